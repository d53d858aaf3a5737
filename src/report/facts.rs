//! `run.json`: what a run was asked for and what came of it, without anything that differs between machines.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::sim::Seed;
use crate::task::TaskError;
use crate::task::execute::ActivityRecorder;
use crate::task::planner::Shows;
use crate::task::scene::SceneSpec;
use crate::task::tasks;

/// What a run was and what came of it. Written as `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunFacts {
    /// `symbolt-run`.
    pub format: String,
    /// 1.
    pub version: u64,
    /// The program's version.
    pub symbolt: String,
    /// A command line that gives the same files.
    pub command: String,
    /// Where all randomness came from.
    pub seed: u64,
    /// The state that the episodes were to bring about.
    pub goal: String,
    /// How the graph's layers were computed.
    pub mode: String,
    /// The planner's settings by name.
    pub planner: Value,
    /// The task's name; a run of before there were others is of the default one.
    #[serde(default = "default_task")]
    pub task: String,
    /// The task's settings in the episodes.
    pub scene: Value,
    /// What the recorded episode's scene was drawn from.
    #[serde(default)]
    pub scene_seed: u64,
    /// The episode that `arrays.npz` and `scene.json` are of, counted from 0.
    #[serde(default, rename = "filmed")]
    pub recorded: usize,
    /// The run's figures, as `--json` gives them.
    pub summary: Map<String, Value>,
    /// What stands in the arrays of modules.
    pub modules: Vec<ModuleFacts>,
    /// What stands in the array of spikes.
    pub populations: Vec<PopulationFacts>,
}

/// What the columns of a module's array are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModuleFacts {
    /// The module; its array is `module_` and this name.
    pub name: String,
    /// A name a column.
    pub names: Vec<String>,
    /// `similarities` (cosines) or `activities`.
    pub shows: String,
}

/// Whose spikes rows of the raster are, in their order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PopulationFacts {
    /// The layer's path.
    pub path: String,
    /// How many of its neurons have a row.
    pub rows: usize,
    /// How many neurons it has.
    pub neurons: usize,
}

fn default_task() -> String {
    tasks::default().name().into()
}

impl RunFacts {
    /// The scene of the recorded episode, drawn anew.
    ///
    /// # Errors
    /// [`TaskError::UnknownTask`]; [`TaskError::Input`], [`TaskError::Setting`] or [`TaskError::Range`] for settings that
    /// make no scene.
    pub fn draw_scene(&self) -> Result<SceneSpec, TaskError> {
        let task = tasks::by_name(&self.task)?;
        let task = task.with_settings(self.scene.to_string().as_bytes(), "run.json")?;
        let scene = task.scene(Seed::new(self.scene_seed))?;
        scene.check().map(|()| scene)
    }

    /// The format's name and version.
    pub const FORMAT: (&'static str, u64) = ("symbolt-run", 1);

    /// What the arrays of recorded activity are.
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
