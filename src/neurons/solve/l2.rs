//! Least squares with a penalty on the squares of decoders.

use ndarray::{Array2, ArrayView2};

use super::{Solver, ridge, solve_normal};
use crate::neurons::tuning::TuningError;
use crate::sim::{Fingerprint, Seed};

/// Regularised least squares: `(A^T A + m s^2 I) D = A^T Y`, for the rates A at m points and s = `regularisation` times
/// the greatest rate (Eliasmith and Anderson 2003, chapter 2; `LstsqL2` of Nengo). In double precision.
///
/// Costs `m n^2 + n^3 / 3` operations for n neurons. Without a solver, an ensemble uses the same equations with
/// [`Tuning::regularisation`](crate::neurons::Tuning::regularisation), faster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct L2 {
    /// Noise that is expected, as a fraction of the greatest rate (at least 0). Default: 0.1.
    pub regularisation: f64,
}

impl Default for L2 {
    fn default() -> Self {
        Self { regularisation: 0.1 }
    }
}

impl Solver for L2 {
    fn name(&self) -> &'static str {
        "l2"
    }

    fn solve(
        &self,
        rates: ArrayView2<'_, f64>,
        targets: ArrayView2<'_, f64>,
        _seed: Seed,
    ) -> Result<Array2<f64>, TuningError> {
        solve_normal(rates, targets, ridge(rates, self.regularisation)?)
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name()).real(self.regularisation);
    }
}
