//! Snapshots: everything that a run needs to go on from a moment.

use serde::{Deserialize, Serialize};

use super::error::SimError;
use super::node::Real;
use super::seed::Seed;
use super::simulator::Simulator;
use super::world::WorldSave;

/// A moment of a run: the arenas, the tick and the world's own save. Recordings are not part of
/// it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Snapshot {
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

impl Snapshot {
    /// Ticks done when it was taken.
    pub fn tick(&self) -> u64 {
        self.tick
    }
}

impl Simulator {
    /// Takes a snapshot. Allocates.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
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
            world: self.world.as_ref().map(|w| w.save()),
        }
    }

    /// Goes to the moment of `snapshot`, with its run seed and noise; recordings are emptied. To
    /// run on from there gives the same bits as the run that it was taken from.
    ///
    /// # Errors
    /// [`SimError::ForeignSnapshot`] if it was taken from another graph, and
    /// [`SimError::World`] if the world does not know its own save; the arenas then stay as they
    /// were.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SimError> {
        let fits = snapshot.graph == self.graph.fingerprint
            && snapshot.signals.len() == self.arenas.signals.len()
            && snapshot.registered.len() == self.arenas.registered.len()
            && snapshot.held.len() == self.arenas.held.len()
            && snapshot.reals.len() == self.arenas.reals.len()
            && snapshot.words.len() == self.arenas.words.len()
            && snapshot.longs.len() == self.arenas.longs.len()
            && snapshot.probe_filters.len() == self.arenas.probe_filters.len()
            && snapshot.world.is_some() == self.world.is_some();
        if !fits {
            return Err(SimError::ForeignSnapshot);
        }
        if let (Some(world), Some(saved)) = (&mut self.world, &snapshot.world) {
            world
                .restore(saved)
                .map_err(|source| SimError::World { tick: snapshot.tick, source })?;
        }
        self.arenas.signals.copy_from_slice(&snapshot.signals);
        self.arenas.registered.copy_from_slice(&snapshot.registered);
        self.arenas.held.copy_from_slice(&snapshot.held);
        self.arenas.reals.copy_from_slice(&snapshot.reals);
        self.arenas.words.copy_from_slice(&snapshot.words);
        self.arenas.longs.copy_from_slice(&snapshot.longs);
        self.arenas.probe_filters.copy_from_slice(&snapshot.probe_filters);
        self.tick = snapshot.tick;
        self.noise = snapshot.noise;
        self.reseed(snapshot.seed);
        self.clear_recordings();
        Ok(())
    }
}
