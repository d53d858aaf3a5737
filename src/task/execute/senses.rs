//! The robot's eyes: several sensed frames of one moment, or of one part while the robot handles it, reduced to one pose
//! for each object.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Vector3};
use serde::{Deserialize, Serialize};

use super::model::Seen;
use super::recorder::Recorder;
use crate::robot::Pose;
use crate::robot::pose::{mean_orientation, quaternion_array};
use crate::robot::scene::{Percept, Scene};
use crate::sim::Seed;
use crate::task::recording::{ObjectPose, Sensing, Snapshot};

/// Number of frames of one look, if sensing has errors.
const FRAMES: u64 = 25;
/// Number of frames in which an object has to be to count as seen. What is not seen for a moment has not vanished.
const SEEN: usize = 2;
/// Number of looks in a row without a part after which it is not there any more.
const UNSEEN: u32 = 3;
/// Number of frames, one in each step, of the part that the robot handles.
const WATCHED: usize = 45;
/// Distance from the median at which a frame is left out, in medians of this distance: one in 600 of normal errors.
const FAR: f64 = 2.5;

/// What the robot has seen.
#[derive(Serialize, Deserialize)]
pub(super) struct Eyes {
    sensing: Sensing,
    seed: Seed,
    pub percept: Percept,
    /// For each part, the number of looks since it was seen.
    unseen: Vec<u32>,
    /// The last frames of the part that the robot handles: in the hand's frame if the robot holds it, else in the scene's.
    watched: VecDeque<Pose>,
    held: bool,
}

impl Eyes {
    pub fn new(scene: &Scene, sensing: Sensing, seed: Seed) -> Self {
        let percept = match sensing.is_exact() {
            true => Percept::default(),
            false => Percept::before_looking(scene),
        };
        let (unseen, watched) = (vec![0; scene.part_count()], VecDeque::new());
        let seed = seed.derive("", "sensing");
        Self { sensing, seed, percept, unseen, watched, held: false }
    }

    /// Looks at a scene.
    pub fn look(&mut self, scene: &Scene) -> Seen {
        let (snapshot, parts) = Recorder::default().look(scene);
        if self.sensing.is_exact() {
            return Seen { snapshot, parts };
        }
        let seen = look(&snapshot, &self.sensing, self.seed, scene.steps());
        let mut landmarks = scene.spec().landmarks.iter();
        let mut kept = Vec::new();
        for unseen in &mut self.unseen {
            *unseen += 1;
        }
        for (object, part) in snapshot.objects.iter().zip(&parts) {
            let landmark = if part.is_none() { landmarks.next() } else { None };
            let Some(pose) = pose_in(&seen, object) else { continue };
            if let Some(part) = *part {
                self.unseen[part] = 0;
                self.percept.part(part, Some(&pose));
            }
            if let Some(landmark) = landmark {
                self.percept.landmark(landmark, &pose);
            }
            kept.push(*part);
        }
        for (part, unseen) in self.unseen.iter().enumerate() {
            if *unseen >= UNSEEN {
                self.percept.part(part, None);
            }
        }
        Seen { snapshot: seen, parts: kept }
    }

    /// Takes a frame of the part that the robot handles, if any. A held part moves with the hand, so the mean is taken in the
    /// hand's frame.
    pub fn watch(&mut self, scene: &Scene, part: Option<usize>, holds: bool) {
        if self.sensing.is_exact() {
            return;
        }
        let Some(part) = part else { return self.watched.clear() };
        let tool = isometry(&scene.tool());
        if self.held != holds {
            let into = if holds { tool.inverse() } else { tool };
            self.watched.iter_mut().for_each(|own| *own = pose(&(into * isometry(own))));
            self.held = holds;
        }
        let on = if holds { tool } else { Isometry3::identity() };
        let (snapshot, parts) = Recorder::default().look(scene);
        let frame = self.sensing.apply(&snapshot, self.seed.derive("", "watch"), scene.steps());
        let object = parts.iter().position(|own| *own == Some(part)).map(|i| &snapshot.objects[i]);
        if let Some(seen) = object.and_then(|object| pose_in(&frame, object)) {
            self.watched.push_back(pose(&(on.inverse() * isometry(&seen))));
        }
        if self.watched.len() >= WATCHED {
            self.watched.truncate(WATCHED + 1);
            let seen = mean(self.watched.make_contiguous()).map(|own| pose(&(on * isometry(&own))));
            self.percept.part(part, seen.as_ref());
            self.watched.pop_front();
        }
    }
}

/// Looks at a scene at rest: takes several frames of the exact snapshot. An object is seen if it is in at least two of them; its
/// pose is the mean of these frames without those far from their median. A swapped or wrong pose in few frames has no effect.
pub(super) fn look(exact: &Snapshot, sensing: &Sensing, seed: Seed, tick: u64) -> Snapshot {
    let frame = |n| sensing.apply(exact, seed, tick * FRAMES + n);
    let frames: Vec<Snapshot> = (0..FRAMES).map(frame).collect();
    let objects = exact.objects.iter().filter_map(|object| {
        let poses: Vec<Pose> = frames.iter().filter_map(|f| pose_in(f, object)).collect();
        let pose = mean(&poses).filter(|_| poses.len() >= SEEN)?;
        Some(ObjectPose { pose, ..object.clone() })
    });
    Snapshot { objects: objects.collect(), object: None, ..exact.clone() }
}

/// Returns the pose of an object in a frame; `None` if it is missing.
fn pose_in(frame: &Snapshot, object: &ObjectPose) -> Option<Pose> {
    frame.objects.iter().find(|own| own.id == object.id).map(|own| own.pose)
}

fn isometry(pose: &Pose) -> Isometry3<f64> {
    Isometry3::from_parts(Vector3::from(pose.position).into(), pose.rotation())
}

fn pose(frame: &Isometry3<f64>) -> Pose {
    let orientation = quaternion_array(&frame.rotation);
    Pose { position: frame.translation.vector.into(), orientation }
}

/// Returns the mean of the poses that are near their median; `None` for no poses.
fn mean(poses: &[Pose]) -> Option<Pose> {
    let position = |axis| median(poses.iter().map(|p| p.position[axis]).collect());
    let middle = Pose::at([0, 1, 2].map(position));
    let near = FAR * median(poses.iter().map(|p| p.distance(&middle)).collect());
    let kept: Vec<&Pose> = poses.iter().filter(|p| p.distance(&middle) <= near).collect();
    let orientations: Vec<[f64; 4]> = kept.iter().map(|p| p.orientation).collect();
    let mean = |axis| kept.iter().map(|p| p.position[axis]).sum::<f64>() / kept.len() as f64;
    let orientation = mean_orientation(&orientations)?;
    Some(Pose { position: [0, 1, 2].map(mean), orientation })
}

/// Returns the median; 0 for no values.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    let at = |i: usize| values.get(i).copied().unwrap_or_default();
    0.5 * (at(last / 2) + at(last.div_ceil(2)))
}
