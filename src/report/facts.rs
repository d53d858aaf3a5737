//! `run.json`: the settings and results of a run, without anything that differs between machines.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::robot::scene::SceneSpec;
use crate::sim::Seed;
use crate::task::TaskError;
use crate::task::execute::ActivityRecorder;
use crate::task::planner::Shows;
use crate::task::tasks::file::DataTask;
use crate::task::tasks::{self, Task};

/// Settings and results of a run, written as `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunFacts {
    /// Name of the format, `symbolt-run`.
    pub format: String,
    /// Version of the format, 1.
    pub version: u64,
    /// Version of the program.
    pub symbolt: String,
    /// Command line that writes the same files.
    pub command: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Goal state of the episodes.
    pub goal: String,
    /// Mode of the graph's layers: `direct`, `rate` or `lif`.
    pub mode: String,
    /// Settings of the planner by name.
    pub planner: Value,
    /// Name of the task. Older files have no name and belong to the default task.
    #[serde(default = "default_task")]
    pub task: String,
    /// Settings of the task in the episodes.
    pub scene: Value,
    /// Seed from which the scene of the recorded episode was drawn.
    #[serde(default)]
    pub scene_seed: u64,
    /// Episode that `arrays.npz` and `scene.json` show, counted from 0.
    #[serde(default, rename = "filmed")]
    pub recorded: usize,
    /// Other episodes whose frames are in `arrays.npz`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub also_filmed: Vec<Filmed>,
    /// Results of the run, as printed by `--json`.
    pub summary: Map<String, Value>,
    /// Modules whose activity is in `arrays.npz`.
    pub modules: Vec<ModuleFacts>,
    /// Populations whose spikes are in `arrays.npz`, in the order of their rows.
    pub populations: Vec<PopulationFacts>,
}

/// An episode whose frames are in `arrays.npz`, beside the recorded one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Filmed {
    /// Number of the episode, counted from 0.
    pub episode: usize,
    /// Seed from which its scene was drawn.
    pub scene_seed: u64,
}

/// A module and the columns of its array.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModuleFacts {
    /// Name of the module. The name of its array is `module_` followed by this name.
    pub name: String,
    /// Names of the columns.
    pub names: Vec<String>,
    /// Kind of the values: `similarities` (cosines) or `activities`.
    pub shows: String,
}

/// A population whose spikes are rows of the raster.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PopulationFacts {
    /// Path of the layer.
    pub path: String,
    /// Number of its neurons that have a row.
    pub rows: usize,
    /// Number of its neurons.
    pub neurons: usize,
}

fn default_task() -> String {
    tasks::default().name().into()
}

impl RunFacts {
    /// Returns the task with the settings of the run.
    ///
    /// # Errors
    /// [`TaskError::UnknownTask`] if no task has the name; [`TaskError::Input`] for settings that cannot be used.
    pub fn own_task(&self) -> Result<Arc<dyn Task>, TaskError> {
        let settings = self.scene.to_string();
        // The settings of a task file are the whole file, so a task that the program does not have can be drawn, too.
        let is_file = self.scene.get("format").is_some_and(|format| format == tasks::file::FORMAT);
        Ok(match is_file {
            true => Arc::new(DataTask::parse(settings.as_bytes(), "run.json")?),
            false => tasks::by_name(&self.task)?.with_settings(settings.as_bytes(), "run.json")?,
        })
    }

    /// Draws the scene of an episode again from its seed.
    ///
    /// # Errors
    /// As [`RunFacts::own_task`]; [`TaskError::Setting`] or [`TaskError::Range`] if the settings make no valid scene.
    pub fn draw_scene(&self, seed: u64) -> Result<SceneSpec, TaskError> {
        let scene = self.own_task()?.scene(Seed::new(seed))?;
        scene.check()?;
        Ok(scene)
    }

    /// Name and version of the format.
    pub const FORMAT: (&'static str, u64) = ("symbolt-run", 1);

    /// Describes the modules and populations of recorded activity.
    pub fn of_activity(activity: &ActivityRecorder) -> (Vec<ModuleFacts>, Vec<PopulationFacts>) {
        let modules = activity.modules().iter().map(|module| ModuleFacts {
            name: module.name.clone(),
            names: module.names.clone(),
            shows: match module.shows {
                Shows::Similarities => "similarities".into(),
                Shows::Activities => "activities".into(),
            },
        });
        let populations = activity.populations().map(|(path, rows, neurons)| PopulationFacts {
            path: path.into(),
            rows,
            neurons,
        });
        (modules.collect(), populations.collect())
    }
}
