//! The interventions that are in force in a run, and how a tick applies them.
//!
//! They are part of the state that a checkpoint holds. A tick without any asks once whether there are some.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::intervention::{Intervention, InterventionError, Place};
use super::simulator::Simulator;
use super::stage::Random;
use crate::sim::build::graph::{Graph, Source};
use crate::sim::error::WorldError;
use crate::sim::real::{Real, Span};
use crate::sim::words::nearest;

/// An output that does not show what its node computes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Held {
    node: u32,
    output: u32,
    /// `None` for zeros.
    values: Option<Vec<Real>>,
}

impl Held {
    fn place(&self) -> (u32, u32) {
        (self.node, self.output)
    }
}

/// All interventions in force. Nodes and outputs are indices in the graph; all lists are sorted by them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Changes {
    /// What sources show in place of their own values.
    set: Vec<Held>,
    /// Outputs that are clamped or silenced. They hide what sources show.
    held: Vec<Held>,
    /// Nodes whose spikes nobody sees from the next tick on.
    silent: Vec<u32>,
    /// Nodes whose spikes nobody saw in the last tick.
    pub muted: Vec<u32>,
    /// Factors of noise other than 1.
    noise: Vec<(u32, Real)>,
}

/// Replaces the entry of the same place in a sorted list, or adds it.
fn put(list: &mut Vec<Held>, held: Held) {
    match list.binary_search_by_key(&held.place(), Held::place) {
        Ok(at) => list[at] = held,
        Err(at) => list.insert(at, held),
    }
}

fn finite(output: &str, values: &[Real]) -> Result<(), InterventionError> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => {
            let (output, value) = (output.into(), values[index]);
            Err(InterventionError::NotFinite { output, index, value })
        }
    }
}

impl Changes {
    pub fn is_empty(&self) -> bool {
        let Self { set, held, silent, muted, noise } = self;
        set.is_empty()
            && held.is_empty()
            && silent.is_empty()
            && muted.is_empty()
            && noise.is_empty()
    }

    /// Bytes on the heap.
    pub fn bytes(&self) -> usize {
        let of = |list: &Vec<Held>| -> usize {
            let values = list.iter().flat_map(|held| &held.values);
            list.capacity() * size_of::<Held>() + values.map(|v| v.capacity() * 4).sum::<usize>()
        };
        let nodes = 4 * (self.silent.capacity() + self.muted.capacity());
        of(&self.set) + of(&self.held) + nodes + 8 * self.noise.capacity()
    }

    /// Adds an intervention. After an error nothing has changed. The noise of the whole run is not kept here.
    pub fn add(&mut self, graph: &Graph, what: &Intervention) -> Result<(), InterventionError> {
        match what {
            Intervention::Clamp { output, values } => {
                let held = Self::values_of(graph, output, values)?;
                put(&mut self.held, held);
            }
            Intervention::Set { output, values } => {
                let held = Self::values_of(graph, output, values)?;
                if !graph.is_source(held.node as usize) {
                    let sources = (0..graph.nodes.len()).filter(|node| graph.is_source(*node));
                    let names = sources.flat_map(|node| {
                        let outputs = 0..graph.nodes[node].outs.len();
                        outputs.map(move |output| graph.output_name(node, output))
                    });
                    let choices = nearest(output, names);
                    return Err(InterventionError::NotASource { output: output.into(), choices });
                }
                put(&mut self.set, held);
            }
            Intervention::Silence { at } => match graph.place(at)? {
                Place::Output(node, output) => self.zero(node, output),
                Place::Nodes(nodes) => {
                    for node in nodes {
                        (0..graph.nodes[node].outs.len())
                            .for_each(|output| self.zero(node, output));
                        if let (1.., Err(at)) =
                            (graph.bodies[node].units(), self.silent.binary_search(&(node as u32)))
                        {
                            self.silent.insert(at, node as u32);
                        }
                    }
                }
            },
            Intervention::Release { at } => self.release(graph, at)?,
            // It changes nothing in the graph. Only the world knows whether it is possible.
            Intervention::World(_) => {}
            Intervention::Noise { at, scale } => {
                if !scale.is_finite() || *scale < 0.0 {
                    return Err(InterventionError::BadNoise { scale: *scale });
                }
                let Some(at) = at else { return Ok(()) };
                for node in graph.modules_at(at)? {
                    let node = node as u32;
                    self.noise.retain(|(own, _)| *own != node);
                    if *scale != 1.0 {
                        let at = self.noise.partition_point(|(own, _)| *own < node);
                        self.noise.insert(at, (node, *scale));
                    }
                }
            }
        }
        Ok(())
    }

    fn values_of(graph: &Graph, name: &str, values: &[Real]) -> Result<Held, InterventionError> {
        let (node, output) = graph.output_at(name)?;
        let expected = graph.nodes[node].outs[output].span.len();
        if values.len() != expected {
            let (output, given) = (name.into(), values.len());
            return Err(InterventionError::Width { output, expected, given });
        }
        finite(name, values)?;
        Ok(Held { node: node as u32, output: output as u32, values: Some(values.to_vec()) })
    }

    fn zero(&mut self, node: usize, output: usize) {
        put(&mut self.held, Held { node: node as u32, output: output as u32, values: None });
    }

    fn release(&mut self, graph: &Graph, at: &str) -> Result<(), InterventionError> {
        let before = (self.held.len(), self.silent.len());
        match graph.place(at)? {
            Place::Output(node, output) => {
                let place = (node as u32, output as u32);
                if let Ok(at) = self.held.binary_search_by_key(&place, Held::place) {
                    self.held.remove(at);
                    self.silent.retain(|own| *own as usize != node);
                }
            }
            Place::Nodes(nodes) => {
                let within = |node: &u32| nodes.binary_search(&(*node as usize)).is_ok();
                self.held.retain(|held| !within(&held.node));
                self.silent.retain(|node| !within(node));
            }
        }
        if before != (self.held.len(), self.silent.len()) {
            return Ok(());
        }
        let name = |held: &Held| graph.output_name(held.node as usize, held.output as usize);
        let held = nearest(at, self.held.iter().map(name));
        Err(InterventionError::NothingHeld { at: at.into(), held })
    }

    /// Returns whether all places exist in the graph, with these widths, and all numbers are usable.
    pub fn fit(&self, graph: &Graph) -> bool {
        let exists = |held: &Held| {
            let node = graph.nodes.get(held.node as usize);
            let out = node.and_then(|node| node.outs.get(held.output as usize));
            let fits = |values: &Vec<Real>| {
                out.is_some_and(|out| out.span.len() == values.len())
                    && values.iter().all(|value| value.is_finite())
            };
            out.is_some() && held.values.as_ref().is_none_or(fits)
        };
        let node = |node: &u32| (*node as usize) < graph.nodes.len();
        let sorted = |list: &[Held]| list.is_sorted_by(|a, b| a.place() < b.place());
        sorted(&self.set)
            && sorted(&self.held)
            && self.set.iter().chain(&self.held).all(exists)
            && self.silent.iter().chain(&self.muted).all(node)
            && self.silent.is_sorted()
            && self.muted.is_sorted()
            && self.noise.is_sorted_by(|a, b| a.0 < b.0)
            && self.noise.iter().all(|(n, scale)| node(n) && scale.is_finite() && *scale >= 0.0)
    }

    /// Returns the factor of noise of a node.
    fn noise(&self, node: usize) -> Option<Real> {
        let at = self.noise.binary_search_by_key(&(node as u32), |(own, _)| *own).ok()?;
        Some(self.noise[at].1)
    }
}

/// A range that a tick overwrites.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hold {
    /// Number of emits after which it is overwritten.
    pub after: u32,
    span: Span,
    /// Range in [`InForce::values`]; empty for zeros.
    values: Span,
}

/// The changes as a tick uses them.
#[derive(Debug, Default)]
pub(crate) struct InForce {
    /// In the order of emits.
    pub signals: Vec<Hold>,
    pub registered: Vec<Hold>,
    pub values: Vec<Real>,
    /// As in [`Changes`].
    pub silent: Vec<u32>,
    /// Whether no tick has used them yet.
    pub fresh: bool,
}

impl InForce {
    fn of(graph: &Graph, changes: &Changes) -> Self {
        let mut now = Self { silent: changes.silent.clone(), fresh: true, ..Self::default() };
        let both = changes.set.iter().chain(&changes.held);
        let places: BTreeMap<_, _> = both.map(|held| (held.place(), held)).collect();
        for ((node, output), held) in places {
            let start = now.values.len() as u32;
            now.values.extend(held.values.iter().flatten());
            let values = Span { start, end: now.values.len() as u32 };
            match Source::of(graph.nodes[node as usize].outs[output as usize]) {
                Source::Signal(span) => {
                    let before = graph.emits.partition_point(|plan| plan.node < node);
                    now.signals.push(Hold { after: before as u32 + 1, span, values });
                }
                Source::Registered(span) => now.registered.push(Hold { after: 0, span, values }),
            }
        }
        now
    }

    /// Overwrites the registered outputs within a range.
    fn hold_within(&self, range: Span, registered: &mut [Real]) {
        let within = |hold: &&Hold| range.start <= hold.span.start && hold.span.end <= range.end;
        self.registered.iter().filter(within).for_each(|hold| hold.write(&self.values, registered));
    }

    /// Overwrites registered outputs.
    #[inline]
    pub fn hold_registered(&self, registered: &mut [Real]) {
        for hold in &self.registered {
            hold.write(&self.values, registered);
        }
    }
}

impl Hold {
    #[inline]
    pub fn write(self, values: &[Real], arena: &mut [Real]) {
        let into = &mut arena[self.span.of()];
        match self.values.len() {
            0 => into.fill(0.0),
            _ => into.copy_from_slice(&values[self.values.of()]),
        }
    }
}

impl Simulator {
    /// Changes the run between two ticks, from the next tick on. A clamp overwrites an output right after its node has
    /// computed it, so all readers and probes see the value held; those of a registered output without a synapse see it
    /// a tick later, as they see all its values. A node whose memory is its registered output goes on from the value
    /// held.
    ///
    /// Checkpoints hold what is in force, and [`reset`](Self::reset) ends it. If several processes run the graph, all
    /// must make the same change after the same tick. [`Live`](crate::sim::Live) keeps a log of changes. Allocates;
    /// ticks do not.
    ///
    /// ```
    /// use symbolt::prelude::*;
    /// use symbolt::sim::Intervention;
    ///
    /// let mut graph = GraphBuilder::new();
    /// let one = graph.add("one", Constant::scalar(1.0));
    /// let sum = graph.add("sum", Add::scalar());
    /// graph.connect(&one, &sum.input, Synapse::None);
    /// let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
    /// sim.intervene(&Intervention::Clamp { output: "one.out".into(), values: vec![3.0] })?;
    /// sim.run_for(SimDuration::from_millis(1))?;
    /// assert_eq!(sim.value(&sum.output)[0], 3.0);
    /// let misspelt = sim.intervene(&Intervention::Silence { at: "summ".into() });
    /// assert!(misspelt.unwrap_err().to_string().contains("the most similar: `sum`"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// An [`InterventionError`] if a place does not exist, or a value does not fit. The run has not changed then.
    pub fn intervene(&mut self, what: &Intervention) -> Result<(), InterventionError> {
        if let Intervention::World(wish) = what {
            let none = || WorldError::new("this run has no world");
            let world = self.world.as_mut().ok_or_else(none);
            return world
                .and_then(|world| world.intervene(wish))
                .map_err(|error| InterventionError::World { reason: error.reason });
        }
        let mut changes = self.changes.clone();
        changes.add(&self.graph, what)?;
        self.put_in_force(changes);
        if let Intervention::Noise { at, scale } = what {
            if at.is_none() {
                self.noise = *scale;
            }
            self.draw_anew();
        }
        if let (Intervention::Release { .. }, Some(link), Some(world)) =
            (what, &self.graph.world, &self.world)
        {
            // A register keeps a sense until the end of the world's period.
            world.sense(&mut self.arenas.registered[link.sense.of()]);
            self.in_force.hold_within(link.sense, &mut self.arenas.registered);
        }
        Ok(())
    }

    /// Replaces all changes. The noise of nodes is that of before until it is drawn anew.
    pub(in crate::sim) fn put_in_force(&mut self, mut changes: Changes) {
        let room = changes.silent.len().max(changes.muted.len());
        changes.muted.reserve_exact(room - changes.muted.len());
        self.in_force = InForce::of(&self.graph, &changes);
        self.changes = changes;
    }

    /// Gives every node its seed and its factor of noise.
    pub(in crate::sim) fn draw_anew(&mut self) {
        let Self { graph, seed, noise, changes, .. } = self;
        let of = |(index, node): (usize, &crate::sim::build::graph::NodeInfo)| Random {
            seed: seed.derive(&node.path, "noise"),
            noise: changes.noise(index).map_or(*noise, |own| own * *noise),
        };
        self.arenas.stage.random = graph.nodes.iter().enumerate().map(of).collect();
    }

    /// Returns whether nobody sees the spikes of a node in the last tick.
    pub(in crate::sim) fn is_muted(&self, node: usize) -> bool {
        self.changes.muted.binary_search(&(node as u32)).is_ok()
    }

    /// Takes the events of muted nodes out of the results of their parts.
    pub(in crate::sim) fn mute(&mut self) {
        for node in &self.changes.muted {
            for part in &self.graph.parts[self.graph.nodes[*node as usize].parts.of()] {
                self.arenas.results[part.results.of()][part.own_results()..].fill(0.0);
            }
        }
    }
}
