#![doc = include_str!("../README.md")]
#![deny(unsafe_code)]

pub mod files;
pub mod guide;
pub mod neurons;
#[cfg(feature = "physics")]
pub mod report;
pub mod sim;
pub mod spa;
pub mod study;
pub mod task;

/// What most programs that build a graph need.
pub mod prelude {
    pub use crate::neurons::{Population, PopulationPlan};
    pub use crate::sim::{
        Add, Constant, GraphBuilder, Module, Noise, ProbeSpec, RunConfig, Scope, Seed, SimDuration,
        Simulator, StopReason, Synapse, Timebase,
    };
}
