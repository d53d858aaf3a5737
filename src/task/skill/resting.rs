//! The poses in which a part can rest on the table, and free places for it.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use rapier3d::math::{Pose as Frame, Rotation, Vector};

use super::grasp::{Grasp, Target};
use super::solid::Solid;
use super::{any_grasps, reach};
use crate::task::robot::arm::HOME;
use crate::task::robot::frame::pose_of;
use crate::task::scene::physics::Scene;

/// Greatest number of targets that [`free_places`] returns.
pub const MOST_PLACES: usize = 16;
/// Least angle by which a part must be tilted before it falls over, in radians. Parts less steady are not put down.
const STEADY_RAD: f64 = 0.17;
/// Distance of a part at a free place from everything else, in metres.
const ROOM_M: f64 = 0.022;
/// Distance of a part at a free place from the rim, in metres.
const FROM_RIM_M: f64 = 0.035;
/// Distance between two places that are tried, in metres.
const GRID_M: f64 = 0.03;
/// Least and greatest distance from the arm's foot of a comfortable place, in metres.
const REACH_M: (f64, f64) = (0.34, 0.62);
/// Greatest number of places that are tried for each way of resting.
const TRIES: usize = 40;

/// A way in which a part rests on a level surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest {
    /// Rotation of the part.
    pub turn: Rotation,
    /// Height of the part's origin above the surface, in metres.
    pub height_m: f64,
    /// Angle by which the part can be tilted before it falls over, in radians.
    pub steady_rad: f64,
    /// Height of the centre of mass above the surface, in metres.
    pub middle_m: f64,
}

impl Rest {
    /// Returns whether two ways of resting look alike, up to turns about the part's z axis.
    fn is_like(&self, other: &Self) -> bool {
        (self.middle_m - other.middle_m).abs() < 2e-4
            && (self.steady_rad - other.steady_rad).abs() < 0.02
            && ((self.turn * Vector::Z).z - (other.turn * Vector::Z).z).abs() < 0.1
    }
}

/// Returns every way in which a part rests, with the part turned as little as possible from `now`.
pub(super) fn rests(solid: &Solid, now: Rotation) -> Vec<Rest> {
    let rest = |face: &super::solid::Face| {
        let down = now * face.normal;
        let turn = arc(down, -Vector::Z) * now;
        let over = |point: Vector| (turn * point).z;
        let floor = solid.corners.iter().map(|c| over(*c)).fold(f64::INFINITY, f64::min);
        let middle_m = over(solid.middle) - floor;
        let steady_rad = steadiness(face, solid.middle);
        Rest { turn, height_m: -floor, steady_rad, middle_m }
    };
    solid.hull().iter().map(rest).filter(|r| r.steady_rad > 0.0).collect()
}

/// Returns the shortest rotation between two directions, also if they are opposite.
fn arc(from: Vector, to: Vector) -> Rotation {
    if from.dot(to) < -1.0 + 1e-9 {
        let side = from.any_orthonormal_vector();
        return Rotation::from_axis_angle(side, std::f64::consts::PI);
    }
    Rotation::from_rotation_arc(from, to)
}

/// Returns the angle by which a part that rests on `face` can be tilted before it falls over, in radians; negative if
/// it does not rest there.
fn steadiness(face: &super::solid::Face, middle: Vector) -> f64 {
    let height = (face.middle - middle).dot(face.normal);
    let count = face.corners.len();
    let edges = (0..count).map(|i| (face.corners[i], face.corners[(i + 1) % count]));
    let inside = edges.map(|(a, b)| {
        let along = (b - a).normalize_or_zero();
        let outward = along.cross(face.normal);
        // The corners may run either way round.
        let outward = if outward.dot(a - face.middle) < 0.0 { -outward } else { outward };
        (a - middle).dot(outward)
    });
    inside.fold(f64::INFINITY, f64::min).atan2(height)
}

/// Returns places on the table at which the part can be laid down to be taken anew, for
/// [`Robot::begin`](super::Robot::begin). The part rests steadily there, at least 35 mm inside the rim and 22 mm from
/// everything else, and the arm reaches the place with one of [`any_grasps`]. Near places come first, and ways of
/// resting alternate, the steadiest first. Returns at most [`MOST_PLACES`]. Costs some tens of milliseconds.
pub fn free_places(scene: &Scene, part: usize) -> Vec<Target> {
    let grasps = any_grasps(scene, part);
    places(scene, part, &grasps)
}

fn places(scene: &Scene, part: usize, grasps: &[Grasp]) -> Vec<Target> {
    let Some(solid) = Solid::of(scene, part) else { return Vec::new() };
    if scene.lost(part) || scene.slider(part).is_some() {
        return Vec::new();
    }
    let frame = scene.part_frame(part);
    let mut kinds: Vec<Rest> = Vec::new();
    let mut all = rests(&solid, frame.rotation);
    all.retain(|rest| rest.steady_rad > STEADY_RAD);
    all.sort_by(|a, b| {
        let turned = |r: &Rest| r.turn.angle_between(frame.rotation);
        turned(a).total_cmp(&turned(b))
    });
    for rest in all {
        if !kinds.iter().any(|other| other.is_like(&rest)) {
            kinds.push(rest);
        }
    }
    // Steadiest first; among equals, the part's z axis up before lying before down.
    kinds.sort_by_key(|rest| {
        let up = (rest.turn * Vector::Z).z;
        (-(rest.steady_rad / 0.2) as i64, if up > 0.7 { 0 } else { i64::from(up < -0.7) + 1 })
    });
    let per_kind = MOST_PLACES.div_ceil(kinds.len().max(1)).clamp(2, 6);
    let grasps: Vec<Frame> = grasps.iter().filter_map(Grasp::tool).collect();
    let mut found: Vec<Vec<Target>> = Vec::new();
    for rest in &kinds {
        found.push(for_rest(scene, part, &solid, rest, &grasps, per_kind));
    }
    let rounds = found.iter().map(Vec::len).max().unwrap_or(0);
    let round = |n: usize| found.iter().filter_map(move |own| own.get(n)).copied();
    (0..rounds).flat_map(round).take(MOST_PLACES).collect()
}

/// Returns places for one way of resting.
fn for_rest(
    scene: &Scene,
    part: usize,
    solid: &Solid,
    rest: &Rest,
    grasps: &[Frame],
    most: usize,
) -> Vec<Target> {
    let frame = scene.part_frame(part);
    let mut found: Vec<Target> = Vec::new();
    let mut used: Vec<Vector> = Vec::new();
    for (index, at) in grid(scene, &frame.transform_point(solid.middle)).into_iter().enumerate() {
        if found.len() >= most || index >= TRIES {
            break;
        }
        // Places next to each other offer nothing new.
        if used.iter().any(|other| (*other - at).length() < 0.06) {
            continue;
        }
        let turns = [0.0, FRAC_PI_2, -FRAC_PI_2, FRAC_PI_4, -FRAC_PI_4, 2.0 * FRAC_PI_2];
        let turns = turns.map(|turn| Rotation::from_rotation_z(turn) * rest.turn);
        for turn in turns.iter().cycle().skip(index).take(3) {
            let middle = *turn * solid.middle;
            let at = Vector::new(at.x - middle.x, at.y - middle.y, rest.height_m);
            let place = Frame::from_parts(at, *turn);
            if has_room(scene, part, solid, &place) && reaches(scene, part, &frame, &place, grasps)
            {
                found.push(Target::pose(&pose_of(&place)));
                used.push(Vector::new(at.x + middle.x, at.y + middle.y, 0.0));
                break;
            }
        }
    }
    found
}

/// Returns points on the table within comfortable reach, those near `at` first.
fn grid(scene: &Scene, at: &Vector) -> Vec<Vector> {
    let [low, high] = scene.spec().table.rim;
    let count = |i: usize| ((high[i] - low[i]) / GRID_M).floor().clamp(0.0, 200.0) as u32;
    let line = |i: usize| {
        let spare = (high[i] - low[i] - f64::from(count(i)) * GRID_M) / 2.0;
        (0..=count(i)).map(move |n| low[i] + spare + f64::from(n) * GRID_M)
    };
    let mut all: Vec<Vector> =
        line(0).flat_map(|x| line(1).map(move |y| Vector::new(x, y, 0.0))).collect();
    all.retain(|p| (REACH_M.0..=REACH_M.1).contains(&p.length()));
    let far = |p: &Vector| (p.x - at.x).hypot(p.y - at.y);
    all.sort_by(|a, b| far(a).total_cmp(&far(b)));
    all
}

/// Returns whether a part at `place` is well inside the rim and away from everything else.
pub(super) fn has_room(scene: &Scene, part: usize, solid: &Solid, place: &Frame) -> bool {
    let [low, high] = scene.spec().table.rim;
    let inside = solid.corners.iter().all(|corner| {
        let p = place.transform_point(*corner);
        p.x > low[0] + FROM_RIM_M
            && p.x < high[0] - FROM_RIM_M
            && p.y > low[1] + FROM_RIM_M
            && p.y < high[1] - FROM_RIM_M
    });
    let raised = |x: f64, y: f64| {
        let at = place.translation + Vector::new(x, y, 1.5e-3);
        Frame::from_parts(at, place.rotation)
    };
    let around = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
    inside
        && around.iter().all(|(x, y)| !scene.part_collides(part, &raised(x * ROOM_M, y * ROOM_M)))
}

/// Returns whether the hand can put the part at `place` with one of the end effector's frames `grasps`.
fn reaches(scene: &Scene, part: usize, now: &Frame, place: &Frame, grasps: &[Frame]) -> bool {
    let opening = scene.handling(part).release_m;
    grasps.iter().any(|tool| {
        let tool = *place * now.inv_mul(tool);
        (tool.rotation * Vector::Z).z < -0.1
            && !scene.hand_collides(&tool, opening, &[part])
            && reach::has_posture(&HOME, &tool)
    })
}
