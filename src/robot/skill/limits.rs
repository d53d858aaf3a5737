//! Why a skill did not work, in words: the limit of the robot that rules it out or comes nearest.

use super::grasp::{Grasp, Target};
use crate::robot::SkillOutcome;
use crate::robot::arm::kinematics;
use crate::robot::scene::{PAYLOAD_N, Sensed};

/// Multiple of a part's weight above which a grip is said to be able to squeeze the part out of the hand.
const SQUEEZED: f64 = 500.0;

impl Sensed<'_> {
    /// Returns in words which limit can have kept the robot from putting a part at a target: payload, grip against weight, reach,
    /// opening of the fingers, or the position error at which the arm stops. `grasps` are those that were tried. Where a limit
    /// leaves room, its numbers are said all the same, so that it can be ruled out.
    pub fn limits_in_words(
        &self,
        part: usize,
        target: &Target,
        grasps: &[Grasp],
        outcome: SkillOutcome,
    ) -> String {
        let Some(kind) = self.kind(part) else { return format!("there is no part {part}") };
        let weight_n = self.mass(part).1;
        let (gripper, arm) = (self.gripper(), self.arm());
        // Between pad and part, the greater coefficient applies, on both sides.
        let friction = gripper.friction.max(kind.friction);
        let holds_n = 2.0 * gripper.force_n * friction;
        let grip = || {
            if weight_n > PAYLOAD_N {
                return format!("it weighs {weight_n:.2} N, and the arm carries {PAYLOAD_N} N");
            }
            let force_n = gripper.force_n;
            let squeezed = match force_n > SQUEEZED * weight_n {
                true => ", and so much force can press it out of the hand",
                false => "",
            };
            format!(
                "it weighs {weight_n:.2} N, and two fingers of {force_n} N at a friction of {friction} hold \
                 {holds_n:.2} N at rest{squeezed}"
            )
        };
        match outcome {
            SkillOutcome::Placed => "it was released at its target".into(),
            SkillOutcome::Dropped | SkillOutcome::Missed => grip(),
            SkillOutcome::Blocked => format!(
                "the end effector was more than {} mm off its path; {}",
                1e3 * arm.alarm_m,
                grip()
            ),
            SkillOutcome::Occupied => "another part is in the way at the target".into(),
            SkillOutcome::TimedOut => "it took longer than 60 s".into(),
            SkillOutcome::Unreachable => self.out_of_reach(part, target, grasps),
        }
    }

    /// Returns why a skill has no path.
    fn out_of_reach(&self, part: usize, target: &Target, grasps: &[Grasp]) -> String {
        let stroke_m = self.gripper().stroke_m;
        let narrowest = grasps.iter().map(|g| g.opening_m).fold(f64::INFINITY, f64::min);
        let lies = self.part(part).map(|pose| pose.position);
        for (what, place) in [("the part", lies), ("the target", Some(target.position))] {
            if let Some(position) = place
                && let far = kinematics::from_shoulder(position)
                && far > kinematics::LONGEST_M
            {
                return format!(
                    "{what} is {far:.2} m from the shoulder, and the arm reaches {:.2} m",
                    kinematics::LONGEST_M
                );
            }
        }
        if self.lost(part) {
            "it fell off the table".into()
        } else if grasps.is_empty() {
            "no grasp fits how it lies".into()
        } else if narrowest > stroke_m {
            format!(
                "the narrowest of {} grasps opens the fingers by {:.0} mm, and they open by {:.0} mm",
                grasps.len(),
                2e3 * narrowest,
                2e3 * stroke_m
            )
        } else {
            format!("none of {} grasps has a path on which the arm hits nothing", grasps.len())
        }
    }
}
