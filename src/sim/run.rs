//! What a run is given beside the graph, and how it says that it ended.

use std::ops::ControlFlow;

use super::node::Real;
use super::seed::Seed;
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
