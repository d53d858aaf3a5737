//! The shape of a domain file: which values must be objects or strings, and which field has a fault.

use serde::Deserialize;
use serde_json::Value;

use super::{FORMAT, FieldFault, VERSION, v1};
use crate::task::domain::Provenance;

/// Paths of values that must be objects, in either version. They are checked here because serde also accepts a list of
/// the field values in order. `[]` stands for every entry of a list.
const OBJECTS: [&[&str]; 9] = [
    &["provenance"],
    &["provenance", "clusters", "[]"],
    &["states", "[]"],
    &["states", "[]", "mean"],
    &["states", "[]", "learned"],
    &["states", "[]", "learned", "mean"],
    &["operators", "[]"],
    &["operators", "[]", "parameters", "[]"],
    &["operators", "[]", "evidence"],
];

/// Paths of values that must be strings. They are checked here because serde also accepts an object.
const STRINGS: [&[&str]; 2] = [&["states", "[]", "origin"], &["states", "[]", "learned", "origin"]];

/// Fields that may be missing or `null` in version 2.
const OPTIONAL: [&str; 3] = ["provenance", "learned", "evidence"];

/// Checks the format, the version and the shape of the file. Returns the version.
pub(super) fn check(file: &Value) -> Result<u64, FieldFault> {
    let fault = |field: &str, found: Option<&Value>, expected: String| FieldFault {
        field: field.into(),
        problem: found.map_or_else(|| "it is missing".into(), found_instead),
        expected,
    };
    if !file.is_object() {
        return Err(fault("", Some(file), "an object, as written by `symbolt learn`".into()));
    }
    // Check the version before other fields, because another version may have different fields.
    let format = file.get("format");
    if format.and_then(Value::as_str) != Some(FORMAT) {
        return Err(fault("format", format, format!("`{FORMAT}`")));
    }
    let version = file.get("version");
    let Some(known @ (v1::VERSION | VERSION)) = version.and_then(Value::as_u64) else {
        let expected =
            format!("{} or {VERSION}, the versions that this program can read", v1::VERSION);
        return Err(fault("version", version, expected));
    };
    for path in OBJECTS {
        let optional = known == VERSION && path.last().is_some_and(|last| OPTIONAL.contains(last));
        let fits = |value: &Value| value.is_object() || optional && value.is_null();
        if let Some((field, value)) = misfit(file, path, String::new(), &fits) {
            return Err(fault(&field, Some(value), "an object".into()));
        }
    }
    for path in STRINGS {
        if let Some((field, value)) = misfit(file, path, String::new(), &Value::is_string) {
            return Err(fault(&field, Some(value), "a string".into()));
        }
    }
    Ok(known)
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

/// Returns the first value at `path` that does not satisfy `fits`, with its place. Missing values are skipped.
fn misfit<'v>(
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

/// Returns the first field that cannot be read, or an empty string if none of the known fields is at fault. `S` and `O`
/// are the types of the entries for states and operators.
pub(super) fn faulty_field<'v, S: Deserialize<'v>, O: Deserialize<'v>>(file: &'v Value) -> String {
    let provenance = file.get("provenance").filter(|p| !p.is_null());
    if provenance.is_some_and(|p| Provenance::deserialize(p).is_err()) {
        return "provenance".into();
    }
    if file.get("goal").is_some_and(|goal| !goal.is_string() && !goal.is_null()) {
        return "goal".into();
    }
    let states = faulty_entry::<S>(file, "states");
    states.or_else(|| faulty_entry::<O>(file, "operators")).unwrap_or_default()
}

fn faulty_entry<'v, T: Deserialize<'v>>(file: &'v Value, list: &str) -> Option<String> {
    let Some(entries) = file.get(list)?.as_array() else { return Some(list.into()) };
    let at = entries.iter().position(|entry| T::deserialize(entry).is_err())?;
    Some(format!("{list}[{at}]"))
}
