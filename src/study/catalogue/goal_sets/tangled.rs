//! `tangled`: random domains by the length of the shortest plan.

use serde_json::json;

use super::kitchen::shuffled;
use super::{REVISION, RULES_VALID, Setup, VALID, rates, readings_of_length, trial_of_length};
use crate::sim::Seed;
use crate::study::experiment::{About, Cell, Experiment, Figure, Results, TrialOutcome};
use crate::study::problems::tangled;
use crate::task::TaskError;

const SLOTS: usize = 100;
const LIMIT_MS: u64 = 20_000;
/// Lengths of shortest plans.
const LENGTHS: [usize; 7] = [5, 6, 7, 8, 10, 12, 15];

/// The experiment: random domains.
pub(crate) struct Tangled(Setup);

impl Tangled {
    pub fn new() -> Self {
        Self(Setup::spiking(SLOTS, LIMIT_MS).both())
    }
}

impl Experiment for Tangled {
    fn about(&self) -> About {
        let question = "How often does the planner of goal sets solve random domains, by the length of the shortest plan?";
        let settings = self.0.settings();
        About { name: "tangled", question, revision: REVISION, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let cell =
            |shortest: usize| Cell::new(json!({"shortest": shortest}), 50, readings_of_length());
        LENGTHS.map(cell).into()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let shortest = cell.number("shortest")? as usize;
        let problem = tangled(shortest, &mut seed.derive("", "domain").rng())?;
        let problem = shuffled(&problem, seed)?;
        trial_of_length(&self.0, &problem, shortest, seed)
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let series = [("planner of goal sets", VALID), ("rules without neurons", RULES_VALID)];
        let series = series.map(|(name, what)| (name.to_owned(), json!({"what": what})));
        let axis = ("shortest", "actions of the shortest plan");
        Some(rates(results, "Valid plans in random domains", axis, series))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neurons::Population;

    #[test]
    fn rules_and_functions_solve_short_ones() {
        let setup =
            Setup { population: Population::Direct, ..Setup::spiking(SLOTS, LIMIT_MS).both() };
        let experiment = Tangled(setup);
        let cells = experiment.cells();
        let (mut planner, mut rules) = (0.0, 0.0);
        for seed in 0..6 {
            let done = experiment.trial(&cells[0], Seed::new(seed)).expect("a trial");
            assert!(done[1].is_nan() || done[1] >= 1.0, "{done:?}");
            planner += done[0];
            rules += done[6];
        }
        assert!(planner >= 4.0 && rules >= 4.0, "{planner} {rules} of 6");
    }
}
