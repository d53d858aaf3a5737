//! `run.json`: the settings and results of a run, without anything that differs between machines.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::robot::scene::SceneSpec;
use crate::sim::{Note, Seed};
use crate::task::compile::GroundProblem;
use crate::task::domain::RelationalDomain;
use crate::task::execute::ActivityRecorder;
use crate::task::planner::{PlannerKind, PlannerSpec, Shows, Unbinding};
use crate::task::tasks::file::DataTask;
use crate::task::tasks::{self, Task};
use crate::task::{Commitment, TaskError};

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
    /// The goal in words.
    #[serde(default)]
    pub goal_words: String,
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
    /// What the populations and the modules around them are called for people, by path. Older files do not say it.
    #[serde(default)]
    pub notes: BTreeMap<String, Note>,
    /// Sentences by symbol: of the states and actions of the domain, of the facts and actions of the planner in any episode,
    /// and of the columns of modules; and the names of objects by id. Older files have none.
    #[serde(default)]
    pub words: BTreeMap<String, String>,
    /// Symbols of the facts that only the planner needs.
    #[serde(default)]
    pub planner_only: BTreeSet<String>,
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
    /// What the module is called for people. Older files do not say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<Note>,
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

/// The sentences of a run.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RunWords {
    /// Sentences by symbol, and names of objects by id, as in [`RunFacts::words`].
    pub words: BTreeMap<String, String>,
    /// Symbols of the facts that only the planner needs.
    pub planner_only: BTreeSet<String>,
}

impl RunWords {
    /// Returns the sentence of a symbol; the symbol itself if it has none.
    pub fn of_symbol<'w>(&'w self, symbol: &'w str) -> &'w str {
        self.words.get(symbol).map_or(symbol, String::as_str)
    }

    /// Collects the sentences of a domain, of the planner in all episodes, and of the columns of modules. Where a later problem
    /// knows more objects, its sentences replace the earlier.
    pub fn of<'g>(
        domain: &RelationalDomain,
        grounds: impl IntoIterator<Item = &'g GroundProblem>,
        activity: &ActivityRecorder,
    ) -> Self {
        let columns = activity.modules().iter().flat_map(|module| &module.names);
        let columns: BTreeSet<&str> = columns.map(String::as_str).collect();
        let mut all = Self { words: domain.words.clone(), ..Self::default() };
        for ground in grounds {
            let own = |(key, words): (&str, &str)| (key.to_owned(), words.to_owned());
            let known = ground.domain();
            for fact in known.state_ids() {
                let (name, words) = (&known[fact].name, ground.fact_in_words(fact));
                all.words.insert(name.clone(), words.to_owned());
                // The columns of some modules are facts that do not hold.
                let not = format!("not {name}");
                if columns.contains(&*not) {
                    all.words.insert(not, format!("not so: {words}"));
                }
                if ground.is_planner_only(fact) {
                    all.planner_only.insert(name.clone());
                }
            }
            let actions = known.action_ids();
            let actions = actions.map(|a| own((&known[a].name, ground.action_in_words(a))));
            all.words.extend(actions.chain(ground.object_names().map(own)));
        }
        all
    }
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

    /// Returns the settings of a planner, as they stand in the file.
    pub fn planner_settings(kind: PlannerKind, spec: &PlannerSpec) -> Value {
        json!({
            "name": kind.name(),
            "dimensions": spec.dimensions,
            "max_similarity": spec.max_similarity,
            "absent": spec.absent,
            "first": spec.commitment == Commitment::First,
            "products": spec.unbinding == Unbinding::Products,
        })
    }

    /// Returns the settings that a run has if nothing else is asked for: of the planner, and of the task, which are null for a
    /// task of one's own.
    pub(super) fn defaults(&self) -> Value {
        let planner = Self::planner_settings(PlannerKind::default(), &PlannerSpec::default());
        let scene = tasks::by_name(&self.task).ok().map(|task| task.settings());
        json!({"planner": planner, "scene": scene})
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
            note: Some(module.note.clone()),
        });
        let populations = activity.populations().map(|(path, rows, neurons)| PopulationFacts {
            path: path.into(),
            rows,
            neurons,
        });
        (modules.collect(), populations.collect())
    }
}
