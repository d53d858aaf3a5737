//! Least squares with a penalty on the magnitudes of decoders: few neurons are decoded.

use ndarray::{Array2, ArrayView2};

use super::{Solver, greatest, normal};
use crate::neurons::tuning::{TuningError, not_negative, refuse};
use crate::sim::{Fingerprint, Seed};

/// The elastic net: least `|A d - y|^2 / (2 m) + a |d|_1 + b |d|^2 / 2`, with `a = l1 r` and `b = l2 r^2` for the
/// greatest rate r (`LstsqL1` of Nengo). Most decoders are 0.
///
/// Solved by coordinate descent (Friedman, Hastie and Tibshirani, "Regularization paths for generalized linear models
/// via coordinate descent", 2010): a sweep costs `n^2` operations for n neurons, and there are at most `sweeps`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct L1 {
    /// Weight of the magnitudes (at least 0). Default: 1e-4.
    pub l1: f64,
    /// Weight of the squares (at least 0). Default: 1e-6.
    pub l2: f64,
    /// Greatest number of sweeps over all neurons (at least 1). Default: 1,000.
    pub sweeps: usize,
}

impl Default for L1 {
    fn default() -> Self {
        Self { l1: 1e-4, l2: 1e-6, sweeps: 1_000 }
    }
}

/// The descent ends once no step of a sweep changes a decoded value by more than this fraction of the targets.
const SMALL: f64 = 1e-7;

impl Solver for L1 {
    fn name(&self) -> &'static str {
        "l1"
    }

    fn solve(
        &self,
        rates: ArrayView2<'_, f64>,
        targets: ArrayView2<'_, f64>,
        _seed: Seed,
    ) -> Result<Array2<f64>, TuningError> {
        not_negative("l1", self.l1)?;
        not_negative("l2", self.l2)?;
        if self.sweeps == 0 {
            return Err(refuse("sweeps", 0, "at least 1"));
        }
        let (m, n) = (rates.nrows() as f64, rates.ncols());
        let (a, b) = (self.l1 * greatest(rates), self.l2 * greatest(rates).powi(2));
        let [mut gram, upper] = normal(rates, targets, 0.0);
        gram /= m;
        let mut all = Array2::zeros(upper.dim());
        for (k, wanted) in upper.columns().into_iter().enumerate() {
            let size = targets.column(k).iter().map(|y| y * y).sum::<f64>() / m;
            let (mut decoders, mut rest) = (vec![0.0; n], wanted.mapv(|x| x / m));
            for _ in 0..self.sweeps {
                let mut change = 0.0f64;
                for i in 0..n {
                    let (square, old) = (gram[(i, i)], decoders[i]);
                    if square <= 0.0 {
                        continue;
                    }
                    let free = rest[i] + square * old;
                    let new = free.signum() * (free.abs() - a).max(0.0) / (square + b);
                    if new != old {
                        rest.scaled_add(old - new, &gram.row(i));
                        decoders[i] = new;
                        change = change.max(square * (new - old).powi(2));
                    }
                }
                if change <= SMALL * SMALL * size {
                    break;
                }
            }
            all.column_mut(k).iter_mut().zip(decoders).for_each(|(to, from)| *to = from);
        }
        Ok(all)
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name()).real(self.l1).real(self.l2).number(self.sweeps as u64);
    }
}
