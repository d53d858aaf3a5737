//! A graph's description as plain data. The builder fills the description; `check` and `layout` turn it into a graph.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::panic::Location;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::lowering::LayerRequest;
use super::node::Node;
use super::port::PortDecl;
use super::probe_spec::ProbeSpec;
use super::process::Process;
use super::synapse::Synapse;
use crate::sim::error::BuildError;

/// Everything added to a builder, in the order of addition.
#[derive(Clone, Default)]
pub(crate) struct Draft {
    /// The builder's number. Every handle of this builder carries it.
    pub builder: u64,
    /// Line of the program that added each path.
    pub added: HashMap<String, &'static Location<'static>>,
    /// Line of the program that added the node at each scope's own path, with [`Scope::leaf`](crate::sim::Scope::leaf).
    pub leaves: HashMap<String, &'static Location<'static>>,
    pub nodes: Vec<NodeDraft>,
    pub edges: Vec<Edge>,
    /// Inputs connected to a faulty output. The fault of the output is reported, so these inputs do not count as
    /// unconnected.
    pub excused: Vec<(usize, usize)>,
    pub probes: Vec<ProbeDraft>,
    /// What paths are called for people.
    pub notes: BTreeMap<String, Note>,
    /// The paths among them that have to be there.
    pub described: BTreeSet<String>,
    /// Layers whose spikes are recorded, by node index.
    pub spike_probes: Vec<usize>,
    pub faults: Vec<BuildError>,
}

/// The body of a described node: a finished node, a process that is made when the graph is built, a layer that the plan
/// turns into a node, or the link to the world.
/// The graphs of one description share it.
#[derive(Clone)]
pub(crate) enum Body {
    Node(Arc<dyn Node>),
    Process(Arc<dyn Process>),
    Layer(Arc<dyn LayerRequest>),
    World(Arc<dyn Node>),
}

/// What a module is called for people, and what it does ([`Scope::describe`](crate::sim::Scope::describe)).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Note {
    /// Its name for people, such as `facts in the way`.
    pub name: String,
    /// A sentence on what it does.
    pub meaning: String,
}

/// A node of a description.
#[derive(Clone)]
pub(crate) struct NodeDraft {
    pub path: String,
    pub body: Body,
    pub ports: PortDecl,
}

/// A connection from an output to an input. Both ends are (node, port) indices.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    pub from: (usize, usize),
    pub to: (usize, usize),
    pub via: Synapse,
}

/// A probe on the output with the (node, port) indices `of`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ProbeDraft {
    pub of: (usize, usize),
    pub spec: ProbeSpec,
}
