//! Lowering: turns each requested layer into a node, according to its mode.

use std::any::Any;
use std::collections::BTreeMap;

use crate::sim::{
    Graph, Lengths, Lowering, LoweringFault, Node, PendingLayer, Ranks, Real, Timebase,
};

use super::bank::{Bank, Firing};
use super::direct::{DirectMap, DirectProduct, DirectRepresent, DirectSelect};
use super::ensemble::{DirectEnsemble, Ensemble, NeuralEnsemble};
use super::layer::{Map, Product, Represent, Select};
use super::parted::Deal;
use super::plan::{Population, PopulationPlan};
use super::population::{Maker, Neural, NeuralProduct, Refusal};
use super::selection::NeuralSelect;
use super::solved::{Kept, SolvedModel, Unfit};

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
        let deal = Deal::new(self.ranks.as_ref());
        for layer in layers {
            let solved = self.solved.as_deref();
            let (reason, choices) = match lower_one(
                self.population(layer.path),
                (solved, &deal),
                layer,
                time.dt_s(),
            ) {
                Ok(node) => {
                    nodes.push(node);
                    continue;
                }
                Err(Refused::Unknown) => (
                    "populations cannot compute this layer".into(),
                    ["Represent", "Map", "Product", "Select", "Ensemble"].map(String::from).into(),
                ),
                Err(Refused::Population(Refusal::Tuning(error))) => (error.to_string(), Vec::new()),
                Err(Refused::Population(Refusal::Unfit(Unfit::Missing))) => {
                    let paths = solved.iter().flat_map(|s| s.paths()).map(String::from).collect();
                    ("the solved model has no such layer".into(), paths)
                }
                Err(Refused::Population(Refusal::Unfit(Unfit::Mismatch))) => {
                    let reason = "the solved model's population was made from another seed, tick, tuning, \
                                  size or function; expected a model solved for this graph";
                    (reason.into(), Vec::new())
                }
            };
            faults.push(LoweringFault { path: layer.path.into(), reason, choices });
        }
        if let Some(ranks) = &self.ranks {
            agree(ranks, &mut nodes, &mut faults);
        }
        if faults.is_empty() { Ok(nodes) } else { Err(faults) }
    }

    fn ranks(&self) -> Option<&Ranks> {
        self.ranks.as_ref()
    }
}

/// Lets all ranks use the same current to close a gate: the greatest that an ensemble needs, whoever owns it. A fault of
/// one rank becomes a fault of all.
fn agree(ranks: &Ranks, nodes: &mut [Box<dyn Node>], faults: &mut Vec<LoweringFault>) {
    let mut banks: Vec<&mut Bank> = nodes
        .iter_mut()
        .filter_map(|node| (&mut **node as &mut dyn Any).downcast_mut::<Neural>())
        .filter_map(Neural::bank_mut)
        .collect();
    let failed = |rank: usize, reason: String| LoweringFault {
        path: format!("the part of rank {rank}"),
        reason,
        choices: Vec::new(),
    };
    // Ranks with faults lack nodes, so all first tell how many banks they have.
    let found = u64::from(faults.is_empty());
    let others = ranks.differs(found << 32 | banks.len() as u64).and_then(|rank| {
        let Some(rank) = rank else { return Ok(None) };
        let own = faults.first().map(|fault| format!("{}: {}", fault.path, fault.reason));
        let mut reasons = ranks.reasons(&own.unwrap_or_default())?;
        let with_reason = reasons.iter().position(|reason| !reason.is_empty());
        let rank = with_reason.unwrap_or(rank);
        Ok(Some((rank, reasons.swap_remove(rank))))
    });
    match others {
        Ok(None) if faults.is_empty() => {}
        Ok(None) => return,
        // This rank knows its own faults.
        Ok(Some(_)) if !faults.is_empty() => return,
        Ok(Some((rank, reason))) => {
            let reason = match &*reason {
                "" => "is another than that of this rank; all ranks must build one graph".into(),
                reason => format!("could not be built: {reason}"),
            };
            return faults.push(failed(rank, reason));
        }
        Err(fault) => return faults.push(failed(fault.rank, fault.reason)),
    }
    let own: Vec<Real> = banks.iter().flat_map(|bank| [bank.silencing, bank.quiet]).collect();
    let Some(lengths) = Lengths::new((0..ranks.ranks()).map(|_| own.len())) else { return };
    let mut all = vec![0.0; lengths.total()];
    if let Err(fault) = ranks.all_gather(&own, &lengths, &mut all) {
        return faults.push(failed(fault.rank, fault.reason));
    }
    for (index, bank) in banks.iter_mut().enumerate() {
        let of = |at: usize| all.iter().skip(2 * index + at).step_by(own.len()).copied();
        bank.silencing = of(0).fold(0.0, Real::max);
        bank.quiet = of(1).fold(Real::MAX, Real::min);
    }
}

enum Refused {
    Unknown,
    Population(Refusal),
}

impl From<Refusal> for Refused {
    fn from(refusal: Refusal) -> Self {
        Self::Population(refusal)
    }
}

/// Makes the node of one layer: one branch per layer, one arm per mode.
fn lower_one(
    population: Population,
    (solved, deal): (Option<&SolvedModel>, &Deal),
    layer: &PendingLayer<'_>,
    dt_s: f64,
) -> Result<Box<dyn Node>, Refused> {
    let request: &dyn Any = layer.request;
    let (path, seed) = (layer.path, layer.seed);
    let maker = match &population {
        Population::Direct => None,
        Population::Rate(spec) => Some((spec, Firing::Rates)),
        Population::Lif(spec) => Some((spec, Firing::Spikes)),
    };
    let maker = maker.map(|(spec, firing)| Maker { spec, firing, dt_s, path, seed, solved, deal });
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
    } else if let Some(layer) = request.downcast_ref::<Ensemble>() {
        Ok(match maker {
            None => Box::new(DirectEnsemble(layer.clone())),
            Some(maker) => Box::new(maker.ensemble(layer)?),
        })
    } else {
        Err(Refused::Unknown)
    }
}

/// Returns the banks of a node, if it is a population.
fn banks(part: &dyn Any) -> Option<Vec<Kept>> {
    if let Some(node) = part.downcast_ref::<Neural>() {
        Some(node.kept())
    } else if let Some(node) = part.downcast_ref::<NeuralProduct>() {
        Some(node.kept())
    } else if let Some(node) = part.downcast_ref::<NeuralSelect>() {
        Some(node.kept())
    } else {
        part.downcast_ref::<NeuralEnsemble>().map(NeuralEnsemble::kept)
    }
}

/// Returns the number of neurons in `graph`, those of all ranks together. Layers in direct mode have none.
pub fn neurons(graph: &Graph) -> usize {
    let banks = graph.nodes().filter_map(|(_, part)| banks(part)).flatten();
    banks.map(|kept| kept.bank.shape.ensembles * kept.bank.shape.neurons).sum()
}

/// Returns the number of neurons in `graph` that this process solved and advances: all of them, unless several ranks
/// share the graph.
pub fn own_neurons(graph: &Graph) -> usize {
    let banks = graph.nodes().filter_map(|(_, part)| banks(part)).flatten();
    let own = |bank: &Bank| bank.own.as_ref().map_or(bank.shape.ensembles, Vec::len);
    banks.map(|kept| own(&kept.bank) * kept.bank.shape.neurons).sum()
}

impl SolvedModel {
    /// Returns the populations of all neural layers of `graph`; layers in direct mode have none, nor have layers of which
    /// this process owns only a part.
    ///
    /// Shares memory with the graph: nothing is copied.
    pub fn of(graph: &Graph) -> Self {
        let mut layers = BTreeMap::new();
        for (path, part) in graph.nodes() {
            let Some(kept) = banks(part) else { continue };
            if kept.iter().all(|kept| kept.bank.own.is_none()) {
                layers.insert(path.to_owned(), kept);
            }
        }
        Self { layers }
    }
}
