//! The tuning of populations: how many neurons a layer gets, and the ranges that they are drawn from.

use thiserror::Error;

use super::bank::hadamard;

/// Why a layer cannot get a population.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TuningError {
    /// A setting outside its range.
    #[error("`{name}` is {value}; expected {expected}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The value that was given.
        value: String,
        /// The values that are allowed.
        expected: String,
    },
    /// A decoder solve that failed.
    #[error("cannot solve for the decoders of {neurons} neurons; use a larger `regularisation`")]
    Unsolvable {
        /// Number of neurons in the ensemble.
        neurons: usize,
    },
    /// An ensemble of which no neuron fires.
    #[error(
        "no neuron of an ensemble fires at any of its {points} evaluation points; expected lower intercepts, or more neurons"
    )]
    Silent {
        /// Number of evaluation points.
        points: usize,
    },
    /// The [`SolvedModel`](super::SolvedModel) of the plan does not have the layer.
    #[error("the solved model has no such layer")]
    Missing,
    /// The [`SolvedModel`](super::SolvedModel) of the plan has another population for the layer.
    #[error(
        "the solved model's population was made from another seed, tick, tuning, size or function; \
         expected a model solved for this graph"
    )]
    Mismatch,
}

pub(crate) fn refuse(
    name: &'static str,
    value: impl ToString,
    expected: impl ToString,
) -> TuningError {
    TuningError::Setting { name, value: value.to_string(), expected: expected.to_string() }
}

/// Returns a fault unless a setting is a finite number of at least 0.
pub(crate) fn not_negative(name: &'static str, value: f64) -> Result<(), TuningError> {
    match value.is_finite() && value >= 0.0 {
        true => Ok(()),
        false => Err(refuse(name, value, "a finite number of at least 0")),
    }
}

/// The number of neurons that a layer gets, and the ranges from which they are drawn, for any
/// [`NeuronModel`](super::NeuronModel). The standard networks of `symbolt bench` use the defaults.
///
/// Ranges are checked when the graph is built. A fault names the path of the layer. Besides the ranges below, an
/// ensemble must have 1 to 10,000 neurons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// Range of maximum rates, in Hz: above 0, and possible for the neuron model. Each neuron draws its rate
    /// uniformly. Default: 200 to 400.
    pub max_rates: [f64; 2],
    /// Range of intercepts for neurons of one dimension, and for [`Ensemble`](super::Ensemble)s of two and three: at
    /// least -1 and below 1. Each neuron draws its intercept uniformly. Default: -1 to 0.9.
    ///
    /// Selections and [`Map::above`](super::Map::above) draw intercepts above their level. Pointers draw them from the
    /// distribution of cosines between random directions (Gosmann and Eliasmith, "Optimizing semantic pointer
    /// representations for symbol-like processing in spiking neural networks", 2016).
    pub intercepts: [f64; 2],
    /// Number of neurons per dimension of a pointer. Default: 50.
    pub per_dimension: usize,
    /// Greatest number of dimensions in one ensemble of a pointer. Each ensemble gets the greatest divisor of the
    /// width of the pointer up to this number. Default: 16.
    pub sub_dimensions: usize,
    /// Greatest number of ensembles of a pointer that are drawn and solved for (at least 1). Default: 4. The others are
    /// these, turned: each in a random direction of its own, with decoders that solve the turned equations exactly. They
    /// share maximum rates and intercepts. With `usize::MAX` each is drawn by itself, and building a pointer of 256
    /// dimensions takes about four times as long. Ensembles of one dimension and Hadamard encoders are never turned.
    pub distinct_ensembles: usize,
    /// Number of neurons per component of a function or of a represented vector. Default: 100.
    pub per_function: usize,
    /// Number of neurons per product. Each of its two squares gets half of them. Default: 200.
    pub per_product: usize,
    /// Number of neurons per item of a selection. Default: 50. [`few_per_item`](Self::few_per_item) tunes 1 to 4.
    pub per_item: usize,
    /// Mean distance of the intercepts of a selection from its level, as a fraction of the range of utilities (at least
    /// 0, finite). Default: 0.1. With 0 all neurons of an item begin to fire at the level, as few neurons must.
    pub item_spread: f64,
    /// Regularisation of the decoder solve, as a fraction of the greatest rate (above 0, finite). Default: 0.1.
    ///
    /// Decoders are `(A^T A + m s^2 I)^-1 A^T F`. A holds the rates and F the target values at m evaluation points; s
    /// is this number times the greatest rate (Eliasmith and Anderson 2003, chapter 2; `reg` of Nengo's `LstsqL2`).
    pub regularisation: f64,
    /// Factor on all numbers of neurons (above 0). Default: 1.
    pub scale: f64,
    /// How encoders of several dimensions are drawn. Default: [`DrawnEncoders::Sphere`].
    pub encoders: DrawnEncoders,
}

/// How the encoders of neurons of several dimensions are drawn, unless an ensemble has
/// [`Encoders`](super::Encoders) of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DrawnEncoders {
    /// Uniformly from the sphere.
    #[default]
    Sphere,
    /// As rows of Hadamard matrices ([`Encoders::hadamard`](super::Encoders::hadamard)) in 16 to 128 dimensions, and
    /// uniformly from the sphere in others. Pointers then run faster, with no greater decoding errors, and take longer to
    /// build ([`Tuning::distinct_ensembles`]).
    Hadamard,
}

/// Least number of dimensions in which [`DrawnEncoders::Hadamard`] has an effect. In fewer there are few corners: four
/// in two dimensions, which suit some functions and not others.
const LEAST_HADAMARD: usize = 16;

impl DrawnEncoders {
    /// Returns whether the encoders of neurons of so many dimensions are rows of Hadamard matrices.
    pub(super) fn are_hadamard(self, dims: usize) -> bool {
        self == Self::Hadamard && dims >= LEAST_HADAMARD && hadamard::DIMS.contains(&dims)
    }
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            max_rates: [200.0, 400.0],
            intercepts: [-1.0, 0.9],
            per_dimension: 50,
            sub_dimensions: 16,
            distinct_ensembles: 4,
            per_function: 100,
            per_product: 200,
            per_item: 50,
            item_spread: 0.1,
            regularisation: 0.1,
            scale: 1.0,
            encoders: DrawnEncoders::default(),
        }
    }
}

/// Greatest number of neurons in one ensemble. The decoder solve for more would need gigabytes of memory.
pub(super) const MAX_NEURONS: f64 = 10_000.0;

impl Tuning {
    /// Returns the default tuning with few neurons per item of a selection: a single neuron is a threshold. Meant for 1 to
    /// 4, which are also stepped faster; 0 is a fault when the graph is built. The maximum rates hold for every layer
    /// with this tuning, so a plan should give it to the selections of a memory alone, by their path.
    ///
    /// All neurons begin to fire at the level, and their maximum rate of 480 Hz is near the refractory limit of the
    /// default [`Lif`](super::Lif): soon above the level they have nearly the same rate. The output of an item then
    /// fluctuates little around 1 behind a synapse of 5 ms.
    pub fn few_per_item(per_item: usize) -> Self {
        Self { per_item, item_spread: 0.0, max_rates: [480.0, 480.0], ..Self::default() }
    }

    /// Checks the ranges from which neurons are drawn. An invalid range then fails for every seed.
    pub(super) fn check(&self) -> Result<(), TuningError> {
        let rising = |[low, high]: [f64; 2]| low <= high;
        let said = |[low, high]: [f64; 2]| format!("{low} to {high}");
        if !(rising(self.max_rates) && self.max_rates[0] > 0.0) {
            let expected = "two rates in rising order, above 0";
            return Err(refuse("max_rates", said(self.max_rates), expected));
        }
        not_negative("item_spread", self.item_spread)?;
        if self.distinct_ensembles == 0 {
            return Err(refuse("distinct_ensembles", 0, "at least 1"));
        }
        if !(rising(self.intercepts) && self.intercepts[0] >= -1.0 && self.intercepts[1] < 1.0) {
            let expected = "two numbers in rising order, at least -1 and below 1";
            return Err(refuse("intercepts", said(self.intercepts), expected));
        }
        if !(self.regularisation.is_finite() && self.regularisation > 0.0) {
            let expected = "a finite number above 0";
            return Err(refuse("regularisation", self.regularisation, expected));
        }
        Ok(())
    }

    /// Scales a number of neurons in one ensemble.
    pub(super) fn count(&self, neurons: f64) -> Result<usize, TuningError> {
        let count = (neurons * self.scale).round();
        if (1.0..=MAX_NEURONS).contains(&count) {
            Ok(count as usize)
        } else {
            Err(refuse("neurons", format!("{count} per ensemble"), format!("1 to {MAX_NEURONS}")))
        }
    }
}
