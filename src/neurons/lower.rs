//! The one table that says what each requested layer becomes in each mode.

use std::any::Any;

use crate::sim::{LayerRequest, Lowering, LoweringFault, Node, PendingLayer, Timebase};

use super::direct::{DirectMap, DirectProduct, DirectRepresent, DirectSelect};
use super::layer::{Map, Product, Represent, Select};
use super::plan::{Population, PopulationPlan};

impl Lowering for PopulationPlan {
    fn lower(
        &self,
        layers: &[PendingLayer<'_>],
        _time: Timebase,
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
            match lower_one(self.population(layer.path), layer.request) {
                Some(node) => nodes.push(node),
                None => faults.push(LoweringFault {
                    path: layer.path.into(),
                    reason: "this layer is not one that the populations know".into(),
                    choices: ["Represent", "Map", "Product", "Select"].map(String::from).into(),
                }),
            }
        }
        if faults.is_empty() { Ok(nodes) } else { Err(faults) }
    }
}

fn lower_one(population: Population, request: &dyn LayerRequest) -> Option<Box<dyn Node>> {
    let request: &dyn Any = request;
    let Population::Direct = population;
    if let Some(layer) = request.downcast_ref::<Represent>() {
        Some(Box::new(DirectRepresent(layer.clone())))
    } else if let Some(layer) = request.downcast_ref::<Map>() {
        Some(Box::new(DirectMap(layer.clone())))
    } else if let Some(layer) = request.downcast_ref::<Product>() {
        Some(Box::new(DirectProduct(layer.clone())))
    } else if let Some(layer) = request.downcast_ref::<Select>() {
        Some(Box::new(DirectSelect(layer.clone())))
    } else {
        None
    }
}
