//! What the mapping says of logs that hold streams by name: topics of messages, and datasets of arrays.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::robot::Pose;

/// What is taken from the messages of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Take {
    /// Poses, transforms, detections or markers, by the type of the messages.
    #[default]
    #[serde(rename = "poses")]
    Poses,
    /// The width of the gripper: a number, or the sum of the positions of its joints.
    #[serde(rename = "width")]
    Width,
    /// Whether the gripper holds something.
    #[serde(rename = "grasp")]
    Grasp,
}

/// How to read the topics of a log of messages whose names match a pattern.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TopicMap {
    /// Pattern of topics; `*` stands for any text.
    pub topic: String,
    /// What is taken from it.
    pub take: Take,
    /// Id of the object, where the messages hold the pose of one object.
    pub object: Option<String>,
    /// Patterns of the objects to take, where the messages name several. Empty: all.
    pub objects: Vec<String>,
    /// Patterns of the joints whose positions add up to the width. Empty: those that are named finger or gripper.
    pub joints: Vec<String>,
    /// Whether the gripper closes as the number grows, or the flag says that it is open.
    pub invert: Option<bool>,
    /// Pose in the world of the frame in which the topic gives poses, in metres. Transforms are not asked for it.
    pub frame: Option<Pose>,
}

/// Datasets that hold the pose of one object, or of several of a kind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseDatasets {
    /// Dataset of positions: times × 3, or times × objects × 3. With the orientation: times × 7, or matrices, times × 4 × 4.
    pub position: String,
    /// Dataset of orientations: times × 4 in the mapping's order, times × 3, or times × 3 × 3.
    #[serde(default)]
    pub rotation: Option<String>,
}

/// How to read a log of arrays. Datasets are given by their path in the group.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DatasetMap {
    /// Pattern of file names; `*` stands for any text. Empty: all files.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub files: String,
    /// Pattern of the groups that are sessions, such as `data/demo_*`. Empty: the whole file is one session.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub group: String,
    /// Dataset of times. Without it, rows are as far apart as `rate_hz` says.
    pub time: Option<String>,
    /// Datasets of each object, by id. `*` in an id stands for the number of the object, where there are several.
    pub objects: BTreeMap<String, PoseDatasets>,
    /// Dataset of the gripper's width: times, or times × fingers, whose distances add up.
    pub width: Option<String>,
    /// Dataset that says whether the gripper holds something.
    pub grasp: Option<String>,
}
