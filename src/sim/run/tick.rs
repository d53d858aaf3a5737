//! One tick of a running graph.
//!
//! A tick does these steps in this order: emit, advance, exchange results with other ranks, settle (each with the outputs
//! overwritten that are clamped), update the filters of
//! connections, check that all numbers are finite, step the world if its period ends, make registered outputs visible to
//! the next tick, sample the probes. No step allocates.
//!
//! Cost: a node that copies one number takes about 20 ns per tick, and a filter about 0.1 ns per component
//! (`graph/tick` in the benches).

use super::arena::Arenas;
use super::simulator::Simulator;
use super::stage::{Clock, Random, Stage};
use crate::sim::build::graph::{Graph, PhasePlan, Source};
use crate::sim::describe::filter::latch;
use crate::sim::describe::io::{
    AdvanceIo, EmitIo, Inputs, Outputs, ScratchArena, Slot, StateMut, StateRef,
};
use crate::sim::error::{NodeFault, SimError};
use crate::sim::real::{Real, Span};
use crate::sim::seed::Seed;

/// What nodes without parts change in advance.
struct Rest<'a> {
    registered: &'a mut [Real],
    reals: &'a mut [Real],
    words: &'a mut [u32],
    longs: &'a mut [u64],
    scratch: &'a mut ScratchArena,
}

impl Simulator {
    /// Runs one tick.
    pub(in crate::sim) fn step(&mut self) -> Result<(), SimError> {
        if std::mem::take(&mut self.in_force.fresh) {
            self.changes.muted.clone_from(&self.in_force.silent);
        }
        let Self { graph, arenas, team, tick, in_force, .. } = self;
        let tick = *tick;
        let Arenas { stage, registered, reals, words, longs, results, scratch, .. } = arenas;
        stage.clock = Clock { tick, time: graph.time };
        let mut cx = stage.clock.cx(Random { seed: Seed::new(0), noise: 0.0 });
        // These locals cannot be aliased. Without them every access goes through two pointers.
        let (bodies, slots, outs) = (&graph.bodies[..], &graph.slots[..], &graph.outs[..]);
        let random = &stage.random[..];
        let signals = &mut stage.signals[..];
        let (held, gathered) = (&stage.held[..], &mut stage.gathered[..]);
        let state = StateRef { reals: &reals[..], words: &words[..], longs: &longs[..] };
        let (mut holds, mut emitted) = (in_force.signals.iter(), 0);
        loop {
            let hold = holds.next();
            let until = hold.map_or(graph.emits.len(), |hold| hold.after as usize);
            for plan in &graph.emits[emitted..until] {
                let node = plan.node as usize;
                Random { seed: cx.node_seed, noise: cx.noise_scale } = random[node];
                let (earlier, own) = signals.split_at_mut(plan.own.start as usize);
                if plan.gathers.len() > 0 {
                    graph.gather(plan.gathers, [earlier, held, &[]], gathered);
                }
                let mut io = EmitIo {
                    inputs: Inputs {
                        slots: &slots[plan.slots.of()],
                        signals: earlier,
                        held,
                        gathered,
                    },
                    outputs: Outputs {
                        spans: &outs[plan.outs.of()],
                        base: plan.own.start as usize,
                        registered: false,
                        values: &mut own[..plan.own.len()],
                    },
                    state: match plan.stateful {
                        true => StateRef {
                            reals: &state.reals[plan.reals.of()],
                            words: &state.words[plan.words.of()],
                            longs: &state.longs[plan.longs.of()],
                        },
                        false => StateRef { reals: &[], words: &[], longs: &[] },
                    },
                    scratch: scratch.lend(plan.scratch),
                };
                bodies[node].emit(&cx, &mut io);
            }
            let Some(hold) = hold else { break };
            hold.write(&in_force.values, signals);
            emitted = until;
        }
        for plan in graph.advances.iter().chain(&graph.divided) {
            if plan.gathers.len() > 0 {
                graph.gather(plan.gathers, [signals, held, &[]], gathered);
            }
        }
        let rest = Rest { registered, reals, words, longs, scratch };
        match graph.parts.is_empty() {
            true => graph.advance(&graph.advances, stage, rest),
            false => team.advance(graph, stage, results, |stage| {
                graph.advance(&graph.advances, stage, rest)
            }),
        }
        .map_err(|fault| graph.at_fault(tick, fault))?;
        if let Some(messages) = &mut self.messages {
            messages.exchange(tick, &self.arenas.stage.held, &mut self.arenas.results)?;
        }
        if !self.changes.muted.is_empty() {
            self.mute();
        }
        let Self { graph, arenas, in_force, .. } = self;
        if !graph.parts.is_empty() {
            graph.collect(&arenas.results, &mut arenas.registered);
        }
        // Those that settle read the values held, and then write outputs of their own.
        in_force.hold_registered(&mut arenas.registered);
        if !graph.settles.is_empty() {
            graph.settle(arenas).map_err(|fault| graph.at_fault(tick, fault))?;
            in_force.hold_registered(&mut arenas.registered);
        }
        for filter in &graph.lowpasses {
            let input = match filter.source {
                Source::Signal(span) => &arenas.stage.signals[span.of()],
                Source::Registered(span) => &arenas.registered[span.of()],
            };
            latch(filter.decay, input, &mut arenas.stage.held[filter.held.of()]);
        }
        for plan in &graph.filters {
            let input = match plan.source {
                Source::Signal(span) => &arenas.stage.signals[span.of()],
                Source::Registered(span) => &arenas.registered[span.of()],
            };
            plan.filter.step(input, &mut arenas.stage.held[plan.held.of()]);
        }
        if !arenas.all_finite() {
            return Err(self.blame_non_finite());
        }
        self.step_world()?;
        self.arenas.commit_registered();
        self.sample_probes()?;
        self.tick += 1;
        Ok(())
    }

    /// Steps the world at the end of its period and reads its senses.
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
            [&self.arenas.stage.signals, &self.arenas.stage.held, &[]],
            &mut self.arenas.stage.gathered,
        );
        let inputs = Inputs {
            slots: &self.graph.slots[link.slots.of()],
            signals: &self.arenas.stage.signals,
            held: &self.arenas.stage.held,
            gathered: &self.arenas.stage.gathered,
        };
        let mut at = 0;
        for index in 0..link.slots.len() {
            let value = inputs.get(index);
            self.command[at..at + value.len()].copy_from_slice(value);
            at += value.len();
        }
        world.advance(&self.command).map_err(|source| SimError::World { tick, source })?;
        world.sense(&mut self.arenas.registered[link.sense.of()]);
        self.in_force.hold_registered(&mut self.arenas.registered);
        let sensed = &self.arenas.registered[link.sense.of()];
        if sensed.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(self.blame_non_finite()) }
    }

    fn sample_probes(&mut self) -> Result<(), SimError> {
        let end = self.tick + 1;
        for (node, recording) in self.graph.spike_probes.iter().zip(&mut self.spikes) {
            if recording.units > 0 {
                let (info, body) = (&self.graph.nodes[*node], &*self.graph.bodies[*node]);
                if self.changes.muted.binary_search(&(*node as u32)).is_ok() {
                    recording.push_none(end);
                    continue;
                }
                if info.parts.len() > 0 {
                    recording.push_parts(
                        end,
                        &self.graph.parts[info.parts.of()],
                        &self.arenas.results,
                    );
                    continue;
                }
                let state = StateRef {
                    reals: &self.arenas.reals[info.reals.of()],
                    words: &self.arenas.words[info.words.of()],
                    longs: &self.arenas.longs[info.longs.of()],
                };
                recording.push(end, body, &state);
            }
        }
        for (plan, recording) in self.graph.probes.iter().zip(&mut self.recordings) {
            let raw = match plan.source {
                Source::Signal(span) => &self.arenas.stage.signals[span.of()],
                Source::Registered(span) => &self.arenas.registered[span.of()],
            };
            let value = match &plan.filter {
                Some(filter) => {
                    let state = &mut self.arenas.probe_filters[plan.state.of()];
                    let value = filter.step(raw, state);
                    if !filter.is_bounded() && !value.iter().all(|v| v.is_finite()) {
                        return Err(self.graph.not_finite(plan.source, self.tick));
                    }
                    value
                }
                None => raw,
            };
            if end.is_multiple_of(plan.period_ticks) {
                recording.push(end, value, plan.capacity);
            }
        }
        Ok(())
    }

    /// Returns an error that names the first output with an infinite value or a value that is not a number.
    fn blame_non_finite(&self) -> SimError {
        let tick = self.tick;
        for node in &self.graph.nodes {
            for (out, decl) in node.outs.iter().zip(&node.ports.outputs) {
                let arena = if out.registered {
                    &self.arenas.registered
                } else {
                    &self.arenas.stage.signals
                };
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
        // All outputs are finite, but an unstable filter grows, and values near the largest float can overflow in one.
        let held = &self.arenas.stage.held;
        let bad = |of: Span| held[of.of()].iter().any(|v| !v.is_finite());
        let filter = self.graph.filters.iter().find(|filter| bad(filter.held));
        self.graph.not_finite(filter.map_or(Source::Signal(Span::default()), |f| f.source), tick)
    }
}

impl Graph {
    /// Returns an error that names the output whose filter has an infinite value.
    fn not_finite(&self, source: Source, tick: u64) -> SimError {
        let ports = self.nodes.iter().flat_map(|node| {
            let outs = node.outs.iter().zip(&node.ports.outputs);
            outs.map(move |(out, decl)| (Source::of(*out), &node.path, &decl.name))
        });
        let named = ports.into_iter().find(|(own, ..)| *own == source);
        let (path, port) = named.map_or_else(
            || ("a connection".into(), "filter".into()),
            |(_, path, port)| (path.clone(), format!("{port} (filtered)")),
        );
        SimError::NonFinite { path, port, value: f32::INFINITY, tick }
    }

    fn at_fault(&self, tick: u64, (node, source): (usize, NodeFault)) -> SimError {
        SimError::Node { path: self.nodes[node].path.clone(), tick, source }
    }

    /// Advances the nodes that read what all others have written in this tick.
    fn settle(&self, arenas: &mut Arenas) -> Result<(), (usize, NodeFault)> {
        let Arenas { stage, registered, reals, words, longs, scratch, .. } = arenas;
        let Stage { signals, held, gathered, .. } = &mut *stage;
        for plan in &self.settles {
            self.gather(plan.gathers, [signals, held, registered], gathered);
        }
        let rest = Rest { registered, reals, words, longs, scratch };
        self.advance(&self.settles, stage, rest)
    }

    /// Advances nodes without parts.
    fn advance(
        &self,
        plans: &[PhasePlan],
        stage: &Stage,
        rest: Rest<'_>,
    ) -> Result<(), (usize, NodeFault)> {
        let (bodies, slots, outs) = (&self.bodies[..], &self.slots[..], &self.outs[..]);
        let Rest { registered, reals, words, longs, scratch } = rest;
        let mut cx = stage.clock.cx(Random { seed: Seed::new(0), noise: 0.0 });
        for plan in plans {
            let node = plan.node as usize;
            Random { seed: cx.node_seed, noise: cx.noise_scale } = stage.random[node];
            let mut io = AdvanceIo {
                inputs: stage.inputs(&slots[plan.slots.of()]),
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
            bodies[node].advance(&cx, &mut io).map_err(|fault| (node, fault))?;
        }
        Ok(())
    }

    /// Writes the results of all parts to the registered outputs of their nodes.
    fn collect(&self, results: &[Real], registered: &mut [Real]) {
        for plan in &self.divided {
            let node = plan.node as usize;
            let Some(parts) = self.bodies[node].parts() else { continue };
            let mut outputs = Outputs {
                spans: &self.outs[plan.outs.of()],
                base: plan.own.start as usize,
                registered: true,
                values: &mut registered[plan.own.of()],
            };
            for part in &self.parts[self.nodes[node].parts.of()] {
                let own = &results[part.results.of()][..part.own_results()];
                parts.collect(part.index as usize, own, &mut outputs);
            }
        }
    }

    /// Sums the sources of a node's inputs, in the order of the sources' paths. Registered outputs are empty before the
    /// end of the tick, when nobody reads them.
    #[inline]
    fn gather(
        &self,
        which: Span,
        [signals, held, registered]: [&[Real]; 3],
        gathered: &mut [Real],
    ) {
        for plan in &self.gathers[which.of()] {
            let into = &mut gathered[plan.into.of()];
            into.fill(0.0);
            for source in &self.gather_sources[plan.sources.of()] {
                let values = match source {
                    Slot::Signal(span) => &signals[span.of()],
                    Slot::Held(span) => &held[span.of()],
                    Slot::Settled(span) => &registered[span.of()],
                    Slot::Gathered(_) | Slot::OtherPhase => continue,
                };
                for (sum, value) in into.iter_mut().zip(values) {
                    *sum += value;
                }
            }
        }
    }
}
