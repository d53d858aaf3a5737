//! Layers: requests that become nodes when the graph is built.
//!
//! A module requests a layer, and a [`Lowering`] decides which node computes it. The engine knows only the request and
//! the resulting node.

use std::any::Any;

use super::node::Node;
use super::port::PortDecl;
use crate::sim::place::ranks::Ranks;
use crate::sim::seed::Seed;
use crate::sim::time::Timebase;

/// A request for a layer. It does not say how the layer is computed.
///
/// The request fixes the layer's ports. They are the same in direct, rate and spiking mode, so the connections,
/// delays and seeds of a graph do not depend on the mode.
pub trait LayerRequest: Any + Send + Sync {
    /// Declares the ports of the layer. State and scratch are ignored.
    fn declare(&self, ports: &mut PortDecl);
}

/// A request for a layer, with its path and seed.
pub struct PendingLayer<'a> {
    /// The layer's full path.
    pub path: &'a str,
    /// The request. A lowering can downcast it to the request types that it knows.
    pub request: &'a dyn LayerRequest,
    /// Seed of the layer, derived from the build seed and the path.
    pub seed: Seed,
}

/// A request that could not become a node, or a plan that does not fit the graph.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoweringFault {
    /// The path of the request, or the pattern that matches no layer.
    pub path: String,
    /// Reason for the fault.
    pub reason: String,
    /// Valid choices.
    pub choices: Vec<String>,
}

/// Turns the requested layers of a graph into nodes.
pub trait Lowering {
    /// Returns one node for each request, in the order of `layers`. Each node must have the ports that its request
    /// declares.
    ///
    /// # Errors
    /// All faults, together.
    fn lower(
        &self,
        layers: &[PendingLayer<'_>],
        time: Timebase,
    ) -> Result<Vec<Box<dyn Node>>, Vec<LoweringFault>>;

    /// Returns the rank of this process, if several processes run the graph. The parts of the nodes then name the
    /// processes that compute them.
    fn ranks(&self) -> Option<&Ranks> {
        None
    }
}
