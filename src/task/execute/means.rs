//! Means of recovery: grasps besides the task's, free places, and pushes.

use crate::task::domain::Pose;
use crate::task::scene::Scene;
use crate::task::skill::{Grasp, Target};

/// Least distance of a free place from every other part, in metres.
const ROOM_M: f64 = 0.07;

/// Returns grasps for a part in any pose, the best first.
pub(super) fn any_grasps(_scene: &Scene, _part: usize) -> Vec<Grasp> {
    Vec::new()
}

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
    home.filter(clear).map(Target::pose).into_iter().collect()
}

/// Returns whether a part fell off the table.
pub(super) fn lost(scene: &Scene, part: usize) -> bool {
    scene.part(part).is_some_and(|pose| pose.position[2] < -0.05)
}

/// Returns the id of a part: its kind and its number among the parts of this kind, lost ones included.
pub(super) fn name(scene: &Scene, part: usize) -> String {
    let Some(kind) = scene.kinds().nth(part) else { return format!("part_{part}") };
    let number = scene.kinds().take(part).filter(|own| *own == kind).count();
    let name = scene.kind(part).map_or("part", |kind| &kind.name);
    format!("{name}_{number}")
}
