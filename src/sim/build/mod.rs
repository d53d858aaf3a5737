//! Builds a graph from its description: checks, the order of nodes, and where every number lies.

pub(super) mod check;
pub(super) mod graph;
pub(super) mod layout;
pub(super) mod outline;
