//! Planning with a graph of semantic-pointer modules, stepped in simulated time.
//!
//! [`PlanningGraph`] is the graph as a module, to be connected to whatever world there is;
//! [`Planner`] is one built and made ready to be asked.

mod alternatives;
mod ask;
pub(crate) mod encode;
mod executive;
mod graph;
mod parts;
mod recall;
mod rollout;
mod views;
mod walk;
mod watch;

pub use ask::{Decision, Milestone, Planner, Stage};
pub use encode::{
    ABSENT, ActionSpace, Encoded, NOTHING, PRECONDITION, StateSpace, deep_preconditions,
};
#[cfg(feature = "physics")]
pub(crate) use executive::TRACE;
pub use executive::Timing;
pub use graph::{Part, PlannerSpec, PlanningGraph, PlanningPorts, Unbinding};
pub use rollout::{PlanEnd, PlannedStep, RolledOut};
pub use views::{ModuleView, Shows};
pub use watch::{Choice, Why};
