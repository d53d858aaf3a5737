//! Lays a sound description out in arenas: where every signal, filter and state stands.

use std::collections::HashMap;

use super::draft::{EdgeDraft, ProbeDraft};
use super::error::BuildError;
use super::fingerprint::Fingerprint;
use super::graph::{
    EdgeInfo, FilterPlan, GatherPlan, Graph, NodeInfo, PhasePlan, ProbePlan, Sizes, Source,
    WorldPlan,
};
use super::node::{Node, OutSlot, Slot};
use super::port::{PortDecl, ScratchSpec, StateSpec};
use super::seed::Seed;
use super::span::Span;
use super::synapse::Synapse;
use super::time::{SimDuration, Timebase};

/// A node that passed the checks.
pub(crate) struct SoundNode {
    pub path: String,
    pub body: Box<dyn Node>,
    pub ports: PortDecl,
    pub world: bool,
}

/// A description that passed the checks.
pub(crate) struct Sound {
    pub builder: u64,
    /// By path.
    pub nodes: Vec<SoundNode>,
    /// By target, then source path.
    pub edges: Vec<EdgeDraft>,
    pub probes: Vec<ProbeDraft>,
    pub order: Vec<usize>,
    pub time: Timebase,
    pub seed: Seed,
    /// From the builder's node number to the place in `nodes`.
    pub moved: Vec<usize>,
}

/// Hands out consecutive ranges.
#[derive(Default)]
struct Tape(usize);

impl Tape {
    fn take(&mut self, len: usize) -> Span {
        let start = self.0;
        self.0 += len;
        // Sizes are checked against the limit before any span is used.
        Span { start: start as u32, end: self.0 as u32 }
    }
}

/// Puts `items` at the end of `all` and says where they stand.
fn append<T: Clone>(all: &mut Vec<T>, items: &[T]) -> Span {
    let start = all.len();
    all.extend_from_slice(items);
    Span { start: start as u32, end: all.len() as u32 }
}

/// Most numbers in one arena: spans are 32-bit.
const LIMIT: usize = u32::MAX as usize;

pub(crate) fn lay_out(sound: Sound) -> Result<Graph, BuildError> {
    let fingerprint = fingerprint(&sound);
    let parallel = sound.nodes.iter().any(|node| node.ports.parallel);
    let Sound { builder, nodes, edges, probes, order, time, seed, moved } = sound;
    let mut signals = Tape::default();
    let mut registered = Tape::default();
    let (mut reals, mut words, mut longs) = (Tape::default(), Tape::default(), Tape::default());
    let mut outs: Vec<Vec<OutSlot>> = vec![Vec::new(); nodes.len()];
    let mut own = vec![(Span::default(), Span::default()); nodes.len()];
    let mut scratch = ScratchSpec::default();
    for at in &order {
        let ports = &nodes[*at].ports;
        let (first_signal, first_registered) = (signals.0, registered.0);
        for output in &ports.outputs {
            let tape = if output.registered { &mut registered } else { &mut signals };
            let span = tape.take(output.shape.width);
            outs[*at].push(OutSlot { span, registered: output.registered });
        }
        own[*at] = (
            Span { start: first_signal as u32, end: signals.0 as u32 },
            Span { start: first_registered as u32, end: registered.0 as u32 },
        );
        scratch.reals = scratch.reals.max(ports.scratch.reals);
        scratch.doubles = scratch.doubles.max(ports.scratch.doubles);
        scratch.complexes = scratch.complexes.max(ports.scratch.complexes);
        scratch.words = scratch.words.max(ports.scratch.words);
    }

    // Filters stand behind the registered outputs in the held arena; edges from one source with
    // one time constant share a filter.
    let mut held = Tape(registered.0);
    let mut filters: Vec<FilterPlan> = Vec::new();
    let mut shared: HashMap<((usize, usize), SimDuration), usize> = HashMap::new();
    let mut sources: Vec<Vec<Vec<Slot>>> =
        nodes.iter().map(|n| vec![Vec::new(); n.ports.inputs.len()]).collect();
    for edge in &edges {
        let out = outs[edge.from.0][edge.from.1];
        let slot = match edge.via {
            Synapse::None if out.registered => Slot::Held(out.span),
            Synapse::None => Slot::Signal(out.span),
            Synapse::Lowpass { tau } => {
                let index = *shared.entry((edge.from, tau)).or_insert_with(|| {
                    filters.push(FilterPlan {
                        source: Source::of(out),
                        held: held.take(out.span.len()),
                        decay: edge.via.decay(time.dt_s()).unwrap_or_default(),
                    });
                    filters.len() - 1
                });
                Slot::Held(filters[index].held)
            }
        };
        sources[edge.to.0][edge.to.1].push(slot);
    }

    let mut gathered = Tape::default();
    let mut graph_outs = Vec::new();
    let mut graph_slots = Vec::new();
    let mut gathers = Vec::new();
    let mut gather_sources = Vec::new();
    let (mut emits, mut advances) = (Vec::new(), Vec::new());
    let (mut infos, mut bodies) = (Vec::new(), Vec::new());
    let mut world = None;
    let mut place = vec![0; nodes.len()];
    for (rank, at) in order.iter().enumerate() {
        place[*at] = rank;
    }
    let mut waiting: Vec<Option<SoundNode>> = nodes.into_iter().map(Some).collect();
    for at in &order {
        let Some(node) = waiting[*at].take() else { continue };
        let ports = &node.ports;
        let mut inputs = Vec::with_capacity(ports.inputs.len());
        let (mut at_emit, mut at_advance) = (Vec::new(), Vec::new());
        for (input, feeds) in ports.inputs.iter().zip(&sources[*at]) {
            inputs.push(match feeds.as_slice() {
                [only] => *only,
                many => {
                    let into = gathered.take(input.shape.width);
                    if !many.is_empty() {
                        let plan = GatherPlan { into, sources: append(&mut gather_sources, many) };
                        if input.at_advance { &mut at_advance } else { &mut at_emit }.push(plan);
                    }
                    Slot::Gathered(into)
                }
            });
        }
        let emit_slots: Vec<Slot> = ports
            .inputs
            .iter()
            .zip(&inputs)
            .map(|(input, slot)| if input.at_advance { Slot::OtherPhase } else { *slot })
            .collect();
        let (signal_span, registered_span) = own[*at];
        let narrow = |n: usize| n as u32;
        let emit = PhasePlan {
            node: narrow(infos.len()),
            own: signal_span,
            outs: append(&mut graph_outs, &outs[*at]),
            slots: append(&mut graph_slots, &emit_slots),
            gathers: append(&mut gathers, &at_emit),
            stateful: ports.state != StateSpec::default(),
            reals: reals.take(ports.state.reals),
            words: words.take(ports.state.words),
            longs: longs.take(ports.state.longs),
            scratch: [
                narrow(ports.scratch.reals),
                narrow(ports.scratch.doubles),
                narrow(ports.scratch.complexes),
                narrow(ports.scratch.words),
            ],
        };
        let advance = PhasePlan {
            own: registered_span,
            slots: append(&mut graph_slots, &inputs),
            gathers: append(&mut gathers, &at_advance),
            ..emit
        };
        if signal_span.len() > 0 {
            emits.push(emit);
        }
        if node.world {
            world = Some(WorldPlan {
                node: infos.len(),
                sense: registered_span,
                slots: advance.slots,
                gathers: advance.gathers,
                command_width: ports.inputs.iter().map(|i| i.shape.width).sum(),
            });
        } else if ports.state != StateSpec::default()
            || ports.always_advance
            || registered_span.len() > 0
            || ports.inputs.iter().any(|i| i.at_advance)
        {
            advances.push(advance);
        }
        infos.push(NodeInfo {
            path: node.path,
            outs: outs[*at].clone(),
            registered: registered_span,
            reals: emit.reals,
            words: emit.words,
            longs: emit.longs,
            ports: node.ports,
        });
        bodies.push(node.body);
    }

    let mut probe_filters = Tape::default();
    let probes: Vec<ProbePlan> = probes
        .iter()
        .map(|probe| {
            let out = outs[probe.of.0][probe.of.1];
            ProbePlan {
                source: Source::of(out),
                period_ticks: time.ticks(probe.spec.period).unwrap_or(1).max(1),
                decay: probe.spec.filter.decay(time.dt_s()),
                filter: match probe.spec.filter {
                    Synapse::None => Span::default(),
                    Synapse::Lowpass { .. } => probe_filters.take(out.span.len()),
                },
                capacity: probe.spec.capacity,
                node: place[probe.of.0],
                output: probe.of.1,
            }
        })
        .collect();

    let sizes = Sizes {
        signals: signals.0,
        registered: registered.0,
        held: held.0,
        gathered: gathered.0,
        reals: reals.0,
        words: words.0,
        longs: longs.0,
        probe_filters: probe_filters.0,
        scratch,
    };
    let largest =
        [sizes.signals, sizes.held, sizes.gathered, sizes.reals, sizes.words, sizes.longs]
            .into_iter()
            .max()
            .unwrap_or(0);
    if largest > LIMIT {
        return Err(BuildError::TooLarge { numbers: largest, limit: LIMIT });
    }
    let edges = edges
        .iter()
        .map(|e| EdgeInfo {
            from: (place[e.from.0], e.from.1),
            to: (place[e.to.0], e.to.1),
            via: e.via,
        })
        .collect();
    Ok(Graph {
        builder,
        handles: moved.iter().map(|sorted| place[*sorted]).collect(),
        nodes: infos,
        bodies,
        emits,
        advances,
        outs: graph_outs,
        slots: graph_slots,
        gathers,
        gather_sources,
        filters,
        probes,
        world,
        edges,
        sizes,
        time,
        seed,
        fingerprint,
        parallel,
    })
}

/// A hash of everything that decides what the numbers of a checkpoint mean: the clock, the nodes with their
/// ports and parameters, edges, and probes' filters.
fn fingerprint(sound: &Sound) -> u64 {
    let mut hash = Fingerprint::default();
    hash.text("symbolt graph 2").number(sound.seed.value()).number(sound.time.tick().as_micros());
    for node in &sound.nodes {
        let state = node.ports.state;
        hash.text(&node.path).text(node.body.type_name());
        for count in [state.reals, state.words, state.longs] {
            hash.number(count as u64);
        }
        for port in &node.ports.inputs {
            hash.text(&port.name).text(&port.kind_label);
            port.shape.fingerprint(&mut hash);
            hash.number(u64::from(port.at_advance));
        }
        for port in &node.ports.outputs {
            hash.text(&port.name).text(&port.kind_label);
            port.shape.fingerprint(&mut hash);
            hash.number(u64::from(port.registered));
        }
        node.body.fingerprint(&mut hash);
    }
    let synapse = |hash: &mut Fingerprint, via: Synapse| match via {
        Synapse::None => hash.number(0).value(),
        Synapse::Lowpass { tau } => hash.number(1).number(tau.as_micros()).value(),
    };
    for edge in &sound.edges {
        for number in [edge.from.0, edge.from.1, edge.to.0, edge.to.1] {
            hash.number(number as u64);
        }
        synapse(&mut hash, edge.via);
    }
    for probe in &sound.probes {
        hash.number(probe.of.0 as u64).number(probe.of.1 as u64);
        synapse(&mut hash, probe.spec.filter);
    }
    hash.value()
}
