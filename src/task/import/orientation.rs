//! Orientations from the numbers of a log: a quaternion, three numbers of a rotation, or a matrix.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::mapping::{Angle, Rotation};
use crate::logs::unit;
use crate::robot::pose::quaternion_array;

/// Returns the orientation that four numbers x, y, z, w, three of a rotation, or nine of a matrix by rows are. Of four
/// zeros it was not seen.
///
/// # Errors
/// What is wrong, in words.
pub(super) fn orientation(
    values: &[f64],
    rotation: Rotation,
    angle: Angle,
) -> Result<[f64; 4], String> {
    match *values {
        [x, y, z, w] => unit([x, y, z, w]),
        [a, b, c] => {
            let scale = if angle == Angle::Degree { 1f64.to_radians() } else { 1.0 };
            let [a, b, c] = [a, b, c].map(|v| v * scale);
            Ok(quaternion_array(&match rotation {
                Rotation::Euler => UnitQuaternion::from_euler_angles(a, b, c),
                Rotation::Vector => UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c)),
            }))
        }
        _ => {
            let matrix = Matrix3::from_row_slice(values.get(..9).unwrap_or(&[0.0; 9]));
            if !((matrix * matrix.transpose() - Matrix3::identity()).norm() < 0.2
                && matrix.determinant() > 0.0)
            {
                return Err("the nine numbers are not a rotation".into());
            }
            let turn = Rotation3::from_matrix_unchecked(matrix);
            Ok(quaternion_array(&UnitQuaternion::from_rotation_matrix(&turn)))
        }
    }
}
