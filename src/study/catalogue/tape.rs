//! `tape`: plans of several depths, written to a tape or a shift stack and read back whole.

use serde_json::json;

use crate::sim::Seed;
use crate::study::experiment::{
    About, Axis, Cell, Experiment, Figure, Measure, Reading, Results, Row, Series, Style,
    TrialOutcome, outcome,
};
use crate::study::tape::{
    HELD_PER_DIMENSION, PER_PRODUCT, TapeSpec, exact_stack, exact_tape, exact_together,
    populations, run_tape,
};
use crate::task::TaskError;

/// The experiment.
pub(super) struct Depths;

/// Where a plan is written.
#[derive(Clone, Copy)]
enum Method {
    Stack,
    Tape,
    Together,
    Spikes,
}

const METHODS: [(&str, Method); 4] = [
    ("shift stack", Method::Stack),
    ("tape", Method::Tape),
    ("tape, read together", Method::Together),
    ("tape in spikes, read together", Method::Spikes),
];
const DEPTHS: [usize; 5] = [5, 7, 10, 15, 20];
/// Dimensions and actions.
const SIZES: [(usize, usize); 2] = [(256, 20), (512, 200)];

impl Experiment for Depths {
    fn about(&self) -> About {
        let question =
            "How often is a whole plan read back from a tape, and from a stack that shifts?";
        let settings = json!({
            "noise": TapeSpec::default().noise,
            "neurons_per_dimension_of_the_tape": HELD_PER_DIMENSION,
            "neurons_per_product": PER_PRODUCT,
        });
        About { name: "tape", question, revision: 1, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let mut cells = Vec::new();
        for (name, how) in METHODS {
            for (dimensions, actions) in SIZES {
                for depth in DEPTHS {
                    // A network takes some 10 s for each plan.
                    if matches!(how, Method::Spikes) && (dimensions, depth) != (512, 15) {
                        continue;
                    }
                    let settings = json!({
                        "method": name, "dimensions": dimensions, "actions": actions, "depth": depth,
                    });
                    let readings = vec![
                        Reading::what(Measure::Rate, "whole plans"),
                        Reading::what(Measure::Mean, "actions read right"),
                    ];
                    cells.push(Cell::new(settings, 100, readings));
                }
            }
        }
        cells
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let whole = |setting| Ok::<_, TaskError>(cell.number(setting)? as usize);
        let spec = TapeSpec {
            dimensions: whole("dimensions")?,
            actions: whole("actions")?,
            depth: whole("depth")?,
            ..TapeSpec::default()
        };
        let right = match cell.choice("method", &METHODS)? {
            Method::Stack => exact_stack(&spec, seed)?,
            Method::Tape => exact_tape(&spec, seed)?,
            Method::Together => exact_together(&spec, seed)?,
            Method::Spikes => run_tape(&spec, &populations()?, seed)?.right,
        };
        let all = if right == spec.depth { 1.0 } else { 0.0 };
        Ok(outcome([all, right as f64]))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let mut series = Vec::new();
        for (colour, (dimensions, actions)) in SIZES.into_iter().enumerate() {
            for ((name, _), style) in
                METHODS.into_iter().zip([Style::Dashed, Style::Dotted, Style::Line, Style::Rings])
            {
                let wanted =
                    json!({"method": name, "dimensions": dimensions, "what": "whole plans"});
                let mark = |row: &Row| Some(row.percent(row.number("depth")?));
                let marks = results.marks(&wanted, mark);
                let name = format!("{name}, D = {dimensions}, {actions} actions");
                series.push(Series { colour: Some(colour), ..Series::new(name, marks, style) });
            }
        }
        Some(Figure {
            title: "Plans that are read back whole".into(),
            x: Axis::new("actions of the plan"),
            y: Axis::from_to("whole plans (%)", 0.0, 102.0),
            series,
        })
    }
}
