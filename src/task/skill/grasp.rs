//! Grasps and placements, in order of preference.

use std::f64::consts::{FRAC_PI_4, TAU};

use rapier3d::math::{Matrix, Pose as Frame, Rotation, Vector};
use serde::{Deserialize, Serialize};

use crate::task::scene::Symmetry;

/// A grasp: the end effector's frame, and the opening of the fingers during the approach. The tool centre point lies
/// between the pads, [`FINGER_TIP_M`](crate::task::robot::FINGER_TIP_M) behind the fingers' tips.
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

/// The place and direction in which a part is to be put.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Position at which the origin of the part's frame should come to rest, in metres.
    pub position: [f64; 3],
    /// Direction in which the part's z axis should point.
    pub axis: [f64; 3],
}

impl Target {
    /// Returns a target at which the part's z axis points up.
    pub fn upright(position: [f64; 3]) -> Self {
        Self { position, axis: [0.0, 0.0, 1.0] }
    }
}

/// Returns the frames in which a part may stand at `target`: every turn about its axis and, if its symmetry
/// allows, upside down. Frames closest to its current orientation in the hand come first.
pub(crate) fn placements(symmetry: &Symmetry, target: &Target, held: &Frame) -> Vec<Frame> {
    let axis = Vector::from(target.axis).normalize();
    let ways: &[f64] = if symmetry.flips { &[1.0, -1.0] } else { &[1.0] };
    let mut all: Vec<Frame> = Vec::new();
    for way in ways {
        let upright = Rotation::from_rotation_arc(Vector::Z, axis * *way);
        all.extend((0..symmetry.turns).map(|k| {
            let turn =
                upright * Rotation::from_rotation_z(f64::from(k) * TAU / f64::from(symmetry.turns));
            Frame::from_parts(Vector::from(target.position), turn)
        }));
    }
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
