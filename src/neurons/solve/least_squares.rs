//! Decoders: regularised least squares from the neurons' rates to the target values.
//!
//! `D = (A^T A + m s^2 I)^-1 A^T F`. A holds the rates at m evaluation points (one row per point), F holds the target
//! values there, and s is the regularisation times the greatest rate (Eliasmith and Anderson 2003, chapter 2). Scaling
//! by the greatest rate follows `LstsqL2` of Nengo, so the same regularisation has the same meaning in both. A
//! Cholesky factorisation ([`super::dense`]) solves the system, in single precision if that is accurate enough, and otherwise
//! in double precision.

use std::ops::Range;

use ndarray::linalg::general_mat_mul;
use ndarray::{Array1, Array2, NdFloat};

use super::dense;
use crate::neurons::draw::Neurons;
use crate::neurons::models::NeuronModel;
use crate::neurons::tuning::TuningError;

/// Evaluation points and the target values there.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Points {
    /// Represented values, one row per point, roughly within the unit ball.
    pub values: Vec<f64>,
    /// Target values, one row of `outputs` numbers per point.
    pub wanted: Vec<f64>,
    pub outputs: usize,
}

impl Points {
    /// Returns the targets, a row per point.
    pub fn targets(&self) -> Array2<f64> {
        let rows = self.wanted.len() / self.outputs.max(1);
        Array2::from_shape_fn((rows, self.outputs), |(p, k)| self.wanted[p * self.outputs + k])
    }

    /// Returns the points with some of the outputs.
    pub fn columns(&self, columns: &Range<usize>) -> Self {
        let rows = self.wanted.chunks_exact(self.outputs);
        let wanted = rows.flat_map(|row| row[columns.clone()].iter().copied()).collect();
        Self { values: self.values.clone(), wanted, outputs: columns.len() }
    }

    /// Returns whether anything but zero is to be decoded. Neurons that currents alone drive may be silent at all points.
    pub fn asks(&self) -> bool {
        self.wanted.iter().any(|wanted| *wanted != 0.0)
    }
}

/// Floating-point types in which a system can be solved.
pub(crate) trait Precision: NdFloat {
    fn of(value: f64) -> Self;
    fn double(self) -> f64;
    /// Replaces currents by firing rates.
    fn rates(model: &dyn NeuronModel, currents: &mut [Self]);
}

impl Precision for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn double(self) -> f64 {
        self
    }

    fn rates(model: &dyn NeuronModel, currents: &mut [Self]) {
        model.rates(currents);
    }
}

impl Precision for f32 {
    fn of(value: f64) -> Self {
        value as Self
    }

    fn double(self) -> f64 {
        f64::from(self)
    }

    fn rates(model: &dyn NeuronModel, currents: &mut [Self]) {
        model.rates_single(currents);
    }
}

/// Adds the product `a b` to `out`. Row by row where `a` is so narrow or short that blocks would not pay.
fn add_product<T: Precision>(a: &Array2<T>, b: &Array2<T>, out: &mut Array2<T>) {
    if a.nrows().min(a.ncols()) > 4 {
        return general_mat_mul(T::one(), a, b, T::one(), out);
    }
    for (factors, mut out) in a.rows().into_iter().zip(out.rows_mut()) {
        for (factor, row) in factors.iter().zip(b.rows()) {
            out.scaled_add(*factor, &row);
        }
    }
}

/// Returns the neurons' rates at the points, one row per point: the matrix A.
pub(crate) fn rates<T: Precision>(
    model: &dyn NeuronModel,
    neurons: &Neurons,
    values: &[f64],
) -> Array2<T> {
    let (dims, count) = (neurons.dims, neurons.count());
    let points = values.len() / dims;
    let gained = Array2::from_shape_fn((dims, count), |(k, n)| {
        T::of(neurons.gains[n] * neurons.encoders[n * dims + k])
    });
    let values = Array2::from_shape_fn((points, dims), |(at, k)| T::of(values[at * dims + k]));
    let biases: Array1<T> = neurons.biases.iter().map(|bias| T::of(*bias)).collect();
    let mut out = Array2::zeros((points, count));
    out.rows_mut().into_iter().for_each(|mut row| row.assign(&biases));
    add_product(&values, &gained, &mut out);
    for mut point in out.rows_mut() {
        if let Some(currents) = point.as_slice_mut() {
            T::rates(model, currents);
        }
    }
    out
}

/// Returns the greatest rate, or 0 if there is none. Eight running maxima need no order, so they fit one instruction.
fn greatest<T: Precision>(rates: &Array2<T>) -> T {
    let mut greatest = [T::zero(); 8];
    for chunk in rates.as_slice().unwrap_or_default().chunks(8) {
        for (greatest, rate) in greatest.iter_mut().zip(chunk) {
            *greatest = if *rate > *greatest { *rate } else { *greatest };
        }
    }
    greatest.into_iter().fold(T::zero(), T::max)
}

/// Greatest condition number for single precision. The condition number is at most the number of neurons divided by
/// the square of the regularisation. Up to this limit, rounding adds far less error than the regularisation does.
const SINGLE: f64 = 1e7;

/// Solves for decoders, one row per neuron. The decoded value is the sum over all neurons of rate times row.
///
/// Costs about `m n^2 + n^3 / 3` operations for n neurons and m points. Single precision is twice as fast; it is used
/// if its rounding errors are small beside the effect of the regularisation.
pub(crate) fn solve(
    model: &dyn NeuronModel,
    neurons: &Neurons,
    points: &Points,
    regularisation: f64,
) -> Result<Vec<f64>, TuningError> {
    if neurons.count() as f64 <= SINGLE * regularisation.powi(2) {
        solve_in::<f32>(model, neurons, points, regularisation)
    } else {
        solve_in::<f64>(model, neurons, points, regularisation)
    }
}

fn solve_in<T: Precision>(
    model: &dyn NeuronModel,
    neurons: &Neurons,
    points: &Points,
    regularisation: f64,
) -> Result<Vec<f64>, TuningError> {
    let at = rates::<T>(model, neurons, &points.values);
    let m = at.nrows();
    let greatest = greatest(&at).double();
    if greatest == 0.0 && at.iter().all(|rate| *rate == T::zero()) && points.asks() {
        return Err(TuningError::Silent { points: m });
    }
    let wanted = Array2::from_shape_fn((points.outputs, m), |(k, p)| {
        T::of(points.wanted[p * points.outputs + k])
    });
    let solved = solve_normal(&at, &wanted, (regularisation * greatest).powi(2) * m as f64)?;
    Ok(solved.iter().map(|decoder| decoder.double()).collect())
}

/// Solves the normal equations with `ridge` on the diagonal. `wanted` has a row per output, the result a row per neuron.
pub(super) fn solve_normal<T: Precision>(
    rates: &Array2<T>,
    wanted: &Array2<T>,
    ridge: f64,
) -> Result<Array2<T>, TuningError> {
    let count = rates.ncols();
    let mut gram = Array2::<T>::zeros((count, count));
    dense::add_gram(T::one(), rates.view(), T::zero(), gram.view_mut());
    for i in 0..count {
        // A neuron that never fires has a row of zeros. The added term then makes its decoder zero.
        gram[(i, i)] += T::of(ridge.max(1e-12));
    }
    let mut upper = Array2::zeros((wanted.nrows(), count));
    add_product(wanted, rates, &mut upper);
    let mut solved = upper.t().as_standard_layout().into_owned();
    dense::solve(gram.view_mut(), solved.view_mut())
        .ok_or(TuningError::Unsolvable { neurons: count })?;
    Ok(solved)
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::neurons::draw::either_way;
    use crate::neurons::models::Lif;
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

    /// Root mean square error without noise, and the sum of the squared decoders.
    fn errors(count: usize, seed: u64, regularisation: f64) -> (f64, f64) {
        let (lif, neurons) = scalar(count, seed);
        let points = line(400);
        let decoders = solve(&lif, &neurons, &points, regularisation).expect("solvable");
        let at = rates::<f64>(&lif, &neurons, &points.values);
        let off: f64 = (0..400)
            .map(|p| {
                let value: f64 = (0..count).map(|n| at[(p, n)] * decoders[n]).sum();
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
        let at = rates::<f64>(&lif, &neurons, &points.values);
        let greatest = at.iter().copied();
        let noise = (0.1 * greatest.fold(0.0, f64::max)).powi(2) * 200.0;
        for row in 0..40 {
            let fitted: f64 = (0..40)
                .map(|n| {
                    let gram: f64 = (0..200).map(|p| at[(p, row)] * at[(p, n)]).sum();
                    (gram + if n == row { noise } else { 0.0 }) * decoders[n]
                })
                .sum();
            let wanted: f64 = (0..200).map(|p| at[(p, row)] * points.values[p]).sum();
            assert!((fitted - wanted).abs() < 1e-6 * wanted.abs().max(1.0), "{row}");
        }
    }

    /// In one dimension rates are most alike, so the system is as badly conditioned as it can be.
    #[test]
    fn at_the_limit_single_precision_decodes_as_well_as_double() {
        let (regularisation, points) = (0.01, line(2_000));
        let count = (SINGLE * regularisation * regularisation) as usize;
        for seed in 0..3 {
            let (lif, neurons) = scalar(count, seed);
            let at = rates::<f64>(&lif, &neurons, &points.values);
            let error = |decoders: Vec<f64>| {
                let off = at.rows().into_iter().zip(&points.wanted).map(|(row, wanted)| {
                    let value: f64 = row.iter().zip(&decoders).map(|(rate, d)| rate * d).sum();
                    (value - wanted).powi(2)
                });
                (off.sum::<f64>() / 2e3).sqrt()
            };
            let single = solve_in::<f32>(&lif, &neurons, &points, regularisation);
            let double = solve_in::<f64>(&lif, &neurons, &points, regularisation);
            let [single, double] = [single, double].map(|solved| error(solved.expect("solvable")));
            // Far below the noise of spikes, which is of the order of 1e-2.
            assert!((single - double).abs() < 1e-4, "{count} neurons: {single} and {double}");
        }
    }

    /// Eliasmith and Anderson 2003, section 2.3: the static distortion (measured with hardly any regularisation) falls
    /// with the square of the number of neurons, the noise term with the number of neurons.
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
