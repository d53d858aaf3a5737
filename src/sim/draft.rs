//! A description as plain data: filled by the builder, checked, then laid out.

use super::error::BuildError;
use super::lowering::LayerRequest;
use super::node::Node;
use super::port::PortDecl;
use super::probe::ProbeSpec;
use super::synapse::Synapse;
use super::world::WorldLink;

/// All that was added to a builder, in the order of adding.
#[derive(Default)]
pub(crate) struct Draft {
    /// The number of the builder, by which its handles are known.
    pub builder: u64,
    pub nodes: Vec<NodeDraft>,
    pub edges: Vec<EdgeDraft>,
    pub probes: Vec<ProbeDraft>,
    pub faults: Vec<BuildError>,
}

/// What stands at a path.
pub(crate) enum Body {
    Node(Box<dyn Node>),
    Layer(Box<dyn LayerRequest>),
    World(WorldLink),
}

/// A node as it was added.
pub(crate) struct NodeDraft {
    pub path: String,
    pub body: Body,
    pub ports: PortDecl,
}

/// An edge between an output and an input, each given by node and port.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EdgeDraft {
    pub from: (usize, usize),
    pub to: (usize, usize),
    pub via: Synapse,
}

/// A probe on an output, given by node and port.
pub(crate) struct ProbeDraft {
    pub of: (usize, usize),
    pub spec: ProbeSpec,
}
