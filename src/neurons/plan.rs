//! Population plans: the mode of each layer, as a default for the graph and exceptions by path.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use thiserror::Error;

use super::models::{Lif, LifRate, NeuronModel};
use super::pattern::PathPattern;
use super::solved::SolvedModel;
use super::tuning::Tuning;
use crate::sim::{Fingerprint, Ranks, few, meant, question};

/// Leaky integrate-and-fire neurons and their tuning, spiking ([`Population::Lif`]) or by their rates
/// ([`Population::Rate`]).
///
/// The tick must be at most a quarter of the membrane time constant. The maximum rates must be below `1 / tau_ref`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LifSpec {
    /// Neuron model: time constants, size of a spike, least voltage.
    pub model: Lif,
    /// Number of neurons, and the ranges from which they are drawn.
    pub tuning: Tuning,
}

impl LifSpec {
    /// Returns the default neurons with another tuning.
    pub fn tuned(tuning: Tuning) -> Self {
        Self { tuning, ..Self::default() }
    }

    /// Returns the default neurons with few of them per item of a selection: see [`Tuning::few_per_item`].
    pub fn few_per_item(per_item: usize) -> Self {
        Self::tuned(Tuning::few_per_item(per_item))
    }
}

/// Neurons of any model and their tuning.
#[derive(Debug, Clone)]
pub struct NeuronSpec {
    /// Neuron model.
    pub model: Arc<dyn NeuronModel>,
    /// Number of neurons, and the ranges from which they are drawn.
    pub tuning: Tuning,
}

impl NeuronSpec {
    /// Combines a model and a tuning.
    pub fn new(model: impl NeuronModel, tuning: Tuning) -> Self {
        Self { model: Arc::new(model), tuning }
    }
}

impl Default for NeuronSpec {
    fn default() -> Self {
        Self::new(Lif::default(), Tuning::default())
    }
}

/// Models are equal if they have the same fingerprint.
impl PartialEq for NeuronSpec {
    fn eq(&self, other: &Self) -> bool {
        let model = |spec: &Self| {
            let mut hash = Fingerprint::default();
            spec.model.fingerprint(&mut hash);
            hash.value()
        };
        model(self) == model(other) && self.tuning == other.tuning
    }
}

/// How a layer is computed: its mode, and the neurons if it has any.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub enum Population {
    /// Direct mode: the exact function, with the delays of a population.
    #[default]
    Direct,
    /// Rate mode: the output of a neuron is its firing rate. Such neurons have the tuning and decoding error of a
    /// population but no spikes.
    Rate(LifSpec),
    /// Spiking mode: leaky integrate-and-fire neurons.
    Lif(LifSpec),
    /// Neurons of any model.
    Neurons(NeuronSpec),
}

/// A mode with its name.
type Named = (&'static str, fn() -> Population);

/// The modes that have a name. Named modes have the default tuning.
const NAMED: [Named; 3] = [
    ("direct", || Population::Direct),
    ("rate", || Population::Rate(LifSpec::default())),
    ("lif", || Population::Lif(LifSpec::default())),
];

impl Population {
    /// Returns neurons of a model with the default tuning.
    pub fn neurons(model: impl NeuronModel) -> Self {
        Self::Neurons(NeuronSpec::new(model, Tuning::default()))
    }

    /// Returns the names of modes, as [`FromStr`] reads them. Modes read by name have the default [`Tuning`].
    pub fn names() -> impl Iterator<Item = &'static str> {
        NAMED.iter().map(|(name, _)| *name)
    }

    /// Returns the neurons; `None` in direct mode.
    pub fn spec(&self) -> Option<NeuronSpec> {
        match self {
            Self::Direct => None,
            Self::Rate(LifSpec { model, tuning }) => {
                Some(NeuronSpec::new(LifRate(*model), *tuning))
            }
            Self::Lif(LifSpec { model, tuning }) => Some(NeuronSpec::new(*model, *tuning)),
            Self::Neurons(spec) => Some(spec.clone()),
        }
    }

    /// Changes the tuning of the neurons. Direct mode stays as it is.
    pub fn tuned(mut self, change: impl FnOnce(Tuning) -> Tuning) -> Self {
        match &mut self {
            Self::Direct => {}
            Self::Rate(LifSpec { tuning, .. })
            | Self::Lif(LifSpec { tuning, .. })
            | Self::Neurons(NeuronSpec { tuning, .. }) => *tuning = change(*tuning),
        }
        self
    }
}

/// How other words for a mode begin, and the name of the mode.
const ALSO: [(&str, &str); 4] =
    [("spik", "lif"), ("neuro", "lif"), ("exact", "direct"), ("math", "direct")];

/// Returns a question about the mode that was probably meant.
fn meant_mode(asked: &str) -> String {
    let lower = asked.to_lowercase();
    match ALSO.iter().find(|(begin, _)| lower.starts_with(begin)) {
        Some((_, name)) => question(Some(*name)),
        None => meant(asked, Population::names()),
    }
}

/// The error for a mode that does not exist.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "there is no mode `{asked}`{}; the modes are: {}",
    meant_mode(asked),
    few(Population::names())
)]
pub struct UnknownMode {
    /// Name that was given.
    pub asked: String,
}

impl FromStr for Population {
    type Err = UnknownMode;

    fn from_str(name: &str) -> Result<Self, UnknownMode> {
        let found = NAMED.iter().find(|(known, _)| *known == name);
        found.map(|(_, mode)| mode()).ok_or_else(|| UnknownMode { asked: name.into() })
    }
}

impl fmt::Display for Population {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.spec().map_or("direct", |spec| spec.model.name()))
    }
}

/// The mode of every layer of a graph: a default, and exceptions by path. If several patterns match a path, the last
/// one added decides.
///
/// A pattern that matches no layer is a fault when the graph is built, so a misspelt ablation cannot go unnoticed.
///
/// ```
/// use symbolt::neurons::{Population, PopulationPlan};
///
/// // Spiking neurons everywhere, except exact arithmetic in every module called `bind`.
/// let plan = PopulationPlan::lif()
///     .with("**/bind/**".parse()?, Population::Direct);
/// assert_eq!(plan.population("planner/bind/products"), Population::Direct);
/// assert_ne!(plan.population("planner/goal"), Population::Direct);
/// # Ok::<(), symbolt::neurons::PatternError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PopulationPlan {
    pub(crate) default: Population,
    pub(crate) overrides: Vec<(PathPattern, Population)>,
    pub(crate) solved: Option<Arc<SolvedModel>>,
    pub(crate) ranks: Option<Ranks>,
}

impl PopulationPlan {
    /// Makes a plan of direct mode everywhere.
    pub fn direct() -> Self {
        Self::all(Population::Direct)
    }

    /// Makes a plan of spiking LIF neurons with the default settings everywhere.
    pub fn lif() -> Self {
        Self::all(Population::Lif(LifSpec::default()))
    }

    /// Makes a plan of the rates of LIF neurons with the default settings everywhere.
    pub fn rate() -> Self {
        Self::all(Population::Rate(LifSpec::default()))
    }

    /// Makes a plan of one mode everywhere.
    pub fn all(default: Population) -> Self {
        Self { default, overrides: Vec::new(), solved: None, ranks: None }
    }

    /// Adds an exception: the layers whose path matches `pattern` get `population`.
    pub fn with(mut self, pattern: PathPattern, population: Population) -> Self {
        self.overrides.push((pattern, population));
        self
    }

    /// Takes the populations of all neural layers from `solved` instead of solving for them.
    ///
    /// Building the graph then fails if `solved` lacks a layer, or if the layer was solved from another seed, tick,
    /// tuning, size or function.
    pub fn solved(mut self, solved: impl Into<Arc<SolvedModel>>) -> Self {
        self.solved = Some(solved.into());
        self
    }

    /// Shares the neurons among several processes. Each solves and advances its own part of the ensembles; see [`Ranks`].
    /// All processes must build the graph at the same time.
    ///
    /// ```
    /// use symbolt::neurons::{LifSpec, Population, PopulationPlan};
    /// use symbolt::prelude::*;
    /// use symbolt::sim::{LayerRequest, Ranks, Vector};
    /// # use symbolt::neurons::{Layers, Map};
    /// # use symbolt::sim::Ports;
    /// # use symbolt::sim::{Module, Scope};
    /// # struct Squares;
    /// # impl Module for Squares {
    /// #     type Ports = Ports<Vector>;
    /// #     fn expand(self, scope: &mut Scope<'_>) -> Ports<Vector> {
    /// #         scope.map("neurons", Map::each(40, |x| x * x))
    /// #     }
    /// # }
    /// // Two threads stand for two processes.
    /// let run = |ranks: Ranks| {
    ///     let plan = PopulationPlan::all(Population::Lif(LifSpec::default())).shared(&ranks);
    ///     let mut graph = GraphBuilder::new();
    ///     let input = graph.add("input", Constant::vector(&[0.5; 40]));
    ///     let squares = graph.add("squares", Squares);
    ///     graph.connect(&input, &squares.input, Synapse::None);
    ///     let graph = graph.build(Timebase::default(), &plan, Seed::new(1))?;
    ///     let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
    ///     sim.run_for(SimDuration::from_millis(100))?;
    ///     Ok::<_, symbolt::sim::SimError>(sim.value(&squares.output).to_vec())
    /// };
    /// let values: Vec<_> = std::thread::scope(|scope| {
    ///     let group = Ranks::in_process(2).into_iter();
    ///     let threads: Vec<_> = group.map(|ranks| scope.spawn(move || run(ranks))).collect();
    ///     threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
    /// });
    /// assert_eq!(values[0], values[1], "both know all values");
    /// ```
    pub fn shared(mut self, ranks: &Ranks) -> Self {
        self.ranks = Some(ranks.clone());
        self
    }

    /// Returns the mode of the layer at `path`.
    pub fn population(&self, path: &str) -> Population {
        self.overrides
            .iter()
            .rev()
            .find(|(pattern, _)| pattern.matches(path))
            .map_or_else(|| self.default.clone(), |(_, population)| population.clone())
    }
}
