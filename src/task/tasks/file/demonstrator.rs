//! The demonstrator: brings about the next relation of the goal, and moves parts out of the way first.
//!
//! A relation is open if it does not hold and everything in its `after` does. The seed draws the order of open
//! relations and of equal places, anew for each demonstration.

use rand::RngExt;

use super::format::{Orientation, Place, Quantity, Relation};
use super::frames::{Level, arc, dot};
use super::relation::{Held, Seen, Sight};
use super::shape::Extent;
use super::task::DataTask;
use crate::robot::{SkillOutcome, SkillReport};
use crate::sim::Seed;
use crate::task::robot::vector::scale;
use crate::task::robot::{BodyFrame, Turn, reaches_table};
use crate::task::scene::Scene;
use crate::task::skill::Target;
use crate::task::tasks::{Demonstrator, Step};

/// The demonstrator of one demonstration.
pub(super) struct Shower {
    task: DataTask,
    seed: Seed,
}

/// Refusals after which another part or place is tried.
const REFUSALS: usize = 4;
/// Distance that a part which is put aside keeps from everything else, in metres.
const ASIDE_M: f64 = 0.03;
/// Overlap of two bodies that is taken for contact, in metres.
const TOUCH_M: f64 = 2e-3;

/// A relation that is still to be brought about at one of `places`.
struct Open<'f> {
    relation: &'f Relation,
    key: f64,
    places: Vec<(Level, Option<usize>, Place)>,
}

impl Shower {
    pub fn new(task: DataTask, seed: Seed, demo: usize) -> Self {
        let seed = seed.derive("demonstrator", "order").derive_index("demonstration", demo as u64);
        Self { task, seed }
    }

    fn key(&self, role: &str, index: usize) -> f64 {
        self.seed.derive_index(role, index as u64).rng().random()
    }

    /// Returns the open relations, in the drawn order.
    fn open<'f>(&self, sight: &Sight<'f>, held: &[Vec<Held>]) -> Vec<Open<'f>> {
        let goal = &sight.file.goal;
        let holds: Vec<bool> = goal.iter().map(|relation| sight.holds(relation)).collect();
        let ready = |relation: &Relation| {
            goal.iter()
                .zip(&holds)
                .all(|(other, holds)| *holds || !relation.after.contains(&other.name))
        };
        let mut open = Vec::new();
        for (number, relation) in goal.iter().enumerate() {
            if holds[number] || !ready(relation) {
                continue;
            }
            let instances = sight.instances(relation);
            let places = |wanted: Option<usize>| {
                let mut keyed = Vec::new();
                for (instance, (level, own)) in instances.iter().enumerate() {
                    for (at, place) in relation.places.iter().enumerate() {
                        let key = self.key(&format!("place {number} {instance}"), at);
                        if wanted.is_none_or(|wanted| wanted == instance) {
                            keyed.push((key, (*level, *own, *place)));
                        }
                    }
                }
                keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
                keyed.into_iter().map(|(_, place)| place).collect()
            };
            let key = |slot: usize| self.key(&format!("relation {number}"), slot);
            if relation.quantity == Quantity::Each {
                for instance in 0..instances.len() {
                    if !held[number].iter().any(|h| h.instance == instance) {
                        let places = places(Some(instance));
                        open.push(Open { relation, key: key(instance), places });
                    }
                }
            } else {
                open.push(Open { relation, key: key(held[number].len()), places: places(None) });
            }
        }
        open.sort_by(|a, b| a.key.total_cmp(&b.key));
        open
    }

    /// Returns the first step that nothing prevents; otherwise a step that moves a part out of the way.
    fn step(&self, sight: &Sight<'_>, so_far: &[SkillReport]) -> Option<Step> {
        let held: Vec<Vec<Held>> = sight.file.goal.iter().map(|r| sight.held(r)).collect();
        let used = |part: usize| held.iter().flatten().any(|h| h.part == part);
        let refused = |part: usize| refusals(so_far, part);
        let (mut in_the_way, mut stuck) = (None, Vec::new());
        for Open { relation, places, .. } in self.open(sight, &held) {
            let kind = sight.kind(&relation.part);
            let fit = sight.parts.iter().filter(|s| Some(s.kind) == kind && !used(s.part));
            let (mut parts, others): (Vec<&Seen>, Vec<&Seen>) =
                fit.partition(|seen| refused(seen.part) < REFUSALS);
            parts.sort_by_key(|seen| refused(seen.part));
            // A part that cannot be brought here as it lies may be taken up better elsewhere.
            stuck.extend(others.iter().map(|seen| seen.part));
            for seen in parts {
                if let Some(top) = sight.parts.iter().find(|other| lies_on(other, seen)) {
                    in_the_way.get_or_insert(top.part);
                    continue;
                }
                let places = roomy_first(sight, seen, &places);
                let from = refused(seen.part) % places.len().max(1);
                let turned = places[from..].iter().chain(&places[..from]);
                for (level, own, place) in turned.filter(|(_, own, _)| *own != Some(seen.part)) {
                    let (target, frame) = target(sight, relation, place, level, seen);
                    let extent = Extent::of(&sight.shapes.corners[seen.kind], &frame);
                    let obstacle = sight.parts.iter().find(|other| {
                        let counts = other.part != seen.part && Some(other.part) != *own;
                        counts && extent.meets(&other.extent, TOUCH_M)
                    });
                    match obstacle {
                        None => return Some(Step { part: seen.part, target }),
                        Some(other) => in_the_way.get_or_insert(other.part),
                    };
                }
            }
        }
        let part =
            in_the_way.or_else(|| stuck.into_iter().find(|part| refused(*part) < 2 * REFUSALS));
        self.put_aside(sight, part?, so_far)
    }

    /// Returns a step that moves a part, or what lies on it, to a free place.
    fn put_aside(&self, sight: &Sight<'_>, part: usize, so_far: &[SkillReport]) -> Option<Step> {
        let mut seen = sight.parts.iter().find(|seen| seen.part == part)?;
        // Bounded, because bodies that lean on each other could each seem to lie on the other.
        for _ in 0..sight.parts.len() {
            match sight.parts.iter().find(|other| lies_on(other, seen)) {
                Some(top) => seen = top,
                None => break,
            }
        }
        let corners = &sight.shapes.corners[seen.kind];
        let turn = seen.frame.turn;
        let height = -Extent::of(corners, &BodyFrame { position: [0.0; 3], turn }).z[0];
        let rooms: Vec<Extent> = sight.rooms();
        let [low, high] = sight.file.aside;
        let mut rng = self.seed.derive_index("aside", so_far.len() as u64).rng();
        let place = (0..500).find_map(|_| {
            let [x, y] = [0, 1].map(|i| low[i] + (high[i] - low[i]) * rng.random::<f64>());
            let position = [x, y, height];
            let extent = Extent::of(corners, &BodyFrame { position, turn });
            let parts = sight.parts.iter().filter(|other| other.part != seen.part);
            let mut others = parts.map(|other| &other.extent).chain(&rooms);
            let free = !others.any(|other| extent.near(other, ASIDE_M)) && reaches_table([x, y]);
            free.then_some(position)
        })?;
        Some(Step { part: seen.part, target: Target::anyhow(place) })
    }
}

impl Demonstrator for Shower {
    fn next(&mut self, scene: &Scene, so_far: &[SkillReport]) -> Option<Step> {
        let task = self.task.0.clone();
        let sight = Sight::of(&task.file, &task.shapes, scene);
        if sight.file.goal.iter().all(|relation| sight.holds(relation)) {
            return None;
        }
        self.step(&sight, so_far)
    }
}

/// Returns places with no other part within the distance in which parts of this kind block them, then the others.
fn roomy_first(
    sight: &Sight<'_>,
    seen: &Seen,
    places: &[(Level, Option<usize>, Place)],
) -> Vec<(Level, Option<usize>, Place)> {
    let within_m = sight.file.parts[seen.kind].handling.in_the_way_m;
    let is_crowded = |(level, own, place): &(Level, Option<usize>, Place)| {
        let [x, y, _] = level.point(place.position);
        let mut others = sight.parts.iter().filter(|o| o.part != seen.part && Some(o.part) != *own);
        others.any(|other| {
            let [ox, oy, _] = other.frame.position;
            (x - ox).hypot(y - oy) < within_m
        })
    };
    let mut all = places.to_vec();
    all.sort_by_key(is_crowded);
    all
}

/// Returns how often the robot has refused to take a part since it last moved one.
fn refusals(so_far: &[SkillReport], part: usize) -> usize {
    let since = so_far.iter().rev().take_while(|r| r.outcome == SkillOutcome::Unreachable);
    since.filter(|report| report.part == part).count()
}

fn lies_on(other: &Seen, seen: &Seen) -> bool {
    other.part != seen.part && other.extent.is_on(&seen.extent)
}

/// Returns the target of a part at a place, and a frame in which the part stands there.
fn target(
    sight: &Sight<'_>,
    relation: &Relation,
    place: &Place,
    level: &Level,
    seen: &Seen,
) -> (Target, BodyFrame) {
    let now = seen.frame.turn.apply([0.0, 0.0, 1.0]);
    let mut position = level.point(place.position);
    let flips = sight.file.parts[seen.kind].handling.flips;
    let axis = level.direction(place.z_axis);
    let nearest = if flips && dot(now, axis) < 0.0 { scale(axis, -1.0) } else { axis };
    let turned = arc(now, nearest) * seen.frame.turn;
    match relation.orientation {
        Orientation::Free => {
            // The place is that of an upright part.
            let corners = &sight.shapes.corners[seen.kind];
            let below =
                |turn: Turn| Extent::of(corners, &BodyFrame { position: [0.0; 3], turn }).z[0];
            let turn = seen.frame.turn;
            position[2] += below(Turn::NONE) - below(turn);
            (Target::anyhow(position), BodyFrame { position, turn })
        }
        Orientation::Axis => (Target::along(position, axis), BodyFrame { position, turn: turned }),
        Orientation::Full => {
            let ahead = level.direction(place.x_axis);
            let upright = arc([0.0, 0.0, 1.0], axis);
            let turn = arc(upright.apply([1.0, 0.0, 0.0]), ahead) * upright;
            let frame = BodyFrame { position, turn };
            (Target::pose(&frame.pose()), frame)
        }
    }
}
