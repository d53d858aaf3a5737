//! `long-plans`: kettle, tea and toast, and generated households, with shortest plans of 6 to 16 actions.

use serde_json::json;

use super::kitchen::shuffled;
use super::{REVISION, RULES_VALID, Setup, VALID, rates, readings_of_length, trial_of_length};
use crate::sim::Seed;
use crate::study::experiment::{About, Cell, Experiment, Figure, Results, TrialOutcome};
use crate::study::problems::{Breakfast, Kitchen, PlanningProblem, breakfast, chores};
use crate::task::TaskError;

const SLOTS: usize = 48;
const LIMIT_MS: u64 = 10_000;

/// Lengths of the generated problems.
const GENERATED: [usize; 6] = [10, 11, 12, 13, 14, 15];
const HOUSEHOLDS: &str = "generated household";
const PUT_BACK: &str = "kettle put back to plug in";

/// The experiment: long plans.
pub(crate) struct LongPlans(Setup);

impl LongPlans {
    pub fn new() -> Self {
        Self(Setup::spiking(SLOTS, LIMIT_MS))
    }
}

/// Returns the name and the length of every problem.
fn all() -> Vec<(&'static str, usize)> {
    let put_back = Kitchen { put_back: true, ..Kitchen::default() };
    let mut all = vec![(PUT_BACK, put_back.most_actions())];
    all.extend(Breakfast::ALL.map(|(name, wanted)| (name, wanted.shortest())));
    all.extend(GENERATED.map(|length| (HOUSEHOLDS, length)));
    all
}

/// Returns the problem of a cell, with random names and orders.
fn draw(cell: &Cell, shortest: usize, seed: Seed) -> Result<PlanningProblem, TaskError> {
    let problem = if cell.is("problem", HOUSEHOLDS) {
        chores(shortest, &mut seed.derive("", "household").rng())?
    } else if cell.is("problem", PUT_BACK) {
        Kitchen { put_back: true, ..Kitchen::default() }.problem(shortest)?
    } else {
        breakfast(cell.choice("problem", &Breakfast::ALL)?)?
    };
    shuffled(&problem, seed)
}

impl Experiment for LongPlans {
    fn about(&self) -> About {
        let question =
            "How often, how fast and how well does the planner of goal sets plan 6 to 16 actions?";
        let settings = self.0.settings();
        About { name: "long-plans", question, revision: REVISION, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let cell = |(problem, shortest): (&str, usize)| {
            let settings = json!({"problem": problem, "shortest": shortest});
            Cell::new(settings, 50, readings_of_length())
        };
        all().into_iter().map(cell).collect()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let shortest = cell.number("shortest")? as usize;
        let problem = draw(cell, shortest, seed)?;
        trial_of_length(&self.0, &problem, shortest, seed)
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let series = [
            ("generated households", json!({"problem": HOUSEHOLDS, "what": VALID})),
            ("rules without neurons", json!({"problem": HOUSEHOLDS, "what": RULES_VALID})),
        ];
        let series = series.map(|(name, wanted)| (name.to_owned(), wanted));
        let axis = ("shortest", "actions of the shortest plan");
        Some(rates(results, "Valid plans of generated households", axis, series))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neurons::Population;
    use crate::study::problems::Distance;

    #[test]
    fn every_cell_has_the_length_that_it_says_and_its_rules_find_plans() {
        let setup = Setup { population: Population::Direct, ..Setup::spiking(SLOTS, 20) };
        let long = LongPlans(setup);
        assert_eq!(long.cells().len(), 10);
        for cell in long.cells() {
            let shortest = cell.number("shortest").expect("a number") as usize;
            let made = draw(&cell, shortest, Seed::new(4)).expect("a problem");
            assert_eq!(made.distance(200_000), Distance::Steps(shortest), "{cell}");
            // In 20 ms nothing is planned, and the rules without neurons take no simulated time.
            let done = long.trial(&cell, Seed::new(4)).expect("a trial");
            assert_eq!((done[0], done[6]), (0.0, 1.0), "{cell}");
            assert!(done[1].is_nan() && done[7] >= 1.0 && done[7] < 3.0, "{cell}: {done:?}");
        }
    }
}
