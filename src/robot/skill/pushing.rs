//! A push in progress: reach, approach, push, retreat and settle.

use rapier3d::math::{Pose as Frame, Vector};
use serde::{Deserialize, Serialize};

use super::drive::{Drive, RAISE_M, REST_S, is_settled};
use super::push::Push;
use super::reach;
use crate::robot::arm::kinematics::{self, Angles, HOME};
use crate::robot::arm::path::Path;
use crate::robot::report::{SkillOutcome, SkillReport};
use crate::robot::scene::Sensed;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Stage {
    Reach(Vec<Path>),
    Approach(Path),
    Push(Path),
    Retreat(Path),
    Settle,
}

/// A push in progress.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Pushing {
    pub part: usize,
    stage: Stage,
    approach: Path,
    push: Path,
    /// Frame of the part at the beginning.
    began: Frame,
    /// Simulated time in this stage, in seconds.
    time_s: f64,
    /// Time for which all parts have been at rest, in seconds.
    calm_s: f64,
    blocked: bool,
}

/// Mean speed of the fingers while they push, in metres per second.
const PUSH_M_S: f64 = 0.035;
/// A part that has moved less than this, in metres, and turned less than this, in radians, has not moved.
const MOVED: (f64, f64) = (0.004, 0.1);

impl Pushing {
    /// Plans a push from the present posture; `None` if its directions are impossible or there is no collision-free
    /// path.
    pub fn plan(scene: &Sensed<'_>, robot: &Drive, push: &Push) -> Option<Self> {
        let part = push.part;
        let tool = push.tool(push.from)?;
        let shift = Vector::from(push.to) - Vector::from(push.from);
        if !shift.is_finite() {
            return None;
        }
        let from = |angles: &Angles| reach::plan_push(scene, angles, part, &tool, shift);
        let (escape, plan) = robot.plan_from_here(scene, from)?;
        Some(Self {
            part,
            stage: Stage::Reach(escape.into_iter().chain(plan.reach).collect()),
            approach: plan.approach,
            push: plan.push.lasting(shift.length() / PUSH_M_S),
            began: scene.part_frame(part),
            time_s: 0.0,
            calm_s: 0.0,
            blocked: false,
        })
    }

    fn go(&mut self, stage: Stage) {
        self.stage = stage;
        self.time_s = 0.0;
    }

    /// Returns the report at the end.
    pub fn report(&self, scene: &Sensed<'_>) -> SkillReport {
        let now = scene.part_frame(self.part);
        let moved = (now.translation - self.began.translation).length() > MOVED.0
            || now.rotation.angle_between(self.began.rotation) > MOVED.1;
        let outcome = match (moved, self.blocked) {
            (true, _) => SkillOutcome::Placed,
            (false, true) => SkillOutcome::Blocked,
            (false, false) => SkillOutcome::Missed,
        };
        SkillReport { part: self.part, outcome, picked: false, slip_m: 0.0 }
    }

    /// Advances by one step and returns whether the push is over.
    pub fn advance(
        &mut self,
        scene: &Sensed<'_>,
        robot: &mut Drive,
        strained: bool,
        speeds: &mut Angles,
        dt: f64,
    ) -> bool {
        self.time_s += dt;
        robot.opening = 0.0;
        if strained && !matches!(self.stage, Stage::Settle) {
            robot.hold(scene);
            self.blocked = true;
            match self.stage {
                Stage::Retreat(_) => self.go(Stage::Settle),
                _ => self.retreat(scene, robot),
            }
        }
        match &self.stage {
            Stage::Reach(paths) => {
                if let Some(left) = robot.follow(paths, &mut self.time_s, speeds) {
                    match left.is_empty() {
                        true => self.go(Stage::Approach(self.approach.clone())),
                        false => self.go(Stage::Reach(left)),
                    }
                }
            }
            Stage::Approach(path) => {
                if robot.run(path, self.time_s, speeds) {
                    self.go(Stage::Push(self.push.clone()));
                }
            }
            Stage::Push(path) => {
                if robot.run(path, self.time_s, speeds) {
                    self.retreat(scene, robot);
                }
            }
            Stage::Retreat(path) => {
                if robot.run(path, self.time_s, speeds) {
                    self.go(Stage::Settle);
                }
            }
            Stage::Settle => {
                self.calm_s = if is_settled(scene) { self.calm_s + dt } else { 0.0 };
                return self.calm_s >= REST_S || self.time_s > 2.0;
            }
        }
        false
    }

    /// Moves the hand away: back along the fingers, or up.
    fn retreat(&mut self, scene: &Sensed<'_>, robot: &Drive) {
        let (arm_spec, angles) = (scene.arm(), &robot.angles);
        let back = kinematics::tool(angles).rotation * -Vector::Z * reach::BACK_M;
        let path = Path::line(angles, back, arm_spec)
            .or_else(|| Path::line(angles, Vector::Z * RAISE_M, arm_spec))
            .unwrap_or_else(|| Path::joints(angles, &HOME, arm_spec, false));
        self.go(Stage::Retreat(path));
    }
}
