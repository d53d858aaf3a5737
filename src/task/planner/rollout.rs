//! Whole plans: asks the planner graph repeatedly, in world states predicted from the operators.

use super::ask::{Decision, Planner};
use crate::task::domain::{ActionId, Obstacle, StateId, Verdict, WorldState};
use crate::task::error::TaskError;

/// One step of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStep {
    /// Action of this step.
    pub action: ActionId,
    /// Decision for this action.
    pub decision: Decision,
}

/// How a plan ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanEnd {
    /// The goal is met.
    Met,
    /// The goal cannot be reached, for this reason.
    Stuck(Obstacle),
    /// The predicted world states repeat.
    Circle,
}

/// A predicted plan. The robot re-plans after every step, so only the first step is a commitment.
#[derive(Debug, Clone, PartialEq)]
pub struct RolledOut {
    /// Steps of the plan, in order.
    pub steps: Vec<PlannedStep>,
    /// How the plan ends.
    pub end: PlanEnd,
    /// The last decision, which determined the end.
    pub last: Decision,
}

impl Planner {
    /// Plans from a scene to `goal`. `objects` gives the number of objects in each state, as
    /// [`Domain::counts`](crate::task::domain::Domain::counts) returns it.
    ///
    /// An action is predicted to move one object from the operator's `from` state, if it has one, to its `to`
    /// state, and to have the operator's other effects.
    ///
    /// # Errors
    /// As [`Planner::decide`].
    pub fn plan(&self, objects: &[usize], goal: StateId) -> Result<RolledOut, TaskError> {
        let mut counts = objects.to_vec();
        let mut steps: Vec<PlannedStep> = Vec::new();
        let mut seen: Vec<Vec<usize>> = Vec::new();
        // A plan without detours moves each object into each state at most once.
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
