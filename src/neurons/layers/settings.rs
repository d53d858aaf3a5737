//! What is set for the neurons of one ensemble, in place of the ranges of the plan.

use std::sync::Arc;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::Ensemble;
use crate::neurons::bank::{Shape, hadamard};
use crate::neurons::draw::{EvenPoints, Neurons, cosine, on_sphere};
use crate::neurons::models::{NeuronModel, RateOf, Start};
use crate::neurons::plan::NeuronSpec;
use crate::neurons::solve::Solver;
use crate::neurons::tuning::{Tuning, TuningError, refuse};
use crate::sim::{Fingerprint, Seed, nearest_first};

type DrawValue = dyn Fn(&mut ChaCha8Rng) -> f64 + Send + Sync;
type DrawRow = dyn Fn(&mut ChaCha8Rng, &mut [f64]) + Send + Sync;

/// Where a number of each neuron comes from, such as its intercept.
#[derive(Clone)]
pub struct Values(Source<f64, Arc<DrawValue>>);

#[derive(Clone)]
enum Source<T, D> {
    Between(f64, f64),
    Given(Arc<[T]>),
    Choice(Arc<[T]>),
    Drawn(D),
}

impl Values {
    /// Draws uniformly from `low` up to `high`. Intercepts up to three dimensions are spread evenly over the range
    /// ([`Ensemble`]).
    pub fn between(low: f64, high: f64) -> Self {
        Self(Source::Between(low, high))
    }

    /// Takes the numbers as they are: one per neuron, in all copies of the ensemble alike, or one per neuron of all
    /// copies.
    pub fn given(values: impl Into<Vec<f64>>) -> Self {
        Self(Source::Given(values.into().into()))
    }

    /// Draws one of some numbers for each neuron. Of a single number, it is that one.
    pub fn choice(values: impl Into<Vec<f64>>) -> Self {
        Self(Source::Choice(values.into().into()))
    }

    /// Draws from any distribution, such as one of the crate `rand_distr`.
    pub fn drawn(draw: impl Fn(&mut ChaCha8Rng) -> f64 + Send + Sync + 'static) -> Self {
        Self(Source::Drawn(Arc::new(draw)))
    }

    /// Checks what does not depend on the number of neurons.
    fn check(&self, name: &'static str) -> Result<(), TuningError> {
        let found = match &self.0 {
            Source::Between(low, high) if low <= high && (high - low).is_finite() => return Ok(()),
            Source::Between(low, high) => format!("{low} to {high}"),
            Source::Given(all) | Source::Choice(all) if all.is_empty() => "empty".into(),
            Source::Given(all) | Source::Choice(all) => {
                match all.iter().find(|value| !value.is_finite()) {
                    None => return Ok(()),
                    Some(wrong) => wrong.to_string(),
                }
            }
            Source::Drawn(_) => return Ok(()),
        };
        Err(refuse(name, found, "finite numbers; of a range, in rising order"))
    }

    /// Returns the number of a neuron, which has index `at` among those of all copies. `share` chooses a number of a
    /// range, from 0 for the low end to 1.
    fn draw(
        &self,
        rng: &mut ChaCha8Rng,
        at: usize,
        share: impl FnOnce(&mut ChaCha8Rng) -> f64,
    ) -> f64 {
        match &self.0 {
            Source::Between(low, high) => low + (high - low) * share(rng),
            Source::Given(all) => all[at % all.len()],
            Source::Choice(all) => all[rng.random_range(0..all.len())],
            Source::Drawn(draw) => draw(rng),
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        match &self.0 {
            Source::Between(low, high) => hash.text("between").real(*low).real(*high),
            Source::Given(all) => numbers(hash.text("given"), all),
            Source::Choice(all) => numbers(hash.text("choice"), all),
            Source::Drawn(draw) => {
                let mut rng = Seed::new(0).derive("", "values").rng();
                let some: Vec<f64> = (0..64).map(|_| draw(&mut rng)).collect();
                numbers(hash.text("drawn"), &some)
            }
        };
    }
}

impl From<f64> for Values {
    /// One number for all neurons.
    fn from(value: f64) -> Self {
        Self::choice([value])
    }
}

/// Adds a list of numbers to a hash.
pub(super) fn numbers<'h>(hash: &'h mut Fingerprint, all: &[f64]) -> &'h mut Fingerprint {
    hash.number(all.len() as u64);
    all.iter().fold(hash, |hash, value| hash.real(*value))
}

/// The directions in which the neurons of an ensemble are tuned: a row of as many numbers as the ensemble has
/// dimensions, for each neuron. Rows are scaled to length 1.
#[derive(Clone)]
pub struct Encoders {
    source: Source<Vec<f64>, Arc<DrawRow>>,
    scaled: bool,
    /// Whether rows of Hadamard matrices replace the source in more than one dimension.
    hadamard: bool,
}

impl Encoders {
    fn of(source: Source<Vec<f64>, Arc<DrawRow>>) -> Self {
        Self { source, scaled: true, hadamard: false }
    }

    /// Draws directions uniformly from the sphere; in one dimension 1 and -1.
    pub fn sphere() -> Self {
        Self::drawn(on_sphere)
    }

    /// Draws rows of Hadamard matrices whose columns are multiplied by random signs: corners of a cube, in groups that
    /// are at right angles if the dimensions are a power of two. In one dimension 1 and -1; at most 128 dimensions.
    ///
    /// Neurons with such encoders are stepped faster, since a fast Walsh-Hadamard transform takes the place of encoders
    /// that would be read from memory. From 16 dimensions on they represent values as well as those of
    /// [`sphere`](Self::sphere). In few dimensions they are few directions, four in two dimensions, which suit
    /// some functions and not others.
    /// [`Tuning::encoders`](crate::neurons::Tuning::encoders) sets them for pointers.
    pub fn hadamard() -> Self {
        Self { hadamard: true, ..Self::sphere() }
    }

    /// Takes the rows as they are: one per neuron, in all copies of the ensemble alike, or one per neuron of all
    /// copies.
    pub fn given<R: Into<Vec<f64>>>(rows: impl IntoIterator<Item = R>) -> Self {
        Self::of(Source::Given(rows.into_iter().map(Into::into).collect()))
    }

    /// Draws one of some rows for each neuron.
    pub fn choice<R: Into<Vec<f64>>>(rows: impl IntoIterator<Item = R>) -> Self {
        Self::of(Source::Choice(rows.into_iter().map(Into::into).collect()))
    }

    /// Draws rows from any distribution.
    pub fn drawn(draw: impl Fn(&mut ChaCha8Rng, &mut [f64]) + Send + Sync + 'static) -> Self {
        Self::of(Source::Drawn(Arc::new(draw)))
    }

    /// Keeps the lengths of the rows: a row twice as long has twice the effect of its neuron's gain.
    pub fn unscaled(mut self) -> Self {
        self.scaled = false;
        self
    }

    fn check(&self, dims: usize) -> Result<(), TuningError> {
        if self.hadamard && dims > *hadamard::DIMS.end() {
            let expected = format!("at most {}", hadamard::DIMS.end());
            return Err(refuse("encoders", format!("Hadamard in {dims} dimensions"), expected));
        }
        let (Source::Given(rows) | Source::Choice(rows)) = &self.source else { return Ok(()) };
        if rows.is_empty() {
            return Err(refuse("encoders", "empty", "at least one row"));
        }
        rows.iter().try_for_each(|row| self.check_row(row, dims))
    }

    fn check_row(&self, row: &[f64], dims: usize) -> Result<(), TuningError> {
        let length = row.iter().map(|x| x * x).sum::<f64>();
        match row.len() == dims && length.is_finite() && length > 0.0 {
            true => Ok(()),
            false => {
                let expected = format!("rows of {dims} finite numbers, not all of them 0");
                Err(refuse("encoders", format!("{row:?}"), expected))
            }
        }
    }

    /// Writes the row of a neuron with index `at` among those of all copies.
    fn draw(&self, rng: &mut ChaCha8Rng, at: usize, row: &mut [f64]) -> Result<(), TuningError> {
        match &self.source {
            Source::Between(..) => {}
            Source::Given(rows) => row.copy_from_slice(&rows[at % rows.len()]),
            Source::Choice(rows) => row.copy_from_slice(&rows[rng.random_range(0..rows.len())]),
            Source::Drawn(draw) => draw(rng, row),
        }
        self.check_row(row, row.len())?;
        if self.scaled {
            let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
            row.iter_mut().for_each(|x| *x /= length);
        }
        Ok(())
    }

    fn fingerprint(&self, hash: &mut Fingerprint, dims: usize) {
        hash.text("encoders").number(u64::from(self.scaled));
        match &self.source {
            Source::Between(..) => {}
            Source::Given(rows) => {
                rows.iter().fold(hash.text("given"), |hash, row| numbers(hash, row));
            }
            Source::Choice(rows) => {
                rows.iter().fold(hash.text("choice"), |hash, row| numbers(hash, row));
            }
            Source::Drawn(draw) => {
                let mut rng = Seed::new(0).derive("", "encoders").rng();
                let mut row = vec![0.0; dims];
                for _ in 0..64 {
                    draw(&mut rng, &mut row);
                    numbers(hash, &row);
                }
            }
        }
    }
}

/// The settings of an ensemble. What is not set comes from the plan.
#[derive(Clone, Default)]
pub(super) struct Settings {
    pub encoders: Option<Encoders>,
    pub intercepts: Option<Values>,
    pub max_rates: Option<Values>,
    pub gains_and_biases: Option<[Arc<[f64]>; 2]>,
    /// Number of evaluation points, or the points.
    pub points: Option<Result<usize, Rows>>,
    pub model: Option<Arc<dyn NeuronModel>>,
    pub starts: Vec<(String, Start)>,
    pub solver: Option<Arc<dyn Solver>>,
}

/// Rows of equal length.
pub(super) type Rows = Arc<[Vec<f64>]>;

/// Greatest number of evaluation points.
const MOST_POINTS: usize = 1_000_000;

/// Checks evaluation points or values at them.
pub(super) fn check_rows(name: &'static str, rows: &Rows, width: usize) -> Result<(), TuningError> {
    if rows.is_empty() || rows.len() > MOST_POINTS {
        let expected = format!("1 to {MOST_POINTS} rows");
        return Err(refuse(name, format!("{} rows", rows.len()), expected));
    }
    let sound = |row: &&Vec<f64>| row.len() == width && row.iter().all(|x| x.is_finite());
    match rows.iter().find(|row| !sound(row)) {
        None => Ok(()),
        Some(row) => {
            Err(refuse(name, format!("{row:?}"), format!("rows of {width} finite numbers")))
        }
    }
}

impl Settings {
    /// Checks what does not depend on the neurons.
    pub fn check(&self, dims: usize) -> Result<(), TuningError> {
        self.encoders.iter().try_for_each(|encoders| encoders.check(dims))?;
        self.intercepts.iter().try_for_each(|values| values.check("intercepts"))?;
        self.max_rates.iter().try_for_each(|values| values.check("max_rates"))?;
        if let Some([gains, biases]) = &self.gains_and_biases {
            if self.intercepts.is_some() || self.max_rates.is_some() {
                let expected = "no intercepts and maximum rates beside them";
                return Err(refuse("gains_and_biases", "given", expected));
            }
            if let Some(wrong) = gains.iter().chain(&**biases).find(|value| !value.is_finite()) {
                return Err(refuse("gains_and_biases", wrong, "finite numbers"));
            }
        }
        match &self.points {
            Some(Ok(count)) if !(1..=MOST_POINTS).contains(count) => {
                Err(refuse("evaluation_count", count, format!("1 to {MOST_POINTS}")))
            }
            Some(Err(rows)) => check_rows("evaluation_points", rows, dims),
            _ => Ok(()),
        }
    }

    /// Checks what depends on the neurons: lengths, and names of variables.
    pub fn check_neurons(
        &self,
        (count, copies): (usize, usize),
        model: &dyn NeuronModel,
    ) -> Result<(), TuningError> {
        let fits =
            |name: &'static str, found: usize| match found == count || found == count * copies {
                true => Ok(()),
                false => {
                    let expected = match copies {
                        1 => format!("{count}, one per neuron"),
                        _ => format!(
                            "{count}, one per neuron, or {} for {copies} copies",
                            count * copies
                        ),
                    };
                    Err(refuse(name, format!("{found} long"), expected))
                }
            };
        if let Some(Encoders { source: Source::Given(rows), .. }) = &self.encoders {
            fits("encoders", rows.len())?;
        }
        for (name, values) in [("intercepts", &self.intercepts), ("max_rates", &self.max_rates)] {
            if let Some(Values(Source::Given(all))) = values {
                fits(name, all.len())?;
            }
        }
        for given in self.gains_and_biases.iter().flatten() {
            fits("gains_and_biases", given.len())?;
        }
        let variables = model.state();
        for (name, start) in &self.starts {
            let [low, high] = match start {
                Start::At(value) => [*value; 2],
                Start::Between(low, high) => [*low, *high],
            };
            if !(low.is_finite() && high.is_finite() && low <= high) {
                let found = format!("{low} to {high} of `{name}`");
                return Err(refuse("start", found, "finite numbers in rising order"));
            }
            let known = variables.iter().any(|variable| variable.name == name);
            if !known && !variables.is_empty() {
                let names: Vec<&str> = variables.iter().map(|variable| variable.name).collect();
                return Err(refuse(
                    "start",
                    format!("of `{name}`"),
                    format!("one of: {}", nearest_first(name, names)),
                ));
            }
        }
        Ok(())
    }

    /// Returns the neurons of the plan with the model of the ensemble.
    pub fn spec(&self, plan: &NeuronSpec, in_rates: bool) -> NeuronSpec {
        let own = self.model.as_ref().map(|model| match in_rates {
            true => RateOf::form(model),
            false => model.clone(),
        });
        NeuronSpec { model: own.unwrap_or_else(|| plan.model.clone()), tuning: plan.tuning }
    }

    /// Returns whether the encoders of neurons of so many dimensions are rows of Hadamard matrices.
    pub fn are_hadamard(&self, tuning: &Tuning, dims: usize) -> bool {
        match &self.encoders {
            Some(encoders) => encoders.hadamard && hadamard::DIMS.contains(&dims),
            None => tuning.encoders.are_hadamard(dims),
        }
    }

    /// Returns whether neurons are drawn otherwise than by the plan.
    pub fn draws(&self) -> bool {
        self.encoders.is_some()
            || self.intercepts.is_some()
            || self.max_rates.is_some()
            || self.gains_and_biases.is_some()
    }

    /// Returns whether maximum rates are drawn by the plan.
    pub fn draws_rates_by_plan(&self) -> bool {
        self.max_rates.is_none() && self.gains_and_biases.is_none()
    }

    /// Draws the neurons of a copy. Each kind of number has random numbers of its own, so setting one does not change
    /// the others.
    pub fn draw(
        &self,
        NeuronSpec { model, tuning }: &NeuronSpec,
        shape: &Shape,
        (copy, seed): (usize, Seed),
    ) -> Result<Neurons, TuningError> {
        let Shape { neurons: count, dims, hadamard, .. } = *shape;
        let [mut directions, mut onsets, mut rates] =
            ["encoders", "intercepts", "max rates"].map(|role| seed.derive("", role).rng());
        let uniform = |[low, high]: [f64; 2]| Values::between(low, high);
        let max_rates = self.max_rates.clone().unwrap_or_else(|| uniform(tuning.max_rates));
        let even_dims = (2..=EvenPoints::MOST_DIMS).contains(&dims);
        let mut even = even_dims.then(|| EvenPoints::new(&mut directions, dims));
        let intercepts = match &self.intercepts {
            None if dims <= EvenPoints::MOST_DIMS => Some(uniform(tuning.intercepts)),
            own => own.clone(),
        };
        let mut neurons = Neurons {
            dims,
            encoders: match hadamard {
                true => hadamard::directions(&mut directions, shape),
                false => vec![0.0; count * dims],
            },
            gains: Vec::new(),
            biases: Vec::new(),
        };
        for (n, row) in neurons.encoders.chunks_exact_mut(dims).enumerate() {
            let at = copy * count + n;
            // A direction and an intercept. With the maximum rate as well, points of four coordinates leave greater errors
            // than draws.
            let point = even.as_mut().map(EvenPoints::advance);
            match (&self.encoders, point) {
                _ if hadamard => {}
                (Some(encoders), _) => encoders.draw(&mut directions, at, row)?,
                (None, Some(point)) => EvenPoints::direction(point, row),
                (None, None) if dims == 1 => {
                    row[0] = if n.is_multiple_of(2) { 1.0 } else { -1.0 };
                }
                (None, None) => on_sphere(&mut directions, row),
            }
            let (gain, bias) = match &self.gains_and_biases {
                Some([gains, biases]) => (gains[at % gains.len()], biases[at % biases.len()]),
                None => {
                    let onset = |rng: &mut ChaCha8Rng| match point {
                        Some(point) => point[dims - 1],
                        None if dims == 1 => {
                            ((n / 2) as f64 + rng.random::<f64>()) / count.div_ceil(2) as f64
                        }
                        None => rng.random(),
                    };
                    let intercept = match &intercepts {
                        Some(values) => values.draw(&mut onsets, at, onset),
                        None => cosine(&mut onsets, dims + 2),
                    };
                    model
                        .gain_bias(max_rates.draw(&mut rates, at, |rng| rng.random()), intercept)?
                }
            };
            neurons.gains.push(gain);
            neurons.biases.push(bias);
        }
        Ok(neurons)
    }

    /// Adds everything that is set to a hash.
    pub fn fingerprint(&self, hash: &mut Fingerprint, dims: usize) {
        self.encoders.iter().for_each(|encoders| encoders.fingerprint(hash, dims));
        for (name, values) in [("intercepts", &self.intercepts), ("max rates", &self.max_rates)] {
            values.iter().for_each(|values| values.fingerprint(hash.text(name)));
        }
        for given in self.gains_and_biases.iter().flatten() {
            numbers(hash.text("gains and biases"), given);
        }
        match &self.points {
            None => {}
            Some(Ok(count)) => {
                hash.text("count").number(*count as u64);
            }
            Some(Err(rows)) => {
                rows.iter().fold(hash.text("points"), |hash, row| numbers(hash, row));
            }
        }
        for (name, start) in &self.starts {
            match start {
                Start::At(value) => hash.text(name).reals(&[*value]),
                Start::Between(low, high) => hash.text(name).reals(&[*low, *high]),
            };
        }
        self.solver.iter().for_each(|solver| solver.fingerprint(hash.text("solver")));
        self.model.iter().for_each(|model| model.fingerprint(hash.text("model")));
    }
}

/// # Settings of the neurons
///
/// What is not set comes from the plan. Settings have no effect in direct mode, but are checked in every mode; what
/// depends on the number of neurons is checked when the graph is built with neurons. All of them enter the fingerprint.
impl Ensemble {
    /// Sets the encoders.
    ///
    /// ```
    /// use symbolt::neurons::{Encoders, Ensemble, Values};
    /// // Neurons tuned to the axes only, which begin to fire at 0.
    /// let axes = Encoders::choice([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]);
    /// let ensemble = Ensemble::new(2).encoders(axes).intercepts(0.0).max_rates(Values::between(80.0, 120.0));
    /// # let _ = ensemble;
    /// ```
    pub fn encoders(mut self, encoders: Encoders) -> Self {
        self.settings.encoders = Some(encoders);
        self
    }

    /// Sets the intercepts: where along its encoder, in units of the radius, each neuron begins to fire (at least -1,
    /// below 1).
    pub fn intercepts(mut self, intercepts: impl Into<Values>) -> Self {
        self.settings.intercepts = Some(intercepts.into());
        self
    }

    /// Sets the maximum rates, in Hz: those at the end of a neuron's encoder on the radius.
    pub fn max_rates(mut self, max_rates: impl Into<Values>) -> Self {
        self.settings.max_rates = Some(max_rates.into());
        self
    }

    /// Sets gains and biases, in place of intercepts and maximum rates: one of each per neuron, in all copies alike, or
    /// one per neuron of all copies. A neuron gets the current `gain (encoder . x) / radius + bias`.
    pub fn gains_and_biases(
        mut self,
        gains: impl Into<Vec<f64>>,
        biases: impl Into<Vec<f64>>,
    ) -> Self {
        self.settings.gains_and_biases = Some([gains.into().into(), biases.into().into()]);
        self
    }

    /// Sets the number of evaluation points (1 to 1,000,000). Default: 1.5 per neuron, at least 1,000 (500 in one
    /// dimension) and at most 3,000.
    pub fn evaluation_count(mut self, count: usize) -> Self {
        self.settings.points = Some(Ok(count));
        self
    }

    /// Sets the evaluation points: rows of as many numbers as the ensemble has dimensions, in the unit of the
    /// represented value. Functions need to be finite at these points alone.
    pub fn evaluation_points<R: Into<Vec<f64>>>(
        mut self,
        rows: impl IntoIterator<Item = R>,
    ) -> Self {
        self.settings.points = Some(Err(rows.into_iter().map(Into::into).collect()));
        self
    }

    /// Sets the neuron model, used wherever the plan gives neurons; where it gives rates
    /// ([`Population::Rate`](crate::neurons::Population::Rate)), the activities are the rates of the model.
    pub fn model(mut self, model: impl NeuronModel) -> Self {
        self.settings.model = Some(Arc::new(model));
        self
    }

    /// Sets the start of a [`Variable`](crate::neurons::Variable) of the neurons, by its name. Models without any
    /// state, such as those of rates, ignore it.
    pub fn start(mut self, variable: &str, start: Start) -> Self {
        self.settings.starts.push((variable.into(), start));
        self
    }

    /// Sets the solver of all functions that have none of their own.
    pub fn solver(mut self, solver: impl Solver) -> Self {
        self.settings.solver = Some(Arc::new(solver));
        self
    }
}
