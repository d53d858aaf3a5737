//! The decisions of a pick and place in progress: how a part lies in the hand, how it is lowered, and how the hand
//! leaves it.

use rapier3d::math::Vector;

use super::drive::{Drive, RAISE_M};
use super::picking::{Skill, Stage, TOUCH_N};
use super::reach;
use crate::robot::SkillOutcome;
use crate::robot::arm::kinematics::{self, HOME};
use crate::robot::arm::path::Path;
use crate::robot::scene::Sensed;

/// A part that has moved farther than this in the hand while it was lifted has not been grasped, in metres.
const MOVED_M: f64 = 0.03;
/// Least gap between a finger and a part that the hand has let go of, in metres.
const FREE_M: f64 = 0.004;

impl Skill {
    /// After lifting: checks that the part is in the hand, measures how it lies, and plans the way to the
    /// target.
    pub(super) fn look_into_hand(&mut self, scene: &Sensed<'_>, robot: &mut Drive) {
        let forces = scene.pad_forces(self.part);
        let in_hand = self.measure(scene);
        let moved = self.in_hand.map(|was| (in_hand.translation - was.translation).length());
        if forces.iter().any(|f| *f < TOUCH_N) || moved.is_none_or(|moved| moved > MOVED_M) {
            return self.fail(SkillOutcome::Missed);
        }
        self.in_hand = Some(in_hand);
        self.picked = true;
        // Open no farther than needed: the fingers could hit a neighbour.
        let release_m = scene.handling(self.part).release_m.max(scene.opening() + FREE_M);
        self.opening = self.opening.min(release_m);
        let (part, angles, opening) = (self.part, &robot.angles, self.opening);
        match reach::plan_placing(scene, angles, part, &self.target, &in_hand, opening) {
            Some(placing) => {
                self.carry_s = placing.carry.iter().map(Path::duration_s).sum();
                let carry = placing.carry.clone();
                self.placing = Some(placing);
                self.go(Stage::Carry(carry));
            }
            None => {
                // Put the part back where it was.
                self.failure = Some(SkillOutcome::Unreachable);
                self.go(Stage::Lower(self.lift.clone().reversed()));
            }
        }
    }

    /// Before lowering: measures how the part lies in the hand now, checks that the target is free, and plans
    /// the way down.
    pub(super) fn aim(&mut self, scene: &Sensed<'_>, robot: &mut Drive) {
        let in_hand = self.measure(scene);
        self.in_hand = Some(in_hand);
        if let Some(placing) = &self.placing
            && scene.part_meets_part(self.part, &placing.part)
        {
            self.failure = Some(SkillOutcome::Occupied);
            let back = placing.carry.iter().rev().map(|p| p.clone().reversed());
            let down = self.lift.clone().reversed();
            self.go(Stage::Carry(back.chain([down]).collect()));
            return;
        }
        let tool = self.placing.as_ref().map(|p| p.part * in_hand);
        match tool.and_then(|t| Path::line_to(&robot.angles, &t, scene.arm())) {
            Some(path) => self.go(Stage::Lower(path)),
            None => self.fail(SkillOutcome::Unreachable),
        }
    }

    /// Moves the open hand away: back along the hand, or up if the arm has hit something or the part was lost.
    pub(super) fn leave(&mut self, scene: &Sensed<'_>, robot: &mut Drive) {
        let arm = scene.arm();
        let back = -(kinematics::tool(&robot.angles).rotation * Vector::Z);
        let up = Vector::Z * RAISE_M;
        // A part between the open fingers would be dragged along by a tilted hand that moves up.
        let away = matches!(
            self.failure,
            Some(SkillOutcome::Blocked | SkillOutcome::Dropped | SkillOutcome::TimedOut)
        );
        let path = Path::line(&robot.angles, back * reach::BACK_M, arm)
            .filter(|_| !away)
            .or_else(|| Path::line(&robot.angles, up, arm))
            .or_else(|| Path::line(&robot.angles, back * 0.04, arm));
        match path {
            Some(path) => self.go(Stage::Retreat(path)),
            None => self.go(Stage::Retreat(Path::joints(&robot.angles, &HOME, arm, false))),
        }
    }
}
