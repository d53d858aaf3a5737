//! Draws neurons: encoders, gains and biases; and the evaluation points of pointers.
//!
//! Intercepts for pointers follow the distribution of the cosine between random directions. Each neuron then
//! fires for about the same share of the values that occur (Gosmann and Eliasmith, "Optimizing semantic pointer
//! representations for symbol-like processing in spiking neural networks", 2016).

use std::ops::RangeInclusive;

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::models::NeuronModel;
use super::tuning::TuningError;

/// The neurons of one ensemble. At a value x within the unit ball, a neuron with unit encoder e gets the current
/// `gain (e . x) + bias`. `encoders` has one row of `dims` numbers per neuron.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Neurons {
    pub dims: usize,
    pub encoders: Vec<f64>,
    pub gains: Vec<f64>,
    pub biases: Vec<f64>,
}

impl Neurons {
    pub fn count(&self) -> usize {
        self.gains.len()
    }

    /// Draws neurons: encoders and intercepts from the given functions, maximum rates uniformly from `max_rates`.
    pub fn draw<R: Rng>(
        model: &dyn NeuronModel,
        (count, dims): (usize, usize),
        max_rates: RangeInclusive<f64>,
        rng: &mut R,
        mut encoder: impl FnMut(&mut R, &mut [f64]),
        mut intercept: impl FnMut(&mut R) -> f64,
    ) -> Result<Self, TuningError> {
        let mut all = Self {
            dims,
            encoders: vec![0.0; count * dims],
            gains: Vec::with_capacity(count),
            biases: Vec::with_capacity(count),
        };
        let (low, high) = (*max_rates.start(), *max_rates.end());
        for row in all.encoders.chunks_exact_mut(dims) {
            encoder(rng, row);
            let rate = low + (high - low) * rng.random::<f64>();
            let (gain, bias) = model.gain_bias(rate, intercept(rng))?;
            all.gains.push(gain);
            all.biases.push(bias);
        }
        Ok(all)
    }

    /// Makes each second neuron the mirror image of the one before it: of opposite encoder, and the same gain and bias.
    pub fn mirror(&mut self) {
        let Self { dims, encoders, gains, biases } = self;
        for pair in encoders.chunks_exact_mut(2 * *dims) {
            let (one, other) = pair.split_at_mut(*dims);
            other.iter_mut().zip(one).for_each(|(other, one)| *other = -*one);
        }
        for pair in gains.chunks_exact_mut(2).chain(biases.chunks_exact_mut(2)) {
            pair[1] = pair[0];
        }
    }
}

/// Draws a direction uniformly from the sphere.
pub(crate) fn on_sphere<R: Rng>(rng: &mut R, out: &mut [f64]) {
    loop {
        out.iter_mut().for_each(|v| *v = StandardNormal.sample(rng));
        let length = out.iter().map(|v| v * v).sum::<f64>().sqrt();
        if length > 1e-9 {
            out.iter_mut().for_each(|v| *v /= length);
            return;
        }
    }
}

/// Draws 1 or -1.
#[cfg(test)]
pub(crate) fn either_way<R: Rng>(rng: &mut R, out: &mut [f64]) {
    out.fill(if rng.random::<bool>() { 1.0 } else { -1.0 });
}

/// Draws the squared length of a vector of `count` normal numbers.
fn square_of_normals<R: Rng>(rng: &mut R, count: usize) -> f64 {
    let normals = std::iter::repeat_with(|| -> f64 { StandardNormal.sample(rng) });
    normals.take(count).map(|v| v * v).sum()
}

/// Draws the cosine between two random directions in `dims` dimensions. At most 0.95, so that every neuron fires for
/// some values.
pub(crate) fn cosine<R: Rng>(rng: &mut R, dims: usize) -> f64 {
    let first: f64 = StandardNormal.sample(rng);
    let rest = square_of_normals(rng, dims.saturating_sub(1));
    (first / (first * first + rest).sqrt().max(1e-12)).clamp(-0.999, 0.95)
}

/// Draws a part of a random unit pointer: `out.len()` of its `total` dimensions.
pub(crate) fn part_of_pointer<R: Rng>(rng: &mut R, out: &mut [f64], total: usize) {
    let rest = square_of_normals(rng, total.saturating_sub(out.len()));
    out.iter_mut().for_each(|v| *v = StandardNormal.sample(rng));
    let own: f64 = out.iter().map(|v| v * v).sum();
    let length = (own + rest).sqrt().max(1e-12);
    out.iter_mut().for_each(|v| *v /= length);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Seed;

    #[test]
    fn cosines_have_the_variance_of_random_directions() {
        // The mean square is 1 / dims. With 20,000 draws it is off by 4 standard errors for fewer than one seed
        // in 10,000.
        let mut rng = Seed::new(1).rng();
        for dims in [2, 18, 258] {
            let mean: f64 = (0..20_000).map(|_| cosine(&mut rng, dims).powi(2)).sum::<f64>() / 2e4;
            let expected = 1.0 / dims as f64;
            assert!((mean - expected).abs() < 0.05 * expected + 0.005, "{dims}: {mean} {expected}");
        }
    }

    #[test]
    fn parts_of_pointers_have_their_share_of_the_length() {
        let mut rng = Seed::new(2).rng();
        let mut part = [0.0; 16];
        let mean: f64 = (0..5_000)
            .map(|_| {
                part_of_pointer(&mut rng, &mut part, 256);
                part.iter().map(|v| v * v).sum::<f64>()
            })
            .sum::<f64>()
            / 5e3;
        assert!((mean - 16.0 / 256.0).abs() < 2e-3, "{mean}");
    }
}
