//! Decoders: regularised least squares from the neurons' rates to the values wanted.
//!
//! `D = (A^T A + m s^2 I)^-1 A^T F` with rates A at m points (a row a point), values F wanted there and `s` the
//! regularisation times the greatest rate (Eliasmith and Anderson 2003, chapter 2; the scaling by the
//! greatest rate is Nengo's `LstsqL2`, so that one figure fits both). Solved by Cholesky in double precision
//! (`faer`).

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, Par, Side};

use super::model::{Lif, TuningError};
use super::tuning::Neurons;

/// Values, and the functions of them that are wanted, at which decoders are solved for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Points {
    /// A row a point, within about the unit ball.
    pub values: Vec<f64>,
    /// A row a point.
    pub wanted: Vec<f64>,
    pub outputs: usize,
}

/// Rates of the neurons at points, a column a point: the transpose of A.
pub(crate) fn rates(lif: &Lif, neurons: &Neurons, values: &[f64]) -> Mat<f64> {
    let (dims, count) = (neurons.dims, neurons.count());
    let points = values.len() / dims;
    let mut out = Mat::zeros(count, points);
    let mut currents = vec![0.0; count];
    for (at, value) in values.chunks_exact(dims).enumerate() {
        for (neuron, current) in currents.iter_mut().enumerate() {
            let encoder = &neurons.encoders[neuron * dims..(neuron + 1) * dims];
            let along: f64 = encoder.iter().zip(value).map(|(e, v)| e * v).sum();
            *current = neurons.gains[neuron] * along + neurons.biases[neuron];
        }
        for (neuron, current) in currents.iter().enumerate() {
            out[(neuron, at)] = lif.rate(*current);
        }
    }
    out
}

/// Decoders, a row a neuron: a rate times its row, summed over the neurons, is the value decoded.
///
/// Costs about `m n^2 + n^3 / 3` operations for n neurons and m points.
pub(crate) fn solve(
    lif: &Lif,
    neurons: &Neurons,
    points: &Points,
    regularisation: f64,
) -> Result<Vec<f64>, TuningError> {
    let at = rates(lif, neurons, &points.values);
    let (count, m) = (at.nrows(), at.ncols());
    let greatest = at.col_iter().flat_map(|c| c.iter().copied()).fold(0.0, f64::max);
    let noise = (regularisation * greatest).powi(2) * m as f64;
    let mut gram = Mat::<f64>::zeros(count, count);
    faer::linalg::matmul::triangular::matmul(
        gram.as_mut(),
        faer::linalg::matmul::triangular::BlockStructure::TriangularLower,
        faer::Accum::Replace,
        at.as_ref(),
        faer::linalg::matmul::triangular::BlockStructure::Rectangular,
        at.transpose(),
        faer::linalg::matmul::triangular::BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
    for i in 0..count {
        // A neuron that never fires has a row of zeros: its decoder is then zero.
        gram[(i, i)] += noise.max(1e-12);
    }
    let wanted = MatRef::from_row_major_slice(&points.wanted, m, points.outputs);
    let upper = at.as_ref() * wanted;
    let factor = gram.llt(Side::Lower).map_err(|_| TuningError::Unsolvable { neurons: count })?;
    let solved = factor.solve(&upper);
    let mut out = Vec::with_capacity(count * points.outputs);
    for neuron in 0..count {
        out.extend((0..points.outputs).map(|k| solved[(neuron, k)]));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::neurons::tuning::either_way;
    use crate::sim::Seed;

    fn scalar(count: usize, seed: u64) -> (Lif, Neurons) {
        let (lif, mut rng) = (Lif::default(), Seed::new(seed).rng());
        let uniform = |r: &mut rand_chacha::ChaCha8Rng| -1.0 + 1.9 * r.random::<f64>();
        let drawn = Neurons::draw(&lif, (count, 1), 200.0..=400.0, &mut rng, either_way, uniform);
        (lif, drawn.expect("possible"))
    }

    fn line(points: usize) -> Points {
        let values: Vec<f64> =
            (0..points).map(|i| -1.0 + 2.0 * i as f64 / (points - 1) as f64).collect();
        Points { wanted: values.clone(), values, outputs: 1 }
    }

    /// Root mean square error without noise, and the length of the decoders.
    fn errors(count: usize, seed: u64, regularisation: f64) -> (f64, f64) {
        let (lif, neurons) = scalar(count, seed);
        let points = line(400);
        let decoders = solve(&lif, &neurons, &points, regularisation).expect("solvable");
        let at = rates(&lif, &neurons, &points.values);
        let off: f64 = (0..400)
            .map(|p| {
                let value: f64 = (0..count).map(|n| at[(n, p)] * decoders[n]).sum();
                (value - points.values[p]).powi(2)
            })
            .sum();
        ((off / 400.0).sqrt(), decoders.iter().map(|d| d * d).sum::<f64>())
    }

    #[test]
    fn the_solution_satisfies_the_normal_equations() {
        let (lif, neurons) = scalar(40, 3);
        let points = line(200);
        let decoders = solve(&lif, &neurons, &points, 0.1).expect("solvable");
        let at = rates(&lif, &neurons, &points.values);
        let greatest = (0..40).flat_map(|n| (0..200).map(move |p| (n, p))).map(|i| at[i]);
        let noise = (0.1 * greatest.fold(0.0, f64::max)).powi(2) * 200.0;
        for row in 0..40 {
            let fitted: f64 = (0..40)
                .map(|n| {
                    let gram: f64 = (0..200).map(|p| at[(row, p)] * at[(n, p)]).sum();
                    (gram + if n == row { noise } else { 0.0 }) * decoders[n]
                })
                .sum();
            let wanted: f64 = (0..200).map(|p| at[(row, p)] * points.values[p]).sum();
            assert!((fitted - wanted).abs() < 1e-6 * wanted.abs().max(1.0), "{row}");
        }
    }

    /// Eliasmith and Anderson 2003, section 2.3: with hardly any regularisation the static distortion falls
    /// as the square of the number of neurons, and the term of the noise as the number.
    #[test]
    fn distortion_falls_as_the_square_of_the_neurons_and_noise_as_their_number() {
        let median = |count: usize, regularisation: f64, which: fn((f64, f64)) -> f64| {
            let mut all: Vec<f64> =
                (0..9).map(|seed| which(errors(count, seed, regularisation))).collect();
            all.sort_by(f64::total_cmp);
            all[4]
        };
        let slope = |a: f64, b: f64| (b / a).ln() / 8f64.ln();
        let distortion = |e: (f64, f64)| e.0 * e.0;
        let static_slope = slope(median(25, 1e-4, distortion), median(200, 1e-4, distortion));
        assert!((-5.0..=-1.6).contains(&static_slope), "{static_slope}");
        let noise_slope = slope(median(25, 0.1, |e| e.1), median(200, 0.1, |e| e.1));
        assert!((-1.3..=-0.7).contains(&noise_slope), "{noise_slope}");
    }
}
