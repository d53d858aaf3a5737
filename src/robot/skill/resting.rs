//! The poses in which a part can rest on the table, and free places for it.

use std::f64::consts::FRAC_PI_4;

use rapier3d::math::{Pose as Frame, Rotation, Vector};

use super::grasp::{Facing, Grasp, Target};
use super::solid::Solid;
use super::{any_grasps, reach};
use crate::robot::Pose;
use crate::robot::arm::frame::{frame_of, pose_of};
use crate::robot::arm::kinematics::HOME;
use crate::robot::scene::Sensed;

/// Greatest number of targets that [`free_places`] returns.
pub const MOST_PLACES: usize = 16;
/// Least angle by which a part must be tilted before it falls over, in radians. Parts less steady are not put down.
pub(super) const STEADY_RAD: f64 = 0.17;
/// Angle between a part's orientation and a way of resting below which the part rests in this way, in radians.
pub(super) const RESTS_RAD: f64 = 0.06;
/// Heights of the centre of mass that differ less are equal, in metres.
pub(super) const ODD_M: f64 = 2e-3;
/// Distance of a part at a free place from everything else, in metres.
const ROOM_M: f64 = 0.022;
/// Distance of a part at a free place from the rim, in metres.
const FROM_RIM_M: f64 = 0.035;
/// Distance of a part's centre of mass from the scene's landmarks, where other parts may have to go, in metres.
const FROM_MARK_M: f64 = 0.05;
/// Distance between two places that are tried, in metres.
const GRID_M: f64 = 0.03;
/// Least and greatest distance from the arm's foot of a comfortable place, in metres.
const REACH_M: (f64, f64) = (0.34, 0.62);
/// Least distance between two places for one way of resting, in metres.
const BETWEEN_M: f64 = 0.06;
/// Greatest number of places with orientation and grasp that are tried for each way of resting.
const TRIES: usize = 400;
/// Greatest number of faces, and of combinations of face and grasp, that are tried at each place.
const MOST_FACES: usize = 24;
const MOST_HOLDS: usize = 16;
/// Turns about the vertical that are tried at each place, in eighths of a turn.
const TURN_ORDER: [f64; TURNS] = [0.0, 2.0, -2.0, 1.0, -1.0, 4.0, 3.0, -3.0];
const TURNS: usize = 8;
/// Least downward component of the hand's direction.
const DOWN: f64 = 0.15;
/// Cosine of the angle between two downward directions in the part's frame above which the part rests in one way.
const TURNED: f64 = 0.9;

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
/// everything else, and the arm reaches the place with one of [`any_grasps`]. Near places come first. Ways of resting
/// alternate: those with a low centre of mass come first, among equals those with the part's z axis up. A part that has
/// room where it is but does not rest in the lowest way gets the way in which it rests last. Returns at most
/// [`MOST_PLACES`]. Costs some tens of milliseconds.
pub fn free_places(scene: &Sensed<'_>, part: usize) -> Vec<Target> {
    if scene.lost(part) || scene.slider(part).is_some() {
        return Vec::new();
    }
    let Some(solid) = Solid::of(scene, part) else { return Vec::new() };
    let frame = scene.part_frame(part);
    let turned = |rest: &Rest| rest.turn.angle_between(frame.rotation);
    let ways = ways(&solid, &frame);
    let lowest = ways.iter().map(|own| own[0].middle_m).fold(f64::INFINITY, f64::min);
    let room = has_room(scene, part, &solid, &frame);
    let odd =
        |own: &[Rest]| room && turned(&own[0]) < RESTS_RAD && own[0].middle_m > lowest + ODD_M;
    let grasps: Vec<Frame> = any_grasps(scene, part).iter().filter_map(Grasp::tool).collect();
    let laying = Laying { scene, part, solid: &solid, frame, grasps };
    let most = MOST_PLACES.div_ceil(ways.len().max(1)).clamp(2, 6);
    let (mut found, mut last) = (Vec::new(), Vec::new());
    for own in &ways {
        let places = laying.places(own, most);
        if odd(own) { last = places } else { found.push(places) }
    }
    let rounds = found.iter().map(Vec::len).max().unwrap_or(0);
    let round = |n: usize| found.iter().filter_map(move |own| own.get(n)).copied();
    (0..rounds).flat_map(round).chain(last).take(MOST_PLACES).collect()
}

/// Returns the height of a part's lowest point relative to the origin of its frame, as the part lies now, in metres: 0
/// or less for a part whose origin is inside it.
pub(crate) fn lowest(scene: &Sensed<'_>, part: usize) -> f64 {
    let frame = scene.part_frame(part);
    let solid = Solid::of(scene, part);
    let corners = solid.iter().flat_map(|solid| &solid.corners);
    let heights = corners.map(|c| (frame.rotation * *c).z);
    heights.fold(f64::INFINITY, f64::min).min(0.0)
}

/// Returns whether a part at `target` rests in another way than now: on another face. A task may have grasps for one way
/// of resting and none for another.
pub fn turns_over(scene: &Sensed<'_>, part: usize, target: &Target) -> bool {
    let Facing::Full(orientation) = target.facing else { return false };
    let then = frame_of(&Pose { position: target.position, orientation }).rotation;
    let Some(now) = scene.part(part).map(|pose| frame_of(&pose).rotation) else { return false };
    let below = |turn: Rotation| turn.inverse() * Vector::Z;
    below(now).dot(below(then)) < TURNED
}

/// Returns the ways in which a part rests steadily, or already rests, each with all faces that look alike. The lowest
/// ways come first.
fn ways(solid: &Solid, frame: &Frame) -> Vec<Vec<Rest>> {
    let turned = |r: &Rest| r.turn.angle_between(frame.rotation);
    let mut all = rests(solid, frame.rotation);
    all.retain(|rest| rest.steady_rad > STEADY_RAD || turned(rest) < RESTS_RAD);
    all.sort_by(|a, b| turned(a).total_cmp(&turned(b)));
    let mut ways: Vec<Vec<Rest>> = Vec::new();
    for rest in all {
        match ways.iter_mut().find(|own| own[0].is_like(&rest)) {
            Some(own) => own.push(rest),
            None => ways.push(vec![rest]),
        }
    }
    ways.sort_by_key(|own| {
        let up = (own[0].turn * Vector::Z).z;
        let up = if up > 0.7 { 0 } else { i64::from(up < -0.7) + 1 };
        ((own[0].middle_m / ODD_M) as i64, up)
    });
    ways
}

/// A part that is to be laid down.
struct Laying<'s> {
    scene: &'s Sensed<'s>,
    part: usize,
    solid: &'s Solid,
    frame: Frame,
    /// End effector's frames at the grasps.
    grasps: Vec<Frame>,
}

/// A way of resting together with the end effector's frame, relative to the part, at a grasp.
struct Hold {
    rest: Rest,
    in_hand: Frame,
    /// Downward component of the hand's direction at the grasp and at the place, whichever is less.
    down: f64,
}

impl Laying<'_> {
    /// Returns the combinations of faces and grasps with which the hand points down, steep ones first.
    fn holds(&self, ways: &[Rest]) -> Vec<Hold> {
        let mut all = Vec::new();
        for rest in ways.iter().take(MOST_FACES) {
            for tool in &self.grasps {
                let in_hand = self.frame.inv_mul(tool);
                let then = -(rest.turn * in_hand.rotation * Vector::Z).z;
                let down = then.min(-(tool.rotation * Vector::Z).z);
                if down > DOWN {
                    all.push(Hold { rest: *rest, in_hand, down });
                }
            }
        }
        all.sort_by(|a, b| b.down.total_cmp(&a.down));
        all.truncate(MOST_HOLDS);
        all
    }

    /// Returns places for one way of resting.
    fn places(&self, ways: &[Rest], most: usize) -> Vec<Target> {
        let holds = self.holds(ways);
        let (mut found, mut used): (Vec<Target>, Vec<Vector>) = (Vec::new(), Vec::new());
        let now = self.frame.transform_point(self.solid.middle);
        let mut left = TRIES;
        for (index, at) in grid(self.scene, self.part, &now).into_iter().enumerate() {
            // Places next to each other offer nothing new.
            if used.iter().any(|other| (*other - at).length() < BETWEEN_M) {
                continue;
            }
            let turns = (0..TURNS).map(|k| TURN_ORDER[(k + index) % TURNS]);
            let place = turns.flat_map(|turn| holds.iter().map(move |hold| (turn, hold)));
            let place = place.take(MOST_HOLDS * 3).find_map(|(turn, hold)| {
                left = usize::saturating_sub(left, 1);
                if left == 0 { None } else { self.place(at, turn, hold) }
            });
            if let Some(place) = place {
                found.push(Target::pose(&pose_of(&place)));
                used.push(at);
            }
            if found.len() >= most || left == 0 {
                break;
            }
        }
        found
    }

    /// Returns the frame of the part with its centre of mass above `at`, if the part has room there and the hand
    /// reaches it.
    fn place(&self, at: Vector, turn: f64, hold: &Hold) -> Option<Frame> {
        let turn = Rotation::from_rotation_z(turn * FRAC_PI_4) * hold.rest.turn;
        let middle = turn * self.solid.middle;
        let at = Vector::new(at.x - middle.x, at.y - middle.y, hold.rest.height_m);
        let place = Frame::from_parts(at, turn);
        let tool = place * hold.in_hand;
        let opening = self.scene.handling(self.part).release_m;
        (has_room(self.scene, self.part, self.solid, &place)
            && !self.scene.hand_collides(&tool, opening, &[self.part])
            && reach::has_posture(&HOME, &tool))
        .then_some(place)
    }
}

/// Returns points on the table within comfortable reach and away from the scene's landmarks, those near `at` first.
fn grid(scene: &Sensed<'_>, part: usize, at: &Vector) -> Vec<Vector> {
    let [low, high] = scene.table().rim;
    let count = |i: usize| ((high[i] - low[i]) / GRID_M).floor().clamp(0.0, 200.0) as u32;
    let line = |i: usize| {
        let spare = (high[i] - low[i] - f64::from(count(i)) * GRID_M) / 2.0;
        (0..=count(i)).map(move |n| low[i] + spare + f64::from(n) * GRID_M)
    };
    let mut all: Vec<Vector> =
        line(0).flat_map(|x| line(1).map(move |y| Vector::new(x, y, 0.0))).collect();
    let flat = |mark: Vector| Vector::new(mark.x, mark.y, 0.0);
    let marked: Vec<Vector> = scene.marks(part).map(flat).collect();
    let free = |p: &Vector| marked.iter().all(|mark| (*mark - *p).length() > FROM_MARK_M);
    all.retain(|p| (REACH_M.0..=REACH_M.1).contains(&p.length()) && free(p));
    let far = |p: &Vector| (p.x - at.x).hypot(p.y - at.y);
    all.sort_by(|a, b| far(a).total_cmp(&far(b)));
    all
}

/// Returns whether a part at `place` is well inside the rim and away from everything else.
pub(super) fn has_room(scene: &Sensed<'_>, part: usize, solid: &Solid, place: &Frame) -> bool {
    let [low, high] = scene.table().rim;
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
