//! `ipc`: problems in a folder of PDDL files.

use std::path::PathBuf;

use serde_json::json;

use super::{Options, REVISION, Setup, begun_at, by_rules, number, unmet, world};
use crate::sim::Seed;
use crate::study::experiment::{About, Cell, Experiment, Measure, Reading, TrialOutcome, outcome};
use crate::study::problems::{ProblemFiles, problems_in};
use crate::task::TaskError;

const SLOTS: usize = 64;
const LIMIT_MS: u64 = 10_000;

/// The experiment: one cell for each problem of a folder.
pub(crate) struct Ipc {
    setup: Setup,
    folder: Option<PathBuf>,
    problems: Vec<ProblemFiles>,
}

impl Ipc {
    /// Prepares the experiment. Reads the folder, if there is one.
    pub fn new(options: &Options) -> Result<Self, TaskError> {
        Ok(Self {
            setup: Setup::spiking(SLOTS, LIMIT_MS).both(),
            problems: options.problems.as_deref().map_or(Ok(Vec::new()), problems_in)?,
            folder: options.problems.clone(),
        })
    }
}

impl Experiment for Ipc {
    fn about(&self) -> About {
        let question = "How often does the planner of goal sets solve each problem in a folder of PDDL files (--problems)?";
        let mut settings = self.setup.settings();
        let folder = self.folder.as_deref().and_then(|path| path.file_name());
        settings["problems"] = json!(folder.map(|name| name.to_string_lossy()));
        let of = |p: &ProblemFiles| format!("{} {} {:016x}", p.group, p.name, p.fingerprint);
        settings["files"] = self.problems.iter().map(of).collect();
        About { name: "ipc", question, revision: REVISION, settings }
    }

    fn cells(&self) -> Vec<Cell> {
        let readings = || {
            vec![
                Reading::what(Measure::Rate, "valid in time"),
                Reading::what(Measure::Mean, "actions"),
                Reading::what(Measure::Mean, "planning (ms)"),
                Reading::what(Measure::Rate, "too large or unreachable"),
                Reading::what(Measure::Share(5), "begun with an unmet precondition"),
                Reading::count(),
                Reading::what(Measure::Rate, "valid, rules without neurons"),
                Reading::what(Measure::Mean, "actions, rules without neurons"),
            ]
        };
        let cell = |p: &ProblemFiles| {
            let settings = json!({"domain": p.group, "problem": p.name});
            Cell::new(settings, 3, readings())
        };
        self.problems.iter().map(cell).collect()
    }

    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError> {
        let own = self.problems.iter().filter(|p| cell.is("domain", &p.group));
        let choices: Vec<(&str, &ProblemFiles)> = own.map(|p| (p.name.as_str(), p)).collect();
        let files = cell.choice("problem", &choices)?;
        let nan = f64::NAN;
        // A problem that the planner refuses is not solved.
        let refused = outcome([0.0, nan, nan, 1.0, 0.0, 0.0, 0.0, nan]);
        let problem = match files.grounded() {
            Err(TaskError::Problem { .. }) => return Ok(refused),
            problem => problem?,
        };
        let course = match self.setup.pursue(&problem, world(&problem), &[], seed) {
            Err(TaskError::Problem { .. }) => return Ok(refused),
            course => course?,
        };
        let length = problem.valid_length(course.plan());
        let rules = by_rules(&problem, self.setup.slots, &mut seed.derive("", "rules").rng());
        let actions = |length: Option<usize>| length.map_or(nan, |n| n as f64);
        let [unmet, begun] = unmet(&course);
        Ok(outcome([
            number(length.is_some()),
            actions(length),
            begun_at(course.begun.first()),
            0.0,
            unmet,
            begun,
            number(rules.is_some()),
            actions(rules),
        ]))
    }
}
