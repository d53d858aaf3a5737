//! Runs a graph: arenas, the tick, the simulator, probes, checkpoints and the world.

pub(super) mod arena;
pub(super) mod changes;
pub(super) mod checkpoint;
pub(super) mod config;
pub(super) mod intervention;
pub(super) mod probe;
pub(super) mod simulator;
pub(super) mod spikes;
pub(super) mod stage;
pub(super) mod tick;
pub(super) mod world;
