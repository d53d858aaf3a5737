//! The settings of a run, and the report on how it ended.

use std::ops::ControlFlow;

use super::world::World;
use crate::sim::place::threads::Threads;
use crate::sim::real::Real;
use crate::sim::seed::Seed;
use crate::sim::time::SimDuration;

/// The settings of a run: seed, noise, world and threads.
///
/// ```
/// use symbolt::sim::{RunConfig, Seed};
/// let quiet = RunConfig::seeded(Seed::new(7)).with_noise(0.0);
/// assert!(quiet.world.is_none());
/// ```
pub struct RunConfig {
    /// Run seed. It decides the noise and all random events in the world.
    pub seed: Seed,
    /// Factor for all noise amplitudes in the graph, finite and at least 0. 0 turns noise off; 1 leaves the amplitudes
    /// unchanged. Signals drawn at random, such as [`WhiteSignal`](crate::sim::WhiteSignal), are no noise.
    pub noise: Real,
    /// World. Required if the graph links to a world, and otherwise not allowed.
    pub world: Option<Box<dyn World>>,
    /// Threads that compute a tick. They affect the speed, never the results, and live as long as the simulator.
    pub threads: Threads,
}

impl Default for RunConfig {
    fn default() -> Self {
        Self { seed: Seed::new(1), noise: 1.0, world: None, threads: Threads::Serial }
    }
}

impl RunConfig {
    /// Creates settings with the run seed `seed`, noise scale 1 and no world.
    pub fn seeded(seed: Seed) -> Self {
        Self { seed, ..Self::default() }
    }

    /// Sets the world.
    pub fn in_world(mut self, world: impl World + 'static) -> Self {
        self.world = Some(Box::new(world));
        self
    }

    /// Sets the threads that compute a tick.
    pub fn with_threads(mut self, threads: Threads) -> Self {
        self.threads = threads;
        self
    }

    /// Sets the factor for all noise amplitudes, a finite number of at least 0.
    pub fn with_noise(mut self, scale: Real) -> Self {
        self.noise = scale;
        self
    }
}

/// The reason why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// The run lasted for the full time limit.
    TimeUp,
    /// The stop condition held. The text is the name that the condition gave.
    Condition(&'static str),
}

/// The result of a stop condition: continue, or stop with a reason.
pub type Stop = ControlFlow<StopReason>;

/// The report on a finished run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunReport {
    /// Reason why the run ended.
    pub reason: StopReason,
    /// Number of ticks that the run lasted.
    pub ticks: u64,
    /// Simulated time that the run lasted.
    pub span: SimDuration,
}
