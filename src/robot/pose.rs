//! Poses: positions in metres, orientations as unit quaternions, and mean orientations.

use nalgebra::{Matrix4, Quaternion, SymmetricEigen, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// A position and an orientation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Position `[x, y, z]`, in metres.
    pub position: [f64; 3],
    /// Orientation as a unit quaternion `[x, y, z, w]`.
    pub orientation: [f64; 4],
}

/// The coordinate of positions that points up.
pub(crate) const UP: usize = 2;

impl Pose {
    /// Returns the unrotated pose at `position`, in metres.
    pub fn at(position: [f64; 3]) -> Self {
        Self { position, orientation: [0.0, 0.0, 0.0, 1.0] }
    }

    /// Returns the Euclidean distance between the two positions, in metres.
    pub fn distance(&self, other: &Self) -> f64 {
        let square = |i: usize| (self.position[i] - other.position[i]).powi(2);
        (square(0) + square(1) + square(2)).sqrt()
    }

    /// Returns the pose outside of what has the pose `inner` in a frame with this one. An orientation that is not a
    /// number stays one that is not.
    pub(crate) fn after(&self, inner: &Self) -> Self {
        let turn = self.rotation();
        let position = turn * Vector3::from(inner.position) + Vector3::from(self.position);
        let orientation = match inner.orientation[3].is_nan() {
            true => inner.orientation,
            false => quaternion_array(&(turn * inner.rotation())),
        };
        Self { position: position.into(), orientation }
    }

    pub(crate) fn rotation(&self) -> UnitQuaternion<f64> {
        let [x, y, z, w] = self.orientation;
        UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
    }
}

pub(crate) fn quaternion_array(q: &UnitQuaternion<f64>) -> [f64; 4] {
    [q.i, q.j, q.k, q.w]
}

/// Returns the mean orientation: the unit quaternion `q` that maximises `sum (q . q_i)^2`. `None` for an empty slice.
///
/// The mean is the eigenvector of `sum q_i q_i^T` with the largest eigenvalue (Markley, Cheng, Crassidis and Oshman,
/// "Averaging quaternions", Journal of Guidance, Control, and Dynamics 30(4), 2007). It does not depend on the signs of
/// the `q_i`: `q` and `-q` are the same rotation. The component of the mean with the largest magnitude is positive.
pub fn mean_orientation(orientations: &[[f64; 4]]) -> Option<[f64; 4]> {
    if orientations.is_empty() {
        return None;
    }
    let mut sum = Matrix4::<f64>::zeros();
    for q in orientations {
        let q = nalgebra::Vector4::from(*q);
        sum += q * q.transpose();
    }
    let eigen = SymmetricEigen::new(sum);
    let best = eigen.eigenvalues.imax();
    let mut mean = eigen.eigenvectors.column(best).normalize();
    if mean[mean.iamax()] < 0.0 {
        mean = -mean;
    }
    Some([mean[0], mean[1], mean[2], mean[3]])
}

/// Returns the rotation from `from` to `to` as a rotation vector in the scene's frame: its direction is the axis, its
/// length the angle, at most pi radians.
pub fn rotation_between(from: &Pose, to: &Pose) -> [f64; 3] {
    let turn: Vector3<f64> = (to.rotation() * from.rotation().inverse()).scaled_axis();
    let angle = turn.norm();
    // The axis-angle form may turn by more than pi: take the equivalent rotation of at most pi.
    let turn = if angle > std::f64::consts::PI {
        turn * ((angle - std::f64::consts::TAU) / angle)
    } else {
        turn
    };
    [turn.x, turn.y, turn.z]
}
