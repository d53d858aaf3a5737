//! Neural layers, and the plan that decides how each of them is computed.
//!
//! This module implements the Neural Engineering Framework (Eliasmith and Anderson, "Neural Engineering", 2003) as
//! five layers. A module requests a layer without saying how to compute it. When the graph is built, a plan assigns
//! neurons or exact arithmetic to each layer. The connections, delays and seeds of the graph are the same in all
//! modes.
//!
//! # Layers
//!
//! The trait [`Layers`] adds these requests to every [`Scope`](crate::sim::Scope):
//!
//! | request | what the layer computes | description |
//! |---|---|---|
//! | [`represent`](Layers::represent) | its input, limited to a radius; optionally behind a gate | [`Represent`] |
//! | [`map`](Layers::map) | a function of each component | [`Map`] |
//! | [`product`](Layers::product) | products of pairs of numbers | [`Product`] |
//! | [`ensemble`](Layers::ensemble) | functions of several components | [`Ensemble`] |
//! | [`select`](Layers::select) | a choice among utilities | [`Select`], [`SelectRule`] |
//!
//! # Modes
//!
//! A [`PopulationPlan`] assigns a [`Population`] to each layer, by the layer's path:
//!
//! - [`Population::Direct`]: the exact function;
//! - [`Population::Rate`]: firing rates of neurons, with the decoding error of a population but without spikes;
//! - [`Population::Lif`]: spiking leaky integrate-and-fire neurons;
//! - [`Population::Neurons`]: neurons of any [`NeuronModel`], such as one of your own.
//!
//! The models are [`Lif`], [`AdaptiveLif`], [`Izhikevich`], [`SpikingRectifiedLinear`], [`RegularSpiking`],
//! [`StochasticSpiking`] and [`PoissonSpiking`], which spike, and [`LifRate`], [`AdaptiveLifRate`],
//! [`RectifiedLinear`], [`Sigmoid`], [`Tanh`] and [`RateOf`] any model, which have rates.
//!
//! [`Tuning`] sets the number of the neurons and the ranges from which they are drawn. A [`SolvedModel`] keeps neurons
//! and decoders, so that later runs do not solve for them again.
//!
//! An [`Ensemble`] may have encoders, intercepts, rates, evaluation points, a model and solvers of its own.
//! [`BuiltLayer`] reads back what any layer was built with: neurons, decoders, their error, tuning curves.
//!
//! A new neuron model implements [`NeuronModel`], a new kind of layer implements [`Layer`], a new solver [`Solver`].
//! Nothing else knows them one by one.
//!
//! # Neurons and learning
//!
//! An [`Ensemble`] can [expose its neurons](Ensemble::expose_neurons): their activities as an output, and currents into
//! them as an input; and [their state](Ensemble::expose_state), such as voltages. A [`Learned`] connection from such an output changes its weights by rules while the graph runs; see
//! [`learning`].
//!
//! # Example
//!
//! One ensemble of 100 spiking neurons squares a number:
//!
//! ```
//! use symbolt::neurons::{Layers, LifSpec, Map};
//! use symbolt::sim::Ports;
//! use symbolt::prelude::*;
//! use symbolt::sim::Vector;
//!
//! struct Square;
//! impl Module for Square {
//!     type Ports = Ports<Vector>;
//!     fn expand(self, scope: &mut Scope<'_>) -> Ports<Vector> {
//!         scope.map("neurons", Map::each(1, |x| x * x))
//!     }
//! }
//!
//! let mut graph = GraphBuilder::new();
//! let input = graph.add("input", Constant::vector(&[0.8]));
//! let square = graph.add("square", Square);
//! graph.connect(&input, &square.input, Synapse::None);
//! let probe = graph.probe(
//!     &square.output,
//!     ProbeSpec::default().filtered(Synapse::lowpass_ms(20)),
//! );
//!
//! let plan = PopulationPlan::lif();
//! let graph = graph.build(Timebase::default(), &plan, Seed::new(1))?;
//! let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
//! sim.run_for(SimDuration::from_millis(300))?;
//! let (_, squared) = sim.samples(&probe).last().expect("one sample per tick");
//! assert!((squared[0] - 0.64).abs() < 0.05);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What this module does not do
//!
//! - It knows no symbols: semantic pointers and their algebra are in the module `spa`, which builds on this one.
//! - It reads no Nengo models. For equal parameters, spikes and decoded values agree with those of Nengo; the tests
//!   check this. The random draws of the two programs differ.

mod bank;
mod builder;
mod built;
#[cfg(test)]
mod conformance;
mod draw;
mod layers;
pub mod learning;
mod lower;
#[cfg(test)]
#[path = "../../tests/unit/neuron_models.rs"]
mod model_tests;
mod models;
mod pattern;
mod plan;
mod poles;
mod saturation;
mod solve;
mod solved;
#[cfg(test)]
mod theory;
mod traffic;
mod tuning;
mod turn;

pub use bank::{Ensembles, Work};
pub use builder::{Components, Keep, Onset, Owner, PopulationBuilder, solver_signature};
pub use built::{BuiltEnsemble, BuiltLayer, ReadBackError};
pub use layers::{
    BilinearPorts, Circuit, Encoders, Ensemble, EnsemblePorts, GatePorts, Items, Layer, Layers,
    Map, Populated, Product, Represent, ScalarFunction, Select, SelectPorts, SelectRule, Target,
    Through, Values,
};
pub use learning::{
    Bcm, Learned, LearnedPorts, LearningRule, LearningTick, Needs, Oja, Pes, Rls, Side, Stretch,
    Trace, Voja, WeightShape, Weights, WeightsError,
};
pub use lower::{neurons, own_neurons};
pub use models::{
    AdaptiveLif, AdaptiveLifRate, Block, Draws, Firing, Izhikevich, Lif, LifRate, NeuronModel,
    PoissonSpiking, RateOf, RectifiedLinear, RegularSpiking, Sigmoid, SpikingRectifiedLinear,
    Start, StochasticSpiking, Tanh, Variable,
};
pub use pattern::{PathPattern, PatternError};
pub use plan::{LifSpec, NeuronSpec, Population, PopulationPlan, UnknownMode};
pub use saturation::{LayerSaturation, Saturation};
pub use solve::{L1, L2, LeastSquares, NoDecoders, Noisy, NonNegative, Solver};
pub use solved::{SolvedError, SolvedFileError, SolvedModel};
pub use traffic::Traffic;
pub use tuning::{DrawnEncoders, Tuning, TuningError};
