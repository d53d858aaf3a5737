//! A pick and place in progress: a sequence of stages, each with its own end condition.

use rapier3d::math::Pose as Frame;
use serde::{Deserialize, Serialize};

use super::drive::{Drive, is_settled};
use super::grasp::{Grasp, Target};
use super::reach::{self, Lift, Placing};
use crate::robot::arm::kinematics::Angles;
use crate::robot::arm::path::Path;
use crate::robot::report::{SkillOutcome, Touch};
use crate::robot::scene::Sensed;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Stage {
    Reach(Vec<Path>),
    Approach(Path),
    Close,
    Lift(Path),
    Slide(Path),
    Carry(Vec<Path>),
    Lower(Path),
    Open,
    Retreat(Path),
    Settle,
}

/// A pick and place in progress.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Skill {
    pub(super) part: usize,
    pub(super) target: Target,
    /// Whether the part slides along a guide instead of being lifted.
    slides: bool,
    pub(super) stage: Stage,
    /// Simulated time in this stage, in seconds.
    pub(super) time_s: f64,
    /// Time for which the stage's end condition has held, in seconds.
    so_s: f64,
    pub(super) opening: f64,
    approach: Path,
    pub(super) lift: Path,
    pub(super) placing: Option<Placing>,
    pub(super) in_hand: Option<Frame>,
    /// Whether the part was in the hand after lifting.
    pub(super) picked: bool,
    /// Share of the carrying at which the fingers open by accident, 0 to 1.
    drop_at: Option<f64>,
    carried_s: f64,
    pub(super) carry_s: f64,
    /// Whether both fingers have touched the part and have not let go of it.
    pub(super) touching: bool,
    freed_s: f64,
    pub(super) failure: Option<SkillOutcome>,
    total_s: f64,
}

/// Least force on each pad that counts as contact, in newtons.
pub(super) const TOUCH_N: f64 = 1.0;
const CLOSING_S: (f64, f64) = (0.2, 0.7);
const CLOSING_M_S: f64 = 0.1;
const OPENING_S: f64 = 0.6;
const FREE_S: f64 = 0.1;
const SETTLING_S: (f64, f64) = (0.1, 2.0);
const SKILL_S: f64 = 60.0;
/// A part that has moved farther than this in the hand counts as dropped, in metres.
const LOST_M: f64 = 0.012;

impl Skill {
    /// Plans from the present posture; `None` if there is no collision-free path.
    pub fn plan(
        scene: &Sensed<'_>,
        robot: &Drive,
        part: usize,
        target: Target,
        grasps: &[Grasp],
        drop_at: Option<f64>,
    ) -> Option<Self> {
        let slides = scene.slider(part).is_some();
        let plan = if slides { reach::plan_slide } else { reach::plan_lift };
        let from = |angles: &Angles| plan(scene, angles, part, &target, grasps);
        let (escape, lift) = robot.plan_from_here(scene, from)?;
        let Lift { reach, approach, lift, opening } = lift;
        let reach = escape.into_iter().chain(reach).collect();
        Some(Self {
            part,
            target,
            slides,
            stage: Stage::Reach(reach),
            time_s: 0.0,
            so_s: 0.0,
            opening,
            approach,
            lift,
            placing: None,
            in_hand: None,
            picked: false,
            drop_at,
            carried_s: 0.0,
            carry_s: 0.0,
            touching: false,
            freed_s: 0.0,
            failure: None,
            total_s: 0.0,
        })
    }

    /// Returns the last joint angles of the approach.
    pub fn grasped_at(&self) -> Angles {
        self.approach.end()
    }

    /// Returns whether the part is lifted or carried through the air.
    pub fn carries(&self) -> bool {
        matches!(self.stage, Stage::Lift(_) | Stage::Carry(_))
    }

    /// Returns whether the part is brought to its place along a line.
    pub fn sets_down(&self) -> bool {
        matches!(self.stage, Stage::Slide(_) | Stage::Lower(_))
    }

    pub fn outcome(&self) -> SkillOutcome {
        self.failure.unwrap_or(SkillOutcome::Placed)
    }

    pub(super) fn go(&mut self, stage: Stage) {
        self.stage = stage;
        self.time_s = 0.0;
        self.so_s = 0.0;
    }

    /// Detects when the fingers touch or release the part.
    pub fn watch(&mut self, scene: &Sensed<'_>, dt: f64) -> Option<Touch> {
        let forces = scene.pad_forces(self.part);
        if !self.touching {
            let closing = matches!(self.stage, Stage::Close);
            if closing && forces.iter().all(|f| *f > TOUCH_N) {
                self.touching = true;
                return Some(Touch::Contact(self.part));
            }
            return None;
        }
        self.freed_s = if forces.iter().all(|f| *f == 0.0) { self.freed_s + dt } else { 0.0 };
        if self.freed_s >= FREE_S {
            self.touching = false;
            return Some(Touch::Release(self.part));
        }
        None
    }

    /// Returns the end effector's frame relative to the part.
    pub(super) fn measure(&self, scene: &Sensed<'_>) -> Frame {
        scene.part_frame(self.part).inv_mul(&scene.tool_frame())
    }

    /// Counts the time of carrying and returns whether the fingers open by accident now.
    fn opens_by_accident(&mut self, dt: f64) -> bool {
        if !matches!(self.stage, Stage::Slide(_) | Stage::Carry(_)) {
            return false;
        }
        self.carried_s += dt;
        self.drop_at.is_some_and(|share| self.carried_s >= share * self.carry_s)
    }

    fn lost(&self, scene: &Sensed<'_>) -> bool {
        let Some(was) = self.in_hand else { return false };
        (self.measure(scene).translation - was.translation).length() > LOST_M
    }

    /// Opens the hand and gives up for the reason `why`. Later reasons are ignored.
    pub(super) fn fail(&mut self, why: SkillOutcome) {
        if self.failure.is_none() {
            self.failure = Some(why);
        }
        self.go(Stage::Open);
    }

    /// Gives up if the skill takes too long, the arm has hit something or the part is lost.
    fn give_up_if_needed(&mut self, scene: &Sensed<'_>, robot: &mut Drive, strained: bool) {
        // The stages after a failure have their own limits.
        if self.total_s > SKILL_S && self.failure.is_none() && !matches!(self.stage, Stage::Settle)
        {
            robot.hold(scene);
            self.fail(SkillOutcome::TimedOut);
        }
        let moving = matches!(
            self.stage,
            Stage::Reach(_)
                | Stage::Approach(_)
                | Stage::Lift(_)
                | Stage::Slide(_)
                | Stage::Carry(_)
                | Stage::Lower(_)
        );
        if moving && strained {
            robot.hold(scene);
            self.fail(SkillOutcome::Blocked);
        }
        let carried = matches!(self.stage, Stage::Slide(_) | Stage::Carry(_) | Stage::Lower(_));
        if carried && self.lost(scene) {
            robot.hold(scene);
            self.fail(SkillOutcome::Dropped);
        }
    }

    /// Advances by one step and returns whether the skill is over.
    pub fn advance(
        &mut self,
        scene: &Sensed<'_>,
        robot: &mut Drive,
        strained: bool,
        speeds: &mut Angles,
        dt: f64,
    ) -> bool {
        self.time_s += dt;
        self.total_s += dt;
        self.give_up_if_needed(scene, robot, strained);
        let slips = self.opens_by_accident(dt);
        match &self.stage {
            Stage::Reach(paths) => {
                robot.opening = self.opening;
                if let Some(left) = robot.follow(paths, &mut self.time_s, speeds) {
                    if left.is_empty() {
                        self.go(Stage::Approach(self.approach.clone()));
                    } else {
                        self.go(Stage::Reach(left));
                    }
                }
            }
            Stage::Approach(path) => {
                if robot.run(path, self.time_s, speeds) {
                    self.go(Stage::Close);
                }
            }
            Stage::Close => {
                // Fingers that close too fast push the part away.
                robot.opening = (self.opening - CLOSING_M_S * self.time_s).max(0.0);
                if self.touching && self.time_s > CLOSING_S.0 && self.slides {
                    (self.in_hand, self.picked) = (Some(self.measure(scene)), true);
                    self.carry_s = self.lift.duration_s();
                    self.go(Stage::Slide(self.lift.clone()));
                } else if self.touching && self.time_s > CLOSING_S.0 {
                    self.in_hand = Some(self.measure(scene));
                    self.go(Stage::Lift(self.lift.clone()));
                } else if self.time_s > CLOSING_S.1 {
                    self.fail(SkillOutcome::Missed);
                }
            }
            Stage::Lift(path) => {
                if robot.run(path, self.time_s, speeds) {
                    self.look_into_hand(scene, robot);
                }
            }
            Stage::Slide(path) => {
                if slips {
                    robot.hold(scene);
                    self.fail(SkillOutcome::Dropped);
                } else if robot.run(path, self.time_s, speeds) {
                    self.go(Stage::Open);
                }
            }
            Stage::Carry(paths) => {
                if slips {
                    robot.hold(scene);
                    self.fail(SkillOutcome::Dropped);
                } else if let Some(left) = robot.follow(paths, &mut self.time_s, speeds) {
                    if left.is_empty() && self.failure.is_some() {
                        self.go(Stage::Open);
                    } else if left.is_empty() {
                        self.aim(scene, robot);
                    } else {
                        self.go(Stage::Carry(left));
                    }
                }
            }
            Stage::Lower(path) => {
                if robot.run(path, self.time_s, speeds) {
                    self.go(Stage::Open);
                }
            }
            Stage::Open => {
                robot.opening = self.opening;
                if !self.touching || self.time_s > OPENING_S {
                    self.leave(scene, robot);
                }
            }
            Stage::Retreat(path) => {
                if strained {
                    robot.hold(scene);
                    self.go(Stage::Settle);
                } else if robot.run(path, self.time_s, speeds) {
                    self.go(Stage::Settle);
                }
            }
            Stage::Settle => {
                self.so_s = if is_settled(scene) { self.so_s + dt } else { 0.0 };
                let calm = self.so_s >= SETTLING_S.0 && !self.touching;
                return calm || self.time_s > SETTLING_S.1;
            }
        }
        false
    }
}
