//! `kitchen`: the kitchen of 2016, with 2 to 5 actions.

use serde_json::{Value, json};

use super::{REVISION, Setup, begun_at, number, rates, unmet, world};
use crate::plan::goal_sets::Course;
use crate::sim::Seed;
use crate::study::experiment::{
    About, Cell, Experiment, Figure, Measure, Reading, Results, TrialOutcome, outcome,
};
use crate::study::problems::{Kitchen, PlanningProblem};
use crate::task::TaskError;

/// Numbers of actions of the kitchen of 2016.
const ACTIONS: [usize; 4] = [2, 3, 4, 5];
/// Simulated time in milliseconds after which a trial has failed, as in the model of 2016.
pub(super) const LIMIT_MS: u64 = 4_000;
/// Time for each action within which the goal is to be reached, in milliseconds.
const IN_TIME_MS: usize = 250;
/// Goal sets that are remembered.
pub(super) const SLOTS: usize = 24;

pub(super) const REACHED: &str = "goal reached";
const AS_PLANNED: &str = "first plan carried out";

/// The experiment: kitchens as they are written, and with random names and orders.
pub(crate) struct Kitchens(Setup);

impl Kitchens {
    pub fn new() -> Self {
        Self(Setup::spiking(SLOTS, LIMIT_MS))
    }
}

/// Readings of a problem that needs a known number of actions.
pub(super) fn readings() -> Vec<Reading> {
    vec![
        Reading::what(Measure::Rate, REACHED),
        Reading::what(Measure::Rate, "reached with the fewest actions"),
        Reading::what(Measure::Rate, AS_PLANNED),
        Reading::what(Measure::Rate, "reached in time"),
        Reading::what(Measure::Share(5), "begun with an unmet precondition"),
        Reading::count(),
        Reading::what(Measure::Mean, "last action begins (ms)"),
        Reading::what(Measure::Mean, "first action begins (ms)"),
    ]
}

/// Returns the numbers of [`readings`].
///
/// The first plan was carried out if the planner planned once, every action that it began had its preconditions met, and the
/// goal was reached. A planner that finds a wrong order acts on it, notices that an action cannot be done, and plans anew; it
/// may then reach the goal, but later.
pub(super) fn outcome_of(course: &Course, actions: usize) -> TrialOutcome {
    let [unmet, begun] = unmet(course);
    let last = begun_at(course.begun.last());
    outcome([
        number(course.reached),
        number(course.reached && course.begun.len() == actions),
        number(course.reached && course.starts() == 1 && unmet == 0.0),
        number(course.reached && last <= (IN_TIME_MS * actions) as f64),
        unmet,
        begun,
        if course.reached { last } else { f64::NAN },
        begun_at(course.begun.first()),
    ])
}

/// Returns the settings of the planner and of the time that it has.
pub(super) fn settings(setup: &Setup) -> Value {
    let mut settings = setup.settings();
    settings["in_time_ms_an_action"] = json!(IN_TIME_MS);
    settings
}

/// Returns the problem with random names and orders.
pub(super) fn shuffled(
    problem: &PlanningProblem,
    seed: Seed,
) -> Result<PlanningProblem, TaskError> {
    problem.shuffled(&mut seed.derive("", "names and orders").rng())
}

const ORDERS: [(&str, bool); 2] = [("as written", false), ("random", true)];

impl Experiment for Kitchens {
    fn about(&self) -> About {
        let question = "How often and how fast does the planner of goal sets boil water, with 2 to 5 actions left?";
        let settings = settings(&self.0);
        About { name: "kitchen", question, revision: REVISION, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let cell = |actions: usize| {
            ORDERS.map(|(order, _)| {
                let settings = json!({"names and orders": order, "actions": actions});
                Cell::new(settings, 50, readings())
            })
        };
        ACTIONS.iter().flat_map(|actions| cell(*actions)).collect()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let actions = cell.number("actions")? as usize;
        let mut problem = Kitchen::default().problem(actions)?;
        if cell.choice("names and orders", &ORDERS)? {
            problem = shuffled(&problem, seed)?;
        }
        let course = self.0.pursue(&problem, world(&problem), &[], seed)?;
        Ok(outcome_of(&course, actions))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let series = ORDERS.map(|(order, _)| {
            let wanted = json!({"names and orders": order, "what": REACHED});
            (format!("names and orders {order}"), wanted)
        });
        Some(rates(results, "Water boiled", ("actions", "actions"), series))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neurons::Population;

    #[test]
    fn every_cell_in_direct_mode() {
        let setup = Setup { population: Population::Direct, ..Setup::spiking(SLOTS, LIMIT_MS) };
        let kitchens = Kitchens(setup);
        let cells = kitchens.cells();
        assert_eq!(cells.len(), 8);
        for cell in &cells {
            for seed in 0..2 {
                let done = kitchens.trial(cell, Seed::new(seed)).expect("a trial");
                assert_eq!(done[..5], [1.0, 1.0, 1.0, 1.0, 0.0], "{cell}: {done:?}");
                assert_eq!(done[5], cell.number("actions").expect("a number"));
            }
        }
    }
}
