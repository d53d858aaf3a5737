//! The standard networks of `symbolt bench`, on which speed and quality are measured.
//!
//! Networks, inputs and measures of quality are fixed, so that figures can be compared with those of other
//! simulators. The tick is 1 ms; synapses have 5 ms feed-forward, 100 ms recurrent, and 10 ms at probes.

mod networks;
mod planners;

use std::str::FromStr;
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;
use thiserror::Error;

use crate::neurons::{LifSpec, Population, PopulationPlan, SelectRule, SolvedModel};
use crate::sim::{
    Graph, GraphBuilder, Pointer, ProbeId, ProbeSpec, Real, RunConfig, Seed, SimDuration,
    Simulator, Synapse, Threads, Timebase, Vector, VocabTag,
};
use crate::spa::cosine_of_slices;
use crate::task::TaskError;
use crate::task::planner::Unbinding;

/// A standard network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// Circular convolution of two pointers.
    Bind,
    /// A pointer given for 100 ms and held by a memory.
    State,
    /// A cleanup memory of 1,000 items.
    Memory,
    /// Basal ganglia and thalamus with 10 actions.
    Select,
    /// Two arrays of 500 scalar ensembles in series.
    Channel,
    /// From a goal to the preconditions of the action that causes it, with neural unbinding.
    Planner,
    /// The parts of a goal-stack planner: 13 pointer memories behind 13 gates, associative memories, and an action
    /// selection with 11 rules.
    Large,
}

impl Model {
    /// All models, with the names that [`FromStr`] takes.
    pub const ALL: [(&'static str, Self); 7] = [
        ("bind", Self::Bind),
        ("state", Self::State),
        ("memory", Self::Memory),
        ("select", Self::Select),
        ("channel", Self::Channel),
        ("planner", Self::Planner),
        ("large", Self::Large),
    ];
}

/// There is no standard network of this name.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("there is no model `{asked}`; the models are: {}", Model::ALL.map(|m| m.0).join(", "))]
pub struct UnknownModel {
    /// The name.
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
    /// Dimensions of pointers; published figures are for 256.
    pub dimensions: usize,
    /// The mode in which layers are computed.
    pub population: Population,
    /// How the planner unbinds its preconditions.
    pub unbinding: Unbinding,
    /// How the cleanup memory selects items.
    pub choice: SelectRule,
    /// Simulated milliseconds, at least 300. Quality is measured at 300.
    pub sim_ms: u64,
    /// The seed of neurons, pointers and inputs.
    pub seed: Seed,
    /// Who computes the ticks of the run. Quality is the same either way, the time is not.
    pub threads: Threads,
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
            threads: Threads::Pool,
        }
    }
}

/// Measurements of a run of a standard network.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// The number of neurons; 0 in direct mode.
    pub neurons: usize,
    /// Wall-clock seconds of the build, with drawing neurons and solving decoders.
    pub build_s: f64,
    /// Wall-clock seconds of the run.
    pub run_s: f64,
    /// Simulated seconds.
    pub sim_s: f64,
    /// Wall-clock nanoseconds for each neuron and tick; 0 without neurons.
    pub ns_per_neuron_step: f64,
    /// Measures of quality, with their names.
    pub quality: Vec<(&'static str, f64)>,
}

/// The vocabulary tag of the pointers here.
pub struct Plain;

impl VocabTag for Plain {
    const NAME: &'static str = "plain";
}

/// The synapse of probes.
const PROBE: Synapse = Synapse::lowpass_ms(10);
/// When quality is measured, in simulated ms and seconds.
const READ_MS: u64 = 300;
const READ_S: f64 = 0.3;

enum Reading {
    /// Cosine similarity to a pointer.
    Cosine(Vec<Real>),
    /// Root mean square error.
    Distance(Vec<Real>),
    /// Activity of the chosen action, and when it settled.
    Choice(usize),
    /// When both of two items had settled.
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
    /// Builds `model` and measures the time of it.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for fewer than 300 ms; [`TaskError::Vocabulary`] or [`TaskError::Build`] for impossible
    /// dimensions or populations.
    pub fn build(&self, model: Model) -> Result<Built, TaskError> {
        self.build_by(model, &PopulationPlan::all(self.population))
    }

    /// Builds `model` with populations that were solved before.
    ///
    /// # Errors
    /// As [`build`](Self::build), and [`TaskError::Build`] if `solved` belongs to another network or other settings.
    pub fn build_from(
        &self,
        model: Model,
        solved: impl Into<Arc<SolvedModel>>,
    ) -> Result<Built, TaskError> {
        self.build_by(model, &PopulationPlan::all(self.population).solved(solved))
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
        };
        let graph = Arc::new(graph.build(Timebase::default(), plan, self.seed)?);
        let build_s = begun.elapsed().as_secs_f64();
        let neurons = SolvedModel::of(&graph).neurons();
        Ok(Built { graph, probe, reading, neurons, build_s, spec: self.clone() })
    }
}

impl Built {
    /// The solved populations of the network.
    pub fn solved(&self) -> SolvedModel {
        SolvedModel::of(&self.graph)
    }

    /// Wall-clock seconds of the build.
    pub fn build_s(&self) -> f64 {
        self.build_s
    }

    /// Runs the network on the threads that its settings name and measures its speed and quality.
    ///
    /// # Errors
    /// [`TaskError::Sim`] if a value is not finite.
    pub fn run(&self) -> Result<Measured, TaskError> {
        let run = RunConfig::seeded(self.spec.seed).with_threads(self.spec.threads);
        let mut sim = Simulator::new(self.graph.clone(), run)?;
        // Quality is measured in the first 300 ms. The rest only measures time, and its recordings are dropped.
        let begun = Instant::now();
        sim.run_for(SimDuration::from_millis(READ_MS))?;
        let mut run_s = begun.elapsed().as_secs_f64();
        let rows: Vec<(f64, Vec<Real>)> = match &self.probe {
            Watched::Pointer(probe) => {
                sim.samples(probe).iter().map(|(t, v)| (t, v.to_vec())).collect()
            }
            Watched::Vector(probe) => {
                sim.samples(probe).iter().map(|(t, v)| (t, v.to_vec())).collect()
            }
        };
        for from in (READ_MS..self.spec.sim_ms).step_by(1_000) {
            sim.clear_recordings();
            let begun = Instant::now();
            sim.run_for(SimDuration::from_millis((self.spec.sim_ms - from).min(1_000)))?;
            run_s += begun.elapsed().as_secs_f64();
        }
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
