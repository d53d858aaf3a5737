//! Frames of states, and poses relative to a frame.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::robot::Pose;
use crate::robot::pose::quaternion_array;

/// The frame in which a state's places are given.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum Frame {
    /// The world frame.
    World,
    /// The frame of an object of this kind, the reference.
    Kind(String),
}

/// Name of the world frame in files and tables. A kind of this name cannot be a frame.
const WORLD: &str = "world";

impl From<String> for Frame {
    fn from(name: String) -> Self {
        if name == WORLD { Self::World } else { Self::Kind(name) }
    }
}

impl From<Frame> for String {
    fn from(frame: Frame) -> Self {
        frame.name().to_owned()
    }
}

impl Frame {
    /// Returns `world`, or the kind of the reference.
    pub fn name(&self) -> &str {
        match self {
            Self::World => WORLD,
            Self::Kind(kind) => kind,
        }
    }

    /// Returns the kind of the reference; `None` for the world frame.
    pub fn kind(&self) -> Option<&str> {
        match self {
            Self::World => None,
            Self::Kind(kind) => Some(kind),
        }
    }
}

/// Returns `pose` in the frame of `reference`.
pub(crate) fn relative(reference: &Pose, pose: &Pose) -> Pose {
    let back = reference.rotation().inverse();
    let offset = Vector3::from(pose.position) - Vector3::from(reference.position);
    Pose {
        position: (back * offset).into(),
        orientation: quaternion_array(&(back * pose.rotation())),
    }
}

/// Returns the world pose of `pose`, which is given in the frame of `reference`.
pub(crate) fn world_pose(reference: &Pose, pose: &Pose) -> Pose {
    let turn = reference.rotation();
    let position = turn * Vector3::from(pose.position) + Vector3::from(reference.position);
    Pose { position: position.into(), orientation: quaternion_array(&(turn * pose.rotation())) }
}

/// Returns a pose turned the shortest way so that a direction of the object's frame points along a direction of the world. A
/// pose in which they are opposite is not changed.
pub(crate) fn levelled(pose: &Pose, own: &Vector3<f64>, along: &Vector3<f64>) -> Pose {
    let turn = pose.rotation();
    match UnitQuaternion::rotation_between(&(turn * own), along) {
        Some(back) => Pose { orientation: quaternion_array(&(back * turn)), ..*pose },
        None => *pose,
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/domain_frame.rs"]
mod tests;
