//! Grasps and placements, in order of preference.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use rapier3d::math::{Matrix, Pose as Frame, Rotation, Vector};
use serde::{Deserialize, Serialize};

use crate::robot::Pose;
use crate::robot::arm::frame::{frame_of, pose_of};
use crate::robot::scene::Symmetry;

/// A grasp: the end effector's frame, and the opening of the fingers during the approach. The tool centre point lies
/// between the pads, [`FINGER_TIP_M`](crate::robot::arm::FINGER_TIP_M) behind the fingers' tips.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grasp {
    /// Tool centre point in the scene, in metres.
    pub at: [f64; 3],
    /// Direction in which the hand points.
    pub approach: [f64; 3],
    /// Direction along which the fingers close, perpendicular to `approach`.
    pub closing: [f64; 3],
    /// Distance of each finger from the middle of the gripper, in metres.
    pub opening_m: f64,
}

impl Grasp {
    /// Returns the end effector's frame; `None` if a direction has no length or the two are not
    /// perpendicular.
    pub(crate) fn tool(&self) -> Option<Frame> {
        let [at, approach, closing] = [self.at, self.approach, self.closing].map(Vector::from);
        let (z, y) = (approach.normalize(), closing.normalize());
        // A direction without length gives NaN here, which fails the test.
        let square = at.is_finite() && z.dot(y).abs() < 1e-6;
        let turn = Matrix::from_cols(y.cross(z), y, z);
        square.then(|| Frame::from_parts(at, Rotation::from_mat3(&turn)))
    }
}

/// The orientation that a part should have at its target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Facing {
    /// The orientation that the part has in the hand, at most turned about the vertical.
    Any,
    /// The direction of the part's z axis. The part may be turned about this direction by the steps of
    /// [`Symmetry::turns`].
    Axis([f64; 3]),
    /// The whole orientation, as a unit quaternion `[x, y, z, w]`. Orientations in which the part looks the same
    /// ([`Symmetry::fold`], [`Symmetry::flips`]) are equivalent.
    Full([f64; 4]),
}

/// The place and orientation in which a part is to be put.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Position at which the origin of the part's frame should come to rest, in metres.
    pub position: [f64; 3],
    /// Orientation of the part.
    pub facing: Facing,
}

impl Target {
    /// Returns a target at which the part's z axis points up.
    pub fn upright(position: [f64; 3]) -> Self {
        Self::along(position, [0.0, 0.0, 1.0])
    }

    /// Returns a target at which the part's z axis points along `axis`.
    pub fn along(position: [f64; 3], axis: [f64; 3]) -> Self {
        Self { position, facing: Facing::Axis(axis) }
    }

    /// Returns a target at which the part has the orientation of `pose`, up to the symmetry of its kind.
    pub fn pose(pose: &Pose) -> Self {
        Self { position: pose.position, facing: Facing::Full(pose.orientation) }
    }

    /// Returns a target at which the part keeps the orientation that it has in the hand, at most turned about the
    /// vertical.
    pub fn anyhow(position: [f64; 3]) -> Self {
        Self { position, facing: Facing::Any }
    }

    /// Returns the poses in which a part of this symmetry fulfils the target. Those closest to the orientation that it has in
    /// the hand come first.
    pub fn poses(&self, symmetry: &Symmetry, held: &Pose) -> Vec<Pose> {
        placements(symmetry, self, &frame_of(held)).iter().map(pose_of).collect()
    }

    /// Returns whether the facing is a direction or an orientation: its numbers are finite and not all 0.
    pub(crate) fn is_possible(&self) -> bool {
        match &self.facing {
            Facing::Any => true,
            Facing::Axis(axis) => Vector::from(*axis).try_normalize().is_some(),
            Facing::Full(turn) => {
                let length: f64 = turn.iter().map(|v| v * v).sum();
                length.is_finite() && length > 1e-12
            }
        }
    }
}

/// Number of equally spaced turns about the vertical that are tried for [`Facing::Any`].
const ANY_TURNS: u32 = 24;

/// Returns rotations by `count` equal steps about z.
fn steps(count: u32) -> impl Iterator<Item = Rotation> {
    (0..count).map(move |k| Rotation::from_rotation_z(f64::from(k) * TAU / f64::from(count)))
}

/// Height of an axis of length 1 below which the part lies.
const LYING: f64 = 0.5;

/// Returns a rotation that takes z to `axis`. For a part that lies, it takes x upwards, so that a part with four equal
/// sides lies on one of them.
fn along(axis: Vector) -> Rotation {
    if axis.z.abs() >= LYING {
        return Rotation::from_rotation_arc(Vector::Z, axis);
    }
    let up = (Vector::Z - axis * axis.z).normalize();
    Rotation::from_mat3(&Matrix::from_cols(up, axis.cross(up), axis))
}

/// Returns the frames in which a part may stand at `target`, as its facing and symmetry allow. Frames closest to its
/// current orientation in the hand come first.
pub(crate) fn placements(symmetry: &Symmetry, target: &Target, held: &Frame) -> Vec<Frame> {
    let turns: Vec<Rotation> = match target.facing {
        Facing::Any => steps(ANY_TURNS).map(|turn| turn * held.rotation).collect(),
        Facing::Axis(axis) => {
            let axis = Vector::from(axis).normalize();
            let ways: &[f64] = if symmetry.flips { &[1.0, -1.0] } else { &[1.0] };
            let upright = |way: &f64| along(axis * *way);
            let about = |upright| steps(symmetry.turns).map(move |turn| upright * turn);
            ways.iter().map(upright).flat_map(about).collect()
        }
        Facing::Full(orientation) => {
            let whole = frame_of(&Pose { position: target.position, orientation }).rotation;
            let over = whole * Rotation::from_rotation_x(PI);
            let ways = [Some(whole), symmetry.flips.then_some(over)].into_iter().flatten();
            ways.flat_map(|way| steps(symmetry.fold).map(move |turn| way * turn)).collect()
        }
    };
    let position = Vector::from(target.position);
    let mut all: Vec<Frame> =
        turns.into_iter().map(|turn| Frame::from_parts(position, turn)).collect();
    all.sort_by(|a, b| {
        let far = |f: &Frame| f.rotation.angle_between(held.rotation);
        far(a).total_cmp(&far(b))
    });
    all
}

/// Returns the end effector's frames for `placements`, given the end effector's frame `in_hand` relative to
/// the part. Frames in which the hand reaches outwards come first.
pub(crate) fn place_tools(placements: &[Frame], in_hand: &Frame) -> Vec<Frame> {
    let mut tools: Vec<Frame> = placements.iter().map(|p| *p * *in_hand).collect();
    let inwards = |tool: &Frame| {
        let pointing = tool.rotation * Vector::Z;
        let out = Vector::new(tool.translation.x, tool.translation.y, 0.0).normalize();
        let flat = Vector::new(pointing.x, pointing.y, 0.0);
        // A hand that points straight down reaches in no direction.
        if flat.length() < 0.2 { 0.0 } else { (flat.dot(out) / flat.length()).acos() }
    };
    tools.sort_by(|a, b| {
        let coarse = |t: &Frame| (inwards(t) / FRAC_PI_4) as i32;
        coarse(a).cmp(&coarse(b))
    });
    tools
}
