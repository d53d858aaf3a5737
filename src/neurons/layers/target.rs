//! What is decoded from an ensemble: a function, or values at points; with a solver and points of its own.

use std::sync::Arc;

use super::settings::{Rows, check_rows, numbers};
use crate::neurons::solve::{Points, Solver};
use crate::neurons::tuning::{TuningError, refuse};
use crate::sim::{Fingerprint, Real};

type Function = Arc<dyn Fn(&[Real], &mut [Real]) + Send + Sync>;

/// What an [`Ensemble`](super::Ensemble) decodes under one name: see
/// [`Ensemble::decode_as`](super::Ensemble::decode_as).
///
/// ```
/// use symbolt::neurons::{Ensemble, NonNegative, Target};
/// // A product by decoders of at least 0, and data in place of a function.
/// let product = Target::function(1, |x, out| out[0] = x[0] * x[1]).solver(NonNegative::default());
/// let data = Target::samples([[0.0, 0.0], [0.5, 0.5], [-0.5, 0.5]], [[0.0], [1.0], [-1.0]]);
/// let ensemble = Ensemble::new(2).decode_as("product", product).decode_as("data", data);
/// # let _ = ensemble;
/// ```
#[derive(Clone)]
pub struct Target {
    pub(super) width: usize,
    function: Function,
    samples: Option<[Rows; 2]>,
    points: Option<Rows>,
    solver: Option<Arc<dyn Solver>>,
}

impl Target {
    /// A function of the vector, whose value has `width` numbers. The closure gets the vector and writes the value;
    /// numbers that it does not write are 0.
    pub fn function(
        width: usize,
        function: impl Fn(&[Real], &mut [Real]) + Send + Sync + 'static,
    ) -> Self {
        Self { width, function: Arc::new(function), samples: None, points: None, solver: None }
    }

    /// The function that has `values` at `points`, a row each, in the units of the represented value and of the output.
    /// Decoders are solved from these rows alone; direct mode takes the value at the nearest point.
    pub fn samples<P: Into<Vec<f64>>, V: Into<Vec<f64>>>(
        points: impl IntoIterator<Item = P>,
        values: impl IntoIterator<Item = V>,
    ) -> Self {
        let points: Rows = points.into_iter().map(Into::into).collect();
        let values: Rows = values.into_iter().map(Into::into).collect();
        let samples = Some([points.clone(), values.clone()]);
        let width = values.first().map_or(1, Vec::len);
        let nearest = move |x: &[Real], out: &mut [Real]| {
            let distance = |row: &[f64]| -> f64 {
                row.iter().zip(x).map(|(a, b)| (a - f64::from(*b)).powi(2)).sum()
            };
            let rows = points.iter().zip(&*values);
            let row = rows.min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)));
            for (out, value) in out.iter_mut().zip(row.map_or(&[][..], |row| row.1)) {
                *out = *value as Real;
            }
        };
        Self { samples, ..Self::function(width, nearest) }
    }

    /// Sets the solver of this function.
    pub fn solver(mut self, solver: impl Solver) -> Self {
        self.solver = Some(Arc::new(solver));
        self
    }

    /// Sets the evaluation points of this function: rows in the unit of the represented value. The function needs to be
    /// finite at these points alone.
    pub fn evaluation_points<R: Into<Vec<f64>>>(
        mut self,
        rows: impl IntoIterator<Item = R>,
    ) -> Self {
        self.points = Some(rows.into_iter().map(Into::into).collect());
        self
    }

    pub(super) fn compute(&self, value: &[Real], out: &mut [Real]) {
        // A function may write some components only.
        out.fill(0.0);
        (self.function)(value, out);
    }

    /// Returns whether the function is solved at points of its own.
    pub(super) fn has_points(&self) -> bool {
        self.points.is_some() || self.samples.is_some()
    }

    pub(super) fn check(&self, dims: usize) -> Result<(), TuningError> {
        self.points.iter().try_for_each(|rows| check_rows("evaluation_points", rows, dims))?;
        let Some([points, values]) = &self.samples else { return Ok(()) };
        check_rows("samples", points, dims)?;
        check_rows("samples", values, self.width)?;
        if self.points.is_some() {
            return Err(refuse("evaluation_points", "given", "none beside samples"));
        }
        match points.len() == values.len() {
            true => Ok(()),
            false => {
                let found = format!("{} points and {} values", points.len(), values.len());
                Err(refuse("samples", found, "as many values as points"))
            }
        }
    }

    /// Returns the points of this function in units of the radius, with their targets; `None` if it has none of its
    /// own.
    pub(super) fn own_points(&self, radius: f64) -> Option<Points> {
        let rows = match &self.samples {
            Some([points, _]) => points,
            None => self.points.as_ref()?,
        };
        let mut out = vec![0.0; self.width];
        let wanted = match &self.samples {
            Some([_, values]) => values.iter().flatten().copied().collect(),
            None => rows
                .iter()
                .flat_map(|row| {
                    let argument: Vec<Real> = row.iter().map(|x| *x as Real).collect();
                    self.compute(&argument, &mut out);
                    out.iter().map(|x| f64::from(*x)).collect::<Vec<_>>()
                })
                .collect(),
        };
        let values = rows.iter().flatten().map(|x| x / radius).collect();
        Some(Points { values, wanted, outputs: self.width })
    }

    /// Returns the solver of the function, given that of the ensemble.
    pub(super) fn solver_or(&self, other: &Option<Arc<dyn Solver>>) -> Option<Arc<dyn Solver>> {
        self.solver.clone().or_else(|| other.clone())
    }

    /// Adds points and solver to a hash.
    pub(super) fn fingerprint(&self, hash: &mut Fingerprint) {
        for rows in self.samples.iter().flatten().chain(&self.points) {
            rows.iter().fold(hash.text("rows"), |hash, row| numbers(hash, row));
        }
        self.solver.iter().for_each(|solver| solver.fingerprint(hash.text("solver")));
    }
}
