//! Running a graph: the tick, runs and their reports, reset.
//!
//! One tick: emit in topological order, advance, latch registered outputs and edge filters, check
//! that all numbers are finite, step the world if it is due, sample the probes. Nothing in a tick
//! allocates; storage for probes that keep everything is reserved between blocks of ticks.
//!
//! Cost: a node that copies one number takes about 20 ns a tick, a filter about 0.1 ns a
//! component (`graph/tick` in the benches).

use std::marker::PhantomData;
use std::ops::ControlFlow;
use std::sync::Arc;

use super::arena::{Arenas, ScratchArena};
use super::error::SimError;
use super::graph::{EventSource, Graph, OutputRef, Source};
use super::handle::Out;
use super::kind::Kind;
use super::node::{
    AdvanceIo, EmitIo, Inputs, Outputs, Real, Scratch, Slot, State, StateMut, StepCx,
};
use super::probe::{Capacity, ProbeId, Recording, Samples};
use super::seed::Seed;
use super::span::Span;
use super::synapse::latch;
use super::threads::Threads;
use super::time::SimDuration;
use super::world::World;

/// What a run brings beside the graph.
pub struct RunConfig {
    /// The run seed: noise and the world.
    pub seed: Seed,
    /// A multiplier of every noise amplitude in the graph; 1 leaves them as described, 0 must
    /// give exactly the noise-free graph.
    pub noise: Real,
    /// The world, if the graph has a link to one.
    pub world: Option<Box<dyn World>>,
    /// Who computes a tick; it decides the speed and no bit of the result.
    pub threads: Threads,
}

impl Default for RunConfig {
    fn default() -> Self {
        Self { seed: Seed::new(1), noise: 1.0, world: None, threads: Threads::Serial }
    }
}

impl RunConfig {
    /// A run with `seed` and noise as described, without a world.
    pub fn seeded(seed: Seed) -> Self {
        Self { seed, ..Self::default() }
    }

    /// Adds a world.
    pub fn in_world(mut self, world: impl World + 'static) -> Self {
        self.world = Some(Box::new(world));
        self
    }

    /// Sets who computes a tick.
    pub fn with_threads(mut self, threads: Threads) -> Self {
        self.threads = threads;
        self
    }

    /// Sets the multiplier of every noise amplitude.
    pub fn with_noise(mut self, scale: Real) -> Self {
        self.noise = scale;
        self
    }
}

/// Why a run came to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// The time given was used up.
    TimeUp,
    /// The caller's condition held; the caller's own word for it.
    Condition(&'static str),
}

/// What a stop condition returns: go on, or stop and why.
pub type Stop = ControlFlow<StopReason>;

/// How a run went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunReport {
    /// Why it ended.
    pub reason: StopReason,
    /// How many ticks it took.
    pub ticks: u64,
    /// How much simulated time that is.
    pub span: SimDuration,
}

/// What a stop condition can look at after a tick.
pub struct SimView<'a> {
    sim: &'a Simulator,
}

impl<'a> SimView<'a> {
    /// Ticks done since the start.
    pub fn tick(&self) -> u64 {
        self.sim.tick
    }

    /// Simulated time since the start.
    pub fn time(&self) -> SimDuration {
        self.sim.graph.time.span(self.sim.tick)
    }

    /// The values of an output after this tick (a registered output: as just written). Empty for
    /// a handle of another graph.
    pub fn value<K: Kind>(&self, of: &Out<K>) -> K::Value<'a> {
        self.sim.value(of)
    }

    /// As [`Simulator::event`].
    pub fn event(&self, of: EventSource, unit: usize) -> bool {
        self.sim.event(of, unit)
    }

    /// The world of this run.
    pub fn world(&self) -> Option<&'a dyn World> {
        self.sim.world()
    }
}

/// A running graph: shares the graph, owns every number that changes.
pub struct Simulator {
    pub(crate) graph: Arc<Graph>,
    pub(crate) arenas: Arenas,
    pub(crate) tick: u64,
    pub(crate) seed: Seed,
    pub(crate) noise: Real,
    pub(crate) world: Option<Box<dyn World>>,
    threads: Threads,
    world_ticks: u64,
    node_seeds: Vec<Seed>,
    recordings: Vec<Recording>,
    command: Vec<Real>,
}

/// Ticks between two reservations of probe storage.
const BLOCK: u64 = 4096;

impl Simulator {
    /// A run of `graph` from its first tick, its world reset.
    ///
    /// # Errors
    /// If the run's world does not fit the graph's link, its period is no whole number of ticks,
    /// the noise scale is not a finite number of at least 0, or the world cannot be reset.
    pub fn new(graph: Arc<Graph>, run: RunConfig) -> Result<Self, SimError> {
        if !run.noise.is_finite() || run.noise < 0.0 {
            return Err(SimError::BadNoise { scale: run.noise });
        }
        let (linked, given) = (graph.world.is_some(), run.world.is_some());
        if linked != given {
            return Err(SimError::WorldMissing { linked, given });
        }
        let world_ticks = match &run.world {
            Some(world) => fit_world(&graph, &**world)?,
            None => 0,
        };
        let command = vec![0.0; graph.world.as_ref().map_or(0, |w| w.command_width)];
        let recordings = graph.probes.iter().map(|_| Recording::default()).collect();
        let mut sim = Self {
            arenas: Arenas::new(&graph.sizes),
            graph,
            tick: 0,
            seed: run.seed,
            noise: run.noise,
            world: run.world,
            threads: run.threads,
            world_ticks,
            node_seeds: Vec::new(),
            recordings,
            command,
        };
        sim.reseed(run.seed);
        sim.reset()?;
        Ok(sim)
    }

    /// Goes back to the first tick: exactly a fresh run, recordings emptied.
    ///
    /// # Errors
    /// If the world cannot be reset.
    pub fn reset(&mut self) -> Result<(), SimError> {
        self.tick = 0;
        self.clear_recordings();
        let Self { graph, arenas, .. } = self;
        arenas.clear();
        for (node, body) in graph.nodes.iter().zip(&graph.bodies) {
            let mut state = StateMut {
                reals: &mut arenas.reals[node.reals.of()],
                words: &mut arenas.words[node.words.of()],
                longs: &mut arenas.longs[node.longs.of()],
            };
            let mut registered = Outputs {
                spans: &node.outs,
                base: node.registered.start as usize,
                registered: true,
                values: &mut arenas.registered[node.registered.of()],
            };
            body.init(&mut state, &mut registered);
        }
        if let (Some(link), Some(world)) = (&self.graph.world, &mut self.world) {
            world
                .reset(self.seed.derive("", "world"))
                .map_err(|source| SimError::World { tick: 0, source })?;
            world.sense(&mut self.arenas.registered[link.sense.of()]);
        }
        self.arenas.commit_registered();
        Ok(())
    }

    /// Makes `seed` the run seed; the world keeps its state.
    pub(crate) fn reseed(&mut self, seed: Seed) {
        self.seed = seed;
        self.node_seeds = self.graph.nodes.iter().map(|n| seed.derive(&n.path, "noise")).collect();
    }

    /// The graph.
    pub fn graph(&self) -> &Arc<Graph> {
        &self.graph
    }

    /// Ticks done since the start.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Simulated seconds since the start.
    pub fn time_s(&self) -> f64 {
        self.tick as f64 * self.graph.time.dt_s()
    }

    /// The world of this run.
    pub fn world(&self) -> Option<&dyn World> {
        self.world.as_deref()
    }

    /// Runs for `span`.
    ///
    /// # Errors
    /// If `span` is no whole number of ticks, a node or the world fails, or a value is not finite.
    pub fn run_for(&mut self, span: SimDuration) -> Result<RunReport, SimError> {
        self.run_until(span, |_| ControlFlow::Continue(()))
    }

    /// Runs until `stop` breaks, looked at after every tick, or for `limit` at most. With
    /// [`Threads::Pool`] `stop` may be called on another thread than the caller's.
    ///
    /// # Errors
    /// As [`Simulator::run_for`].
    pub fn run_until(
        &mut self,
        limit: SimDuration,
        stop: impl FnMut(SimView<'_>) -> Stop + Send,
    ) -> Result<RunReport, SimError> {
        let limit = self.graph.time.ticks(limit)?;
        let outside = rayon::current_thread_index().is_none();
        // Entering the pool once a run costs some microseconds; a node that shared its work from
        // outside would pay them in every tick.
        if outside && self.threads() == Threads::Pool && rayon::current_num_threads() > 1 {
            rayon::scope(|_| self.run_ticks(limit, stop))
        } else {
            self.run_ticks(limit, stop)
        }
    }

    /// Who computes a tick of this graph.
    fn threads(&self) -> Threads {
        if self.graph.parallel { self.threads } else { Threads::Serial }
    }

    fn run_ticks(
        &mut self,
        limit: u64,
        mut stop: impl FnMut(SimView<'_>) -> Stop,
    ) -> Result<RunReport, SimError> {
        let mut done = 0;
        let mut reason = StopReason::TimeUp;
        'run: while done < limit {
            let block = BLOCK.min(limit - done);
            self.reserve(block)?;
            for _ in 0..block {
                self.step()?;
                done += 1;
                if let ControlFlow::Break(why) = stop(SimView { sim: self }) {
                    reason = why;
                    break 'run;
                }
            }
        }
        Ok(RunReport { reason, ticks: done, span: self.graph.time.span(done) })
    }

    /// The values of an output after the last tick (a registered output: as just written). Empty
    /// for a handle of another graph.
    pub fn value<K: Kind>(&self, of: &Out<K>) -> K::Value<'_> {
        K::value(self.graph.source(of).map_or(&[], |source| self.arenas.source(source)))
    }

    /// The values of an output found by path.
    pub fn value_of(&self, of: OutputRef) -> &[Real] {
        self.arenas.source(of.source)
    }

    /// Whether a unit of a node of this graph, counted from 0, had an event in the last tick.
    /// `false` for a unit that the node does not have.
    pub fn event(&self, of: EventSource, unit: usize) -> bool {
        let (Some(node), Some(body)) =
            (self.graph.nodes.get(of.node), self.graph.bodies.get(of.node))
        else {
            return false;
        };
        let state = State {
            reals: &self.arenas.reals[node.reals.of()],
            words: &self.arenas.words[node.words.of()],
            longs: &self.arenas.longs[node.longs.of()],
        };
        unit < body.units() && self.tick > 0 && body.event(&state, unit)
    }

    /// What a probe has recorded. Empty for a handle of another graph.
    pub fn samples<K: Kind>(&self, probe: &ProbeId<K>) -> Samples<'_, K> {
        static NONE: Recording = Recording { ticks: Vec::new(), values: Vec::new(), head: 0 };
        let own = probe.builder == self.graph.builder;
        let (recording, width) = match self.graph.probes.get(probe.index) {
            Some(plan) if own => (&self.recordings[probe.index], plan.source.span().len()),
            _ => (&NONE, 0),
        };
        Samples { recording, width, dt_s: self.graph.time.dt_s(), kind: PhantomData }
    }

    /// Forgets what all probes have recorded.
    pub fn clear_recordings(&mut self) {
        self.recordings.iter_mut().for_each(Recording::clear);
    }

    /// Makes room for the samples of `ticks` more ticks.
    fn reserve(&mut self, ticks: u64) -> Result<(), SimError> {
        for (plan, recording) in self.graph.probes.iter().zip(&mut self.recordings) {
            let coming = (ticks / plan.period_ticks + 1) as usize;
            let more = match plan.capacity {
                Capacity::All => coming,
                Capacity::Last(most) => most.saturating_sub(recording.ticks.len()).min(coming),
            };
            let width = plan.source.span().len();
            let room = recording
                .ticks
                .try_reserve(more)
                .and_then(|()| recording.values.try_reserve(more.saturating_mul(width)));
            if room.is_err() {
                let node = &self.graph.nodes[plan.node];
                let port = format!("{}.{}", node.path, node.ports.outputs[plan.output].name);
                return Err(SimError::ProbeStorage { port, samples: more });
            }
        }
        Ok(())
    }

    /// One tick.
    fn step(&mut self) -> Result<(), SimError> {
        let threads = self.threads();
        let Self { graph, arenas, tick, noise, node_seeds, .. } = self;
        let tick = *tick;
        let mut cx = StepCx {
            tick,
            time: graph.time,
            noise_scale: *noise,
            threads,
            node_seed: Seed::new(0),
            graph: PhantomData,
        };
        // Locals that nothing else can alias: without them every access goes through two pointers.
        let (bodies, slots, outs) = (&graph.bodies[..], &graph.slots[..], &graph.outs[..]);
        let seeds = &node_seeds[..];
        let (signals, registered) = (&mut arenas.signals[..], &mut arenas.registered[..]);
        let (held, gathered) = (&arenas.held[..], &mut arenas.gathered[..]);
        let (reals, words) = (&mut arenas.reals[..], &mut arenas.words[..]);
        let (longs, scratch) = (&mut arenas.longs[..], &mut arenas.scratch);
        for plan in &graph.emits {
            let node = plan.node as usize;
            cx.node_seed = seeds[node];
            let (earlier, own) = signals.split_at_mut(plan.own.start as usize);
            if plan.gathers.len() > 0 {
                graph.gather(plan.gathers, earlier, held, gathered);
            }
            let mut io = EmitIo {
                inputs: Inputs { slots: &slots[plan.slots.of()], signals: earlier, held, gathered },
                outputs: Outputs {
                    spans: &outs[plan.outs.of()],
                    base: plan.own.start as usize,
                    registered: false,
                    values: &mut own[..plan.own.len()],
                },
                state: match plan.stateful {
                    true => State {
                        reals: &reals[plan.reals.of()],
                        words: &words[plan.words.of()],
                        longs: &longs[plan.longs.of()],
                    },
                    false => State { reals: &[], words: &[], longs: &[] },
                },
                scratch: scratch.lend(plan.scratch),
            };
            bodies[node].emit(&cx, &mut io);
        }
        for plan in &graph.advances {
            let node = plan.node as usize;
            cx.node_seed = seeds[node];
            if plan.gathers.len() > 0 {
                graph.gather(plan.gathers, signals, held, gathered);
            }
            let mut io = AdvanceIo {
                inputs: Inputs { slots: &slots[plan.slots.of()], signals, held, gathered },
                outputs: Outputs {
                    spans: &outs[plan.outs.of()],
                    base: plan.own.start as usize,
                    registered: true,
                    values: &mut registered[plan.own.of()],
                },
                state: match plan.stateful {
                    true => StateMut {
                        reals: &mut reals[plan.reals.of()],
                        words: &mut words[plan.words.of()],
                        longs: &mut longs[plan.longs.of()],
                    },
                    false => StateMut { reals: &mut [], words: &mut [], longs: &mut [] },
                },
                scratch: scratch.lend(plan.scratch),
            };
            if let Err(source) = bodies[node].advance(&cx, &mut io) {
                let path = graph.nodes[node].path.clone();
                return Err(SimError::Node { path, tick, source });
            }
        }
        for filter in &graph.filters {
            let input = match filter.source {
                Source::Signal(span) => &arenas.signals[span.of()],
                Source::Registered(span) => &arenas.registered[span.of()],
            };
            latch(filter.decay, input, &mut arenas.held[filter.held.of()]);
        }
        if !arenas.all_finite() {
            return Err(self.blame_non_finite());
        }
        self.step_world()?;
        self.arenas.commit_registered();
        self.sample_probes();
        self.tick += 1;
        Ok(())
    }

    /// Steps the world at the end of its period and shows what it senses.
    fn step_world(&mut self) -> Result<(), SimError> {
        let tick = self.tick;
        let (Some(link), Some(world)) = (&self.graph.world, &mut self.world) else {
            return Ok(());
        };
        if !(tick + 1).is_multiple_of(self.world_ticks) {
            return Ok(());
        }
        self.graph.gather(
            link.gathers,
            &self.arenas.signals,
            &self.arenas.held,
            &mut self.arenas.gathered,
        );
        let inputs = Inputs {
            slots: &self.graph.slots[link.slots.of()],
            signals: &self.arenas.signals,
            held: &self.arenas.held,
            gathered: &self.arenas.gathered,
        };
        let mut at = 0;
        for index in 0..link.slots.len() {
            let value = inputs.get(index);
            self.command[at..at + value.len()].copy_from_slice(value);
            at += value.len();
        }
        world.advance(&self.command).map_err(|source| SimError::World { tick, source })?;
        world.sense(&mut self.arenas.registered[link.sense.of()]);
        let sensed = &self.arenas.registered[link.sense.of()];
        if sensed.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(self.blame_non_finite()) }
    }

    fn sample_probes(&mut self) {
        let end = self.tick + 1;
        for (plan, recording) in self.graph.probes.iter().zip(&mut self.recordings) {
            let raw = match plan.source {
                Source::Signal(span) => &self.arenas.signals[span.of()],
                Source::Registered(span) => &self.arenas.registered[span.of()],
            };
            let value = match plan.decay {
                Some(decay) => {
                    let filtered = &mut self.arenas.probe_filters[plan.filter.of()];
                    latch(decay, raw, filtered);
                    &*filtered
                }
                None => raw,
            };
            if end.is_multiple_of(plan.period_ticks) {
                recording.push(end, value, plan.capacity);
            }
        }
    }

    /// Finds the first port that holds a value that is not finite.
    fn blame_non_finite(&self) -> SimError {
        let tick = self.tick;
        for node in &self.graph.nodes {
            for (out, decl) in node.outs.iter().zip(&node.ports.outputs) {
                let arena =
                    if out.registered { &self.arenas.registered } else { &self.arenas.signals };
                if let Some(value) = arena[out.span.of()].iter().find(|v| !v.is_finite()) {
                    return SimError::NonFinite {
                        path: node.path.clone(),
                        port: decl.name.clone(),
                        value: *value,
                        tick,
                    };
                }
            }
        }
        // Finite outputs of both signs near the largest float can still overflow in a filter.
        SimError::NonFinite { path: "an edge".into(), port: "filter".into(), value: f32::NAN, tick }
    }
}

/// How many ticks a period of `world` lasts, if it fits the link of `graph`.
fn fit_world(graph: &Graph, world: &dyn World) -> Result<u64, SimError> {
    let Some(link) = &graph.world else {
        return Err(SimError::WorldMissing { linked: false, given: true });
    };
    let shapes = [
        ("sense", world.sense_width(), link.sense.len()),
        ("command", world.command_width(), link.command_width),
    ];
    for (what, has, needs) in shapes {
        if has != needs {
            let link = graph.nodes[link.node].path.clone();
            return Err(SimError::WorldShape { link, what, world: has, graph: needs });
        }
    }
    Ok(graph.time.ticks(world.period())?.max(1))
}

impl Graph {
    /// Adds sources up for a node about to run, in the order of their paths.
    #[inline]
    fn gather(&self, which: Span, signals: &[Real], held: &[Real], gathered: &mut [Real]) {
        for plan in &self.gathers[which.of()] {
            let into = &mut gathered[plan.into.of()];
            into.fill(0.0);
            for source in &self.gather_sources[plan.sources.of()] {
                let values = match source {
                    Slot::Signal(span) => &signals[span.of()],
                    Slot::Held(span) => &held[span.of()],
                    Slot::Gathered(_) | Slot::OtherPhase => continue,
                };
                for (sum, value) in into.iter_mut().zip(values) {
                    *sum += value;
                }
            }
        }
    }
}

impl ScratchArena {
    #[inline]
    fn lend(&mut self, lengths: [u32; 4]) -> Scratch<'_> {
        if lengths == [0; 4] {
            return Scratch {
                reals: &mut [],
                doubles: &mut [],
                complexes: &mut [],
                words: &mut [],
            };
        }
        let [reals, doubles, complexes, words] = lengths.map(|n| n as usize);
        Scratch {
            reals: &mut self.reals[..reals],
            doubles: &mut self.doubles[..doubles],
            complexes: &mut self.complexes[..complexes],
            words: &mut self.words[..words],
        }
    }
}
