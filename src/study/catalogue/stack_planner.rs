//! `stack-planner`: the planner of 2016, rebuilt, in its kitchen and in longer chains of actions.

use serde_json::json;

use crate::neurons::{LifSpec, Population};
use crate::sim::Seed;
use crate::study::experiment::{About, Cell, Experiment, Measure, Reading, TrialOutcome, outcome};
use crate::study::stack_planner::{Kitchen, StackPlanner, StackSpec};
use crate::task::TaskError;

/// Makes a kitchen with a number of actions.
type Make = fn(usize) -> Result<Kitchen, TaskError>;

/// The kitchens, with the numbers of actions that are tried.
const KITCHENS: [(&str, Make, &[usize]); 2] =
    [("kettle", Kitchen::kettle, &[2, 3, 4, 5]), ("chain", Kitchen::chain, &[2, 3, 4, 5, 6, 7, 8])];

/// The experiment: success, time and straying of the rebuilt planner.
pub(super) struct StackPlans {
    spec: StackSpec,
}

impl StackPlans {
    pub fn new() -> Self {
        let population = Population::Lif(LifSpec::default());
        let spec = StackSpec { population, ..StackSpec::default() };
        Self { spec }
    }
}

impl Experiment for StackPlans {
    fn about(&self) -> About {
        let question = "How often and how fast does the rebuilt planner of 2016 reach its goal, and how long are the plans that it can hold?";
        let limit_ms = self.spec.limit.as_micros() / 1000;
        let settings = json!({"dimensions": self.spec.dimensions, "limit_ms": limit_ms});
        About { name: "stack-planner", question, revision: 2, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = || {
            vec![
                Reading::what(Measure::Rate, "goal reached"),
                Reading::what(Measure::Rate, "whole plan on the stack when acting begins"),
                Reading::what(Measure::Mean, "its actions on the stack, from the top"),
                Reading::what(Measure::Mean, "its actions done before it acts on another plan"),
                Reading::what(Measure::Mean, "last action (ms), if reached"),
                Reading::what(Measure::Rate, "exactly the shortest plan, if reached"),
                Reading::what(Measure::Mean, "episodes, if reached"),
            ]
        };
        let cells = KITCHENS.iter().flat_map(|(kitchen, _, actions)| {
            actions.iter().map(move |actions| json!({"kitchen": kitchen, "actions": actions}))
        });
        cells.map(|settings| Cell::new(settings, 50, readings())).collect()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let make = cell.choice("kitchen", &KITCHENS.map(|(name, make, _)| (name, make)))?;
        let kitchen = make(cell.number("actions")? as usize)?;
        let course = StackPlanner::new(&kitchen, &self.spec, seed)?.run()?;
        let whole = if course.stacked == kitchen.steps() { 1.0 } else { 0.0 };
        let plan = [whole, course.stacked as f64, course.first as f64];
        let Some(last) = course.begun.last().filter(|_| course.reached) else {
            return Ok(outcome([0.0, plan[0], plan[1], plan[2]]));
        };
        let exact = if course.begun.len() == kitchen.steps() { 1.0 } else { 0.0 };
        let course = [last.ms as f64, exact, course.episodes as f64];
        Ok(outcome([1.0, plan[0], plan[1], plan[2], course[0], course[1], course[2]]))
    }
}
