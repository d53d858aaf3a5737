//! Checkpoints: everything that a run needs to continue from a tick.

use serde::{Deserialize, Serialize};

use super::error::SimError;
use super::node::Real;
use super::seed::Seed;
use super::simulator::Simulator;
use super::world::WorldSave;

/// The state of a run after a tick: the arenas, the tick and the world's own save. Recordings are not part
/// of it.
///
/// It carries a fingerprint of its graph, by which [`Simulator::restore`] refuses those of others. Two things the
/// fingerprint cannot see. A function in direct mode is known by its values at 257 evenly spaced points within
/// its layer's radius: functions that differ only between these points or beyond the radius count as the same.
/// And the world is opaque to the engine: the save is the world's own, and only
/// [`World::restore`](super::World::restore) can tell that it is not of such a world.
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
    words: Vec<u32>,
    longs: Vec<u64>,
    probe_filters: Vec<Real>,
    world: Option<WorldSave>,
}

impl Checkpoint {
    /// Ticks done when it was taken.
    pub fn tick(&self) -> u64 {
        self.tick
    }
}

impl Simulator {
    /// Takes a checkpoint. Allocates.
    ///
    /// # Errors
    /// [`SimError::World`] if the world cannot be saved.
    pub fn checkpoint(&self) -> Result<Checkpoint, SimError> {
        let saved = self.world.as_ref().map(|world| world.save()).transpose();
        let world = saved.map_err(|source| SimError::World { tick: self.tick, source })?;
        Ok(Checkpoint {
            graph: self.graph.fingerprint,
            tick: self.tick,
            seed: self.seed,
            noise: self.noise,
            signals: self.arenas.signals.clone(),
            registered: self.arenas.registered.clone(),
            held: self.arenas.held.clone(),
            reals: self.arenas.reals.clone(),
            words: self.arenas.words.clone(),
            longs: self.arenas.longs.clone(),
            probe_filters: self.arenas.probe_filters.clone(),
            world,
        })
    }

    /// Returns to the tick of `checkpoint`, with its run seed and noise; recordings are emptied. Running on
    /// gives the same bits as in the run that it was taken from.
    ///
    /// # Errors
    /// [`SimError::ForeignCheckpoint`] if it was taken from a graph with other nodes, ports, parameters or edges (of
    /// functions in direct mode only sampled values are compared, see [`Checkpoint`]), and [`SimError::World`] if the
    /// world, which vouches for its own save, refuses it; the arenas then stay as they were.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), SimError> {
        let fits = checkpoint.graph == self.graph.fingerprint
            && checkpoint.signals.len() == self.arenas.signals.len()
            && checkpoint.registered.len() == self.arenas.registered.len()
            && checkpoint.held.len() == self.arenas.held.len()
            && checkpoint.reals.len() == self.arenas.reals.len()
            && checkpoint.words.len() == self.arenas.words.len()
            && checkpoint.longs.len() == self.arenas.longs.len()
            && checkpoint.probe_filters.len() == self.arenas.probe_filters.len()
            && checkpoint.world.is_some() == self.world.is_some();
        if !fits {
            return Err(SimError::ForeignCheckpoint);
        }
        if let (Some(world), Some(saved)) = (&mut self.world, &checkpoint.world) {
            world
                .restore(saved)
                .map_err(|source| SimError::World { tick: checkpoint.tick, source })?;
        }
        self.arenas.signals.copy_from_slice(&checkpoint.signals);
        self.arenas.registered.copy_from_slice(&checkpoint.registered);
        self.arenas.held.copy_from_slice(&checkpoint.held);
        self.arenas.reals.copy_from_slice(&checkpoint.reals);
        self.arenas.words.copy_from_slice(&checkpoint.words);
        self.arenas.longs.copy_from_slice(&checkpoint.longs);
        self.arenas.probe_filters.copy_from_slice(&checkpoint.probe_filters);
        self.tick = checkpoint.tick;
        self.noise = checkpoint.noise;
        self.reseed(checkpoint.seed);
        self.clear_recordings();
        Ok(())
    }
}
