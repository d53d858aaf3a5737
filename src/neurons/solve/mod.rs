//! Solving decoders: the trait of solvers, and the solvers, each in a file of its own.
//!
//! The default is least squares with the plan's regularisation ([`least_squares`]), in single precision where that is
//! enough. Functions of an [`Ensemble`](super::Ensemble) may have another [`Solver`].

mod dense;
mod l1;
mod l2;
mod least_squares;
mod no_decoders;
mod noisy;
mod non_negative;
mod plain;

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use ndarray::{Array2, ArrayView2};

use super::draw::Neurons;
use super::models::NeuronModel;
use super::tuning::{TuningError, not_negative, refuse};
use crate::sim::{Fingerprint, Seed};

pub use l1::L1;
pub use l2::L2;
pub(crate) use least_squares::{Points, rates, solve};
pub use no_decoders::NoDecoders;
pub use noisy::Noisy;
pub use non_negative::NonNegative;
pub use plain::LeastSquares;

/// A way to find decoders: numbers D for which the product of rates and D is near the target values.
///
/// Decoders by the mean rate alone, a solver of one's own:
///
/// ```
/// use ndarray::{Array2, ArrayView2, Axis};
/// use symbolt::neurons::{Ensemble, Solver, TuningError};
/// use symbolt::sim::{Fingerprint, Seed};
///
/// #[derive(Debug)]
/// struct Correlated;
/// impl Solver for Correlated {
///     fn name(&self) -> &'static str {
///         "correlated"
///     }
///     fn solve(
///         &self,
///         rates: ArrayView2<'_, f64>,
///         targets: ArrayView2<'_, f64>,
///         _seed: Seed,
///     ) -> Result<Array2<f64>, TuningError> {
///         let squares = rates.iter().map(|rate| rate * rate).sum::<f64>();
///         Ok(rates.t().dot(&targets) / squares.max(1.0))
///     }
///     fn fingerprint(&self, hash: &mut Fingerprint) {
///         hash.text(self.name());
///     }
/// }
/// let ensemble = Ensemble::new(1).identity("x").solver(Correlated);
/// # let _ = ensemble;
/// ```
pub trait Solver: fmt::Debug + Send + Sync + 'static {
    /// Returns the name of the solver in messages.
    fn name(&self) -> &'static str;

    /// Returns decoders, a row per neuron and a column per output. `rates` has a row per evaluation point and a column
    /// per neuron, in Hz; `targets` has a row per point and a column per output. Random numbers must come from the
    /// seed.
    ///
    /// # Errors
    /// [`TuningError::Setting`] for parameters outside their range; [`TuningError::Unsolvable`] if there is no
    /// solution.
    fn solve(
        &self,
        rates: ArrayView2<'_, f64>,
        targets: ArrayView2<'_, f64>,
        seed: Seed,
    ) -> Result<Array2<f64>, TuningError>;

    /// Adds to `hash` the name and every parameter.
    fn fingerprint(&self, hash: &mut Fingerprint);
}

/// Outputs that have points or a solver of their own.
#[derive(Debug, Clone)]
pub(crate) struct Special {
    /// Their columns among all outputs.
    pub columns: Range<usize>,
    /// Their points and targets, if not those of the ensemble.
    pub points: Option<Arc<Points>>,
    pub solver: Option<Arc<dyn Solver>>,
}

/// Solves for the decoders of all outputs, one row per neuron.
pub(crate) fn solve_all(
    (model, neurons): (&dyn NeuronModel, &Neurons),
    points: &Points,
    regularisation: f64,
    special: &[Special],
    seed: Seed,
) -> Result<Vec<f64>, TuningError> {
    let outputs = points.outputs;
    let covered: usize = special.iter().map(|special| special.columns.len()).sum();
    // Targets of 0, such as those of an ensemble of bare neurons, need neither a solution nor neurons that fire.
    let mut all = match covered < outputs && points.asks() {
        true => solve(model, neurons, points, regularisation)?,
        false => vec![0.0; neurons.count() * outputs],
    };
    for Special { columns, points: own, solver } in special {
        let own = own.as_ref().map_or_else(|| points.columns(columns), |own| (**own).clone());
        let solved = match solver {
            None => solve(model, neurons, &own, regularisation)?,
            Some(solver) => {
                let seed = seed.derive_index("solver", columns.start as u64);
                solve_by(&**solver, (model, neurons), &own, seed)?
            }
        };
        let rows = all.chunks_exact_mut(outputs).zip(solved.chunks_exact(own.outputs));
        rows.for_each(|(row, solved)| row[columns.clone()].copy_from_slice(solved));
    }
    Ok(all)
}

/// Solves for decoders, one row per neuron, and checks the result.
fn solve_by(
    solver: &dyn Solver,
    (model, neurons): (&dyn NeuronModel, &Neurons),
    points: &Points,
    seed: Seed,
) -> Result<Vec<f64>, TuningError> {
    let rates = rates::<f64>(model, neurons, &points.values);
    if rates.iter().all(|rate| *rate == 0.0) && points.asks() {
        return Err(TuningError::Silent { points: rates.nrows() });
    }
    let solved = solver.solve(rates.view(), points.targets().view(), seed)?;
    let expected = (neurons.count(), points.outputs);
    if solved.dim() != expected || solved.iter().any(|decoder| !decoder.is_finite()) {
        let found = format!("`{}`, which gave an array of shape {:?}", solver.name(), solved.dim());
        return Err(refuse("solver", found, format!("finite numbers of shape {expected:?}")));
    }
    Ok(solved.iter().copied().collect())
}

/// Returns the products of the neurons' rates with each other plus `ridge` on the diagonal, and with the targets.
fn normal(
    rates: ArrayView2<'_, f64>,
    targets: ArrayView2<'_, f64>,
    ridge: f64,
) -> [Array2<f64>; 2] {
    let mut gram = Array2::zeros((rates.ncols(), rates.ncols()));
    dense::add_gram(1.0, rates, 0.0, gram.view_mut());
    gram.diag_mut().iter_mut().for_each(|square| *square += ridge);
    for i in 0..gram.nrows() {
        // Only the upper triangle is complete.
        (0..i).for_each(|j| gram[(i, j)] = gram[(j, i)]);
    }
    [gram, rates.t().dot(&targets)]
}

/// Solves the normal equations with `ridge` on the diagonal.
fn solve_normal(
    rates: ArrayView2<'_, f64>,
    targets: ArrayView2<'_, f64>,
    ridge: f64,
) -> Result<Array2<f64>, TuningError> {
    least_squares::solve_normal(&rates.to_owned(), &targets.t().to_owned(), ridge)
}

/// Returns what a regularisation, a fraction of the greatest rate, adds to the diagonal of the normal equations.
fn ridge(rates: ArrayView2<'_, f64>, regularisation: f64) -> Result<f64, TuningError> {
    not_negative("regularisation", regularisation)?;
    Ok((regularisation * greatest(rates)).powi(2) * rates.nrows() as f64)
}

/// Returns the greatest rate, at least 0.
fn greatest(rates: ArrayView2<'_, f64>) -> f64 {
    rates.iter().copied().fold(0.0, f64::max)
}
