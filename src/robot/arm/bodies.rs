//! The robot's bodies: links, hand and fingers as a multibody, with their collision shapes.

use rapier3d::dynamics::{
    GenericJointBuilder, JointAxesMask, JointAxis, MotorModel, MultibodyDofCoupling,
    MultibodyJointHandle, RigidBodyBuilder, RigidBodyHandle,
};
use rapier3d::geometry::{ColliderBuilder, ColliderHandle, SharedShape};
use rapier3d::math::{Pose as Frame, Rotation, Vector};
use rapier3d::prelude::{CoefficientCombineRule, PhysicsWorld};
use serde::{Deserialize, Serialize};

use super::kinematics::{self, Angles, HOME, JOINTS};
use super::spec::{ArmSpec, GripperSpec};

/// Handles of the robot's bodies in the physics.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct RobotBodies {
    pub links: Vec<RigidBodyHandle>,
    pub joints: Vec<MultibodyJointHandle>,
    pub fingers: [MultibodyJointHandle; 2],
    pub pads: [ColliderHandle; 2],
}

/// Distance from the tool centre point to the fingers' tips, in metres.
pub const FINGER_TIP_M: f64 = 0.006;
/// Thickness of a finger, in metres.
const FINGER_M: f64 = 0.005;
const PAD_HALF_WIDTH_M: f64 = 0.008;
const FINGER_LENGTH_M: f64 = 0.045;
/// Half the hand's depth, width and height, in metres.
const HAND_M: [f64; 3] = [0.025, 0.062, 0.028];

/// Collision shape of each link: a capsule in the link's frame (two end points and a radius, in metres).
const CAPSULES: [([f64; 3], [f64; 3], f64); JOINTS] = [
    ([0.0, 0.0, -0.17], [0.0, 0.0, 0.0], 0.06),
    ([0.0, 0.0, 0.0], [0.0, -0.17, 0.0], 0.06),
    ([0.0, 0.0, -0.12], [0.06, 0.0, 0.0], 0.055),
    ([0.0, 0.0, 0.0], [-0.0825, 0.10, 0.0], 0.055),
    ([0.0, 0.0, -0.24], [0.0, 0.03, -0.06], 0.05),
    ([0.0, 0.0, 0.0], [0.075, 0.0, 0.0], 0.045),
    ([0.0, 0.0, 0.0], [0.0, 0.0, 0.07], 0.042),
];

/// Mass of each link, in kilograms, roughly as in the Panda.
const MASSES: [f64; JOINTS] = [3.0, 3.0, 3.0, 3.0, 3.0, 1.7, 0.7];

/// Inertia that each joint's motor is tuned to move, in kilogram square metres: the inertia of the stretched-out arm.
pub(crate) const LOADS: [f64; JOINTS] = [4.0, 4.0, 3.0, 3.0, 0.4, 0.4, 0.1];

/// Returns the robot's collision shapes and their frames, with the arm at `angles` and the fingers at `opening`. The
/// first link is left out: it stands at the table's edge, and nothing comes near it. Each shape is thicker by `grown_m`
/// metres on every side.
pub(crate) fn outline(
    angles: &Angles,
    opening: f64,
    grown_m: f64,
) -> impl Iterator<Item = (Frame, SharedShape)> {
    let links = kinematics::links(angles);
    let hand = links[JOINTS - 1] * kinematics::hand_offset();
    let finger = finger_shape(grown_m);
    let fingers = [1.0, -1.0].map(|side| (hand * finger_frame(side, opening), finger.clone()));
    (1..JOINTS)
        .map(move |i| (links[i], link_shape(i, grown_m)))
        .chain([(hand * hand_middle(), hand_shape(grown_m))])
        .chain(fingers)
}

/// Number of links, from the base, that hand and held parts can run into.
const NEAR_LINKS: usize = 5;

/// Returns the collision shapes of the links near the base and their frames, with the arm at `angles`.
pub(crate) fn near_links(angles: &Angles) -> impl Iterator<Item = (Frame, SharedShape)> {
    let links = kinematics::links(angles);
    (0..NEAR_LINKS).map(move |i| (links[i], link_shape(i, 0.0)))
}

/// Returns the collision shapes of the hand and the fingers and their frames, with the end effector at `tool`.
pub(crate) fn hand_outline(
    tool: &Frame,
    opening: f64,
) -> impl Iterator<Item = (Frame, SharedShape)> {
    let hand = *tool * Frame::from_translation(Vector::new(0.0, 0.0, -kinematics::TOOL_M));
    let finger = |side| (hand * finger_frame(side, opening), finger_shape(0.0));
    let fingers = [1.0, -1.0].map(finger);
    std::iter::once((hand * hand_middle(), hand_shape(0.0))).chain(fingers)
}

/// Distance from the space between the fingers within which a part may still be in it, by errors of sensing, in metres.
const BETWEEN_M: f64 = 2e-3;

/// Returns the space between the fingers, a little enlarged, and its frame, with the end effector at `tool`.
pub(crate) fn between_fingers(tool: &Frame, opening: f64) -> (Frame, SharedShape) {
    let half_m = FINGER_LENGTH_M / 2.0;
    let middle = Frame::from_translation(Vector::new(0.0, 0.0, FINGER_TIP_M - half_m));
    let [x, y, z] = [PAD_HALF_WIDTH_M, opening, half_m].map(|half| half + BETWEEN_M);
    (*tool * middle, SharedShape::cuboid(x, y, z))
}

/// Returns the shapes of the link that moves with a joint, in the link's frame. The last link includes the
/// hand.
pub(crate) fn link_shapes(joint: usize) -> Vec<(Frame, SharedShape)> {
    let mut shapes = vec![(Frame::IDENTITY, link_shape(joint, 0.0))];
    if joint == JOINTS - 1 {
        shapes.push((kinematics::hand_offset() * hand_middle(), hand_shape(0.0)));
    }
    shapes
}

/// Returns the closed finger on a side, 1 or -1, in the last link's frame. It opens along the hand's y axis.
pub(crate) fn closed_finger(side: f64) -> (Frame, SharedShape) {
    (kinematics::hand_offset() * finger_frame(side, 0.0), finger_shape(0.0))
}

fn link_shape(joint: usize, grown_m: f64) -> SharedShape {
    let (a, b, radius) = CAPSULES[joint];
    SharedShape::capsule(Vector::from(a), Vector::from(b), radius + grown_m)
}

fn hand_shape(grown_m: f64) -> SharedShape {
    let [x, y, z] = HAND_M.map(|half| half + grown_m);
    SharedShape::cuboid(x, y, z)
}

fn finger_shape(grown_m: f64) -> SharedShape {
    let half = [PAD_HALF_WIDTH_M, FINGER_M / 2.0, FINGER_LENGTH_M / 2.0];
    let [x, y, z] = half.map(|half| half + grown_m);
    SharedShape::cuboid(x, y, z)
}

/// Returns the middle of the hand's box, in the hand's frame.
fn hand_middle() -> Frame {
    Frame::from_translation(Vector::new(0.0, 0.0, HAND_M[2] + 0.002))
}

/// Returns the middle of a finger's box, in the hand's frame.
fn finger_frame(side: f64, opening: f64) -> Frame {
    let z = kinematics::TOOL_M + FINGER_TIP_M - FINGER_LENGTH_M / 2.0;
    Frame::from_translation(Vector::new(0.0, side * (opening + FINGER_M / 2.0), z))
}

/// Returns the joint frame that aligns Rapier's free axis, x, with `axis`.
fn along(axis: Vector) -> Rotation {
    Rotation::from_rotation_arc(Vector::X, axis)
}

/// Builds the robot in the physics, in its waiting posture.
pub(crate) fn build_robot(
    physics: &mut PhysicsWorld,
    arm_spec: &ArmSpec,
    gripper: &GripperSpec,
) -> RobotBodies {
    let base = physics.insert_body(RigidBodyBuilder::fixed());
    let link_body =
        |frame: Frame| RigidBodyBuilder::dynamic().pose(frame).gravity_scale(0.0).can_sleep(false);
    let frames = kinematics::links(&[0.0; JOINTS]);
    let mut parent = base;
    let (mut links, mut joints) = (Vec::new(), Vec::new());
    for joint in 0..JOINTS {
        let body = physics.insert_body(link_body(frames[joint]));
        physics.insert_collider(
            ColliderBuilder::new(link_shape(joint, 0.0)).mass(MASSES[joint]),
            Some(body),
        );
        if joint == JOINTS - 1 {
            let at = kinematics::hand_offset() * hand_middle();
            let hand = ColliderBuilder::new(hand_shape(0.0)).position(at).mass(0.6);
            physics.insert_collider(hand, Some(body));
        }
        let turn = along(Vector::Z);
        let data = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
            .local_frame1(kinematics::offset(joint) * turn)
            .local_frame2(Frame::from_rotation(turn))
            .motor_max_force(JointAxis::AngX, arm_spec.torque_nm[joint])
            .motor_model(JointAxis::AngX, MotorModel::ForceBased)
            .build();
        if let Some(handle) = physics.insert_multibody_joint(parent, body, data) {
            joints.push(handle);
        }
        links.push(body);
        parent = body;
    }
    let hand = kinematics::hand_offset();
    let mut fingers = Vec::new();
    let mut pads = Vec::new();
    for side in [1.0, -1.0] {
        let body = physics.insert_body(link_body(frames[JOINTS - 1] * hand));
        let pad = physics.insert_collider(
            ColliderBuilder::new(finger_shape(0.0))
                .position(finger_frame(side, 0.0))
                .mass(0.05)
                .friction(gripper.friction)
                .friction_combine_rule(CoefficientCombineRule::Max),
            Some(body),
        );
        let turn = along(Vector::Y * side);
        let data = GenericJointBuilder::new(JointAxesMask::LOCKED_PRISMATIC_AXES)
            .local_frame1(hand * turn)
            .local_frame2(Frame::from_rotation(turn))
            .motor_max_force(JointAxis::LinX, gripper.force_n)
            .limits(JointAxis::LinX, [0.0, gripper.stroke_m])
            .build();
        if let Some(handle) = physics.insert_multibody_joint(parent, body, data) {
            fingers.push(handle);
        }
        pads.push(pad);
    }
    let robot =
        RobotBodies { links, joints, fingers: [fingers[0], fingers[1]], pads: [pads[0], pads[1]] };
    pose_robot(physics, arm_spec, gripper, &robot);
    robot
}

/// Couples the fingers, sets the armature and puts the arm into its waiting posture.
fn pose_robot(
    physics: &mut PhysicsWorld,
    arm_spec: &ArmSpec,
    gripper: &GripperSpec,
    robot: &RobotBodies,
) {
    let links = robot.fingers.map(|f| physics.multibody_joints.get(f).map_or(0, |(_, l)| l));
    let Some((multibody, _)) = physics.multibody_joints.get_mut(robot.joints[0]) else { return };
    multibody.set_self_contacts_enabled(false);
    multibody.forward_kinematics(&physics.bodies, true);
    // Couple the fingers at the finger that is solved last. A coupling at the other finger lets the first finger push
    // the middle of the hand aside by one substep's motion.
    multibody.add_dof_coupling(MultibodyDofCoupling {
        link1: links[1],
        dof1: 0,
        axis1: 0,
        link2: links[0],
        dof2: 0,
        axis2: 0,
        coeff: 1.0,
        offset: 0.0,
    });
    multibody.damping_mut().fill(0.0);
    let armature = multibody.armature_mut();
    for joint in 0..JOINTS {
        armature[joint] = arm_spec.armature;
    }
    let mut start = vec![0.0; multibody.ndofs()];
    start[..JOINTS].copy_from_slice(&HOME);
    start[JOINTS..].fill(0.8 * gripper.stroke_m);
    multibody.apply_displacements(&start);
    multibody.forward_kinematics(&physics.bodies, false);
    multibody.update_rigid_bodies(&mut physics.bodies, true);
}
