//! The table of a finished experiment, as JSON and CSV.

use serde_json::{Map, Value, json};

use super::Mark;
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
        let wanted: Vec<_> = wanted.as_object().into_iter().flatten().collect();
        let own = |row: &&Row| wanted.iter().all(|(setting, value)| row.is(setting, value));
        self.rows.iter().filter(own).filter_map(mark).collect()
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
