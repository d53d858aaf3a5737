//! `threats`: problems in which some order of the actions is wrong, with the veto and without it.

use serde_json::json;

use super::blind::at_random;
use super::kitchen::{LIMIT_MS, REACHED, SLOTS, outcome_of, readings, settings, shuffled};
use super::{REVISION, Setup, number, rates, world};
use crate::sim::Seed;
use crate::study::experiment::{
    About, Cell, Experiment, Figure, Measure, Reading, Results, TrialOutcome,
};
use crate::study::problems::{Kitchen, PlanningProblem, packing};
use crate::task::TaskError;

/// A kind of problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Kitchen(Kitchen),
    Packing,
}

const PLAIN: Kitchen = Kitchen { put_back: false, one_fuse: false };
const FUSED: Kitchen = Kitchen { put_back: false, one_fuse: true };
const FUSED_PUT_BACK: Kitchen = Kitchen { put_back: true, one_fuse: true };

/// Kinds of problems with their numbers of actions. In the kitchen of 2016 a wrong order can be made good; in the others it
/// cannot.
const KINDS: [(&str, Kind, &[u32]); 4] = [
    ("kitchen", Kind::Kitchen(PLAIN), &[4, 5]),
    ("kitchen with one fuse", Kind::Kitchen(FUSED), &[4, 5]),
    ("kitchen with one fuse, kettle put back", Kind::Kitchen(FUSED_PUT_BACK), &[5, 6]),
    ("packing", Kind::Packing, &[3, 4, 5]),
];
const CUT: [(&str, &[&str]); 2] = [("whole", &[]), ("without veto", &["veto"])];

/// The experiment: all problems with random names and orders, by the whole planner, without the veto, and by chance.
pub(crate) struct Threats(Setup);

impl Threats {
    pub fn new() -> Self {
        Self(Setup::spiking(SLOTS, LIMIT_MS))
    }
}

fn draw(kind: Kind, actions: usize, seed: Seed) -> Result<PlanningProblem, TaskError> {
    let problem = match kind {
        Kind::Kitchen(kitchen) => kitchen.problem(actions)?,
        Kind::Packing => packing(actions, &mut seed.derive("", "packing").rng())?,
    };
    shuffled(&problem, seed)
}

impl Experiment for Threats {
    fn about(&self) -> About {
        let question = "How often does the planner of goal sets find the right order, with the veto on threatened goals and without it?";
        let settings = settings(&self.0);
        About { name: "threats", question, revision: REVISION, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let mut readings = readings();
        // Instead of the time of the first action.
        readings[7] = Reading::what(Measure::Rate, "valid, operators chosen at random");
        let mut cells = Vec::new();
        for (problem, _, lengths) in KINDS {
            for actions in lengths {
                for (planner, _) in CUT {
                    let settings =
                        json!({"problem": problem, "actions": actions, "planner": planner});
                    cells.push(Cell::new(settings, 50, readings.clone()));
                }
            }
        }
        cells
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let kind = cell.choice("problem", &KINDS.map(|(name, kind, _)| (name, kind)))?;
        let ablated = cell.choice("planner", &CUT)?;
        let actions = cell.number("actions")? as usize;
        let problem = draw(kind, actions, seed)?;
        let course = self.0.pursue(&problem, world(&problem), ablated, seed)?;
        let mut outcome = outcome_of(&course, actions);
        let chance = at_random(&problem, &mut seed.derive("", "chance").rng());
        outcome[7] = number(chance.is_some());
        Ok(outcome)
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let series = KINDS.into_iter().flat_map(|(problem, ..)| {
            CUT.map(|(planner, _)| {
                let wanted = json!({"problem": problem, "planner": planner, "what": REACHED});
                (format!("{problem}, {planner}"), wanted)
            })
        });
        Some(rates(results, "Goals reached", ("actions", "actions"), series))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    #[test]
    fn without_the_veto_a_wrong_order_is_fatal_where_it_cannot_be_made_good() {
        let threats = Threats(Setup::spiking(SLOTS, 2_500));
        let cells = threats.cells();
        assert_eq!(cells.len(), 18);
        let reached = |problem: &str, actions: u32, planner: &str| -> f64 {
            let wanted = [("problem", json!(problem)), ("actions", json!(actions))];
            let own = |cell: &&Cell| {
                let has = |(key, value): &(&str, Value)| cell.settings.get(*key) == Some(value);
                wanted.iter().all(has) && cell.is("planner", planner)
            };
            let cell = cells.iter().find(own).expect("a cell");
            let trial = |seed| threats.trial(cell, Seed::new(seed)).expect("a trial")[0];
            (0..4).map(trial).sum()
        };
        // Measured with twenty runs each: 20 and 3.
        let fuse = "kitchen with one fuse, kettle put back";
        assert_eq!(reached(fuse, 6, "whole"), 4.0);
        assert!(reached(fuse, 6, "without veto") <= 2.0);
        assert_eq!(reached("packing", 4, "whole"), 4.0);
        assert!(reached("packing", 4, "without veto") <= 2.0);
    }
}
