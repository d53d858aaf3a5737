//! Distances between positions by p-norms. With negative p, two positions are close if they agree in any coordinate.

use rayon::prelude::*;

use crate::task::error::TaskError;

/// Exponent p that the paper uses (section II.E).
pub const PAPER_EXPONENT: f64 = -2.0;

/// Checks an exponent of the p-norm.
///
/// # Errors
/// [`TaskError::Setting`] if `p` is 0 or not finite.
pub fn check_exponent(p: f64) -> Result<(), TaskError> {
    if p.is_finite() && p != 0.0 {
        return Ok(());
    }
    let expected = "a finite number other than 0; the paper uses -2";
    Err(TaskError::Setting { name: "p", value: p.to_string(), expected })
}

/// Returns the p-norm of `u - v`: `(sum |u_i - v_i|^p)^(1/p)` (equation 1 of the paper).
///
/// With `p < 0`, the distance is at most the smallest coordinate difference, so two positions are close as soon as one
/// coordinate agrees. If a difference is exactly 0, the distance for such `p` is 0, the limit of the formula. Equal
/// positions have distance 0 for any `p`.
///
/// ```
/// use symbolt::task::learn::p_distance;
/// let d = p_distance(&[0.0, 0.0, 0.0], &[3.0, 4.0, 12.0], -2.0);
/// assert!((d - (1.0f64 / 9.0 + 1.0 / 16.0 + 1.0 / 144.0).powf(-0.5)).abs() < 1e-12);
/// assert_eq!(p_distance(&[1.0, 5.0, 9.0], &[7.0, 5.0, -3.0], -2.0), 0.0);
/// ```
///
/// # Panics
/// If `u` and `v` have different lengths.
pub fn p_distance(u: &[f64], v: &[f64], p: f64) -> f64 {
    assert_eq!(u.len(), v.len(), "two positions have the same number of coordinates");
    if let ([u0, u1, u2], [v0, v1, v2]) = (u, v)
        && p == PAPER_EXPONENT
    {
        return inverse_square(u0 - v0, u1 - v1, u2 - v2);
    }
    let differences = || u.iter().zip(v).map(|(a, b)| (a - b).abs());
    // Scale by the dominant difference, so that its term is 1 and no power overflows.
    let scale = if p < 0.0 {
        differences().fold(f64::INFINITY, f64::min)
    } else {
        differences().fold(0.0, f64::max)
    };
    if scale == 0.0 || scale.is_infinite() {
        return 0.0;
    }
    let sum: f64 = differences().map(|d| (d / scale).powf(p)).sum();
    scale * sum.powf(1.0 / p)
}

/// The case `p = -2` in three dimensions, computed with one root and one quotient:
/// `(1/x + 1/y + 1/z)^(-1/2) = sqrt(x y z / (x y + y z + z x))`, where x, y and z are the squared differences.
#[inline]
fn inverse_square(dx: f64, dy: f64, dz: f64) -> f64 {
    // Scale by the largest difference, so that no product overflows or underflows too early.
    let most = dx.abs().max(dy.abs()).max(dz.abs());
    let scale = if most > 0.0 { 1.0 / most } else { 0.0 };
    let (x, y, z) = (dx * scale, dy * scale, dz * scale);
    let (x, y, z) = (x * x, y * y, z * z);
    let below = x * y + y * z + z * x;
    let ratio = if below > 0.0 { x * y * z / below } else { 0.0 };
    ratio.sqrt() * most
}

/// Returns all pairwise p-norm distances of `points` as a condensed matrix: the rows above the diagonal, one after the
/// other, `n (n - 1) / 2` numbers. Uses all threads of the current rayon pool; the result does not depend on their
/// number.
pub fn distance_matrix(points: &[[f64; 3]], p: f64) -> Vec<f64> {
    let n = points.len();
    let mut condensed = vec![0.0; n * n.saturating_sub(1) / 2];
    let mut rows = Vec::with_capacity(n);
    let mut rest = condensed.as_mut_slice();
    for i in 0..n {
        let (row, tail) = rest.split_at_mut(n - 1 - i);
        rows.push((i, row));
        rest = tail;
    }
    rows.into_par_iter().with_min_len(16).for_each(|(i, row)| fill_row(points, i, row, p));
    condensed
}

fn fill_row(points: &[[f64; 3]], i: usize, row: &mut [f64], p: f64) {
    let others = &points[i + 1..];
    if p == PAPER_EXPONENT {
        inverse_square_row(points[i], others, row);
    } else {
        for (out, other) in row.iter_mut().zip(others) {
            *out = p_distance(&points[i], other, p);
        }
    }
}

#[multiversion::multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
fn inverse_square_row(point: [f64; 3], others: &[[f64; 3]], row: &mut [f64]) {
    let [x, y, z] = point;
    for (out, other) in row.iter_mut().zip(others) {
        *out = inverse_square(x - other[0], y - other[1], z - other[2]);
    }
}
