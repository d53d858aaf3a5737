//! Preconditions and effects of an action, from counts over the world states before and after its instances.

use crate::task::propositional::{StateId, WorldState};

/// The counts behind an operator, over all demonstrated instances of its action. Each list has one entry for each
/// state, in the order of the domain's states.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Evidence {
    /// Number of instances.
    pub instances: u32,
    /// For each state, the number of instances in which it held before the action: `sum G` (section II.E of the paper).
    pub before: Vec<u32>,
    /// For each state, the number of instances in which it began to hold, minus the number in which it ceased to hold:
    /// `sum (H - G)` (section II.E).
    pub change: Vec<i32>,
}

/// One demonstrated instance of an action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Instance {
    /// World state before the action: `G` in the paper.
    pub before: WorldState,
    /// World state after the action: `H` in the paper.
    pub after: WorldState,
}

impl Evidence {
    /// Counts the states before and after all instances of an action.
    ///
    /// # Panics
    /// If the world states do not all have the same number of states.
    pub fn count<'a>(instances: impl IntoIterator<Item = &'a Instance>) -> Self {
        let mut evidence = Self::default();
        for Instance { before, after } in instances {
            assert_eq!(before.states(), after.states(), "world states of one domain");
            if evidence.instances == 0 {
                evidence.before = vec![0; before.states()];
                evidence.change = vec![0; before.states()];
            }
            assert_eq!(evidence.before.len(), before.states(), "world states of one domain");
            evidence.instances += 1;
            for (state, (g, h)) in before.flags().iter().zip(after.flags()).enumerate() {
                evidence.before[state] += u32::from(*g);
                evidence.change[state] += i32::from(*h) - i32::from(*g);
            }
        }
        evidence
    }

    /// Returns the preconditions: the states that held most often before the action, `argmax sum G` (section II.E of
    /// the paper). Ties give several states. Empty if no state ever held before.
    pub fn preconditions(&self) -> Vec<StateId> {
        let most = self.before.iter().copied().max().unwrap_or(0);
        if most == 0 {
            return Vec::new();
        }
        (0..self.before.len()).filter(|s| self.before[*s] == most).map(StateId::new).collect()
    }

    /// Returns the effects: the states that began to hold most often, `argmax sum (H - G)` (section II.E of the paper).
    /// Ties give several states. Empty if no state began to hold more often than it ceased to hold.
    pub fn effects(&self) -> Vec<StateId> {
        let most = self.change.iter().copied().max().unwrap_or(0);
        if most <= 0 {
            return Vec::new();
        }
        (0..self.change.len()).filter(|s| self.change[*s] == most).map(StateId::new).collect()
    }

    /// Returns the states that never held before the action. A planner may require them to be absent. With few
    /// instances, a state can be absent by coincidence.
    pub fn absent(&self) -> Vec<StateId> {
        (0..self.before.len()).filter(|s| self.before[*s] == 0).map(StateId::new).collect()
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/learn_operators.rs"]
mod tests;
