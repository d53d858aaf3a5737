//! The standard networks of `symbolt bench`, on which speed and quality are measured.
//!
//! Networks, inputs and measures of quality are fixed, so that results can be compared with those of other simulators.
//! The tick is 1 ms. Time constants of synapses are 5 ms in feed-forward connections, 100 ms in recurrent connections,
//! and 10 ms at probes.

mod brain;
mod limits;
mod networks;
mod planners;

use std::str::FromStr;
use std::sync::Arc;
use std::time::Instant;

use thiserror::Error;

use crate::neurons::{
    LifSpec, Population, PopulationPlan, SelectRule, SolvedModel, Traffic, neurons,
};
use crate::sim::{
    Fingerprint, Graph, GraphBuilder, Kind, Pointer, ProbeId, ProbeSpec, Ranks, Real, RunConfig,
    Seed, SimDuration, Simulator, Synapse, Threads, Timebase, Vector, VocabTag, few, meant,
};
use crate::spa::cosine_of_slices;
use crate::task::TaskError;
use crate::task::planner::Unbinding;

pub use limits::{Bound, Limits, machine};

/// A standard network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// Circular convolution of two constant pointers.
    Bind,
    /// A memory that holds a pointer shown for 100 ms.
    State,
    /// A cleanup memory of 1,000 items.
    Memory,
    /// Basal ganglia and thalamus with 10 actions.
    Select,
    /// Two arrays of 500 scalar ensembles in series.
    Channel,
    /// Memories that recall the action that causes a goal, and then its preconditions. Unbinding is neural.
    Planner,
    /// The parts of a goal-stack planner: 13 pointer memories behind 13 gates, associative memories, and an action
    /// selection with 11 rules.
    Large,
    /// A memory for a list of nine items among a thousand, with 2.5 million neurons.
    Brain,
}

impl Model {
    /// All models with their names, as [`FromStr`] parses them.
    pub const ALL: [(&'static str, Self); 8] = [
        ("bind", Self::Bind),
        ("state", Self::State),
        ("memory", Self::Memory),
        ("select", Self::Select),
        ("channel", Self::Channel),
        ("planner", Self::Planner),
        ("large", Self::Large),
        ("brain", Self::Brain),
    ];
}

/// No standard network has this name.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("there is no network `{asked}`{}; the networks are: {}", meant(asked, Model::ALL.map(|m| m.0)), few(Model::ALL.map(|m| m.0)))]
pub struct UnknownModel {
    /// The name given.
    pub asked: String,
}

impl FromStr for Model {
    type Err = UnknownModel;

    fn from_str(name: &str) -> Result<Self, UnknownModel> {
        let found = Self::ALL.iter().find(|(known, _)| *known == name);
        found.map(|(_, model)| *model).ok_or_else(|| UnknownModel { asked: name.into() })
    }
}

/// Settings of a standard network and its run.
#[derive(Debug, Clone, PartialEq)]
pub struct Standard {
    /// Number of dimensions of the pointers. Published results are for 256.
    pub dimensions: usize,
    /// Population of every layer: direct, rate or LIF.
    pub population: Population,
    /// Method by which the planner network unbinds preconditions.
    pub unbinding: Unbinding,
    /// Rule by which the cleanup memory selects items.
    pub choice: SelectRule,
    /// Simulated time in milliseconds, at least 300. Quality is measured at 300 ms.
    pub sim_ms: u64,
    /// Seed of neurons, pointers and inputs.
    pub seed: Seed,
    /// Rank among the processes that share the network, if there are several. They must build and run it at the same time.
    pub ranks: Option<Ranks>,
}

impl Default for Standard {
    fn default() -> Self {
        Self {
            dimensions: 256,
            population: Population::Lif(LifSpec::default()),
            unbinding: Unbinding::Products,
            choice: SelectRule::WinnerTakeAll { level: 0.5 },
            sim_ms: 1_000,
            seed: Seed::new(1),
            ranks: None,
        }
    }
}

/// Measurements of a run of a standard network.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Number of neurons; 0 in direct mode.
    pub neurons: usize,
    /// Number of decoded values in a tick, which ranks would exchange; 0 in direct mode.
    pub exchanged_values: usize,
    /// Wall-clock time of the build in seconds, including drawing neurons and solving decoders.
    pub build_s: f64,
    /// Wall-clock time of the run, in seconds.
    pub run_s: f64,
    /// Simulated time, in seconds.
    pub sim_s: f64,
    /// Wall-clock time of a neuron's tick, in nanoseconds; 0 without neurons.
    pub ns_per_neuron_step: f64,
    /// Number of threads that computed a tick.
    pub threads: usize,
    /// What the neurons of this process read, write and compute in a tick: the mean of one tick in fifty.
    pub traffic: Traffic,
    /// Measures of quality, with their names.
    pub quality: Vec<(&'static str, f64)>,
    /// Hash of the bits of all outputs of the first 300 ms.
    pub bits: u64,
}

/// Vocabulary tag of the pointers in [`Model::Bind`], [`Model::State`] and [`Model::Memory`].
struct Plain;

impl VocabTag for Plain {
    const NAME: &'static str = "plain";
}

/// Synapse of probes.
const PROBE: Synapse = Synapse::lowpass_ms(10);
/// Simulated time at which quality is measured, in ms and in seconds.
const READ_MS: u64 = 300;
const READ_S: f64 = 0.3;
/// Simulated time between two looks at the neurons, in ms.
const LOOK_MS: usize = 50;

enum Reading {
    /// Cosine similarity of the output to a pointer.
    Cosine(Vec<Real>),
    /// Root mean square error of the output.
    Distance(Vec<Real>),
    /// Activity of the chosen action, and the time at which it settles.
    Choice(usize),
    /// Time at which two items have both settled.
    Both([usize; 2]),
}

enum Watched {
    Pointer(ProbeId<Pointer<Plain>>),
    Vector(ProbeId<Vector>),
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

impl Standard {
    /// Builds `model` and measures the build time.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for fewer than 300 ms; [`TaskError::Vocabulary`] or [`TaskError::Build`] if the number of
    /// dimensions or the population is invalid.
    pub fn build(&self, model: Model) -> Result<Built, TaskError> {
        self.build_by(model, &PopulationPlan::all(self.population.clone()))
    }

    /// Builds `model` with solved populations.
    ///
    /// # Errors
    /// As [`build`](Self::build); [`TaskError::Build`] also if `solved` belongs to another network or other settings.
    pub fn build_from(
        &self,
        model: Model,
        solved: impl Into<Arc<SolvedModel>>,
    ) -> Result<Built, TaskError> {
        self.build_by(model, &PopulationPlan::all(self.population.clone()).solved(solved))
    }

    fn build_by(&self, model: Model, plan: &PopulationPlan) -> Result<Built, TaskError> {
        if self.sim_ms < 300 {
            let value = self.sim_ms.to_string();
            return Err(TaskError::Setting { name: "sim_ms", value, expected: "at least 300" });
        }
        let begun = Instant::now();
        let mut graph = GraphBuilder::new();
        let probed = ProbeSpec::default().filtered(PROBE);
        let (probe, reading) = match model {
            Model::Bind => networks::bind(self, &mut graph, probed)?,
            Model::State => networks::state(self, &mut graph, probed)?,
            Model::Memory => networks::memory(self, &mut graph, probed)?,
            Model::Select => networks::select(&mut graph, probed),
            Model::Channel => networks::channel(self, &mut graph, probed),
            Model::Planner => planners::loop_of_memories(self, &mut graph, probed)?,
            Model::Large => planners::goal_stack(self, &mut graph, probed)?,
            Model::Brain => brain::list_memory(self, &mut graph, probed)?,
        };
        let plan = self.ranks.iter().fold(plan.clone(), |plan, ranks| plan.shared(ranks));
        let graph = Arc::new(graph.build(Timebase::default(), &plan, self.seed)?);
        let build_s = begun.elapsed().as_secs_f64();
        let neurons = neurons(&graph);
        Ok(Built { graph, probe, reading, neurons, build_s, spec: self.clone() })
    }
}

fn rows<K: Kind>(sim: &Simulator, probe: &ProbeId<K>) -> Vec<(f64, Vec<Real>)> {
    sim.samples(probe).iter().map(|(t, v)| (t, v.to_vec())).collect()
}

impl Built {
    /// Returns the solved populations of the network.
    pub fn solved(&self) -> SolvedModel {
        SolvedModel::of(&self.graph)
    }

    /// Returns the network.
    pub fn graph(&self) -> &Arc<Graph> {
        &self.graph
    }

    /// Returns the wall-clock time of the build in seconds, as in [`Measured`].
    pub fn build_s(&self) -> f64 {
        self.build_s
    }

    /// Runs the network on [`Threads::Auto`] and measures its speed and quality.
    ///
    /// # Errors
    /// [`TaskError::Sim`] if a value becomes infinite or NaN.
    pub fn run(&self) -> Result<Measured, TaskError> {
        self.run_on(Threads::Auto)
    }

    /// Runs the network on these threads, as [`run`](Self::run) does.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn run_on(&self, threads: Threads) -> Result<Measured, TaskError> {
        let run = RunConfig::seeded(self.spec.seed).with_threads(threads);
        let mut sim = Simulator::new(self.graph.clone(), run)?;
        // Quality is measured in the first 300 ms. The rest of the run only measures time, so its samples are dropped.
        let (mut run_s, mut traffic, mut looks) = (0.0, Traffic::default(), 0);
        let mut recorded = Vec::new();
        for from in (0..self.spec.sim_ms).step_by(LOOK_MS) {
            let until = (from + LOOK_MS as u64).min(self.spec.sim_ms);
            let begun = Instant::now();
            sim.run_for(SimDuration::from_millis(until - from))?;
            run_s += begun.elapsed().as_secs_f64();
            (traffic, looks) = (traffic.plus(Traffic::of(&sim)), looks + 1);
            if until == READ_MS {
                recorded = match &self.probe {
                    Watched::Pointer(probe) => rows(&sim, probe),
                    Watched::Vector(probe) => rows(&sim, probe),
                };
            }
            if until >= READ_MS {
                sim.clear_recordings();
            }
        }
        let mut bits = Fingerprint::default();
        recorded.iter().for_each(|(_, row)| {
            bits.reals(row);
        });
        let sim_s = self.spec.sim_ms as f64 / 1e3;
        let steps = self.neurons as f64 * self.spec.sim_ms as f64;
        Ok(Measured {
            neurons: self.neurons,
            exchanged_values: self.graph.exchanged_values(),
            build_s: self.build_s,
            run_s,
            sim_s,
            ns_per_neuron_step: if steps > 0.0 { run_s * 1e9 / steps } else { 0.0 },
            threads: sim.threads(),
            traffic: traffic.over(f64::from(looks)),
            quality: self.quality(&recorded),
            bits: bits.value(),
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
                ("cosine", f64::from(cosine_of_slices(at, exact))),
                ("cosine_of_50_ms_mean", f64::from(cosine_of_slices(&mean, exact))),
            ],
            Reading::Distance(exact) => {
                let square: f64 = at.iter().zip(exact).map(|(a, b)| f64::from(a - b).powi(2)).sum();
                vec![("rmse", (square / exact.len() as f64).sqrt())]
            }
            Reading::Both(which) => {
                let there =
                    |v: &Vec<Real>| which.iter().all(|i| mean[*i] > 0.1 && v[*i] >= 0.8 * mean[*i]);
                let first = rows.iter().find(|(_, v)| there(v));
                let weaker = which.map(|i| f64::from(mean[i])).into_iter().fold(f64::MAX, f64::min);
                let others = mean.iter().enumerate().filter(|(i, _)| !which.contains(i));
                let rival = others.map(|(_, v)| f64::from(*v)).fold(0.0, f64::max);
                vec![
                    ("preconditions_ms", first.map_or(f64::NAN, |(t, _)| (1e3 * t).round())),
                    ("weaker_precondition", weaker),
                    ("greatest_other", rival),
                ]
            }
            Reading::Choice(which) => {
                let own = f64::from(mean[*which]);
                let others = mean.iter().enumerate().filter(|(i, _)| i != which);
                let rival = others.map(|(_, v)| f64::from(*v)).fold(f64::NEG_INFINITY, f64::max);
                let there = |v: &Vec<Real>| own > 0.1 && f64::from(v[*which]) >= 0.8 * own;
                let first = rows.iter().find(|(_, v)| there(v));
                vec![
                    ("chosen", own),
                    ("greatest_other", rival),
                    ("settled_ms", first.map_or(f64::NAN, |(t, _)| (1e3 * t).round())),
                ]
            }
        }
    }
}
