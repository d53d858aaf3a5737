//! Decoders of zero, for connections that learn.

use ndarray::{Array2, ArrayView2};

use super::Solver;
use crate::neurons::tuning::TuningError;
use crate::sim::{Fingerprint, Seed};

/// No solver: all decoders are 0, such as at the start of a connection that learns (`NoSolver` of Nengo).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NoDecoders;

impl Solver for NoDecoders {
    fn name(&self) -> &'static str {
        "no decoders"
    }

    fn solve(
        &self,
        rates: ArrayView2<'_, f64>,
        targets: ArrayView2<'_, f64>,
        _seed: Seed,
    ) -> Result<Array2<f64>, TuningError> {
        Ok(Array2::zeros((rates.ncols(), targets.ncols())))
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name());
    }
}
