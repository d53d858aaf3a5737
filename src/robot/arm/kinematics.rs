//! The arm's kinematics: the pose of the end effector at given joint angles, and joint angles for a given
//! pose.
//!
//! Lengths, offsets and joint limits are Franka Emika's published values for the Panda (modified Denavit-Hartenberg
//! parameters). The origin of the end effector's frame is the tool centre point, between the fingers' pads. Its z axis
//! points in the direction of the hand; the fingers close along its y axis.
//!
//! The inverse kinematics uses damped least squares within the joints' limits, with a pull towards the middle of their
//! ranges in the null space (Buss, "Introduction to inverse kinematics", 2004; Liegeois 1977). It tries several
//! starting postures.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use nalgebra::{Matrix6, SMatrix, SVector, Vector6};
use rapier3d::math::{Pose as Frame, Rotation, Vector};

use super::frame::{frame_of, pose_of};
use crate::robot::Pose;

/// Number of the arm's joints.
pub(crate) const JOINTS: usize = 7;

/// Angles of the seven joints, in radians.
pub(crate) type Angles = [f64; JOINTS];

/// Modified Denavit-Hartenberg parameters: a, d, alpha.
const CHAIN: [(f64, f64, f64); JOINTS] = [
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -FRAC_PI_2),
    (0.0, 0.316, FRAC_PI_2),
    (0.0825, 0.0, FRAC_PI_2),
    (-0.0825, 0.384, -FRAC_PI_2),
    (0.0, 0.0, FRAC_PI_2),
    (0.088, 0.0, FRAC_PI_2),
];

/// Lower and upper limit of each joint, in radians, half a degree inside the published limits.
pub(crate) const LIMITS: [(f64, f64); JOINTS] = [
    (-2.888, 2.888),
    (-1.754, 1.754),
    (-2.888, 2.888),
    (-3.063, -0.079),
    (-2.888, 2.888),
    (-0.009, 3.744),
    (-2.888, 2.888),
];

/// Distance from the last joint to the flange, in metres.
const FLANGE_M: f64 = 0.107;
/// Distance from the flange to the tool centre point, in metres.
pub(crate) const TOOL_M: f64 = 0.1034;

/// Joint angles of the waiting posture: above the table, the hand pointing down.
pub(crate) const HOME: Angles = [0.0, -0.55, 0.0, -2.35, 0.0, 1.8, FRAC_PI_4];

/// Returns the fixed part of joint `joint`'s frame, in the frame of the joint before it.
pub(crate) fn offset(joint: usize) -> Frame {
    let (a, d, alpha) = CHAIN[joint];
    let tilt = Rotation::from_rotation_x(alpha);
    Frame::from_parts(Vector::new(a, 0.0, 0.0) + tilt * Vector::new(0.0, 0.0, d), tilt)
}

/// Returns the hand's frame in the frame of the last joint: at the flange, turned so that the fingers close along y.
pub(crate) fn hand_offset() -> Frame {
    Frame::from_parts(Vector::new(0.0, 0.0, FLANGE_M), Rotation::from_rotation_z(-FRAC_PI_4))
}

/// Returns the end effector's frame in the frame of the last joint.
pub(crate) fn tool_offset() -> Frame {
    hand_offset() * Frame::from_translation(Vector::new(0.0, 0.0, TOOL_M))
}

/// Returns the frames of the seven links in the scene.
pub(crate) fn links(q: &Angles) -> [Frame; JOINTS] {
    let mut frame = Frame::IDENTITY;
    std::array::from_fn(|joint| {
        frame = frame * offset(joint) * Rotation::from_rotation_z(q[joint]);
        frame
    })
}

/// Returns the end effector's frame in the scene.
pub(crate) fn tool(q: &Angles) -> Frame {
    links(q)[JOINTS - 1] * tool_offset()
}

/// Height above the table of the second joint, about which the arm reaches out, in metres.
const SHOULDER_M: f64 = 0.333;
/// Greatest distance of the tool centre point from the second joint when the hand points down, in metres.
const REACH_M: f64 = 0.72;

/// Greatest distance of the wrist, where the last joints but one meet, from the shoulder, in metres: the lengths of upper
/// and lower arm with the elbow's offset.
const STRETCHED_M: f64 = 0.7195;
/// Distance of the wrist from the axis of the last joint, in metres.
const WRIST_M: f64 = 0.088;

/// Greatest distance of the tool centre point from the shoulder, in metres.
pub(crate) const LONGEST_M: f64 = STRETCHED_M + WRIST_M + FLANGE_M + TOOL_M;

/// Returns the distance of a place in the scene from the shoulder, in metres.
pub(crate) fn from_shoulder(position: [f64; 3]) -> f64 {
    (Vector::from(position) - Vector::new(0.0, 0.0, SHOULDER_M)).length()
}

/// Returns whether the stretched arm is long enough to bring the end effector to `target`. Costs a few nanoseconds; a
/// search for joint angles that must fail costs a millisecond.
pub(crate) fn may_reach(target: &Frame) -> bool {
    let axis = target.translation - target.rotation * Vector::Z * (FLANGE_M + TOOL_M);
    let far = (axis - Vector::new(0.0, 0.0, SHOULDER_M)).length();
    far - WRIST_M < STRETCHED_M
}

/// Returns whether the tool centre point reaches a place on the table with the hand pointing down. The place
/// is in metres from the arm's base.
pub fn reaches_table([x, y]: [f64; 2]) -> bool {
    let far = x.hypot(y);
    far > 0.25 && far.hypot(SHOULDER_M - 0.2) < REACH_M
}

/// Returns the poses of the seven links and, last, of the end effector, in metres from the base. Joint angles
/// are in radians. Costs about a microsecond.
pub fn forward_kinematics(angles: &[f64; 7]) -> [Pose; 8] {
    let frames = links(angles);
    std::array::from_fn(|i| match frames.get(i) {
        Some(frame) => pose_of(frame),
        None => pose_of(&tool(angles)),
    })
}

/// Finds joint angles, in radians and within the limits, that bring the end effector to `target` (metres from the
/// base). The search begins near `start`. Returns `None` if it finds no solution. Costs about 20 microseconds if a
/// solution is near `start`, and up to a millisecond if there is no solution.
///
/// ```
/// use symbolt::robot::Pose;
/// use symbolt::robot::arm::{forward_kinematics, inverse_kinematics};
///
/// let above_the_table = Pose { position: [0.5, 0.1, 0.2], orientation: [1.0, 0.0, 0.0, 0.0] };
/// let angles = inverse_kinematics(&above_the_table, &[0.0, -0.5, 0.0, -2.3, 0.0, 1.8, 0.8]);
/// let tool = forward_kinematics(&angles.expect("it is within reach"))[7];
/// assert!((tool.position[2] - 0.2).abs() < 1e-4);
/// ```
pub fn inverse_kinematics(target: &Pose, start: &[f64; 7]) -> Option<[f64; 7]> {
    let target = frame_of(target);
    starts(start, &target).find_map(|start| solve(&target, &start))
}

/// Returns the translation and rotation from `from` to `to` as one vector of six numbers.
fn error(from: &Frame, to: &Frame) -> Vector6<f64> {
    let shift = to.translation - from.translation;
    let turn = (to.rotation * from.rotation.inverse()).to_scaled_axis();
    // Take the shorter way round.
    let angle = turn.length();
    let turn = if angle > std::f64::consts::PI {
        turn * ((angle - std::f64::consts::TAU) / angle)
    } else {
        turn
    };
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

fn jacobian(links: &[Frame; JOINTS], tool: &Frame) -> SMatrix<f64, 6, JOINTS> {
    let mut out = SMatrix::<f64, 6, JOINTS>::zeros();
    for (joint, link) in links.iter().enumerate() {
        let axis = link.rotation * Vector::Z;
        let linear = axis.cross(tool.translation - link.translation);
        let column = [linear.x, linear.y, linear.z, axis.x, axis.y, axis.z];
        out.set_column(joint, &Vector6::from(column));
    }
    out
}

fn clamp(q: &mut Angles) {
    for (angle, (low, high)) in q.iter_mut().zip(LIMITS) {
        *angle = angle.clamp(low, high);
    }
}

/// Accepted errors of the inverse kinematics, in metres and radians.
const NEAR: (f64, f64) = (1e-5, 1e-4);

/// Iterates from `start` to joint angles, within the limits, that bring the end effector to `target`. Costs
/// about 1 microsecond an iteration, for at most 80 iterations.
pub(crate) fn solve(target: &Frame, start: &Angles) -> Option<Angles> {
    iterate(target, start, 0.05)
}

/// As [`solve`], but without the pull to the middle of the ranges: finds the nearest posture, for points along a line.
pub(crate) fn solve_near(target: &Frame, start: &Angles) -> Option<Angles> {
    iterate(target, start, 0.0)
}

fn iterate(target: &Frame, start: &Angles, pull: f64) -> Option<Angles> {
    let mut q = *start;
    clamp(&mut q);
    for round in 0..80 {
        let frames = links(&q);
        let tool = frames[JOINTS - 1] * tool_offset();
        let error = error(&tool, target);
        let (shift, turn) = (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm());
        if shift < NEAR.0 && turn < NEAR.1 {
            return Some(q);
        }
        let j = jacobian(&frames, &tool);
        // Damp the step far from the target, and not near it.
        let damping = (1e-3 * error.norm_squared()).max(1e-9);
        let lhs: Matrix6<f64> = j * j.transpose() + Matrix6::identity() * damping;
        let inverse = lhs.try_inverse()?;
        let middle: SVector<f64, JOINTS> = SVector::from_fn(|i, _| {
            let (low, high) = LIMITS[i];
            let range = (high - low) / 2.0;
            ((low + high) / 2.0 - q[i]) / (range * range)
        });
        let pull = if round < 40 { pull } else { 0.0 };
        let null = middle - j.transpose() * (inverse * (j * middle));
        let mut step = j.transpose() * (inverse * error) + null * pull;
        let most = step.amax();
        if most > 0.3 {
            step *= 0.3 / most;
        }
        for (angle, by) in q.iter_mut().zip(step.iter()) {
            *angle += by;
        }
        clamp(&mut q);
    }
    None
}

/// Returns starting postures for [`solve`]: the current posture, then the waiting posture facing the target, with
/// shoulder, elbow and wrist turned either way.
pub(crate) fn starts(current: &Angles, target: &Frame) -> impl Iterator<Item = Angles> {
    let at = target.translation;
    let bearing = at.y.atan2(at.x);
    let current = *current;
    let turned = move |elbow: f64, wrist: f64, hand: f64| {
        let mut q = HOME;
        q[0] = bearing - elbow / 2.0;
        q[2] = elbow;
        q[4] = wrist;
        q[6] = FRAC_PI_4 + hand;
        q
    };
    let mut all = vec![current];
    for hand in [0.0, -1.5, 1.5] {
        for (elbow, wrist) in [(0.0, 0.0), (0.8, 0.0), (-0.8, 0.0), (0.0, 1.3), (0.0, -1.3)] {
            all.push(turned(elbow, wrist, hand));
        }
    }
    all.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Seed;
    use rand::RngExt;

    fn draw(rng: &mut impl rand::Rng) -> Angles {
        std::array::from_fn(|i| {
            let (low, high) = LIMITS[i];
            low + (high - low) * rng.random::<f64>()
        })
    }

    #[test]
    fn the_jacobian_is_the_derivative() {
        let mut rng = Seed::new(1).rng();
        for _ in 0..20 {
            let q = draw(&mut rng);
            let frames = links(&q);
            let j = jacobian(&frames, &tool(&q));
            for joint in 0..JOINTS {
                let mut moved = q;
                moved[joint] += 1e-6;
                let measured = error(&tool(&q), &tool(&moved)) / 1e-6;
                assert!((measured - j.column(joint)).norm() < 1e-4);
            }
        }
    }
}
