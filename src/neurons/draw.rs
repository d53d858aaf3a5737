//! Draws neurons: encoders, gains and biases; and the evaluation points of pointers.
//!
//! Intercepts for pointers follow the distribution of the cosine between random directions. Each neuron then
//! fires for about the same share of the values that occur (Gosmann and Eliasmith, "Optimizing semantic pointer
//! representations for symbol-like processing in spiking neural networks", 2016).

use std::f64::consts::TAU;
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

/// Draws a vector from the unit ball: its direction evenly, its length as in a ball of at most `most` dimensions.
pub(crate) fn in_ball<R: Rng>(rng: &mut R, out: &mut [f64], most: usize) {
    on_sphere(rng, out);
    let length = rng.random::<f64>().powf(1.0 / out.len().min(most) as f64);
    out.iter_mut().for_each(|value| *value *= length);
}

/// Points that fill the unit cube evenly, where independent draws leave clusters and gaps.
///
/// Each coordinate grows by a fixed irrational step and starts at a random number, modulo 1. The steps are powers of
/// 1 / g, where g is the root above 1 of `g^(d+1) = g + 1` for d coordinates (Roberts, "The unreasonable effectiveness of
/// quasirandom sequences", 2018).
pub(crate) struct EvenPoints {
    steps: Vec<f64>,
    next: Vec<f64>,
}

impl EvenPoints {
    /// Greatest number of dimensions in which directions are made of even points.
    pub const MOST_DIMS: usize = 3;

    pub fn new<R: Rng>(rng: &mut R, coordinates: usize) -> Self {
        let root = (0..64).fold(1.5f64, |g, _| (g + 1.0).powf(1.0 / (coordinates as f64 + 1.0)));
        let steps = (1..=coordinates).map(|power| root.powi(-(power as i32))).collect();
        Self { steps, next: (0..coordinates).map(|_| rng.random()).collect() }
    }

    /// Goes on to the next point.
    pub fn advance(&mut self) -> &[f64] {
        for (at, step) in self.next.iter_mut().zip(&self.steps) {
            *at = (*at + step).fract();
        }
        &self.next
    }

    /// Writes the direction that belongs to a point of the cube of one dimension less than `out`. Even points give even
    /// directions, of 2 or 3 dimensions.
    pub fn direction(point: &[f64], out: &mut [f64]) {
        let (sine, cosine) = (TAU * point[0]).sin_cos();
        let height = point.get(1).filter(|_| out.len() > 2).map_or(0.0, |share| 2.0 * share - 1.0);
        let across = (1.0 - height * height).sqrt();
        for (value, part) in out.iter_mut().zip([across * cosine, across * sine, height]) {
            *value = part;
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

    /// Greatest difference between the share of `points` in a box and the volume of the box, over boxes from the origin
    /// to corners of a grid.
    fn discrepancy(points: &[[f64; 3]]) -> f64 {
        let corners = (1..=8).map(|k| f64::from(k) / 8.0);
        let boxes = corners.clone().flat_map(|x| {
            let corners = corners.clone();
            corners.clone().flat_map(move |y| corners.clone().map(move |z| [x, y, z]))
        });
        let worst = boxes.map(|corner| {
            let within = |point: &&[f64; 3]| point.iter().zip(&corner).all(|(at, end)| at < end);
            let share = points.iter().filter(within).count() as f64 / points.len() as f64;
            (share - corner.iter().product::<f64>()).abs()
        });
        worst.fold(0.0, f64::max)
    }

    #[test]
    fn even_points_fill_the_cube_more_evenly_than_draws() {
        for seed in 1..=20 {
            let mut rng = Seed::new(seed).rng();
            let mut even = EvenPoints::new(&mut rng, 3);
            let points: Vec<[f64; 3]> =
                (0..300).map(|_| even.advance().try_into().unwrap()).collect();
            assert!(points.iter().flatten().all(|at| (0.0..1.0).contains(at)));
            let drawn: Vec<[f64; 3]> =
                (0..300).map(|_| std::array::from_fn(|_| rng.random())).collect();
            let (even, drawn) = (discrepancy(&points), discrepancy(&drawn));
            assert!(even < 0.025 && drawn > even, "{seed}: {even} {drawn}");
        }
    }

    #[test]
    fn even_directions_have_the_moments_of_the_sphere() {
        for dims in [2, 3] {
            let mut even = EvenPoints::new(&mut Seed::new(3).rng(), dims - 1);
            let (mut out, mut mean, mut square) =
                (vec![0.0; dims], vec![0.0; dims], vec![0.0; dims]);
            for _ in 0..200 {
                EvenPoints::direction(even.advance(), &mut out);
                assert!((out.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-12);
                for (axis, value) in out.iter().enumerate() {
                    mean[axis] += value / 200.0;
                    square[axis] += value * value / 200.0;
                }
            }
            // Two hundred independent draws are off by 0.05 on the mean of an axis.
            assert!(mean.iter().all(|mean| mean.abs() < 0.01), "{mean:?}");
            assert!(square.iter().all(|s| (s - 1.0 / dims as f64).abs() < 0.01), "{square:?}");
        }
    }
}
