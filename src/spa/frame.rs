//! Tight frames: sets of unit vectors whose mutual similarities are as small as they can be together.
//!
//! For N unit rows in D dimensions the sum of all squared similarities is at least `N^2 / D` (Welch, "Lower bounds on
//! the maximum cross correlation of signals", 1974). Tight frames reach this bound. A similarity of two rows then has
//! the variance `(1 - D / N) / D` instead of the `1 / D` of random vectors.
//!
//! The rows start as random vectors. Two steps alternate: one brings all singular values nearer to each other, the
//! other scales the rows to norm 1 (alternating projection; Tropp, Dhillon, Heath and Strohmer, "Designing structured
//! tight frames via an alternating projection method", 2005). The first step is one Newton-Schulz step towards the
//! polar factor, `B (3 - B^T B) / 2`, so it needs no decomposition.

use ndarray::linalg::general_mat_mul;
use ndarray::{Array2, ArrayViewMut2};
use rand::Rng;

use super::vocabulary::draw_pointer;
use crate::sim::Real;

/// Greatest number of rounds. Frames of usual shapes need 10 to 40.
const MAX_ROUNDS: usize = 200;
/// Greatest deviation from the identity at which a frame counts as tight.
const TIGHT: f64 = 1e-5;

/// Draws `count` unit rows of `dim` numbers that form a tight frame, or are orthonormal if there are no more rows than
/// dimensions. Row-major. Costs O(N D min(N, D)) for each of some 20 rounds: two seconds for 1,250 rows of 500.
pub(crate) fn tight_frame<R: Rng>(count: usize, dim: usize, rng: &mut R) -> Vec<Real> {
    let rows: Vec<Real> = (0..count).flat_map(|_| draw_pointer(dim, rng)).collect();
    let mut frame = Array2::from_shape_fn((count, dim), |(i, j)| f64::from(rows[i * dim + j]));
    let least = count.min(dim);
    let mut next = Array2::zeros((count, dim));
    let mut gram = Array2::zeros((least, least));
    for _ in 0..MAX_ROUNDS {
        let (wide, tall) = (count <= dim, frame.t());
        let scale = if wide { 1.0 } else { dim as f64 / count as f64 };
        match wide {
            true => general_mat_mul(scale, &frame, &tall, 0.0, &mut gram),
            false => general_mat_mul(scale, &tall, &frame, 0.0, &mut gram),
        }
        let off = deviation(&gram);
        gram.mapv_inplace(|value| -0.5 * value);
        gram.diag_mut().mapv_inplace(|value| value + 1.5);
        match wide {
            true => general_mat_mul(1.0, &gram, &frame, 0.0, &mut next),
            false => general_mat_mul(1.0, &frame, &gram, 0.0, &mut next),
        }
        std::mem::swap(&mut frame, &mut next);
        unit_rows(frame.view_mut());
        if off < TIGHT {
            break;
        }
    }
    frame.iter().map(|value| *value as Real).collect()
}

/// Returns the greatest deviation of a matrix from the identity.
fn deviation(gram: &Array2<f64>) -> f64 {
    let off = |((i, j), value): ((usize, usize), &f64)| {
        let wanted = if i == j { 1.0 } else { 0.0 };
        (value - wanted).abs()
    };
    gram.indexed_iter().map(off).fold(0.0, f64::max)
}

fn unit_rows(mut rows: ArrayViewMut2<'_, f64>) {
    for mut row in rows.rows_mut() {
        let length = row.iter().map(|v| v * v).sum::<f64>().sqrt();
        if length > 0.0 {
            row.mapv_inplace(|v| v / length);
        }
    }
}
