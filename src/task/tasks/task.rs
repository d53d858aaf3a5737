//! The traits and types that describe a task.

use std::fmt::Debug;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::robot::Pose;
use crate::robot::SkillReport;
use crate::robot::scene::{BodyId, Scene, SceneSpec, Sensed};
use crate::robot::skill::{Grasp, Target};
use crate::sim::Seed;
use crate::task::error::TaskError;

/// A task with its settings.
///
/// All randomness comes from seeds. The same settings and seed give the same scene, demonstrations and
/// perturbation, bit for bit.
pub trait Task: Debug + Send + Sync {
    /// Returns a short name in lower case with hyphens, such as `nuts-and-bolts`.
    fn name(&self) -> &str;

    /// Returns a description of the task in one line. Lists of tasks show it beside the name.
    fn description(&self) -> &str;

    /// Returns the settings as a JSON object, as `symbolt config` prints them and `run.json` stores them.
    fn settings(&self) -> Value;

    /// Returns the same task with settings from `text`, a JSON object that was read from `file`. Missing
    /// settings have their defaults. See [`parse_settings`](super::parse_settings).
    ///
    /// # Errors
    /// [`TaskError::Input`] for settings that cannot be read or used.
    fn with_settings(&self, text: &[u8], file: &str) -> Result<Arc<dyn Task>, TaskError>;

    /// Draws a scene: its bodies and the places from which the parts fall. `step_ms` and the number of parts
    /// must be the same for every seed.
    ///
    /// # Errors
    /// [`TaskError::Setting`] or [`TaskError::Range`] for settings that give no valid scene.
    fn scene(&self, seed: Seed) -> Result<SceneSpec, TaskError>;

    /// Returns the grasps for a part as it lies now, the best first; an empty list if the part cannot be
    /// grasped.
    fn grasps(&self, scene: &Sensed<'_>, part: usize) -> Vec<Grasp>;

    /// Returns the demonstrator of demonstration `demo`, counted from 0. `seed` is the same for all
    /// demonstrations; differences between them must be drawn from `seed` and `demo`.
    fn demonstrator(&self, seed: Seed, demo: usize) -> Box<dyn Demonstrator>;

    /// Judges whether the scene satisfies the task. Neither the learner nor the executor uses the judgement.
    fn judge(&self, scene: &Scene) -> Judgement;

    /// Returns the least number of pick-and-place actions that solve the task: at least 1.
    fn min_actions(&self) -> usize;

    /// Returns the change that a person makes to the scene during an episode; `None` if the task offers no
    /// perturbation.
    fn perturbation(&self, seed: Seed) -> Option<Perturbation> {
        let _ = seed;
        None
    }
}

/// A policy that demonstrates the task. It may look at the scene itself; the learner sees only the recording of its
/// skills.
pub trait Demonstrator {
    /// Returns the next step; `None` if the task is solved or nothing can be done. `so_far` holds the reports
    /// of this demonstration's skills.
    fn next(&mut self, scene: &Scene, so_far: &[SkillReport]) -> Option<Step>;
}

/// One step of a demonstrator: a part, and where to put it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Index of the part in the scene.
    pub part: usize,
    /// Target of the part.
    pub target: Target,
}

/// The judgement of a scene by a task's judge.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Judgement {
    /// Whether the task is solved.
    pub solved: bool,
    /// What has been achieved, in words.
    pub achieved: Vec<String>,
}

/// A perturbation: a person moves a body once, as soon as the earliest time has come, the robot does not handle the
/// body or a part in it, and the place is free.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Perturbation {
    /// Earliest simulated time, in seconds.
    pub at_s: f64,
    /// The part or movable fixture.
    pub body: BodyId,
    /// Pose that the body is put into.
    pub pose: Pose,
}
