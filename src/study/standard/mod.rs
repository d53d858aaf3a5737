//! The standard networks that speed and quality are measured on, as `symbolt bench` runs them.
//!
//! Layouts, inputs and the reading of quality are fixed, so that figures can be laid beside another
//! simulator's: a tick of 1 ms, feed-forward synapses of 5 ms, recurrent ones of 100 ms, probes of 10 ms.

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
    /// A goal-stack planner's parts: 13 pointer memories behind 13 gated channels, associative
    /// memories, and an action selection with 11 rules.
    Large,
}

impl Model {
    /// All of them, by the names that [`FromStr`] takes.
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
    /// How the planner unbinds its preconditions.
    pub unbinding: Unbinding,
    /// How the memory of 1,000 items chooses.
    pub choice: SelectRule,
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
            unbinding: Unbinding::Products,
            choice: SelectRule::WinnerTakeAll { level: 0.5 },
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

/// The synapse behind which everything is probed.
const PROBE: Synapse = Synapse::lowpass_ms(10);
/// When quality is read, in simulated ms and seconds.
const READ_MS: u64 = 300;
const READ_S: f64 = 0.3;

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
    /// Describes and builds `model`, and takes the time.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for fewer than 300 ms; [`TaskError::Vocabulary`] or [`TaskError::Build`] for
    /// dimensions or populations that cannot be.
    pub fn build(&self, model: Model) -> Result<Built, TaskError> {
        self.build_by(model, &PopulationPlan::all(self.population))
    }

    /// Describes `model` and builds it from populations that were solved before.
    ///
    /// # Errors
    /// As [`build`](Self::build), and if `solved` is not of this network with these settings.
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
    /// The populations of the network, to be kept.
    pub fn solved(&self) -> SolvedModel {
        SolvedModel::of(&self.graph)
    }

    /// Wall-clock seconds that the build took.
    pub fn build_s(&self) -> f64 {
        self.build_s
    }

    /// Runs the network, on the threads of the pool, and reads its quality.
    ///
    /// # Errors
    /// [`TaskError::Sim`] if a value is not finite.
    pub fn run(&self) -> Result<Measured, TaskError> {
        let run = RunConfig::seeded(self.spec.seed).with_threads(Threads::Pool);
        let mut sim = Simulator::new(self.graph.clone(), run)?;
        // What is read of the probes comes from the first 300 ms; the rest is for the clock.
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
                let least = which.map(|i| f64::from(mean[i])).into_iter().fold(f64::MAX, f64::min);
                let others = mean.iter().enumerate().filter(|(i, _)| !which.contains(i));
                let rival = others.map(|(_, v)| f64::from(*v)).fold(0.0, f64::max);
                vec![
                    ("preconditions_ms", first.map_or(f64::NAN, |(t, _)| (1e3 * t).round())),
                    ("weaker_precondition", least),
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
