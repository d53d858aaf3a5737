//! Checks a description, reports all its faults together, and passes a valid one to the layout.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::sync::Arc;

use super::graph::Graph;
use super::layout::{self, Checked, CheckedNode};
use crate::sim::describe::builder::GraphBuilder;
use crate::sim::describe::draft::{Body, Draft, Edge, NodeDraft, Note};
use crate::sim::describe::filter::Filter;
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::describe::kind::Shape;
use crate::sim::describe::lowering::{Lowering, PendingLayer};
use crate::sim::describe::node::Node;
use crate::sim::describe::port::{InputDecl, OutputDecl, PortDecl, StateSpec, is_port_name};
use crate::sim::describe::probe_spec::Capacity;
use crate::sim::describe::synapse::Synapse;
use crate::sim::error::{BuildError, BuildErrors};
use crate::sim::path::{is_inside, is_within};
use crate::sim::seed::Seed;
use crate::sim::time::Timebase;
use crate::sim::words::{is_plain, nearest_first};

impl GraphBuilder {
    /// Checks the description, turns each requested layer into a node as `plan` says, and returns the
    /// immutable graph. The description can be built again, with another plan, timebase or seed; its handles and probes
    /// hold for all its graphs, which share their nodes.
    ///
    /// `seed` is the build seed. It decides all random parameters of the layers, such as encoders. Noise
    /// has a separate seed, the run seed in [`RunConfig`](crate::sim::RunConfig). Costs O(nodes log nodes + edges)
    /// in addition to the work of `plan`.
    ///
    /// ```
    /// use symbolt::prelude::*;
    ///
    /// let mut graph = GraphBuilder::new();
    /// let half = graph.add("half", Constant::vector(&[0.5]));
    /// let point = graph.add("point", Ensemble::new(1).identity("same"));
    /// graph.route(&half >> &point.input);
    /// let spiking = PopulationPlan::lif();
    /// for plan in [PopulationPlan::direct(), spiking] {
    ///     graph.build(Timebase::default(), &plan, Seed::new(1))?;
    /// }
    /// # Ok::<(), symbolt::sim::BuildErrors>(())
    /// ```
    ///
    /// # Errors
    /// All faults of the description, together.
    pub fn build(
        &self,
        time: Timebase,
        plan: &dyn Lowering,
        seed: Seed,
    ) -> Result<Graph, BuildErrors> {
        freeze(self.draft.clone(), time, plan, seed)
    }
}

/// Turns a description into a graph, or returns all its faults.
fn freeze(
    mut draft: Draft,
    time: Timebase,
    plan: &dyn Lowering,
    seed: Seed,
) -> Result<Graph, BuildErrors> {
    let mut faults = std::mem::take(&mut draft.faults);
    if draft.nodes.is_empty() && faults.is_empty() {
        faults.push(BuildError::Empty);
    }
    let moved = sort_by_path(&mut draft);
    for node in &draft.nodes {
        let inputs = node.ports.inputs.iter().map(|port| &port.name);
        let outputs = node.ports.outputs.iter().map(|port| &port.name);
        for port in inputs.chain(outputs).filter(|name| !is_port_name(name)) {
            faults.push(BuildError::BadPortName { node: node.path.clone(), port: port.clone() });
        }
        for reason in &node.ports.faults {
            faults.push(BuildError::Refused { node: node.path.clone(), reason: reason.clone() });
        }
    }
    let worlds: Vec<&NodeDraft> =
        draft.nodes.iter().filter(|n| matches!(n.body, Body::World(_))).collect();
    for second in worlds.iter().skip(1) {
        faults.push(BuildError::SecondWorld {
            first: worlds[0].path.clone(),
            second: second.path.clone(),
        });
    }
    let lowered = lower(&draft.nodes, plan, time, seed, &mut faults);
    check_edges(&draft.nodes, &draft.edges, time, &mut faults);
    check_arity(&draft, &mut faults);
    check_probes(&draft, time, &mut faults);

    let mut lowered = lowered.into_iter();
    let mut nodes = Vec::with_capacity(draft.nodes.len());
    for node in draft.nodes {
        let (body, ports, world): (Arc<dyn Node>, PortDecl, bool) = match node.body {
            Body::Node(body) => (body, node.ports, false),
            Body::Process(process) => {
                match process.make(time, seed.derive(&node.path, "process")) {
                    Ok(body) => {
                        let (body, ports) = adopt(body, &node.ports, &node.path, &mut faults);
                        (body, ports, false)
                    }
                    Err(reason) => {
                        faults.push(BuildError::Refused { node: node.path.clone(), reason });
                        (Arc::new(Absent), node.ports, false)
                    }
                }
            }
            Body::World(link) => (link, node.ports, true),
            Body::Layer(_) => match lowered.next() {
                Some((body, ports)) => (body, ports, false),
                // Lowering failed and reported why. The request's ports serve the other checks.
                None => (Arc::new(Absent), node.ports, false),
            },
        };
        if body.parts().is_some() && ports.state != StateSpec::default() {
            let reason = "a node with parts keeps its state in its parts and declares no other";
            faults.push(BuildError::Refused { node: node.path.clone(), reason: reason.into() });
        }
        if body.parts().is_some() && ports.settles() {
            let reason = "a node with parts cannot read an input at the end of the tick";
            faults.push(BuildError::Refused { node: node.path.clone(), reason: reason.into() });
        }
        nodes.push(CheckedNode { path: node.path, body, ports, world });
    }
    let mut notes = draft.notes;
    check_notes(&notes, &draft.described, &nodes, &mut faults);
    notes.retain(|path, _| nodes.iter().any(|node| is_within(&node.path, path)));
    let order = emit_order(&nodes, &draft.edges, &mut faults);
    if !faults.is_empty() {
        let refused = faults.iter().filter_map(|fault| match fault {
            BuildError::Refused { node, .. } => Some(node.clone()),
            _ => None,
        });
        let refused: Vec<String> = refused.collect();
        // A layer states some of its faults twice: as a node, and when it is lowered.
        let mut once: Vec<BuildError> = Vec::new();
        for fault in faults {
            if !once.contains(&fault) && !follows(&fault, &refused) {
                once.push(fault);
            }
        }
        return Err(BuildErrors(once));
    }
    let checked = Checked {
        builder: draft.builder,
        nodes,
        edges: draft.edges,
        probes: draft.probes,
        spike_probes: draft.spike_probes,
        notes,
        ranks: plan.ranks().cloned(),
        order,
        time,
        seed,
        moved,
    };
    layout::lay_out(checked).map_err(|fault| BuildErrors(vec![fault]))
}

/// Returns whether a fault is about the ports of a refused node, or about what is in a refused module. They are not what they would
/// be without its own fault, which needs no second message.
fn follows(fault: &BuildError, refused: &[String]) -> bool {
    let of = |port: &str, node: &String| {
        port.strip_prefix(node.as_str()).is_some_and(|rest| rest.starts_with(['.', '/']))
    };
    refused.iter().any(|refused| match fault {
        BuildError::Refused { node, .. } => is_inside(node, refused),
        BuildError::Lowering { path, .. } => is_inside(path, refused),
        BuildError::UnknownPort { node, .. } => is_within(refused, node),
        BuildError::WidthMismatch { from, to, .. } => of(from, refused) || of(to, refused),
        BuildError::Unfed { port, .. } => of(port, refused),
        _ => false,
    })
}

/// Replaces a layer whose lowering failed, so that the remaining checks can run.
struct Absent;

impl Node for Absent {
    fn declare(&self, _ports: &mut PortDecl) {}

    fn fingerprint(&self, _hash: &mut Fingerprint) {}
}

/// Sorts nodes and connections by path, so that the order of addition does not matter. Returns the new index of each
/// node.
fn sort_by_path(draft: &mut Draft) -> Vec<usize> {
    let mut rank: Vec<usize> = (0..draft.nodes.len()).collect();
    rank.sort_by(|a, b| draft.nodes[*a].path.cmp(&draft.nodes[*b].path).then(a.cmp(b)));
    let mut place = vec![0; rank.len()];
    for (new, old) in rank.iter().enumerate() {
        place[*old] = new;
    }
    let mut slots: Vec<Option<NodeDraft>> = draft.nodes.drain(..).map(Some).collect();
    draft.nodes = rank.iter().filter_map(|old| slots[*old].take()).collect();
    for edge in &mut draft.edges {
        edge.from.0 = place[edge.from.0];
        edge.to.0 = place[edge.to.0];
    }
    for input in &mut draft.excused {
        input.0 = place[input.0];
    }
    for probe in &mut draft.probes {
        probe.of.0 = place[probe.of.0];
    }
    for node in &mut draft.spike_probes {
        *node = place[*node];
    }
    draft.edges.sort_by_key(|e| (e.to, e.from, e.via.order()));
    place
}

type LoweredNode = (Arc<dyn Node>, PortDecl);

fn lower(
    nodes: &[NodeDraft],
    plan: &dyn Lowering,
    time: Timebase,
    seed: Seed,
    faults: &mut Vec<BuildError>,
) -> Vec<LoweredNode> {
    let pending: Vec<(PendingLayer<'_>, &PortDecl)> = nodes
        .iter()
        .filter_map(|node| match &node.body {
            Body::Layer(request) => Some((
                PendingLayer {
                    path: &node.path,
                    request: &**request,
                    seed: seed.derive(&node.path, "layer"),
                },
                &node.ports,
            )),
            _ => None,
        })
        .collect();
    let (layers, asked): (Vec<_>, Vec<_>) = pending.into_iter().unzip();
    let bodies = match plan.lower(&layers, time) {
        Ok(bodies) => bodies,
        Err(wrong) => {
            // A layer with a fault of its own is not lowered well either, which needs no second message.
            let sound = |path: &str| {
                !layers
                    .iter()
                    .zip(&asked)
                    .any(|(l, ports)| l.path == path && !ports.faults.is_empty())
            };
            let wrong = wrong.into_iter().filter(|f| sound(&f.path));
            faults.extend(wrong.map(|f| BuildError::Lowering {
                path: f.path,
                reason: f.reason,
                choices: f.choices,
            }));
            return Vec::new();
        }
    };
    assert!(bodies.len() == layers.len(), "a lowering returns one node for each request");
    let mut out = Vec::with_capacity(bodies.len());
    for ((body, layer), asked) in bodies.into_iter().zip(&layers).zip(asked) {
        out.push(adopt(body, asked, layer.path, faults));
    }
    out
}

/// Takes a node that was made for these ports.
fn adopt(
    body: Box<dyn Node>,
    asked: &PortDecl,
    path: &str,
    faults: &mut Vec<BuildError>,
) -> LoweredNode {
    let mut ports = PortDecl::default();
    body.declare(&mut ports);
    assert!(
        ports.same_ports(asked),
        "the ports of `{path}` changed when the graph was built; they are the same in every mode"
    );
    for reason in &ports.faults {
        faults.push(BuildError::Refused { node: path.into(), reason: reason.clone() });
    }
    // A layer needs the same synapses in every mode.
    for (now, asked) in ports.outputs.iter_mut().zip(&asked.outputs) {
        now.spec.filtered_only = asked.spec.filtered_only;
        now.exposed = asked.exposed.clone();
        now.inner = asked.inner.clone();
    }
    (body.into(), ports)
}

/// The name of an input in messages: the exposed name, or node path and port name.
fn input_name(node: &NodeDraft, port: &InputDecl) -> String {
    port_name(node, &port.name, port.exposed.as_deref())
}

/// The name of an output in messages.
fn output_name(node: &NodeDraft, port: &OutputDecl) -> String {
    port_name(node, &port.name, port.exposed.as_deref())
}

fn port_name(node: &NodeDraft, port: &str, exposed: Option<&str>) -> String {
    exposed.map_or_else(|| format!("{}.{port}", node.path), Into::into)
}

fn space_name(shape: &Shape) -> String {
    shape.space.as_ref().map_or_else(|| "no space".into(), ToString::to_string)
}

/// Returns whether a message about the port `of` may offer `port` as a choice: `port` must be in the same module or in
/// an enclosing one.
fn is_visible(port: &str, of: &str) -> bool {
    let scope = |name: &str| name.rfind('/').unwrap_or(0);
    let (outer, inner) = (&port[..scope(port)], &of[..scope(of)]);
    outer.is_empty() || is_within(inner, outer)
}

/// Greatest number of fitting ports in a fault. In a graph of thousands of nodes, thousands fit.
const FITTING: usize = 10;

/// Up to ten visible outputs of the kind and shape of `input`, as choices for a message.
fn fitting_outputs(nodes: &[NodeDraft], input: &InputDecl, name: &str) -> Vec<String> {
    let outputs = nodes.iter().flat_map(|node| node.ports.outputs.iter().map(move |o| (node, o)));
    let fits = |o: &OutputDecl| o.kind == input.kind && o.shape.fits(&input.shape);
    let fitting = outputs.filter(|(_, output)| fits(output));
    let named = fitting.map(|(node, output)| output_name(node, output));
    named.filter(|other| is_visible(other, name)).take(FITTING).collect()
}

fn check_edges(nodes: &[NodeDraft], edges: &[Edge], time: Timebase, faults: &mut Vec<BuildError>) {
    let fed: BTreeSet<(usize, usize)> = edges.iter().map(|e| e.to).collect();
    for edge in edges {
        let (from_node, to_node) = (&nodes[edge.from.0], &nodes[edge.to.0]);
        let output = &from_node.ports.outputs[edge.from.1];
        let input = &to_node.ports.inputs[edge.to.1];
        let from = output_name(from_node, output);
        let to = input_name(to_node, input);
        if output.shape.width != input.shape.width {
            let mut inputs = Vec::new();
            for (n, node) in nodes.iter().enumerate() {
                for (p, other) in node.ports.inputs.iter().enumerate() {
                    let open = other.sum || !fed.contains(&(n, p));
                    let fits = other.kind == output.kind && other.shape.fits(&output.shape);
                    if inputs.len() == FITTING || !(open && fits) {
                        continue;
                    }
                    let name = input_name(node, other);
                    if is_visible(&name, &from) {
                        inputs.push(name);
                    }
                }
            }
            faults.push(BuildError::WidthMismatch {
                from: from.clone(),
                from_width: output.shape.width,
                to: to.clone(),
                to_width: input.shape.width,
                inputs,
                outputs: fitting_outputs(nodes, input, &to),
            });
        } else if !output.shape.same_space(&input.shape) {
            faults.push(BuildError::SpaceMismatch {
                from: from.clone(),
                from_space: space_name(&output.shape),
                to: to.clone(),
                to_space: space_name(&input.shape),
                outputs: fitting_outputs(nodes, input, &to),
            });
        }
        if let Err(reason) = Filter::of_connection(edge.via, time) {
            faults.push(BuildError::BadSynapse { from, to, reason });
        } else if edge.via == Synapse::None {
            if input.at_settle && output.registered && from_node.ports.settles() {
                faults.push(BuildError::BothSettle { from, to });
            } else if output.filtered_only && !input.at_settle {
                faults.push(BuildError::Unfiltered { from, to });
            }
        }
    }
}

fn check_arity(draft: &Draft, faults: &mut Vec<BuildError>) {
    let (nodes, edges) = (&draft.nodes[..], &draft.edges[..]);
    let mut sources: BTreeMap<(usize, usize), Vec<String>> = BTreeMap::new();
    for edge in edges {
        let from = &nodes[edge.from.0];
        let name = output_name(from, &from.ports.outputs[edge.from.1]);
        sources.entry(edge.to).or_default().push(name);
    }
    for (n, node) in nodes.iter().enumerate() {
        for (p, input) in node.ports.inputs.iter().enumerate() {
            match sources.get(&(n, p)) {
                Some(many) if many.len() > 1 && !input.sum => {
                    faults.push(BuildError::TooManySources {
                        to: input_name(node, input),
                        sources: many.clone(),
                    });
                }
                None if !input.optional && !draft.excused.contains(&(n, p)) => {
                    let port = input_name(node, input);
                    let outputs = fitting_outputs(nodes, input, &port);
                    faults.push(BuildError::Unfed { port, outputs });
                }
                _ => {}
            }
        }
    }
}

fn check_probes(draft: &Draft, time: Timebase, faults: &mut Vec<BuildError>) {
    for probe in &draft.probes {
        let node = &draft.nodes[probe.of.0];
        let port = output_name(node, &node.ports.outputs[probe.of.1]);
        if let Err(wrong) = time.ticks(probe.spec.period) {
            faults.push(BuildError::BadProbe { port: port.clone(), reason: wrong.to_string() });
        }
        if probe.spec.capacity == Capacity::Last(0) {
            let reason = "its capacity is 0 samples; use at least 1".into();
            faults.push(BuildError::BadProbe { port: port.clone(), reason });
        }
        if let Err(wrong) = Filter::new(probe.spec.filter, time) {
            let reason = format!("its filter has {wrong}");
            faults.push(BuildError::BadProbe { port, reason });
        }
    }
}

/// Checks that modules with names for people are there, and that these can be shown.
fn check_notes(
    notes: &BTreeMap<String, Note>,
    described: &BTreeSet<String>,
    nodes: &[CheckedNode],
    faults: &mut Vec<BuildError>,
) {
    for (path, note) in notes {
        let there = || nodes.iter().any(|node| is_within(&node.path, path));
        let reason = if note.name.trim().is_empty() {
            "its name for people is empty".to_owned()
        } else if !is_plain(&note.name) || !is_plain(&note.meaning) {
            "its name for people or its meaning has control characters".to_owned()
        } else if described.contains(path) && !there() {
            let paths = nodes.iter().map(|node| &*node.path);
            format!("is described and not there; the nearest are: {}", nearest_first(path, paths))
        } else {
            continue;
        };
        faults.push(BuildError::Refused { node: path.clone(), reason });
    }
}

/// Returns the order in which nodes emit. Each node comes after the nodes whose outputs it reads in the same tick.
/// Nodes that could come in either order are sorted by path. Reports a fault for each loop.
fn emit_order(nodes: &[CheckedNode], edges: &[Edge], faults: &mut Vec<BuildError>) -> Vec<usize> {
    let mut after: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
    let mut before: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
    for edge in edges {
        let output = nodes[edge.from.0].ports.outputs.get(edge.from.1);
        let input = nodes[edge.to.0].ports.inputs.get(edge.to.1);
        let (Some(output), Some(input)) = (output, input) else { continue };
        if edge.via == Synapse::None && !output.registered && !input.at_advance {
            after[edge.from.0].push(edge.to.0);
            before[edge.to.0].push(edge.from.0);
        }
    }
    let mut waiting: Vec<usize> = before.iter().map(Vec::len).collect();
    let mut ready: BinaryHeap<Reverse<usize>> =
        waiting.iter().enumerate().filter(|(_, w)| **w == 0).map(|(n, _)| Reverse(n)).collect();
    let mut order = Vec::with_capacity(nodes.len());
    while let Some(Reverse(node)) = ready.pop() {
        order.push(node);
        for next in &after[node] {
            waiting[*next] -= 1;
            if waiting[*next] == 0 {
                ready.push(Reverse(*next));
            }
        }
    }
    let mut told = vec![false; nodes.len()];
    for start in (0..nodes.len()).filter(|n| waiting[*n] > 0) {
        // A node that never became ready reads another such node. Walking backwards therefore ends in a loop, or in
        // nodes whose loop is already reported.
        let mut trail: Vec<usize> = Vec::new();
        let mut at = start;
        while !told[at] {
            told[at] = true;
            trail.push(at);
            let Some(prior) = before[at].iter().copied().find(|p| waiting[*p] > 0) else { break };
            if let Some(first) = trail.iter().position(|n| *n == prior) {
                let mut path: Vec<String> =
                    trail[first..].iter().rev().map(|n| nodes[*n].path.clone()).collect();
                path.push(path[0].clone());
                faults.push(BuildError::AlgebraicLoop { path });
            }
            at = prior;
        }
    }
    order
}
