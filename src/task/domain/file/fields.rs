//! Faults in the fields of a JSON file, and the first field that has one.

use std::collections::HashMap;

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::sim::{cut, meant, nearest_first};
use crate::task::propositional::{Fault, check_names};

/// A fault in a field of the file.
pub(super) struct FieldFault {
    /// The field; empty if the fault is not in a single one.
    pub field: String,
    pub problem: String,
    pub expected: String,
}

impl FieldFault {
    /// Builds the fault of a field whose value is missing or is not as expected.
    pub fn found(field: &str, found: Option<&Value>, expected: impl Into<String>) -> Self {
        Self {
            field: field.into(),
            problem: found.map_or_else(|| "it is missing".into(), found_instead),
            expected: expected.into(),
        }
    }

    /// Says in which field the fault is.
    pub fn at(self, field: String) -> Self {
        Self { field, ..self }
    }
}

/// The names of the states of a file, by which its other entries refer to them.
pub(super) struct StateNames {
    names: Vec<String>,
    places: HashMap<String, usize>,
}

impl StateNames {
    /// Checks the names of states and operators. An invalid name must not be reported as a reference to an unknown state.
    pub fn new<'n>(
        states: impl Iterator<Item = &'n String> + Clone,
        operators: impl Iterator<Item = &'n String>,
    ) -> Result<Self, Fault> {
        check_names(states.clone().chain(operators))?;
        let names: Vec<String> = states.cloned().collect();
        let places = names.iter().cloned().zip(0..).collect();
        Ok(Self { names, places })
    }

    /// Returns the number of states.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Returns the index of the state that a field names.
    pub fn find(&self, name: &str, field: impl FnOnce() -> String) -> Result<usize, FieldFault> {
        self.places.get(name).copied().ok_or_else(|| {
            let known = || self.names.iter().map(String::as_str);
            let (near, known) = (meant(name, known()), nearest_first(name, known()));
            let name = cut(name, 200);
            FieldFault {
                field: field(),
                problem: format!("`{name}` is not a state{near}"),
                expected: format!("one of the domain's states: {known}"),
            }
        })
    }

    /// Returns the indices of the states that a field lists.
    pub fn find_all(&self, list: &[String], field: &str) -> Result<Vec<usize>, FieldFault> {
        let entries = list.iter().enumerate();
        entries.map(|(i, name)| self.find(name, || format!("{field}[{i}]"))).collect()
    }
}

impl From<Fault> for FieldFault {
    fn from(Fault { problem, expected }: Fault) -> Self {
        Self { field: String::new(), problem, expected }
    }
}

/// A short description of a value.
fn found_instead(value: &Value) -> String {
    match value {
        Value::Array(_) => "it is a list".into(),
        Value::Object(_) => "it is an object".into(),
        Value::String(text) if text.chars().count() > 40 => "it is a long string".into(),
        Value::String(text) => format!("it is `{text}`"),
        other => format!("it is {other}"),
    }
}

/// Returns the first value at `path` that does not satisfy `fits`, with its place. Missing values are skipped. `[]` in
/// the path stands for every entry of a list.
pub(super) fn misfit<'v>(
    value: &'v Value,
    path: &[&str],
    place: String,
    fits: &dyn Fn(&Value) -> bool,
) -> Option<(String, &'v Value)> {
    match path.split_first() {
        None => (!fits(value)).then_some((place, value)),
        Some((&"[]", rest)) => {
            let entries = value.as_array()?.iter().enumerate();
            entries
                .filter_map(|(i, entry)| misfit(entry, rest, format!("{place}[{i}]"), fits))
                .next()
        }
        Some((key, rest)) => {
            let dot = if place.is_empty() { "" } else { "." };
            misfit(value.get(key)?, rest, format!("{place}{dot}{key}"), fits)
        }
    }
}

/// Returns the first entry of the list `list` that cannot be read as a `T`, or `list` itself if it is no list.
pub(super) fn faulty_entry<T: DeserializeOwned>(file: &Value, list: &str) -> Option<String> {
    let Some(entries) = file.get(list)?.as_array() else { return Some(list.into()) };
    let at = entries.iter().position(is_unreadable::<T>)?;
    Some(format!("{list}[{at}]"))
}

/// Returns whether a value cannot be read as a `T`. It is read as text, as the file is: reading it as a value would be
/// compiled once more for each type.
pub(super) fn is_unreadable<T: DeserializeOwned>(value: &Value) -> bool {
    serde_json::from_slice::<T>(value.to_string().as_bytes()).is_err()
}
