//! What the executor needs of a planner graph, whichever planner it is.

use std::sync::Arc;

use super::chain::views::ModuleView;
use super::rollout::{Prediction, RolledOut};
use crate::sim::{Graph, Real, SimDuration};
use crate::task::error::TaskError;
use crate::task::propositional::{Domain, StateId, Verdict, WorldState};

/// What the executor wants of a planner graph at the moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Forget the last goal.
    Forget,
    /// Wait: the robot moves, or the executor has not looked again.
    Wait,
    /// Decide.
    Decide,
}

/// The input of a planner graph: the request, what holds, and the goals.
#[derive(Debug, Clone, Copy)]
pub struct PlannerInput<'w> {
    /// What is wanted.
    pub request: Request,
    /// The states that hold, as the executor knows them.
    pub present: &'w WorldState,
    /// States that the planner is to take as holding although they do not.
    pub pretended: &'w [StateId],
    /// The first goal that does not hold.
    pub goal: StateId,
    /// All goals, in the order in which they were completed when they were learned.
    pub goals: &'w [StateId],
}

impl PlannerInput<'_> {
    /// Returns whether the planner is to take a state as holding.
    pub fn holds(&self, state: StateId) -> bool {
        self.present.holds(state) || self.pretended.contains(&state)
    }
}

/// A planner graph over a domain that decides in a world: it senses what holds and what is wanted, and commands actions.
///
/// The graph has one node `world`. [`Planner`](super::Planner) and [`GoalSetPlanner`](super::GoalSetPlanner) are the two
/// planners; [`EpisodeWorld`](crate::task::execute::EpisodeWorld) connects either to a scene.
pub trait Decider: Send + Sync {
    /// Returns the domain.
    fn domain(&self) -> &Domain;

    /// Returns the built graph.
    fn graph(&self) -> &Arc<Graph>;

    /// Returns views of the graph's modules, for reading them while the graph runs.
    fn modules(&self) -> &[ModuleView];

    /// Returns how many numbers the graph senses.
    fn sense_width(&self) -> usize;

    /// Returns how many numbers the graph commands.
    fn command_width(&self) -> usize;

    /// Writes what the graph senses, [`sense_width`](Self::sense_width) numbers.
    fn sense(&self, input: &PlannerInput<'_>, out: &mut [Real]);

    /// Returns the verdict that commands show, if there is one yet.
    fn verdict(&self, command: &[Real], input: &PlannerInput<'_>) -> Option<Verdict>;

    /// Returns whether the planner plans for all goals together. Otherwise it is asked for one after the other, and forgets
    /// each before the next.
    fn plans_for_all_goals(&self) -> bool {
        false
    }

    /// Returns for how many milliseconds this verdict must stay the same before it counts.
    fn steady_ms(&self, verdict: &Verdict) -> u64 {
        let _ = verdict;
        0
    }

    /// Returns the simulated time in milliseconds after which the executor gives up waiting for a verdict; `None` if there
    /// always is one.
    fn patience_ms(&self) -> Option<u64> {
        None
    }

    /// Plans to the end: decides, lets the action have its predicted effects, and decides again. If a search takes longer
    /// than `limit`, the plan ends there ([`Obstacle::NoPlan`](crate::task::Obstacle::NoPlan)).
    ///
    /// # Errors
    /// [`TaskError::Setting`] for a goal or a situation of another domain; [`TaskError::Undecided`] if the graph does not settle.
    fn roll_out(
        &self,
        prediction: &mut dyn Prediction,
        limit: SimDuration,
    ) -> Result<RolledOut, TaskError>;

    /// Refuses a world of another domain.
    ///
    /// # Errors
    /// [`TaskError::Setting`] with the number of its states.
    fn check_world(&self, world: &WorldState) -> Result<(), TaskError> {
        let states = self.domain().states().len();
        if world.states() == states {
            return Ok(());
        }
        let value = format!("over {} states, but the domain has {states}", world.states());
        let expected = "a world state of the planner's own domain";
        Err(TaskError::Setting { name: "world", value, expected })
    }

    /// Refuses a state of another domain.
    ///
    /// # Errors
    /// [`TaskError::Setting`] with the number of the state.
    fn check_goal(&self, goal: StateId) -> Result<(), TaskError> {
        let states = self.domain().states().len();
        if goal.index() < states {
            return Ok(());
        }
        let value =
            format!("state number {} (from 0) of a domain with {states} states", goal.index());
        let expected = "a state of the planner's own domain";
        Err(TaskError::Setting { name: "goal", value, expected })
    }
}
