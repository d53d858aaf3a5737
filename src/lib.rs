//! Plans with semantic pointers: from recorded demonstrations to a simulated robot that acts.
//!
//! symbolt learns the states and actions of a task from a few recorded demonstrations, turns them into semantic
//! pointers, and plans with a graph of modules in simulated time. The same graph runs as exact maths, as firing rates
//! or as spiking neurons. For each decision it reports the simulated time of every step, in ms. You can also use only
//! a part of the crate: the engine and its modules for your own cognitive models, or the learner and planner for your
//! own recordings.
//!
//! The crate follows the Neural Engineering Framework and the Semantic Pointer Architecture. [`glossary`] explains the
//! terms on one page.
//!
//! # A first graph
//!
//! You describe a graph, build it, and run it. The type of a port names its vocabulary, so you cannot connect a
//! pointer of parts to an input for pointers of actions.
//!
//! ```
//! use symbolt::prelude::*;
//!
//! struct Parts;
//! impl VocabTag for Parts { const NAME: &'static str = "parts"; }
//!
//! let parts = VocabularyBuilder::<Parts>::new(256, Seed::new(1)).pointers(["NUT", "JIG"]).build()?;
//! let mut graph = GraphBuilder::new();
//! let nut = graph.add("nut", Constant::pointer(parts.space(), &parts.get("NUT")?));
//! let jig = graph.add("jig", Constant::pointer(parts.space(), &parts.get("JIG")?));
//! let bind = graph.add("bind", Bind::new(&parts));
//! graph.connect(&nut, &bind.a, Synapse::None);
//! graph.connect(&jig, &bind.b, Synapse::None);
//!
//! let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
//! let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
//! sim.run_for(SimDuration::from_millis(50))?;
//! assert!(cosine(&sim.value(&bind.output), &parts.parse("JIG * NUT")?) > 0.999);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The main types
//!
//! | to | use |
//! |---|---|
//! | name pointers | [`VocabularyBuilder`](spa::VocabularyBuilder), [`Vocabulary`](spa::Vocabulary), [`VocabTag`](sim::VocabTag) |
//! | describe a graph | [`GraphBuilder`](sim::GraphBuilder), [`Synapse`](sim::Synapse), [`ProbeSpec`](sim::ProbeSpec) |
//! | feed values to a graph | [`Constant`](sim::Constant), [`Stimulus`](sim::Stimulus), [`Noise`](sim::Noise) |
//! | compute with pointers | [`Bind`](spa::Bind), [`Unbind`](spa::Unbind), [`CleanupMemory`](spa::CleanupMemory), [`AssociativeMemory`](spa::AssociativeMemory), [`State`](spa::State), [`GoalBuffer`](spa::GoalBuffer), [`BasalGanglia`](spa::BasalGanglia) |
//! | choose exact maths, rates or spikes | [`PopulationPlan`](neurons::PopulationPlan), [`Population`](neurons::Population), [`LifSpec`](neurons::LifSpec) |
//! | run a graph | [`Simulator`](sim::Simulator), [`RunConfig`](sim::RunConfig), [`Seed`](sim::Seed) |
//! | model ensembles, dynamics and learning | [`Ensemble`](neurons::Ensemble), [`Learned`](neurons::Learned), [`BuiltLayer`](neurons::BuiltLayer) |
//! | add your own module, node or world | [`Module`](sim::Module), [`Node`](sim::Node), [`World`](sim::World) |
//! | learn a domain | [`Recording`](task::Recording), [`learn`](task::learn::learn), [`RelationalDomain`](task::domain::RelationalDomain) |
//! | find an object's state | [`Classifier`](task::classify::Classifier) |
//! | plan in a scene | [`Problem`](task::compile::Problem), [`PlannerBuild`](task::planner::PlannerBuild), [`ScenePlan`](task::planner::ScenePlan) |
//! | plan without geometry | [`DomainBuilder`](task::DomainBuilder), [`Planner`](task::planner::Planner), [`Decision`](task::planner::Decision) |
#![cfg_attr(
    feature = "physics",
    doc = "| act in physics | [`Task`](task::tasks::Task), [`demonstrate`](task::demonstrate), [`episode`](task::execute::episode) |"
)]
//! | repeat trials and analyse them | [`Experiment`](study::experiment::Experiment), [`Run`](study::experiment::Run) |
//!
//! [`prelude`] exports what nearly every program needs. [`guide`] has guides: models of the Neural Engineering Framework,
//! expressions and rules, planner graphs in code, your own modules, timing, ablations, your own recordings, and the scene.
//!
//! # What it is not for
//!
//! - Deep learning: nothing is differentiated, and there is no GPU backend. Ensembles, dynamics and learning rules of the Neural
//!   Engineering Framework are here: see [`guide::nef`].
//! - Existing Nengo models: they have to be rewritten. The README compares the names.
//! - Perception: the learner and the planner receive poses of objects, not images.
//! - Driving a real arm: the robot and its physics are a simulation, with perfect sensing.
//!
//! # Feature flags
//!
//! | feature | default | adds |
//! |---|---|---|
//! | `physics` | yes | the scene in Rapier, skills, the closed loop, and the report |
//! | `cli` | yes | the program `symbolt`; turns on `physics` |
//! | `mcap` | no | logs of robots as MCAP, the bags of ROS 2; needs a C compiler |
//! | `hdf5` | no | logs of robots as HDF5 |
//! | `view` | no | live runs in a browser: the module `view`, and `symbolt view` |
//! | `mpi` | no | graphs on several processes ([`Ranks`](sim::Ranks)); needs an MPI library and libclang |
//!
//! Without default features the crate has the engine, the neurons, the algebra, the learner, the planner and the
//! experiments.
//!
//! # Build profiles
//!
//! A plain `cargo run` in your own crate compiles symbolt without optimisation. Spiking neurons and physics then run
//! tens of times slower. Run with `--release`, or add this to your `Cargo.toml`:
//!
//! ```toml
//! [profile.dev.package."*"]
//! opt-level = 3
//! ```
//!
//! This optimises your dependencies once. Your own code still compiles quickly.
#![deny(unsafe_code)]

pub mod doubt;
pub mod files;
mod logs;
pub mod plan;
pub mod record;
// Rustdoc uses the first definition of each link. These definitions point to items; those of the file point to source
// files.
#[doc = concat!(
    "[`AssociativeMemory`]: crate::spa::AssociativeMemory\n",
    "[`BasalGanglia`]: crate::spa::BasalGanglia\n",
    "[`Bind`]: crate::spa::Bind\n",
    "[`Classifier`]: crate::task::classify::Classifier\n",
    "[`CleanupMemory`]: crate::spa::CleanupMemory\n",
    "[`Decision`]: crate::task::planner::Decision\n",
    "[`Domain`]: crate::task::Domain\n",
    "[`GoalBuffer`]: crate::spa::GoalBuffer\n",
    "[`GraphBuilder`]: crate::sim::GraphBuilder\n",
    "[`ItemMemory`]: crate::spa::ItemMemory\n",
    "[`LifSpec`]: crate::neurons::LifSpec\n",
    "[`Module`]: crate::sim::Module\n",
    "[`Node`]: crate::sim::Node\n",
    "[`Noise`]: crate::sim::Noise\n",
    "[`Operator`]: crate::task::Operator\n",
    "[`Pointer`]: crate::sim::Pointer\n",
    "[`Population`]: crate::neurons::Population\n",
    "[`PopulationPlan`]: crate::neurons::PopulationPlan\n",
    "[`ProbeSpec`]: crate::sim::ProbeSpec\n",
    "[`Recording`]: crate::task::Recording\n",
    "[`Scalar`]: crate::sim::Scalar\n",
    "[`Seed`]: crate::sim::Seed\n",
    "[`SelectRule`]: crate::neurons::SelectRule\n",
    "[`Simulator`]: crate::sim::Simulator\n",
    "[`Synapse`]: crate::sim::Synapse\n",
    "[`Unbind`]: crate::spa::Unbind\n",
    "[`Vector`]: crate::sim::Vector\n",
    "[`Vocabulary`]: crate::spa::Vocabulary\n",
    "[`World`]: crate::sim::World\n",
    "[`WorldState`]: crate::task::WorldState\n",
    "[`statistics`]: crate::study::statistics\n",
    "\n",
    include_str!("../docs/glossary.md"),
)]
pub mod glossary {}
// Rustdoc does not compile the guides' code blocks, because they are fragments. The examples `guide_*` compile them.
#[cfg(not(doctest))]
pub mod guide;
pub mod neurons;
#[cfg(feature = "physics")]
pub mod report;
pub mod robot;
pub mod sim;
pub mod spa;
pub mod study;
pub mod task;
#[cfg(feature = "view")]
pub mod view;

/// The crate of the arrays that some functions take and return.
pub use ndarray;

#[cfg(doctest)]
#[path = "../tests/documents/compile_fail.rs"]
mod mistakes;

/// The README's Rust blocks, compiled and run as doctests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}

/// Names that nearly every program needs: `use symbolt::prelude::*;`.
pub mod prelude {
    pub use crate::neurons::{
        Bcm, Ensemble, Learned, LifSpec, Oja, Pes, Population, PopulationPlan, Rls, SelectRule,
        Tuning, Voja, Weights,
    };
    pub use crate::record::TimeSeries;
    pub use crate::sim::{
        Add, Constant, GraphBuilder, In, Module, Noise, Out, Pointer, Ports, ProbeSpec, RunConfig,
        Scalar, Scope, Seed, Signal, SimDuration, Simulator, Stimulus, StopReason, Synapse,
        Threads, Timebase, Vector, VocabTag,
    };
    pub use crate::spa::{
        AssociativeMemory, BasalGanglia, Bind, CleanupMemory, FlowExt, Gate, GoalBuffer, Linear,
        Routes, Rules, State, Superpose, Unbind, Vocabulary, VocabularyBuilder, cosine, dot,
    };
    pub use crate::task::classify::Classifier;
    pub use crate::task::compile::Problem;
    pub use crate::task::domain::RelationalDomain;
    pub use crate::task::learn::learn;
    pub use crate::task::planner::{Decider, Planner, PlannerBuild, PlannerKind, PlannerSpec};
    pub use crate::task::{Domain, DomainBuilder, Recording, Snapshot, TaskError, Verdict};
}
