//! The graph builder: adds modules and nodes, connects their ports and places probes.

use std::marker::PhantomData;
use std::panic::Location;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::draft::{Body, Draft, Edge, NodeDraft, Note, ProbeDraft};
use super::find;
use super::handle::{In, NodePorts, Out, PortRef, Ports};
use super::kind::{Kind, Pointer, Space, VocabTag};
use super::lowering::LayerRequest;
use super::node::Node;
use super::port::{PortDecl, is_port_name};
use super::probe_spec::{ProbeId, ProbeSpec, SpikeProbe};
use super::process::Process;
use super::synapse::Synapse;
use crate::sim::error::BuildError;

/// The next builder's number, unique within the process. A builder recognises handles of other builders by this
/// number. Results do not depend on it.
static NEXT_BUILDER: AtomicU64 = AtomicU64::new(0);

/// A named group of nodes with ports of its own.
///
/// A module is a plain description. Its [`expand`](Module::expand) adds nodes, layers and other modules to a
/// [`Scope`], connects them, and returns the handles that users of the module connect to.
///
/// ```
/// use symbolt::sim::{Add, GraphBuilder, In, Module, Noise, Out, Scalar, Scope, Synapse};
///
/// /// Adds numbers, then noise.
/// struct NoisySum {
///     sd: f32,
/// }
///
/// struct NoisySumPorts {
///     input: In<Scalar>,
///     output: Out<Scalar>,
/// }
///
/// impl Module for NoisySum {
///     type Ports = NoisySumPorts;
///
///     fn expand(self, scope: &mut Scope<'_>) -> NoisySumPorts {
///         let sum = scope.add("sum", Add::scalar());
///         let noise = scope.add("noise", Noise::scalar(self.sd));
///         scope.connect(&sum.output, &noise.input, Synapse::None);
///         NoisySumPorts {
///             input: scope.input("input", sum.input),
///             output: scope.output("output", noise.output),
///         }
///     }
/// }
///
/// let mut graph = GraphBuilder::new();
/// let blur = graph.add("blur", NoisySum { sd: 0.1 }); // adds the nodes `blur/sum` and `blur/noise`
/// graph.connect(&blur.output, &blur.input, Synapse::lowpass_ms(5));
/// ```
pub trait Module {
    /// The handles of the module's ports.
    type Ports;

    /// Adds the module's nodes to `scope` and returns its ports. Faults are reported by
    /// [`GraphBuilder::build`]; see [`Scope::refuse`].
    fn expand(self, scope: &mut Scope<'_>) -> Self::Ports;
}

/// The description of a graph. [`build`](GraphBuilder::build) turns it into a [`Graph`](crate::sim::Graph).
///
/// Adding, connecting and probing never fail. The builder collects faults, and `build` returns all of them.
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
    pub(crate) draft: Draft,
}

impl Default for GraphBuilder {
    fn default() -> Self {
        Self::new()
    }
}

impl GraphBuilder {
    /// Starts an empty description.
    pub fn new() -> Self {
        let builder = NEXT_BUILDER.fetch_add(1, Ordering::Relaxed);
        Self { draft: Draft { builder, ..Draft::default() } }
    }

    /// Adds a module under `name` and returns its ports. Two additions with the same name are a fault.
    #[track_caller]
    pub fn add<M: Module>(&mut self, name: &str, module: M) -> M::Ports {
        self.root().add(name, module)
    }

    /// Adds a single node under `name` and returns its ports. Two additions with the same name are a fault.
    #[track_caller]
    pub fn node(&mut self, name: &str, node: impl Node + 'static) -> NodePorts {
        self.root().node(name, node)
    }

    /// Connects an output to an input of the same kind.
    ///
    /// A scalar output fits a scalar input:
    ///
    /// ```
    /// use symbolt::prelude::*;
    /// let mut graph = GraphBuilder::new();
    /// let one = graph.add("one", Constant::scalar(1.0));
    /// let sum = graph.add("sum", Add::scalar());
    /// graph.connect(&one, &sum.input, Synapse::None);
    /// ```
    ///
    /// A vector output does not fit a scalar input, and a pointer does not fit an input of another vocabulary.
    /// Such a program does not compile:
    ///
    /// ```compile_fail
    /// use symbolt::prelude::*;
    /// let mut graph = GraphBuilder::new();
    /// let one = graph.add("one", Constant::vector(&[1.0]));
    /// let sum = graph.add("sum", Add::scalar());
    /// graph.connect(&one, &sum.input, Synapse::None);
    /// ```
    pub fn connect<K: Kind>(&mut self, from: &Out<K>, to: &In<K>, via: Synapse) {
        let from = self.resolve(&from.port, "output");
        let to = self.resolve(&to.port, "input");
        match (from, to) {
            (Some(from), Some(to)) => self.draft.edges.push(Edge { from, to, via }),
            (None, Some(to)) => self.draft.excused.push(to),
            (_, None) => {}
        }
    }

    /// Records an output during every run.
    pub fn probe<K: Kind>(&mut self, of: &Out<K>, spec: ProbeSpec) -> ProbeId<K> {
        let index = self.draft.probes.len();
        if let Some(of) = self.resolve(&of.port, "output") {
            self.draft.probes.push(ProbeDraft { of, spec });
        }
        ProbeId { index, builder: self.draft.builder, kind: PhantomData }
    }

    /// Records the output called `name` during every run, as [`probe`](Self::probe) does. The name is node path and port
    /// (`bind/back.out`), the name that a module gives to the output (`bind.output`), or a module alone, whose output is
    /// called `output` (`bind`). The output must have been added before.
    ///
    /// A name or kind that there is not is a fault when the graph is built. Costs O(nodes).
    ///
    /// ```
    /// use symbolt::prelude::*;
    ///
    /// let mut graph = GraphBuilder::new();
    /// let one = graph.add("one", Constant::scalar(1.0));
    /// let sum = graph.add("sum", Add::scalar());
    /// graph.route(&one >> &sum);
    /// let probe = graph.probe_at::<Scalar>("sum", ProbeSpec::default());
    /// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(3))?;
    /// assert_eq!(sim.samples(&probe).len(), 3);
    /// # Ok::<(), symbolt::sim::SimError>(())
    /// ```
    pub fn probe_at<K: Kind>(&mut self, name: &str, spec: ProbeSpec) -> ProbeId<K> {
        let index = self.draft.probes.len();
        match find::output::<K>(&self.draft.nodes, name) {
            Ok(of) => self.draft.probes.push(ProbeDraft { of, spec }),
            Err(fault) => self.draft.faults.push(fault),
        }
        ProbeId { index, builder: self.draft.builder, kind: PhantomData }
    }

    /// Records the spikes of the layer at `path` (such as `memory/population`) during every run, or of the only layer
    /// of the module at `path`. A layer without spiking neurons records nothing. A node of your own is recorded if it
    /// has units with events ([`Node::units`](crate::sim::Node::units)). A path without a layer, or a module with several, is
    /// a fault when the graph is built.
    ///
    /// A tick stores one bit per neuron.
    pub fn probe_spikes(&mut self, path: &str) -> SpikeProbe {
        let index = self.draft.spike_probes.len();
        match find::layer(&self.draft.nodes, path) {
            Ok(node) => self.draft.spike_probes.push(node),
            Err(fault) => self.draft.faults.push(fault),
        }
        SpikeProbe { index, builder: self.draft.builder }
    }

    /// Says what the module at `path` is called for people, and what it does, as [`Scope::describe`] does.
    pub fn describe(&mut self, path: &str, name: &str, meaning: &str) {
        self.root().describe(path, name, meaning);
    }

    /// Returns the first fault so far.
    pub(crate) fn first_fault(&self) -> Option<&BuildError> {
        self.draft.faults.first()
    }

    pub(crate) fn root(&mut self) -> Scope<'_> {
        Scope { builder: self, path: String::new(), repeated: false }
    }

    fn resolve(&mut self, port: &PortRef, direction: &'static str) -> Option<(usize, usize)> {
        match port {
            PortRef::Known { builder, node, port, .. } if *builder == self.draft.builder => {
                Some((*node, *port))
            }
            PortRef::Known { name, .. } => {
                let port = name.to_string();
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

/// The place in a graph to which a module adds its nodes.
///
/// A scope has a path. The node `sum` in the scope `planner/goal` has the path `planner/goal/sum`.
pub struct Scope<'a> {
    builder: &'a mut GraphBuilder,
    path: String,
    /// Whether this path was added before. Names inside it may then repeat too, and these repetitions are not
    /// reported.
    repeated: bool,
}

impl Scope<'_> {
    /// Adds a module inside this scope and returns its ports.
    #[track_caller]
    pub fn add<M: Module>(&mut self, name: &str, module: M) -> M::Ports {
        let (path, repeated) = self.child(name);
        module.expand(&mut Scope { builder: self.builder, path, repeated })
    }

    /// Adds a single node inside this scope and returns its ports.
    #[track_caller]
    pub fn node(&mut self, name: &str, node: impl Node + 'static) -> NodePorts {
        let mut ports = PortDecl::default();
        node.declare(&mut ports);
        self.push(name, Body::Node(Arc::new(node)), ports)
    }

    /// Adds a node at the scope's own path, for a module that is a single node.
    #[track_caller]
    pub fn leaf(&mut self, node: impl Node + 'static) -> NodePorts {
        self.leaf_of(Arc::new(node))
    }

    #[track_caller]
    fn leaf_of(&mut self, node: Arc<dyn Node>) -> NodePorts {
        let mut ports = PortDecl::default();
        node.declare(&mut ports);
        self.push_here(Body::Node(node), ports)
    }

    /// Adds a process at the scope's own path, for a module that is a single node.
    #[track_caller]
    pub fn process(&mut self, process: impl Process) -> NodePorts {
        let mut ports = PortDecl::default();
        process.declare(&mut ports);
        self.push_here(Body::Process(Arc::new(process)), ports)
    }

    #[track_caller]
    fn push_here(&mut self, body: Body, ports: PortDecl) -> NodePorts {
        let draft = &mut self.builder.draft;
        let here = Location::caller();
        if let Some(first) = draft.leaves.insert(self.path.clone(), here)
            && !self.repeated
        {
            draft.faults.push(added_twice(&self.path, first, here));
        }
        self.push_at(self.path.clone(), body, ports)
    }

    /// Requests a layer. The plan turns it into a node when the graph is built.
    #[track_caller]
    pub fn layer(&mut self, name: &str, request: impl LayerRequest) -> NodePorts {
        let mut ports = PortDecl::default();
        request.declare(&mut ports);
        self.push(name, Body::Layer(Arc::new(request)), ports)
    }

    /// Connects an output to an input of the same kind.
    pub fn connect<K: Kind>(&mut self, from: &Out<K>, to: &In<K>, via: Synapse) {
        self.builder.connect(from, to, via);
    }

    /// Makes the input of an inner node the module's own input `name`. Faults then call the port `bind.a`, as users of
    /// the module know it, and not `bind/left.in`. Use the name of the field in the module's port struct.
    pub fn input<K: Kind>(&mut self, name: &str, port: In<K>) -> In<K> {
        let exposed = self.expose(name, port.port, |ports, index, name| {
            if let Some(port) = ports.inputs.get_mut(index) {
                port.exposed = Some(name);
            }
        });
        In::new(exposed)
    }

    /// Makes the output of an inner node the module's own output `name`, as [`input`](Scope::input) does.
    /// [`Graph::output`](crate::sim::Graph::output) finds the output under both names.
    pub fn output<K: Kind>(&mut self, name: &str, port: Out<K>) -> Out<K> {
        let exposed = self.expose(name, port.port, |ports, index, name| {
            if let Some(port) = ports.outputs.get_mut(index) {
                port.inner.extend(port.exposed.replace(name));
            }
        });
        Out::new(exposed)
    }

    /// Makes the ports of an inner node the module's own ports `input` and `output`.
    pub fn ports<A: Kind, B: Kind>(&mut self, inner: Ports<A, B>) -> Ports<A, B> {
        Ports {
            input: self.input("input", inner.input),
            output: self.output("output", inner.output),
        }
    }

    /// Says what the module or node at `path` inside this scope is called for people, and what it does, in a sentence. Pages
    /// show this name; scripts keep to the path. An empty `path` is the scope itself. The last description of a path counts. An empty
    /// name, control characters, and a path that no module has when the graph is built are faults.
    ///
    /// ```
    /// use symbolt::prelude::*;
    ///
    /// let mut graph = GraphBuilder::new();
    /// graph.add("one", Constant::scalar(1.0));
    /// graph.describe("one", "the unit", "Is always 1.");
    /// let sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
    /// assert_eq!(sim.graph().note("one").map(|note| &*note.name), Some("the unit"));
    /// # Ok::<(), symbolt::sim::SimError>(())
    /// ```
    pub fn describe(&mut self, path: &str, name: &str, meaning: &str) {
        let path = self.describe_if_there(path, name, meaning);
        self.builder.draft.described.insert(path);
    }

    /// As [`describe`](Self::describe), for a module that may not be there. Returns its path.
    pub(crate) fn describe_if_there(&mut self, path: &str, name: &str, meaning: &str) -> String {
        let parts = [&*self.path, path].into_iter().filter(|part| !part.is_empty());
        let path = parts.collect::<Vec<_>>().join("/");
        let note = Note { name: name.into(), meaning: meaning.into() };
        self.builder.draft.notes.insert(path.clone(), note);
        path
    }

    /// Reports that the module cannot be built as described. `build` returns `reason` with the path of this scope.
    pub fn refuse(&mut self, reason: impl Into<String>) {
        self.builder
            .draft
            .faults
            .push(BuildError::Refused { node: self.path.clone(), reason: reason.into() });
    }

    /// Returns the space that the port of an output was declared with; `None` for a faulty or foreign handle.
    pub(crate) fn space_of<V: VocabTag>(&self, output: &Out<Pointer<V>>) -> Option<Space<V>> {
        let (node, port) = self.known(&output.port)?;
        let declared = self.builder.draft.nodes[node].ports.outputs.get(port)?;
        declared.spec.shape.space.clone().map(Space::of)
    }

    /// Returns the space that the port of an input was declared with; `None` for a faulty or foreign handle.
    pub(crate) fn space_of_input<V: VocabTag>(&self, input: &In<Pointer<V>>) -> Option<Space<V>> {
        let (node, port) = self.known(&input.port)?;
        let declared = self.builder.draft.nodes[node].ports.inputs.get(port)?;
        declared.spec.shape.space.clone().map(Space::of)
    }

    /// Returns the width that the port of an output was declared with; `None` for a faulty or foreign handle.
    pub(crate) fn width_of<K: Kind>(&self, output: &Out<K>) -> Option<usize> {
        let (node, port) = self.known(&output.port)?;
        Some(self.builder.draft.nodes[node].ports.outputs.get(port)?.spec.width())
    }

    /// Returns the width that the port of an input was declared with; `None` for a faulty or foreign handle.
    pub(crate) fn width_of_input<K: Kind>(&self, input: &In<K>) -> Option<usize> {
        let (node, port) = self.known(&input.port)?;
        Some(self.builder.draft.nodes[node].ports.inputs.get(port)?.spec.width())
    }

    /// Returns whether every connection from an output needs a synapse.
    pub(crate) fn needs_synapse(&self, output: &PortRef) -> bool {
        let declared = self
            .known(output)
            .and_then(|(node, port)| self.builder.draft.nodes[node].ports.outputs.get(port));
        declared.is_some_and(|declared| declared.spec.filtered_only)
    }

    /// Returns whether an input adds any number of connections.
    pub(crate) fn adds<K: Kind>(&self, input: &In<K>) -> bool {
        let declared = self
            .known(&input.port)
            .and_then(|(node, port)| self.builder.draft.nodes[node].ports.inputs.get(port));
        declared.is_some_and(|declared| declared.spec.sum)
    }

    /// Returns `name`, or `name-2`, `name-3` and so on if the scope has a child of this name.
    pub(crate) fn free_name(&self, name: &str) -> String {
        let added = &self.builder.draft.added;
        let taken = |name: &str| match self.path.is_empty() {
            true => added.contains_key(name),
            false => added.contains_key(&format!("{}/{name}", self.path)),
        };
        let numbered = (2..).map(|n| format!("{name}-{n}"));
        let mut all = std::iter::once(name.to_owned()).chain(numbered);
        all.find(|name| !taken(name)).unwrap_or_default()
    }

    fn known(&self, port: &PortRef) -> Option<(usize, usize)> {
        match port {
            PortRef::Known { builder, node, port, .. }
                if *builder == self.builder.draft.builder =>
            {
                Some((*node, *port))
            }
            _ => None,
        }
    }

    /// Gives a port the name `exposed` in this scope. Faulty handles and handles of other builders stay as they are.
    fn expose(
        &mut self,
        exposed: &str,
        handle: PortRef,
        note: fn(&mut PortDecl, usize, Arc<str>),
    ) -> PortRef {
        let draft = &mut self.builder.draft;
        if !is_port_name(exposed) {
            let (node, port) = (self.path.clone(), exposed.into());
            draft.faults.push(BuildError::BadPortName { node, port });
        }
        match handle {
            PortRef::Known { builder, node, port, .. } if builder == draft.builder => {
                let name: Arc<str> = format!("{}.{exposed}", self.path).into();
                note(&mut draft.nodes[node].ports, port, name.clone());
                PortRef::Known { builder, node, port, name }
            }
            other => other,
        }
    }

    /// Returns the path of `name` in this scope, and whether this path or an enclosing one was added before.
    #[track_caller]
    fn child(&mut self, name: &str) -> (String, bool) {
        let good = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
        let draft = &mut self.builder.draft;
        if name.is_empty() || !name.chars().all(good) {
            let (parent, name) = (self.path.clone(), name.into());
            draft.faults.push(BuildError::BadName { parent, name });
        }
        let path = if self.path.is_empty() { name.into() } else { format!("{}/{name}", self.path) };
        let here = Location::caller();
        let first = draft.added.insert(path.clone(), here);
        if let Some(first) = first
            && !self.repeated
        {
            draft.faults.push(added_twice(&path, first, here));
        }
        (path, self.repeated || first.is_some())
    }

    /// Adds a node with this body and these ports.
    #[track_caller]
    pub(crate) fn push(&mut self, name: &str, body: Body, ports: PortDecl) -> NodePorts {
        let (path, _) = self.child(name);
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

fn added_twice(path: &str, first: &Location<'_>, second: &Location<'_>) -> BuildError {
    let line = |at: &Location<'_>| format!("{}:{}", at.file(), at.line());
    BuildError::DuplicatePath { path: path.into(), first: line(first), second: line(second) }
}
