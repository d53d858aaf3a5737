//! Grasps computed from a part's shape alone: the fingers close on two opposing surfaces.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};

use rapier3d::math::{Matrix, Pose as Frame, Rotation, Vector};

use super::grasp::Grasp;
use super::reach;
use super::solid::{Face, Solid};
use crate::robot::arm::FINGER_TIP_M;
use crate::robot::arm::kinematics::HOME;
use crate::robot::scene::Sensed;

/// Greatest number of grasps that [`any_grasps`] returns.
pub const MOST_GRASPS: usize = 48;
/// Greatest angle between the closing direction and the normal of a surface, in radians.
const SLOPE_RAD: f64 = FRAC_PI_6;
/// Widest grasp below the gripper's greatest opening, in metres on each side.
const SPARE_M: f64 = 2.5e-3;
/// Distances between finger and part on each side before the fingers close, in metres. The first that is free is used.
const AROUND_M: [f64; 3] = [0.006, 0.004, 0.0025];
/// Room that a finger needs between two walls of a part, in metres.
const BETWEEN_M: f64 = 0.011;
/// Distances by which the fingers' tips reach past the middle of a contact, in metres.
const BEYOND_M: [f64; 4] = [0.006, 0.003, 0.0, 0.010];
/// Step between two directions of approach about the closing direction, and greatest angle from the steepest, in
/// degrees.
const APPROACH_DEG: (i32, i32) = (15, 75);
/// Least downward component of the approach.
const DOWN: f64 = 0.17;
/// Greatest vertical component of the closing direction.
const LEVEL: f64 = 0.8;
/// Greatest number of grasps that are tested for collisions.
const TESTS: usize = 600;
/// Greatest number of samples on the surface, and greatest number times the part's faces. The second bounds the time for
/// parts with thousands of faces.
const SAMPLES: usize = 400;
const SAMPLES_BY_FACES: usize = 60_000;

/// Two opposing places on a part's surface, in the part's frame.
struct Pair {
    /// Point in the middle between the two places.
    middle: Vector,
    /// Direction from one place to the other.
    closing: Vector,
    /// Half the distance between the two places, in metres.
    half_m: f64,
}

/// A grasp that has not been tested yet.
struct Candidate {
    tool: Frame,
    half_m: f64,
    cost: f64,
}

/// Returns grasps for a part in any pose, computed from its shape, best first: the fingers close on opposing surfaces
/// that are at most 30 degrees from perpendicular, within the gripper's opening, with the hand pointing down or
/// sideways. The hand alone touches nothing at these grasps and in front of them, and the arm has a posture for them.
/// Returns at most [`MOST_GRASPS`]; none for a part that is [lost](Sensed::lost) or on a slider. Costs some tens of
/// milliseconds.
///
/// Use them after the task's own grasps, for parts that came to rest in a pose for which the task has no grasp.
pub fn any_grasps(scene: &Sensed<'_>, part: usize) -> Vec<Grasp> {
    if scene.lost(part) || scene.slider(part).is_some() {
        return Vec::new();
    }
    let Some(solid) = Solid::of(scene, part) else { return Vec::new() };
    let frame = scene.part_frame(part);
    let stroke = scene.gripper().stroke_m;
    let mut candidates: Vec<Candidate> = pairs(&solid, stroke)
        .iter()
        .flat_map(|pair| approaches(&solid, &frame, pair, stroke))
        .collect();
    candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    choose(scene, &candidates, stroke)
}

/// Returns points on a face: its middle, and points between the middle and the corners of a wide face.
fn samples(face: &Face) -> Vec<Vector> {
    let far = |corner: &&Vector| (**corner - face.middle).length() > 4e-3;
    let step = face.corners.len().div_ceil(6);
    let outer = face.corners.iter().step_by(step.max(1)).filter(far);
    std::iter::once(face.middle).chain(outer.map(|c| face.middle.lerp(*c, 0.55))).collect()
}

/// Returns pairs of opposing places that fit between the fingers.
fn pairs(solid: &Solid, stroke: f64) -> Vec<Pair> {
    let mut all: Vec<Pair> = Vec::new();
    let faces: Vec<&Face> = solid.pieces.iter().flat_map(|piece| &piece.faces).collect();
    let most = (SAMPLES_BY_FACES / faces.len().max(1)).clamp(8, SAMPLES);
    let (mut count, mut tests) = (0, 0);
    for face in faces.iter().step_by(faces.len().div_ceil(most).max(1)) {
        for point in samples(face) {
            tests += 1;
            // A face between two pieces is no surface.
            if count >= most || tests > 4 * most || solid.contains(point + face.normal * 5e-4) {
                continue;
            }
            count += 1;
            let inwards = -face.normal;
            let runs = solid.runs(point - inwards * 1e-5, inwards);
            for (index, run) in runs.iter().enumerate().filter(|(_, run)| run.to > 0.0) {
                let room = runs.get(index + 1).is_none_or(|next| next.from - run.to > BETWEEN_M);
                let fits = run.to / 2.0 + SPARE_M <= stroke;
                if !room || !fits || run.out.dot(inwards) < SLOPE_RAD.cos() {
                    continue;
                }
                let half_m = run.to / 2.0;
                let pair = Pair { middle: point + inwards * half_m, closing: inwards, half_m };
                let same = |other: &Pair| {
                    (other.middle - pair.middle).length() < 1.5e-3
                        && other.closing.dot(pair.closing).abs() > 0.998
                };
                if !all.iter().any(same) {
                    all.push(pair);
                }
            }
        }
    }
    all
}

/// Returns the ways in which the hand can come to a pair of places.
fn approaches(solid: &Solid, frame: &Frame, pair: &Pair, stroke: f64) -> Vec<Candidate> {
    let closing = frame.rotation * pair.closing;
    if closing.z.abs() > LEVEL {
        return Vec::new();
    }
    let steepest = (closing * closing.z - Vector::Z).normalize();
    let (step, most) = APPROACH_DEG;
    let mut all = Vec::new();
    for degrees in (-most..=most).step_by(step as usize) {
        let turn = Rotation::from_axis_angle(closing, f64::from(degrees).to_radians());
        let approach = turn * steepest;
        if approach.z > -DOWN {
            continue;
        }
        let turn = Matrix::from_cols(closing.cross(approach), closing, approach);
        let turn = Rotation::from_mat3(&turn);
        for (rank, beyond) in BEYOND_M.into_iter().enumerate() {
            let at = *frame * pair.middle + approach * (beyond - FINGER_TIP_M);
            let tool = Frame::from_parts(at, turn);
            if let Some(candidate) = held(solid, frame, &tool, [pair.half_m, stroke], rank) {
                all.push(candidate);
            }
        }
    }
    all
}

/// Distances from the tool centre point at which the pads are sampled, in metres: across the pads, and along them.
const ACROSS_M: [f64; 3] = [-0.007, 0.0, 0.007];
const ALONG_M: [f64; 5] = [0.005, 0.001, -0.004, -0.011, -0.020];
/// Distance beyond a contact within which the same wall of the part may lie, in metres.
const WALL_M: f64 = 0.004;
/// Difference in depth at which both of two points touch a pad, in metres.
const FLAT_M: f64 = 5e-4;

/// Returns the grasp with the end effector near `tool` that centres the part between the pads; `None` if the pads
/// would not hold the part. The pads meet the part about `near_m` metres from the middle, and at most `stroke` metres.
fn held(
    solid: &Solid,
    frame: &Frame,
    tool: &Frame,
    [near_m, stroke]: [f64; 2],
    rank: usize,
) -> Option<Candidate> {
    let local = frame.inv_mul(tool);
    let [across, closing, along] = [Vector::X, Vector::Y, Vector::Z].map(|v| local.rotation * v);
    let mut ends: Vec<(f64, f64)> = Vec::new();
    for x in ACROSS_M {
        for z in ALONG_M {
            let at = local.translation + across * x + along * z;
            // Behind a finger there may be another wall of the part.
            let around = near_m + WALL_M;
            let between = |run: &&super::solid::Run| run.from < around && run.to > -around;
            let runs = solid.runs(at, closing);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for run in runs.iter().filter(between) {
                (low, high) = (low.min(run.from), high.max(run.to));
            }
            if low < high {
                ends.push((low, high));
            }
        }
    }
    let low = ends.iter().map(|e| e.0).fold(f64::INFINITY, f64::min);
    let high = ends.iter().map(|e| e.1).fold(f64::NEG_INFINITY, f64::max);
    let half_m = (high - low) / 2.0;
    // NaN and an empty list fail here.
    if !(half_m > 5e-4 && half_m + SPARE_M <= stroke) {
        return None;
    }
    let held_low = ends.iter().filter(|e| e.0 < low + FLAT_M).count();
    let held_high = ends.iter().filter(|e| e.1 > high - FLAT_M).count();
    let at = tool.translation + tool.rotation * Vector::Y * ((high + low) / 2.0);
    let tool = Frame::from_parts(at, tool.rotation);
    let lever = frame.transform_point(solid.middle) - at;
    let axis = tool.rotation * Vector::Y;
    let lever = (lever - axis * lever.dot(axis)).length();
    let tilt = (-(tool.rotation * Vector::Z).z).clamp(-1.0, 1.0).acos() / FRAC_PI_2;
    let thin = |count: usize| match count {
        0 | 1 => 0.6,
        2 => 0.25,
        3 => 0.1,
        _ => 0.0,
    };
    let cost = 1.2 * tilt * tilt
        + lever / 0.03
        + thin(held_low)
        + thin(held_high)
        + 0.6 * axis.z.abs()
        + 0.03 * rank as f64;
    Some(Candidate { tool, half_m, cost })
}

/// Least distance, in metres, and least turn, in radians, between two chosen grasps: first few that differ much, then
/// more between them.
const APART: [(f64, f64); 2] = [(0.015, 0.45), (0.004, 0.2)];

/// Returns the best candidates that differ from each other and at which the hand touches nothing.
fn choose(scene: &Sensed<'_>, candidates: &[Candidate], stroke: f64) -> Vec<Grasp> {
    let mut chosen: Vec<&Candidate> = Vec::new();
    let mut tested = vec![false; candidates.len()];
    let mut all = Vec::new();
    let mut left = TESTS;
    for (apart_m, apart_rad) in APART {
        for (candidate, tested) in candidates.iter().zip(&mut tested) {
            let same = |other: &&Candidate| {
                let turn = other.tool.rotation.angle_between(candidate.tool.rotation);
                let way = (other.tool.translation - candidate.tool.translation).length();
                way < apart_m && turn < apart_rad
            };
            if *tested || chosen.iter().any(same) {
                continue;
            }
            if left == 0 || all.len() >= MOST_GRASPS {
                break;
            }
            (left, *tested) = (left - 1, true);
            let Some(opening_m) = opening(scene, candidate, stroke) else { continue };
            let grasps = both_ways(candidate, opening_m);
            if !grasps.is_empty() {
                chosen.push(candidate);
                all.extend(grasps);
            }
        }
    }
    all.truncate(MOST_GRASPS);
    all
}

/// Returns a grasp and the same grasp with the hand turned by half a turn, for which the arm has another posture.
fn both_ways(candidate: &Candidate, opening_m: f64) -> Vec<Grasp> {
    let (at, turn) = (candidate.tool.translation.to_array(), candidate.tool.rotation);
    let grasp = |sense: f64| Grasp {
        at,
        approach: (turn * Vector::Z).to_array(),
        closing: (turn * Vector::Y * sense).to_array(),
        opening_m,
    };
    let reached = |grasp: &Grasp| grasp.tool().is_some_and(|tool| reach::has_posture(&HOME, &tool));
    [1.0, -1.0].into_iter().map(grasp).filter(reached).collect()
}

/// Returns the opening with which the hand can come to a grasp without touching anything.
fn opening(scene: &Sensed<'_>, candidate: &Candidate, stroke: f64) -> Option<f64> {
    let Candidate { tool, half_m, .. } = candidate;
    let back = tool.rotation * -Vector::Z;
    // The fingers must not touch anything else when they close.
    let behind = |by: f64| Frame::from_parts(tool.translation + back * by, tool.rotation);
    AROUND_M.into_iter().map(|around| (half_m + around).min(stroke)).find(|opening| {
        [0.0, 0.012, 0.03, 0.06].iter().all(|by| !scene.hand_collides(&behind(*by), *opening, &[]))
    })
}
