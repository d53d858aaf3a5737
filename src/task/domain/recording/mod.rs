//! Recordings of demonstrations: what was where at the moments that the recorder chose.

mod read;
mod write;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::pose::Pose;

/// Why a snapshot was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SnapshotEvent {
    /// The demonstration begins.
    Start,
    /// The gripper makes contact with an object.
    Contact,
    /// The gripper lets an object go.
    Release,
    /// The demonstration ends.
    End,
}

/// One object at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectPose {
    /// The recorder's name for the object; an identity only while the number of objects of its
    /// kind stays the same.
    pub id: Arc<str>,
    /// What kind of object it is.
    pub kind: Arc<str>,
    /// Where it is.
    pub pose: Pose,
}

/// All objects at one moment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Snapshot {
    /// The recorder's number of the snapshot.
    pub number: u64,
    /// Simulated seconds, if recorded.
    pub time_s: Option<f64>,
    /// Why it was taken, if recorded.
    pub event: Option<SnapshotEvent>,
    /// Which of `objects` was touched or let go, if recorded.
    pub object: Option<usize>,
    /// The objects.
    pub objects: Vec<ObjectPose>,
}

/// One demonstration: its snapshots in the order of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstration {
    /// The recorder's number of the demonstration.
    pub number: u64,
    /// Its snapshots, at least one.
    pub snapshots: Vec<Snapshot>,
}

/// Demonstrations to learn from.
///
/// A recording holds no action names: where a file has some, [`Recording::read_labelled`] hands them
/// out beside it, for scoring, and nothing that learns is given them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// The demonstrations, in the order of the file.
    pub demos: Vec<Demonstration>,
}

/// A person's names for the actions about to start, by demonstration and snapshot.
pub type Labels = Vec<Vec<Option<String>>>;

impl Recording {
    /// How many snapshots there are in all.
    pub fn snapshot_count(&self) -> usize {
        self.demos.iter().map(|d| d.snapshots.len()).sum()
    }

    /// The recording restricted to the demonstrations for which `keep` holds.
    pub fn filter(&self, keep: impl Fn(&Demonstration) -> bool) -> Self {
        Self { demos: self.demos.iter().filter(|d| keep(d)).cloned().collect() }
    }
}
