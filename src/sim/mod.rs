//! The engine: ticks, ports, nodes, synapses, the graph builder and its checks, the simulator.
//!
//! Three types, one after the other: a [`GraphBuilder`] describes, [`GraphBuilder::build`] consumes
//! it into an immutable [`Graph`], and a [`Simulator`] runs the graph with arenas of its own.
//! Nothing here knows symbols, neurons or robots.
//!
//! Two things differ from the usual shape of such engines. Unfiltered inputs are not copied: signals
//! stand in topological order, so a node reads earlier ones in place while it writes its own, without
//! `unsafe`. And edges that leave one output with one time constant share a filter.

mod arena;
mod builder;
mod check;
mod checkpoint;
mod draft;
mod error;
mod fingerprint;
mod graph;
mod handle;
mod kind;
mod layout;
mod lowering;
mod node;
mod nodes;
mod port;
mod probe;
mod run;
mod seed;
mod simulator;
mod span;
mod synapse;
mod threads;
mod tick;
mod time;
mod unoptimised;
mod world;

pub use builder::{EdgeId, GraphBuilder, Module, Scope};
pub use checkpoint::Checkpoint;
pub use error::{BuildError, BuildErrors, ConfigError, NodeFault, SimError, WorldError};
pub use fingerprint::Fingerprint;
pub use graph::{EventSource, Graph, OutputRef};
pub use handle::{In, NodePorts, Out};
pub use kind::{AsPointer, Kind, Pointer, PointerRef, Scalar, Space, Vector, VocabTag};
pub use lowering::{LayerRequest, Lowering, LoweringFault, PendingLayer};
pub use node::{
    AdvanceIo, Complex, EmitIo, Inputs, Node, Outputs, Real, Scratch, StateMut, StateRef, StepCx,
};
pub use nodes::{Add, AddPorts, Constant, Noise, NoisePorts, Stimulus};
pub use port::{AnyInput, AnyOutput, InputSpec, OutputSpec, PortDecl, ScratchSpec, StateSpec};
pub use probe::{Capacity, ProbeId, ProbeSpec, Samples};
pub use run::{RunConfig, RunReport, Stop, StopReason};
pub use seed::Seed;
pub(crate) use seed::{FNV_START, fnv1a, fnv1a_word};
pub use simulator::{SimView, Simulator};
pub use synapse::Synapse;
pub(crate) use synapse::decayed;
#[cfg(test)]
pub(crate) use synapse::lowpass_decay;
pub use threads::Threads;
pub use time::{SimDuration, Timebase};
pub(crate) use unoptimised::warn as warn_if_unoptimised;
pub use world::{ScriptedWorld, World, WorldLink, WorldSave};
