//! Recordings of demonstrations: the poses of all objects at moments chosen by the recorder.

mod attributes;
mod read;
mod sensing;
mod write;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::robot::Pose;
use crate::sim::{is_plain, plain};

pub use attributes::{Attribute, Attributes, ObjectAttributes};
pub use sensing::Sensing;

/// Maximum length of a name, in characters.
pub(crate) const MAX_NAME: usize = 200;

/// What is expected of the name of an object, a kind or an attribute.
pub(crate) const FIT_NAME: &str = "1 to 200 characters, none of them a control character";

/// Returns what is wrong with the name of an object, a kind or an attribute, if anything is. Names are printed, and a
/// terminal obeys control characters.
pub(crate) fn unfit(name: &str) -> Option<String> {
    let length = name.chars().count();
    if length == 0 || length > MAX_NAME {
        return Some(format!("it has {length} characters"));
    }
    (!is_plain(name)).then(|| format!("`{}` has a control character", plain(name)))
}

/// Why a snapshot was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SnapshotEvent {
    /// The demonstration begins.
    Start,
    /// The gripper makes contact with an object.
    Contact,
    /// The gripper releases an object.
    Release,
    /// The demonstration ends.
    End,
}

/// The pose of one object at one moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObjectPose {
    /// Id that the recorder gave the object. An id identifies an object only within a demonstration, and only while the
    /// number of objects of its kind stays the same: when an object is lost, later ids may move down.
    pub id: Arc<str>,
    /// Kind of the object.
    pub kind: Arc<str>,
    /// Pose of the object.
    pub pose: Pose,
}

/// The poses of all objects at one moment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Snapshot {
    /// Number of the snapshot, as recorded.
    pub number: u64,
    /// Simulated time in seconds, if recorded.
    pub time_s: Option<f64>,
    /// Why the snapshot was taken, if recorded.
    pub event: Option<SnapshotEvent>,
    /// Index in `objects` of the object that was touched or released, if recorded.
    pub object: Option<usize>,
    /// All objects, including fixtures.
    pub objects: Vec<ObjectPose>,
}

/// One demonstration: its snapshots in time order.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstration {
    /// Number of the demonstration, as recorded.
    pub number: u64,
    /// Snapshots of the demonstration, at least one.
    pub snapshots: Vec<Snapshot>,
}

/// Demonstrations to learn from.
///
/// A recording contains no action names. If the file has labels, [`Recording::read_labelled`] returns them separately.
/// They serve only to score what was learned; the learner never receives them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// The demonstrations, in the order of the file.
    pub demos: Vec<Demonstration>,
}

/// Labels that a person gave, by demonstration and snapshot: the name of the action that begins after the snapshot, or
/// `None` if there is no label.
pub type Labels = Vec<Vec<Option<String>>>;

impl Recording {
    /// Returns the number of snapshots in all demonstrations.
    pub fn snapshot_count(&self) -> usize {
        self.demos.iter().map(|d| d.snapshots.len()).sum()
    }

    /// Returns a recording with a scene as its only snapshot.
    pub fn of_scene(scene: Snapshot) -> Self {
        Self { demos: vec![Demonstration { number: 0, snapshots: vec![scene] }] }
    }

    /// Returns a recording of only the demonstrations for which `keep` returns true.
    pub fn filter(&self, keep: impl Fn(&Demonstration) -> bool) -> Self {
        Self { demos: self.demos.iter().filter(|d| keep(d)).cloned().collect() }
    }
}
