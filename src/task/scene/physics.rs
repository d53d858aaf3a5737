//! The scene's bodies: table, fixtures, parts and the robot, stepped by Rapier.
//!
//! Parts are held by friction and contact alone. The only joints are the robot's own, and nothing here sets a part's
//! pose after it has been dropped, except [`Scene::disturb`].
//!
//! Settings that matter, as measured: double precision; contact recycling off and stiff contacts, or
//! parts float above the table and sink into the pads; friction in the bias pass and Coulomb's
//! model, or parts creep in the hand; armature on the joints, or the wrist gives; arm motors that hold
//! speeds, see [`Scene::drive_arm`]; the fingers' coupling on the one that is solved last; substeps of 1 ms
//! while anything but the arm moves.

use std::time::{Duration, Instant};

use rapier3d::dynamics::{
    FrictionModel, IntegrationParameters, JointAxis, MultibodyJointHandle, RigidBodyBuilder,
    RigidBodyHandle, SpringCoefficients,
};
use rapier3d::geometry::{ColliderBuilder, ColliderHandle};
use rapier3d::math::{Pose as Frame, Vector};
use rapier3d::prelude::{PhysicsWorld, QueryFilter};
use serde::{Deserialize, Serialize};

use super::shapes;
use super::spec::{BodyKind, Handling, SceneSpec};
use crate::sim::SimDuration;
use crate::task::domain::Pose;
use crate::task::error::TaskError;
use crate::task::event::SceneFrame;
use crate::task::robot::arm::{self, Angles, JOINTS};
use crate::task::robot::bodies::{self, RobotBodies};
use crate::task::robot::frame::{frame_of, pose_of};
use crate::task::robot::{ArmSpec, BodyFrame};

#[derive(Debug, Clone, Serialize, Deserialize)]
struct PartBody {
    /// Its kind's place in the specification.
    kind: usize,
    body: RigidBodyHandle,
    collider: ColliderHandle,
}

/// A scene: its bodies as they are now.
#[derive(Serialize, Deserialize)]
pub struct Scene {
    spec: SceneSpec,
    physics: PhysicsWorld,
    robot: RobotBodies,
    parts: Vec<PartBody>,
    steps: u64,
    /// A profile, not a part of the scene's state.
    #[serde(skip)]
    wall: Duration,
}

/// How far parts can seem to be within one another where one goes into the other.
const MEETING_M: f64 = 1.5e-3;

impl Scene {
    /// Builds the scene, drops the parts and lets them settle, for two simulated seconds at most. Costs some tens of
    /// milliseconds.
    ///
    /// # Errors
    /// As [`SceneSpec::check`].
    pub fn new(spec: SceneSpec) -> Result<Self, TaskError> {
        spec.check()?;
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::new(0.0, 0.0, -9.81);
        physics.integration_parameters = parameters(&spec);
        furnish(&mut physics, &spec);
        let robot = bodies::build_robot(&mut physics, &spec.arm, &spec.gripper);
        let mut scene =
            Self { spec, physics, robot, parts: Vec::new(), steps: 0, wall: Duration::ZERO };
        for index in 0..scene.spec.parts.len() {
            scene.insert_part(index);
        }
        let step_ms = scene.spec.step_ms;
        let mut calm = 0;
        // Two seconds at most: a part that still rolls will be seen to roll.
        for _ in 0..2_000 / step_ms {
            scene.step();
            let still = scene.parts.iter().all(|p| scene.speed(p) < 1e-3);
            calm = if still { calm + 1 } else { 0 };
            if calm >= 100 / step_ms {
                break;
            }
        }
        scene.steps = 0;
        scene.wall = Duration::ZERO;
        Ok(scene)
    }

    fn insert_part(&mut self, index: usize) {
        let part = &self.spec.parts[index];
        let kind = &self.spec.kinds[part.kind];
        let (body, collider) = self.physics.insert(
            RigidBodyBuilder::dynamic().pose(part.frame.frame()),
            shapes::compound(&kind.pieces).density(kind.density).friction(kind.friction),
        );
        // Still for so long that it will not move by itself.
        let activation = self.physics.bodies[body].activation_mut();
        activation.normalized_linear_threshold = 1e-3;
        activation.angular_threshold = 0.05;
        activation.time_until_sleep = 0.3;
        self.parts.push(PartBody { kind: part.kind, body, collider });
    }

    fn speed(&self, part: &PartBody) -> f64 {
        let body = &self.physics.bodies[part.body];
        body.linvel().length().max(0.02 * body.angvel().length())
    }

    /// Advances by one step of [`SceneSpec::step_ms`].
    pub fn step(&mut self) {
        let begun = Instant::now();
        self.physics.step();
        self.wall += begun.elapsed();
        self.steps += 1;
    }

    /// Time that the steps have taken on this machine.
    pub fn wall(&self) -> Duration {
        self.wall
    }

    /// How long one step is.
    pub fn period(&self) -> SimDuration {
        SimDuration::from_millis(self.spec.step_ms)
    }

    /// Steps since the parts had settled.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Simulated seconds since the parts had settled.
    pub fn time_s(&self) -> f64 {
        (self.steps * self.spec.step_ms) as f64 / 1e3
    }

    /// What the scene was made from.
    pub fn spec(&self) -> &SceneSpec {
        &self.spec
    }

    /// How many parts there are.
    pub fn part_count(&self) -> usize {
        self.parts.len()
    }

    /// The parts' kinds, each by its place in [`SceneSpec::kinds`].
    pub fn kinds(&self) -> impl Iterator<Item = usize> {
        self.parts.iter().map(|p| p.kind)
    }

    /// A part's kind; `None` for a part that is not there.
    pub fn kind(&self, index: usize) -> Option<&BodyKind> {
        self.parts.get(index).map(|p| &self.spec.kinds[p.kind])
    }

    /// Where a part is; `None` for a part that is not there.
    pub fn part(&self, index: usize) -> Option<Pose> {
        self.parts.get(index).map(|p| pose_of(self.physics.bodies[p.body].position()))
    }

    /// The frame of a part as the physics has it; `None` for a part that is not there.
    pub fn body_frame(&self, index: usize) -> Option<BodyFrame> {
        (index < self.parts.len()).then(|| BodyFrame::of(&self.part_frame(index)))
    }

    pub(crate) fn part_frame(&self, index: usize) -> Frame {
        *self.physics.bodies[self.parts[index].body].position()
    }

    /// How the robot puts down a part of its kind.
    pub(crate) fn handling(&self, index: usize) -> &Handling {
        &self.spec.kinds[self.parts[index].kind].handling
    }

    /// The greater of a part's speed and a fiftieth of a metre a radian of its turning, in metres a
    /// second.
    pub(crate) fn part_speed(&self, index: usize) -> f64 {
        self.speed(&self.parts[index])
    }

    /// Puts a part somewhere, at rest, as a person might. Nothing that the robot does calls this.
    pub fn disturb(&mut self, index: usize, pose: &Pose) {
        if let Some(part) = self.parts.get(index) {
            let body = &mut self.physics.bodies[part.body];
            body.set_position(frame_of(pose), true);
            body.set_linvel(Vector::ZERO, true);
            body.set_angvel(Vector::ZERO, true);
        }
    }

    /// Whether a part would touch nothing, the robot included, at `pose`; `false` for a part that is not
    /// there.
    pub fn has_room(&self, index: usize, pose: &Pose) -> bool {
        let Some(part) = self.parts.get(index) else { return false };
        let filter =
            |handle: ColliderHandle, _: &rapier3d::geometry::Collider| handle != part.collider;
        let query = self.physics.query_pipeline_with_filter(QueryFilter::new().predicate(&filter));
        let shape = self.physics.colliders[part.collider].shape();
        query.intersect_shape(frame_of(pose), shape).next().is_none()
    }

    /// How many joints there are, of the robot's multibody and of any other sort: the second must be 0.
    pub fn joint_counts(&self) -> (usize, usize) {
        let own = self.physics.multibody_joints.multibodies().map(|m| m.num_links() - 1).sum();
        (own, self.physics.impulse_joints.len())
    }

    /// The joints' angles.
    pub(crate) fn angles(&self) -> Angles {
        std::array::from_fn(|i| self.coordinate(self.robot.joints[i], JointAxis::AngX))
    }

    /// This moment, for pictures.
    pub fn frame(&self) -> SceneFrame {
        SceneFrame {
            t: self.time_s(),
            angles: self.angles(),
            fingers: self.robot.fingers.map(|f| self.coordinate(f, JointAxis::LinX)),
            parts: (0..self.parts.len()).filter_map(|index| self.part(index)).collect(),
        }
    }

    fn coordinate(&self, joint: MultibodyJointHandle, axis: JointAxis) -> f64 {
        self.physics.multibody_joints.get(joint).map_or(0.0, |(multibody, link)| {
            multibody.link(link).map_or(0.0, |l| l.joint.coords()[axis as usize])
        })
    }

    /// Sets where the joints should be at the next step's end, in radians, and how fast, in radians a
    /// second.
    ///
    /// As industrial drives do it: a loop about the place asks for a speed, and the motor holds that
    /// speed. A motor that is given a place instead pulls back to where it should be at one moment of the
    /// step in all of its substeps, and that shaking makes held parts creep.
    pub(crate) fn drive_arm(&mut self, angles: &Angles, speeds: &Angles) {
        let ArmSpec { position_gain, velocity_gain, armature, .. } = self.spec.arm;
        let now = self.angles();
        let ahead = 1.0 - position_gain * self.physics.integration_parameters.dt;
        for joint in 0..JOINTS {
            let handle = self.robot.joints[joint];
            if let Some((multibody, link)) = self.physics.multibody_joints.get_mut(handle)
                && let Some(link) = multibody.link_mut(link)
            {
                // In newton metres: a motor that scales by the inertia that its joint alone has to move
                // yields where joints move together.
                let damping = (bodies::LOADS[joint] + armature) * velocity_gain;
                let speed = position_gain * (angles[joint] - now[joint]) + ahead * speeds[joint];
                link.joint.data.set_motor(JointAxis::AngX, 0.0, speed, 0.0, damping);
            }
        }
    }

    /// Chooses the substeps: the longer they are the more a held part creeps, and parts that touch a fixture do not
    /// come to rest at all.
    pub(crate) fn refine(&mut self, carrying: bool) {
        let awake = |part: &PartBody| !self.physics.bodies[part.body].is_sleeping();
        let substeps = match (carrying, self.parts.iter().any(awake)) {
            (true, _) => SUBSTEPS_CARRYING,
            (false, true) => SUBSTEPS,
            (false, false) => SUBSTEPS_AT_REST,
        };
        self.physics.integration_parameters.num_solver_iterations = substeps;
    }

    /// Sets how far each finger should be from the middle, in metres.
    pub(crate) fn drive_fingers(&mut self, opening: f64) {
        let frequency = self.spec.gripper.frequency;
        for handle in self.robot.fingers {
            if let Some((multibody, link)) = self.physics.multibody_joints.get_mut(handle)
                && let Some(link) = multibody.link_mut(link)
            {
                let (stiffness, damping) = (frequency * frequency, 2.0 * frequency);
                link.joint.data.set_motor(JointAxis::LinX, opening, 0.0, stiffness, damping);
            }
        }
    }

    /// Newtons with which each pad presses on a part.
    pub(crate) fn pad_forces(&self, index: usize) -> [f64; 2] {
        let dt = self.physics.integration_parameters.dt;
        self.robot.pads.map(|pad| {
            self.physics
                .contact_pair(pad, self.parts[index].collider)
                .map_or(0.0, |pair| pair.total_impulse_magnitude() / dt)
        })
    }

    /// Where the tool is.
    pub fn tool(&self) -> Pose {
        pose_of(&self.tool_frame())
    }

    pub(crate) fn tool_frame(&self) -> Frame {
        let last = self.robot.links[JOINTS - 1];
        *self.physics.bodies[last].position() * arm::tool_offset()
    }

    /// Whether the arm at `angles` with its fingers at `opening` would touch anything but the parts
    /// in `ignored`.
    pub(crate) fn collides(&self, angles: &Angles, opening: f64, ignored: &[usize]) -> bool {
        let skip = |handle: ColliderHandle| {
            ignored.iter().any(|part| self.parts[*part].collider == handle)
        };
        let filter = |handle: ColliderHandle, collider: &rapier3d::geometry::Collider| {
            let own = collider.parent().is_some_and(|b| self.robot_body(b));
            !own && !skip(handle)
        };
        let query = self.physics.query_pipeline_with_filter(QueryFilter::new().predicate(&filter));
        bodies::outline(angles, opening)
            .any(|(frame, shape)| query.intersect_shape(frame, &*shape).next().is_some())
    }

    /// Whether part `index`, if it were at `frame`, would be within another part by more than a touch.
    pub(crate) fn part_meets_part(&self, index: usize, frame: &Frame) -> bool {
        let shape = self.physics.colliders[self.parts[index].collider].shape();
        let others = self.parts.iter().enumerate().filter(|(other, _)| *other != index);
        others.into_iter().any(|(other, part)| {
            let (place, theirs) = (self.part_frame(other), &self.physics.colliders[part.collider]);
            parry3d::query::contact(frame, shape, &place, theirs.shape(), 0.0)
                .is_ok_and(|c| c.is_some_and(|c| c.dist < -MEETING_M))
        })
    }

    /// Whether part `index`, if it were at `frame`, would touch anything but the robot.
    pub(crate) fn part_collides(&self, index: usize, frame: &Frame) -> bool {
        let own = self.parts[index].collider;
        let filter = |handle: ColliderHandle, collider: &rapier3d::geometry::Collider| {
            handle != own && !collider.parent().is_some_and(|b| self.robot_body(b))
        };
        let query = self.physics.query_pipeline_with_filter(QueryFilter::new().predicate(&filter));
        let shape = self.physics.colliders[own].shape();
        query.intersect_shape(*frame, shape).next().is_some()
    }

    fn robot_body(&self, body: RigidBodyHandle) -> bool {
        self.physics.multibody_joints.rigid_body_link(body).is_some()
    }
}

/// Substeps of a step: while parts move that the hand does not carry, while it carries one through the
/// air, and while all parts rest.
const SUBSTEPS: usize = 4;
const SUBSTEPS_CARRYING: usize = 3;
const SUBSTEPS_AT_REST: usize = 2;

fn parameters(spec: &SceneSpec) -> IntegrationParameters {
    IntegrationParameters {
        dt: spec.step_ms as f64 / 1e3,
        num_solver_iterations: SUBSTEPS,
        contact_recycling: false,
        normalized_prediction_distance: 0.002,
        contact_softness: SpringCoefficients { natural_frequency: 300.0, damping_ratio: 2.0 },
        static_contact_softness: SpringCoefficients {
            natural_frequency: 600.0,
            damping_ratio: 2.0,
        },
        friction_in_bias_pass: true,
        friction_model: FrictionModel::Coulomb,
        normalized_max_corrective_velocity: 1.0,
        normalized_allowed_linear_error: 2e-4,
        ..IntegrationParameters::default()
    }
}

/// Table, rim and fixtures.
fn furnish(physics: &mut PhysicsWorld, spec: &SceneSpec) {
    let table = shapes::table(&spec.table).into_iter().map(|piece| (piece, spec.table.friction));
    let fixtures = spec.fixtures.iter();
    let fixtures = fixtures.flat_map(|f| shapes::fixture(f).map(|piece| (piece, f.friction)));
    for ((at, shape), friction) in table.chain(fixtures) {
        let collider = ColliderBuilder::new(shape).position(at).friction(friction);
        physics.insert_collider(collider, None);
    }
}
