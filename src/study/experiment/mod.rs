//! Experiments: independent trials in a journal, and the table of their statistics.
//!
//! An [`Experiment`] is a list of cells and a trial, which is a function of cell and seed that returns a few numbers.
//! Trials are independent, so they run on all cores and on several machines. A [`Run`] appends every finished trial
//! to a journal; a run that was killed is resumed from it. The table depends only on the trials in the journal,
//! sorted by cell and trial, so it has the same bits however they were computed.
//!
//! The seed of a trial depends on its number and not on its cell, so cells are compared on common random numbers.
//!
//! Nothing here knows which experiments there are: the catalogue beside this room lists them.

mod figure;
mod journal;
mod lock;
mod merge;
mod results;
mod run;

use serde_json::{Map, Value};

use crate::sim::Seed;
use crate::task::TaskError;

pub use figure::{Axis, Figure, Mark, Series, Style};
pub use lock::Warning;
pub use results::{Results, Row};
pub use run::{Run, Shard};

/// The most numbers that a trial can return.
pub const MAX_READINGS: usize = 8;

/// What a trial returns: a number for each reading of its cell, NaN for none.
pub type TrialOutcome = [f64; MAX_READINGS];

/// An outcome of `N` numbers; the others are NaN.
pub fn outcome<const N: usize>(numbers: [f64; N]) -> TrialOutcome {
    std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(f64::NAN))
}

/// Which statistic a number of the trials goes into. Other numbers are referred to by their place among the cell's
/// readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// 1 for success, 0 for failure: a rate with a Wilson interval.
    Rate,
    /// As [`Rate`](Self::Rate), where trials are correlated if the [`Auxiliary`](Self::Auxiliary) number at that
    /// place is the same, as for trials drawn from one pool.
    ClusteredRate(usize),
    /// A count of successes, where the [`Auxiliary`](Self::Auxiliary) number at that place is the count of attempts:
    /// a rate over all trials. Attempts of one trial may be correlated; the interval treats trials as clusters
    /// ([`Rate::of_clusters`](crate::study::statistics::Rate::of_clusters)).
    Share(usize),
    /// Any number: mean, standard deviation, count, and an interval of the mean.
    Mean,
    /// As [`Mean`](Self::Mean), where trials are correlated if the [`Auxiliary`](Self::Auxiliary) number at that
    /// place is the same.
    ClusteredMean(usize),
    /// The difference of two rates or probabilities, -1 to 1.
    Difference,
    /// A number that other readings refer to. It has no row of its own.
    Auxiliary,
}

/// One number of a trial, with the settings that distinguish it from the cell's other numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Settings of the reading, such as the decoder.
    pub settings: Map<String, Value>,
    /// Its statistic.
    pub measure: Measure,
}

impl Reading {
    /// A reading; `settings` is a JSON object, anything else stands for none.
    pub fn new(measure: Measure, settings: Value) -> Self {
        let Value::Object(settings) = settings else {
            return Self { settings: Map::new(), measure };
        };
        Self { settings, measure }
    }
}

/// A combination of settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Name to value.
    pub settings: Map<String, Value>,
    /// How many trials it has.
    pub trials: u64,
    /// The numbers of each trial, at most [`MAX_READINGS`].
    pub readings: Vec<Reading>,
}

impl Cell {
    /// A cell; `settings` is a JSON object, anything else stands for none.
    pub fn new(settings: Value, trials: u64, readings: Vec<Reading>) -> Self {
        let Value::Object(settings) = settings else {
            return Self { settings: Map::new(), trials, readings };
        };
        Self { settings, trials, readings }
    }
}

/// A question that many trials answer.
pub trait Experiment: Send + Sync {
    /// The name on the command line.
    fn name(&self) -> &'static str;
    /// The question, in one sentence.
    fn question(&self) -> &'static str;
    /// All settings that outcomes depend on, except seed, cells and number of trials.
    fn settings(&self) -> Value;
    /// Raised with every change after which a trial of the same settings and seed has another outcome. Journals of
    /// other revisions are not resumed.
    fn revision(&self) -> u32 {
        1
    }
    /// The cells.
    fn cells(&self) -> Vec<Cell>;
    /// One trial of a cell. `seed` is the same for this trial's number in every cell.
    ///
    /// # Errors
    /// Any error ends the run.
    fn trial(&self, cell: usize, seed: Seed) -> Result<TrialOutcome, TaskError>;
    /// A picture of the results.
    fn figure(&self, results: &Results) -> Option<Figure> {
        let _ = results;
        None
    }
}

/// The most trials of a cell. They are held in memory, 72 bytes each.
pub const MAX_TRIALS: u64 = 100_000;
