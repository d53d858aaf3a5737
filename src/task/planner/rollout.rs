//! A whole plan: the planner graph asked again and again, in worlds predicted from the operators.

use super::ask::{Decision, Planner};
use crate::task::domain::{ActionId, Obstacle, StateId, Verdict, WorldState};
use crate::task::error::TaskError;

/// One step of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStep {
    /// The action.
    pub action: ActionId,
    /// How the planner came to it.
    pub decision: Decision,
}

/// How a plan ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanEnd {
    /// The goal is met.
    Met,
    /// It cannot be had.
    Stuck(Obstacle),
    /// The predicted worlds repeat themselves.
    Circle,
}

/// A plan as far as it can be foreseen. The robot re-plans at every step; only the first is a
/// commitment.
#[derive(Debug, Clone, PartialEq)]
pub struct RolledOut {
    /// The steps.
    pub steps: Vec<PlannedStep>,
    /// How it ends.
    pub end: PlanEnd,
    /// The last decision, which found the end.
    pub last: Decision,
}

impl Planner {
    /// Plans from a scene to `goal`, given how many objects are in each state.
    ///
    /// An action is predicted to take one object from the state that it was always taken from to the
    /// state that it is put into, and to have its learned further effects.
    ///
    /// # Errors
    /// As [`Planner::decide`].
    pub fn plan(&self, objects: &[usize], goal: StateId) -> Result<RolledOut, TaskError> {
        let mut counts = objects.to_vec();
        let mut steps: Vec<PlannedStep> = Vec::new();
        let mut seen: Vec<Vec<usize>> = Vec::new();
        // Each object can come into each state once on a way without detours.
        let most = (objects.iter().sum::<usize>() + 1) * (objects.len() + 1);
        loop {
            let world: WorldState = counts.iter().map(|c| *c > 0).collect();
            let decision = self.decide(&world, goal)?;
            let end = match decision.verdict {
                Verdict::Met => Some(PlanEnd::Met),
                Verdict::Stuck(obstacle) => Some(PlanEnd::Stuck(obstacle)),
                Verdict::Act(_) if seen.contains(&counts) || steps.len() >= most => {
                    Some(PlanEnd::Circle)
                }
                Verdict::Act(_) => None,
            };
            if let Some(end) = end {
                return Ok(RolledOut { steps, end, last: decision });
            }
            seen.push(counts.clone());
            if let Verdict::Act(action) = decision.verdict {
                self.predict(&mut counts, action);
                steps.push(PlannedStep { action, decision });
            }
        }
    }

    fn predict(&self, counts: &mut [usize], action: ActionId) {
        let operator = &self.domain()[action];
        let from = operator.from.map(StateId::index);
        if let Some(from) = from {
            counts[from] = counts[from].saturating_sub(1);
        }
        for ended in operator.removes.iter().map(|s| s.index()) {
            if Some(ended) != from {
                counts[ended] = 0;
            }
        }
        let to = operator.to.index();
        counts[to] += 1;
        for effect in operator.effects.iter().map(|s| s.index()) {
            if effect != to {
                counts[effect] = counts[effect].max(1);
            }
        }
    }
}
