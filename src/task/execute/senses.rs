//! The executor's senses: several sensed frames of one moment, reduced to one snapshot.

use super::model::Seen;
use super::recorder::Recorder;
use crate::robot::Pose;
use crate::robot::scene::Scene;
use crate::sim::Seed;
use crate::task::recording::{ObjectPose, Sensing, Snapshot};

/// Number of frames of one look, if sensing has errors.
const FRAMES: u64 = 9;
/// Number of frames in which an object has to be to count as seen. What is not seen for a moment has not vanished: with
/// three in ten objects missing from each frame, one in 2,300 is missing from a look. If half the frames were asked for, it
/// would be one in ten.
const SEEN: usize = 2;

/// Looks at a scene. If sensing has errors, takes several frames. An object is seen if it is in at least two of them; its
/// position is the median of these frames. A swapped or wrong pose in few frames has no effect.
pub(super) fn look(recorder: &Recorder, scene: &Scene, sensing: &Sensing, seed: Seed) -> Seen {
    let (snapshot, parts) = recorder.look(scene);
    if sensing.is_exact() {
        return Seen { snapshot, parts };
    }
    let seed = seed.derive("", "sensing");
    let frames: Vec<Snapshot> = (0..FRAMES)
        .map(|frame| sensing.apply(&snapshot, seed, scene.steps() * FRAMES + frame))
        .collect();
    let (mut objects, mut kept) = (Vec::new(), Vec::new());
    for (object, part) in snapshot.objects.iter().zip(&parts) {
        let same =
            |frame: &Snapshot| frame.objects.iter().find(|o| o.id == object.id).map(|o| o.pose);
        let poses: Vec<Pose> = frames.iter().filter_map(same).collect();
        if let (true, Some(pose)) = (poses.len() >= SEEN, middle(&poses)) {
            objects.push(ObjectPose { pose, ..object.clone() });
            kept.push(*part);
        }
    }
    Seen { snapshot: Snapshot { objects, ..snapshot }, parts: kept }
}

/// Returns the median position, with the orientation that is nearest to all others.
fn middle(poses: &[Pose]) -> Option<Pose> {
    let position = std::array::from_fn(|axis| {
        let mut values: Vec<f64> = poses.iter().map(|p| p.position[axis]).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().saturating_sub(1);
        let at = |i: usize| values.get(i).copied().unwrap_or_default();
        0.5 * (at(last / 2) + at(last.div_ceil(2)))
    });
    let far = |a: &Pose| poses.iter().map(|b| a.rotation().angle_to(&b.rotation())).sum::<f64>();
    let nearest = poses.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
    Some(Pose { position, orientation: nearest.orientation })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_poses_in_few_frames_have_no_effect() {
        let at = |x: f64| Pose::at([x, 0.0, 0.0]);
        let poses = [at(0.1), at(9.0), at(0.101), at(0.099), at(-5.0)];
        let middle = middle(&poses).map(|p| p.position[0]);
        assert_eq!(middle, Some(0.1));
        assert_eq!(super::middle(&[]), None);
        let two = [at(0.2), at(0.4)];
        assert!((super::middle(&two).map_or(0.0, |p| p.position[0]) - 0.3).abs() < 1e-12);
    }
}
