//! The one table that says what each requested layer becomes in each mode.

use std::any::Any;

use crate::sim::{Lowering, LoweringFault, Node, PendingLayer, Timebase};

use super::bank::Firing;
use super::direct::{DirectMap, DirectProduct, DirectRepresent, DirectSelect};
use super::layer::{Map, Product, Represent, Select};
use super::model::TuningError;
use super::plan::{Population, PopulationPlan};
use super::population::Maker;

impl Lowering for PopulationPlan {
    fn lower(
        &self,
        layers: &[PendingLayer<'_>],
        time: Timebase,
    ) -> Result<Vec<Box<dyn Node>>, Vec<LoweringFault>> {
        let mut faults = Vec::new();
        for (pattern, _) in &self.overrides {
            if !layers.iter().any(|layer| pattern.matches(layer.path)) {
                faults.push(LoweringFault {
                    path: pattern.to_string(),
                    reason: "the pattern matches no layer".into(),
                    choices: layers.iter().map(|layer| layer.path.into()).collect(),
                });
            }
        }
        let mut nodes = Vec::with_capacity(layers.len());
        for layer in layers {
            match lower_one(self.population(layer.path), layer, time.dt_s()) {
                Ok(node) => nodes.push(node),
                Err(Refused::Unknown) => faults.push(LoweringFault {
                    path: layer.path.into(),
                    reason: "this layer is not one that the populations know".into(),
                    choices: ["Represent", "Map", "Product", "Select"].map(String::from).into(),
                }),
                Err(Refused::Tuning(error)) => faults.push(LoweringFault {
                    path: layer.path.into(),
                    reason: error.to_string(),
                    choices: Vec::new(),
                }),
            }
        }
        if faults.is_empty() { Ok(nodes) } else { Err(faults) }
    }
}

enum Refused {
    Unknown,
    Tuning(TuningError),
}

impl From<TuningError> for Refused {
    fn from(error: TuningError) -> Self {
        Self::Tuning(error)
    }
}

/// The table: a row a layer, a column a mode.
fn lower_one(
    population: Population,
    layer: &PendingLayer<'_>,
    dt_s: f64,
) -> Result<Box<dyn Node>, Refused> {
    let request: &dyn Any = layer.request;
    let seed = layer.seed;
    let maker = match &population {
        Population::Direct => None,
        Population::Rate(spec) => Some(Maker { spec, firing: Firing::Rates, dt_s, seed }),
        Population::Lif(spec) => Some(Maker { spec, firing: Firing::Spikes, dt_s, seed }),
    };
    if let Some(layer) = request.downcast_ref::<Represent>() {
        Ok(match maker {
            None => Box::new(DirectRepresent(layer.clone())),
            Some(maker) => Box::new(maker.represent(layer)?),
        })
    } else if let Some(layer) = request.downcast_ref::<Map>() {
        Ok(match maker {
            None => Box::new(DirectMap(layer.clone())),
            Some(maker) => Box::new(maker.map(layer)?),
        })
    } else if let Some(layer) = request.downcast_ref::<Product>() {
        Ok(match maker {
            None => Box::new(DirectProduct(layer.clone())),
            Some(maker) => Box::new(maker.product(layer)?),
        })
    } else if let Some(layer) = request.downcast_ref::<Select>() {
        Ok(match maker {
            None => Box::new(DirectSelect(layer.clone())),
            Some(maker) => Box::new(maker.select(layer)?),
        })
    } else {
        Err(Refused::Unknown)
    }
}
