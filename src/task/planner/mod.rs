//! Planners over a domain: they decide the next action towards a goal in simulated time.
//!
//! There are two, behind the trait [`Decider`]. A [`GoalSetPlanner`] is the one that drives the robot by default: it plans
//! with whole goal sets, in neurons alone ([`goal_sets`](crate::plan::goal_sets)). A [`Planner`] is that of the paper: it
//! asks about one state after another with semantic-pointer modules, and its control is a program. It is described here.
//!
//! | to | use |
//! |---|---|
//! | build either planner | [`PlannerBuild`] |
//! | plan in a scene with a learned domain | [`PlannerBuild::plan`], which returns a [`ScenePlan`] |
//! | plan to the end in other predicted situations | [`Decider::roll_out`] with a [`Prediction`] |
//! | ask the paper's planner for decisions in code | [`Planner`] |
//! | connect the graph to your own world | [`PlanningGraph`], with its ports [`PlanningPorts`] |
//! | set dimensions, rules and waits | [`PlannerSpec`] and [`Timing`] |
//! | read an answer | [`Decision`], with its [`Milestone`]s and [`Choice`]s |
//! | look at modules while they run | [`ModuleView`] |
//! | get a domain's semantic pointers | [`Encoded`] |
//!
//! # The modules
//!
//! | module | function |
//! |---|---|
//! | `goal` | a cleanup memory; recognises the goal that the world sends |
//! | `goal_buffer` | holds the pointer of the examined state |
//! | `cause` | an associative memory from a state to the action that causes it |
//! | `alternatives` | a contest of utilities among the causes of a state; only for states with several causes |
//! | `deep` | an associative memory from an action to its deep pointer, `PRECONDITION * (A + B + ...)` |
//! | `unbind`, `required` | unbinding and a cleanup memory; together they give the action's preconditions |
//! | `open`, `chosen` | the unmet preconditions, and one of them |
//! | `motor_gate`, `motor` | pass the action to the output once the decision is made |
//! | `executive` | the planner's control: opens gates and draws conclusions |
//!
//! # One decision
//!
//! A decision is a series of questions. Each question examines one state and asks which action causes it. The first
//! question examines the goal.
//!
//! 1. The world sets `ready` to 1. If the goal holds, the verdict is [`Met`](crate::task::Verdict::Met).
//! 2. The executive loads the examined state into the goal buffer (milestone [`Goal`](Stage::Goal)).
//! 3. The graph recalls the action that causes this state (milestone [`Action`](Stage::Action)).
//! 4. It unbinds and cleans up the action's preconditions (milestone
//!    [`Preconditions`](Stage::Preconditions)).
//! 5. It removes the preconditions that hold or are known to be reachable, and chooses one of the rest
//!    (milestone [`Comparison`](Stage::Comparison)).
//! 6. The executive draws its conclusion (milestone [`Conclusion`](Stage::Conclusion)). If a precondition is unmet, the
//!    next question examines it. If no precondition is unmet, the state is reachable, and the executive returns to the
//!    state before it.
//! 7. If the recalled action turns out to be impossible, the executive tries another cause of the state. If no cause is
//!    left, the verdict is [`Stuck`](crate::task::Verdict::Stuck) with the reason.
//! 8. Once the goal is known to be reachable, the executive recalls the first action that was found possible and opens
//!    the motor gate for it: the verdict is [`Act`](crate::task::Verdict::Act). With
//!    [`Commitment::First`](crate::task::Commitment::First) the executive does not wait until the goal is known to be
//!    reachable.
//!
//! The last milestone of every decision is [`Decision`](Stage::Decision), the time at which the verdict is at
//! the graph's outputs.
//!
//! A state is *reachable* if it holds, or if an action causes it and all preconditions of that action are
//! reachable. This ignores that actions can also end states; the robot notices an ended state when it
//! re-plans.

mod apart;
mod board;
mod build;
mod chain;
mod decider;
mod decision;
mod goal_sets;
mod rollout;
mod scene;

pub use build::{PlannerBuild, PlannerKind};
pub use chain::ask::Planner;
pub use chain::encode::{
    ABSENT, ActionSpace, Encoded, NOTHING, PRECONDITION, StateSpace, deep_preconditions,
};
pub use chain::executive::Timing;
pub use chain::graph::{Part, PlannerSpec, PlanningGraph, PlanningPorts, Unbinding};
pub use chain::views::{ModuleView, Shows};
pub use decider::{Decider, PlannerInput, Request};
pub use decision::{Choice, Decision, Milestone, Stage, Why};
pub use goal_sets::{GoalSetPlanner, strips_problem};
pub use rollout::{Counts, PlanEnd, PlannedStep, Prediction, RolledOut};
pub use scene::{SceneEnd, SceneMove, ScenePlan};
