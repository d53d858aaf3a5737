//! The controller of a pick and place: a sequence of stages, each with its own end condition.

use rapier3d::math::Pose as Frame;
use serde::{Deserialize, Serialize};

use super::grasp::{Grasp, Target};
use super::pushing::Pushing;
use super::reach::{self, Lift, Placing};
use crate::task::event::{SkillOutcome, SkillReport, Touch};
use crate::task::robot::arm::{self, Angles, HOME};
use crate::task::robot::path::Path;
use crate::task::scene::physics::Scene;

/// The result of one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stepped {
    /// Contact or release in this step, at which a snapshot is recorded; `None` if there is none.
    pub touch: Option<Touch>,
    /// Report of the skill in the step in which it ends; `None` in all other steps.
    pub ended: Option<SkillReport>,
}

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
    /// End effector's frame, relative to the part, after lifting.
    pub(super) lifted: Option<Frame>,
    /// Share of the carrying at which the fingers open by accident, 0 to 1.
    drop_at: Option<f64>,
    carried_s: f64,
    pub(super) carry_s: f64,
    touching: bool,
    freed_s: f64,
    pub(super) failure: Option<SkillOutcome>,
    slip_m: f64,
    total_s: f64,
}

/// The robot's controller: the skill in progress, and the joint angles and finger opening that it commands.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Robot {
    angles: Angles,
    opening: f64,
    skill: Option<Skill>,
    push: Option<Pushing>,
    strained_s: f64,
}

/// Least force on each pad that counts as contact, in newtons.
pub(super) const TOUCH_N: f64 = 1.0;
/// Time of rest at the end of a path before anything is measured, in seconds.
pub(super) const REST_S: f64 = 0.06;
const CLOSING_S: (f64, f64) = (0.2, 0.7);
const CLOSING_M_S: f64 = 0.1;
const OPENING_S: f64 = 0.6;
const FREE_S: f64 = 0.1;
const SETTLING_S: (f64, f64) = (0.1, 2.0);
const STRAIN_S: f64 = 0.02;
const SKILL_S: f64 = 60.0;
/// A part that has moved farther than this in the hand counts as dropped, in metres.
const LOST_M: f64 = 0.012;
pub(super) const RAISE_M: f64 = 0.10;

impl Default for Robot {
    fn default() -> Self {
        Self { angles: HOME, opening: 0.032, skill: None, push: None, strained_s: 0.0 }
    }
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
        let at = arm::tool(&self.skill.as_ref()?.approach.end());
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
    /// part is [lost](Scene::lost), or if the target's axis or orientation has length 0. In that case nothing has moved.
    pub fn begin(
        &mut self,
        scene: &Scene,
        part: usize,
        target: Target,
        grasps: &[Grasp],
        drop_at: Option<f64>,
    ) -> Result<(), SkillReport> {
        let unreachable =
            SkillReport { part, outcome: SkillOutcome::Unreachable, picked: false, slip_m: 0.0 };
        if part >= scene.part_count() || scene.lost(part) || !target.is_possible() {
            return Err(unreachable);
        }
        let slides = scene.slider(part).is_some();
        let plan = if slides { reach::plan_slide } else { reach::plan_lift };
        let from = |angles: &Angles| plan(scene, angles, part, &target, grasps);
        let plan = self.plan_from_here(scene, from).ok_or(unreachable)?;
        let (escape, Lift { reach, approach, lift, opening }) = plan;
        let reach = escape.into_iter().chain(reach).collect();
        self.skill = Some(Skill {
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
            lifted: None,
            drop_at,
            carried_s: 0.0,
            carry_s: 0.0,
            touching: false,
            freed_s: 0.0,
            failure: None,
            slip_m: 0.0,
            total_s: 0.0,
        });
        self.push = None;
        self.strained_s = 0.0;
        Ok(())
    }

    /// Plans from the present posture; if that fails and the arm touches something, from a posture nearby. Returns the
    /// path to that posture too.
    pub(super) fn plan_from_here<T>(
        &self,
        scene: &Scene,
        plan: impl Fn(&Angles) -> Option<T>,
    ) -> Option<(Option<Path>, T)> {
        if let Some(found) = plan(&self.angles) {
            return Some((None, found));
        }
        let escape = reach::escape(scene, &self.angles, self.opening)?;
        plan(&escape.end()).map(|found| (Some(escape), found))
    }

    pub(super) fn start_push(&mut self, push: Pushing) {
        (self.skill, self.push) = (None, Some(push));
        self.strained_s = 0.0;
    }

    /// Advances the skill and the physics by one step.
    pub fn step(&mut self, scene: &mut Scene) -> Stepped {
        let dt = scene.spec().step_ms as f64 / 1e3;
        let mut speeds = [0.0; arm::JOINTS];
        let mut stepped = Stepped::default();
        if let Some(mut skill) = self.skill.take() {
            skill.time_s += dt;
            skill.total_s += dt;
            let strained = self.strained(scene, dt);
            stepped.touch = skill.watch(scene, dt);
            let over = skill.advance(scene, self, strained, &mut speeds, dt);
            if over {
                stepped.ended = Some(skill.report());
            } else {
                self.skill = Some(skill);
            }
        }
        if let Some(mut push) = self.push.take() {
            let strained = self.strained(scene, dt);
            if push.advance(scene, self, strained, &mut speeds, dt) {
                stepped.ended = Some(push.report(scene));
            } else {
                self.push = Some(push);
            }
        }
        let carrying = match &self.skill {
            Some(skill) => match skill.stage {
                Stage::Lift(_) | Stage::Carry(_) => true,
                Stage::Slide(_) | Stage::Lower(_) => scene.touches_only_the_hand(skill.part),
                _ => false,
            },
            None => (0..scene.part_count()).any(|part| scene.pad_forces(part) != [0.0; 2]),
        };
        scene.refine(carrying);
        scene.drive_arm(&self.angles, &speeds);
        scene.drive_fingers(self.opening);
        scene.step();
        stepped
    }

    /// Returns whether the end effector has been farther than `alarm_m` from its commanded place for
    /// [`STRAIN_S`] seconds.
    fn strained(&mut self, scene: &Scene, dt: f64) -> bool {
        let off = (scene.tool_frame().translation - arm::tool(&self.angles).translation).length();
        self.strained_s = if off > scene.spec().arm.alarm_m { self.strained_s + dt } else { 0.0 };
        self.strained_s > STRAIN_S
    }
}

impl Skill {
    fn report(&self) -> SkillReport {
        SkillReport {
            part: self.part,
            outcome: self.failure.unwrap_or(SkillOutcome::Placed),
            picked: self.lifted.is_some(),
            slip_m: self.slip_m,
        }
    }

    pub(super) fn go(&mut self, stage: Stage) {
        self.stage = stage;
        self.time_s = 0.0;
        self.so_s = 0.0;
    }

    /// Detects when the fingers touch or release the part.
    fn watch(&mut self, scene: &Scene, dt: f64) -> Option<Touch> {
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
    pub(super) fn measure(&self, scene: &Scene) -> Frame {
        scene.part_frame(self.part).inv_mul(&scene.tool_frame())
    }

    /// Measures how far the part has slipped in the hand.
    fn note_slip(&mut self, scene: &Scene) {
        if let Some(lifted) = self.lifted {
            let now = self.measure(scene).translation;
            self.slip_m = (now - lifted.translation).length();
        }
    }

    /// Counts the time of carrying and returns whether the fingers open by accident now.
    fn opens_by_accident(&mut self, dt: f64) -> bool {
        if !matches!(self.stage, Stage::Slide(_) | Stage::Carry(_)) {
            return false;
        }
        self.carried_s += dt;
        self.drop_at.is_some_and(|share| self.carried_s >= share * self.carry_s)
    }

    fn lost(&self, scene: &Scene) -> bool {
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
    fn give_up_if_needed(&mut self, scene: &Scene, robot: &mut Robot, strained: bool) {
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
    fn advance(
        &mut self,
        scene: &Scene,
        robot: &mut Robot,
        strained: bool,
        speeds: &mut Angles,
        dt: f64,
    ) -> bool {
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
                    let in_hand = Some(self.measure(scene));
                    (self.in_hand, self.lifted) = (in_hand, in_hand);
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
                    self.note_slip(scene);
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
                    self.note_slip(scene);
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

/// Returns whether all parts are at rest.
pub(super) fn is_settled(scene: &Scene) -> bool {
    (0..scene.part_count()).all(|part| scene.part_speed(part) < 2e-3)
}

impl Robot {
    pub(super) fn angles(&self) -> &Angles {
        &self.angles
    }

    pub(super) fn set_opening(&mut self, opening: f64) {
        self.opening = opening;
    }

    /// Holds the current joint angles.
    pub(super) fn hold(&mut self, scene: &Scene) {
        self.angles = scene.angles();
        self.strained_s = 0.0;
    }

    /// Follows a path and returns whether it ended at least [`REST_S`] ago.
    pub(super) fn run(&mut self, path: &Path, time_s: f64, speeds: &mut Angles) -> bool {
        (self.angles, *speeds) = path.at(time_s);
        time_s >= path.duration_s() + REST_S
    }

    /// Follows the first of several paths; returns the remaining paths when it is done.
    pub(super) fn follow(
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
