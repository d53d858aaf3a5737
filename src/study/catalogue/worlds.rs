//! `worlds`: kinematic tasks with known truth, plain ones and varied ones, learned from demonstrations and carried out.
//!
//! A trial demonstrates a task, learns it, and carries it out in one test scene. The episodes of most cells are planned by the
//! symbolic planner, which is no part of the learner: they tell whether the learned states and actions suffice. The cells of
//! `goal-sets` are planned by the network, in direct mode.

use serde_json::json;

use crate::sim::Seed;
use crate::study::experiment::{
    About, Axis, Cell, Experiment, Figure, Measure, Reading, Results, Row, Series, Style,
    TrialOutcome,
};
use crate::study::worlds::{self, Planning, Trial, World, evaluate};
use crate::task::TaskError;
use crate::task::recording::Sensing;

/// The experiment.
pub(super) struct Worlds {
    worlds: Vec<World>,
}

impl Worlds {
    pub fn new() -> Self {
        Self { worlds: worlds::all() }
    }
}

/// Errors of all poses by name: standard deviations in metres and degrees, and the share of objects that are missing.
const NOISES: [(&str, [f64; 3]); 4] = [
    ("none", [0.0; 3]),
    ("1 mm, 1 degree", [1e-3, 1.0, 0.0]),
    ("2 mm, 2 degrees", [2e-3, 2.0, 0.0]),
    ("5% missing", [0.0, 0.0, 0.05]),
];

/// Planner, number of demonstrations and noise of the cells of a world.
const SETTINGS: [(&str, usize, &str); 11] = [
    ("symbolic", 3, NOISES[0].0),
    ("symbolic", 5, NOISES[0].0),
    ("symbolic", 10, NOISES[0].0),
    ("symbolic", 3, NOISES[1].0),
    ("symbolic", 5, NOISES[1].0),
    ("symbolic", 10, NOISES[1].0),
    ("symbolic", 3, NOISES[2].0),
    ("symbolic", 5, NOISES[2].0),
    ("symbolic", 10, NOISES[2].0),
    ("symbolic", 5, NOISES[3].0),
    ("goal-sets", 5, NOISES[0].0),
];

/// The settings that the figure shows.
const SHOWN: [usize; 4] = [1, 2, 5, 10];

/// The settings of the world `bins`, where a learner needs hundreds of demonstrations to tell heaps of any height apart.
const BINS: [(&str, usize, &str); 1] = [("symbolic", 300, NOISES[0].0)];

const DONE: &str = "done and recognised";

impl Experiment for Worlds {
    fn about(&self) -> About {
        let question = "How often is a task with known truth learned and carried out, planned by the symbolic planner or by that of goal sets, and is what was learned true?";
        let settings = json!({"moves": worlds::MOST_MOVES, "mode_of_goal-sets": "direct"});
        About { name: "worlds", question, revision: 2, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = |world: &World| {
            let mut readings = vec![
                Reading::what(Measure::Rate, DONE),
                Reading::what(Measure::Share(2), "poses whose state is right"),
                Reading::count(),
                Reading::what(Measure::Share(4), "required conditions that are true"),
                Reading::count(),
                Reading::what(Measure::Mean, "poses with the wrong reference object"),
                Reading::what(Measure::Rate, "goal reached"),
                Reading::what(Measure::Rate, "false goals"),
            ];
            if world.demands() {
                readings.extend([
                    Reading::what(Measure::Share(9), "conditions found"),
                    Reading::count(),
                ]);
            }
            readings
        };
        let mut cells = Vec::new();
        for world in &self.worlds {
            let own = if world.name() == "bins" { &BINS[..] } else { &SETTINGS };
            for (planner, demos, noise) in own {
                let settings = json!({
                    "world": world.name(), "planner": planner, "demonstrations": demos, "noise": noise,
                });
                cells.push(Cell::new(settings, 20, readings(world)));
            }
        }
        cells
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let choices: Vec<_> = self.worlds.iter().map(|world| (world.name(), world)).collect();
        let world = cell.choice("world", &choices)?;
        let [pose_noise_m, pose_noise_deg, missing_rate] = cell.choice("noise", &NOISES)?;
        let trial = Trial {
            demos: cell.number("demonstrations")? as usize,
            episodes: 1,
            planner: cell.choice("planner", &Planning::ALL)?,
            sensing: Sensing { pose_noise_m, pose_noise_deg, missing_rate, ..Sensing::default() },
            seed,
        };
        let found = evaluate(world, &trial)?;
        let (poses, needs) = (found.states.poses, found.needs);
        let counts = [
            found.done(),
            poses.found,
            poses.due,
            needs.right,
            needs.said,
            found.states.wrong_references,
            found.solved(),
            found.false_goals(),
            needs.found,
            needs.due,
        ];
        Ok(counts.map(|count| count as f64))
    }

    fn figure(&self, results: &Results) -> Option<Figure> {
        let few = self.worlds.iter().rev().filter(|world| world.name() != "bins");
        let names: Vec<String> = few.map(|world| world.name().to_owned()).collect();
        let series = SHOWN.map(|at| SETTINGS[at]).into_iter().enumerate().map(
            |(at, (planner, demos, noise))| {
                let wanted = json!({
                    "planner": planner, "demonstrations": demos, "noise": noise, "what": DONE,
                });
                let shift = 0.2 * (1.5 - at as f64);
                let at = |row: &Row| names.iter().position(|name| row.is("world", &json!(name)));
                let mark = |row: &Row| Some(row.percent(at(row)? as f64 + shift).across());
                let marks = results.marks(&wanted, mark);
                let name = format!("{planner}, {demos} demonstrations, noise {noise}");
                Series::new(name, marks, Style::Points)
            },
        );
        let series = series.collect();
        Some(Figure {
            title: "Test scenes done, with 95% intervals".into(),
            x: Axis::from_to("done and recognised (%)", 0.0, 102.0),
            y: Axis::named(names),
            series,
        })
    }
}
