//! Turned copies of ensembles: one solution for decoders serves several ensembles of a pointer.
//!
//! The encoders of a pointer's ensembles are drawn uniformly from the sphere, and the directions of their evaluation
//! points likewise. Turn both by an orthogonal matrix R: the rates at the points stay, and so do the normal equations.
//! If D decodes the identity of the first ensemble with the least error, `D R` does that of the turned one, exactly.
//! R is drawn uniformly too, so each copy is as likely as an ensemble drawn by itself, and its decoding error has a
//! direction of its own. Copies share maximum rates and intercepts, and nothing else.

use rand::Rng;

use super::bank::Draft;
use super::draw::{Neurons, on_sphere};
use super::solve::Points;
use crate::sim::Seed;

/// Returns the ensemble that an ensemble is a turned copy of, where the first `distinct` are drawn and solved for: itself if it
/// is one of them.
pub(super) fn origin(ensemble: usize, distinct: usize) -> usize {
    ensemble % distinct
}

/// An orthogonal matrix.
pub(super) struct Turn {
    dims: usize,
    /// Its rows, one after another.
    rows: Vec<f64>,
}

impl Turn {
    /// Returns the turn of the ensemble with a seed.
    pub fn of(ensemble: Seed, dims: usize) -> Self {
        Self::draw(&mut ensemble.derive("", "turn").rng(), dims)
    }

    /// Draws one uniformly: random directions, each made orthogonal to those before (Stewart 1980).
    fn draw<R: Rng>(rng: &mut R, dims: usize) -> Self {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut rows = vec![0.0; dims * dims];
        for at in 0..dims {
            let (before, rest) = rows.split_at_mut(at * dims);
            let row = &mut rest[..dims];
            loop {
                on_sphere(rng, row);
                // The second time takes away what rounding left.
                for other in before.chunks_exact(dims).chain(before.chunks_exact(dims)) {
                    let along = dot(row, other);
                    row.iter_mut().zip(other).for_each(|(x, y)| *x -= along * y);
                }
                let length = dot(row, row).sqrt();
                if length > 1e-6 {
                    row.iter_mut().for_each(|x| *x /= length);
                    break;
                }
            }
        }
        Self { dims, rows }
    }

    /// Returns vectors turned, one after another.
    pub fn vectors(&self, given: &[f64]) -> Vec<f64> {
        let mut turned = vec![0.0; given.len()];
        for (from, to) in given.chunks_exact(self.dims).zip(turned.chunks_exact_mut(self.dims)) {
            for (x, row) in from.iter().zip(self.rows.chunks_exact(self.dims)) {
                to.iter_mut().zip(row).for_each(|(to, r)| *to += x * r);
            }
        }
        turned
    }

    /// Returns neurons with turned encoders.
    pub fn neurons(&self, given: &Neurons) -> Neurons {
        Neurons { encoders: self.vectors(&given.encoders), ..given.clone() }
    }

    /// Returns an ensemble turned with its points and targets.
    pub fn draft(&self, given: &Draft) -> Draft {
        let Points { values, wanted, outputs } = &given.points;
        let points = Points {
            values: self.vectors(values),
            wanted: self.vectors(wanted),
            outputs: *outputs,
        };
        Draft { neurons: self.neurons(&given.neurons), radius: given.radius, points }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_keeps_all_products_and_moves_each_axis_anywhere() {
        for dims in [1, 2, 7, 16] {
            // The first axis of 400 turns: each of its coordinates has the mean 0 and the mean square 1 / dims.
            let mut sums = vec![[0.0; 2]; dims];
            for seed in 0..400 {
                let turn = Turn::of(Seed::new(seed), dims);
                let mut rng = Seed::new(seed).rng();
                let mut both = vec![0.0; 2 * dims];
                both.chunks_exact_mut(dims).for_each(|v| on_sphere(&mut rng, v));
                let turned = turn.vectors(&both);
                let product = |of: &[f64]| -> f64 { (0..dims).map(|k| of[k] * of[dims + k]).sum() };
                assert!((product(&both) - product(&turned)).abs() < 1e-12, "{dims}, {seed}");
                let mut axis = vec![0.0; dims];
                axis[0] = 1.0;
                for (sum, x) in sums.iter_mut().zip(turn.vectors(&axis)) {
                    *sum = [sum[0] + x, sum[1] + x * x];
                }
            }
            // Five standard errors, for fewer than one coordinate in 1,000,000.
            let (n, share) = (400.0, 1.0 / dims as f64);
            for [sum, squares] in sums {
                assert!((sum / n).abs() < 5.0 * (share / n).sqrt(), "{dims}: {sum}");
                assert!((squares / n - share).abs() < 5.0 * share * (2.0 / n).sqrt(), "{dims}");
            }
        }
    }
}
