//! Layers that modules ask for, and the one table that says what each becomes.
//!
//! A module asks its scope to [`represent`](Layers::represent) a value, to [`map`](Layers::map) it
//! through a function, for [`product`](Layers::product)s, or to [`select`](Layers::select) among
//! utilities. A [`PopulationPlan`] says by path how each is computed. Only this module asks for the mode.
//! Nothing here knows symbols.

mod bank;
#[cfg(test)]
mod conformance;
mod decode;
mod dense;
mod direct;
mod layer;
mod lower;
mod model;
mod plan;
mod population;
mod selection;
mod solved;
#[cfg(test)]
mod theory;
mod tuning;

pub use layer::{
    GatedPorts, LayerPorts, Layers, Map, Product, ProductPorts, Represent, ScalarFunction, Select,
    SelectPorts, SelectRule,
};
pub use model::{Lif, TuningError};
pub use plan::{LifSpec, PathPattern, PatternError, Population, PopulationPlan, UnknownMode};
pub use solved::{SolvedError, SolvedFileError, SolvedModel};
