//! The model of a state: a robust mean pose and a 6-D Gaussian of position and orientation.

use crate::robot::{Pose, mean_orientation, rotation_between};

/// Returns the robust mean of `values` (section II.E of the paper): the mean without the `floor(n / 10)` lowest and the
/// `floor(n / 10)` highest values. Returns 0 for no values. Sorts `values`.
///
/// ```
/// use symbolt::task::learn::robust_mean;
/// let mut nine_and_a_slip: Vec<f64> = vec![1.0; 9];
/// nine_and_a_slip.push(1000.0);
/// assert_eq!(robust_mean(&mut nine_and_a_slip), 1.0);
/// assert_eq!(robust_mean(&mut [1.0, 2.0, 6.0]), 3.0);
/// ```
pub fn robust_mean(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let drop = values.len() / 10;
    let kept = &values[drop..values.len() - drop];
    if kept.is_empty() { 0.0 } else { kept.iter().sum::<f64>() / kept.len() as f64 }
}

/// A six-dimensional Gaussian over poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseGaussian {
    /// Robust mean pose: each coordinate by [`robust_mean`], the orientation by [`mean_orientation`] of the `n -
    /// floor(n / 10)` poses closest to the mean orientation of all poses.
    pub mean: Pose,
    /// Covariance about the mean, `sum x x^T / (n - 1)`: first the three coordinates in metres, then the rotations from
    /// the mean about the scene's three axes in radians. Zero for a single pose.
    pub covariance: [[f64; 6]; 6],
}

impl PoseGaussian {
    /// Fits a Gaussian to `poses`; `None` if there are none.
    pub fn fit(poses: &[Pose]) -> Option<Self> {
        let n = poses.len();
        let mut position = [0.0; 3];
        for (axis, mean) in position.iter_mut().enumerate() {
            let mut values: Vec<f64> = poses.iter().map(|p| p.position[axis]).collect();
            *mean = robust_mean(&mut values);
        }
        let orientations: Vec<[f64; 4]> = poses.iter().map(|p| p.orientation).collect();
        let rough = Pose { position, orientation: mean_orientation(&orientations)? };
        let mut by_angle: Vec<(f64, [f64; 4])> = poses
            .iter()
            .map(|p| (rotation_between(&rough, p).map(|v| v * v).iter().sum(), p.orientation))
            .collect();
        by_angle.sort_by(|a, b| a.0.total_cmp(&b.0));
        by_angle.truncate(n - n / 10);
        let kept: Vec<[f64; 4]> = by_angle.into_iter().map(|(_, q)| q).collect();
        let mean = Pose { position, orientation: mean_orientation(&kept)? };
        let mut covariance = [[0.0; 6]; 6];
        for pose in poses {
            let turn = rotation_between(&mean, pose);
            let x: [f64; 6] = std::array::from_fn(|i| {
                if i < 3 { pose.position[i] - position[i] } else { turn[i - 3] }
            });
            for (row, a) in covariance.iter_mut().zip(x) {
                for (cell, b) in row.iter_mut().zip(x) {
                    *cell += a * b;
                }
            }
        }
        let scale = if n > 1 { 1.0 / (n - 1) as f64 } else { 0.0 };
        covariance.iter_mut().flatten().for_each(|cell| *cell *= scale);
        Some(Self { mean, covariance })
    }
}
