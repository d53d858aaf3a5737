//! Free places for parts, and the names of parts.

use crate::robot::Pose;
use crate::robot::scene::Sensed;
use crate::robot::skill::{self, Facing, Target};
use crate::task::domain::naming::object_names;

/// Least distance of a free place from every other part, in metres.
const ROOM_M: f64 = 0.07;

/// Distance that a part must be moved at least, in metres.
const AWAY_M: f64 = 0.06;
/// Number of places from [`skill::free_places`] that are tried.
const MOST: usize = 8;
/// Number of places at which a part may be put down as it lies in the hand.
const SPOTS: usize = 4;
/// Height from which such a part falls, in metres.
const FALL_M: f64 = 0.004;
/// Greatest difference between the vertical components of two axes of parts that lie alike.
const ALIKE: f64 = 0.25;

/// Returns whether a part in this pose lies as parts of its kind lay when they were found: its axis is equally steep.
pub(in crate::task::execute) fn lies_well(
    scene: &Sensed<'_>,
    part: usize,
    pose: &Pose,
    homes: &[Option<Pose>],
) -> bool {
    let flips = scene.kind(part).is_some_and(|kind| kind.handling.symmetry.flips);
    let steepness = |pose: &Pose| {
        let z = (pose.rotation() * nalgebra::Vector3::z()).z;
        if flips { z.abs() } else { z }
    };
    let kinds: Vec<usize> = scene.kinds().collect();
    let like = homes.iter().enumerate().filter(|(other, _)| kinds.get(*other) == kinds.get(part));
    let mut like = like.filter_map(|(_, home)| home.as_ref());
    like.any(|home| (steepness(home) - steepness(pose)).abs() < ALIKE)
}

/// Returns targets at which a part can be put down: where it was found, if no other part is near, then other places in
/// the order of [`skill::free_places`]. With `strict`, the part lies at all of them as it was found, and places near
/// where it was found come first.
pub(in crate::task::execute) fn free_places(
    scene: &Sensed<'_>,
    part: usize,
    homes: &[Option<Pose>],
    strict: bool,
) -> Vec<Target> {
    let (Some(now), home) = (scene.part(part), homes.get(part).copied().flatten()) else {
        return Vec::new();
    };
    let far = |a: &[f64; 3], b: &[f64; 3]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let clear = |pose: &&Pose| {
        let others = (0..scene.part_count()).filter(|other| *other != part);
        let mut others = others.filter_map(|other| scene.part(other));
        others.all(|other| far(&other.position, &pose.position) > ROOM_M)
    };
    let first = home.iter().filter(clear).map(Target::pose);
    let well = |target: &Target| {
        let Facing::Full(orientation) = target.facing else { return true };
        let pose = Pose { position: target.position, orientation };
        lies_well(scene, part, &pose, homes)
    };
    let lies = lies_well(scene, part, &now, homes);
    let mut rest = skill::free_places(scene, part);
    if strict {
        let from = home.map_or(now.position, |home| home.position);
        rest.retain(well);
        rest.sort_by(|a, b| far(&a.position, &from).total_cmp(&far(&b.position, &from)));
    }
    // As a last resort, the part is put down as it lies in the hand, and falls on its next side.
    let floor = skill::lowest(scene, part);
    let over = |t: &Target| {
        let [x, y, _] = t.position;
        Target::anyhow([x, y, FALL_M - floor])
    };
    let first: Vec<Target> = first.collect();
    let spots = first.iter().chain(&rest).take(if strict { 0 } else { SPOTS });
    let anyhow: Vec<Target> = spots.map(over).collect();
    // A part that lies well must at least lie elsewhere.
    let changes = |t: &Target| {
        let moved = far(&t.position, &now.position);
        moved > AWAY_M || (!lies && (well(t) || moved > AWAY_M / 2.0))
    };
    let rest = rest.into_iter().take(MOST);
    first.into_iter().chain(rest).chain(anyhow).filter(changes).collect()
}

/// Returns the id of a part: its kind and its number among the parts of this kind, lost ones included.
pub(in crate::task::execute) fn id(scene: &Sensed<'_>, part: usize) -> String {
    let Some(kind) = scene.kinds().nth(part) else { return format!("part_{part}") };
    let number = scene.kinds().take(part).filter(|own| *own == kind).count();
    let name = scene.kind(part).map_or("part", |kind| &kind.name);
    format!("{name}_{number}")
}

/// Returns the name of a part for people, such as `cup 0`, or `the cup` if it is the only one of its kind.
pub(in crate::task::execute) fn name(scene: &Sensed<'_>, part: usize) -> String {
    let all: Vec<String> = (0..scene.part_count()).map(|part| id(scene, part)).collect();
    let kind = |part: usize| scene.kind(part).map_or("part", |kind| &*kind.name);
    let mut names = object_names(all.iter().enumerate().map(|(part, id)| (&**id, kind(part))));
    if part < names.len() { names.swap_remove(part) } else { id(scene, part) }
}
