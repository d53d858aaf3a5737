//! What a task has to say of itself.

use std::fmt::Debug;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::sim::Seed;
use crate::task::domain::Pose;
use crate::task::error::TaskError;
use crate::task::event::SkillReport;
use crate::task::scene::{Scene, SceneSpec};
use crate::task::skill::{Grasp, Target};

/// A task with its settings.
///
/// All randomness comes from seeds: the same settings and seed give the same scene, demonstrations and perturbation, to
/// the bit.
pub trait Task: Debug + Send + Sync {
    /// A short name in lower case with hyphens: `nuts-and-bolts`.
    fn name(&self) -> &'static str;

    /// What is to be done, in one line: it stands beside the name where tasks are listed.
    fn description(&self) -> &'static str;

    /// The settings as a JSON object: what `symbolt config` prints and `run.json` holds.
    fn settings(&self) -> Value;

    /// The same task with the settings of a JSON object that came from `file`; what is not there has its default. See
    /// [`parse_settings`](super::parse_settings).
    ///
    /// # Errors
    /// [`TaskError::Input`] for settings that cannot be read or used.
    fn with_settings(&self, text: &[u8], file: &str) -> Result<Arc<dyn Task>, TaskError>;

    /// Draws a scene: what there is, and where parts are let fall. `step_ms` and the number of parts are the same for
    /// every seed.
    ///
    /// # Errors
    /// [`TaskError::Setting`] or [`TaskError::Range`] for settings that make no scene.
    fn scene(&self, seed: Seed) -> Result<SceneSpec, TaskError>;

    /// Ways to take hold of a part as it lies now, the best first; none if it cannot be.
    fn grasps(&self, scene: &Scene, part: usize) -> Vec<Grasp>;

    /// The demonstrator of demonstration `demo`, counted from 0. What varies between demonstrations is drawn from
    /// `seed`, which is the same for all of them.
    fn demonstrator(&self, seed: Seed, demo: usize) -> Box<dyn Demonstrator>;

    /// Whether the scene is as it should be in the end. Neither the learner nor the executor asks.
    fn judge(&self, scene: &Scene) -> Judgement;

    /// The least number of pick and place actions that solve it: at least 1.
    fn min_actions(&self) -> usize;

    /// What a person does to the scene in the midst of an episode, where the task offers that.
    fn perturbation(&self, seed: Seed) -> Option<Perturbation> {
        let _ = seed;
        None
    }
}

/// One who shows the task: a policy that looks at the scene itself. Only the recording of what it did is learned from.
pub trait Demonstrator {
    /// What to do next; `None` if the task is solved or nothing can be done. `so_far` are the skills of this
    /// demonstration.
    fn next(&mut self, scene: &Scene, so_far: &[SkillReport]) -> Option<Step>;
}

/// A part, and where to put it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The part's place in the scene.
    pub part: usize,
    /// Where it is put.
    pub target: Target,
}

/// What a task's judge says of a scene.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Judgement {
    /// Whether the task is solved.
    pub solved: bool,
    /// What has been achieved, in words.
    pub achieved: Vec<String>,
}

/// A person puts a part somewhere, once, as soon as the robot is not after it and there is room.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Perturbation {
    /// Not before this many simulated seconds.
    pub at_s: f64,
    /// The part's place in the scene.
    pub part: usize,
    /// Where it is put.
    pub pose: Pose,
}
