//! The engine: runs graphs of nodes that exchange numbers, tick by tick. It knows no symbols, neurons or robots.
//!
//! # Describe, build, run
//!
//! A [`GraphBuilder`] describes a graph: it adds modules and nodes, connects their ports and places probes.
//! [`GraphBuilder::build`] checks the description and returns an immutable [`Graph`], or all faults at once. One
//! description can be built in several modes. A [`Simulator`] runs the graph. Several simulators can share one graph; each owns all numbers that change.
//!
//! ```
//! use symbolt::prelude::*;
//!
//! // Describe: a constant number that passes through a low-pass filter.
//! let mut graph = GraphBuilder::new();
//! let input = graph.add("input", Constant::scalar(1.0));
//! let output = graph.add("output", Add::scalar());
//! graph.connect(&input, &output.input, Synapse::lowpass_ms(5));
//! let probe = graph.probe(&output.output, ProbeSpec::default());
//!
//! // Build.
//! let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
//!
//! // Run for 20 ticks of 1 ms.
//! let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
//! sim.run_for(SimDuration::from_millis(20))?;
//! let (time_s, value) = sim.samples(&probe).last().ok_or("no sample")?;
//! assert_eq!(time_s, 0.02);
//! assert!(value[0] > 0.95);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Nodes, modules and paths
//!
//! A [`Node`] computes outputs from inputs and from its state. A [`Module`] is a named group of nodes. Names nest: the
//! node `left` of the module `bind` has the path `bind/left`. Names are unique within their module. [`Graph::output`]
//! finds an output by the path of its node and the name of the port: `bind/left.out`.
//!
//! # Ports and kinds
//!
//! Nodes and modules have inputs and outputs, together called ports. Every port has a [`Kind`]: [`Scalar`] is one
//! number, [`Vector`] several, and [`Pointer`] a semantic pointer of one vocabulary. The handles [`Out`] and [`In`]
//! carry the kind as a type, so a connection between different kinds does not compile. Widths and vocabularies are
//! checked by `build`.
//!
//! By default an input takes exactly one connection. [`InputSpec::sum`] lets an input add several sources, and
//! [`InputSpec::optional`] lets it stay unconnected.
//!
//! # Ticks
//!
//! Simulated time advances in ticks of equal length, 1 ms by default ([`Timebase`]). Each tick has two phases:
//!
//! 1. Emit: every node computes its outputs from its inputs and its state. Nodes emit in topological order, so a value
//!    passes through a whole chain of nodes within one tick.
//! 2. Advance: nodes with state or registered outputs update them for the next tick. Nodes that read what the others
//!    have just written ([`InputSpec::at_settle`]), such as learned connections, come last.
//!
//! Three things delay a value by one tick:
//!
//! - A [`Synapse`] on the connection; a pure delay by as many ticks as it says.
//! - A registered output ([`OutputSpec::registered`]). It is written in advance and visible to readers one tick later.
//! - An input that its node reads in advance only ([`InputSpec::at_advance`]). Its value affects the node's outputs
//!   from the next tick on.
//!
//! Every loop in a graph needs at least one of these delays. `build` reports a loop without delay.
//!
//! # Synapses
//!
//! A [`Synapse`] on a connection is a filter made discrete exactly: low-pass, alpha, double exponential, triangle, any
//! linear filter up to order 8, or a pure delay. Connections from one output with equal synapses share one filter. In front
//! of a probe the same filter shows its output in its own tick, without the tick of a connection. A node can have [`Filter`]s
//! of its own.
//!
//! # Processes
//!
//! [`WhiteNoise`] is random in every tick; it may be filtered or integrated, belongs to the run seed and follows the noise
//! scale of the run. [`WhiteSignal`] is a band-limited signal that repeats; it belongs to the build seed. [`Stimulus`] has
//! given values at given times, in steps or interpolated, once or again and again. [`Signal`] computes a function of time.
//! [`Process`] is the trait of further ones that need the length of a tick in advance.
//!
//! # Seeds
//!
//! Random numbers depend on two seeds. The build seed decides the parameters of layers, such as encoders. The run seed
//! ([`RunConfig`]) decides the noise and all random events in the world. Each node derives its own seed from its path
//! (see [`Seed::derive`]), so adding a node does not change the random numbers of other nodes. The same seeds give the
//! same bits.
//!
//! # The world
//!
//! A graph can link to one [`World`], such as a physics scene, that runs in the same simulated time. Once per period
//! the world reads commands from the graph and writes sensed values to the graph.
//!
//! # Threads and ranks
//!
//! Nodes with [`Parts`], such as populations of neurons, are shared among the threads of a run ([`Threads`]) and among
//! processes ([`Ranks`]). The bits are the same. The guide `docs/parallel.md` describes both.
//!
//! # How it differs from similar engines
//!
//! Connections without a synapse copy nothing: outputs are stored in topological order, so a node reads the outputs of
//! earlier nodes in place while it writes its own, without `unsafe` code. Connections from one output with the same
//! synapse share one filter. No tick allocates memory.

mod build;

mod describe;
mod error;
mod live;
mod nodes;
mod path;
mod place;
mod real;
mod run;
mod seed;
mod time;
mod unoptimised;
mod words;

pub use build::graph::{EventSource, Graph, OutputRef};
pub use build::outline::{EdgeOutline, GraphOutline, NodeOutline, OutputOutline};
pub use describe::builder::{GraphBuilder, Module, Scope};
pub use describe::draft::Note;
pub use describe::filter::Filter;
pub(crate) use describe::filter::decayed;
#[cfg(test)]
pub(crate) use describe::filter::lowpass_decay;
pub use describe::fingerprint::Fingerprint;
pub(crate) use describe::handle::PortRef;
pub use describe::handle::{In, NodePorts, Out, Ports};
pub use describe::io::{AdvanceIo, EmitIo, Inputs, Outputs, Scratch, StateMut, StateRef, StepCx};
pub use describe::kind::{AsPointer, Kind, Pointer, PointerRef, Scalar, Space, Vector, VocabTag};
pub use describe::lowering::{LayerRequest, Lowering, LoweringFault, PendingLayer};
pub use describe::node::Node;
pub use describe::parts::{PartIo, PartSpec, Parts};
pub use describe::port::{
    AnyInput, AnyOutput, InputSpec, OutputSpec, PortDecl, ScratchSpec, StateSpec,
};
pub use describe::probe_spec::{Capacity, ProbeId, ProbeSpec, SpikeProbe};
pub use describe::process::Process;
pub use describe::synapse::{LinearFilter, Synapse};
pub use error::{BuildError, BuildErrors, NodeFault, SimError, SynapseError, WorldError};
pub use live::{
    CommandError, Commands, InterventionLog, Live, LiveError, LiveOptions, LogError, Logged, Mark,
    Refused, Stretch,
};
pub use nodes::{
    Add, Apply, Constant, Interpolation, Noise, NoiseDistribution, Signal, Stimulus, WhiteNoise,
    WhiteSignal,
};
pub(crate) use path::is_inside;
#[cfg(feature = "physics")]
pub(crate) use path::is_within;
#[cfg(feature = "mpi")]
pub use place::ends::Failure;
#[cfg(feature = "mpi")]
pub use place::mpi::{MpiSession, MpiStartError};
pub use place::ranks::{Exchange, ExchangeFault, Launched, Lengths, Ranks, launched};
pub use place::threads::Threads;
pub use real::{Complex, Numbers, Real};
pub use run::checkpoint::Checkpoint;
pub use run::config::{RunConfig, RunReport, Stop, StopReason};
pub use run::intervention::{Intervention, InterventionError};
pub use run::probe::Samples;
pub use run::simulator::{SimView, Simulator};
pub use run::spikes::Spikes;
pub use run::world::{ScriptedWorld, World, WorldLink, WorldSave};
pub use seed::Seed;
pub(crate) use seed::{FNV_START, fnv1a, fnv1a_word, mix64};
pub use time::{ConfigError, SimDuration, Timebase};
pub(crate) use unoptimised::warn as warn_if_unoptimised;
pub(crate) use words::{cut, nearest_name, question};
pub use words::{few, is_plain, meant, nearest_first, plain};
