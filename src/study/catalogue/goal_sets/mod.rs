//! Experiments with the planner of goal sets: kitchens, threats, surprises, long plans, tangled domains, and problems in PDDL.

mod blind;
mod ipc;
mod kitchen;
mod long;
mod preferences;
mod surprises;
mod tangled;
mod threats;

use std::collections::BTreeSet;

use rand::Rng;
use serde_json::{Value, json};

use super::Options;
use crate::neurons::{LifSpec, Population};
use crate::plan::goal_sets::{
    Begun, Course, Directions, GoalSetError, GoalSetSpec, Regression, StripsWorld, pursue, search,
};
use crate::sim::{Seed, SimDuration};
use crate::study::experiment::{
    Axis, Figure, Measure, Reading, Results, Row, Series, Style, TrialOutcome, outcome,
};
use crate::study::problems::PlanningProblem;
use crate::task::TaskError;

pub(super) use ipc::Ipc;
pub(super) use kitchen::Kitchens;
pub(super) use long::LongPlans;
pub(super) use preferences::Preferences;
pub(super) use surprises::Surprises;
pub(super) use tangled::Tangled;
pub(super) use threats::Threats;

/// Time for which the motor is locked after an action has begun, in milliseconds, as in the model of 2016.
const LOCK_MS: u64 = 100;

/// Revision of all experiments here. It increases with every change of the planner's outcomes.
const REVISION: u32 = 10;

/// The planner of a trial.
#[derive(Debug, Clone, PartialEq)]
struct Setup {
    population: Population,
    /// Goal sets and states that are remembered; as many as the problem suggests if not given.
    slots: Option<usize>,
    /// Greatest simulated time in milliseconds.
    limit_ms: u64,
    directions: Directions,
}

impl Setup {
    /// A planner of spiking neurons, which searches backward.
    fn spiking(slots: usize, limit_ms: u64) -> Self {
        let population = Population::Lif(LifSpec::default());
        Self { population, slots: Some(slots), limit_ms, directions: Directions::Backward }
    }

    /// A planner that searches both ways, with as many slots as each problem suggests.
    fn both(self) -> Self {
        Self { directions: Directions::Both, slots: None, ..self }
    }

    /// Returns the settings that outcomes depend on.
    fn settings(&self) -> Value {
        json!({
            "mode": self.population.to_string(), "slots": self.slots, "limit_ms": self.limit_ms, "motor_lock_ms": LOCK_MS,
            "directions": self.directions.name(),
        })
    }

    /// Plans and acts in a world that follows the rules of the problem, without the ablated groups.
    fn pursue(
        &self,
        problem: &PlanningProblem,
        world: StripsWorld,
        ablated: &[&str],
        seed: Seed,
    ) -> Result<Course, TaskError> {
        let spec = GoalSetSpec {
            slots: self.slots,
            directions: self.directions,
            count_spikes: false,
            limit: SimDuration::from_millis(self.limit_ms),
            population: self.population.clone(),
            ablated: ablated.iter().map(|group| (*group).to_owned()).collect(),
        };
        pursue(&problem.grounded, world, &spec, seed).map_err(refused)
    }
}

/// Returns the world of a problem.
fn world(problem: &PlanningProblem) -> StripsWorld {
    StripsWorld::new(&problem.grounded, SimDuration::from_millis(LOCK_MS))
}

fn refused(error: GoalSetError) -> TaskError {
    match error {
        GoalSetError::Sim(error) => TaskError::Sim(error),
        other => TaskError::Problem { reason: other.to_string() },
    }
}

/// 1 for true, 0 for false.
fn number(holds: bool) -> f64 {
    if holds { 1.0 } else { 0.0 }
}

/// Returns the time at which an action began, in milliseconds; NaN if there is none.
fn begun_at(begun: Option<&Begun>) -> f64 {
    begun.map_or(f64::NAN, |begun| begun.ms as f64)
}

/// Returns the number of actions that were begun with an unmet precondition, and of all that were begun.
fn unmet(course: &Course) -> [f64; 2] {
    let unmet = course.begun.iter().filter(|begun| !begun.met).count();
    [unmet as f64, course.begun.len() as f64]
}

const VALID: &str = "valid plans";
const RULES_VALID: &str = "valid, rules without neurons";

/// Readings of problems whose shortest plan is known.
fn readings_of_length() -> Vec<Reading> {
    vec![
        Reading::what(Measure::Rate, VALID),
        Reading::what(Measure::Mean, "length / shortest"),
        Reading::what(Measure::Mean, "planning (ms)"),
        Reading::what(Measure::Mean, "new starts"),
        Reading::what(Measure::Share(5), "begun with an unmet precondition"),
        Reading::count(),
        Reading::what(Measure::Rate, RULES_VALID),
        Reading::what(Measure::Mean, "length / shortest, rules without neurons"),
    ]
}

/// Plans and acts with neurons and by the rules without neurons. Returns the numbers of [`readings_of_length`].
fn trial_of_length(
    setup: &Setup,
    problem: &PlanningProblem,
    shortest: usize,
    seed: Seed,
) -> Result<TrialOutcome, TaskError> {
    let course = setup.pursue(problem, world(problem), &[], seed)?;
    let length = problem.valid_length(course.plan());
    let rules = by_rules(problem, setup.slots, &mut seed.derive("", "rules").rng());
    let ratio = |length: Option<usize>| length.map_or(f64::NAN, |n| n as f64 / shortest as f64);
    let [unmet, begun] = unmet(&course);
    Ok(outcome([
        number(length.is_some()),
        ratio(length),
        begun_at(course.begun.first()),
        course.starts().saturating_sub(1) as f64,
        unmet,
        begun,
        number(rules.is_some()),
        ratio(rules),
    ]))
}

/// Searches by the rules without neurons, with as many slots as the planner. Returns the length of the plan if one was found
/// and is valid.
fn by_rules(problem: &PlanningProblem, slots: Option<usize>, rng: &mut impl Rng) -> Option<usize> {
    let [suggested, _] = crate::plan::goal_sets::slots(problem.grounded.fluents.len());
    let slots = slots.unwrap_or(suggested);
    let rules = Regression::new(&problem.grounded);
    let set = |fluents: &[usize]| -> BTreeSet<usize> { fluents.iter().copied().collect() };
    let (start, goal) = (set(&problem.grounded.start), set(&problem.grounded.goal));
    let found = search(&rules, &start, &goal, slots, rng)?;
    problem.valid_length(found.plan)
}

/// Draws rates over a setting that is a number, one line for each series: its name and what its rows have.
fn rates(
    results: &Results,
    title: &str,
    axis: (&str, &str),
    series: impl IntoIterator<Item = (String, Value)>,
) -> Figure {
    let (setting, label) = axis;
    let mark = |row: &Row| Some(row.percent(row.number(setting)?));
    let marks = |wanted: &Value| results.marks(wanted, mark);
    let series =
        series.into_iter().map(|(name, wanted)| Series::new(name, marks(&wanted), Style::Line));
    Figure {
        title: title.into(),
        x: Axis::new(label),
        y: Axis::from_to("% of trials", 0.0, 100.0),
        series: series.collect(),
    }
}
