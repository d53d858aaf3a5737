//! Processes: nodes that are made when a graph is built.

use super::node::Node;
use super::port::PortDecl;
use crate::sim::seed::Seed;
use crate::sim::time::Timebase;

/// A description that becomes a [`Node`] when the graph is built, for nodes that need the length of a tick or the build
/// seed in advance: filters, tables, signals drawn once. A module adds it with [`Scope::process`](crate::sim::Scope::process).
pub trait Process: Send + Sync + 'static {
    /// Declares the ports of the node. State and scratch are ignored; the node declares its own.
    fn declare(&self, ports: &mut PortDecl);

    /// Makes the node, with the same ports. `seed` derives from the build seed and the path of the node.
    ///
    /// # Errors
    /// The reason, in one sentence. `build` reports it with the path of the node.
    fn make(&self, time: Timebase, seed: Seed) -> Result<Box<dyn Node>, String>;
}
