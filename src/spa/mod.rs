//! The Semantic Pointer Architecture: vector-symbolic algebra, vocabularies and the modules of a graph.
//!
//! The algebra binds, compares and cleans up vectors directly, without a graph. From the modules you build a graph
//! through which semantic pointers flow, in exact arithmetic or in spiking neurons.
//!
//! # Algebra on vectors
//!
//! - [`VocabularyBuilder`] and [`Vocabulary`]: named pointers of one space, and expressions over them. Pointers of
//!   two vocabularies have different types, so mixing them up does not compile.
//! - [`Hrr`]: binding and unbinding by circular convolution, with fractional powers; [`Vtb`] and [`Tvtb`]: by
//!   vector-derived transformations. All implement the trait [`Algebra`].
//! - [`cosine`]: the similarity of two pointers.
//! - [`ItemMemory`]: finds the stored vector most similar to a query, exactly and fast.
//! - [`FactoredItems`]: a large item memory whose items are sparse sums of shared atoms.
//! - [`PairDecoder`]: decodes all fillers of a sum of role-filler pairs.
//! - [`Resonator`]: finds the factors of a bound pointer.
//! - [`Capacity`] and [`Vocabulary::reliability`]: predict how reliably pointers are decoded.
//!
//! # Modules of a graph
//!
//! | module | what it does | in nengo_spa |
//! |---|---|---|
//! | [`State`] | represents a pointer; with a recurrent synapse, remembers it | `State` |
//! | [`Bind`], [`Unbind`] | binds or unbinds two changing pointers | `Bind` |
//! | [`Linear::unbind`] | unbinds a fixed role | `~` and `*` with a symbol |
//! | [`Compare`] | the scalar product of two changing pointers | `Compare`, `dot` |
//! | [`Multiply`], [`Weigh`] | multiplies two numbers, or a number and a pointer or vector | `Product` |
//! | [`Superpose`] | adds pointers with weights | `Superposition`, `+` |
//! | [`CleanupMemory`], [`AssociativeMemory`] | chooses stored pointers by similarity | `ThresholdingAssocMem`, `WTAAssocMem`, `IAAssocMem` |
//! | [`DecodePairs`] | decodes all fillers of a sum of role-filler pairs at once | |
//! | [`JointMemory`] | finds the items that meet several conditions at once | |
//! | [`FactoredSimilarity`] | compares pointers with items that share atoms | |
//! | [`Selection`] | chooses among utilities by a rule | `Thresholding`, `WTA`, `IA` |
//! | [`BasalGanglia`] | chooses the action of greatest utility | `BasalGanglia` with `Thalamus` |
//! | [`Gate`] | lets a pointer pass or silences it | gated routes of `ActionSelection` |
//! | [`ValueGate`] | lets a number or a vector pass or silences it | |
//! | [`GoalBuffer`] | stores its input while its gate is open, then holds it | |
//! | [`GatedMemory`] | the same for a number or a vector | `InputGatedMemory` of Nengo |
//! | [`Integrator`], [`Oscillator`] | integrates its input; turns a point | those of Nengo |
//! | [`ResonatorNetwork`] | finds the factors of a bound pointer | |
//! | [`Sequence`] | steps through named pointers | |
//! | [`Tape`] | writes pointers at the positions of a moving index, and reads them | |
//! | [`Linear`] | applies a fixed linear map | transforms |
//! | [`Linear::reinterpret`] | passes a pointer on as one of another vocabulary | `reinterpret` |
//!
//! Every module filters the output of its populations with a synapse of 5 ms, unless its docs say otherwise. You can
//! therefore connect its outputs without a synapse. The delay of a module is the same in every mode.
//!
//! [`flow`] writes these modules as expressions, such as `graph.route(&scene * !role >> &cleanup)`, and [`Rules`] are
//! named action rules, as in nengo_spa's `ActionSelection`.
//!
//! # Example
//!
//! This graph reads the colour out of a scene, by unbinding and cleanup:
//!
//! ```
//! use symbolt::neurons::SelectRule;
//! use symbolt::prelude::*;
//! use symbolt::sim::VocabTag;
//! use symbolt::spa::{CleanupMemory, Linear, VocabularyBuilder, cosine};
//!
//! struct Things;
//! impl VocabTag for Things {
//!     const NAME: &'static str = "things";
//! }
//!
//! let things = VocabularyBuilder::<Things>::new(256, Seed::new(1))
//!     .pointers(["RED", "BLUE", "CIRCLE", "COLOUR", "SHAPE"])
//!     .build()?;
//! let scene = things.parse("COLOUR * RED + SHAPE * CIRCLE")?;
//!
//! let mut graph = GraphBuilder::new();
//! let scene = graph.add("scene", Constant::pointer(things.space(), &scene));
//! let colour = graph.add("colour", Linear::unbind(&things, "COLOUR")?);
//! let rule = SelectRule::WinnerTakeAll { level: 0.3 };
//! let cleanup = graph.add("cleanup", CleanupMemory::new(&things, ["RED", "BLUE", "CIRCLE"], rule)?);
//! graph.connect(&scene, &colour.input, Synapse::None);
//! graph.connect(&colour.output, &cleanup.input, Synapse::None);
//!
//! let plan = PopulationPlan::direct();
//! let graph = graph.build(Timebase::default(), &plan, Seed::new(1))?;
//! let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
//! sim.run_for(SimDuration::from_millis(50))?;
//! assert!(cosine(&sim.value(&cleanup.output), &things.get("RED")?) > 0.99);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What this module does not do
//!
//! - A vocabulary never changes; [`Vocabulary::grow`] makes a larger one. A running graph learns no pointers.
//! - It knows no tasks or robots.

mod algebra;
mod capacity;
mod error;
mod expr;
mod factored;
pub mod flow;
mod frame;
mod item_memory;
mod modules;
mod pairs;
mod pointer;
mod resonator;
mod vocabulary;

pub use crate::neurons::{BilinearPorts, GatePorts};
pub use crate::sim::PointerRef;
pub use algebra::{
    Algebra, Hrr, LinearMap, ProductForm, Tvtb, Vtb, Workspace, cosine, cosine_of_slices, dot,
    norm, normalize,
};
pub use capacity::Capacity;
pub use error::VocabError;
pub use factored::FactoredItems;
pub use flow::{Flow, FlowExt, IntoFlow, Route, Routes, Rule, Rules, RulesPorts};
pub(crate) use item_memory::dots;
pub use item_memory::{ItemMemory, Match};
pub use modules::{
    AssociativeMemory, BasalGanglia, BasalGangliaPorts, Bind, CleanupMemory, Compare, DecodePairs,
    DecodePairsPorts, FEED_FORWARD, FactoredSimilarity, FactoredSimilarityPorts, Gate, GatedMemory,
    GoalBuffer, Integrator, JointMemory, JointMemoryPorts, Linear, MemoryPorts, Multiply,
    Oscillator, OscillatorPorts, RECURRENT, ResonatorNetwork, ResonatorNetworkPorts, Selection,
    SelectionPorts, Sequence, SequencePorts, State, Superpose, SuperposePorts, Tape, TapePorts,
    Unbind, UnbindPorts, ValueGate, Weigh, WeighPorts,
};
pub use pairs::{Filler, PairDecoder};
pub use pointer::PointerValue;
pub use resonator::{Factors, Resonator};
pub(crate) use vocabulary::draw_pointer;
pub use vocabulary::{Name, OutputVocabulary, Vocabulary, VocabularyBuilder, random_pointer};
