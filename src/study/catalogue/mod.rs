//! The experiments that `symbolt experiment` lists: the paper's tables and figures, and sweeps over noise, network size
//! and parts of the planner.

mod ablation;
mod capacity;
#[cfg(feature = "physics")]
mod clusters;
mod goal_sets;
mod norms;
mod retrieval;
mod stack_planner;
mod structures;
mod tape;
#[cfg(feature = "physics")]
mod thresholds;
mod timing;
mod worlds;

use std::path::PathBuf;

use crate::sim::Seed;
use crate::study::experiment::{Experiment, MAX_TRIALS};
use crate::task::TaskError;

/// Settings that every experiment takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Seed of the data that trials share, such as a pool of poses. It should equal the run's seed.
    pub seed: Seed,
    /// Number of trials of each cell, 1 to [`MAX_TRIALS`]; `None` for the experiment's default. A run takes it
    /// ([`Run::with_trials`](crate::study::experiment::Run::with_trials)).
    pub trials: Option<u64>,
    /// Recording to use in addition to the simulated scene. Only `threshold` uses it.
    pub recording: Option<PathBuf>,
    /// Folder of planning problems in PDDL. Only `ipc` takes it, and needs it.
    pub problems: Option<PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: Seed::new(1), trials: None, recording: None, problems: None }
    }
}

/// Returns the name and the question of every experiment.
pub fn all() -> Vec<(&'static str, &'static str)> {
    // Only a recording or a folder can make an experiment fail, and the default options have none.
    let made = makers().into_iter().filter_map(|make| make(&Options::default()).ok());
    made.map(|e| (e.about().name, e.about().question)).collect()
}

/// The only experiment that uses [`Options::recording`].
pub const TAKES_RECORDING: &str = "threshold";
/// The only experiment that takes [`Options::problems`].
const TAKES_PROBLEMS: &str = "ipc";

type Make = fn(&Options) -> Result<Box<dyn Experiment>, TaskError>;

fn makers() -> Vec<Make> {
    vec![
        |_| Ok(Box::new(norms::Distances)),
        |_| Ok(Box::new(norms::TableSetting)),
        #[cfg(feature = "physics")]
        |_| Ok(Box::new(clusters::Clusters)),
        #[cfg(feature = "physics")]
        |_| Ok(Box::new(clusters::Classification::new())),
        #[cfg(feature = "physics")]
        |o| Ok(Box::new(thresholds::Thresholds::new(o)?)),
        |_| Ok(Box::new(structures::TABLE_4)),
        |_| Ok(Box::new(structures::BEYOND)),
        |_| Ok(Box::new(capacity::Capacity)),
        |_| Ok(Box::new(retrieval::Retrieval)),
        |_| Ok(Box::new(tape::Depths)),
        |_| Ok(Box::new(ablation::Ablation::new())),
        |_| Ok(Box::new(timing::Timing)),
        |_| Ok(Box::new(goal_sets::Kitchens::new())),
        |_| Ok(Box::new(goal_sets::Threats::new())),
        |_| Ok(Box::new(goal_sets::Surprises::new())),
        |_| Ok(Box::new(goal_sets::LongPlans::new())),
        |_| Ok(Box::new(goal_sets::Tangled::new())),
        |_| Ok(Box::new(goal_sets::Preferences::new())),
        |o| Ok(Box::new(goal_sets::Ipc::new(o)?)),
        |_| Ok(Box::new(stack_planner::StackPlans::new())),
        |_| Ok(Box::new(worlds::Worlds::new())),
    ]
}

/// Creates the experiment with this name. If `options` has a recording and the experiment uses it, this function reads
/// the recording and learns from it. Likewise for a folder of problems.
///
/// # Errors
/// [`TaskError::UnknownExperiment`], which lists the experiments; [`TaskError::Setting`] if the number of trials is not
/// 1 to [`MAX_TRIALS`], if the experiment needs a folder of problems and there is none, or if there is one and the
/// experiment takes none; the error of reading the recording or the folder, or of learning from the recording.
pub fn find(name: &str, options: &Options) -> Result<Box<dyn Experiment>, TaskError> {
    if let Some(trials) = options.trials.filter(|n| !(1..=MAX_TRIALS).contains(n)) {
        let value = trials.to_string();
        return Err(TaskError::Setting { name: "trials", value, expected: "1 to 100000" });
    }
    // Search with default options, which is cheap. With a recording, an experiment may read it and learn from it.
    let plain = Options::default();
    let has_name = |make: &Make| make(&plain).is_ok_and(|made| made.about().name == name);
    match makers().into_iter().find(has_name) {
        Some(make) => {
            if let Some(folder) = options.problems.as_deref().filter(|_| name != TAKES_PROBLEMS) {
                let expected = "absent; only the experiment `ipc` takes a folder of problems";
                let value = folder.display().to_string();
                return Err(TaskError::Setting { name: "problems", value, expected });
            }
            let made = make(options)?;
            if made.cells().is_empty() {
                let expected = "a folder of problems in PDDL";
                let value = "not given".into();
                return Err(TaskError::Setting { name: "problems", value, expected });
            }
            Ok(made)
        }
        None => Err(TaskError::UnknownExperiment {
            name: name.into(),
            choices: all().into_iter().map(|(name, _)| name.to_owned()).collect(),
        }),
    }
}
