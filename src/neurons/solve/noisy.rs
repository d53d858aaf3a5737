//! Least squares on rates with noise.

use ndarray::{Array2, ArrayView2};
use rand_distr::{Distribution, StandardNormal};

use super::{Solver, greatest, solve_normal};
use crate::neurons::tuning::{TuningError, not_negative};
use crate::sim::{Fingerprint, Seed};

/// Least squares on rates to which normal noise was added (`LstsqNoise` of Nengo), or by which they were multiplied
/// (`LstsqMultNoise`). The noise regularises: with many points, added noise gives the decoders of [`L2`](super::L2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noisy {
    noise: f64,
    multiplied: bool,
}

impl Noisy {
    /// Adds noise with a standard deviation of `noise` (at least 0) times the greatest rate.
    pub fn added(noise: f64) -> Self {
        Self { noise, multiplied: false }
    }

    /// Multiplies each rate by a number with mean 1 and a standard deviation of `noise` (at least 0).
    pub fn multiplied(noise: f64) -> Self {
        Self { noise, multiplied: true }
    }
}

impl Solver for Noisy {
    fn name(&self) -> &'static str {
        "noisy"
    }

    fn solve(
        &self,
        rates: ArrayView2<'_, f64>,
        targets: ArrayView2<'_, f64>,
        seed: Seed,
    ) -> Result<Array2<f64>, TuningError> {
        not_negative("noise", self.noise)?;
        let (mut rng, scale) = (seed.rng(), self.noise * greatest(rates));
        let noisy = rates.mapv(|rate| {
            let normal: f64 = StandardNormal.sample(&mut rng);
            if self.multiplied { rate + self.noise * rate * normal } else { rate + scale * normal }
        });
        solve_normal(noisy.view(), targets, 0.0)
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name()).real(self.noise).number(u64::from(self.multiplied));
    }
}
