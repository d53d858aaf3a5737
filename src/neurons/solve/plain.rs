//! Least squares without a penalty.

use nalgebra::DMatrix;
use ndarray::{Array2, ArrayView2};

use super::Solver;
use crate::neurons::tuning::{TuningError, not_negative};
use crate::sim::{Fingerprint, Seed};

/// Plain least squares: of all decoders with the least error, those with the least squares. Singular values below
/// `cutoff` times the greatest count as 0 (`Lstsq` of Nengo). Costs some `m n^2` operations, ten times those of
/// [`L2`](super::L2): minutes for 2,000 neurons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeastSquares {
    /// Least singular value, as a fraction of the greatest (at least 0). Default: 0.01.
    pub cutoff: f64,
}

impl Default for LeastSquares {
    fn default() -> Self {
        Self { cutoff: 0.01 }
    }
}

impl Solver for LeastSquares {
    fn name(&self) -> &'static str {
        "least squares"
    }

    fn solve(
        &self,
        rates: ArrayView2<'_, f64>,
        targets: ArrayView2<'_, f64>,
        _seed: Seed,
    ) -> Result<Array2<f64>, TuningError> {
        not_negative("cutoff", self.cutoff)?;
        let of = |array: ArrayView2<'_, f64>| {
            DMatrix::from_row_iterator(array.nrows(), array.ncols(), array.iter().copied())
        };
        let svd = of(rates).svd(true, true);
        let least = self.cutoff * svd.singular_values.max();
        let unsolvable = || TuningError::Unsolvable { neurons: rates.ncols() };
        let solved = svd.solve(&of(targets), least).map_err(|_| unsolvable())?;
        Ok(Array2::from_shape_fn((rates.ncols(), targets.ncols()), |at| solved[at]))
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name()).real(self.cutoff);
    }
}
