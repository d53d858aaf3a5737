//! The robot: begins skills, one at a time, and steps the one in progress with the physics.

use rapier3d::math::Pose as Frame;
use serde::{Deserialize, Serialize};

use super::drive::Drive;
use super::grasp::{Grasp, Target};
use super::picking::Skill;
use super::push::Push;
use super::pushing::Pushing;
use crate::robot::arm::kinematics;
use crate::robot::report::{SkillOutcome, SkillReport, Touch};
use crate::robot::scene::{Percept, Scene, Sensed};

/// The result of one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stepped {
    /// Contact or release in this step, at which a snapshot is recorded; `None` if there is none.
    pub touch: Option<Touch>,
    /// Report of the skill in the step in which it ends; `None` in all other steps.
    pub ended: Option<SkillReport>,
}

/// The robot's controller: the skill in progress, and the joint angles and finger opening that it commands.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Robot {
    drive: Drive,
    skill: Option<Skill>,
    push: Option<Pushing>,
    /// End effector's frame in the physics, relative to the part, after lifting.
    lifted: Option<Frame>,
    slip_m: f64,
}

fn unreachable(part: usize) -> SkillReport {
    SkillReport { part, outcome: SkillOutcome::Unreachable, picked: false, slip_m: 0.0 }
}

impl Robot {
    /// Returns whether a skill is in progress.
    pub fn busy(&self) -> bool {
        self.skill.is_some() || self.push.is_some()
    }

    /// Returns the part that the current skill handles, by its index in the scene.
    pub fn part(&self) -> Option<usize> {
        let pushed = self.push.as_ref().map(|p| p.part);
        self.skill.as_ref().map(|s| s.part).or(pushed)
    }

    /// Returns the index of the grasp, among `grasps`, by which the current skill takes its part.
    pub(crate) fn taken_by(&self, grasps: &[Grasp]) -> Option<usize> {
        let at = kinematics::tool(&self.skill.as_ref()?.grasped_at());
        let is = |tool: Frame| {
            (tool.translation - at.translation).length() < 5e-4
                && tool.rotation.angle_between(at.rotation) < 5e-3
        };
        grasps.iter().position(|grasp| grasp.tool().is_some_and(is))
    }

    /// Begins a skill: takes `part` (its index in the scene) by the first of `grasps` that works, and puts it at
    /// `target`. With `drop_at`, the fingers open by accident at that share (0 to 1) of the carrying. Searching for
    /// joint angles and paths takes from a fraction of a millisecond to some hundred milliseconds.
    ///
    /// # Errors
    /// A report with [`SkillOutcome::Unreachable`] if there is no collision-free path, no such part or no grasp, if the
    /// part is [lost](Sensed::lost), or if the target's axis or orientation has length 0. In that case nothing has moved.
    pub fn begin(
        &mut self,
        scene: &Sensed<'_>,
        part: usize,
        target: Target,
        grasps: &[Grasp],
        drop_at: Option<f64>,
    ) -> Result<(), SkillReport> {
        let possible = part < scene.part_count() && !scene.lost(part) && target.is_possible();
        let plan = || Skill::plan(scene, &self.drive, part, target, grasps, drop_at);
        let skill = possible.then(plan).flatten().ok_or(unreachable(part))?;
        (self.skill, self.push) = (Some(skill), None);
        (self.lifted, self.slip_m) = (None, 0.0);
        self.drive.strained_s = 0.0;
        Ok(())
    }

    /// Begins a push. The skill ends with [`SkillOutcome::Placed`] if the part has moved or turned, with
    /// [`SkillOutcome::Missed`] if it has not, and with [`SkillOutcome::Blocked`] if it has not because the arm hit
    /// something.
    ///
    /// # Errors
    /// A report with [`SkillOutcome::Unreachable`] if there is no such part, it is lost or slides on a guide, or the
    /// arm has no collision-free path. In that case nothing has moved.
    pub fn begin_push(&mut self, scene: &Sensed<'_>, push: &Push) -> Result<(), SkillReport> {
        let part = push.part;
        let free = |part| !scene.lost(part) && scene.slider(part).is_none();
        let possible = part < scene.part_count() && free(part);
        let plan = || Pushing::plan(scene, &self.drive, push);
        let push = possible.then(plan).flatten().ok_or(unreachable(part))?;
        (self.skill, self.push) = (None, Some(push));
        self.drive.strained_s = 0.0;
        Ok(())
    }

    /// Returns whether both fingers have touched the part of the current skill and have not let go of it.
    pub(crate) fn holds(&self) -> bool {
        self.skill.as_ref().is_some_and(|skill| skill.touching)
    }

    /// Advances the skill and the physics by one step, with exact senses.
    pub fn step(&mut self, scene: &mut Scene) -> Stepped {
        self.step_by(scene, &Percept::default())
    }

    /// Advances the skill and the physics by one step. The skill goes by the percept. The slip in its report is that of the
    /// physics.
    pub fn step_by(&mut self, scene: &mut Scene, percept: &Percept) -> Stepped {
        let dt = scene.spec().step_ms as f64 / 1e3;
        let mut speeds = [0.0; kinematics::JOINTS];
        let mut stepped = Stepped::default();
        let sensed = scene.sensed_by(percept);
        if let Some(mut skill) = self.skill.take() {
            let strained = self.drive.strained(&sensed, dt);
            let before = (skill.sets_down(), skill.outcome());
            stepped.touch = skill.watch(&sensed, dt);
            let over = skill.advance(&sensed, &mut self.drive, strained, &mut speeds, dt);
            let in_hand = scene.part_frame(skill.part).inv_mul(&scene.tool_frame());
            if skill.picked {
                let lifted = *self.lifted.get_or_insert(in_hand);
                if before == (true, skill.outcome()) && !skill.sets_down() {
                    self.slip_m = (in_hand.translation - lifted.translation).length();
                }
            }
            if over {
                // What still leans on the open fingers was let go all the same.
                let leans = skill.touching.then_some(Touch::Release(skill.part));
                stepped.touch = stepped.touch.or(leans);
                let (outcome, slip_m) = (skill.outcome(), self.slip_m);
                let Skill { part, picked, .. } = skill;
                stepped.ended = Some(SkillReport { part, outcome, picked, slip_m });
            } else {
                self.skill = Some(skill);
            }
        }
        if let Some(mut push) = self.push.take() {
            let strained = self.drive.strained(&sensed, dt);
            if push.advance(&sensed, &mut self.drive, strained, &mut speeds, dt) {
                stepped.ended = Some(push.report(&sensed));
            } else {
                self.push = Some(push);
            }
        }
        let alone = |skill: &Skill| skill.sets_down() && scene.touches_only_the_hand(skill.part);
        let carrying = match &self.skill {
            Some(skill) => skill.carries() || alone(skill),
            None => (0..scene.part_count()).any(|part| scene.pad_forces(part) != [0.0; 2]),
        };
        scene.refine(carrying);
        scene.drive_arm(&self.drive.angles, &speeds);
        scene.drive_fingers(self.drive.opening);
        scene.step();
        stepped
    }
}
