//! States of objects, and the geometry that learned states have.

use serde::{Deserialize, Serialize};

use super::pose::Pose;

/// A state that an object of one kind can be in.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The state's name: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// The kind of object.
    pub kind: String,
    /// Where objects in it lie, if it was learned from demonstrations; a state of a domain written
    /// in code has no place, and no object is ever classified into it.
    pub learned: Option<LearnedState>,
}

/// How the parts that are in a state came to be there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// They lay there when a demonstration began, or were knocked there.
    Found,
    /// They were put there.
    Placed,
}

/// What demonstrations showed of a state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedState {
    /// How many poses it was learned from.
    pub count: usize,
    /// How many of them differ by more than the movement of a resting part.
    pub distinct: usize,
    /// How parts came into it.
    pub origin: Origin,
    /// The robust mean pose.
    pub mean: Pose,
    /// Covariance about the mean: coordinates in metres, then rotation about the scene's axes in
    /// radians.
    pub covariance: [[f64; 6]; 6],
}

impl LearnedState {
    /// Standard deviation of each coordinate, in metres.
    pub fn spread(&self) -> [f64; 3] {
        std::array::from_fn(|i| self.covariance[i][i].max(0.0).sqrt())
    }
}
