//! States of objects, and the geometry of learned states.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::tolerance::WILD_RAD;
use crate::robot::Pose;

/// A state that an object of one kind can be in.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Name of the state: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// Kind of the objects that can be in the state.
    pub kind: String,
    /// Geometry learned from demonstrations: where objects in the state lie. `None` in a domain written in code; no
    /// object is ever classified into such a state.
    pub learned: Option<LearnedState>,
}

/// How objects came into a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// The objects lay there when a demonstration began, or were knocked there.
    Found,
    /// The objects were put there.
    Placed,
}

/// Geometry of a state, learned from demonstrations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedState {
    /// Number of poses that the state was learned from.
    pub count: usize,
    /// Number of distinct poses among these: consecutive poses of an object that moved less than 1 mm count once.
    pub distinct: usize,
    /// How most objects came into the state.
    pub origin: Origin,
    /// Robust mean pose.
    pub mean: Pose,
    /// Covariance about the mean: first the three coordinates in metres, then the rotations about the scene's three
    /// axes in radians.
    pub covariance: [[f64; 6]; 6],
}

impl LearnedState {
    /// Returns the standard deviation of each coordinate, in metres.
    pub fn spread(&self) -> [f64; 3] {
        std::array::from_fn(|i| self.covariance[i][i].max(0.0).sqrt())
    }

    /// Returns the direction of the objects' z axis in the mean pose.
    pub(crate) fn upright(&self) -> Vector3<f64> {
        self.mean.rotation() * Vector3::z()
    }

    /// Returns the standard deviation of the direction of the objects' z axis about each of two perpendicular axes, in
    /// radians; `None` if the direction is not constrained.
    pub(crate) fn tilt_sd(&self) -> Option<f64> {
        let turns = Matrix3::from_fn(|i, j| self.covariance[3 + i][3 + j]);
        let up = self.upright();
        let variance = 0.5 * (turns.trace() - up.dot(&(turns * up)));
        let sd = variance.max(0.0).sqrt();
        (sd < WILD_RAD).then_some(sd)
    }
}
