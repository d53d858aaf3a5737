//! Experiments: the paper's tables and figures, and sweeps of noise, size and parts.
//!
//! An [`Experiment`] is a list of cells and a trial: a function of cell and seed that gives a few numbers. Trials
//! are independent, so they run on all cores, on several machines, and go on after a kill: every finished trial
//! stands in a journal ([`Run`]). The table is a function of the journal's trials in their order, so it
//! has the same bits however they came about.
//!
//! A trial's seed depends on its number alone, not on its cell: cells are compared on the same draws.

mod journal;
mod plot;
mod run;

mod ablation;
mod capacity;
#[cfg(feature = "physics")]
mod clusters;
mod norms;
mod structures;
#[cfg(feature = "physics")]
mod thresholds;

use std::path::PathBuf;

use serde_json::{Map, Value, json};

use super::statistics::Statistic;
use crate::sim::Seed;
use crate::task::TaskError;

pub use plot::{Axis, Figure, Mark, Series, Style};
pub use run::{Run, Shard, merge};

/// The most numbers that a trial can give.
pub const WIDTH: usize = 8;

/// What a trial gives: a number for each of its cell's readings, NaN for none.
pub type Outcome = [f64; WIDTH];

/// An outcome of fewer numbers than there is room for; the others are NaN.
pub fn outcome<const N: usize>(numbers: [f64; N]) -> Outcome {
    std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(f64::NAN))
}

/// How a number of the trials is summed up. Others are named by their place among the cell's readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// 1 for success, 0 for failure: a rate with a Wilson interval.
    Rate,
    /// The same, where trials with the same [`Beside`](Self::Beside) at that place are alike: drawn from one pool.
    RateWithin(usize),
    /// How many of those that the [`Beside`](Self::Beside) at that place counts: a rate over both of all trials.
    /// Those of one trial need not be independent; the interval takes trials for clusters
    /// ([`Rate::of_clusters`](crate::study::statistics::Rate::of_clusters)).
    Share(usize),
    /// Any number: mean, standard deviation, count, and an interval of the mean.
    Mean,
    /// The same, where trials with the same [`Beside`](Self::Beside) at that place are alike.
    MeanWithin(usize),
    /// The difference of two rates or probabilities, -1 to 1.
    Difference,
    /// What other readings need, without a row of its own.
    Beside,
}

/// One number of a trial, and what distinguishes it from the cell's others.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Settings of the reading, such as the decoder.
    pub settings: Map<String, Value>,
    /// How it is summed up.
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
    /// How often it is tried.
    pub trials: u64,
    /// What each trial gives, at most [`WIDTH`].
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

/// Something that can be tried many times.
pub trait Experiment: Send + Sync {
    /// The name on the command line.
    fn name(&self) -> &'static str;
    /// One sentence on what is asked.
    fn question(&self) -> &'static str;
    /// What decides the outcomes beside seed, cells and number of trials.
    fn settings(&self) -> Value;
    /// Raised whenever a trial of the same settings and seed would come out otherwise: journals of other revisions
    /// are not gone on with.
    fn revision(&self) -> u32 {
        1
    }
    /// The cells.
    fn cells(&self) -> Vec<Cell>;
    /// One trial of a cell, from a seed that is the same for this trial's number in every cell.
    ///
    /// # Errors
    /// Whatever ends the experiment.
    fn trial(&self, cell: usize, seed: Seed) -> Result<Outcome, TaskError>;
    /// A picture of the results.
    fn figure(&self, results: &Results) -> Option<Figure> {
        let _ = results;
        None
    }
}

/// The table of a finished experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// The experiment.
    pub name: &'static str,
    /// What was asked.
    pub question: &'static str,
    /// Seed, and the experiment's own settings.
    pub settings: Value,
    /// One row a reading of a cell.
    pub rows: Vec<Row>,
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Settings of the cell and of the reading.
    pub settings: Map<String, Value>,
    /// What came out.
    pub statistic: Statistic,
}

impl Row {
    /// A setting as a number.
    pub fn number(&self, setting: &str) -> Option<f64> {
        self.settings.get(setting)?.as_f64()
    }

    /// Whether a setting has this value.
    pub fn is(&self, setting: &str, value: &Value) -> bool {
        self.settings.get(setting) == Some(value)
    }
}

impl Results {
    /// The keys of `--json`.
    pub fn to_json(&self) -> Value {
        let cells: Vec<Value> = self
            .rows
            .iter()
            .map(|row| {
                let mut cell = row.settings.clone();
                cell.extend(row.statistic.to_json());
                Value::Object(cell)
            })
            .collect();
        json!({"name": self.name, "question": self.question, "settings": self.settings, "cells": cells})
    }

    /// The names of all columns of settings, in the order of their first row.
    pub fn columns(&self) -> Vec<&str> {
        let mut columns: Vec<&str> = Vec::new();
        for key in self.rows.iter().flat_map(|row| row.settings.keys()) {
            if !columns.contains(&key.as_str()) {
                columns.push(key);
            }
        }
        columns
    }

    /// One line a row, with a header; text is quoted where it has to be.
    pub fn to_csv(&self) -> String {
        let columns = self.columns();
        let quoted = |text: String| {
            if text.contains([',', '"', '\n']) {
                format!("\"{}\"", text.replace('"', "\"\""))
            } else {
                text
            }
        };
        let mut lines = vec![
            columns
                .iter()
                .copied()
                .chain([
                    "value",
                    "low95",
                    "high95",
                    "sd",
                    "q5",
                    "q50",
                    "q95",
                    "trials",
                    "effective_trials",
                ])
                .collect::<Vec<_>>()
                .join(","),
        ];
        for row in &self.rows {
            let mut fields: Vec<String> = columns
                .iter()
                .map(|key| match row.settings.get(*key) {
                    Some(Value::String(text)) => quoted(text.clone()),
                    Some(value) => quoted(value.to_string()),
                    None => String::new(),
                })
                .collect();
            let [low, high] = row.statistic.interval95();
            let number = |v: f64| if v.is_finite() { v.to_string() } else { String::new() };
            fields.extend([row.statistic.value(), low, high].map(number));
            fields.push(row.statistic.sd().map_or_else(String::new, number));
            let quantiles = row.statistic.quantiles();
            fields.extend((0..3).map(|i| quantiles.map_or_else(String::new, |q| number(q[i]))));
            fields.push(row.statistic.trials().to_string());
            fields.push(row.statistic.effective_trials().map_or_else(String::new, number));
            lines.push(fields.join(","));
        }
        lines.push(String::new());
        lines.join("\n")
    }
}

/// The most trials a cell, which together have to fit into memory: 72 bytes each.
pub const MOST_TRIALS: u64 = 100_000;

/// What an experiment is asked to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Where what trials share is drawn from, such as a pool of poses; the trials' own seed beside it.
    pub seed: Seed,
    /// Trials a cell, 1 to [`MOST_TRIALS`]; the experiment's own number if none is given.
    pub trials: Option<u64>,
    /// A recording to be used beside our own scene, by those that use recordings.
    pub recording: Option<PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: Seed::new(1), trials: None, recording: None }
    }
}

/// The experiments by name, each with its question.
pub fn all() -> Vec<(&'static str, &'static str)> {
    let options = Options::default();
    makers().iter().map(|make| make(&options)).map(|e| (e.name(), e.question())).collect()
}

type Make = fn(&Options) -> Box<dyn Experiment>;

fn makers() -> Vec<Make> {
    vec![
        |o| Box::new(norms::Distances::new(o)),
        |o| Box::new(norms::TableSetting::new(o)),
        #[cfg(feature = "physics")]
        |o| Box::new(clusters::Clusters::new(o)),
        #[cfg(feature = "physics")]
        |o| Box::new(clusters::Classification::new(o)),
        #[cfg(feature = "physics")]
        |o| Box::new(thresholds::Thresholds::new(o)),
        |o| Box::new(structures::Structures::new(o)),
        |o| Box::new(structures::Structures::beyond(o)),
        |o| Box::new(capacity::Capacity::new(o)),
        |o| Box::new(ablation::Ablation::new(o)),
        |o| Box::new(ablation::Timing::new(o)),
    ]
}

/// The experiment of this name.
///
/// # Errors
/// [`TaskError::UnknownExperiment`], with the list of those that exist; [`TaskError::Setting`] for a number of
/// trials outside its range.
pub fn find(name: &str, options: &Options) -> Result<Box<dyn Experiment>, TaskError> {
    if let Some(trials) = options.trials.filter(|n| !(1..=MOST_TRIALS).contains(n)) {
        let value = trials.to_string();
        return Err(TaskError::Setting { name: "trials", value, expected: "1 to 100000" });
    }
    // With default options making one costs nothing; with a recording it may be read and learned from.
    let plain = Options::default();
    match makers().into_iter().find(|make| make(&plain).name() == name) {
        Some(make) => Ok(make(options)),
        None => Err(TaskError::UnknownExperiment {
            name: name.into(),
            choices: all().into_iter().map(|(name, _)| name.to_owned()).collect(),
        }),
    }
}
