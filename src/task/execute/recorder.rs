//! The recorder: takes snapshots of the poses of all parts and landmarks of a scene.

use std::sync::Arc;

use crate::robot::scene::Scene;
use crate::task::recording::{ObjectPose, Snapshot, SnapshotEvent};

/// Takes snapshots of a scene. A snapshot lists first the parts, then the landmarks. An object's id is the name of its
/// kind, an underscore and a number from 0.
///
/// A part that fell off the table disappears from later snapshots, and the later ids of its kind move down, as in
/// recordings by a camera that numbers the objects it sees.
#[derive(Debug, Clone, Default)]
pub struct Recorder {
    snapshots: Vec<Snapshot>,
}

/// Height below which a part has left the table, in metres.
const GONE_M: f64 = -0.05;

/// Makes ids for the objects of one kind.
struct Names {
    kind: Arc<str>,
    count: usize,
}

impl Names {
    fn of(kind: &str) -> Self {
        Self { kind: kind.into(), count: 0 }
    }

    fn next(&mut self) -> (Arc<str>, Arc<str>) {
        self.count += 1;
        (format!("{}_{}", self.kind, self.count - 1).into(), self.kind.clone())
    }
}

impl Recorder {
    /// Returns a snapshot of the present moment and, for each object, the index of its part in the scene
    /// (`None` for a landmark).
    pub fn look(&self, scene: &Scene) -> (Snapshot, Vec<Option<usize>>) {
        let spec = scene.spec();
        let mut names: Vec<Names> = spec.kinds.iter().map(|kind| Names::of(&kind.name)).collect();
        let (mut objects, mut parts) = (Vec::new(), Vec::new());
        for (index, kind) in scene.kinds().enumerate() {
            let Some(pose) = scene.part(index).filter(|p| p.position[2] > GONE_M) else { continue };
            let (id, kind) = names[kind].next();
            objects.push(ObjectPose { id, kind, pose });
            parts.push(Some(index));
        }
        let mut places: Vec<Names> = Vec::new();
        for (index, landmark) in spec.landmarks.iter().enumerate() {
            let Some(pose) = scene.landmark(index) else { continue };
            let known = places.iter().position(|names| *names.kind == *landmark.kind);
            let names = known.unwrap_or_else(|| {
                places.push(Names::of(&landmark.kind));
                places.len() - 1
            });
            let (id, kind) = places[names].next();
            objects.push(ObjectPose { id, kind, pose });
            parts.push(None);
        }
        let snapshot = Snapshot {
            number: self.snapshots.len() as u64,
            time_s: Some(scene.time_s()),
            event: None,
            object: None,
            objects,
        };
        (snapshot, parts)
    }

    /// Takes a snapshot for an event: the start, the end, or a touch of part `touched`.
    pub fn note(&mut self, scene: &Scene, event: SnapshotEvent, touched: Option<usize>) {
        let (mut snapshot, parts) = self.look(scene);
        snapshot.event = Some(event);
        snapshot.object = touched.and_then(|t| parts.iter().position(|p| *p == Some(t)));
        // A part released over the table's edge is already gone, so the event has no object to name.
        if touched.is_none() || snapshot.object.is_some() {
            self.snapshots.push(snapshot);
        }
    }

    /// Returns the snapshots.
    pub fn into_snapshots(self) -> Vec<Snapshot> {
        self.snapshots
    }
}
