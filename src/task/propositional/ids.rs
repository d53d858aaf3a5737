//! Ids of states and actions: typed indices into the tables of one domain.

use serde::{Deserialize, Serialize};

/// The id of a state, valid for one domain.
///
/// [`Domain::state`](super::Domain::state) finds the id by name. `domain[id]` returns the [`State`](super::State).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StateId(usize);

/// The id of an action, valid for one domain.
///
/// [`Domain::action`](super::Domain::action) finds the id by name. `domain[id]` returns the
/// [`Operator`](super::Operator).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ActionId(usize);

impl StateId {
    /// Returns the id of the state at `index` in the domain's table, for building operators in code.
    /// [`Domain::new`](super::Domain::new) checks that the index exists.
    pub const fn new(index: usize) -> Self {
        Self(index)
    }

    /// Returns the state's index in the domain's table, from 0.
    pub const fn index(self) -> usize {
        self.0
    }
}

impl ActionId {
    /// Returns the id of the action at `index` in the domain's table.
    pub const fn new(index: usize) -> Self {
        Self(index)
    }

    /// Returns the action's index in the domain's table, from 0.
    pub const fn index(self) -> usize {
        self.0
    }
}
