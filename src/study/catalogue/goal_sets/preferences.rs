//! `preferences`: what each preference of the searches buys.

use serde_json::json;

use super::kitchen::shuffled;
use super::{REVISION, Setup, begun_at, number, world};
use crate::neurons::Population;
use crate::plan::goal_sets::Directions;
use crate::sim::Seed;
use crate::study::experiment::{About, Cell, Experiment, Measure, Reading, TrialOutcome, outcome};
use crate::study::problems::{chores, tangled};
use crate::task::TaskError;

const LIMIT_MS: u64 = 20_000;

/// What is cut in each search: what it is for, and its group. The first is the whole search.
const FORWARD: [(&str, &[&str]); 7] = [
    ("nothing", &[]),
    ("what completes another operator", &["last"]),
    ("threats to the relaxed plan", &["claims"]),
    ("one support of several", &["later"]),
    ("what was tried in a slot", &["notes"]),
    ("a new wave after a dead end", &["returned"]),
    ("operators outside the relaxed plan", &["wide"]),
];
const BACKWARD: [(&str, &[&str]); 5] = [
    ("nothing", &[]),
    ("the veto", &["veto"]),
    ("unmet goals, and what stands in their way", &["helps"]),
    ("preconditions that serve another goal", &["shares"]),
    ("what was tried in a slot", &["notes"]),
];

/// A kind of problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Tangled,
    Chores,
}

/// Kinds of problems with the length of their shortest plans.
const KINDS: [(&str, Kind, usize); 2] =
    [("tangled", Kind::Tangled, 8), ("household", Kind::Chores, 10)];

/// The experiment: each search alone, whole and without one preference, in exact maths.
pub(crate) struct Preferences(Setup);

impl Preferences {
    pub fn new() -> Self {
        let setup = Setup::spiking(0, LIMIT_MS).both();
        Self(Setup { population: Population::Direct, ..setup })
    }
}

impl Experiment for Preferences {
    fn about(&self) -> About {
        let question = "What does each preference of the searches of goal sets and states buy, in exact maths?";
        About { name: "preferences", question, revision: REVISION, settings: self.0.settings() }
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = vec![
            Reading::what(Measure::Rate, "valid plans"),
            Reading::what(Measure::Mean, "length / shortest"),
            Reading::what(Measure::Mean, "planning (ms)"),
            Reading::what(Measure::Mean, "dead ends"),
        ];
        let searches = [(Directions::Forward, &FORWARD[..]), (Directions::Backward, &BACKWARD[..])];
        let mut cells = Vec::new();
        for (direction, cuts) in searches {
            for (problem, ..) in KINDS {
                for (cut, _) in cuts {
                    let settings =
                        json!({"search": direction.name(), "problem": problem, "without": cut});
                    cells.push(Cell::new(settings, 40, readings.clone()));
                }
            }
        }
        cells
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let (directions, cuts) = match cell.is("search", Directions::Forward.name()) {
            true => (Directions::Forward, &FORWARD[..]),
            false => (Directions::Backward, &BACKWARD[..]),
        };
        let ablated = cell.choice("without", cuts)?;
        let kinds = KINDS.map(|(name, kind, length)| (name, (kind, length)));
        let (kind, length) = cell.choice("problem", &kinds)?;
        let rng = &mut seed.derive("", "domain").rng();
        let problem = match kind {
            Kind::Tangled => tangled(length, rng)?,
            Kind::Chores => chores(length, rng)?,
        };
        let problem = shuffled(&problem, seed)?;
        let setup = Setup { directions, ..self.0.clone() };
        let course = setup.pursue(&problem, world(&problem), ablated, seed)?;
        let valid = problem.valid_length(course.plan());
        Ok(outcome([
            number(valid.is_some()),
            valid.map_or(f64::NAN, |n| n as f64 / length as f64),
            begun_at(course.begun.first()),
            course.dead_ends() as f64,
        ]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_preference_can_be_cut() {
        let experiment = Preferences::new();
        let experiment = Preferences(Setup { limit_ms: 20, ..experiment.0 });
        let cells = experiment.cells();
        assert_eq!(cells.len(), 2 * (FORWARD.len() + BACKWARD.len()));
        for cell in &cells {
            // A group that does not exist is an error.
            let done = experiment.trial(cell, Seed::new(1)).expect("a trial");
            assert!(done[0] == 0.0, "{done:?}");
        }
    }
}
