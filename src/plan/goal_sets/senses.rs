//! What a planner is told: whether a plan is wanted, whether the motor is busy, what holds, and the goal.

use super::wiring::{Group, Wiring};
use crate::sim::{In, Scope, Vector};

/// Sums that take what comes from outside.
pub(super) struct Senses {
    pub ready: Group,
    pub busy: Group,
    pub holds: Group,
    pub goal: Group,
}

impl Senses {
    pub fn new(w: &mut Wiring<'_, '_>, fluents: usize) -> Self {
        Self {
            ready: w.sum("ready", 1),
            busy: w.sum("busy", 1),
            holds: w.sum("holds", fluents),
            goal: w.sum("goal", fluents),
        }
    }

    /// Exposes the inputs, in the order of the fields.
    pub fn inputs(&self, scope: &mut Scope<'_>) -> [In<Vector>; 4] {
        [("ready", &self.ready), ("busy", &self.busy), ("holds", &self.holds), ("goal", &self.goal)]
            .map(|(name, group)| scope.input(name, group.input.clone()))
    }
}
