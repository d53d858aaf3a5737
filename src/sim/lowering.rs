//! Layers that are described now and become nodes when the graph is built.
//!
//! The engine knows what is requested and what comes out; a [`Lowering`] decides what each becomes.

use std::any::Any;

use super::node::Node;
use super::port::PortDecl;
use super::seed::Seed;
use super::time::Timebase;

/// A layer that a module asked for without saying how it is to be computed.
///
/// Its ports are fixed here and are the same in every mode, so a graph's wiring, delays and seeds
/// do not depend on the mode.
pub trait LayerRequest: Any + Send + Sync {
    /// The ports of the layer, whatever it becomes. State and scratch are ignored.
    fn declare(&self, ports: &mut PortDecl);
}

/// A request with the place that it was made from.
pub struct PendingLayer<'a> {
    /// The layer's full path.
    pub path: &'a str,
    /// What was asked for; the lowering knows its concrete types.
    pub request: &'a dyn LayerRequest,
    /// The build seed at this path.
    pub seed: Seed,
}

/// Why a request could not become a node, or a plan does not fit the graph.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoweringFault {
    /// The request's path, or the pattern that matches nothing.
    pub path: String,
    /// What is wrong.
    pub reason: String,
    /// What could stand there instead.
    pub choices: Vec<String>,
}

/// Turns every requested layer of a graph into a node.
pub trait Lowering {
    /// One node for each request, in their order, with the ports that the request declares.
    ///
    /// # Errors
    /// All faults together.
    fn lower(
        &self,
        layers: &[PendingLayer<'_>],
        time: Timebase,
    ) -> Result<Vec<Box<dyn Node>>, Vec<LoweringFault>>;
}
