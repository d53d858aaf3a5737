//! Grasps of a task file, in the scene.

use std::f64::consts::TAU;

use super::format::GraspData;
use crate::robot::arm::level::dot;
use crate::robot::arm::vector::{add, scale, sub, unit};
use crate::robot::arm::{BodyFrame, FINGER_TIP_M, Turn};
use crate::robot::skill::Grasp;

/// Approaches up to this angle from straight down come from above, the others from the side, in degrees.
const STEEP_DEG: f64 = 60.0;
/// Least component of an approach from the side that points away from the arm's base.
const OUTWARDS: f64 = -0.3;
/// Approaches whose angles from straight down fall into the same range of this size are equally good, in degrees.
const EQUAL_DEG: f64 = 15.0;

/// Returns the grasps for a part at `frame`: first those with the first tilt of each family, and among these the
/// steeper ones. Those from the side come last, the ones that point away from the arm's base first.
pub(super) fn grasps(families: &[GraspData], frame: &BodyFrame) -> Vec<Grasp> {
    let rounds = families.iter().map(|family| family.tilts_deg.len()).max().unwrap_or(0);
    let mut all = Vec::new();
    for round in 0..rounds {
        let mut found = Vec::new();
        for family in families {
            let Some(tilt) = family.tilts_deg.get(round) else { continue };
            for opening_m in &family.openings_m {
                found.extend(family_at(family, *tilt, *opening_m, frame));
            }
        }
        let rank = |grasp: &Grasp| match off_deg(grasp.approach) {
            angle if angle <= STEEP_DEG => ((angle / EQUAL_DEG) as i32, 0.0),
            _ => (i32::MAX, -outwards(grasp.approach, frame)),
        };
        found.sort_by(|a, b| {
            let (a, b) = (rank(a), rank(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        for grasp in found {
            // Half a turn about the axis of a symmetric family gives the same grasp as the other sense of closing.
            if !all.iter().any(|other| is_same(other, &grasp)) {
                all.push(grasp);
            }
        }
    }
    all
}

/// Returns the angle between an approach and straight down, in degrees.
fn off_deg(approach: [f64; 3]) -> f64 {
    (-approach[2]).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Returns the component of an approach that points from the arm's base to a part.
fn outwards(approach: [f64; 3], frame: &BodyFrame) -> f64 {
    let [x, y, _] = frame.position;
    dot(approach, unit([x, y, 0.0]))
}

fn is_same(a: &Grasp, b: &Grasp) -> bool {
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-6);
    near(a.at, b.at)
        && near(a.approach, b.approach)
        && near(a.closing, b.closing)
        && a.opening_m == b.opening_m
}

fn family_at(family: &GraspData, tilt_deg: f64, opening_m: f64, frame: &BodyFrame) -> Vec<Grasp> {
    let approach = unit(family.approach);
    let closing = unit(sub(family.closing, scale(approach, dot(approach, family.closing))));
    let tilted = Turn::about(closing, tilt_deg.to_radians()).apply(approach);
    let (axis, times) = family.around.map_or(([0.0, 0.0, 1.0], 1), |a| (unit(a.axis), a.times));
    let mut all = Vec::new();
    for k in 0..times {
        let turn = frame.turn * Turn::about(axis, TAU * f64::from(k) / f64::from(times));
        let approach = turn.apply(tilted);
        if -approach[2] < family.most_deg.to_radians().cos() {
            continue;
        }
        if off_deg(approach) > STEEP_DEG && outwards(approach, frame) < OUTWARDS {
            continue;
        }
        let tips = add(frame.position, turn.apply(family.at));
        let at = add(tips, scale(approach, family.beyond_m - FINGER_TIP_M));
        for sense in [1.0, -1.0] {
            let closing = scale(turn.apply(closing), sense);
            all.push(Grasp { at, approach, closing, opening_m });
        }
    }
    all
}

#[cfg(test)]
#[path = "../../../../tests/unit/task_file_grasps.rs"]
mod tests;
