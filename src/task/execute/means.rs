//! Free places for parts, and the names of parts.

use crate::task::domain::Pose;
use crate::task::scene::Scene;
use crate::task::skill::{self, Target};

/// Least distance of a free place from every other part, in metres.
const ROOM_M: f64 = 0.07;

/// Returns targets at which a part can be put down: where it was found, if no other part is near, then other places.
pub(super) fn free_places(scene: &Scene, part: usize, home: Option<&Pose>) -> Vec<Target> {
    let clear = |pose: &&Pose| {
        let others = (0..scene.part_count()).filter(|other| *other != part);
        let mut others = others.filter_map(|other| scene.part(other));
        others.all(|other| {
            let [x, y, _] = other.position;
            (x - pose.position[0]).hypot(y - pose.position[1]) > ROOM_M
        })
    };
    let home = home.filter(clear).map(Target::pose);
    home.into_iter().chain(skill::free_places(scene, part)).collect()
}

/// Returns the id of a part: its kind and its number among the parts of this kind, lost ones included.
pub(super) fn name(scene: &Scene, part: usize) -> String {
    let Some(kind) = scene.kinds().nth(part) else { return format!("part_{part}") };
    let number = scene.kinds().take(part).filter(|own| *own == kind).count();
    let name = scene.kind(part).map_or("part", |kind| &kind.name);
    format!("{name}_{number}")
}
