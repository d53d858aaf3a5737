//! Checkpoints: the saved state of a run.

use serde::{Deserialize, Serialize};

use super::changes::Changes;
use super::simulator::Simulator;
use super::world::WorldSave;
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::error::SimError;
use crate::sim::real::Real;
use crate::sim::seed::Seed;

/// The state of a run after a tick: all values, the tick, the run seed, the noise scale, the interventions in force and
/// the saved world. The samples of probes are not included.
///
/// A checkpoint carries the fingerprint of its graph, and [`Simulator::restore`] refuses checkpoints of other graphs.
/// The fingerprint has two limits:
///
/// - It samples a function in direct mode at 257 evenly spaced points within the layer's radius. Functions that differ
///   only between these points or beyond the radius count as the same.
/// - It does not cover the world. Only [`World::restore`](crate::sim::World::restore) can detect a save of another world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    graph: u64,
    tick: u64,
    seed: Seed,
    noise: Real,
    signals: Vec<Real>,
    registered: Vec<Real>,
    held: Vec<Real>,
    reals: Vec<Real>,
    parts: Vec<Real>,
    words: Vec<u32>,
    longs: Vec<u64>,
    probe_filters: Vec<Real>,
    world: Option<WorldSave>,
    #[serde(default, skip_serializing_if = "Changes::is_empty")]
    changes: Changes,
}

impl Checkpoint {
    /// Returns the number of completed ticks.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Returns the memory that the checkpoint takes, in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + self
                .all_reals()
                .map(|reals| size_of::<Real>() * reals.capacity())
                .iter()
                .sum::<usize>()
            + 4 * self.words.capacity()
            + 8 * self.longs.capacity()
            + self.world.as_ref().map_or(0, |world| world.0.capacity())
            + self.changes.bytes()
    }

    fn all_reals(&self) -> [&Vec<Real>; 6] {
        let Self { signals, registered, held, reals, parts, probe_filters, .. } = self;
        [signals, registered, held, reals, parts, probe_filters]
    }

    fn hash(&self) -> u64 {
        let mut hash = Fingerprint::default();
        for number in [self.graph, self.tick, self.seed.value()] {
            hash.number(number);
        }
        hash.reals(&[self.noise]);
        for reals in self.all_reals() {
            hash.reals(reals);
        }
        for word in &self.words {
            hash.number(u64::from(*word));
        }
        for long in &self.longs {
            hash.number(*long);
        }
        if let Some(WorldSave(bytes)) = &self.world {
            for byte in bytes {
                hash.number(u64::from(*byte));
            }
        }
        if !self.changes.is_empty() {
            hash.text(&format!("{:?}", self.changes));
        }
        hash.value()
    }
}

impl Simulator {
    /// Takes a checkpoint of the current state. Allocates. If several processes run the graph, all of them must call this
    /// after the same tick. Each gets the whole checkpoint, from which any number of processes can continue.
    ///
    /// # Errors
    /// [`SimError::Interrupted`] if the run failed within a tick; [`SimError::World`] if the world cannot be saved;
    /// [`SimError::Rank`] if another process has ended or failed.
    pub fn checkpoint(&self) -> Result<Checkpoint, SimError> {
        self.check_whole()?;
        let saved = self.world.as_ref().map(|world| world.save()).transpose();
        let world = saved
            .map_err(|source| SimError::World { tick: self.tick, source })
            .inspect_err(|error| self.tell(error))?;
        Ok(Checkpoint {
            graph: self.graph.fingerprint,
            tick: self.tick,
            seed: self.seed,
            noise: self.noise,
            signals: self.arenas.stage.signals.clone(),
            registered: self.arenas.registered.clone(),
            held: self.arenas.stage.held.clone(),
            reals: self.arenas.reals.clone(),
            parts: self.states_of_parts()?,
            words: self.arenas.words.clone(),
            longs: self.arenas.longs.clone(),
            probe_filters: self.arenas.probe_filters.clone(),
            world,
            changes: self.changes.clone(),
        })
    }

    /// Returns to the state of `checkpoint`, with its run seed, noise scale and interventions. The run then continues with the
    /// same bits as the run that the checkpoint was taken from. If several processes run the graph, all of them must restore
    /// the same checkpoint.
    ///
    /// Recordings are cut: samples and spikes of later ticks are deleted, those up to the checkpoint's tick stay, as the
    /// past of the run. They are all deleted if the checkpoint cannot be of this run's past: if its tick is later than
    /// that of the run, or its run seed is another. Where a checkpoint of a run with the same seed but other interventions is
    /// restored, [`clear_recordings`](Self::clear_recordings) deletes what does not belong to it.
    ///
    /// # Errors
    /// [`SimError::ForeignCheckpoint`] if the checkpoint was taken from a graph with another fingerprint (see
    /// [`Checkpoint`]), or if only one of the two runs has a world. [`SimError::World`] if the world refuses its save.
    /// [`SimError::Rank`] if another process has ended or failed, or restores another checkpoint. After an error the values
    /// of the graph are unchanged; a run with a world must then be reset or restored, because the world may have changed.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), SimError> {
        self.restore_world(checkpoint).inspect_err(|error| self.tell(error))?;
        if let Some(messages) = &self.messages {
            messages.check_restored(checkpoint.hash())?;
        }
        self.arenas.stage.signals.copy_from_slice(&checkpoint.signals);
        self.arenas.registered.copy_from_slice(&checkpoint.registered);
        self.arenas.stage.held.copy_from_slice(&checkpoint.held);
        self.arenas.reals.copy_from_slice(&checkpoint.reals);
        for (index, part) in self.graph.parts.iter().enumerate() {
            let state = &checkpoint.parts[part.state.of()];
            self.team.set_state(index, state);
            let node = self.graph.divided[part.divided as usize].node as usize;
            if let (Some(parts), 1..) = (self.graph.bodies[node].parts(), part.events) {
                let results = &mut self.arenas.results[part.results.of()];
                let events = &mut results[part.own_results()..];
                parts.events(part.index as usize, state, part.units.len(), events);
            }
        }
        self.arenas.words.copy_from_slice(&checkpoint.words);
        self.arenas.longs.copy_from_slice(&checkpoint.longs);
        self.arenas.probe_filters.copy_from_slice(&checkpoint.probe_filters);
        match checkpoint.tick <= self.tick && checkpoint.seed == self.seed {
            true => self.cut_recordings(checkpoint.tick),
            false => self.clear_recordings(),
        }
        self.tick = checkpoint.tick;
        self.noise = checkpoint.noise;
        self.seed = checkpoint.seed;
        self.put_in_force(checkpoint.changes.clone());
        self.draw_anew();
        self.interrupted = None;
        Ok(())
    }

    /// Returns the states of all parts, those of other ranks too.
    fn states_of_parts(&self) -> Result<Vec<Real>, SimError> {
        let mut all = vec![0.0; self.graph.sizes.parts];
        for (index, part) in self.graph.parts.iter().enumerate() {
            let into = &mut all[part.state.of()];
            self.team.with_state(index, |state| into.copy_from_slice(state));
        }
        if let Some(messages) = &self.messages {
            messages.gather_states(self.tick, &self.graph, &mut all)?;
        }
        Ok(all)
    }

    /// Checks that the checkpoint fits, and restores the world.
    fn restore_world(&mut self, checkpoint: &Checkpoint) -> Result<(), SimError> {
        let fits = checkpoint.graph == self.graph.fingerprint
            && checkpoint.signals.len() == self.arenas.stage.signals.len()
            && checkpoint.registered.len() == self.arenas.registered.len()
            && checkpoint.held.len() == self.arenas.stage.held.len()
            && checkpoint.reals.len() == self.arenas.reals.len()
            && checkpoint.parts.len() == self.graph.sizes.parts
            && checkpoint.words.len() == self.arenas.words.len()
            && checkpoint.longs.len() == self.arenas.longs.len()
            && checkpoint.probe_filters.len() == self.arenas.probe_filters.len()
            && checkpoint.changes.fit(&self.graph)
            && checkpoint.world.is_some() == self.world.is_some();
        if !fits {
            return Err(SimError::ForeignCheckpoint);
        }
        if let (Some(world), Some(saved)) = (&mut self.world, &checkpoint.world) {
            let restored = world.restore(saved);
            restored.map_err(|source| SimError::World { tick: checkpoint.tick, source })?;
            // Until the graph follows.
            self.interrupted = Some("its world may stand at another tick than its graph".into());
        }
        Ok(())
    }
}
