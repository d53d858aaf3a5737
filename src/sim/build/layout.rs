//! Lays out a valid description: assigns every signal, filter and state its place in the arenas.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use super::graph::{
    FilterPlan, GatherPlan, Graph, LowpassPlan, NodeInfo, PartPlan, PhasePlan, ProbePlan, Sizes,
    Source, WorldPlan,
};
use crate::sim::describe::draft::{Edge, Note, ProbeDraft};
use crate::sim::describe::filter::Filter;
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::describe::io::{OutSlot, Slot};
use crate::sim::describe::node::Node;
use crate::sim::describe::parts::Parts;
use crate::sim::describe::port::{PortDecl, ScratchSpec, StateSpec};
use crate::sim::describe::synapse::Synapse;
use crate::sim::error::BuildError;
use crate::sim::place::ranks::Ranks;
use crate::sim::real::Span;
use crate::sim::seed::Seed;
use crate::sim::time::Timebase;

/// A node that passed the checks.
pub(crate) struct CheckedNode {
    pub path: String,
    pub body: Arc<dyn Node>,
    pub ports: PortDecl,
    pub world: bool,
}

/// A description that passed the checks.
pub(crate) struct Checked {
    pub builder: u64,
    /// Sorted by path.
    pub nodes: Vec<CheckedNode>,
    /// Sorted by target, then by source.
    pub edges: Vec<Edge>,
    pub probes: Vec<ProbeDraft>,
    pub spike_probes: Vec<usize>,
    pub notes: BTreeMap<String, Note>,
    pub ranks: Option<Ranks>,
    pub order: Vec<usize>,
    pub time: Timebase,
    pub seed: Seed,
    /// The index in `nodes` of each of the builder's nodes.
    pub moved: Vec<usize>,
}

/// Hands out consecutive ranges.
#[derive(Default)]
struct Cursor(usize);

impl Cursor {
    fn take(&mut self, len: usize) -> Span {
        let start = self.0;
        self.0 += len;
        // Sizes are checked against the limit before any span is used.
        Span { start: start as u32, end: self.0 as u32 }
    }
}

/// Appends `items` to `all` and returns their range.
fn append<T: Clone>(all: &mut Vec<T>, items: &[T]) -> Span {
    let start = all.len();
    all.extend_from_slice(items);
    Span { start: start as u32, end: all.len() as u32 }
}

/// Greatest size of an arena, because spans are 32-bit.
const LIMIT: usize = u32::MAX as usize;

/// Builds the graph of a valid description.
pub(crate) fn lay_out(checked: Checked) -> Result<Graph, BuildError> {
    let fingerprint = fingerprint(&checked);
    let places = Places::of(&checked);
    let wires = Wires::of(&checked, &places);
    let Checked {
        builder,
        nodes,
        edges,
        probes,
        spike_probes,
        notes,
        ranks,
        order,
        time,
        seed,
        moved,
    } = checked;
    let mut rank = vec![0; nodes.len()];
    for (at, node) in order.iter().enumerate() {
        rank[*node] = at;
    }
    let spike_probes: Vec<usize> = spike_probes.iter().map(|node| rank[*node]).collect();
    let (mut plans, infos, bodies) = Plans::of(nodes, &order, &places, &wires);
    let results = place_results(&mut plans, &spike_probes, ranks.as_ref());
    let mut probe_filters = Cursor::default();
    let probes = probe_plans(&probes, time, (&places, &rank), &mut probe_filters);
    let sizes = Sizes {
        signals: places.signals.0,
        registered: places.registered.0,
        held: wires.held.0,
        gathered: plans.gathered.0,
        reals: plans.reals.0,
        words: plans.words.0,
        longs: plans.longs.0,
        probe_filters: probe_filters.0,
        parts: plans.part_states.0,
        results,
        scratch: places.scratch,
    };
    let Sizes { signals, held, gathered, reals, words, longs, parts, .. } = sizes;
    let all = [signals, held, gathered, reals, words, longs, parts, results];
    let largest = all.into_iter().max().unwrap_or(0);
    if largest > LIMIT {
        return Err(BuildError::TooLarge { numbers: largest, limit: LIMIT });
    }
    let edge = |e: &Edge| Edge {
        from: (rank[e.from.0], e.from.1),
        to: (rank[e.to.0], e.to.1),
        via: e.via,
    };
    Ok(Graph {
        builder,
        handles: moved.iter().map(|sorted| rank[*sorted]).collect(),
        nodes: infos,
        bodies,
        emits: plans.emits,
        advances: plans.advances,
        settles: plans.settles,
        divided: plans.divided,
        parts: plans.parts,
        outs: plans.outs,
        slots: plans.slots,
        gathers: plans.gathers,
        gather_sources: plans.gather_sources,
        lowpasses: wires.lowpasses,
        filters: wires.filters,
        probes,
        spike_probes,
        world: plans.world,
        edges: edges.iter().map(edge).collect(),
        notes,
        sizes,
        time,
        seed,
        fingerprint,
        ranks,
    })
}

/// The places of all outputs, by node.
struct Places {
    outs: Vec<Vec<OutSlot>>,
    /// Each node's ranges of signals and of registered outputs.
    own: Vec<(Span, Span)>,
    signals: Cursor,
    registered: Cursor,
    /// Greatest size of scratch memory that a node needs.
    scratch: ScratchSpec,
}

impl Places {
    fn of(checked: &Checked) -> Self {
        let count = checked.nodes.len();
        let mut places = Self {
            outs: vec![Vec::new(); count],
            own: vec![(Span::default(), Span::default()); count],
            signals: Cursor::default(),
            registered: Cursor::default(),
            scratch: ScratchSpec::default(),
        };
        for at in &checked.order {
            let ports = &checked.nodes[*at].ports;
            let (first_signal, first_registered) = (places.signals.0, places.registered.0);
            for output in &ports.outputs {
                let tape =
                    if output.registered { &mut places.registered } else { &mut places.signals };
                let span = tape.take(output.shape.width);
                places.outs[*at].push(OutSlot { span, registered: output.registered });
            }
            places.own[*at] = (
                Span { start: first_signal as u32, end: places.signals.0 as u32 },
                Span { start: first_registered as u32, end: places.registered.0 as u32 },
            );
            let scratch = &mut places.scratch;
            scratch.reals = scratch.reals.max(ports.scratch.reals);
            scratch.complexes = scratch.complexes.max(ports.scratch.complexes);
            scratch.words = scratch.words.max(ports.scratch.words);
        }
        places
    }
}

/// Filters, and the sources of every input.
struct Wires {
    lowpasses: Vec<LowpassPlan>,
    filters: Vec<FilterPlan>,
    /// Indexed by node and input.
    sources: Vec<Vec<Vec<Slot>>>,
    /// Registered outputs, then filters.
    held: Cursor,
}

impl Wires {
    /// Connections from one output with the same synapse share a filter.
    fn of(checked: &Checked, places: &Places) -> Self {
        let mut held = Cursor(places.registered.0);
        let (mut lowpasses, mut filters) = (Vec::new(), Vec::new());
        let mut shared: HashMap<(usize, usize), Vec<(Synapse, Span)>> = HashMap::new();
        let mut sources: Vec<Vec<Vec<Slot>>> =
            checked.nodes.iter().map(|n| vec![Vec::new(); n.ports.inputs.len()]).collect();
        for edge in &checked.edges {
            let out = places.outs[edge.from.0][edge.from.1];
            let settles = checked.nodes[edge.to.0].ports.inputs[edge.to.1].at_settle;
            let slot = match edge.via {
                Synapse::None if out.registered && settles => Slot::Settled(out.span),
                Synapse::None if out.registered => Slot::Held(out.span),
                Synapse::None => Slot::Signal(out.span),
                via => {
                    let others = shared.entry(edge.from).or_default();
                    let equal = others.iter().find(|(synapse, _)| *synapse == via);
                    Slot::Held(equal.map(|(_, output)| *output).unwrap_or_else(|| {
                        let (width, source) = (out.span.len() as u32, Source::of(out));
                        // The checks have made it before.
                        let filter = Filter::of_connection(via, checked.time).unwrap_or_default();
                        let held = held.take(filter.state_len(out.span.len()));
                        let output = Span { start: held.start, end: held.start + width };
                        match filter.decay() {
                            Some(decay) => lowpasses.push(LowpassPlan { source, held, decay }),
                            None => filters.push(FilterPlan { source, held, filter }),
                        }
                        others.push((via, output));
                        output
                    }))
                }
            };
            sources[edge.to.0][edge.to.1].push(slot);
        }
        Self { lowpasses, filters, sources, held }
    }
}

/// The plans of all nodes, in the order of emits.
#[derive(Default)]
struct Plans {
    emits: Vec<PhasePlan>,
    advances: Vec<PhasePlan>,
    settles: Vec<PhasePlan>,
    divided: Vec<PhasePlan>,
    parts: Vec<PartPlan>,
    part_states: Cursor,
    world: Option<WorldPlan>,
    outs: Vec<OutSlot>,
    slots: Vec<Slot>,
    gathers: Vec<GatherPlan>,
    gather_sources: Vec<Slot>,
    gathered: Cursor,
    reals: Cursor,
    words: Cursor,
    longs: Cursor,
}

impl Plans {
    fn of(
        nodes: Vec<CheckedNode>,
        order: &[usize],
        places: &Places,
        wires: &Wires,
    ) -> (Self, Vec<NodeInfo>, Vec<Arc<dyn Node>>) {
        let mut plans = Self::default();
        let (mut infos, mut bodies) = (Vec::new(), Vec::new());
        let mut waiting: Vec<Option<CheckedNode>> = nodes.into_iter().map(Some).collect();
        for at in order {
            let Some(node) = waiting[*at].take() else { continue };
            let (outs, own) = (&places.outs[*at], places.own[*at]);
            let first = plans.parts.len() as u32;
            let emit = plans.add(&node, infos.len(), (outs, own), &wires.sources[*at]);
            infos.push(NodeInfo {
                path: node.path,
                outs: outs.clone(),
                registered: own.1,
                reals: emit.reals,
                words: emit.words,
                longs: emit.longs,
                parts: Span { start: first, end: plans.parts.len() as u32 },
                ports: node.ports,
            });
            bodies.push(node.body);
        }
        (plans, infos, bodies)
    }

    /// Adds the plans of the next node and returns its plan for emit.
    fn add(
        &mut self,
        node: &CheckedNode,
        index: usize,
        (outs, (signals, registered)): (&[OutSlot], (Span, Span)),
        sources: &[Vec<Slot>],
    ) -> PhasePlan {
        let ports = &node.ports;
        let (inputs, [at_emit, at_advance]) = self.inputs(ports, sources);
        let emit_slots: Vec<Slot> = ports
            .inputs
            .iter()
            .zip(&inputs)
            .map(|(input, slot)| if input.at_advance { Slot::OtherPhase } else { *slot })
            .collect();
        let stateful = ports.state != StateSpec::default();
        let scratch = &ports.scratch;
        let scratch = [scratch.reals, scratch.complexes, scratch.words];
        let emit = PhasePlan {
            node: index as u32,
            own: signals,
            outs: append(&mut self.outs, outs),
            slots: append(&mut self.slots, &emit_slots),
            gathers: append(&mut self.gathers, &at_emit),
            stateful,
            reals: self.reals.take(ports.state.reals),
            words: self.words.take(ports.state.words),
            longs: self.longs.take(ports.state.longs),
            scratch: scratch.map(|n| n as u32),
        };
        let advance = PhasePlan {
            own: registered,
            slots: append(&mut self.slots, &inputs),
            gathers: append(&mut self.gathers, &at_advance),
            ..emit
        };
        if signals.len() > 0 {
            self.emits.push(emit);
        }
        if let Some(parts) = node.body.parts() {
            self.add_parts(parts);
            self.divided.push(advance);
        } else if node.world {
            self.world = Some(WorldPlan {
                node: index,
                sense: registered,
                slots: advance.slots,
                gathers: advance.gathers,
                command_width: ports.inputs.iter().map(|i| i.shape.width).sum(),
            });
        } else if ports.settles() {
            self.settles.push(advance);
        } else if stateful
            || ports.always_advance
            || registered.len() > 0
            || ports.inputs.iter().any(|i| i.at_advance)
        {
            self.advances.push(advance);
        }
        emit
    }

    /// Adds the parts of the next node with parts.
    fn add_parts(&mut self, parts: &dyn Parts) {
        let mut units = Cursor::default();
        for index in 0..parts.count() {
            let spec = parts.part(index);
            self.parts.push(PartPlan {
                divided: self.divided.len() as u32,
                index: index as u32,
                rank: spec.rank as u32,
                work: spec.work.clamp(1, LIMIT) as u32,
                state: self.part_states.take(spec.state),
                units: units.take(spec.units),
                results: Span { start: 0, end: spec.results as u32 },
                events: 0,
            });
        }
    }

    /// Returns where the node reads its inputs, and the sums to compute before its emit and before its advance.
    fn inputs(
        &mut self,
        ports: &PortDecl,
        sources: &[Vec<Slot>],
    ) -> (Vec<Slot>, [Vec<GatherPlan>; 2]) {
        let mut slots = Vec::with_capacity(ports.inputs.len());
        let mut gathers = [Vec::new(), Vec::new()];
        let emits = ports.outputs.iter().any(|output| !output.registered);
        for (input, feeds) in ports.inputs.iter().zip(sources) {
            slots.push(match feeds.as_slice() {
                [only] if !matches!(only, Slot::Settled(_)) => *only,
                many => {
                    let into = self.gathered.take(input.shape.width);
                    if !many.is_empty() {
                        let sources = append(&mut self.gather_sources, many);
                        let late = input.at_advance || !emits;
                        gathers[usize::from(late)].push(GatherPlan { into, sources });
                    }
                    Slot::Gathered(into)
                }
            });
        }
        (slots, gathers)
    }
}

/// Number of words with which every rank begins what it sends in a tick.
pub(crate) const HEADER: usize = 4;

/// Gives the results of every part their place, and returns the size of all. The results of a rank stand together, as
/// it sends them.
fn place_results(plans: &mut Plans, spike_probes: &[usize], ranks: Option<&Ranks>) -> usize {
    let mut results = Cursor::default();
    let (count, header) = ranks.map_or((1, 0), |ranks| (ranks.ranks(), HEADER));
    let all_events = ranks.is_some_and(Ranks::sends_events);
    let mut of_rank: Vec<Vec<usize>> = vec![Vec::new(); count];
    for (index, part) in plans.parts.iter_mut().enumerate() {
        part.rank %= count as u32;
        of_rank[part.rank as usize].push(index);
    }
    for parts in of_rank {
        results.take(header);
        for index in parts {
            let part = &mut plans.parts[index];
            let node = plans.divided[part.divided as usize].node as usize;
            if all_events || spike_probes.contains(&node) {
                part.events = part.units.len().div_ceil(32) as u32;
            }
            part.results = results.take(part.results.len() + part.events as usize);
        }
    }
    results.0
}

fn probe_plans(
    probes: &[ProbeDraft],
    time: Timebase,
    (places, rank): (&Places, &[usize]),
    filters: &mut Cursor,
) -> Vec<ProbePlan> {
    let plan = |probe: &ProbeDraft| {
        let out = places.outs[probe.of.0][probe.of.1];
        let filter = match probe.spec.filter {
            Synapse::None => None,
            synapse => Filter::new(synapse, time).ok(),
        };
        ProbePlan {
            source: Source::of(out),
            period_ticks: time.ticks(probe.spec.period).unwrap_or(1).max(1),
            state: filter.as_ref().map_or_else(Span::default, |filter| {
                filters.take(filter.state_len(out.span.len()))
            }),
            filter,
            capacity: probe.spec.capacity,
            node: rank[probe.of.0],
            output: probe.of.1,
        }
    };
    probes.iter().map(plan).collect()
}

/// Hashes everything that a checkpoint must share with its graph: the build seed, the tick, the nodes with their ports
/// and parameters, the connections, and the filters of the probes.
fn fingerprint(checked: &Checked) -> u64 {
    let mut hash = Fingerprint::default();
    hash.text("symbolt graph 3")
        .number(checked.seed.value())
        .number(checked.time.tick().as_micros());
    for node in &checked.nodes {
        let state = node.ports.state;
        hash.text(&node.path).text(node.body.type_name());
        let in_parts: usize = node
            .body
            .parts()
            .map_or(0, |parts| (0..parts.count()).map(|part| parts.part(part).state).sum());
        for count in [state.reals + in_parts, state.words, state.longs] {
            hash.number(count as u64);
        }
        for port in &node.ports.inputs {
            hash.text(&port.name).text(&port.kind_label);
            port.shape.fingerprint(&mut hash);
            hash.number(u64::from(port.at_advance) + u64::from(port.at_settle));
        }
        for port in &node.ports.outputs {
            hash.text(&port.name).text(&port.kind_label);
            port.shape.fingerprint(&mut hash);
            hash.number(u64::from(port.registered));
        }
        node.body.fingerprint(&mut hash);
    }
    for edge in &checked.edges {
        for number in [edge.from.0, edge.from.1, edge.to.0, edge.to.1] {
            hash.number(number as u64);
        }
        edge.via.fingerprint(&mut hash);
    }
    for probe in &checked.probes {
        hash.number(probe.of.0 as u64).number(probe.of.1 as u64);
        probe.spec.filter.fingerprint(&mut hash);
    }
    for node in &checked.spike_probes {
        hash.number(*node as u64);
    }
    hash.value()
}
