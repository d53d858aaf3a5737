//! The robot in its scene. The executor acts and looks through it; it cannot read where a body is in truth, which the physics
//! and the judge alone know.

use serde::{Deserialize, Serialize};

use super::model::Seen;
use super::senses::Eyes;
use crate::robot::Pose;
use crate::robot::scene::{BodyId, Scene, Sensed};
use crate::robot::skill::{Grasp, Push, Robot, Stepped, Target};
use crate::sim::Seed;
use crate::task::recording::Sensing;

/// A robot with its eyes, in a scene.
#[derive(Serialize, Deserialize)]
pub(super) struct Cell {
    scene: Scene,
    robot: Robot,
    eyes: Eyes,
}

impl Cell {
    pub fn new(scene: Scene, sensing: Sensing, seed: Seed) -> Self {
        let eyes = Eyes::new(&scene, sensing, seed);
        Self { scene, robot: Robot::default(), eyes }
    }

    /// Returns the scene as it is. The physics, the judge and pictures need it; neither skills nor the executor do.
    pub fn truth(&self) -> &Scene {
        &self.scene
    }

    /// Returns the scene as the robot senses it.
    pub fn sensed(&self) -> Sensed<'_> {
        self.scene.sensed_by(&self.eyes.percept)
    }

    /// Looks at the scene.
    pub fn look(&mut self) -> Seen {
        self.eyes.look(&self.scene)
    }

    /// Begins to take a part and put it at a target. Returns the index of the grasp; `None` if there is no way.
    pub fn begin(
        &mut self,
        part: usize,
        target: Target,
        grasps: &[Grasp],
        drop_at: Option<f64>,
    ) -> Option<usize> {
        let sensed = self.scene.sensed_by(&self.eyes.percept);
        self.robot.begin(&sensed, part, target, grasps, drop_at).ok()?;
        Some(self.robot.taken_by(grasps).unwrap_or(0))
    }

    /// Begins a push. Returns whether there is a way.
    pub fn begin_push(&mut self, push: &Push) -> bool {
        self.robot.begin_push(&self.scene.sensed_by(&self.eyes.percept), push).is_ok()
    }

    /// Advances the skill and the physics by one step.
    pub fn step(&mut self) -> Stepped {
        self.eyes.watch(&self.scene, self.robot.part(), self.robot.holds());
        self.robot.step_by(&mut self.scene, &self.eyes.percept)
    }

    /// Returns whether the robot does not handle a body, or a part in it.
    pub fn is_free(&self, body: BodyId) -> bool {
        let handled = |part: usize| match body {
            BodyId::Part(own) => own == part,
            BodyId::Fixture(fixture) => self.scene.carried(fixture).contains(&part),
        };
        !self.robot.part().is_some_and(handled)
    }

    /// Puts a body into a pose without the robot; without a pose, takes a part away.
    pub fn put(&mut self, body: BodyId, to: Option<&Pose>) {
        match (to, body) {
            (Some(pose), _) => self.scene.displace(body, pose),
            (None, BodyId::Part(part)) => self.scene.take_away(part),
            (None, BodyId::Fixture(_)) => {}
        }
    }
}
