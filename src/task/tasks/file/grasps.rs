//! Grasps of a task file, in the scene.

use std::f64::consts::TAU;

use super::format::GraspData;
use crate::robot::arm::level::dot;
use crate::robot::arm::vector::{add, scale, sub, unit};
use crate::robot::arm::{BodyFrame, FINGER_TIP_M, Turn};
use crate::robot::scene::Sensed;
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

/// Returns the grasps of a family for a part at `frame` that the hand can come to from there.
fn family_at(family: &GraspData, tilt_deg: f64, opening_m: f64, frame: &BodyFrame) -> Vec<Grasp> {
    let most = family.most_deg.to_radians().cos();
    let from_here = |grasp: &Grasp| {
        let approach = grasp.approach;
        -approach[2] >= most
            && (off_deg(approach) <= STEEP_DEG || outwards(approach, frame) >= OUTWARDS)
    };
    turns(family, tilt_deg, opening_m, frame).flatten().filter(from_here).collect()
}

/// Returns whether any of a part lies between the fingers before they close.
pub(super) fn holds(grasp: &Grasp, scene: &Sensed<'_>, part: usize) -> bool {
    grasp.tool().is_some_and(|tool| scene.is_between_fingers(part, &tool, grasp.opening_m))
}

/// Returns how many grasps of a family for a part at `frame` close on nothing, in words; `None` if none does.
pub(super) fn empty(
    family: &GraspData,
    frame: &BodyFrame,
    scene: &Sensed<'_>,
    part: usize,
) -> Option<String> {
    let ways =
        family.tilts_deg.iter().flat_map(|tilt| family.openings_m.iter().map(move |m| (tilt, m)));
    let (mut of, mut empty, mut first) = (0, 0, false);
    for (tilt, opening_m) in ways {
        for (turn, [grasp, _]) in turns(family, *tilt, *opening_m, frame).enumerate() {
            let holds = holds(&grasp, scene, part);
            first |= holds && turn == 0;
            of += 1;
            empty += usize::from(!holds);
        }
    }
    let why = match first && family.around.is_some() {
        true => "`around` turns about an axis through the origin of the part's frame",
        false => "none of the part is between the fingers there",
    };
    (empty > 0).then(|| format!("{empty} of {of} grasps close on nothing and are not used: {why}"))
}

/// Returns the grasps of a family for a part at `frame`: for each turn about the axis of `around`, both senses of
/// closing.
pub(super) fn turns(
    family: &GraspData,
    tilt_deg: f64,
    opening_m: f64,
    frame: &BodyFrame,
) -> impl Iterator<Item = [Grasp; 2]> {
    let approach = unit(family.approach);
    let closing = unit(sub(family.closing, scale(approach, dot(approach, family.closing))));
    let tilted = Turn::about(closing, tilt_deg.to_radians()).apply(approach);
    let (axis, times) = family.around.map_or(([0.0, 0.0, 1.0], 1), |a| (unit(a.axis), a.times));
    (0..times).map(move |k| {
        let turn = frame.turn * Turn::about(axis, TAU * f64::from(k) / f64::from(times));
        let approach = turn.apply(tilted);
        let tips = add(frame.position, turn.apply(family.at));
        let at = add(tips, scale(approach, family.beyond_m - FINGER_TIP_M));
        let closing = turn.apply(closing);
        [1.0, -1.0].map(|sense| Grasp { at, approach, closing: scale(closing, sense), opening_m })
    })
}

#[cfg(test)]
#[path = "../../../../tests/unit/task_file_grasps.rs"]
mod tests;
