//! The built graph. It is immutable, and simulators share it. It gives every number of a run a fixed place in the
//! arenas.

use std::any::Any;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Arc;

use crate::sim::describe::draft::{Edge, Note};
use crate::sim::describe::filter::Filter;
use crate::sim::describe::handle::{Out, PortRef};
use crate::sim::describe::io::{OutSlot, Slot};
use crate::sim::describe::kind::Kind;
use crate::sim::describe::node::Node;
use crate::sim::describe::port::{OutputDecl, PortDecl, ScratchSpec};
use crate::sim::describe::probe_spec::Capacity;
use crate::sim::describe::synapse::Synapse;
use crate::sim::error::SimError;
use crate::sim::place::ranks::Ranks;
use crate::sim::real::Span;
use crate::sim::seed::Seed;
use crate::sim::time::Timebase;

/// The values that a filter or probe reads: signals of this tick, or registered outputs that were just written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    Signal(Span),
    Registered(Span),
}

/// A sum of several sources, computed before a node reads it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GatherPlan {
    pub into: Span,
    /// Range in [`Graph::gather_sources`].
    pub sources: Span,
}

/// A low-pass on connections. Most filters are, so their loop knows nothing else.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LowpassPlan {
    pub source: Source,
    pub held: Span,
    pub decay: f32,
}

/// Another filter on connections.
#[derive(Debug, Clone)]
pub(crate) struct FilterPlan {
    pub source: Source,
    /// The state, which begins with the output.
    pub held: Span,
    pub filter: Filter,
}

/// Information about a node that a tick does not need.
pub(crate) struct NodeInfo {
    pub path: String,
    pub ports: PortDecl,
    pub outs: Vec<OutSlot>,
    pub registered: Span,
    pub reals: Span,
    pub words: Span,
    pub longs: Span,
    /// Range in [`Graph::parts`].
    pub parts: Span,
}

/// A part of a node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PartPlan {
    /// Index of the node in [`Graph::divided`].
    pub divided: u32,
    /// Index of the part in its node.
    pub index: u32,
    pub rank: u32,
    pub work: u32,
    /// Range among the states of all parts, as a checkpoint holds them.
    pub state: Span,
    /// Range among the node's units.
    pub units: Span,
    /// Range in the results of all parts: the part's own results, then the events of its units as bits if they are
    /// recorded or sent.
    pub results: Span,
    /// Number of words for events at the end of `results`.
    pub events: u32,
}

impl PartPlan {
    /// Number of the part's own results.
    pub fn own_results(&self) -> usize {
        self.results.len() - self.events as usize
    }
}

/// The data that a tick needs about a node in one phase. Plans are small and stored in the order of use: in a graph of
/// a thousand nodes they make up most of the data that passes through the cache.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PhasePlan {
    pub node: u32,
    /// Range that the node writes in this phase, in the arena of signals or of registered outputs.
    pub own: Span,
    /// Range in [`Graph::outs`].
    pub outs: Span,
    /// Range in [`Graph::slots`].
    pub slots: Span,
    /// Range in [`Graph::gathers`].
    pub gathers: Span,
    /// Whether the node has state: `reals`, `words` or `longs`.
    pub stateful: bool,
    pub reals: Span,
    pub words: Span,
    pub longs: Span,
    /// Sizes of scratch memory: reals, complexes, words.
    pub scratch: [u32; 3],
}

#[derive(Debug, Clone)]
pub(crate) struct ProbePlan {
    pub source: Source,
    pub period_ticks: u64,
    pub filter: Option<Filter>,
    pub state: Span,
    pub capacity: Capacity,
    pub node: usize,
    pub output: usize,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct WorldPlan {
    pub node: usize,
    pub sense: Span,
    /// Range in [`Graph::slots`].
    pub slots: Span,
    /// Range in [`Graph::gathers`].
    pub gathers: Span,
    pub command_width: usize,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Sizes {
    pub signals: usize,
    pub registered: usize,
    pub held: usize,
    pub gathered: usize,
    pub reals: usize,
    pub words: usize,
    pub longs: usize,
    pub probe_filters: usize,
    /// States of all parts.
    pub parts: usize,
    /// Results of all parts.
    pub results: usize,
    pub scratch: ScratchSpec,
}

/// A built graph, ready to run. It is immutable; simulators share it by [`Arc`](std::sync::Arc).
pub struct Graph {
    pub(crate) builder: u64,
    /// The index in `nodes` of each of the builder's nodes.
    pub(crate) handles: Vec<usize>,
    /// In the order in which nodes emit. `bodies`, `emits`, `advances` and `settles` have the same order.
    pub(crate) nodes: Vec<NodeInfo>,
    pub(crate) bodies: Vec<Arc<dyn Node>>,
    pub(crate) emits: Vec<PhasePlan>,
    pub(crate) advances: Vec<PhasePlan>,
    /// The nodes that advance after all others.
    pub(crate) settles: Vec<PhasePlan>,
    /// The nodes with parts.
    pub(crate) divided: Vec<PhasePlan>,
    /// The parts of all nodes, node by node.
    pub(crate) parts: Vec<PartPlan>,
    pub(crate) outs: Vec<OutSlot>,
    pub(crate) slots: Vec<Slot>,
    pub(crate) gathers: Vec<GatherPlan>,
    pub(crate) gather_sources: Vec<Slot>,
    pub(crate) lowpasses: Vec<LowpassPlan>,
    pub(crate) filters: Vec<FilterPlan>,
    pub(crate) probes: Vec<ProbePlan>,
    /// Nodes whose spikes are recorded.
    pub(crate) spike_probes: Vec<usize>,
    pub(crate) world: Option<WorldPlan>,
    pub(crate) edges: Vec<Edge>,
    /// What paths are called for people.
    pub(crate) notes: BTreeMap<String, Note>,
    pub(crate) sizes: Sizes,
    pub(crate) time: Timebase,
    pub(crate) seed: Seed,
    pub(crate) fingerprint: u64,
    /// The process's rank, if several processes run the graph.
    pub(crate) ranks: Option<Ranks>,
}

impl std::fmt::Debug for Graph {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Graph({} nodes, {} edges)", self.nodes.len(), self.edges.len())
    }
}

/// An output found by name, for observers without a typed handle.
#[derive(Debug, Clone, Copy)]
pub struct OutputRef {
    pub(crate) source: Source,
}

/// A node whose units have events, such as a population of spiking neurons.
#[derive(Debug, Clone, Copy)]
pub struct EventSource {
    pub(crate) node: usize,
    /// Number of units.
    pub units: usize,
}

impl Graph {
    /// Returns the clock.
    pub(crate) fn timebase(&self) -> Timebase {
        self.time
    }

    /// Returns the build seed.
    pub fn seed(&self) -> Seed {
        self.seed
    }

    /// Returns the number of nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Returns the number of connections.
    pub fn edge_count(&self) -> usize {
        self.edges.len()
    }

    /// Returns the number of values that the parts of all nodes hand on in a tick ([`Parts`](crate::sim::Parts)). Ranks exchange
    /// them, four bytes each.
    pub fn exchanged_values(&self) -> usize {
        self.parts.iter().map(|part| part.results.len()).sum()
    }

    /// Returns the paths of all nodes, in the order in which they emit.
    pub fn paths(&self) -> impl Iterator<Item = &str> {
        self.nodes.iter().map(|n| n.path.as_str())
    }

    /// Returns all nodes with their paths, in the order in which they emit. Callers that know the type of a node can
    /// downcast the node.
    pub fn nodes(&self) -> impl Iterator<Item = (&str, &dyn Any)> {
        let bodies = self.bodies.iter().map(|body| &**body as &dyn Any);
        self.paths().zip(bodies)
    }

    /// Returns the nodes whose units have events, with their paths, in the order in which they emit.
    pub fn event_sources(&self) -> impl Iterator<Item = (&str, EventSource)> {
        self.paths().zip(&self.bodies).enumerate().filter_map(|(node, (path, body))| {
            let units = body.units();
            (units > 0).then_some((path, EventSource { node, units }))
        })
    }

    /// Returns what the module at `path` is called for people, or else the nearest one around it. `None` if none of them was
    /// described ([`Scope::describe`](crate::sim::Scope::describe)).
    pub fn note(&self, path: &str) -> Option<&Note> {
        let above =
            std::iter::successors(Some(path), |path| path.rsplit_once('/').map(|(at, _)| at));
        above.into_iter().find_map(|path| self.notes.get(path))
    }

    /// As [`note`](Self::note), for the module that an output belongs to.
    pub(crate) fn note_of<K: Kind>(&self, out: &Out<K>) -> Option<&Note> {
        match &out.port {
            PortRef::Known { builder, node, .. } if *builder == self.builder => {
                self.note(&self.nodes[*self.handles.get(*node)?].path)
            }
            _ => None,
        }
    }

    /// Returns the names of all outputs as `path.port`, node by node in the order in which nodes emit.
    pub fn outputs(&self) -> impl Iterator<Item = String> + '_ {
        self.nodes
            .iter()
            .flat_map(|n| n.ports.outputs.iter().map(move |o| format!("{}.{}", n.path, o.name)))
    }

    /// Finds an output by name. The name is either node path and port name (`bind/back.out`), or a name that a
    /// module around it gives to the output (`bind.output`). Costs O(nodes).
    ///
    /// # Errors
    /// [`SimError::UnknownOutput`], with a list of all outputs, if there is no such output.
    pub fn output(&self, name: &str) -> Result<OutputRef, SimError> {
        let (node, output) = self.find_output(name).ok_or_else(|| SimError::UnknownOutput {
            asked: name.into(),
            choices: self.outputs().collect(),
        })?;
        Ok(OutputRef { source: Source::of(self.nodes[node].outs[output]) })
    }

    /// Returns the indices of the node and the port that [`output`](Self::output) finds.
    pub(crate) fn find_output(&self, name: &str) -> Option<(usize, usize)> {
        if let Some((path, port)) = name.rsplit_once('.')
            && let Some(node) = self.nodes.iter().position(|n| n.path == path)
            && let Some(index) = self.nodes[node].ports.outputs.iter().position(|o| o.name == port)
        {
            return Some((node, index));
        }
        let named = |o: &OutputDecl| o.is_exposed_as(name);
        let outputs = self.nodes.iter().map(|node| node.ports.outputs.iter().position(named));
        outputs.enumerate().find_map(|(node, output)| Some((node, output?)))
    }

    pub(crate) fn source<K: Kind>(&self, out: &Out<K>) -> Option<Source> {
        match &out.port {
            PortRef::Known { builder, node, port, .. } if *builder == self.builder => {
                let plan = &self.nodes[*self.handles.get(*node)?];
                Some(Source::of(*plan.outs.get(*port)?))
            }
            _ => None,
        }
    }

    /// Returns the graph in the DOT language of Graphviz. Nodes are boxes with their output width, modules are
    /// clusters, and connections are labelled with their ports and synapses; a low-pass is its time constant. A dashed
    /// connection delays by one tick, or as long as its label says.
    pub fn to_dot(&self) -> String {
        let mut by_path: Vec<usize> = (0..self.nodes.len()).collect();
        by_path.sort_by(|a, b| self.nodes[*a].path.cmp(&self.nodes[*b].path));
        let mut dot = String::from(
            "digraph symbolt {\n  rankdir=LR;\n  node [shape=box, fontname=\"Helvetica\"];\n",
        );
        let mut open: Vec<&str> = Vec::new();
        for index in by_path {
            let node = &self.nodes[index];
            let mut parts: Vec<&str> = node.path.split('/').collect();
            let name = parts.pop().unwrap_or_default();
            let common = open.iter().zip(&parts).take_while(|(a, b)| a == b).count();
            for depth in (common..open.len()).rev() {
                let _ = writeln!(dot, "{}}}", "  ".repeat(depth + 1));
            }
            open.truncate(common);
            for part in &parts[common..] {
                open.push(part);
                let pad = "  ".repeat(open.len());
                let _ = writeln!(dot, "{pad}subgraph \"cluster_{}\" {{", open.join("/"));
                let _ = writeln!(dot, "{pad}  label=\"{part}\";");
            }
            let pad = "  ".repeat(open.len() + 1);
            let width: usize = node.ports.outputs.iter().map(|o| o.shape.width).sum();
            let _ = writeln!(dot, "{pad}n{index} [label=\"{name}\\n{width}\"];");
        }
        for depth in (0..open.len()).rev() {
            let _ = writeln!(dot, "{}}}", "  ".repeat(depth + 1));
        }
        for edge in &self.edges {
            let output = &self.nodes[edge.from.0].ports.outputs[edge.from.1];
            let input = &self.nodes[edge.to.0].ports.inputs[edge.to.1];
            let (label, style) = match edge.via {
                Synapse::None if output.registered => (String::new(), "dashed"),
                Synapse::None => (String::new(), "solid"),
                via => (format!(" {via}"), "dashed"),
            };
            let _ = writeln!(
                dot,
                "  n{} -> n{} [label=\"{} > {}{label}\", style={style}];",
                edge.from.0, edge.to.0, output.name, input.name
            );
        }
        dot.push_str("}\n");
        dot
    }
}

impl Source {
    pub fn of(out: OutSlot) -> Self {
        if out.registered { Self::Registered(out.span) } else { Self::Signal(out.span) }
    }

    pub fn span(self) -> Span {
        match self {
            Self::Signal(span) | Self::Registered(span) => span,
        }
    }
}
