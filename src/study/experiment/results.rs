//! The table of a finished experiment, as JSON and CSV.

use std::borrow::Cow;

use serde_json::{Map, Value, json};

use super::{Mark, in_words};
use crate::record::csv_field;
use crate::study::statistics::Statistic;

/// The table of a finished experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// Name of the experiment.
    pub name: &'static str,
    /// Question that the experiment answers.
    pub question: &'static str,
    /// Settings of the experiment, the seed, and the number of trials.
    pub settings: Value,
    /// Rows of the table, one for each reading of each cell.
    pub rows: Vec<Row>,
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Settings of the cell and of the reading.
    pub settings: Map<String, Value>,
    /// Statistic over trials.
    pub statistic: Statistic,
}

impl Row {
    /// Returns the value of a setting if it is a number.
    pub fn number(&self, setting: &str) -> Option<f64> {
        self.settings.get(setting)?.as_f64()
    }

    /// Returns a setting as text, without the quotes of JSON; empty if there is none.
    pub fn text(&self, setting: &str) -> Cow<'_, str> {
        self.settings.get(setting).map_or_else(Cow::default, in_words)
    }

    /// Returns whether a setting has this value.
    pub fn is(&self, setting: &str, value: &Value) -> bool {
        self.settings.get(setting) == Some(value)
    }

    /// Returns the point of a figure at `x` whose height is the value in percent, with the 95% interval.
    pub fn percent(&self, x: f64) -> Mark {
        let bar = Some(self.statistic.interval95().map(|v| 100.0 * v));
        Mark { x, y: 100.0 * self.statistic.value(), bar }
    }

    /// Returns the point of a figure at `x` whose height is the scaled median, with the 5% and 95% quantiles. `None` for a
    /// rate.
    pub fn median(&self, x: f64, scale: impl Fn(f64) -> f64) -> Option<Mark> {
        let [low, y, high] = self.statistic.quantiles()?.map(scale);
        Some(Mark { x, y, bar: Some([low, high]) })
    }
}

impl Results {
    /// Returns the points that `mark` makes of the rows whose settings have all values of the JSON object `wanted`.
    pub fn marks(&self, wanted: &Value, mark: impl Fn(&Row) -> Option<Mark>) -> Vec<Mark> {
        self.rows_with(wanted).into_iter().filter_map(mark).collect()
    }

    fn rows_with(&self, wanted: &Value) -> Vec<&Row> {
        let wanted: Vec<_> = wanted.as_object().into_iter().flatten().collect();
        let own = |row: &&Row| wanted.iter().all(|(setting, value)| row.is(setting, value));
        self.rows.iter().filter(own).collect()
    }

    /// Returns the object that `--json` prints and `results.json` holds.
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

    /// Returns the names of all settings, in the order of their first appearance.
    pub fn columns(&self) -> Vec<&str> {
        let mut columns: Vec<&str> = Vec::new();
        for key in self.rows.iter().flat_map(|row| row.settings.keys()) {
            if !columns.contains(&key.as_str()) {
                columns.push(key);
            }
        }
        columns
    }

    /// Returns the table as CSV: a header, and one line for each row.
    pub(super) fn to_csv(&self) -> String {
        let columns = self.columns();
        let number = |number: Option<f64>| {
            number.filter(|v| v.is_finite()).map_or_else(String::new, |v| v.to_string())
        };
        let mut lines = vec![[&columns[..], &STATISTICS].concat().join(",")];
        for row in &self.rows {
            let statistic = &row.statistic;
            let settings = columns.iter().map(|key| csv_field(&row.text(key)).into_owned());
            let [low, high] = statistic.interval95();
            let [q5, q50, q95] = statistic.quantiles().map_or([None; 3], |q| q.map(Some));
            let spread = [Some(statistic.value()), Some(low), Some(high), statistic.sd()];
            let numbers = spread.into_iter().chain([q5, q50, q95]).map(number);
            let trials = [statistic.trials().to_string(), number(statistic.effective_trials())];
            let fields: Vec<String> = settings.chain(numbers).chain(trials).collect();
            lines.push(fields.join(","));
        }
        lines.push(String::new());
        lines.join("\n")
    }
}

/// The columns of a CSV table that every experiment has, after its settings.
const STATISTICS: [&str; 9] =
    ["value", "low95", "high95", "sd", "q5", "q50", "q95", "trials", "effective_trials"];
