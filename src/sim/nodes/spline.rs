//! Cubic splines through points in time.

/// Returns the second derivatives of the cubic spline through the points `y` at the increasing times `t`, at least four.
///
/// The third derivative is continuous at the second and at the last but one point ("not a knot", de Boor 1978): the points
/// of a cubic polynomial give that polynomial. Solves a tridiagonal system in O(points).
pub(super) fn curvatures(t: &[f64], y: &[f64]) -> Vec<f64> {
    let last = t.len() - 1;
    let width: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    let slope: Vec<f64> = (0..last).map(|i| (y[i + 1] - y[i]) / width[i]).collect();
    // Unknown are the curvatures of the inner points; the condition at each end gives the outer ones.
    let (first, end) = (width[0] / width[1], width[last - 1] / width[last - 2]);
    let mut diagonal: Vec<f64> = (1..last).map(|i| 2.0 * (width[i - 1] + width[i])).collect();
    let mut above: Vec<f64> = (1..last).map(|i| width[i]).collect();
    let mut below: Vec<f64> = (1..last).map(|i| width[i - 1]).collect();
    let mut right: Vec<f64> = (1..last).map(|i| 6.0 * (slope[i] - slope[i - 1])).collect();
    let inner = diagonal.len();
    diagonal[0] += width[0] * (1.0 + first);
    above[0] -= width[0] * first;
    diagonal[inner - 1] += width[last - 1] * (1.0 + end);
    below[inner - 1] -= width[last - 1] * end;
    for i in 1..inner {
        let factor = below[i] / diagonal[i - 1];
        diagonal[i] -= factor * above[i - 1];
        right[i] -= factor * right[i - 1];
    }
    let mut all = vec![0.0; t.len()];
    for i in (0..inner).rev() {
        let next = if i + 1 < inner { above[i] * all[i + 2] } else { 0.0 };
        all[i + 1] = (right[i] - next) / diagonal[i];
    }
    all[0] = (1.0 + first) * all[1] - first * all[2];
    all[last] = (1.0 + end) * all[last - 1] - end * all[last - 2];
    all
}

/// Returns the value of a cubic with these values and curvatures at its ends, at `share` of a width of `width`.
pub(super) fn cubic(y: [f64; 2], curvature: [f64; 2], width: f64, share: f64) -> f64 {
    let (a, b) = (1.0 - share, share);
    let bend = (a * a * a - a) * curvature[0] + (b * b * b - b) * curvature[1];
    a * y[0] + b * y[1] + bend * width * width / 6.0
}
