//! Ids of states and actions: places in one domain's tables, which no other number can be mistaken for.

use serde::{Deserialize, Serialize};

/// A state of a domain. Two domains number their states independently.
///
/// [`Domain::state`](super::Domain::state) finds it by name, and `domain[id]` is the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StateId(usize);

/// An action of a domain: one of its operators. Two domains number their actions independently.
///
/// [`Domain::action`](super::Domain::action) finds it by name, and `domain[id]` is the operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ActionId(usize);

impl StateId {
    /// The state at this place of the domain's table, for building operators in code.
    /// [`Domain::new`](super::Domain::new) checks that the place exists.
    pub const fn new(index: usize) -> Self {
        Self(index)
    }

    /// The state's place in the domain's table, from 0.
    pub const fn index(self) -> usize {
        self.0
    }
}

impl ActionId {
    /// The action at this place of the domain's table.
    pub const fn new(index: usize) -> Self {
        Self(index)
    }

    /// The action's place in the domain's table, from 0.
    pub const fn index(self) -> usize {
        self.0
    }
}
