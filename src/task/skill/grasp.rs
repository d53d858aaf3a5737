//! Ways to take hold of a part, and ways to set it down, in the order of preference.

use std::f64::consts::{FRAC_PI_4, TAU};

use rapier3d::math::{Matrix, Pose as Frame, Rotation, Vector};
use serde::{Deserialize, Serialize};

use crate::task::scene::Symmetry;

/// A way to take hold of a part: where the tool is put, and how far the fingers are open on the way there. The tool's
/// origin is between the pads, [`FINGER_TIP_M`](crate::task::robot::FINGER_TIP_M) before the fingers' tips.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grasp {
    /// The tool's origin in the scene, in metres.
    pub at: [f64; 3],
    /// The direction in which the hand points.
    pub approach: [f64; 3],
    /// The direction along which the fingers close, square to `approach`.
    pub closing: [f64; 3],
    /// Each finger's distance from the middle, in metres.
    pub opening_m: f64,
}

impl Grasp {
    /// The tool's frame; `None` if a direction has no length or they are not square to one another.
    pub(crate) fn tool(&self) -> Option<Frame> {
        let [at, approach, closing] = [self.at, self.approach, self.closing].map(Vector::from);
        let (z, y) = (approach.normalize(), closing.normalize());
        // A direction without length makes this not a number.
        let square = at.is_finite() && z.dot(y).abs() < 1e-6;
        let turn = Matrix::from_cols(y.cross(z), y, z);
        square.then(|| Frame::from_parts(at, Rotation::from_mat3(&turn)))
    }
}

/// Where a part is to be put.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Where the origin of the part's frame should come to rest, in metres.
    pub position: [f64; 3],
    /// Which way the part's z axis should point.
    pub axis: [f64; 3],
}

impl Target {
    /// A place at which the part's z axis points up.
    pub fn upright(position: [f64; 3]) -> Self {
        Self { position, axis: [0.0, 0.0, 1.0] }
    }
}

/// Frames for a part at `target`: turned about its axis in every way and, where that is the same, also upside down,
/// those nearest to how it is held now first.
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

/// The tool's frames at which a part, taken as `in_hand` says (the tool in the part's frame), stands as
/// one of `placements`; the hand reaching outwards first.
pub(crate) fn place_tools(placements: &[Frame], in_hand: &Frame) -> Vec<Frame> {
    let mut tools: Vec<Frame> = placements.iter().map(|p| *p * *in_hand).collect();
    let inwards = |tool: &Frame| {
        let pointing = tool.rotation * Vector::Z;
        let out = Vector::new(tool.translation.x, tool.translation.y, 0.0).normalize();
        let flat = Vector::new(pointing.x, pointing.y, 0.0);
        // A hand that points down has no side.
        if flat.length() < 0.2 { 0.0 } else { (flat.dot(out) / flat.length()).acos() }
    };
    tools.sort_by(|a, b| {
        let coarse = |t: &Frame| (inwards(t) / FRAC_PI_4) as i32;
        coarse(a).cmp(&coarse(b))
    });
    tools
}
