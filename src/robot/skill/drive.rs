//! What a skill commands: the joint angles and the opening of the fingers.

use serde::{Deserialize, Serialize};

use super::reach;
use crate::robot::arm::kinematics::{self, Angles, HOME};
use crate::robot::arm::path::Path;
use crate::robot::scene::Sensed;

/// Time of rest at the end of a path before anything is measured, in seconds.
pub(super) const REST_S: f64 = 0.06;
/// Height by which the hand is raised after a failure, in metres.
pub(super) const RAISE_M: f64 = 0.10;
const STRAIN_S: f64 = 0.02;

/// The posture that the robot commands.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Drive {
    pub angles: Angles,
    /// Distance of each finger from the middle of the gripper, in metres.
    pub opening: f64,
    /// Time for which the arm has been off its commanded place, in seconds.
    pub strained_s: f64,
}

impl Default for Drive {
    fn default() -> Self {
        Self { angles: HOME, opening: 0.032, strained_s: 0.0 }
    }
}

impl Drive {
    /// Plans from the present posture; if that fails and the arm touches something, from a posture nearby. Returns the
    /// path to that posture too.
    pub fn plan_from_here<T>(
        &self,
        scene: &Sensed<'_>,
        plan: impl Fn(&Angles) -> Option<T>,
    ) -> Option<(Option<Path>, T)> {
        if let Some(found) = plan(&self.angles) {
            return Some((None, found));
        }
        let escape = reach::escape(scene, &self.angles, self.opening)?;
        plan(&escape.end()).map(|found| (Some(escape), found))
    }

    /// Returns whether the end effector has been farther than `alarm_m` from its commanded place for
    /// [`STRAIN_S`] seconds.
    pub fn strained(&mut self, scene: &Sensed<'_>, dt: f64) -> bool {
        let off =
            (scene.tool_frame().translation - kinematics::tool(&self.angles).translation).length();
        self.strained_s = if off > scene.arm().alarm_m { self.strained_s + dt } else { 0.0 };
        self.strained_s > STRAIN_S
    }

    /// Holds the current joint angles.
    pub fn hold(&mut self, scene: &Sensed<'_>) {
        self.angles = scene.angles();
        self.strained_s = 0.0;
    }

    /// Follows a path and returns whether it ended at least [`REST_S`] ago.
    pub fn run(&mut self, path: &Path, time_s: f64, speeds: &mut Angles) -> bool {
        (self.angles, *speeds) = path.at(time_s);
        time_s >= path.duration_s() + REST_S
    }

    /// Follows the first of several paths; returns the remaining paths when it is done.
    pub fn follow(
        &mut self,
        paths: &[Path],
        time_s: &mut f64,
        speeds: &mut Angles,
    ) -> Option<Vec<Path>> {
        let (first, rest) = paths.split_first()?;
        (self.angles, *speeds) = first.at(*time_s);
        let rest_s = if rest.is_empty() { REST_S } else { 0.0 };
        (*time_s >= first.duration_s() + rest_s).then(|| rest.to_vec())
    }
}

/// Returns whether all parts are seen to be at rest.
pub(super) fn is_settled(scene: &Sensed<'_>) -> bool {
    scene.is_still(2e-3).unwrap_or(false)
}
