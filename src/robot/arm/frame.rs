//! Conversions between poses and Rapier's frames, and plain types for rotations and frames with Rapier's
//! arithmetic.

use std::ops::Mul;

use rapier3d::math::{Pose as Frame, Rotation, Vector};
use serde::{Deserialize, Serialize};

use crate::robot::Pose;

pub(crate) fn frame_of(pose: &Pose) -> Frame {
    let [x, y, z, w] = pose.orientation;
    Frame::from_parts(Vector::from(pose.position), Rotation::from_xyzw(x, y, z, w).normalize())
}

pub(crate) fn pose_of(frame: &Frame) -> Pose {
    let q = frame.rotation.normalize();
    Pose { position: frame.translation.to_array(), orientation: [q.x, q.y, q.z, q.w] }
}

/// A rotation in the arithmetic of the physics. Results have the same bits as in the physics. `a * b` turns by `b`
/// first.
///
/// ```
/// use std::f64::consts::FRAC_PI_2;
/// use symbolt::robot::arm::Turn;
///
/// let [x, y, _] = (Turn::about_z(FRAC_PI_2) * Turn::NONE).apply([1.0, 0.0, 0.0]);
/// assert!(x.abs() < 1e-12 && (y - 1.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Turn([f64; 4]);

impl Turn {
    /// No rotation.
    pub const NONE: Self = Self([0.0, 0.0, 0.0, 1.0]);

    /// Returns the rotation about x by an angle in radians.
    pub fn about_x(angle: f64) -> Self {
        Self::of(Rotation::from_rotation_x(angle))
    }

    /// Returns the rotation about y by an angle in radians.
    pub fn about_y(angle: f64) -> Self {
        Self::of(Rotation::from_rotation_y(angle))
    }

    /// Returns the rotation about z by an angle in radians.
    pub fn about_z(angle: f64) -> Self {
        Self::of(Rotation::from_rotation_z(angle))
    }

    /// Returns the rotation about an axis of length 1 by an angle in radians.
    pub fn about(axis: [f64; 3], angle: f64) -> Self {
        Self::of(Rotation::from_axis_angle(Vector::from(axis), angle))
    }

    /// Returns the vector after this rotation.
    pub fn apply(self, vector: [f64; 3]) -> [f64; 3] {
        (self.rotation() * Vector::from(vector)).to_array()
    }

    pub(crate) fn of(rotation: Rotation) -> Self {
        Self([rotation.x, rotation.y, rotation.z, rotation.w])
    }

    pub(crate) fn rotation(self) -> Rotation {
        let [x, y, z, w] = self.0;
        Rotation::from_xyzw(x, y, z, w)
    }
}

impl Mul for Turn {
    type Output = Self;

    fn mul(self, first: Self) -> Self {
        Self::of(self.rotation() * first.rotation())
    }
}

/// A body's frame as the physics stores it, bit for bit. A [`Pose`], by contrast, has a normalised
/// orientation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BodyFrame {
    /// Origin of the frame, in metres.
    pub position: [f64; 3],
    /// Rotation of the frame.
    pub turn: Turn,
}

impl BodyFrame {
    /// Returns a frame at `position`, without rotation.
    pub fn at(position: [f64; 3]) -> Self {
        Self { position, turn: Turn::NONE }
    }

    /// Returns whether all numbers are finite and the rotation has length 1.
    pub fn is_finite(&self) -> bool {
        let length: f64 = self.turn.0.iter().map(|v| v * v).sum();
        self.position.iter().all(|v| v.is_finite()) && (length - 1.0).abs() < 1e-6
    }

    /// Returns the frame as a pose.
    pub fn pose(&self) -> Pose {
        pose_of(&self.frame())
    }

    pub(crate) fn of(frame: &Frame) -> Self {
        Self { position: frame.translation.to_array(), turn: Turn::of(frame.rotation) }
    }

    pub(crate) fn frame(&self) -> Frame {
        Frame::from_parts(Vector::from(self.position), self.turn.rotation())
    }
}

impl From<&Pose> for BodyFrame {
    fn from(pose: &Pose) -> Self {
        Self::of(&frame_of(pose))
    }
}
