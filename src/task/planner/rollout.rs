//! Whole plans: asks a planner repeatedly, in situations predicted from the operators.

use super::decision::Decision;
use crate::sim::SimDuration;
use crate::task::error::TaskError;
use crate::task::propositional::{ActionId, Domain, Obstacle, StateId, Verdict, WorldState};

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
    /// The predicted situations repeat.
    Circle,
    /// Nothing in the situation can carry out this action.
    Impossible(ActionId),
}

/// A predicted plan. The robot re-plans after every step, so only the first step is a commitment.
#[derive(Debug, Clone, PartialEq)]
pub struct RolledOut {
    /// Steps of the plan, in order.
    pub steps: Vec<PlannedStep>,
    /// How the plan ends.
    pub end: PlanEnd,
    /// The last decision; `None` if the goal is met and nothing was asked.
    pub last: Option<Decision>,
}

/// A situation that changes as the operators predict.
pub trait Prediction {
    /// Returns the states that hold.
    fn present(&self) -> WorldState;

    /// Returns all goals.
    fn goals(&self) -> &[StateId];

    /// Returns the first goal to ask for; `None` if there is nothing left to ask.
    fn goal(&self) -> Option<StateId>;

    /// Lets an action have its effects. Returns why the plan ends with this action, if it does.
    fn act(&mut self, action: ActionId) -> Option<PlanEnd>;
}

/// Objects of a [`Domain`] without relations: only how many are in each state is known.
///
/// An action is predicted to move one object from the operator's `from` state, if it has one, to its `to` state, and to
/// have the operator's other effects.
#[derive(Debug, Clone)]
pub struct Counts<'d> {
    domain: &'d Domain,
    counts: Vec<usize>,
    goal: [StateId; 1],
    seen: Vec<Vec<usize>>,
    /// A plan without detours moves each object into each state at most once.
    left: usize,
}

impl<'d> Counts<'d> {
    /// Makes the situation from the number of objects in each state, as
    /// [`Domain::counts`](crate::task::propositional::Domain::counts) returns it. A planner refuses counts of another number of
    /// states.
    pub fn new(domain: &'d Domain, objects: &[usize], goal: StateId) -> Self {
        let left = (objects.iter().sum::<usize>() + 1) * (objects.len() + 1);
        let (counts, goal) = (objects.to_vec(), [goal]);
        Self { domain, seen: vec![counts.clone()], counts, goal, left }
    }
}

impl Prediction for Counts<'_> {
    fn present(&self) -> WorldState {
        self.counts.iter().map(|count| *count > 0).collect()
    }

    fn goals(&self) -> &[StateId] {
        &self.goal
    }

    fn goal(&self) -> Option<StateId> {
        Some(self.goal[0])
    }

    fn act(&mut self, action: ActionId) -> Option<PlanEnd> {
        let (operator, counts) = (&self.domain[action], &mut self.counts);
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
        self.left = self.left.saturating_sub(1);
        if self.left == 0 || self.seen.contains(counts) {
            return Some(PlanEnd::Circle);
        }
        self.seen.push(counts.clone());
        None
    }
}

/// Plans to the end: decides towards the first goal in the situation that is predicted, lets the action have its effects, and
/// decides again.
pub(super) fn roll_out(
    prediction: &mut dyn Prediction,
    mut decide: impl FnMut(&WorldState, StateId) -> Result<Decision, TaskError>,
) -> Result<RolledOut, TaskError> {
    let (mut steps, mut last) = (Vec::new(), None);
    while let Some(goal) = prediction.goal() {
        let decision = decide(&prediction.present(), goal)?;
        let end = match decision.verdict {
            Verdict::Met => Some(PlanEnd::Met),
            Verdict::Stuck(obstacle) => Some(PlanEnd::Stuck(obstacle)),
            Verdict::Act(action) => {
                let end = prediction.act(action);
                if !matches!(end, Some(PlanEnd::Impossible(_))) {
                    steps.push(PlannedStep { action, decision: decision.clone() });
                }
                end
            }
        };
        last = Some(decision);
        if let Some(end) = end {
            return Ok(RolledOut { steps, end, last });
        }
    }
    Ok(RolledOut { steps, end: PlanEnd::Met, last })
}

/// Longest simulated time of one decision of a plan, unless another is given.
pub(super) const LIMIT: SimDuration = SimDuration::from_millis(10_000);
