//! The simulator: runs a graph and gives access to values and samples.
//!
//! Memory for samples is reserved between blocks of ticks, so that no tick allocates.

use std::any::Any;
use std::marker::PhantomData;
use std::ops::ControlFlow;
use std::sync::Arc;

use super::arena::Arenas;
use super::changes::{Changes, InForce};
use super::checkpoint::Checkpoint;
use super::config::{RunConfig, RunReport, Stop, StopReason};
use super::probe::{Recording, Samples};
use super::spikes::{SpikeRecording, Spikes};
use super::stage::{Clock, Random};
use super::world::World;
use crate::sim::build::graph::{EventSource, Graph, OutputRef};
use crate::sim::describe::builder::GraphBuilder;
use crate::sim::describe::handle::{NodePorts, Out};
use crate::sim::describe::io::{Inputs, Outputs, StateMut, StateRef};
use crate::sim::describe::kind::{Kind, Vector};
use crate::sim::describe::lowering::Lowering;
use crate::sim::describe::parts::Parts;
use crate::sim::describe::probe_spec::{Capacity, ProbeId, SpikeProbe};
use crate::sim::error::SimError;
use crate::sim::place::messages::Messages;
use crate::sim::place::ranks::Ranks;
use crate::sim::place::team::Team;
use crate::sim::real::{Real, Span};
use crate::sim::seed::Seed;
use crate::sim::time::{SimDuration, Timebase};

/// The view of a run that a stop condition gets after each tick.
pub struct SimView<'a> {
    sim: &'a Simulator,
}

impl<'a> SimView<'a> {
    /// Returns the view of a run as it stands.
    pub fn of(sim: &'a Simulator) -> Self {
        Self { sim }
    }

    /// Returns the number of completed ticks.
    pub fn tick(&self) -> u64 {
        self.sim.tick
    }

    /// Returns the simulated time since the start.
    pub fn time(&self) -> SimDuration {
        self.sim.graph.time.span(self.sim.tick)
    }

    /// Returns the value of an output in this tick. For a registered output this is the value just written, which
    /// readers see in the next tick. Empty for a handle of another graph.
    pub fn value<K: Kind>(&self, of: &Out<K>) -> K::Value<'a> {
        self.sim.value(of)
    }

    /// Returns the values of an output in this tick, as [`Simulator::value_of`] does.
    pub fn value_of(&self, of: OutputRef) -> &'a [Real] {
        self.sim.value_of(of)
    }

    /// Takes a checkpoint of the state after this tick.
    ///
    /// # Errors
    /// As [`Simulator::checkpoint`].
    pub fn checkpoint(&self) -> Result<Checkpoint, SimError> {
        self.sim.checkpoint()
    }

    /// Returns whether a unit had an event in this tick, as [`Simulator::event`] does.
    pub fn event(&self, of: EventSource, unit: usize) -> bool {
        self.sim.event(of, unit)
    }

    /// Returns the world of this run, if it has one.
    pub fn world(&self) -> Option<&'a dyn World> {
        self.sim.world()
    }

    pub(crate) fn look_at_parts(&self, look: impl FnMut(PartView<'_>)) {
        self.sim.look_at_parts(look);
    }
}

/// A part of a node after a tick.
pub(crate) struct PartView<'a> {
    /// Path of the node.
    pub path: &'a str,
    pub node: &'a dyn Any,
    pub part: usize,
    /// The node's inputs. Those that a synapse filters have their values of the next tick.
    pub inputs: Inputs<'a>,
    pub state: &'a [Real],
}

/// A run of a graph. It shares the graph and owns all numbers that change.
pub struct Simulator {
    pub(crate) graph: Arc<Graph>,
    pub(crate) arenas: Arenas,
    pub(crate) tick: u64,
    pub(crate) seed: Seed,
    pub(crate) noise: Real,
    pub(crate) world: Option<Box<dyn World>>,
    pub(in crate::sim) team: Team,
    /// What the ranks of the run tell one another.
    pub(in crate::sim) messages: Option<Messages>,
    pub(in crate::sim) world_ticks: u64,
    pub(in crate::sim) recordings: Vec<Recording>,
    pub(in crate::sim) spikes: Vec<SpikeRecording>,
    pub(in crate::sim) command: Vec<Real>,
    /// The interventions in force, and their form in a tick.
    pub(in crate::sim) changes: Changes,
    pub(in crate::sim) in_force: InForce,
    /// Run seed and noise scale of the start, to which a reset returns.
    start: (Seed, Real),
    /// Why the values are not those after a whole tick: empty as long as they change, and after a panic.
    pub(in crate::sim) interrupted: Option<String>,
}

impl GraphBuilder {
    /// Builds the graph with ticks of 1 ms and creates a run of it, with `seed` as the build seed and the run seed.
    ///
    /// Use [`build`](Self::build) and [`Simulator::new`] for another timebase, several runs of one graph, a world, threads
    /// or noise.
    ///
    /// # Errors
    /// [`SimError::Build`] with all faults of the description; otherwise as [`Simulator::new`].
    pub fn start(&self, plan: &dyn Lowering, seed: Seed) -> Result<Simulator, SimError> {
        let graph = self.build(Timebase::default(), plan, seed)?;
        Simulator::new(Arc::new(graph), RunConfig::seeded(seed))
    }

    /// Builds the graph and runs it for `duration`, as [`start`](Self::start) and [`Simulator::run_for`] do.
    ///
    /// # Errors
    /// As these two.
    pub fn run(
        &self,
        plan: &dyn Lowering,
        seed: Seed,
        duration: SimDuration,
    ) -> Result<Simulator, SimError> {
        let mut sim = self.start(plan, seed)?;
        sim.run_for(duration)?;
        Ok(sim)
    }
}

/// Ticks between two reservations of memory for samples.
const BLOCK: u64 = 4096;

impl Simulator {
    /// Creates a run of `graph` at tick 0 and resets the world. Allocates all memory of the run except the memory for
    /// samples.
    ///
    /// # Errors
    /// - [`SimError::BadNoise`] if the noise scale is negative or not finite;
    /// - [`SimError::WorldMissing`] if the graph links to a world and the run has none, or the reverse;
    /// - [`SimError::WorldShape`] if the world and the graph's link have different numbers of sense or command values;
    /// - [`SimError::Config`] if the world's period is not a whole number of ticks;
    /// - [`SimError::World`] if the world cannot be reset.
    pub fn new(graph: Arc<Graph>, run: RunConfig) -> Result<Self, SimError> {
        crate::sim::warn_if_unoptimised();
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
        let spikes = graph
            .spike_probes
            .iter()
            .map(|node| SpikeRecording { units: graph.bodies[*node].units(), ..Default::default() })
            .collect();
        let messages =
            graph.ranks.as_ref().map(|ranks| Messages::new(&graph, ranks)).transpose()?;
        let rank = graph.ranks.as_ref().map_or(0, Ranks::rank);
        let own = graph.parts.iter().filter(|part| part.rank as usize == rank);
        let (parts, work) =
            own.fold((0, 0), |(parts, work), part| (parts + 1, work + u64::from(part.work)));
        let mut sim = Self {
            arenas: Arenas::new(&graph.sizes),
            team: Team::new(&graph, rank, run.threads.count(parts, work)),
            messages,
            graph,
            tick: 0,
            seed: run.seed,
            noise: run.noise,
            world: run.world,
            world_ticks,
            recordings,
            spikes,
            command,
            changes: Changes::default(),
            in_force: InForce::default(),
            start: (run.seed, run.noise),
            interrupted: None,
        };
        sim.reset()?;
        Ok(sim)
    }

    /// Returns to tick 0, with the run seed and noise scale of [`new`](Self::new), ends all interventions and empties the
    /// recordings. The next run has the same bits as a run of a new simulator.
    ///
    /// # Errors
    /// [`SimError::World`] if the world cannot be reset.
    pub fn reset(&mut self) -> Result<(), SimError> {
        self.change(Self::start_again)
    }

    fn start_again(&mut self) -> Result<(), SimError> {
        self.tick = 0;
        (self.seed, self.noise) = self.start;
        self.put_in_force(Changes::default());
        self.draw_anew();
        self.clear_recordings();
        let Self { graph, arenas, team, seed, noise, .. } = self;
        arenas.clear();
        let clock = Clock { tick: 0, time: graph.time };
        for (node, body) in graph.nodes.iter().zip(&graph.bodies) {
            let parts = &graph.parts[node.parts.of()];
            let mut in_parts = vec![0.0; parts.iter().map(|part| part.state.len()).sum()];
            let mut state = StateMut {
                reals: match parts {
                    [] => &mut arenas.reals[node.reals.of()],
                    _ => &mut in_parts,
                },
                words: &mut arenas.words[node.words.of()],
                longs: &mut arenas.longs[node.longs.of()],
            };
            let mut registered = Outputs {
                spans: &node.outs,
                base: node.registered.start as usize,
                registered: true,
                values: &mut arenas.registered[node.registered.of()],
            };
            let random = Random { seed: seed.derive(&node.path, "init"), noise: *noise };
            let cx = clock.cx(random);
            body.init(&cx, &mut state, &mut registered);
            let mut rest = &in_parts[..];
            for (index, part) in node.parts.of().zip(parts) {
                let (own, after) = rest.split_at(part.state.len());
                team.set_state(index, own);
                rest = after;
            }
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

    /// Changes the values. If that fails or panics halfway, the run cannot go on from there.
    pub(in crate::sim) fn change(
        &mut self,
        change: impl FnOnce(&mut Self) -> Result<(), SimError>,
    ) -> Result<(), SimError> {
        self.interrupted = Some(String::new());
        let outcome = change(self);
        self.interrupted = outcome.as_ref().err().map(ToString::to_string);
        outcome
    }

    /// Checks that the values are those after a whole tick.
    pub(in crate::sim) fn check_whole(&self) -> Result<(), SimError> {
        let reason = match self.interrupted.as_deref() {
            None => return Ok(()),
            Some("") => "a node or the world panicked",
            Some(reason) => reason,
        };
        Err(SimError::Interrupted { tick: self.tick, reason: reason.into() })
    }

    /// Tells the other ranks of an error.
    pub(in crate::sim) fn tell(&self, error: &SimError) {
        if let Some(messages) = &self.messages {
            messages.tell(self.tick, error);
        }
    }

    /// Returns the number of threads that compute a tick.
    pub fn threads(&self) -> usize {
        self.team.threads()
    }

    /// Returns the graph.
    pub fn graph(&self) -> &Arc<Graph> {
        &self.graph
    }

    /// Returns the number of completed ticks.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Returns the simulated time since the start, in seconds.
    pub fn time_s(&self) -> f64 {
        self.tick as f64 * self.graph.time.dt_s()
    }

    /// Returns the world of this run, if it has one.
    pub fn world(&self) -> Option<&dyn World> {
        self.world.as_deref()
    }

    /// Ends the run and returns its world, if it has one.
    pub fn into_world(self) -> Option<Box<dyn World>> {
        self.world
    }

    /// Runs for `span` of simulated time.
    ///
    /// # Errors
    /// - [`SimError::Config`] if `span` is not a whole number of ticks;
    /// - [`SimError::Node`] or [`SimError::World`] if a node or the world fails;
    /// - [`SimError::NonFinite`] if a value becomes infinite or not a number;
    /// - [`SimError::ProbeStorage`] if there is too little memory for the samples of a probe;
    /// - [`SimError::Interrupted`] if an earlier call failed within a tick. [`reset`](Self::reset) and
    ///   [`restore`](Self::restore) make the run usable again.
    pub fn run_for(&mut self, span: SimDuration) -> Result<RunReport, SimError> {
        self.run_until(span, |_| ControlFlow::Continue(()))
    }

    /// Runs until `stop` returns [`ControlFlow::Break`], but at most for `limit`. `stop` is called after every tick, on the
    /// calling thread.
    ///
    /// # Errors
    /// As for [`Simulator::run_for`].
    pub fn run_until(
        &mut self,
        limit: SimDuration,
        stop: impl FnMut(SimView<'_>) -> Stop,
    ) -> Result<RunReport, SimError> {
        let limit = self.graph.time.ticks(limit)?;
        let outcome = self.run_ticks(limit, stop);
        if let Err(error) = &outcome {
            self.tell(error);
        }
        outcome
    }

    pub(in crate::sim) fn run_ticks(
        &mut self,
        limit: u64,
        mut stop: impl FnMut(SimView<'_>) -> Stop,
    ) -> Result<RunReport, SimError> {
        self.check_whole()?;
        let mut done = 0;
        let mut reason = StopReason::TimeUp;
        'run: while done < limit {
            let block = BLOCK.min(limit - done);
            self.reserve(block)?;
            for _ in 0..block {
                self.change(Self::step)?;
                done += 1;
                if let ControlFlow::Break(why) = stop(SimView { sim: self }) {
                    reason = why;
                    break 'run;
                }
            }
        }
        Ok(RunReport { reason, ticks: done, span: self.graph.time.span(done) })
    }

    /// Returns the value of an output in the last tick. For a registered output this is the value just written, which
    /// readers see in the next tick. Empty for a handle of another graph.
    pub fn value<K: Kind>(&self, of: &Out<K>) -> K::Value<'_> {
        K::value(self.graph.source(of).map_or(&[], |source| self.arenas.source(source)))
    }

    /// Returns the values of an output that [`Graph::output`] found in this graph. With an output of another graph the
    /// values are meaningless, and the call may panic.
    pub fn value_of(&self, of: OutputRef) -> &[Real] {
        self.arenas.source(of.source)
    }

    /// Returns the state of a node that [`GraphBuilder::node`] or [`Scope::leaf`](crate::sim::Scope::leaf) added, after the
    /// last tick. `None` for a handle of another graph. A node with parts has no other state.
    pub fn state(&self, of: &NodePorts) -> Option<StateRef<'_>> {
        let own = of.builder == self.graph.builder;
        let node = &self.graph.nodes[*self.graph.handles.get(of.node).filter(|_| own)?];
        Some(StateRef {
            reals: &self.arenas.reals[node.reals.of()],
            words: &self.arenas.words[node.words.of()],
            longs: &self.arenas.longs[node.longs.of()],
        })
    }

    /// Returns whether unit number `unit` of a node had an event in the last tick. Units are counted from 0. Returns
    /// `false` for a unit that the node does not have, and for a unit of another process unless events are sent
    /// ([`Ranks::with_events`]) or recorded. `of` must come from this graph.
    pub fn event(&self, of: EventSource, unit: usize) -> bool {
        let (Some(node), Some(body)) =
            (self.graph.nodes.get(of.node), self.graph.bodies.get(of.node))
        else {
            return false;
        };
        if self.tick == 0 || self.is_muted(of.node) {
            return false;
        }
        if node.parts.len() > 0 {
            return self.event_in_parts(node.parts, body.parts(), unit);
        }
        let state = StateRef {
            reals: &self.arenas.reals[node.reals.of()],
            words: &self.arenas.words[node.words.of()],
            longs: &self.arenas.longs[node.longs.of()],
        };
        unit < body.units() && body.event(&state, unit)
    }

    /// Calls `look` with every part that this process computes, as it is after the last tick.
    pub(crate) fn look_at_parts(&self, mut look: impl FnMut(PartView<'_>)) {
        for (at, part) in self.graph.parts.iter().enumerate() {
            let plan = &self.graph.divided[part.divided as usize];
            let node = plan.node as usize;
            self.team.with_state(at, |state| {
                look(PartView {
                    path: &self.graph.nodes[node].path,
                    node: &*self.graph.bodies[node] as &dyn Any,
                    part: part.index as usize,
                    inputs: self.arenas.stage.inputs(&self.graph.slots[plan.slots.of()]),
                    state,
                });
            });
        }
    }

    fn event_in_parts(&self, all: Span, parts: Option<&dyn Parts>, unit: usize) -> bool {
        let all_of_node = &self.graph.parts[all.of()];
        let at = all_of_node.partition_point(|part| part.units.end as usize <= unit);
        let (Some(part), Some(parts)) = (all_of_node.get(at), parts) else { return false };
        let unit = unit - part.units.start as usize;
        if part.events > 0 {
            let words = &self.arenas.results[part.results.of()][part.own_results()..];
            return words[unit / 32].to_bits() >> (unit % 32) & 1 == 1;
        }
        let state = |state: &[Real]| parts.event(at, state, unit);
        self.team.with_state(all.start as usize + at, state).unwrap_or(false)
    }

    /// Returns the samples of a probe. Empty for a handle of another graph.
    pub fn samples<K: Kind>(&self, probe: &ProbeId<K>) -> Samples<'_, K> {
        static NONE: Recording = Recording { ticks: Vec::new(), values: Vec::new(), head: 0 };
        let own = probe.builder == self.graph.builder;
        let (recording, width) = match self.graph.probes.get(probe.index) {
            Some(plan) if own => (&self.recordings[probe.index], plan.source.span().len()),
            _ => (&NONE, 0),
        };
        Samples { recording, width, dt_s: self.graph.time.dt_s(), kind: PhantomData }
    }

    /// Returns the spikes of a layer that [`probe_spikes`](crate::sim::GraphBuilder::probe_spikes) records. Empty for a handle
    /// of another graph.
    pub fn spikes(&self, probe: &SpikeProbe) -> Spikes<'_> {
        static NONE: SpikeRecording =
            SpikeRecording { units: 0, ticks: Vec::new(), bits: Vec::new() };
        let own = probe.builder == self.graph.builder;
        let recording = self.spikes.get(probe.index).filter(|_| own).unwrap_or(&NONE);
        Spikes { recording, dt_s: self.graph.time.dt_s() }
    }

    /// Returns the samples and the spikes that the probes have recorded, each with the name of its output or layer. The
    /// second probe of an output has `-2` behind its name, and so on.
    #[expect(clippy::type_complexity, reason = "two lists of the same form")]
    pub(crate) fn recorded(
        &self,
    ) -> (Vec<(String, Samples<'_, Vector>)>, Vec<(String, Spikes<'_>)>) {
        let dt_s = self.graph.time.dt_s();
        let mut values: Vec<(String, Samples<'_, Vector>)> = Vec::new();
        for (plan, recording) in self.graph.probes.iter().zip(&self.recordings) {
            let node = &self.graph.nodes[plan.node];
            let output = &node.ports.outputs[plan.output];
            let full = || format!("{}.{}", node.path, output.name);
            let name = output.exposed.as_deref().map_or_else(full, str::to_owned);
            let name = unique(name, values.iter().map(|(name, ..)| name));
            let width = plan.source.span().len();
            values.push((name, Samples { recording, width, dt_s, kind: PhantomData }));
        }
        let mut spikes: Vec<(String, Spikes<'_>)> = Vec::new();
        for (node, recording) in self.graph.spike_probes.iter().zip(&self.spikes) {
            let name = self.graph.nodes[*node].path.clone();
            let name = unique(name, spikes.iter().map(|(name, _)| name));
            spikes.push((name, Spikes { recording, dt_s }));
        }
        (values, spikes)
    }

    /// Deletes the samples of all probes.
    pub fn clear_recordings(&mut self) {
        self.recordings.iter_mut().for_each(Recording::clear);
        self.spikes.iter_mut().for_each(SpikeRecording::clear);
    }

    /// Deletes the samples of ticks that end after `end_tick`.
    pub(in crate::sim) fn cut_recordings(&mut self, end_tick: u64) {
        self.recordings.iter_mut().for_each(|recording| recording.cut(end_tick));
        self.spikes.iter_mut().for_each(|recording| recording.cut(end_tick));
    }

    /// Reserves memory for the samples of `ticks` more ticks.
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
        for (node, recording) in self.graph.spike_probes.iter().zip(&mut self.spikes) {
            let (ticks, words) = (ticks as usize, recording.words());
            let room = recording
                .ticks
                .try_reserve(ticks)
                .and_then(|()| recording.bits.try_reserve(ticks.saturating_mul(words)));
            if room.is_err() {
                let port = format!("the spikes of {}", self.graph.nodes[*node].path);
                return Err(SimError::ProbeStorage { port, samples: ticks });
            }
        }
        Ok(())
    }
}

/// Returns `name`, or `name-2` and so on if it is taken.
fn unique<'t>(name: String, taken: impl Iterator<Item = &'t String> + Clone) -> String {
    let free = |name: &String| !taken.clone().any(|other| other == name);
    if free(&name) {
        return name;
    }
    (2..).map(|n| format!("{name}-{n}")).find(free).unwrap_or(name)
}

/// Returns the period of `world` in ticks, if the world fits the link of `graph`.
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
