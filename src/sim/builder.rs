//! Describing a graph: adding modules and nodes, connecting ports, placing probes.

use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::check;
use super::draft::{Body, Draft, EdgeDraft, NodeDraft, ProbeDraft};
use super::error::{BuildError, BuildErrors};
use super::graph::Graph;
use super::handle::{In, NodePorts, Out, PortRef};
use super::kind::Kind;
use super::lowering::{LayerRequest, Lowering};
use super::node::Node;
use super::port::PortDecl;
use super::probe::{ProbeId, ProbeSpec};
use super::seed::Seed;
use super::synapse::Synapse;
use super::time::Timebase;
use super::world::WorldLink;

/// Tells builders apart, so that a handle of one is refused by another. It numbers builders within
/// the process and enters no result.
static NEXT_BUILDER: AtomicU64 = AtomicU64::new(0);

/// A part of a graph that is itself made of parts.
///
/// A module is a plain description; [`expand`](Module::expand) writes its nodes and inner edges
/// into a scope and hands out its ports.
pub trait Module {
    /// The handles by which the module is connected.
    type Ports;

    /// Adds the module's nodes to `scope`. Faults are noted there, never returned.
    fn expand(self, scope: &mut Scope<'_>) -> Self::Ports;
}

/// The number of an edge, in the order of connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EdgeId(pub usize);

/// The description of a graph. [`build`](GraphBuilder::build) consumes it.
///
/// Adding, connecting and probing never fail: faults are noted, and `build` returns them all.
///
/// ```
/// use symbolt::prelude::*;
///
/// let mut graph = GraphBuilder::new();
/// let one = graph.add("one", Constant::vector(&[1.0, 2.0]));
/// let sum = graph.add("sum", Add::vector(2));
/// graph.connect(&one, &sum.input, Synapse::None);
/// let probe = graph.probe(&sum.output, ProbeSpec::default());
///
/// let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
/// let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
/// sim.run_for(SimDuration::from_millis(3))?;
/// assert_eq!(sim.samples(&probe).last(), Some((0.003, &[1.0, 2.0][..])));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct GraphBuilder {
    draft: Draft,
}

impl Default for GraphBuilder {
    fn default() -> Self {
        Self::new()
    }
}

impl GraphBuilder {
    /// An empty description.
    pub fn new() -> Self {
        let builder = NEXT_BUILDER.fetch_add(1, Ordering::Relaxed);
        Self { draft: Draft { builder, ..Draft::default() } }
    }

    /// Adds a module under `name` and returns its ports.
    pub fn add<M: Module>(&mut self, name: &str, module: M) -> M::Ports {
        self.root().add(name, module)
    }

    /// Adds a single node under `name`.
    pub fn node(&mut self, name: &str, node: impl Node + 'static) -> NodePorts {
        self.root().node(name, node)
    }

    /// Adds the link to the world (at most one a graph).
    pub fn world(&mut self, name: &str, link: WorldLink) -> NodePorts {
        self.root().world(name, link)
    }

    /// Connects two ports of one kind.
    ///
    /// A number fits where a number is wanted:
    ///
    /// ```
    /// use symbolt::prelude::*;
    /// let mut graph = GraphBuilder::new();
    /// let one = graph.add("one", Constant::scalar(1.0));
    /// let sum = graph.add("sum", Add::scalar());
    /// graph.connect(&one, &sum.input, Synapse::None);
    /// ```
    ///
    /// A vector does not (and neither does a pointer of another vocabulary):
    ///
    /// ```compile_fail
    /// use symbolt::prelude::*;
    /// let mut graph = GraphBuilder::new();
    /// let one = graph.add("one", Constant::vector(&[1.0]));
    /// let sum = graph.add("sum", Add::scalar());
    /// graph.connect(&one, &sum.input, Synapse::None);
    /// ```
    pub fn connect<K: Kind>(&mut self, from: &Out<K>, to: &In<K>, via: Synapse) -> EdgeId {
        let from = self.resolve(&from.port, "output");
        let to = self.resolve(&to.port, "input");
        if let (Some(from), Some(to)) = (from, to) {
            self.draft.edges.push(EdgeDraft { from, to, via });
        }
        EdgeId(self.draft.edges.len().saturating_sub(1))
    }

    /// Records an output while the graph runs.
    pub fn probe<K: Kind>(&mut self, of: &Out<K>, spec: ProbeSpec) -> ProbeId<K> {
        let index = self.draft.probes.len();
        if let Some(of) = self.resolve(&of.port, "output") {
            self.draft.probes.push(ProbeDraft { of, spec });
        }
        ProbeId { index, builder: self.draft.builder, kind: PhantomData }
    }

    /// Checks the description, turns requested layers into nodes by `plan`, and freezes the graph.
    ///
    /// `seed` is the build seed: who the neurons and pointers are. Noise has a seed of its own,
    /// given with the run. Costs O(nodes log nodes + edges) beside what `plan` does.
    ///
    /// # Errors
    /// Every fault of the description, together.
    pub fn build(
        self,
        time: Timebase,
        plan: &dyn Lowering,
        seed: Seed,
    ) -> Result<Graph, BuildErrors> {
        check::freeze(self.draft, time, plan, seed)
    }

    fn root(&mut self) -> Scope<'_> {
        Scope { builder: self, path: String::new() }
    }

    fn resolve(&mut self, port: &PortRef, direction: &'static str) -> Option<(usize, usize)> {
        match port {
            PortRef::Known { builder, node, port } if *builder == self.draft.builder => {
                Some((*node, *port))
            }
            PortRef::Known { node, port, .. } => {
                let port = format!("node {node}, port {port}");
                self.draft.faults.push(BuildError::ForeignHandle { direction, port });
                None
            }
            PortRef::Unknown { node, port, kind, choices } => {
                self.draft.faults.push(BuildError::UnknownPort {
                    node: node.clone(),
                    direction,
                    port: port.clone(),
                    kind: kind.clone(),
                    choices: choices.clone(),
                });
                None
            }
        }
    }
}

/// A place in the tree of paths to which a module adds its parts.
pub struct Scope<'a> {
    builder: &'a mut GraphBuilder,
    path: String,
}

impl Scope<'_> {
    /// Adds a module inside this scope.
    pub fn add<M: Module>(&mut self, name: &str, module: M) -> M::Ports {
        let path = self.child(name);
        module.expand(&mut Scope { builder: self.builder, path })
    }

    /// Adds a single node inside this scope.
    pub fn node(&mut self, name: &str, node: impl Node + 'static) -> NodePorts {
        let mut ports = PortDecl::default();
        node.declare(&mut ports);
        self.push(name, Body::Node(Box::new(node)), ports)
    }

    /// Adds a single node at the scope's own path, for modules that are one node.
    pub fn leaf(&mut self, node: impl Node + 'static) -> NodePorts {
        let mut ports = PortDecl::default();
        node.declare(&mut ports);
        self.push_at(self.path.clone(), Body::Node(Box::new(node)), ports)
    }

    /// Asks for a layer that the plan turns into a node when the graph is built.
    pub fn layer(&mut self, name: &str, request: impl LayerRequest) -> NodePorts {
        let mut ports = PortDecl::default();
        request.declare(&mut ports);
        self.push(name, Body::Layer(Box::new(request)), ports)
    }

    /// Adds the link to the world.
    pub fn world(&mut self, name: &str, link: WorldLink) -> NodePorts {
        let mut ports = PortDecl::default();
        link.declare(&mut ports);
        self.push(name, Body::World(link), ports)
    }

    /// Connects two ports of one kind.
    pub fn connect<K: Kind>(&mut self, from: &Out<K>, to: &In<K>, via: Synapse) -> EdgeId {
        self.builder.connect(from, to, via)
    }

    /// Records an output while the graph runs.
    pub fn probe<K: Kind>(&mut self, of: &Out<K>, spec: ProbeSpec) -> ProbeId<K> {
        self.builder.probe(of, spec)
    }

    /// Notes that the module cannot be built as described; `build` reports it under this path.
    pub fn refuse(&mut self, reason: impl Into<String>) {
        self.builder
            .draft
            .faults
            .push(BuildError::Refused { node: self.path.clone(), reason: reason.into() });
    }

    /// The path of this scope, empty at the root.
    pub fn path(&self) -> &str {
        &self.path
    }

    fn child(&mut self, name: &str) -> String {
        let good = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
        if name.is_empty() || !name.chars().all(good) {
            self.builder
                .draft
                .faults
                .push(BuildError::BadName { parent: self.path.clone(), name: name.into() });
        }
        if self.path.is_empty() { name.into() } else { format!("{}/{name}", self.path) }
    }

    fn push(&mut self, name: &str, body: Body, ports: PortDecl) -> NodePorts {
        let path = self.child(name);
        self.push_at(path, body, ports)
    }

    fn push_at(&mut self, path: String, body: Body, ports: PortDecl) -> NodePorts {
        let node = self.builder.draft.nodes.len();
        let handle = NodePorts {
            builder: self.builder.draft.builder,
            node,
            path: path.clone(),
            inputs: ports
                .inputs
                .iter()
                .map(|p| (p.name.clone(), p.kind, p.kind_label.clone()))
                .collect::<Arc<[_]>>(),
            outputs: ports
                .outputs
                .iter()
                .map(|p| (p.name.clone(), p.kind, p.kind_label.clone()))
                .collect::<Arc<[_]>>(),
        };
        self.builder.draft.nodes.push(NodeDraft { path, body, ports });
        handle
    }
}
