//! Plans and acts in simulated time: the planner graph in a world that follows the rules of the problem.

use std::any::Any;
use std::sync::Arc;

use thiserror::Error;

use super::control::Phase;
use super::graph::GoalSetGraph;
use super::memory::Layout;
use super::rules::Regression;
use super::world::{Begun, StripsWorld};
use crate::neurons::{LifSpec, PatternError, Population, PopulationPlan};
use crate::sim::{
    Constant, GraphBuilder, InputSpec, OutputSpec, ProbeSpec, Real, RunConfig, Seed, SimDuration,
    SimError, Simulator, Synapse, Timebase, Vector, WorldLink,
};
use crate::task::strips::Grounded;

/// Greatest number of units of a planner graph. In spiking mode each unit is twenty neurons.
pub const MAX_UNITS: usize = 400_000;

/// Simulated time between two looks at the world, in milliseconds. A tick takes one.
const PERIOD_MS: u64 = 10;

/// Settings of a planner over goal sets.
#[derive(Debug, Clone, PartialEq)]
pub struct GoalSetSpec {
    /// Goal sets that are remembered. A plan has fewer actions; a search that fills the slots starts again.
    pub slots: usize,
    /// Simulated time after which the run ends.
    pub limit: SimDuration,
    /// Neurons, or the functions that they compute.
    pub population: Population,
    /// Groups of the planner whose links to others are cut, such as `veto`.
    pub ablated: Vec<String>,
}

impl Default for GoalSetSpec {
    fn default() -> Self {
        Self {
            slots: 48,
            limit: SimDuration::from_millis(10_000),
            population: Population::Direct,
            ablated: Vec::new(),
        }
    }
}

/// Why a planner cannot run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GoalSetError {
    /// The problem needs too many units.
    #[error(
        "the planner for {fluents} fluents and {operators} operators would have {units} units, more than {MAX_UNITS}; use a smaller problem or fewer slots than {slots}"
    )]
    TooLarge {
        /// Number of fluents of the problem.
        fluents: usize,
        /// Number of its operators.
        operators: usize,
        /// Slots that were asked for.
        slots: usize,
        /// Number of units.
        units: usize,
    },
    /// There are fewer than two slots.
    #[error(
        "a planner needs at least 2 slots, one for the goal and one for each action; got {slots}"
    )]
    Slots {
        /// Slots that were asked for.
        slots: usize,
    },
    /// Two parts of the goal never hold together.
    #[error("the goal cannot be reached: {first} and {second} never hold together")]
    Unreachable {
        /// A part of the goal.
        first: String,
        /// Another one, or the same.
        second: String,
    },
    /// A pattern of layers is wrong.
    #[error(transparent)]
    Pattern(#[from] PatternError),
    /// A group to be ablated does not exist, or the world failed.
    #[error(transparent)]
    Sim(#[from] SimError),
}

/// What a planner did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Course {
    /// Whether the goal holds at the end.
    pub reached: bool,
    /// The actions that were begun.
    pub begun: Vec<Begun>,
    /// Simulated time of the run in milliseconds. The run ends once the goal holds.
    pub ms: u64,
    /// Goal sets that were written, without the goal itself.
    pub steps: usize,
    /// Dead ends from which the planner went back.
    pub backs: usize,
    /// Times that it began to plan: 1, and one for each surprise or search that filled the slots.
    pub starts: usize,
    /// Units of the planner.
    pub units: usize,
}

impl Course {
    /// Returns the operators that had their effects, in order.
    pub fn plan(&self) -> impl Iterator<Item = usize> {
        self.begun.iter().filter(|b| b.done).map(|b| b.operator)
    }
}

/// Returns the populations with which the planner is measured: units of twenty neurons, and more for sums and the race.
///
/// A unit of [`LifSpec::default`] is too noisy: its decoders are less regularised and it fires less.
///
/// # Errors
/// None for the groups of [`GoalSetGraph`]; the type is that of all patterns.
pub fn populations(population: &Population) -> Result<PopulationPlan, PatternError> {
    let of = |spec: LifSpec| match population {
        Population::Direct => Population::Direct,
        Population::Rate(_) => Population::Rate(spec),
        Population::Lif(_) => Population::Lif(spec),
    };
    let (Population::Rate(spec) | Population::Lif(spec)) = population else {
        return Ok(PopulationPlan::direct());
    };
    let unit = LifSpec { per_item: 20, regularisation: 1.0, max_rates: [300.0, 450.0], ..*spec };
    let race = LifSpec { per_item: 100, ..*spec };
    let plan = PopulationPlan::all(of(unit)).with("**/analog".parse()?, of(*spec));
    Ok(plan.with("**/race".parse()?, of(race)))
}

/// Plans and acts until the goal holds or the time is over.
///
/// Costs O(units) per simulated millisecond in spiking mode. One seed gives the same bits.
///
/// # Errors
/// [`GoalSetError`] if the problem is too large, if parts of the goal exclude each other, or if a group to be ablated does
/// not exist.
pub fn pursue(
    problem: &Grounded,
    world: StripsWorld,
    spec: &GoalSetSpec,
    seed: Seed,
) -> Result<Course, GoalSetError> {
    let (fluents, operators) = (problem.fluents.len(), problem.operators.len());
    if spec.slots < 2 {
        return Err(GoalSetError::Slots { slots: spec.slots });
    }
    let units = Layout::new(fluents, operators, spec.slots).units();
    if units > MAX_UNITS {
        return Err(GoalSetError::TooLarge { fluents, operators, slots: spec.slots, units });
    }
    if problem.operators.is_empty() {
        // Nothing can be done, so the goal holds: a goal that no operator achieves is refused when the problem is grounded.
        let reached = world.reached();
        return Ok(Course {
            reached,
            begun: Vec::new(),
            ms: 0,
            steps: 0,
            backs: 0,
            starts: 0,
            units,
        });
    }
    let rules = Regression::new(problem);
    let mut pairs = problem.goal.iter().flat_map(|a| problem.goal.iter().map(move |b| (*a, *b)));
    if let Some((a, b)) = pairs.find(|(a, b)| rules.mutexes.excludes(*a, *b)) {
        let [first, second] = [a, b].map(|f| problem.fluents[f].to_string());
        return Err(GoalSetError::Unreachable { first, second });
    }
    let rules = Arc::new(rules);
    let mut graph = GraphBuilder::new();
    let planner = GoalSetGraph::new(rules, spec.slots);
    let planner = spec.ablated.iter().fold(planner, |planner, group| planner.ablate(group));
    let planner = graph.add("planner", planner);
    let link = WorldLink::new()
        .sense("holds", OutputSpec::vector(fluents))
        .command("actions", InputSpec::vector(operators));
    let node = graph.world("world", link);
    let ready = graph.add("ready", Constant::vector(&[1.0]));
    let mut wanted = vec![0.0; fluents];
    problem.goal.iter().for_each(|f| wanted[*f] = 1.0);
    let goal = graph.add("goal", Constant::vector(&wanted));
    let idle = graph.add("idle", Constant::vector(&[0.0]));
    graph.connect(&ready, &planner.ready, Synapse::None);
    graph.connect(&idle, &planner.busy, Synapse::None);
    graph.connect(&goal, &planner.goal, Synapse::None);
    graph.connect(&node.output::<Vector>("holds"), &planner.holds, Synapse::None);
    graph.connect(&planner.actions, &node.input::<Vector>("actions"), Synapse::None);
    let phases = graph.probe(&planner.phases, ProbeSpec::default().last(PERIOD_MS as usize));
    for name in &spec.ablated {
        // A name that is no group is a fault of the graph.
        graph.probe_at::<Vector>(&format!("planner/{name}/output"), ProbeSpec::default());
    }
    let plan = populations(&spec.population)?;
    let graph = graph.build(Timebase::default(), &plan, seed).map_err(SimError::from)?;
    let config = RunConfig::seeded(seed).in_world(world);
    let mut sim = Simulator::new(graph.into(), config)?;
    let mut tally = Tally::default();
    let (mut ms, limit) = (0, spec.limit.as_micros() / 1000);
    while ms < limit && !inside(&sim).is_some_and(StripsWorld::reached) {
        let step = (limit - ms).min(PERIOD_MS);
        sim.run_for(SimDuration::from_millis(step))?;
        ms += step;
        let samples = sim.samples(&phases);
        let past = samples.len().saturating_sub(step as usize);
        samples.iter().skip(past).for_each(|(_, row)| tally.add(row));
    }
    let [steps, backs, starts] = tally.counts;
    let world = inside(&sim);
    Ok(Course {
        reached: world.is_some_and(StripsWorld::reached),
        begun: world.map(|w| w.begun().to_vec()).unwrap_or_default(),
        ms,
        steps,
        backs,
        starts,
        units,
    })
}

/// Returns the world of a simulator.
fn inside(sim: &Simulator) -> Option<&StripsWorld> {
    let world: &dyn Any = sim.world()?;
    world.downcast_ref()
}

/// Phases that are counted: goal sets are written, dead ends are left, planning begins.
const COUNTED: [Phase; 3] = [Phase::Write, Phase::Back, Phase::Start];
/// Activity above which a phase is active, and below which it is over. Noise between the two counts for nothing.
const ACTIVE: Real = 0.5;
const OVER: Real = 0.3;

/// How often each phase of [`COUNTED`] began.
///
/// While one phase follows another, both are active for a moment. So each is counted by itself.
#[derive(Default)]
struct Tally {
    counts: [usize; 3],
    active: [bool; 3],
}

impl Tally {
    /// Takes the activities of all phases at one time.
    fn add(&mut self, row: &[Real]) {
        for (i, phase) in COUNTED.into_iter().enumerate() {
            let activity = row[phase as usize];
            if self.active[i] {
                self.active[i] = activity >= OVER;
            } else if activity > ACTIVE {
                self.active[i] = true;
                self.counts[i] += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts what begins in rows that have these activities and zeros.
    fn counted(rows: &[&[(Phase, Real)]]) -> [usize; 3] {
        let mut tally = Tally::default();
        for active in rows {
            let mut row = [0.0; Phase::ALL.len()];
            active.iter().for_each(|(phase, activity)| row[*phase as usize] = *activity);
            tally.add(&row);
        }
        tally.counts
    }

    #[test]
    fn a_start_that_is_never_active_alone_is_counted() {
        use Phase::{Back, Check, Start, Wave, Write};
        let rows: [&[(Phase, Real)]; 7] = [
            &[(Start, 1.0)],
            &[(Wave, 1.0)],
            &[(Check, 1.0)],
            &[(Check, 0.8), (Start, 0.7)],
            &[(Start, 0.9), (Wave, 0.8)],
            &[(Wave, 1.0)],
            &[(Write, 0.9), (Back, 0.9)],
        ];
        assert_eq!(counted(&rows), [1, 1, 2]);
    }

    #[test]
    fn a_phase_that_fluctuates_begins_once() {
        let of = |activity| [(Phase::Start, activity)];
        let rows = [0.0, 0.6, 0.45, 0.31, 0.55, 0.9, 0.51, 0.29, 0.4, 0.5, 0.51, 0.0].map(of);
        let rows = rows.each_ref().map(<[_; 1]>::as_slice);
        assert_eq!(counted(&rows), [0, 0, 2]);
        assert_eq!(counted(&[]), [0; 3]);
    }
}
