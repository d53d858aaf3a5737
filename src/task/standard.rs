//! The standard networks that speed and quality are measured on, as `symbolt bench` runs them.
//!
//! Layouts, inputs and the reading of quality are fixed, so that figures can be laid beside another
//! simulator's: a tick of 1 ms, feed-forward synapses of 5 ms, recurrent ones of 100 ms, probes of 10 ms.

use std::str::FromStr;
use std::sync::Arc;
use std::time::Instant;

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;
use thiserror::Error;

use super::encode::{Encoded, PRECONDITION, deep_preconditions};
use super::error::TaskError;
use super::symbolic::SymbolicDomain;
use crate::neurons::{LayerPorts, Layers, LifSpec, Map, Population, PopulationPlan, SelectRule};
use crate::sim::{
    Constant, Graph, GraphBuilder, Module, Out, ProbeId, ProbeSpec, Real, RunConfig, Scope, Seed,
    SimDuration, Simulator, Stimulus, Synapse, Timebase, Vector, VocabTag,
};
use crate::spa::{
    AssociativeMemory, BasalGanglia, Bind, CleanupMemory, FEED_FORWARD, Gate, RECURRENT, State,
    Unbind, VocabularyBuilder, cosine, normalize,
};

/// A standard network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// Circular convolution of two pointers.
    Bind,
    /// A pointer taken up for 100 ms and held.
    State,
    /// A cleanup of 1,000 items.
    Memory,
    /// Basal ganglia and thalamus with 10 actions.
    Select,
    /// Two arrays of 500 scalar ensembles in series.
    Channel,
    /// From a goal to the preconditions of the action that causes it, with neural unbinding.
    Planner,
}

impl Model {
    /// All of them, by the names that [`FromStr`] takes.
    pub const ALL: [(&'static str, Self); 6] = [
        ("bind", Self::Bind),
        ("state", Self::State),
        ("memory", Self::Memory),
        ("select", Self::Select),
        ("channel", Self::Channel),
        ("planner", Self::Planner),
    ];
}

/// A standard network that does not exist.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("there is no model `{asked}`; the models are: {}", Model::ALL.map(|m| m.0).join(", "))]
pub struct UnknownModel {
    /// What was asked for.
    pub asked: String,
}

impl FromStr for Model {
    type Err = UnknownModel;

    fn from_str(name: &str) -> Result<Self, UnknownModel> {
        let found = Self::ALL.iter().find(|(known, _)| *known == name);
        found.map(|(_, model)| *model).ok_or_else(|| UnknownModel { asked: name.into() })
    }
}

/// How a standard network is run.
#[derive(Debug, Clone, PartialEq)]
pub struct Standard {
    /// Dimensions of pointers (256 in the table of figures).
    pub dimensions: usize,
    /// How layers are computed.
    pub population: Population,
    /// Simulated milliseconds (at least 300, at which quality is read).
    pub sim_ms: u64,
    /// Who the neurons and pointers are.
    pub seed: Seed,
}

impl Default for Standard {
    fn default() -> Self {
        Self {
            dimensions: 256,
            population: Population::Lif(LifSpec::default()),
            sim_ms: 1_000,
            seed: Seed::new(1),
        }
    }
}

/// What a run of a standard network gave.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// Neurons, where there are any.
    pub neurons: usize,
    /// Wall-clock seconds of describing, drawing and solving.
    pub build_s: f64,
    /// Wall-clock seconds of the run.
    pub run_s: f64,
    /// Simulated seconds.
    pub sim_s: f64,
    /// Nanoseconds of the run a neuron and tick.
    pub ns_per_neuron_step: f64,
    /// What the quality figures are.
    pub quality: Vec<(&'static str, f64)>,
}

/// The family of the pointers used here.
pub struct Plain;

impl VocabTag for Plain {
    const NAME: &'static str = "plain";
}

/// A plain vector passed through one population a component.
struct Array {
    width: usize,
}

impl Module for Array {
    type Ports = LayerPorts<Vector>;

    fn expand(self, scope: &mut Scope<'_>) -> LayerPorts<Vector> {
        scope.map("population", Map::each(self.width, |x| x))
    }
}

const PROBE: Synapse = Synapse::lowpass_ms(10);
/// When quality is read, in simulated seconds.
const READ_S: f64 = 0.3;
const CHANNELS: usize = 500;
const ITEMS: usize = 1_000;
const ACTIONS: usize = 10;
const CHOSEN: usize = 3;

enum Reading {
    /// Cosine with a pointer.
    Cosine(Vec<Real>),
    /// Root mean square distance.
    Distance(Vec<Real>),
    /// The chosen action's activity, and when it was there.
    Choice(usize),
    /// When both of two items were there to stay.
    Both([usize; 2]),
}

/// A built network, not yet run.
pub struct Built {
    graph: Arc<Graph>,
    probe: Watched,
    reading: Reading,
    neurons: usize,
    build_s: f64,
    spec: Standard,
}

enum Watched {
    Pointer(ProbeId<crate::sim::Pointer<Plain>>),
    Vector(ProbeId<Vector>),
}

fn pointer(seed: Seed, name: &str, dim: usize) -> Vec<Real> {
    let mut rng = seed.derive(name, "input").rng();
    let mut out: Vec<Real> =
        (0..dim).map(|_| -> f64 { StandardNormal.sample(&mut rng) }).map(|v| v as Real).collect();
    normalize(&mut out);
    out
}

/// Items of the planner's memories: 3 + 3 + 3 causes, deep pointers and effects, 5 + 5 states.
const PLANNER_ITEMS: usize = 19;

/// A planner's loop over the paper's domain: a goal buffer, the action that causes what it holds, the
/// action's deep pointer, its preconditions by neural unbinding, those that are not satisfied, and a gate
/// through which one of them would become the next goal. Gives the activity of each precondition, and
/// which two are right.
fn planner(
    graph: &mut GraphBuilder,
    dim: usize,
    seed: Seed,
) -> Result<(Out<Vector>, [usize; 2]), TaskError> {
    let domain = SymbolicDomain::of_the_paper().build()?;
    let encoded = Encoded::new(&domain, dim, 0.1, seed)?;
    let (states, actions) = (&encoded.states, &encoded.actions);
    let names: Vec<&str> = domain.states().iter().map(|s| s.name.as_str()).collect();
    let winner = SelectRule::WinnerTakeAll { level: 0.3 };
    let every = SelectRule::Threshold { level: 0.3 };
    let operators = domain.operators();
    let deep: Vec<(&str, String)> = operators
        .iter()
        .map(|o| (&o.name[..], deep_preconditions(o.preconditions.iter().map(String::as_str))))
        .collect();
    let effects: Vec<(&str, &str)> =
        operators.iter().map(|o| (&o.name[..], o.to.as_str())).collect();
    let causes = effects.iter().map(|(action, effect)| (*effect, *action));
    let cause = AssociativeMemory::new(states, actions, causes, winner)?;
    let pairs = deep.iter().map(|(action, deep)| (*action, deep.as_str()));
    let deep = AssociativeMemory::new(actions, states, pairs, every)?;
    let effect = AssociativeMemory::new(actions, states, effects.iter().copied(), every)?;

    let wanted: Vec<Real> = states.get("BOLT_ASSEMBLED")?.iter().map(|v| 2.0 * v).collect();
    let given = Stimulus::pointer(states.space(), &wanted)
        .from(SimDuration::from_millis(50), &vec![0.0; dim]);
    let given = graph.add("given", given);
    let goal = graph.add("goal", State::new(states).recurrent(RECURRENT));
    let cause = graph.add("cause", cause);
    let action = graph.add("action", State::new(actions));
    let deep = graph.add("deep", deep);
    let effect = graph.add("effect", effect);
    let role = Constant::pointer(states.space(), &states.get(PRECONDITION)?);
    let role = graph.add("role", role);
    let unbind = graph.add("unbind", Unbind::new(states));
    let preconditions = graph.add("preconditions", State::new(states));
    let cleanup = graph.add("cleanup", CleanupMemory::new(states, names.iter().copied(), every)?);
    let unsatisfied =
        graph.add("unsatisfied", CleanupMemory::new(states, names.iter().copied(), every)?);
    let change = graph.add("goal_change", Gate::new(states));
    let closed = graph.add("closed", Constant::scalar(0.0));
    let none = Synapse::None;
    graph.connect(&given, &goal.input, none);
    graph.connect(&goal.output, &cause.input, none);
    graph.connect(&cause.output, &action.input, none);
    graph.connect(&action.output, &deep.input, none);
    graph.connect(&action.output, &effect.input, none);
    graph.connect(&deep.output, &unbind.bound, none);
    graph.connect(&role, &unbind.role, none);
    graph.connect(&unbind.output, &preconditions.input, none);
    graph.connect(&preconditions.output, &cleanup.input, none);
    graph.connect(&cleanup.output, &unsatisfied.input, none);
    graph.connect(&unsatisfied.output, &change.input, none);
    graph.connect(&closed, &change.open, none);
    graph.connect(&change.output, &goal.input, none);
    let right = |name: &str| names.iter().position(|n| *n == name).unwrap_or_default();
    Ok((cleanup.items, [right("NUT_IN_JIG"), right("BOLT_IN_JIG")]))
}

impl Standard {
    /// Describes and builds `model`, and takes the time.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for fewer than 300 ms; [`TaskError::Vocabulary`] or [`TaskError::Build`] for
    /// dimensions or populations that cannot be.
    pub fn build(&self, model: Model) -> Result<Built, TaskError> {
        if self.sim_ms < 300 {
            let value = self.sim_ms.to_string();
            return Err(TaskError::Setting { name: "sim_ms", value, expected: "at least 300" });
        }
        let begun = Instant::now();
        let (dim, seed) = (self.dimensions, self.seed);
        let mut graph = GraphBuilder::new();
        let spec = ProbeSpec::default().filtered(PROBE);
        let lif = match self.population {
            Population::Lif(spec) | Population::Rate(spec) => Some(spec),
            Population::Direct => None,
        };
        let sized = |of: usize| lif.map_or(0, |l| (of as f64 * l.scale).round() as usize);
        let per = |of: fn(&LifSpec) -> usize| lif.as_ref().map_or(0, of);
        let (neurons, probe, reading): (usize, Watched, Reading) = match model {
            Model::Bind => {
                let vocabulary = VocabularyBuilder::<Plain>::new(dim, seed).build()?;
                let (a, b) = (pointer(seed, "a", dim), pointer(seed, "b", dim));
                let bind = graph.add("bind", Bind::new(&vocabulary).synapse(FEED_FORWARD));
                for (name, value, port) in [("a", &a, &bind.a), ("b", &b, &bind.b)] {
                    let given = graph.add(name, Constant::pointer(vocabulary.space(), value));
                    graph.connect(&given, port, Synapse::None);
                }
                let mut exact = vec![0.0; dim];
                let algebra = vocabulary.algebra();
                algebra.bind_into(&a, &b, &mut exact, &mut algebra.scratch(dim));
                let products = 4 * (dim / 2 + 1);
                let probe = Watched::Pointer(graph.probe(&bind.output, spec));
                let ensembles = 2 * products;
                (ensembles * sized(per(|l| l.per_product) / 2), probe, Reading::Cosine(exact))
            }
            Model::State => {
                let vocabulary = VocabularyBuilder::<Plain>::new(dim, seed).build()?;
                let given = pointer(seed, "a", dim);
                let input = graph.add(
                    "input",
                    Stimulus::pointer(vocabulary.space(), &given)
                        .from(SimDuration::from_millis(100), &vec![0.0; dim]),
                );
                let state = graph.add("state", State::new(&vocabulary).recurrent(RECURRENT));
                graph.connect(&input, &state.input, Synapse::None);
                let probe = Watched::Pointer(graph.probe(&state.output, spec));
                (sized(dim * per(|l| l.per_dimension)), probe, Reading::Cosine(given))
            }
            Model::Memory => {
                let names: Vec<String> = (0..ITEMS).map(|i| format!("V{i}")).collect();
                let vocabulary = VocabularyBuilder::<Plain>::new(dim, seed)
                    .max_similarity(1.0)
                    .pointers(names.iter().map(String::as_str))
                    .build()?;
                let mixed = vocabulary.parse("0.8 * V0 + 0.3 * V1")?;
                let rule = SelectRule::WinnerTakeAll { level: 0.5 };
                let names = names.iter().map(String::as_str);
                let memory = graph.add("memory", CleanupMemory::new(&vocabulary, names, rule)?);
                let input = graph.add("input", Constant::pointer(vocabulary.space(), &mixed));
                graph.connect(&input, &memory.input, Synapse::None);
                let probe = Watched::Pointer(graph.probe(&memory.output, spec));
                (
                    ITEMS * sized(per(|l| l.per_item)),
                    probe,
                    Reading::Cosine(vocabulary.get("V0")?.to_vec()),
                )
            }
            Model::Select => {
                let mut utilities = vec![0.3; ACTIONS];
                utilities[CHOSEN] = 0.8;
                let input = graph.add("input", Constant::vector(&utilities));
                let select = graph.add("select", BasalGanglia::new(ACTIONS));
                graph.connect(&input, &select.utilities, Synapse::None);
                let probe = Watched::Vector(graph.probe(&select.chosen, spec));
                let nucleus = sized(per(|l| l.per_function));
                (ACTIONS * (5 * nucleus + nucleus / 2), probe, Reading::Choice(CHOSEN))
            }
            Model::Planner => {
                let (items, watched) = planner(&mut graph, dim, seed)?;
                let spec = ProbeSpec::default().filtered(PROBE);
                let probe = Watched::Vector(graph.probe(&items, spec));
                let states = 4 * sized(dim * per(|l| l.per_dimension));
                let products = 8 * (dim / 2 + 1) * sized(per(|l| l.per_product) / 2);
                let stored = PLANNER_ITEMS * sized(per(|l| l.per_item));
                (states + products + stored, probe, Reading::Both(watched))
            }
            Model::Channel => {
                let mut rng = seed.derive("channel", "input").rng();
                let given: Vec<Real> =
                    (0..CHANNELS).map(|_| 2.0 * rng.random::<Real>() - 1.0).collect();
                let input = graph.add("input", Constant::vector(&given));
                let first = graph.add("first", Array { width: CHANNELS });
                let second = graph.add("second", Array { width: CHANNELS });
                graph.connect(&input, &first.input, Synapse::None);
                graph.connect(&first.output, &second.input, FEED_FORWARD);
                let probe = Watched::Vector(graph.probe(&second.output, spec));
                (2 * CHANNELS * sized(per(|l| l.per_function)), probe, Reading::Distance(given))
            }
        };
        let plan = PopulationPlan::all(self.population);
        let graph = Arc::new(graph.build(Timebase::default(), &plan, seed)?);
        let build_s = begun.elapsed().as_secs_f64();
        Ok(Built { graph, probe, reading, neurons, build_s, spec: self.clone() })
    }
}

impl Built {
    /// Runs the network and reads its quality.
    ///
    /// # Errors
    /// [`TaskError::Sim`] if a value is not finite.
    pub fn run(&self) -> Result<Measured, TaskError> {
        let mut sim = Simulator::new(self.graph.clone(), RunConfig::seeded(self.spec.seed))?;
        let begun = Instant::now();
        sim.run_for(SimDuration::from_millis(self.spec.sim_ms))?;
        let run_s = begun.elapsed().as_secs_f64();
        let rows: Vec<(f64, Vec<Real>)> = match &self.probe {
            Watched::Pointer(probe) => {
                sim.samples(probe).iter().map(|(t, v)| (t, v.to_vec())).collect()
            }
            Watched::Vector(probe) => {
                sim.samples(probe).iter().map(|(t, v)| (t, v.to_vec())).collect()
            }
        };
        let sim_s = self.spec.sim_ms as f64 / 1e3;
        let steps = self.neurons as f64 * self.spec.sim_ms as f64;
        Ok(Measured {
            neurons: self.neurons,
            build_s: self.build_s,
            run_s,
            sim_s,
            ns_per_neuron_step: if steps > 0.0 { run_s * 1e9 / steps } else { 0.0 },
            quality: self.quality(&rows),
        })
    }

    fn quality(&self, rows: &[(f64, Vec<Real>)]) -> Vec<(&'static str, f64)> {
        let at = rows.iter().rfind(|(t, _)| *t <= READ_S + 1e-9).map(|(_, v)| v.as_slice());
        let at = at.unwrap_or(&[]);
        let last: Vec<&Vec<Real>> = rows
            .iter()
            .filter(|(t, _)| *t > READ_S - 0.05 + 1e-9 && *t <= READ_S + 1e-9)
            .map(|(_, v)| v)
            .collect();
        let mean: Vec<Real> = (0..at.len())
            .map(|i| last.iter().map(|v| v[i]).sum::<Real>() / last.len().max(1) as Real)
            .collect();
        match &self.reading {
            Reading::Cosine(exact) => vec![
                ("cosine", f64::from(cosine(at, exact))),
                ("cosine_of_50_ms_mean", f64::from(cosine(&mean, exact))),
            ],
            Reading::Distance(exact) => {
                let square: f64 = at.iter().zip(exact).map(|(a, b)| f64::from(a - b).powi(2)).sum();
                vec![("rmse", (square / exact.len() as f64).sqrt())]
            }
            Reading::Both(which) => {
                let there = |v: &Vec<Real>| which.iter().all(|i| v[*i] >= 0.8 * mean[*i]);
                let first = rows.iter().find(|(_, v)| there(v));
                let least = which.map(|i| f64::from(mean[i])).into_iter().fold(f64::MAX, f64::min);
                let others = mean.iter().enumerate().filter(|(i, _)| !which.contains(i));
                let rival = others.map(|(_, v)| f64::from(*v)).fold(0.0, f64::max);
                vec![
                    ("preconditions_ms", first.map_or(f64::NAN, |(t, _)| 1e3 * t)),
                    ("weaker_precondition", least),
                    ("greatest_other", rival),
                ]
            }
            Reading::Choice(which) => {
                let own = f64::from(mean[*which]);
                let others = mean.iter().enumerate().filter(|(i, _)| i != which);
                let rival = others.map(|(_, v)| f64::from(*v)).fold(f64::NEG_INFINITY, f64::max);
                let first = rows.iter().find(|(_, v)| f64::from(v[*which]) >= 0.8 * own);
                vec![
                    ("chosen", own),
                    ("greatest_other", rival),
                    ("settled_ms", first.map_or(f64::NAN, |(t, _)| 1e3 * t)),
                ]
            }
        }
    }
}
