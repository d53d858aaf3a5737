//! The spiking planner of Blouw, Eliasmith and Tripp, "A scaleable spiking neural model of action planning" (CogSci 2016),
//! rebuilt from the modules of this crate as one graph.
//!
//! The model exists to be compared with. It plans from the goal backwards: it recalls an action with the wanted effect and
//! a thing that is here, pushes the action onto a stack, and takes the action's preconditions as the next goal. When the
//! sensor says that the pushed action is ready, it acts: it pops one action after the other. A scalar, the gate, ends the
//! acting after a while, and planning starts anew.
//!
//! The stack is a sum of the names of actions, each bound to a power of a unitary pointer: a push shifts the whole stack
//! by one power. Memories amplify what they are given until they saturate, so each push scales the stack back, and an
//! action loses a factor of about the square root of 2 with every push. The stack is therefore not longer than about five.
//!
//! Every rule is chosen by basal ganglia and thalamus. Not made of neurons are the [kitchen](Kitchen) with its motor and
//! sensor, and constant inputs. The 2016 model checks preconditions in the sensor: a table made by hand says what must hold
//! before an action counts as ready.

mod graph;
mod kitchen;
mod symbols;
mod world;

use std::any::Any;
use std::sync::Arc;

pub use kitchen::Kitchen;

use crate::neurons::{LifSpec, Population, PopulationPlan, SolvedModel};
use crate::sim::{
    Graph, ProbeId, ProbeSpec, RunConfig, Seed, SimDuration, Simulator, Threads, Timebase, Vector,
};
use crate::task::TaskError;
use crate::task::regression::Begun;
use symbols::Symbols;
use world::StackWorld;

/// Simulated time between two looks at the kitchen, in milliseconds. A tick takes one.
const PERIOD_MS: u64 = 10;
/// Activity from which a rule counts as chosen.
const CHOSEN: f32 = 0.5;
/// Rules that plan, and rules that act.
const PLANNING: [&str; 4] = ["plan", "get_action", "get_precon", "set_goal"];
const ACTING: [&str; 3] = ["top", "pop", "set"];

/// A part of the planner that can be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The shift of the stack: pushes and pops leave every action at its depth.
    Index,
    /// What holds the sensor back: every action that it recognises counts as ready.
    Sensor,
}

/// Settings of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct StackSpec {
    /// Dimensions of the pointers. The original has 256.
    pub dimensions: usize,
    /// Neurons, or the functions that they compute.
    pub population: Population,
    /// Simulated time after which the run ends.
    pub limit: SimDuration,
    /// Part that is left out.
    pub without: Option<Part>,
}

impl Default for StackSpec {
    fn default() -> Self {
        Self {
            dimensions: 256,
            population: Population::Lif(LifSpec::default()),
            limit: SimDuration::from_millis(4_000),
            without: None,
        }
    }
}

/// What a planner did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StackCourse {
    /// Whether the goal was reached. The run ends then.
    pub reached: bool,
    /// The actions that were begun. The positions are those of [`Kitchen::names`].
    pub begun: Vec<Begun>,
    /// Times that acting followed planning.
    pub episodes: usize,
    /// Simulated time of the run in milliseconds.
    pub ms: u64,
}

/// A planner that is built for one kitchen.
pub struct StackPlanner {
    graph: Arc<Graph>,
    world: StackWorld,
    chosen: ProbeId<Vector>,
    phases: Phases,
    limit_ms: u64,
    seed: Seed,
}

impl StackPlanner {
    /// Builds the planner of a kitchen. The seed decides its pointers and its neurons.
    ///
    /// Costs about 10 s of CPU time at 256 dimensions in neurons.
    ///
    /// # Errors
    /// [`TaskError::Vocabulary`] or [`TaskError::Build`] if the number of dimensions or the population is invalid.
    pub fn new(kitchen: &Kitchen, spec: &StackSpec, seed: Seed) -> Result<Self, TaskError> {
        let symbols = Symbols::new(kitchen, spec.dimensions, seed)?;
        let (mut graph, rules) = graph::describe(kitchen, &symbols, spec.without)?;
        let world = StackWorld::new(kitchen, &symbols, spec.without != Some(Part::Sensor))?;
        let recent = ProbeSpec::default().last(PERIOD_MS as usize);
        let chosen = graph.probe(&rules.chosen, recent);
        let phases = Phases::new(rules.names());
        let plan = populations(spec.population)?;
        let graph = graph.build(Timebase::default(), &plan, seed)?.into();
        let limit_ms = spec.limit.as_micros() / 1000;
        Ok(Self { graph, world, chosen, phases, limit_ms, seed })
    }

    /// Returns the number of neurons; 0 in direct mode.
    pub fn neurons(&self) -> usize {
        SolvedModel::of(&self.graph).neurons()
    }

    /// Returns the graph.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// Plans and acts until the goal is reached or the time is over.
    ///
    /// # Errors
    /// [`TaskError::Sim`] if a value becomes infinite or NaN.
    pub fn run(&self) -> Result<StackCourse, TaskError> {
        let config = RunConfig::seeded(self.seed).with_threads(Threads::Serial);
        let mut sim = Simulator::new(self.graph.clone(), config.in_world(self.world.clone()))?;
        let (mut ms, mut episodes, mut planned) = (0, 0, false);
        loop {
            let reached = inside(&sim).is_some_and(|world| world.kitchen().reached());
            if reached || ms >= self.limit_ms {
                let begun = inside(&sim).map(|world| world.kitchen().begun().to_vec());
                return Ok(StackCourse { reached, begun: begun.unwrap_or_default(), episodes, ms });
            }
            let step = (self.limit_ms - ms).min(PERIOD_MS);
            sim.run_for(SimDuration::from_millis(step))?;
            ms += step;
            let samples = sim.samples(&self.chosen);
            for (_, row) in samples.iter().skip(samples.len().saturating_sub(step as usize)) {
                let phase = row.iter().zip(&self.phases.0).find(|(active, _)| **active > CHOSEN);
                match phase.map(|(_, phase)| phase) {
                    Some(Phase::Plan) => planned = true,
                    Some(Phase::Act) => {
                        episodes += usize::from(planned);
                        planned = false;
                    }
                    _ => {}
                }
            }
        }
    }
}

/// What a rule belongs to.
#[derive(Debug, Clone, Copy)]
enum Phase {
    Plan,
    Act,
    Other,
}

/// The phase of each rule.
struct Phases(Vec<Phase>);

impl Phases {
    fn new(rules: &[String]) -> Self {
        let phase = |name: &String| match name.as_str() {
            name if PLANNING.contains(&name) => Phase::Plan,
            name if ACTING.contains(&name) => Phase::Act,
            _ => Phase::Other,
        };
        Self(rules.iter().map(phase).collect())
    }
}

/// Returns the world of a simulator.
fn inside(sim: &Simulator) -> Option<&StackWorld> {
    let world: &dyn Any = sim.world()?;
    world.downcast_ref()
}

/// Returns the populations: those of the default, with 250 neurons for the gate, as in the original.
fn populations(population: Population) -> Result<PopulationPlan, TaskError> {
    let wide = |spec: LifSpec| LifSpec { per_function: 250, ..spec };
    let gate = match population {
        Population::Rate(spec) => Population::Rate(wide(spec)),
        Population::Lif(spec) => Population::Lif(wide(spec)),
        other => other,
    };
    // The pattern always parses.
    let plan = PopulationPlan::all(population);
    Ok(match "gate/population".parse() {
        Ok(pattern) => plan.with(pattern, gate),
        Err(_) => plan,
    })
}
