//! Relations of the goal, checked by geometry alone.

use std::f64::consts::TAU;

use super::draw::Shapes;
use super::format::{HandlingData, Orientation, Place, Quantity, Relation, TaskFile};
use crate::robot::Pose;
use crate::robot::arm::BodyFrame;
use crate::robot::arm::level::{Level, angle_deg, dot};
use crate::robot::arm::vector::{scale, sub, unit};
use crate::robot::scene::Scene;
use crate::robot::scene::extent::Extent;

/// A part as it lies now.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Index in the scene.
    pub part: usize,
    /// Index of its kind.
    pub kind: usize,
    pub frame: BodyFrame,
    pub extent: Extent,
    /// Coordinate on its guide, in metres; `None` for a part that moves freely.
    pub slid_m: Option<f64>,
}

/// A part at a place of a relation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Placement {
    /// Number of the reference's instance.
    pub instance: usize,
    /// Number of the place.
    pub place: usize,
    /// Index of the part in the scene.
    pub part: usize,
}

/// Everything that relations are judged by.
pub(super) struct Sight<'f> {
    pub file: &'f TaskFile,
    pub shapes: &'f Shapes,
    pub parts: Vec<Seen>,
    /// Frames of the instances of each kind of reference.
    pub references: Vec<Vec<BodyFrame>>,
}

/// Height below which a part has left the table, in metres.
const GONE_M: f64 = -0.05;
/// Distance from a guide at which a place still belongs to it, in metres.
const BESIDE_M: f64 = 0.005;

impl<'f> Sight<'f> {
    pub fn of(file: &'f TaskFile, shapes: &'f Shapes, scene: &Scene) -> Self {
        let kinds = scene.kinds().enumerate();
        let parts = kinds.filter_map(|(part, kind)| {
            let frame = scene.body_frame(part).filter(|f| f.position[2] > GONE_M)?;
            let extent = Extent::of(shapes.corners.get(kind)?, &frame);
            Some(Seen { part, kind, frame, extent, slid_m: scene.slid_m(part) })
        });
        Self { file, shapes, parts: parts.collect(), references: references(file, scene) }
    }

    /// Returns the levelled frames of a relation's references, and for a part its index.
    pub fn instances(&self, relation: &Relation) -> Vec<(Level, Option<usize>)> {
        if relation.reference == super::WORLD {
            return vec![(Level::WORLD, None)];
        }
        let named = self.file.references.iter().position(|r| r.name == relation.reference);
        if let Some(kind) = named {
            return self.references[kind].iter().map(|f| (Level::of(f), None)).collect();
        }
        let kind = self.kind(&relation.reference);
        let parts = self.parts.iter().filter(|seen| Some(seen.kind) == kind);
        parts.map(|seen| (Level::of(&seen.frame), Some(seen.part))).collect()
    }

    /// Returns the index of a kind of part.
    pub fn kind(&self, name: &str) -> Option<usize> {
        self.file.parts.iter().position(|part| part.kind == name)
    }

    /// Returns the parts that stand at places of a relation.
    pub fn held(&self, relation: &Relation) -> Vec<Placement> {
        let kind = self.kind(&relation.part);
        let mut held: Vec<Placement> = Vec::new();
        for (instance, (level, own)) in self.instances(relation).into_iter().enumerate() {
            for seen in self.parts.iter().filter(|s| Some(s.kind) == kind && Some(s.part) != own) {
                let handling = &self.file.parts[seen.kind].handling;
                let at = relation
                    .places
                    .iter()
                    .position(|place| stands(relation, place, &level, &seen.frame, handling));
                held.extend(at.map(|place| Placement { instance, place, part: seen.part }));
            }
        }
        held
    }

    /// Returns whether a part may be brought to a point of the scene: a part on a guide only along it.
    pub fn may_go(&self, seen: &Seen, to: [f64; 3]) -> bool {
        let slider = self.file.parts[seen.kind].slider;
        slider.zip(seen.slid_m).is_none_or(|(slider, at_m)| {
            let axis = unit(seen.frame.turn.apply(slider.axis));
            let way = sub(to, seen.frame.position);
            let along = dot(way, axis);
            let beside = sub(way, scale(axis, along));
            let [least, most] = slider.range_m;
            dot(beside, beside).sqrt() <= BESIDE_M
                && (least - BESIDE_M..=most + BESIDE_M).contains(&(at_m + along))
        })
    }

    /// Returns whether a relation holds as often as it must.
    pub fn holds(&self, relation: &Relation) -> bool {
        let held = self.held(relation);
        let at = |instance: usize| held.iter().any(|h| h.instance == instance);
        match relation.quantity {
            Quantity::Each => {
                let count = self.instances(relation).len();
                count > 0 && (0..count).all(at)
            }
            Quantity::One => !held.is_empty(),
            Quantity::AtLeast(least) => {
                let mut parts: Vec<usize> = held.iter().map(|h| h.part).collect();
                parts.sort_unstable();
                parts.dedup();
                parts.len() >= least
            }
        }
    }
}

/// Returns whether a part at `frame` stands at a place of the frame `level`.
fn stands(
    relation: &Relation,
    place: &Place,
    level: &Level,
    frame: &BodyFrame,
    handling: &HandlingData,
) -> bool {
    let at = level.local(frame.position);
    let off_m: [f64; 3] = std::array::from_fn(|i| (at[i] - place.position[i]).abs());
    let near =
        off_m.iter().zip(relation.within_m).all(|(off, most)| most.is_none_or(|m| *off <= m));
    let off =
        |own: [f64; 3], wanted: [f64; 3]| angle_deg(frame.turn.apply(own), level.direction(wanted));
    let axis = || {
        let angle = off([0.0, 0.0, 1.0], place.z_axis);
        let angle = if handling.flips { angle.min(180.0 - angle) } else { angle };
        angle <= relation.within_deg
    };
    let ahead = || {
        let turns = (0..handling.fold).map(|k| f64::from(k) * TAU / f64::from(handling.fold));
        let mut ways = turns.map(|turn| [turn.cos(), turn.sin(), 0.0]);
        ways.any(|way| off(way, place.x_axis) <= relation.within_deg)
    };
    near && match relation.orientation {
        Orientation::Free => true,
        Orientation::Axis => axis(),
        Orientation::Full => axis() && ahead(),
    }
}

/// Returns the frames of all references, found by the first landmark of each.
fn references(file: &TaskFile, scene: &Scene) -> Vec<Vec<BodyFrame>> {
    let mut next = 0;
    let mut all = Vec::new();
    for reference in &file.references {
        let marks = reference.marks();
        let count: usize = reference.starts.iter().map(|start| start.count).sum();
        let mut frames = Vec::new();
        for _ in 0..count {
            if let (Some(mark), Some(seen)) = (marks.first(), scene.landmark(next)) {
                frames.push(origin(&seen, mark.at));
            }
            next += marks.len();
        }
        all.push(frames);
    }
    all
}

/// Returns the frame in which the point `at` has the pose `pose`.
fn origin(pose: &Pose, at: [f64; 3]) -> BodyFrame {
    let mut frame = BodyFrame::from(pose);
    let by = frame.turn.apply(at);
    frame.position = std::array::from_fn(|i| frame.position[i] - by[i]);
    frame
}

impl Sight<'_> {
    /// Returns the space that is kept free for each reference.
    pub fn rooms(&self) -> Vec<Extent> {
        let all = self.references.iter().enumerate();
        let rooms = all.flat_map(|(kind, frames)| {
            let reference = &self.file.references[kind];
            frames.iter().filter_map(move |frame| self.shapes.room(kind, reference, frame))
        });
        rooms.collect()
    }
}
