//! Experiments: independent trials in a journal, and the table of their statistics.
//!
//! An [`Experiment`] has a list of cells, each a combination of settings, and a trial: a function of cell and seed that
//! returns a few numbers. Trials are independent, so they can run on all cores and on several machines. A [`Run`]
//! appends each finished trial to a journal, and a killed run resumes from it. The table depends only on the trials in
//! the journal, sorted by cell and trial, so it has the same bits for any number of threads and shards.
//!
//! The seed of a trial depends on the trial's number but not on its cell. Cells are thus compared on common random
//! numbers.
//!
//! The experiments themselves are in [`catalogue`](crate::study::catalogue), which this module does not use.

mod figure;
mod journal;
mod launcher;
mod merge;
mod results;
mod run;
mod shard;
mod status;

use std::borrow::Cow;
use std::fmt;

use serde_json::{Map, Value};

use crate::sim::Seed;
use crate::task::TaskError;

pub use figure::{Axis, Figure, Mark, Series, Style};
pub use launcher::{ShardChoice, ShardError};
pub use merge::Origin;
pub use results::{Results, Row};
pub use run::Run;
pub use shard::Shard;
pub use status::{CellStatus, Missing, Plan, ShardState, ShardStatus, Status};

/// Maximum number of values that a trial can return.
pub const MAX_READINGS: usize = 10;

/// The result of a trial: a number for each reading of its cell, NaN if there is none.
pub type TrialOutcome = [f64; MAX_READINGS];

/// Returns an outcome that begins with `numbers` and is filled with NaN.
pub fn outcome<const N: usize>(numbers: [f64; N]) -> TrialOutcome {
    std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(f64::NAN))
}

/// The statistic that is computed from one reading of all trials. The field of a variant is the index of another
/// reading of the same cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// 1 for success, 0 for failure: a rate with a Wilson interval.
    Rate,
    /// As [`Rate`](Self::Rate), for correlated trials, such as trials drawn from one pool. Trials with the same
    /// [`Auxiliary`](Self::Auxiliary) number at that index are correlated.
    ClusteredRate(usize),
    /// A count of successes: a rate over the attempts of all trials. The [`Auxiliary`](Self::Auxiliary) number at that
    /// index is the count of attempts. Attempts of a trial may be correlated; the interval treats trials as clusters
    /// ([`Rate::of_clusters`](crate::study::statistics::Rate::of_clusters)).
    Share(usize),
    /// Any number: a mean with its standard deviation and interval.
    Mean,
    /// As [`Mean`](Self::Mean), for correlated trials. Trials with the same [`Auxiliary`](Self::Auxiliary) number at
    /// that index are correlated.
    ClusteredMean(usize),
    /// A difference between two rates or probabilities, from -1 to 1.
    Difference,
    /// A number that other readings refer to. It has no row in the table.
    Auxiliary,
}

/// Returns the keys of a JSON object; of any other value, none.
fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(keys) => keys,
        _ => Map::new(),
    }
}

/// Returns a setting as text, without the quotes of JSON.
fn in_words(setting: &Value) -> Cow<'_, str> {
    match setting {
        Value::String(text) => text.into(),
        value => value.to_string().into(),
    }
}

/// A number that a trial returns, with the settings that distinguish it from the cell's other numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Settings of the reading, such as the decoder.
    pub settings: Map<String, Value>,
    /// Statistic that is computed from the number.
    pub measure: Measure,
}

impl Reading {
    /// Creates a reading. `settings` is a JSON object; any other value means no settings.
    pub fn new(measure: Measure, settings: Value) -> Self {
        Self { settings: object(settings), measure }
    }

    /// Creates a reading that is told from the cell's others by the setting `what`.
    pub fn what(measure: Measure, what: &str) -> Self {
        Self::new(measure, serde_json::json!({"what": what}))
    }

    /// Creates a count for other readings to refer to ([`Measure::Auxiliary`]).
    pub fn count() -> Self {
        Self { settings: Map::new(), measure: Measure::Auxiliary }
    }
}

/// A combination of settings, tried many times.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Settings by name.
    pub settings: Map<String, Value>,
    /// Number of trials.
    pub trials: u64,
    /// Numbers that each trial returns, at most [`MAX_READINGS`].
    pub readings: Vec<Reading>,
}

impl Cell {
    /// Creates a cell. `settings` is a JSON object; any other value means no settings.
    pub fn new(settings: Value, trials: u64, readings: Vec<Reading>) -> Self {
        Self { settings: object(settings), trials, readings }
    }

    /// Returns whether a setting has this value.
    pub fn is(&self, setting: &str, value: &str) -> bool {
        self.settings.get(setting).is_some_and(|own| own == value)
    }

    /// Returns a setting that is a number.
    ///
    /// # Errors
    /// [`TaskError::CellSetting`] if the cell has no such setting.
    pub fn number(&self, setting: &str) -> Result<f64, TaskError> {
        let number = self.settings.get(setting).and_then(Value::as_f64);
        number.ok_or_else(|| self.fault(setting, "a number".into()))
    }

    /// Returns the choice that a setting names: the value beside its name.
    ///
    /// # Errors
    /// [`TaskError::CellSetting`] if the cell has no such setting, or if it is none of the names.
    pub fn choice<T: Clone>(&self, setting: &str, choices: &[(&str, T)]) -> Result<T, TaskError> {
        let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
        Ok(choices[self.chosen(setting, &names)?].1.clone())
    }

    fn chosen(&self, setting: &str, names: &[&str]) -> Result<usize, TaskError> {
        names
            .iter()
            .position(|name| self.is(setting, name))
            .ok_or_else(|| self.fault(setting, format!("one of `{}`", names.join("`, `"))))
    }

    fn fault(&self, setting: &str, expected: String) -> TaskError {
        let (cell, setting) = (self.to_string(), setting.to_owned());
        TaskError::CellSetting { cell, setting, expected }
    }
}

/// Writes the settings: `gate = in, noise = 0.5`.
pub(super) fn write_settings(
    settings: &Map<String, Value>,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    if settings.is_empty() {
        return f.write_str("without settings");
    }
    for (at, (name, value)) in settings.iter().enumerate() {
        let separator = if at == 0 { "" } else { ", " };
        write!(f, "{separator}{name} = {}", in_words(value))?;
    }
    Ok(())
}

/// Writes the cell's name, which is made of its settings: `gate = in, noise = 0.5`.
impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_settings(&self.settings, f)
    }
}

/// What an experiment is called, what it asks, and on what its outcomes depend.
#[derive(Debug, Clone, PartialEq)]
pub struct About {
    /// Name on the command line.
    pub name: &'static str,
    /// Question, in one sentence.
    pub question: &'static str,
    /// Revision of the code, from 1. It must increase with every change after which a trial with the same settings and seed has
    /// another outcome. A journal of another revision is not resumed.
    pub revision: u32,
    /// All settings that outcomes depend on, except the seed, the cells and the number of trials.
    pub settings: Value,
}

/// A question that many trials answer.
pub trait Experiment: Send + Sync {
    /// Returns the name, the question, the revision and the settings.
    fn about(&self) -> About;
    /// Returns the cells.
    fn cells(&self) -> Vec<Cell>;
    /// Runs a trial of a cell, one of [`cells`](Self::cells), which says by its settings what to do
    /// ([`Cell::choice`], [`Cell::number`]). `seed` depends on the trial's number and is the same in every cell.
    ///
    /// # Errors
    /// Any [`TaskError`]; it ends the run.
    fn trial(&self, cell: &Cell, seed: Seed) -> Result<TrialOutcome, TaskError>;
    /// Draws the results; `None` for an experiment without a figure.
    fn figure(&self, results: &Results) -> Option<Figure> {
        let _ = results;
        None
    }
}

/// Maximum number of trials of a cell. Trials are held in memory, 72 bytes each.
pub const MAX_TRIALS: u64 = 100_000;
