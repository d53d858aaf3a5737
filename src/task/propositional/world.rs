//! The world state: the set of states that hold at one moment.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::ids::StateId;

/// The set of states that hold at one moment: the *global state vector* of the paper (section II.E).
///
/// It has one flag for each state of its domain. A state holds if at least one object is in it.
///
/// ```
/// use symbolt::task::DomainBuilder;
/// let domain = DomainBuilder::of_the_paper().build()?;
/// let world = domain.world(["NUT_ON_TABLE", "BOLT_IN_JIG"])?;
/// assert!(world.holds(domain.state("NUT_ON_TABLE")?));
/// assert_eq!(world.len(), 2);
/// # Ok::<(), symbolt::task::TaskError>(())
/// ```
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct WorldState {
    holds: Vec<bool>,
}

impl WorldState {
    /// Returns a world state over `states` states, none of which holds.
    pub fn empty(states: usize) -> Self {
        Self { holds: vec![false; states] }
    }

    /// Returns the number of states of the domain, whether or not they hold.
    pub fn states(&self) -> usize {
        self.holds.len()
    }

    /// Returns whether `state` holds; `false` if it is out of range.
    pub fn holds(&self, state: StateId) -> bool {
        self.holds.get(state.index()).copied().unwrap_or(false)
    }

    /// Adds `state` to the states that hold.
    ///
    /// # Panics
    /// If `state` is out of range.
    pub fn insert(&mut self, state: StateId) {
        self.holds[state.index()] = true;
    }

    /// Removes `state` from the states that hold.
    ///
    /// # Panics
    /// If `state` is out of range.
    pub fn remove(&mut self, state: StateId) {
        self.holds[state.index()] = false;
    }

    /// Returns the number of states that hold.
    pub fn len(&self) -> usize {
        self.holds.iter().filter(|h| **h).count()
    }

    /// Returns whether no state holds.
    pub fn is_empty(&self) -> bool {
        !self.holds.contains(&true)
    }

    /// Iterates over the states that hold, in the domain's order.
    pub fn iter(&self) -> impl Iterator<Item = StateId> + '_ {
        self.holds.iter().enumerate().filter(|(_, h)| **h).map(|(index, _)| StateId::new(index))
    }

    /// Returns one flag for each state, in the domain's order.
    pub fn flags(&self) -> &[bool] {
        &self.holds
    }
}

/// Builds a world state from one flag for each state, in the domain's order.
impl FromIterator<bool> for WorldState {
    fn from_iter<I: IntoIterator<Item = bool>>(flags: I) -> Self {
        Self { holds: flags.into_iter().collect() }
    }
}

impl fmt::Debug for WorldState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let holds: Vec<usize> = self.iter().map(StateId::index).collect();
        write!(f, "WorldState({holds:?} of {})", self.states())
    }
}
