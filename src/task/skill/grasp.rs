//! Ways to take hold of a part, and ways to set it down: candidates in the order of preference.
//!
//! A grasp closes on two opposing flats of the hexagon. Lying bolts rest on a flat, so that the flats to be held are
//! 30 degrees off the horizontal; the hand tilts towards the tip, so that it is not under the bolt
//! when the bolt is upright.

use std::f64::consts::{FRAC_PI_3, FRAC_PI_4, TAU};

use rapier3d::math::{Matrix, Pose as Frame, Rotation, Vector};

use crate::task::robot::bodies::TIP_M;
use crate::task::scene::config::PartSpec;
use crate::task::scene::physics::PartKind;

/// A place for the tool, and how far the fingers are open on the way there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grasp {
    /// The tool's frame in the scene.
    pub tool: Frame,
    /// Each finger's distance from the middle, in metres.
    pub opening: f64,
}

/// How much of a nut's height is held: more, and the pads would touch the pocket's rim.
const NUT_HELD_M: f64 = 0.007;
/// How far above the head's underside the pads' tips end.
const HEAD_FREE_M: f64 = 0.002;
/// Tilts of the hand towards a lying bolt's tip, in degrees.
const TILTS: [f64; 5] = [30.0, 20.0, 38.0, 10.0, 45.0];
/// How far the pads' tips end beyond a lying bolt's axis.
const BEYOND_M: [f64; 3] = [0.0015, -0.0015, -0.004];

/// The tool's frame at `at` that points along `approach` and closes along `closing`.
fn tool(at: Vector, approach: Vector, closing: Vector) -> Frame {
    let (z, y) = (approach.normalize(), closing.normalize());
    let turn = Matrix::from_cols(y.cross(z), y, z);
    Frame::from_parts(at, Rotation::from_mat3(&turn))
}

/// The six directions out of the hexagon's flats.
fn flats(part: &Frame) -> impl Iterator<Item = Vector> {
    let turn = part.rotation;
    (0..6).map(move |k| turn * Rotation::from_rotation_z(f64::from(k) * FRAC_PI_3) * Vector::X)
}

/// Ways to take hold of a part that lies at `frame`; none for one that stands on its edge or head.
pub(crate) fn grasps(kind: PartKind, frame: &Frame, part: &PartSpec) -> Vec<Grasp> {
    let half = part.across_flats_m / 2.0;
    let axis = frame.rotation * Vector::Z;
    let at = frame.translation;
    let from_above = |top: Vector, up: Vector| -> Vec<Grasp> {
        flats(frame)
            .map(|closing| Grasp { tool: tool(top, -up, closing), opening: half + 0.005 })
            .collect()
    };
    match kind {
        PartKind::Nut if axis.z.abs() > 0.94 => {
            let up = axis * axis.z.signum();
            from_above(at + up * (part.nut_height_m / 2.0 - NUT_HELD_M + TIP_M), up)
        }
        PartKind::Bolt if axis.z > 0.94 => from_above(at + axis * (HEAD_FREE_M + TIP_M), axis),
        PartKind::Bolt if axis.z.abs() < 0.5 => lying_bolt(frame, axis, half, part),
        _ => Vec::new(),
    }
}

fn lying_bolt(frame: &Frame, axis: Vector, half: f64, part: &PartSpec) -> Vec<Grasp> {
    let middle = frame.translation + axis * (part.head_height_m / 2.0);
    let mut all = Vec::new();
    for beyond in BEYOND_M {
        for tilt in TILTS {
            let (sin, cos) = tilt.to_radians().sin_cos();
            for closing in flats(frame) {
                let up = closing.cross(axis).normalize();
                let up = up * up.z.signum();
                if up.z < 0.8 {
                    continue;
                }
                let approach = -up * cos - axis * sin;
                let at = middle + approach * (beyond - TIP_M);
                all.push(Grasp { tool: tool(at, approach, closing), opening: half + 0.003 });
            }
        }
    }
    all
}

/// Where a part is to be put.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Target {
    /// Where the origin of the part's frame should come to rest, in metres.
    pub position: [f64; 3],
    /// Which way the part's z axis should point.
    pub axis: [f64; 3],
}

/// Frames for a part at `target`: turned about its axis in every way, and for a nut, which has no upper
/// side, also upside down, those nearest to how it is held now first.
pub(crate) fn placements(kind: PartKind, target: &Target, held: &Frame) -> Vec<Frame> {
    let axis = Vector::from(target.axis).normalize();
    let ways: &[f64] = if kind == PartKind::Nut { &[1.0, -1.0] } else { &[1.0] };
    let mut all: Vec<Frame> = Vec::new();
    for way in ways {
        let upright = Rotation::from_rotation_arc(Vector::Z, axis * *way);
        all.extend((0..24).map(|k| {
            let turn = upright * Rotation::from_rotation_z(f64::from(k) * TAU / 24.0);
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
