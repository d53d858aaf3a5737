//! `surprises`: actions that fail, and another hand that changes something once.

use std::collections::BTreeSet;

use rand::RngExt;
use rand::seq::IndexedRandom;
use serde_json::json;

use super::kitchen::{REACHED, SLOTS};
use super::{REVISION, Setup, begun_at, number, rates, unmet, world};
use crate::plan::goal_sets::Course;
use crate::plan::strips::Grounded;
use crate::sim::Seed;
use crate::study::experiment::{
    About, Cell, Experiment, Figure, Measure, Reading, Results, TrialOutcome, outcome,
};
use crate::study::problems::{Distance, Kitchen, PlanningProblem, distance};
use crate::task::TaskError;

/// Probability that an action begins and has no effect.
const FAILURES: f64 = 0.2;
const LIMIT_MS: u64 = 10_000;
/// Most states of a kitchen.
const STATES: usize = 10_000;

/// Surprises: whether actions fail, and whether another hand acts.
const KINDS: [(&str, [bool; 2]); 3] =
    [("actions fail", [true, false]), ("another hand", [false, true]), ("both", [true, true])];

/// The experiment: the kitchen with surprises.
pub(crate) struct Surprises(Setup);

impl Surprises {
    pub fn new() -> Self {
        Self(Setup::spiking(SLOTS, LIMIT_MS))
    }
}

/// Returns what holds at a time of a course in milliseconds, before an action of that millisecond.
fn state_at(problem: &Grounded, course: &Course, ms: u64) -> BTreeSet<usize> {
    let mut state: BTreeSet<usize> = problem.start.iter().copied().collect();
    let done = course.begun.iter().filter(|begun| begun.done && begun.ms < ms);
    done.for_each(|begun| problem.operators[begun.operator].apply(&mut state));
    state
}

/// Returns the operators that another hand can carry out in a state: they change something, do not reach the goal, and leave
/// it within reach.
fn hands(problem: &Grounded, state: &BTreeSet<usize>) -> Vec<usize> {
    let fits = |a: &usize| {
        let operator = &problem.operators[*a];
        let mut after = state.clone();
        operator.apply(&mut after);
        let reach = distance(problem, &after, STATES);
        Grounded::all_hold(state, &operator.preconditions)
            && after != *state
            && matches!(reach, Distance::Steps(1..))
    };
    (0..problem.operators.len()).filter(fits).collect()
}

/// Draws when another hand acts and what it does. The time is any at which it can do something before the goal is reached in
/// `course`, which is the course without it. `None` if there is no such time.
fn hand(problem: &PlanningProblem, course: &Course, seed: Seed) -> Option<(u64, usize)> {
    let rng = &mut seed.derive("", "hand").rng();
    let problem = &problem.grounded;
    let end = course.begun.last().filter(|_| course.reached).map_or(LIMIT_MS, |begun| begun.ms);
    (0..100).find_map(|_| {
        let ms = rng.random_range(1..=end);
        let choices = hands(problem, &state_at(problem, course, ms));
        choices.choose(rng).map(|operator| (ms, *operator))
    })
}

impl Experiment for Surprises {
    fn about(&self) -> About {
        let question = "How often does the planner of goal sets boil water if actions fail and another hand changes something?";
        let mut settings = self.0.settings();
        settings["failures"] = json!(FAILURES);
        About { name: "surprises", question, revision: REVISION, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = || {
            vec![
                Reading::what(Measure::Rate, REACHED),
                Reading::what(Measure::Share(2), "begun with an unmet precondition"),
                Reading::count(),
                Reading::what(Measure::Mean, "last action begins (ms)"),
                Reading::what(Measure::Mean, "new starts"),
                Reading::what(Measure::Mean, "actions that failed"),
                Reading::what(Measure::Rate, "another hand changed something"),
            ]
        };
        let mut cells = Vec::new();
        for (surprise, _) in KINDS {
            for actions in 2..=5u32 {
                let settings = json!({"surprise": surprise, "actions": actions});
                cells.push(Cell::new(settings, 50, readings()));
            }
        }
        cells
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let problem = Kitchen::default().problem(cell.number("actions")? as usize)?;
        let [fails, meddles] = cell.choice("surprise", &KINDS)?;
        let place = || world(&problem).failures(if fails { FAILURES } else { 0.0 });
        let mut course = self.0.pursue(&problem, place(), &[], seed)?;
        let mut meddled = false;
        if meddles && let Some((ms, operator)) = hand(&problem, &course, seed) {
            // Until then the course is the same.
            let place = place().intrusion(ms, operator);
            course = self.0.pursue(&problem, place, &[], seed)?;
            meddled = true;
        }
        let [unmet, begun] = unmet(&course);
        let failed = course.begun.iter().filter(|b| b.met && !b.done).count();
        Ok(outcome([
            number(course.reached),
            unmet,
            begun,
            if course.reached { begun_at(course.begun.last()) } else { f64::NAN },
            course.starts().saturating_sub(1) as f64,
            failed as f64,
            number(meddled),
        ]))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let series = KINDS.map(|(surprise, _)| {
            (surprise.to_owned(), json!({"surprise": surprise, "what": REACHED}))
        });
        Some(rates(results, "Water boiled in spite of surprises", ("actions", "actions"), series))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neurons::Population;
    use crate::plan::goal_sets::{Begun, Directions};

    #[test]
    fn another_hand_changes_something_and_leaves_the_goal_within_reach() {
        let problem = Kitchen { one_fuse: true, put_back: false }.problem(5).expect("a problem");
        let made = &problem.grounded;
        let place = |name: &str| made.operators.iter().position(|o| o.name == name).expect(name);
        let begun = |ms, name| Begun { ms, operator: place(name), met: true, done: true };
        let course = Course {
            reached: true,
            begun: vec![begun(500, "(unplug-kettle)"), begun(600, "(put-kettle-under-tap)")],
            ms: 700,
            moments: Vec::new(),
            units: 1,
            directions: Directions::Backward,
            spikes: None,
            decision: None,
        };
        let named = |ms| {
            let hands = hands(made, &state_at(made, &course, ms));
            hands.into_iter().map(|a| made.operators[a].name.as_str()).collect::<Vec<_>>()
        };
        assert_eq!(named(500), ["(unplug-kettle)"]);
        // To plug in now would blow the fuse.
        assert_eq!(named(501), ["(put-kettle-under-tap)"]);
        assert_eq!(named(700), ["(fill-kettle-from-tap)", "(plug-in-kettle)"]);
        for seed in 0..20 {
            let (ms, operator) = hand(&problem, &course, Seed::new(seed)).expect("a hand");
            assert!((1..=600).contains(&ms));
            assert!(hands(made, &state_at(made, &course, ms)).contains(&operator));
        }
    }

    #[test]
    fn every_cell_in_direct_mode() {
        let setup = Setup { population: Population::Direct, ..Setup::spiking(SLOTS, LIMIT_MS) };
        let surprises = Surprises(setup);
        let (mut failed, mut meddled) = (0.0, 0.0);
        for cell in surprises.cells() {
            for seed in 0..2 {
                let done = surprises.trial(&cell, Seed::new(seed)).expect("a trial");
                assert_eq!(done[0], 1.0, "{cell}");
                let kind = cell.choice("surprise", &KINDS).expect("a kind");
                assert_eq!(done[6], number(kind[1]), "{cell}");
                failed += done[5];
                meddled += done[6];
            }
        }
        assert!(failed >= 5.0 && meddled == 16.0, "{failed} {meddled}");
    }
}
