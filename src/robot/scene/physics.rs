//! The scene in Rapier: table, fixtures, parts and the robot.
//!
//! Friction and contact alone hold a part in the hand. The only joints are the robot's own and the sliders of parts
//! such as drawers. After the parts have been dropped, nothing here sets the pose of a part except [`Scene::disturb`]
//! and [`Scene::displace`].
//!
//! These settings proved necessary:
//!
//! - Double precision.
//! - No contact recycling, and stiff contacts. Otherwise parts float above the table and sink into the pads.
//! - Contacts found within 1 mm. The contacts of a part's pieces are merged, and four of all that were found are kept.
//!   With 2 mm, a lying part lost and regained the corner that carries it, rocked, and slid by 80 to 160 µm/s. With 1 mm,
//!   96 of 96 parts stay below 0.02 µm/s even if they may not sleep, and with sleep all parts rest.
//! - Friction in the bias pass and Coulomb's model. Otherwise parts creep in the hand.
//! - A held part's weight borne by the fingers ([`Scene::drive_arm`]). The motors start from zero in every substep and
//!   one pass does not find all their torques, so the hand trembled, and parts crept by 1 to 50 µm/s without end. Now a
//!   part may settle in the hand, by up to 60 µm in some seconds, and then does not move.
//! - Nine substeps while parts move outside the hand ([`Scene::refine`]). With four, nearly half of all shafts that were
//!   put into a ring rattled in it without end, and without merged contacts one in five sprang out of it within ten
//!   seconds. With nine, 60 of 60 are asleep after half a second. The numbers are odd: the contacts' corrections alternate
//!   from substep to substep. With an even number every step ends in the same phase, and some held parts creep by up to
//!   140 µm/s.
//! - Three substeps while the hand carries a part that touches nothing else, one while all parts rest. More of them cost
//!   time and change nothing there.
//! - Armature on the joints. Otherwise the wrist gives way.
//! - Arm motors that hold speeds instead of positions ([`Scene::drive_arm`]).
//! - Fingers coupled at the finger that is solved last.

use std::time::{Duration, Instant};

use rapier3d::dynamics::{
    FrictionModel, ImpulseJointHandle, IntegrationParameters, JointAxis, MultibodyJointHandle,
    RigidBodyBuilder, RigidBodyHandle, SpringCoefficients,
};
use rapier3d::geometry::{Collider, ColliderHandle, SharedShape};
use rapier3d::math::{Pose as Frame, Vector};
use rapier3d::prelude::PhysicsWorld;
use serde::{Deserialize, Serialize};

use super::frame::SceneFrame;
use super::sensed::meet;
use super::spec::{BodyId, BodyKind, SceneSpec};
use super::{furnish, shapes};
use crate::robot::Pose;
use crate::robot::RobotError;
use crate::robot::arm::bodies::{self, RobotBodies};
use crate::robot::arm::frame::{frame_of, pose_of};
use crate::robot::arm::kinematics::{self, Angles, JOINTS};
use crate::robot::arm::{ArmSpec, BodyFrame};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct PartBody {
    /// Index of the part's kind in [`SceneSpec::kinds`].
    pub(super) kind: usize,
    pub(super) body: RigidBodyHandle,
    pub(super) collider: ColliderHandle,
    /// The slider's joint.
    pub(super) slider: Option<ImpulseJointHandle>,
}

/// A simulated scene in its current state.
#[derive(Serialize, Deserialize)]
pub struct Scene {
    spec: SceneSpec,
    pub(super) physics: PhysicsWorld,
    robot: RobotBodies,
    pub(super) parts: Vec<PartBody>,
    /// The body of each movable fixture; `None` for the other fixtures.
    pub(super) movable: Vec<Option<RigidBodyHandle>>,
    steps: u64,
    /// Wall time of the steps. It is not part of the scene's state.
    #[serde(skip)]
    wall: Duration,
}

/// Weight that the arm carries, in newtons. Blocks of 8.6 N were carried with fingers of 10 and 25 N in four of four demonstrations,
/// blocks of 9.9 N with fingers of 25, 50 and 100 N in one of six.
pub const PAYLOAD_N: f64 = 9.0;

impl Scene {
    /// Builds the scene, drops the parts and lets them settle for at most two simulated seconds. Costs some
    /// tens of milliseconds.
    ///
    /// # Errors
    /// As [`SceneSpec::check`].
    pub fn new(spec: SceneSpec) -> Result<Self, RobotError> {
        spec.check()?;
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::new(0.0, 0.0, -9.81);
        physics.integration_parameters = parameters(&spec);
        furnish::still(&mut physics, &spec);
        let movable = furnish::movable(&mut physics, &spec);
        let robot = bodies::build_robot(&mut physics, &spec.arm, &spec.gripper);
        let (parts, wall) = (Vec::new(), Duration::ZERO);
        let mut scene = Self { spec, physics, robot, parts, movable, steps: 0, wall };
        for index in 0..scene.spec.parts.len() {
            scene.insert_part(index);
        }
        let step_ms = scene.spec.step_ms;
        let mut calm = 0;
        // Limited, because a part may keep rolling.
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
        // A part slower than these thresholds for 0.3 s falls asleep: the physics no longer moves it until something
        // touches it.
        let activation = self.physics.bodies[body].activation_mut();
        activation.normalized_linear_threshold = 1e-3;
        activation.angular_threshold = 0.05;
        activation.time_until_sleep = 0.3;
        let slider = part.slider.map(|slider| {
            let base = slider.fixture.and_then(|fixture| self.movable[fixture]);
            furnish::guide(&mut self.physics, &slider, base, body)
        });
        self.parts.push(PartBody { kind: part.kind, body, collider, slider });
    }

    fn speed(&self, part: &PartBody) -> f64 {
        if self.is_lost(part) {
            return 0.0;
        }
        let body = &self.physics.bodies[part.body];
        body.linvel().length().max(0.02 * body.angvel().length())
    }

    /// Advances the scene by one step of [`SceneSpec::step_ms`].
    pub fn step(&mut self) {
        let begun = Instant::now();
        self.physics.step();
        self.freeze_lost();
        self.wall += begun.elapsed();
        self.steps += 1;
    }

    /// Returns the wall time that the steps have taken.
    pub fn wall(&self) -> Duration {
        self.wall
    }

    /// Returns the number of steps since the parts settled.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Returns the simulated time since the parts settled, in seconds.
    pub fn time_s(&self) -> f64 {
        (self.steps * self.spec.step_ms) as f64 / 1e3
    }

    /// Returns the specification that the scene was built from.
    pub fn spec(&self) -> &SceneSpec {
        &self.spec
    }

    /// Returns the number of parts.
    pub fn part_count(&self) -> usize {
        self.parts.len()
    }

    /// Returns the kind of each part, by its index in [`SceneSpec::kinds`].
    pub fn kinds(&self) -> impl Iterator<Item = usize> {
        self.parts.iter().map(|p| p.kind)
    }

    /// Returns a part's kind; `None` if there is no such part.
    pub fn kind(&self, index: usize) -> Option<&BodyKind> {
        self.parts.get(index).map(|p| &self.spec.kinds[p.kind])
    }

    /// Returns a part's pose; `None` if there is no such part.
    pub fn part(&self, index: usize) -> Option<Pose> {
        self.parts.get(index).map(|p| pose_of(self.physics.bodies[p.body].position()))
    }

    /// Returns a part's weight in newtons; `None` if there is no such part. Above [`PAYLOAD_N`] the robot mostly drops it.
    pub fn weight_n(&self, part: usize) -> Option<f64> {
        let body = &self.physics.bodies[self.parts.get(part)?.body];
        Some(body.mass() * self.physics.gravity.length())
    }

    /// Returns a part's frame as the physics stores it; `None` if there is no such part.
    pub fn body_frame(&self, index: usize) -> Option<BodyFrame> {
        (index < self.parts.len()).then(|| BodyFrame::of(&self.part_frame(index)))
    }

    pub(crate) fn part_frame(&self, index: usize) -> Frame {
        *self.physics.bodies[self.parts[index].body].position()
    }

    /// Returns the greater of a part's speed and 0.02 m times its angular speed, in metres per second.
    pub(crate) fn part_speed(&self, index: usize) -> f64 {
        self.speed(&self.parts[index])
    }

    /// Moves a part to `pose`, at rest, as a person might do. A [lost](Scene::lost) part is found again. Does nothing if
    /// there is no such part. The robot never calls this.
    pub fn disturb(&mut self, index: usize, pose: &Pose) {
        if let Some(part) = self.parts.get(index) {
            let body = &mut self.physics.bodies[part.body];
            body.set_enabled(true);
            body.set_position(frame_of(pose), true);
            body.set_linvel(Vector::ZERO, true);
            body.set_angvel(Vector::ZERO, true);
        }
    }

    /// Returns whether a part at `pose` would touch nothing, the robot included; `false` if there is no such
    /// part.
    pub fn has_room(&self, index: usize, pose: &Pose) -> bool {
        let Some(part) = self.parts.get(index) else { return false };
        let shape = self.physics.colliders[part.collider].shared_shape();
        !self.touches(&frame_of(pose), shape, &[part.collider])
    }

    /// Returns whether a shape at `place` would touch any body but `own`. It goes by where bodies are: their colliders follow
    /// only with the next step, so they would not show what another hand has just moved. Costs O(colliders).
    pub(super) fn touches(
        &self,
        place: &Frame,
        shape: &SharedShape,
        own: &[ColliderHandle],
    ) -> bool {
        let mut others = self.physics.colliders.iter().filter(|(handle, other)| {
            let body = other.parent().and_then(|body| self.physics.bodies.get(body));
            !own.contains(handle) && body.map_or(other.is_enabled(), |body| body.is_enabled())
        });
        others.any(|(_, other)| meet((place, shape), (&self.place_of(other), other.shared_shape())))
    }

    /// Returns where the body of a collider holds it at this moment.
    pub(super) fn place_of(&self, collider: &Collider) -> Frame {
        let body = collider.parent().and_then(|body| self.physics.bodies.get(body));
        match (body, collider.position_wrt_parent()) {
            (Some(body), Some(within)) => body.position() * within,
            _ => *collider.position(),
        }
    }

    /// Returns two counts: joints of the robot's multibody, and all other joints except the parts' sliders
    /// ([`Scene::sliders`]). The second must be 0: no joint holds a part in the hand.
    pub fn joint_counts(&self) -> (usize, usize) {
        let own = self.physics.multibody_joints.multibodies().map(|m| m.num_links() - 1).sum();
        (own, self.physics.impulse_joints.len() - self.sliders())
    }

    /// Returns the joint angles.
    pub(crate) fn angles(&self) -> Angles {
        std::array::from_fn(|i| self.coordinate(self.robot.joints[i], JointAxis::AngX))
    }

    /// Returns joint angles, finger openings, and poses of parts and movable fixtures at this moment, for pictures.
    pub fn frame(&self) -> SceneFrame {
        SceneFrame {
            t: self.time_s(),
            angles: self.angles(),
            fingers: self.robot.fingers.map(|f| self.coordinate(f, JointAxis::LinX)),
            parts: (0..self.parts.len())
                .map(BodyId::Part)
                .chain((0..self.movable.len()).map(BodyId::Fixture))
                .filter_map(|body| self.body(body))
                .collect(),
        }
    }

    fn coordinate(&self, joint: MultibodyJointHandle, axis: JointAxis) -> f64 {
        self.physics.multibody_joints.get(joint).map_or(0.0, |(multibody, link)| {
            multibody.link(link).map_or(0.0, |l| l.joint.coords()[axis as usize])
        })
    }

    /// Sets the target joint angles (radians) and speeds (radians per second) for the end of the next step.
    ///
    /// An outer loop turns the position error into a speed, and the motor holds that speed, as in industrial drives. A
    /// motor that held a position would instead pull towards the same position in every substep. The resulting
    /// vibration makes held parts creep.
    pub(crate) fn drive_arm(&mut self, angles: &Angles, speeds: &Angles) {
        self.bear_held_parts();
        let ArmSpec { position_gain, velocity_gain, armature, .. } = self.spec.arm;
        let now = self.angles();
        let ahead = 1.0 - position_gain * self.physics.integration_parameters.dt;
        for joint in 0..JOINTS {
            let handle = self.robot.joints[joint];
            if let Some((multibody, link)) = self.physics.multibody_joints.get_mut(handle)
                && let Some(link) = multibody.link_mut(link)
            {
                // The torque is absolute, in newton metres. A motor whose torque scales with the inertia of its own
                // joint alone gives way when joints move together.
                let damping = (bodies::LOADS[joint] + armature) * velocity_gain;
                let speed = position_gain * (angles[joint] - now[joint]) + ahead * speeds[joint];
                link.joint.data.set_motor(JointAxis::AngX, 0.0, speed, 0.0, damping);
            }
        }
    }

    /// Applies the weight of the parts in the hand to the fingers, upwards, half to each. Industrial arms, too, balance
    /// the weight of their payload. On the hand instead of the fingers, the coupling of the fingers would have to bear
    /// the part of the weight that acts along it.
    fn bear_held_parts(&mut self) {
        let fingers = self.robot.pads.map(|pad| self.physics.colliders[pad].parent());
        for finger in fingers.into_iter().flatten() {
            let finger = &mut self.physics.bodies[finger];
            finger.reset_forces(false);
            finger.reset_torques(false);
        }
        for part in 0..self.parts.len() {
            if !self.is_held(part) || self.parts[part].slider.is_some() {
                continue;
            }
            let body = &self.physics.bodies[self.parts[part].body];
            let half = -0.5 * body.mass() * self.physics.gravity;
            let at = body.center_of_mass();
            for finger in fingers.into_iter().flatten() {
                self.physics.bodies[finger].add_force_at_point(half, at, false);
            }
        }
    }

    /// Chooses the number of substeps, for the reasons in the module's documentation.
    pub(crate) fn refine(&mut self, carrying: bool) {
        let awake =
            |part: &PartBody| !self.is_lost(part) && !self.physics.bodies[part.body].is_sleeping();
        let substeps = match (carrying, self.parts.iter().any(awake)) {
            (true, _) => SUBSTEPS_CARRYING,
            (false, true) => SUBSTEPS,
            (false, false) => SUBSTEPS_AT_REST,
        };
        self.physics.integration_parameters.num_solver_iterations = substeps;
    }

    /// Sets the target distance of each finger from the middle of the gripper, in metres.
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

    /// Returns the force with which each pad presses on a part, in newtons.
    pub(crate) fn pad_forces(&self, index: usize) -> [f64; 2] {
        let dt = self.physics.integration_parameters.dt;
        self.robot.pads.map(|pad| {
            self.physics
                .contact_pair(pad, self.parts[index].collider)
                .map_or(0.0, |pair| pair.total_impulse_magnitude() / dt)
        })
    }

    /// Returns whether both pads press on a part.
    pub(crate) fn is_held(&self, index: usize) -> bool {
        self.pad_forces(index).iter().all(|force| *force > 0.0)
    }

    /// Returns whether nothing but the hand touches part `index`, or is about to.
    pub(crate) fn touches_only_the_hand(&self, index: usize) -> bool {
        self.physics.contact_pairs_with(self.parts[index].collider).all(|pair| {
            self.robot.pads.iter().any(|pad| [pair.collider1, pair.collider2].contains(pad))
                || !pair.has_any_active_contact()
        })
    }

    /// Returns the pose of the end effector.
    pub fn tool(&self) -> Pose {
        pose_of(&self.tool_frame())
    }

    pub(crate) fn tool_frame(&self) -> Frame {
        let last = self.robot.links[JOINTS - 1];
        *self.physics.bodies[last].position() * kinematics::tool_offset()
    }

    pub(super) fn robot_body(&self, body: RigidBodyHandle) -> bool {
        self.physics.multibody_joints.rigid_body_link(body).is_some()
    }
}

/// Number of substeps of a step: while parts move outside the hand, while the hand carries a part through the air, and
/// while all parts rest.
const SUBSTEPS: usize = 9;
const SUBSTEPS_CARRYING: usize = 3;
const SUBSTEPS_AT_REST: usize = 1;

/// Distance within which contacts are found, in metres.
pub(super) const CONTACT_M: f64 = 1e-3;

fn parameters(spec: &SceneSpec) -> IntegrationParameters {
    IntegrationParameters {
        dt: spec.step_ms as f64 / 1e3,
        num_solver_iterations: SUBSTEPS,
        contact_recycling: false,
        normalized_prediction_distance: CONTACT_M,
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
