//! The demonstrator: brings about the next relation of the goal, and moves parts out of the way first.
//!
//! A relation is open if it does not hold and everything in its `after` and `needs` does. A condition must also be needed
//! by a relation that does not hold. The seed draws the order of open relations and of equal places, anew for each
//! demonstration.

use std::sync::Arc;

use rand::RngExt;

use super::draw::Inner;
use super::format::{Orientation, Place, Quantity, Relation};
use super::relation::{Placement, Seen, Sight};
use crate::robot::arm::level::{Level, arc, dot};
use crate::robot::arm::vector::scale;
use crate::robot::arm::{BodyFrame, Turn, reaches_table};
use crate::robot::scene::Scene;
use crate::robot::scene::extent::Extent;
use crate::robot::skill::Target;
use crate::robot::{SkillOutcome, SkillReport};
use crate::sim::Seed;
use crate::task::tasks::{Demonstrator, Step};

/// The demonstrator of one demonstration.
pub(super) struct Shower {
    task: Arc<Inner>,
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
    /// Number of the relation, with the goal's first.
    number: usize,
    relation: &'f Relation,
    key: f64,
    places: Vec<(Level, Option<usize>, Place)>,
}

impl Shower {
    pub fn new(task: Arc<Inner>, seed: Seed, demo: usize) -> Self {
        let seed = seed.derive("demonstrator", "order").derive_index("demonstration", demo as u64);
        Self { task, seed }
    }

    fn key(&self, role: &str, index: usize) -> f64 {
        self.seed.derive_index(role, index as u64).rng().random()
    }

    /// Returns the open relations, in the drawn order.
    fn open<'f>(&self, sight: &Sight<'f>, held: &[Vec<Placement>]) -> Vec<Open<'f>> {
        let all: Vec<&Relation> = sight.file.relations().collect();
        let holds: Vec<bool> = all.iter().map(|relation| sight.holds(relation)).collect();
        let ready = |relation: &Relation| {
            let first = || relation.after.iter().chain(&relation.needs);
            all.iter()
                .zip(&holds)
                .all(|(other, holds)| *holds || !first().any(|n| *n == other.name))
        };
        let goals = sight.file.goal.len();
        let mut wanted: Vec<bool> = (0..all.len()).map(|n| n < goals && !holds[n]).collect();
        for _ in goals..all.len() {
            for number in goals..all.len() {
                let needs =
                    |other: usize| wanted[other] && all[other].needs.contains(&all[number].name);
                wanted[number] = !holds[number] && (0..all.len()).any(needs);
            }
        }
        let mut open = Vec::new();
        for (number, relation) in all.iter().copied().enumerate() {
            if !wanted[number] || !ready(relation) {
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
                        open.push(Open { number, relation, key: key(instance), places });
                    }
                }
            } else {
                let (key, places) = (key(held[number].len()), places(None));
                open.push(Open { number, relation, key, places });
            }
        }
        open.sort_by(|a, b| a.key.total_cmp(&b.key));
        open
    }

    /// Returns the first step that nothing prevents; otherwise a step that moves a part out of the way.
    fn step(&self, sight: &Sight<'_>, so_far: &[SkillReport]) -> Option<Step> {
        let held: Vec<Vec<Placement>> = sight.file.relations().map(|r| sight.held(r)).collect();
        let goals = sight.file.goal.len();
        let used = |part: usize| holds_any(&held[..goals], part);
        let refused = |part: usize| refusals(so_far, part);
        let (mut in_the_way, mut stuck) = (None, Vec::new());
        for Open { number, relation, places, .. } in self.open(sight, &held) {
            let fit = fit(sight, &held, number, relation).into_iter();
            // What was demanded first is not in the way, even if the part goes into it.
            let before: Vec<usize> = (sight.file.relations().zip(&held))
                .filter(|(other, _)| relation.after.contains(&other.name))
                .flat_map(|(_, held)| held.iter().map(|h| h.part))
                .collect();
            let (mut parts, others): (Vec<&Seen>, Vec<&Seen>) =
                fit.partition(|seen| refused(seen.part) < REFUSALS);
            parts.sort_by_key(|seen| (used(seen.part), refused(seen.part)));
            // A part that cannot be brought here as it lies may be taken up better elsewhere.
            stuck.extend(others.iter().filter(|s| s.slid_m.is_none()).map(|seen| seen.part));
            for seen in parts {
                if let Some(top) = sight.parts.iter().find(|other| lies_on(other, seen)) {
                    in_the_way.get_or_insert(top.part);
                    continue;
                }
                let places = possible(sight, relation, seen, &places);
                let places = roomy_first(sight, seen, &places);
                let from = refused(seen.part) % places.len().max(1);
                let turned = places[from..].iter().chain(&places[..from]);
                for (level, own, place) in turned.filter(|(_, own, _)| *own != Some(seen.part)) {
                    let (target, frame) = target(sight, relation, place, level, seen);
                    let extent = Extent::of(&sight.shapes.corners[seen.kind], &frame);
                    let obstacle = sight.parts.iter().find(|other| {
                        // The space of a drawer includes what lies in it.
                        let slides = seen.slid_m.is_some() || other.slid_m.is_some();
                        let counts = other.part != seen.part && Some(other.part) != *own;
                        counts
                            && !slides
                            && !before.contains(&other.part)
                            && extent.meets(&other.extent, TOUCH_M)
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
        let task = self.task.clone();
        let sight = Sight::of(&task.file, &task.shapes, scene);
        if sight.file.goal.iter().all(|relation| sight.holds(relation)) {
            return None;
        }
        self.step(&sight, so_far)
    }
}

fn holds_any(held: &[Vec<Placement>], part: usize) -> bool {
    held.iter().flatten().any(|h| h.part == part)
}

/// Returns the parts that may be brought to a place of a relation, given the parts that hold each relation.
fn fit<'s>(
    sight: &'s Sight<'_>,
    held: &[Vec<Placement>],
    number: usize,
    relation: &Relation,
) -> Vec<&'s Seen> {
    let goals = sight.file.goal.len();
    // What is needed for a while may undo what the goal asks for, such as a lid that is put aside.
    let kept = if number < goals { &held[..goals] } else { &held[number..=number] };
    let is_free = |seen: &Seen| !holds_any(kept, seen.part);
    let own = |condition: &Relation| {
        relation.needs.contains(&condition.name) && condition.part == relation.part
    };
    let needed: Vec<&[Vec<Placement>]> =
        (sight.file.conditions.iter().zip(held[goals..].chunks(1)))
            .filter(|(condition, _)| own(condition))
            .map(|(_, held)| held)
            .collect();
    let kind = sight.kind(&relation.part);
    let parts = sight.parts.iter().filter(|seen| Some(seen.kind) == kind && is_free(seen));
    parts.filter(|seen| needed.iter().all(|held| holds_any(held, seen.part))).collect()
}

/// Returns the places to which a part may go. Where its position does not matter, they are where the part is now.
fn possible(
    sight: &Sight<'_>,
    relation: &Relation,
    seen: &Seen,
    places: &[(Level, Option<usize>, Place)],
) -> Vec<(Level, Option<usize>, Place)> {
    let here = |(level, own, mut place): (Level, Option<usize>, Place)| {
        let now = level.local(seen.frame.position);
        for (i, _) in relation.within_m.iter().enumerate().filter(|(_, within)| within.is_none()) {
            place.position[i] = now[i];
        }
        (level, own, place)
    };
    let may_go = |(level, _, place): &(Level, Option<usize>, Place)| {
        sight.may_go(seen, level.point(place.position))
    };
    places.iter().copied().map(here).filter(may_go).collect()
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

/// Returns whether a part must be moved before another can be taken. What lies on a part that slides moves along.
fn lies_on(other: &Seen, seen: &Seen) -> bool {
    let slides = other.slid_m.is_some() || seen.slid_m.is_some();
    other.part != seen.part && !slides && other.extent.is_on(&seen.extent)
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
    if seen.slid_m.is_some() {
        return (Target::anyhow(position), BodyFrame { position, ..seen.frame });
    }
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
