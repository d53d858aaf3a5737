//! Grasps for nuts and bolts, the best first.
//!
//! A grasp closes on two opposing flats of the hexagon. A lying bolt rests on a flat, so the flats to grasp are 30
//! degrees off the horizontal. The hand tilts towards the bolt's tip, so that the hand is not below the bolt once the
//! bolt is upright.

use std::f64::consts::FRAC_PI_3;

use super::settings::PartSpec;
use crate::robot::arm::vector::{add, cross, scale, sub, unit};
use crate::robot::arm::{BodyFrame, FINGER_TIP_M, Turn};
use crate::robot::skill::Grasp;

/// Length of a nut's flats that the pads cover, in metres. With more, the pads would touch the pocket's rim.
const NUT_HELD_M: f64 = 0.007;
/// Height of the pads' tips above the underside of the head, in metres.
const HEAD_FREE_M: f64 = 0.002;
/// Tilts of the hand towards a lying bolt's tip, in degrees.
const TILTS: [f64; 5] = [30.0, 20.0, 38.0, 10.0, 45.0];
/// Distances of the pads' tips beyond a lying bolt's axis, in metres.
const BEYOND_M: [f64; 3] = [0.0015, -0.0015, -0.004];

/// Returns the six directions out of the hexagon's flats.
fn flats(part: &BodyFrame) -> impl Iterator<Item = [f64; 3]> {
    let turn = part.turn;
    (0..6).map(move |k| (turn * Turn::about_z(f64::from(k) * FRAC_PI_3)).apply([1.0, 0.0, 0.0]))
}

/// Returns the direction of the part's z axis.
fn axis(part: &BodyFrame) -> [f64; 3] {
    part.turn.apply([0.0, 0.0, 1.0])
}

fn from_above(frame: &BodyFrame, top: [f64; 3], up: [f64; 3], half: f64) -> Vec<Grasp> {
    let approach = scale(up, -1.0);
    flats(frame)
        .map(|closing| Grasp { at: top, approach, closing, opening_m: half + 0.005 })
        .collect()
}

/// Returns the grasps for a nut; no grasps if the nut stands on its edge.
pub(super) fn nut(frame: &BodyFrame, part: &PartSpec) -> Vec<Grasp> {
    let axis = axis(frame);
    if axis[2].abs() <= 0.94 {
        return Vec::new();
    }
    let up = scale(axis, axis[2].signum());
    let above = part.nut_height_m / 2.0 - NUT_HELD_M + FINGER_TIP_M;
    from_above(frame, add(frame.position, scale(up, above)), up, part.across_flats_m / 2.0)
}

/// Returns the grasps for a bolt; no grasps if the bolt stands on its head.
pub(super) fn bolt(frame: &BodyFrame, part: &PartSpec) -> Vec<Grasp> {
    let (axis, half) = (axis(frame), part.across_flats_m / 2.0);
    if axis[2] > 0.94 {
        let top = add(frame.position, scale(axis, HEAD_FREE_M + FINGER_TIP_M));
        return from_above(frame, top, axis, half);
    }
    if axis[2].abs() < 0.5 { lying_bolt(frame, axis, half, part) } else { Vec::new() }
}

fn lying_bolt(frame: &BodyFrame, axis: [f64; 3], half: f64, part: &PartSpec) -> Vec<Grasp> {
    let middle = add(frame.position, scale(axis, part.head_height_m / 2.0));
    let mut all = Vec::new();
    for beyond in BEYOND_M {
        for tilt in TILTS {
            let (sin, cos) = tilt.to_radians().sin_cos();
            for closing in flats(frame) {
                let up = unit(cross(closing, axis));
                let up = scale(up, up[2].signum());
                if up[2] < 0.8 {
                    continue;
                }
                let approach = sub(scale(scale(up, -1.0), cos), scale(axis, sin));
                let at = add(middle, scale(approach, beyond - FINGER_TIP_M));
                all.push(Grasp { at, approach, closing, opening_m: half + 0.003 });
            }
        }
    }
    all
}
