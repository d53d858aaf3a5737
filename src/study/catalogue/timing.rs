//! `timing`: the simulated time of decisions and whole plans.

use serde_json::json;

use super::ablation::{GOAL, TABLE, lif};
use crate::neurons::{Population, PopulationPlan};
use crate::sim::Seed;
use crate::study::experiment::{
    About, Axis, Cell, Experiment, Figure, Mark, Measure, Reading, Results, Row, Series, Style,
    TrialOutcome, outcome,
};
use crate::task::TaskError;
use crate::task::planner::{PlanEnd, Planner, PlannerSpec};
use crate::task::propositional::DomainBuilder;

/// The experiment: decisions and whole plans, in direct mode and in spiking neurons.
pub(super) struct Timing;

const MODES: [&str; 2] = ["direct", "lif"];

impl Experiment for Timing {
    fn about(&self) -> About {
        let question = "How many simulated ms do a decision and a plan of three steps take?";
        let settings = json!({"goal": GOAL});
        About { name: "timing", question, revision: 2, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = || {
            vec![
                Reading::what(Measure::Mean, "first decision (ms)"),
                Reading::what(Measure::Mean, "second decision (ms)"),
                Reading::what(Measure::Mean, "third decision (ms)"),
                Reading::what(Measure::Mean, "whole plan (ms)"),
                Reading::what(Measure::Rate, "three steps to the goal"),
            ]
        };
        MODES.map(|mode| Cell::new(json!({"mode": mode}), 40, readings())).into()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let domain = DomainBuilder::of_the_paper().build()?;
        let plan =
            PopulationPlan::all(if cell.is("mode", "lif") { lif() } else { Population::Direct });
        let planner = Planner::with_plan(&domain, PlannerSpec::default(), &plan, seed)?;
        let rolled = planner.plan(&domain.counts(TABLE)?, domain.state(GOAL)?)?;
        let [first, second, third] = std::array::from_fn(|step| {
            rolled.steps.get(step).map_or(f64::NAN, |step| step.decision.time_ms)
        });
        let all: f64 = rolled.steps.iter().map(|step| step.decision.time_ms).sum();
        let complete = rolled.steps.len() == 3 && rolled.end == PlanEnd::Met;
        Ok(outcome([first, second, third, all, if complete { 1.0 } else { 0.0 }]))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        // The first row of the table is at the top.
        let timed = || results.rows.iter().rev().filter(|row| row.statistic.quantiles().is_some());
        let name = |row: &Row| {
            format!("{}, {}", row.text("what").trim_end_matches(" (ms)"), row.text("mode"))
        };
        let mark = |(at, row): (usize, &Row)| row.median(at as f64, |ms| ms).map(Mark::across);
        let marks = timed().enumerate().filter_map(mark);
        let marks = marks.collect();
        Some(Figure {
            title: "Simulated time to an answer (median, 5 to 95% of the seeds)".into(),
            x: Axis::new("simulated ms"),
            y: Axis::named(timed().map(name).collect()),
            series: vec![Series::new("", marks, Style::Points)],
        })
    }
}
