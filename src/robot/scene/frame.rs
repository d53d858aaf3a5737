//! A picture frame of a scene.

use serde::{Deserialize, Serialize};

use crate::robot::Pose;

/// A picture frame: the poses of robot and parts at one moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneFrame {
    /// Simulated time, in seconds.
    pub t: f64,
    /// Joint angles, in radians.
    pub angles: [f64; 7],
    /// Distance of each finger from the middle of the gripper, in metres.
    pub fingers: [f64; 2],
    /// Poses of all parts in the scene's order, then of the movable fixtures.
    pub parts: Vec<Pose>,
}
