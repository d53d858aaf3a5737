//! The planner of the paper: a chain of memories, unbinding and cleanup that finds the next action of a plan.

pub(super) mod alternatives;
pub(super) mod ask;
pub(crate) mod encode;
pub(super) mod executive;
pub(super) mod graph;
pub(super) mod recall;
pub(super) mod views;
pub(super) mod walk;
pub(super) mod watch;
mod words;
