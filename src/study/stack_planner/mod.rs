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
//! action loses a factor of about the square root of 2 with every push. Longer plans come about by planning again: measured, a
//! stack in spikes rarely holds more than three actions.
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

use crate::neurons::{LifSpec, Population, PopulationPlan, SolvedModel, Tuning};
use crate::plan::goal_sets::Begun;
use crate::sim::{
    Graph, Pointer, ProbeId, ProbeSpec, RunConfig, Seed, SimDuration, Simulator, Threads, Timebase,
    Vector,
};
use crate::task::TaskError;
use symbols::{Acts, Names, Symbols};
use world::StackWorld;

/// Simulated time between two looks at the kitchen, in milliseconds. A tick takes one.
const PERIOD_MS: u64 = 10;
/// Activity from which a rule counts as chosen.
const CHOSEN: f32 = 0.5;
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
    /// Simulated time after which the run ends, rounded down to milliseconds.
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
    /// Actions of the shortest plan, from the first on, that exact maths reads from the stack before the first of them is
    /// taken off it. 0 if the planner does not begin to act. It is no bound on [`first`](Self::first): the memory of the push,
    /// which is copied to the stack, holds the plan as well.
    pub stacked: usize,
    /// Actions of the shortest plan, from the first on, that were done before the planner acted on a second plan or
    /// began any other action.
    pub first: usize,
    /// Simulated time of the run in milliseconds.
    pub ms: u64,
}

/// A planner that is built for one kitchen.
pub struct StackPlanner {
    graph: Arc<Graph>,
    world: StackWorld,
    chosen: ProbeId<Vector>,
    stack: ProbeId<Pointer<Acts>>,
    names: Names,
    /// The phase of each rule.
    phases: Vec<Option<Phase>>,
    limit_ms: u64,
    seed: Seed,
}

impl StackPlanner {
    /// Builds the planner of a kitchen. The seed decides its pointers and its neurons.
    ///
    /// Costs some seconds of CPU time at 256 dimensions in neurons.
    ///
    /// # Errors
    /// [`TaskError::Vocabulary`] or [`TaskError::Build`] if the number of dimensions or the population is invalid.
    pub fn new(kitchen: &Kitchen, spec: &StackSpec, seed: Seed) -> Result<Self, TaskError> {
        let symbols = Symbols::new(kitchen, spec.dimensions, seed)?;
        let (mut graph, rules, stack) = graph::describe(kitchen, &symbols, spec.without)?;
        let world = StackWorld::new(kitchen, &symbols, spec.without)?;
        let recent = ProbeSpec::default().last(PERIOD_MS as usize);
        let chosen = graph.probe(&rules.chosen, recent);
        let stack = graph.probe(&stack, recent);
        let names = symbols.names_of_actions(kitchen)?;
        let phases = rules.names().iter().map(|rule| phase_of(rule)).collect();
        let plan = populations(spec.population.clone())?;
        let graph = graph.build(Timebase::default(), &plan, seed)?.into();
        let limit_ms = spec.limit.as_micros() / 1000;
        Ok(Self { graph, world, chosen, stack, names, phases, limit_ms, seed })
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
    /// Costs about 3 s of CPU time per simulated second at 256 dimensions in neurons.
    ///
    /// # Errors
    /// [`TaskError::Sim`] if a value becomes infinite or NaN.
    pub fn run(&self) -> Result<StackCourse, TaskError> {
        let config = RunConfig::seeded(self.seed).with_threads(Threads::Serial);
        let mut sim = Simulator::new(self.graph.clone(), config.in_world(self.world.clone()))?;
        let mut seen = Seen::default();
        let mut ms = 0;
        loop {
            let reached = inside(&sim).is_some_and(|world| world.kitchen().reached());
            if reached || ms >= self.limit_ms {
                let begun = inside(&sim).map(|world| world.kitchen().begun().to_vec());
                let begun = begun.unwrap_or_default();
                let Seen { episodes, stacked, again_ms, .. } = seen;
                let first = self.in_order(&begun, again_ms.unwrap_or(u64::MAX));
                let stacked = stacked.unwrap_or(0);
                return Ok(StackCourse { reached, begun, episodes, stacked, first, ms });
            }
            let step = (self.limit_ms - ms).min(PERIOD_MS);
            sim.run_for(SimDuration::from_millis(step))?;
            let (chosen, stacks) = (sim.samples(&self.chosen), sim.samples(&self.stack));
            let before = chosen.len().saturating_sub(step as usize);
            let rows = chosen.iter().zip(stacks.iter()).skip(before);
            for (tick, ((_, row), (_, stack))) in (ms..).zip(rows) {
                let phase = row.iter().zip(&self.phases).find(|(active, _)| **active > CHOSEN);
                match phase.and_then(|(_, phase)| *phase) {
                    Some(Phase::Plan) => seen.planned = true,
                    Some(phase @ (Phase::Read | Phase::Take)) => {
                        seen.episodes += usize::from(seen.planned);
                        seen.planned = false;
                        if seen.episodes > 1 {
                            seen.again_ms.get_or_insert(tick);
                        }
                        if phase == Phase::Take && seen.stacked.is_none() {
                            seen.stacked = Some(self.names.in_order(&stack));
                        }
                    }
                    _ => {}
                }
            }
            ms += step;
        }
    }

    /// Returns how many of the first actions are those of the shortest plan, in its order, were begun before `until_ms`
    /// and had their effects.
    fn in_order(&self, begun: &[Begun], until_ms: u64) -> usize {
        let begun = begun.iter().take_while(|action| action.ms < until_ms && action.done);
        begun
            .zip(self.names.shortest())
            .take_while(|(action, wanted)| action.operator == *wanted)
            .count()
    }
}

/// What was seen of a run so far.
#[derive(Default)]
struct Seen {
    /// Whether a rule that plans was chosen since the last one that acts.
    planned: bool,
    episodes: usize,
    /// Actions on the stack when the first one was taken off it.
    stacked: Option<usize>,
    /// Time at which acting on the second plan began.
    again_ms: Option<u64>,
}

/// What a rule belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Plan,
    /// Acting: the top of the stack is read.
    Read,
    /// Acting: the action that was read is taken off the stack.
    Take,
}

/// Returns what a rule belongs to, by its name.
fn phase_of(rule: &str) -> Option<Phase> {
    match rule {
        "plan" | "get_action" | "get_precon" | "set_goal" => Some(Phase::Plan),
        "top" => Some(Phase::Read),
        "pop" | "set" => Some(Phase::Take),
        _ => None,
    }
}

/// Returns the world of a simulator.
fn inside(sim: &Simulator) -> Option<&StackWorld> {
    let world: &dyn Any = sim.world()?;
    world.downcast_ref()
}

/// Returns the populations: those of the default, with 250 neurons for the gate, as in the original.
fn populations(population: Population) -> Result<PopulationPlan, TaskError> {
    let gate = population.clone().tuned(|usual| Tuning { per_function: 250, ..usual });
    // The pattern always parses.
    let plan = PopulationPlan::all(population);
    Ok(match "gate/population".parse() {
        Ok(pattern) => plan.with(pattern, gate),
        Err(_) => plan,
    })
}
