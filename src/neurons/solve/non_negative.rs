//! Least squares with decoders that are not negative.

use ndarray::{Array1, Array2, ArrayView1, ArrayView2};

use super::{Solver, dense, normal, ridge};
use crate::neurons::tuning::TuningError;
use crate::sim::{Fingerprint, Seed};

/// Least squares with decoders of at least 0, such as those of excitatory neurons (`Nnls` of Nengo), with a
/// regularisation as in [`L2`](super::L2).
///
/// By active sets on the normal equations (Bro and de Jong, "A fast non-negativity-constrained least squares
/// algorithm", 1997): up to `n^4 / 12` operations for n neurons.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NonNegative {
    /// Noise that is expected, as a fraction of the greatest rate (at least 0). Default: 0.
    pub regularisation: f64,
}

/// Solves one column: `gram` is symmetric, `wanted` the product of rates and targets.
fn solve_one(gram: &Array2<f64>, wanted: ArrayView1<'_, f64>) -> Array1<f64> {
    let n = wanted.len();
    let tolerance = 1e-11 * wanted.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let (mut decoders, mut passive) = (Array1::zeros(n), vec![false; n]);
    // Neurons whose rates depend on those of the passive set.
    let mut dependent = vec![false; n];
    for _ in 0..3 * n {
        let slope = &wanted - &gram.dot(&decoders);
        let free = (0..n).filter(|i| !passive[*i] && !dependent[*i] && slope[*i] > tolerance);
        let Some(next) = free.max_by(|a, b| slope[*a].total_cmp(&slope[*b])) else { break };
        passive[next] = true;
        loop {
            let set: Vec<usize> = (0..n).filter(|i| passive[*i]).collect();
            let count = set.len();
            let mut inner = Array2::from_shape_fn((count, count), |(i, j)| gram[(set[i], set[j])]);
            let mut solved = Array2::from_shape_fn((count, 1), |(i, _)| wanted[set[i]]);
            if dense::solve(inner.view_mut(), solved.view_mut()).is_none() {
                (passive[next], dependent[next]) = (false, true);
                break;
            }
            let step = (set.iter().zip(solved.column(0)))
                .filter(|(_, new)| **new <= 0.0)
                .map(|(i, new)| decoders[*i] / (decoders[*i] - new))
                .fold(f64::INFINITY, f64::min);
            for (i, new) in set.iter().zip(solved.column(0)) {
                decoders[*i] += step.min(1.0) * (new - decoders[*i]);
                passive[*i] =
                    decoders[*i] > 1e-300 && (step >= 1.0 || decoders[*i] > 1e-14 * new.abs());
                if !passive[*i] {
                    decoders[*i] = 0.0;
                }
            }
            if step >= 1.0 {
                break;
            }
        }
    }
    decoders
}

impl Solver for NonNegative {
    fn name(&self) -> &'static str {
        "non-negative"
    }

    fn solve(
        &self,
        rates: ArrayView2<'_, f64>,
        targets: ArrayView2<'_, f64>,
        _seed: Seed,
    ) -> Result<Array2<f64>, TuningError> {
        let [gram, upper] = normal(rates, targets, ridge(rates, self.regularisation)?);
        let mut all = Array2::zeros(upper.dim());
        for (mut to, wanted) in all.columns_mut().into_iter().zip(upper.columns()) {
            to.assign(&solve_one(&gram, wanted));
        }
        Ok(all)
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name()).real(self.regularisation);
    }
}
