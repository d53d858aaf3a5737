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
//! - [`Population::Lif`]: spiking leaky integrate-and-fire neurons.
//!
//! [`LifSpec`] sets the number and tuning of the neurons, and [`Lif`] their time constants. A [`SolvedModel`] keeps
//! neurons and decoders, so that later runs do not solve for them again.
//!
//! # Example
//!
//! One ensemble of 100 spiking neurons squares a number:
//!
//! ```
//! use symbolt::neurons::{LayerPorts, Layers, LifSpec, Map};
//! use symbolt::prelude::*;
//! use symbolt::sim::Vector;
//!
//! struct Square;
//! impl Module for Square {
//!     type Ports = LayerPorts<Vector>;
//!     fn expand(self, scope: &mut Scope<'_>) -> LayerPorts<Vector> {
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
//! let plan = PopulationPlan::all(Population::Lif(LifSpec::default()));
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
//! - It has one neuron model, [`Lif`], and no learning rules: decoders are solved when the graph is built.
//! - Ensembles cannot be connected neuron to neuron. All connections carry decoded values.
//! - It reads no Nengo models. For equal parameters, spikes and decoded values agree with those of Nengo; the tests
//!   check this. The random draws of the two programs differ.

mod bank;
#[cfg(test)]
mod conformance;
mod decode;
mod dense;
mod direct;
mod ensemble;
mod layer;
mod lower;
mod model;
mod parted;
mod plan;
mod population;
mod selection;
mod solved;
#[cfg(test)]
mod theory;
mod tuning;

pub use ensemble::{Ensemble, EnsemblePorts};
pub use layer::{
    GatedPorts, LayerPorts, Layers, Map, Product, ProductPorts, Represent, ScalarFunction, Select,
    SelectPorts, SelectRule,
};
pub use lower::{neurons, own_neurons};
pub use model::{Lif, TuningError};
pub use plan::{LifSpec, PathPattern, PatternError, Population, PopulationPlan, UnknownMode};
pub use population::solver_signature;
pub use solved::{SolvedError, SolvedFileError, SolvedModel};
