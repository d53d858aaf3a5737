//! `timing`: the simulated time of decisions and whole plans.

use serde_json::{Value, json};

use super::Options;
use super::ablation::{GOAL, TABLE, lif};
use crate::neurons::{Population, PopulationPlan};
use crate::sim::Seed;
use crate::study::experiment::{
    Axis, Cell, Experiment, Figure, Mark, Measure, Reading, Results, Row, Series, Style,
    TrialOutcome, outcome,
};
use crate::task::TaskError;
use crate::task::domain::DomainBuilder;
use crate::task::planner::{PlanEnd, Planner, PlannerSpec};

/// The experiment: decisions and whole plans, in direct mode and in spiking neurons.
pub(super) struct Timing {
    trials: u64,
}

const MODES: [&str; 2] = ["direct", "lif"];

impl Timing {
    pub fn new(options: &Options) -> Self {
        Self { trials: options.trials.unwrap_or(40) }
    }
}

impl Experiment for Timing {
    fn name(&self) -> &'static str {
        "timing"
    }

    fn question(&self) -> &'static str {
        "How many simulated ms do a decision and a plan of three steps take?"
    }

    fn settings(&self) -> Value {
        json!({"goal": GOAL})
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = || {
            vec![
                Reading::new(Measure::Mean, json!({"what": "first decision (ms)"})),
                Reading::new(Measure::Mean, json!({"what": "second decision (ms)"})),
                Reading::new(Measure::Mean, json!({"what": "third decision (ms)"})),
                Reading::new(Measure::Mean, json!({"what": "whole plan (ms)"})),
                Reading::new(Measure::Rate, json!({"what": "three steps to the goal"})),
            ]
        };
        MODES.map(|mode| Cell::new(json!({"mode": mode}), self.trials, readings())).into()
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

    fn revision(&self) -> u32 {
        2
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        // The first row of the table is at the top.
        let timed = || results.rows.iter().rev().filter(|row| row.statistic.quantiles().is_some());
        let name = |row: &Row| {
            let text = |key| row.settings.get(key)?.as_str();
            Some(format!("{}, {}", text("what")?.trim_end_matches(" (ms)"), text("mode")?))
        };
        let marks = timed().enumerate().filter_map(|(at, row)| {
            let [low, middle, high] = row.statistic.quantiles()?;
            Some(Mark { x: middle, y: at as f64, bar: Some([low, high]) })
        });
        let (marks, name_of) = (marks.collect(), timed().map(name));
        Some(Figure {
            title: "Simulated time to an answer (median, 5 to 95% of the seeds)".into(),
            x: Axis::new("simulated ms"),
            y: Axis::named(name_of.collect::<Option<_>>()?),
            series: vec![Series::new("", marks, Style::Points)],
        })
    }
}
