//! Lowering: turns each requested layer into a node, according to its mode.

use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::sim::{
    Graph, Lengths, Lowering, LoweringFault, Node, PendingLayer, Ranks, Real, Timebase,
};

use super::bank::{Bank, LoadBalance, Solved};
use super::builder::PopulationBuilder;
use super::layers::{Layer, Populated, Request};
use super::plan::{Population, PopulationPlan};
use super::solved::SolvedModel;
use super::tuning::TuningError;

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
        let balance = LoadBalance::new(self.ranks.as_ref());
        for layer in layers {
            let request: &dyn Any = layer.request;
            let node = match request.downcast_ref::<Request>() {
                Some(Request(layer_of)) => self.node(layer, &**layer_of, &balance, time.dt_s()),
                None => {
                    Err(("only layers of the module `neurons` can be computed".into(), Vec::new()))
                }
            };
            match node {
                Ok(node) => nodes.push(node),
                Err((reason, choices)) => {
                    faults.push(LoweringFault { path: layer.path.into(), reason, choices });
                }
            }
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

/// Why a layer cannot become a node, and valid choices.
type Fault = (String, Vec<String>);

impl PopulationPlan {
    /// Makes the node of one layer, in its mode.
    fn node(
        &self,
        asked: &PendingLayer<'_>,
        layer: &dyn Layer,
        balance: &LoadBalance,
        dt_s: f64,
    ) -> Result<Box<dyn Node>, Fault> {
        let (path, seed, solved) = (asked.path, asked.seed, self.solved.as_deref());
        let population = self.population(path);
        let in_rates = matches!(population, Population::Rate(_));
        let Some(spec) = &population.spec() else {
            return match layer.only_neural() {
                Some(reason) => Err((reason.into(), Vec::new())),
                None => Ok(layer.direct()),
            };
        };
        let builder = PopulationBuilder { spec, dt_s, path, seed, solved, balance, in_rates };
        let node = layer.neural(&builder).map_err(|error| {
            let paths = || solved.iter().flat_map(|s| s.paths()).map(String::from).collect();
            let choices = if error == TuningError::Missing { paths() } else { Vec::new() };
            (error.to_string(), choices)
        })?;
        Ok(Box::new(node))
    }
}

/// Lets all ranks use the same current to close a gate: the greatest that an ensemble needs, whoever owns it. A fault of
/// one rank becomes a fault of all.
fn agree(ranks: &Ranks, nodes: &mut [Box<dyn Node>], faults: &mut Vec<LoweringFault>) {
    let mut banks: Vec<&mut Bank> = nodes
        .iter_mut()
        .filter_map(|node| (&mut **node as &mut dyn Any).downcast_mut::<Populated>())
        .flat_map(Populated::banks_mut)
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

/// Returns what the populations of a graph were solved to, with the paths of their layers.
fn populations(graph: &Graph) -> impl Iterator<Item = (&str, &Arc<Solved>)> {
    let layers = graph.nodes().filter_map(|(path, part)| Some((path, part.downcast_ref()?)));
    layers.flat_map(|(path, layer): (_, &Populated)| layer.solved().map(move |s| (path, s)))
}

/// Returns the number of neurons in `graph`, those of all ranks together. Layers in direct mode have none.
pub fn neurons(graph: &Graph) -> usize {
    let shapes = populations(graph).map(|(_, solved)| solved.shape);
    shapes.map(|shape| shape.ensembles * shape.neurons).sum()
}

/// Returns the number of neurons in `graph` that this process solved and advances: all of them, unless several ranks
/// share the graph.
pub fn own_neurons(graph: &Graph) -> usize {
    let own = |solved: &Solved| solved.own.as_ref().map_or(solved.shape.ensembles, Vec::len);
    populations(graph).map(|(_, solved)| own(solved) * solved.shape.neurons).sum()
}

impl SolvedModel {
    /// Returns the populations of all neural layers of `graph`; layers in direct mode have none, nor have layers of which
    /// this process owns only a part.
    ///
    /// Shares memory with the graph: nothing is copied.
    pub fn of(graph: &Graph) -> Self {
        let mut layers = BTreeMap::<String, Vec<_>>::new();
        for (path, solved) in populations(graph) {
            layers.entry(path.to_owned()).or_default().push(solved.clone());
        }
        layers.retain(|_, solved| solved.iter().all(|solved| solved.own.is_none()));
        Self { layers }
    }
}
