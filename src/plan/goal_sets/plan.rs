//! Plans and acts in simulated time: the planner graph in a world that follows the rules of the problem.

use std::any::Any;
use std::sync::Arc;

use thiserror::Error;

use super::both::{Directions, PlannerGraph};
use super::forward::Progression;
use super::moments::{Moment, Moments, Step};
use super::rules::Regression;
use super::spikes::{SpikeCount, SpikeCounter};
use super::world::{Begun, StripsWorld};
use crate::neurons::{PatternError, Population, PopulationPlan, Tuning};
use crate::plan::strips::Grounded;
use crate::sim::{
    Constant, GraphBuilder, InputSpec, OutputSpec, ProbeSpec, RunConfig, Seed, SimDuration,
    SimError, Simulator, Synapse, Timebase, Vector, WorldLink,
};

/// Greatest number of units of a planner graph. In spiking mode each unit is twenty neurons.
pub const MAX_UNITS: usize = 400_000;

/// Simulated time between two looks at the world, in milliseconds. A tick takes one.
const PERIOD_MS: u64 = 10;

/// Settings of a planner over goal sets.
#[derive(Debug, Clone, PartialEq)]
pub struct GoalSetSpec {
    /// Goal sets, and states, that are remembered; if not given, as many as [`slots`] says. A plan has fewer actions; a search
    /// that fills the slots starts again.
    pub slots: Option<usize>,
    /// Simulated time after which the run ends.
    pub limit: SimDuration,
    /// Neurons, or the functions that they compute.
    pub population: Population,
    /// Groups of the planner whose links to others are cut, such as `veto` or `backward/veto`, and `forward/wanted`.
    pub ablated: Vec<String>,
    /// The directions of the search.
    pub directions: Directions,
    /// Whether spikes are counted. It takes about as long as the neurons themselves.
    pub count_spikes: bool,
}

impl Default for GoalSetSpec {
    fn default() -> Self {
        Self {
            slots: None,
            limit: SimDuration::from_millis(10_000),
            population: Population::Direct,
            ablated: Vec::new(),
            directions: Directions::Both,
            count_spikes: false,
        }
    }
}

/// Returns how many goal sets a search backward remembers in a problem with this many fluents, and how many states one forward.
pub fn slots(fluents: usize) -> [usize; 2] {
    // A search backward that goes back to the lowest of many sets misses fewer plans in small problems than one that starts again.
    let few = (12 * fluents).min(150);
    [(4 * fluents).max(few).clamp(48, 400), (6 * fluents).clamp(64, 600)]
}

/// Why a planner cannot run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GoalSetError {
    /// The problem needs too many units.
    #[error(
        "the planner for {fluents} {} and {operators} {} would have {units} units with {slots} slots, more than {MAX_UNITS}; use a smaller problem{}",
        plural(*fluents, "fluent"),
        plural(*operators, "operator"),
        if *slots > LEAST_SLOTS { " or fewer slots" } else { "" }
    )]
    TooLarge {
        /// Number of fluents of the problem.
        fluents: usize,
        /// Number of its operators.
        operators: usize,
        /// Slots that were asked for; 2, the fewest, if they are too many as well.
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
    /// A part of the goal never holds, or two or three never hold together.
    #[error("the goal cannot be reached: {}", never(facts))]
    Unreachable {
        /// The parts, from one to three, as facts.
        facts: Vec<String>,
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
    /// What the planner did, in order. If it searches both ways, steps of both searches.
    pub moments: Vec<Moment>,
    /// Units of the planner.
    pub units: usize,
    /// The directions in which it searched.
    pub directions: Directions,
    /// The spikes, if they were counted.
    pub spikes: Option<SpikeCount>,
    /// Those of the first decision among them: until an action begins.
    pub decision: Option<SpikeCount>,
}

impl Course {
    /// Returns the operators that had their effects, in order.
    pub fn plan(&self) -> impl Iterator<Item = usize> {
        self.begun.iter().filter(|b| b.done).map(|b| b.operator)
    }

    /// Returns the number of goal sets and states that were written, without the goal and the start.
    pub fn goal_sets(&self) -> usize {
        self.count(|step| matches!(step, Step::GoalSet { .. }))
    }

    /// Returns the number of dead ends from which the planner went back.
    pub fn dead_ends(&self) -> usize {
        self.count(|step| step == Step::DeadEnd)
    }

    /// Returns how often it began to plan: once, and once for each surprise or search that filled the slots. Of two searches,
    /// the greater number.
    pub fn starts(&self) -> usize {
        let of = |forward: bool| {
            let own = self.moments.iter().filter(|moment| moment.forward == forward);
            own.filter(|moment| moment.step == Step::Start).count()
        };
        of(false).max(of(true))
    }

    fn count(&self, of: impl Fn(Step) -> bool) -> usize {
        self.moments.iter().filter(|moment| of(moment.step)).count()
    }
}

/// Returns the populations with which the planner is measured: units of twenty neurons, and more for sums and the race.
///
/// A unit of [`Tuning::default`] is too noisy: its decoders are less regularised and it fires less.
///
/// # Errors
/// None for the groups of [`GoalSetGraph`](super::GoalSetGraph); the type is that of all patterns.
pub fn populations(population: &Population) -> Result<PopulationPlan, PatternError> {
    if *population == Population::Direct {
        return Ok(PopulationPlan::direct());
    }
    let of = |change: fn(Tuning) -> Tuning| population.clone().tuned(change);
    let unit = of(|usual| Tuning {
        per_item: 20,
        regularisation: 1.0,
        max_rates: [300.0, 450.0],
        ..usual
    });
    let race = of(|usual| Tuning { per_item: 100, ..usual });
    let plan = PopulationPlan::all(unit).with("**/analog".parse()?, population.clone());
    Ok(plan.with("**/race".parse()?, race))
}

/// The fewest slots: one for the goal and one for an action.
const LEAST_SLOTS: usize = 2;

fn plural(count: usize, word: &str) -> String {
    format!("{word}{}", if count == 1 { "" } else { "s" })
}

/// Says of facts that they never hold together.
fn never(facts: &[String]) -> String {
    match facts {
        [several @ .., last] if !several.is_empty() => {
            format!("{} and {last} never hold together", several.join(", "))
        }
        _ => format!("{} never holds", facts.concat()),
    }
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
    pursue_with(problem, world, spec, &populations(&spec.population)?, seed)
}

/// Plans and acts as [`pursue`] does, with these populations.
pub(crate) fn pursue_with(
    problem: &Grounded,
    world: StripsWorld,
    spec: &GoalSetSpec,
    plan: &PopulationPlan,
    seed: Seed,
) -> Result<Course, GoalSetError> {
    let (fluents, operators) = (problem.fluents.len(), problem.operators.len());
    if let Some(slots @ ..2) = spec.slots {
        return Err(GoalSetError::Slots { slots });
    }
    let [back, ahead] = spec.slots.map_or_else(|| slots(fluents), |slots| [slots; 2]);
    let (directions, units) = fitting(problem, spec.directions, [back, ahead])?;
    let rules = Regression::new(problem);
    if let Some(parts) = rules.never_together(&problem.goal) {
        let facts = parts.iter().map(|f| problem.fluents[*f].to_string()).collect();
        return Err(GoalSetError::Unreachable { facts });
    }
    if rules.operators.iter().all(|operator| operator.adds.is_empty()) {
        // No operator is in a plan: the goal holds, or is out of reach.
        let reached = world.reached();
        let none = spec.count_spikes.then(SpikeCount::default);
        return Ok(Course {
            reached,
            begun: Vec::new(),
            ms: 0,
            moments: Vec::new(),
            units,
            directions,
            spikes: none,
            decision: none,
        });
    }
    let rules = Arc::new(rules);
    let mut graph = GraphBuilder::new();
    let ablated: Vec<String> = spec.ablated.iter().map(|name| within(directions, name)).collect();
    let planner = PlannerGraph::new(problem, rules, directions, [back, ahead]);
    let planner = ablated.iter().fold(planner, |planner, path| planner.ablate(path));
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
    graph.connect(&idle, &planner.busy, Synapse::None);
    graph.connect(&ready, &planner.ready, Synapse::None);
    graph.connect(&goal, &planner.goal, Synapse::None);
    graph.connect(&node.output::<Vector>("holds"), &planner.holds, Synapse::None);
    graph.connect(&planner.actions, &node.input::<Vector>("actions"), Synapse::None);
    let recent = ProbeSpec::default().last(PERIOD_MS as usize);
    let mut watched = Vec::new();
    if let Some(ports) = &planner.backward {
        let probes = [graph.probe(&ports.phases, recent), graph.probe(&ports.winner, recent)];
        watched.push((Moments::default(), probes));
    }
    if let Some(ports) = &planner.forward {
        let probes = [graph.probe(&ports.phases, recent), graph.probe(&ports.winner, recent)];
        watched.push((Moments::forward(), probes));
    }
    for path in &ablated {
        // A name that is no group is a fault of the graph.
        graph.probe_at::<Vector>(&format!("planner/{path}/output"), ProbeSpec::default());
    }
    let graph = graph.build(Timebase::default(), plan, seed).map_err(SimError::from)?;
    let mut counter = spec.count_spikes.then(|| SpikeCounter::new(&graph, &planner.reach));
    let config = RunConfig::seeded(seed).in_world(world);
    let mut sim = Simulator::new(graph.into(), config)?;
    let mut decision = counter.as_ref().map(|counter| counter.count);
    let (mut ms, limit) = (0, spec.limit.as_micros() / 1000);
    while ms < limit && !inside(&sim).is_some_and(StripsWorld::reached) {
        let step = (limit - ms).min(PERIOD_MS);
        match &mut counter {
            Some(counter) => {
                for _ in 0..step {
                    sim.run_for(SimDuration::from_millis(1))?;
                    counter.look(&sim);
                    if inside(&sim).is_none_or(|world| world.begun().is_empty()) {
                        decision = Some(counter.count);
                    }
                }
            }
            None => sim.run_for(SimDuration::from_millis(step)).map(|_| ())?,
        }
        for (moments, [phases, winner]) in &mut watched {
            let (phases, winner) = (sim.samples(phases), sim.samples(winner));
            let past = phases.len().saturating_sub(step as usize);
            let both = phases.iter().zip(winner.iter()).skip(past);
            for (at, ((_, phases), (_, winner))) in both.enumerate() {
                moments.look(ms + at as u64 + 1, phases, winner);
            }
        }
        ms += step;
    }
    let mut moments: Vec<Moment> =
        watched.into_iter().flat_map(|(moments, _)| moments.all).collect();
    moments.sort_by_key(|moment| moment.ms);
    let world = inside(&sim);
    Ok(Course {
        reached: world.is_some_and(StripsWorld::reached),
        begun: world.map(|w| w.begun().to_vec()).unwrap_or_default(),
        ms,
        moments,
        units,
        directions,
        spikes: counter.map(|counter| counter.count),
        decision,
    })
}

/// Returns the path of a group within the planner: a name alone is one of the search backward, if there is one.
fn within(directions: Directions, name: &str) -> String {
    match directions {
        _ if name.contains('/') => name.to_owned(),
        Directions::Forward => format!("forward/{name}"),
        Directions::Backward | Directions::Both => format!("backward/{name}"),
    }
}

/// Returns the directions in which a problem is searched, and about how many units that takes. If both are too many, the
/// search is forward only, which takes fewer.
fn fitting(
    problem: &Grounded,
    directions: Directions,
    [back, ahead]: [usize; 2],
) -> Result<(Directions, usize), GoalSetError> {
    let backward = check_units(problem, back);
    let forward = Progression::units(problem, ahead);
    let least = Progression::units(problem, LEAST_SLOTS);
    match (directions, backward) {
        (Directions::Backward, backward) => Ok((directions, backward?)),
        (Directions::Both, Ok(backward)) if backward + forward <= MAX_UNITS => {
            Ok((directions, backward + forward))
        }
        _ if least > MAX_UNITS => Err(too_large(problem, LEAST_SLOTS, least)),
        _ if forward > MAX_UNITS => Err(too_large(problem, ahead, forward)),
        _ => Ok((Directions::Forward, forward)),
    }
}

/// Returns about how many units a search backward has.
///
/// # Errors
/// [`GoalSetError::TooLarge`] if they are more than [`MAX_UNITS`].
pub(crate) fn check_units(problem: &Grounded, slots: usize) -> Result<usize, GoalSetError> {
    let least = Regression::units(problem, LEAST_SLOTS);
    match Regression::units(problem, slots) {
        _ if least > MAX_UNITS => Err(too_large(problem, LEAST_SLOTS, least)),
        units if units > MAX_UNITS => Err(too_large(problem, slots, units)),
        units => Ok(units),
    }
}

fn too_large(problem: &Grounded, slots: usize, units: usize) -> GoalSetError {
    let (fluents, operators) = (problem.fluents.len(), problem.operators.len());
    GoalSetError::TooLarge { fluents, operators, slots, units }
}

/// Returns the world of a simulator.
fn inside(sim: &Simulator) -> Option<&StripsWorld> {
    let world: &dyn Any = sim.world()?;
    world.downcast_ref()
}
