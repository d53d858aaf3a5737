//! Pushes with the closed fingers: a part is tilted over or shoved aside, to be taken afterwards.

use std::f64::consts::TAU;

use rapier3d::math::{Pose as Frame, Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::resting::{ODD_M, RESTS_RAD, Rest, STEADY_RAD, rests};
use super::solid::Solid;
use super::{Grasp, reach};
use crate::robot::arm::FINGER_TIP_M;
use crate::robot::arm::kinematics::HOME;
use crate::robot::scene::Sensed;

/// Greatest number of pushes that [`pushes`] returns.
pub const MOST_PUSHES: usize = 12;

/// The purpose of a push.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PushAim {
    /// Tilt over a part that stands unsteadily or leans.
    Topple,
    /// Shove a part away from the rim.
    Inwards,
    /// Shove a part away from another part or a fixture.
    Apart,
    /// Shove a part elsewhere.
    Aside,
}

impl std::fmt::Display for PushAim {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Topple => "tilt it over",
            Self::Inwards => "shove it away from the rim",
            Self::Apart => "shove it away from its neighbour",
            Self::Aside => "shove it aside",
        })
    }
}

/// A straight push with the closed fingers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Push {
    /// Index of the part in the scene.
    pub part: usize,
    /// Place of the fingers' tips at the beginning, in metres.
    pub from: [f64; 3],
    /// Place of the fingers' tips at the end, in metres.
    pub to: [f64; 3],
    /// Direction in which the hand points.
    pub approach: [f64; 3],
    /// Direction along which the fingers close, perpendicular to `approach`.
    pub closing: [f64; 3],
    /// Purpose.
    pub why: PushAim,
}

impl Push {
    /// Returns the end effector's frame with the tips at `tips`; `None` for impossible directions.
    pub(super) fn tool(&self, tips: [f64; 3]) -> Option<Frame> {
        let at = (Vector::from(tips) - Vector::from(self.approach) * FINGER_TIP_M).to_array();
        Grasp { at, approach: self.approach, closing: self.closing, opening_m: 0.0 }.tool()
    }
}

/// Number of horizontal directions that are tried.
const DIRECTIONS: u32 = 16;
/// Greatest number of sides of the part that are pushed straight.
const MOST_SIDES: usize = 24;
/// Gap between the fingers and the part at the beginning, in metres.
const GAP_M: f64 = 0.008;
/// Half the size of the closed fingers along and across the closing direction, in metres.
const FINGERS_M: [f64; 2] = [0.005, 0.008];
/// Height of the part's top above the tips of the fingers that tilt it over, in metres.
const TOP_M: f64 = 0.004;
/// Ways of a shove, in metres.
const SHOVES_M: [f64; 3] = [0.06, 0.04, 0.025];
/// Distance that a part keeps from the rim after a push, in metres.
const INSIDE_M: f64 = 0.012;
/// Distance from the rim or another body below which a part is to be shoved away, in metres.
const CLOSE_M: f64 = 0.03;
/// Distance between the points of a push that are tested for collisions, in metres.
const LOOK_M: f64 = 0.008;

/// What is known about the part that is to be pushed.
struct Subject<'s> {
    scene: &'s Sensed<'s>,
    part: usize,
    solid: Solid,
    frame: Frame,
    /// Centre of mass, in the scene.
    middle: Vector,
    /// Heights of the part's lowest and highest corner, in metres.
    floor: f64,
    top: f64,
    rests: Vec<Rest>,
    /// Whether the part leans or could stand much steadier.
    unsteady: bool,
    /// Direction away from a rim that is close; zero if none is.
    inwards: Vector,
    /// Direction away from bodies that are close; zero if there is none.
    apart: Vector,
}

/// Returns pushes that tilt over or shove a part, the most useful first: they tilt over a part that leans or stands on a
/// small face, and shove away a part that is close to the rim or to another body. The part stays inside the rim and has
/// room where it should end, and the hand touches nothing else on the way. Returns at most [`MOST_PUSHES`]; none for a
/// part that is [lost](Sensed::lost) or on a slider. Costs some tens of milliseconds.
pub fn pushes(scene: &Sensed<'_>, part: usize) -> Vec<Push> {
    let Some(subject) = Subject::new(scene, part) else { return Vec::new() };
    let mut all: Vec<(f64, Push, Vector)> = Vec::new();
    for k in 0..DIRECTIONS {
        let (sin, cos) = (f64::from(k) * TAU / f64::from(DIRECTIONS)).sin_cos();
        subject.along(Vector::new(cos, sin, 0.0), &mut all);
    }
    let flats = subject.solid.hull();
    let sides = flats.iter().map(|face| subject.frame.rotation * face.normal);
    for side in sides.filter(|side| side.z.abs() < 0.2).take(MOST_SIDES) {
        subject.along(Vector::new(-side.x, -side.y, 0.0).normalize(), &mut all);
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut chosen: Vec<(Push, Vector)> = Vec::new();
    for (_, push, way) in all {
        let same =
            |(other, theirs): &(Push, Vector)| other.why == push.why && theirs.dot(way) > 0.9;
        if chosen.len() < MOST_PUSHES && !chosen.iter().any(same) && subject.is_free(&push) {
            chosen.push((push, way));
        }
    }
    chosen.into_iter().map(|(push, _)| push).collect()
}

impl<'s> Subject<'s> {
    fn new(scene: &'s Sensed<'s>, part: usize) -> Option<Self> {
        let solid = Solid::of(scene, part)?;
        if scene.lost(part) || scene.slider(part).is_some() {
            return None;
        }
        let frame = scene.part_frame(part);
        let heights = solid.corners.iter().map(|c| frame.transform_point(*c).z);
        let (floor, top) = heights
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
        let rests = rests(&solid, frame.rotation);
        let steady = rests.iter().filter(|r| r.steady_rad > STEADY_RAD);
        let lowest = steady.map(|r| r.middle_m).fold(f64::INFINITY, f64::min);
        let lies = |rest: &&Rest| rest.turn.angle_between(frame.rotation) < RESTS_RAD;
        let now = rests.iter().find(lies).filter(|_| floor.abs() < 2e-3);
        let unsteady = now.is_none_or(|rest| rest.middle_m > lowest + ODD_M);
        let middle = frame.transform_point(solid.middle);
        let mut subject = Self {
            scene,
            part,
            solid,
            frame,
            middle,
            floor,
            top,
            rests,
            unsteady,
            inwards: Vector::ZERO,
            apart: Vector::ZERO,
        };
        subject.look_around();
        Some(subject)
    }

    /// Finds out what is close to the part.
    fn look_around(&mut self) {
        let [low, high] = self.scene.table().rim;
        for corner in self.corners(&self.frame) {
            let close = |gap: f64| if gap < CLOSE_M { 1.0 } else { 0.0 };
            self.inwards.x += close(corner.x - low[0]) - close(high[0] - corner.x);
            self.inwards.y += close(corner.y - low[1]) - close(high[1] - corner.y);
        }
        self.inwards = self.inwards.normalize_or_zero();
        for k in 0..DIRECTIONS {
            let (sin, cos) = (f64::from(k) * TAU / f64::from(DIRECTIONS)).sin_cos();
            let way = Vector::new(cos, sin, 0.0);
            let at = self.frame.translation + way * (CLOSE_M / 2.0) + Vector::Z * 2e-3;
            let beside = Frame::from_parts(at, self.frame.rotation);
            if self.scene.part_collides(self.part, &beside) {
                self.apart -= way;
            }
        }
        self.apart = self.apart.normalize_or_zero();
    }

    fn corners(&self, frame: &Frame) -> Vec<Vector> {
        self.solid.corners.iter().map(|c| frame.transform_point(*c)).collect()
    }

    /// Returns the distance from the centre of mass back to the part's surface at a height, against `way`, and how oblique
    /// the surface is there: 0 if it is perpendicular to `way`.
    fn behind(&self, way: Vector, height: f64) -> Option<(f64, f64)> {
        let at = Vector::new(self.middle.x, self.middle.y, height);
        let turn = self.frame.rotation.inverse();
        let local = turn * (at - self.frame.translation);
        let runs = self.solid.runs(local, turn * -way);
        runs.last().map(|run| (run.to, 1.0 - run.out.dot(turn * -way)))
    }

    /// Adds the pushes along a horizontal direction, with their costs.
    fn along(&self, way: Vector, all: &mut Vec<(f64, Push, Vector)>) {
        let high = self.top - TOP_M;
        if let Some((behind, oblique)) = self.behind(way, high)
            && let Some((travel, slides)) = self.topples(way, high, behind)
        {
            let cost = if self.unsteady { 0.0 } else { 4.0 } + 2.0 * oblique + slides;
            let away = self.inwards.dot(way) + self.apart.dot(way);
            self.add(PushAim::Topple, way, [high, behind, travel], cost - 0.3 * away, all);
        }
        let low = self.floor + 0.4 * (self.top - self.floor);
        let Some((behind, oblique)) = self.behind(way, low) else { return };
        let Some(travel) = SHOVES_M.into_iter().find(|by| self.has_room(way, *by)) else { return };
        let (why, cost) = if self.inwards != Vector::ZERO {
            (PushAim::Inwards, 1.0 - self.inwards.dot(way) - 0.3 * self.apart.dot(way))
        } else if self.apart != Vector::ZERO {
            (PushAim::Apart, 1.0 - self.apart.dot(way))
        } else {
            (PushAim::Aside, 3.0)
        };
        let tips = (low - 0.006).max(0.003);
        self.add(why, way, [tips, behind, travel], cost + 0.5 + oblique - 5.0 * travel, all);
    }

    /// Returns how far the fingers must go at a height to tilt the part over its front edge, and how near the part is to
    /// sliding instead (1 at the limit); `None` if it would slide, or if it has no room where it falls.
    fn topples(&self, way: Vector, height: f64, behind: f64) -> Option<(f64, f64)> {
        let corners = self.corners(&self.frame);
        let feet = corners.iter().filter(|c| c.z < self.floor + 2e-3);
        let ahead = |c: &Vector| (*c - self.middle).dot(way);
        let edge = feet.map(ahead).fold(f64::NEG_INFINITY, f64::max).max(0.0);
        let kind = self.scene.kind(self.part)?;
        let friction = (kind.friction + self.scene.table().friction) / 2.0;
        let slides = edge / ((height - self.floor) * friction);
        if slides > 0.9 {
            return None;
        }
        let angle = edge.atan2(self.middle.z - self.floor);
        let lift = height - self.floor;
        let travel = lift * angle.sin() + (edge + behind) * (1.0 - angle.cos());
        // The part falls on its next side.
        let pivot = self.middle + way * edge - Vector::Z * (self.middle.z - self.floor);
        let turn = Rotation::from_axis_angle(Vector::Z.cross(way), angle + 0.5);
        let tilted = turn * self.frame.rotation;
        let far = |r: &&Rest| r.turn.angle_between(tilted);
        // The ways of resting were turned from the present orientation, so their headings are near.
        let next = self.rests.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
        let corners = self.solid.corners.iter().map(|c| (next.turn * *c).dot(way));
        let back = corners.fold(f64::INFINITY, f64::min);
        let over = pivot.dot(way) - back;
        let side = self.middle - way * self.middle.dot(way);
        let own = next.turn * self.solid.middle;
        let own = own - way * own.dot(way);
        let at = way * over + side - own;
        let place = Frame::from_parts(Vector::new(at.x, at.y, next.height_m + 2e-3), next.turn);
        let free = self.is_inside(&place) && !self.scene.part_collides(self.part, &place);
        (free && travel < 0.07).then_some((travel + 0.008, slides))
    }

    /// Returns whether the part has room after a shove, and on the way.
    fn has_room(&self, way: Vector, by: f64) -> bool {
        let steps = (by / 0.01).ceil() as u32;
        let place = |n: u32| {
            let shift = way * (by + 0.01) * (f64::from(n) / f64::from(steps)) + Vector::Z * 2e-3;
            Frame::from_parts(self.frame.translation + shift, self.frame.rotation)
        };
        // At the beginning it may touch its neighbours.
        self.is_inside(&place(steps))
            && (1..=steps).all(|n| !self.scene.part_collides(self.part, &place(n)))
    }

    /// Returns whether a part at `place` is inside the rim, however it turns about the vertical. A part that is close
    /// to the rim already must only not come closer.
    fn is_inside(&self, place: &Frame) -> bool {
        let middle = place.transform_point(self.solid.middle);
        let flat = |v: Vector| Vector::new(v.x, v.y, 0.0);
        let [low, high] = self.scene.table().rim;
        let gaps = |p: Vector| [p.x - low[0], high[0] - p.x, p.y - low[1], high[1] - p.y];
        let out = |frame: &Frame| {
            self.corners(frame).into_iter().fold([f64::INFINITY; 4], |least, corner| {
                let gaps = gaps(corner);
                std::array::from_fn(|i| f64::min(least[i], gaps[i]))
            })
        };
        let far = self.corners(place).into_iter().map(|c| flat(c - middle).length());
        let far = far.fold(0.0, f64::max);
        let (now, then, round) = (out(&self.frame), out(place), gaps(middle));
        (0..4).all(|i| {
            let turned = then[i].min(round[i] - 0.8 * far);
            turned > INSIDE_M || (then[i] > now[i] - 1e-3 && now[i] < CLOSE_M && then[i] > 0.0)
        })
    }

    /// Adds a push with every way in which the hand can point. `numbers` are the height of the tips, the distance of
    /// the part's back from its middle, and the way after the first contact.
    fn add(
        &self,
        why: PushAim,
        way: Vector,
        [tips, behind, travel]: [f64; 3],
        cost: f64,
        all: &mut Vec<(f64, Push, Vector)>,
    ) {
        let side = Vector::Z.cross(way);
        let middle = Vector::new(self.middle.x, self.middle.y, tips);
        for (rank, closing) in [way, side, -way, -side].into_iter().enumerate() {
            let thick = FINGERS_M[rank % 2];
            for (steep, tilt) in [0.0, 0.35, -0.35].into_iter().enumerate() {
                let turn = Rotation::from_axis_angle(side, tilt);
                let (approach, closing) = (turn * -Vector::Z, turn * closing);
                let from = middle - way * (behind + thick + GAP_M);
                let to = middle - way * (behind + thick - travel);
                let push = Push {
                    part: self.part,
                    from: from.to_array(),
                    to: to.to_array(),
                    approach: approach.to_array(),
                    closing: closing.to_array(),
                    why,
                };
                all.push((cost + 0.02 * rank as f64 + 0.05 * steep as f64, push, way));
            }
        }
    }

    /// Returns whether the hand can come to the beginning of a push and follow it.
    fn is_free(&self, push: &Push) -> bool {
        let Some(start) = push.tool(push.from) else { return false };
        let (from, to) = (Vector::from(push.from), Vector::from(push.to));
        let back = Vector::from(push.approach) * -0.05;
        let count = ((to - from).length() / LOOK_M).ceil().max(1.0) as u32;
        let moved = |by: Vector| Frame::from_parts(start.translation + by, start.rotation);
        let along = |n: u32| moved((to - from) * (f64::from(n) / f64::from(count)));
        !self.scene.hand_collides(&start, 0.0, &[])
            && !self.scene.hand_collides(&moved(back), 0.0, &[])
            && (1..=count).all(|n| !self.scene.hand_collides(&along(n), 0.0, &[self.part]))
            && reach::has_posture(&HOME, &start)
    }
}
