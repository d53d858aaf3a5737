//! The shape of a domain file: which values must be objects or strings, and which field has a fault.

use std::collections::BTreeMap;

use serde_json::Value;

use super::fields::{FieldFault, faulty_entry, is_unreadable, misfit};
use super::{FORMAT, GoalEntry, NeedEntry, OperatorEntry, SideEffectEntry, VERSION};
use crate::task::domain::{FrameState, Place, Provenance};

/// Paths of values that must be objects. They are checked here because serde also accepts a list of the field values in
/// order. `[]` stands for every entry of a list. Each version has some of them.
const OBJECTS: [&[&str]; 22] = [
    &["sub_kinds", "[]"],
    &["sub_kinds", "[]", "of", "[]"],
    &["provenance"],
    &["provenance", "clusters", "[]"],
    &["goals", "[]"],
    &["states", "[]"],
    &["states", "[]", "places", "[]"],
    &["states", "[]", "places", "[]", "coordinates", "[]"],
    &["states", "[]", "places", "[]", "coordinates", "[]", "tight"],
    &["states", "[]", "places", "[]", "coordinates", "[]", "open"],
    &["states", "[]", "turn", "axis"],
    &["states", "[]", "turn", "full"],
    &["operators", "[]"],
    &["operators", "[]", "needs", "[]"],
    &["operators", "[]", "side_effects", "[]"],
    &["operators", "[]", "order", "[]"],
    &["operators", "[]", "order", "[]", "one_of", "[]"],
    &["operators", "[]", "displacement"],
    &["states", "[]", "mean"],
    &["states", "[]", "learned"],
    &["states", "[]", "learned", "mean"],
    &["operators", "[]", "evidence"],
];

/// Paths of values that must be strings. They are checked here because serde also accepts an object.
const STRINGS: [&[&str]; 4] = [
    &["states", "[]", "origin"],
    &["operators", "[]", "needs", "[]", "verdict"],
    &["goals", "[]", "each"],
    &["states", "[]", "learned", "origin"],
];

/// Fields that may be `null`.
const OPTIONAL: [&str; 2] = ["displacement", "each"];

/// Checks the format, the version and the shape of the file. Returns the version.
pub(super) fn check(file: &Value) -> Result<u64, FieldFault> {
    if !file.is_object() {
        let expected = "an object, as written by `symbolt learn`";
        return Err(FieldFault::found("", Some(file), expected));
    }
    // Check the version before other fields, because another version may have different fields.
    let format = file.get("format");
    if format.and_then(Value::as_str) != Some(FORMAT) {
        return Err(FieldFault::found("format", format, format!("`{FORMAT}`")));
    }
    let version = file.get("version");
    let Some(known @ 1..=VERSION) = version.and_then(Value::as_u64) else {
        let expected = format!("1 to {VERSION}, the versions that this program can read");
        return Err(FieldFault::found("version", version, expected));
    };
    let lists = [(&OBJECTS[..], "an object"), (&STRINGS[..], "a string")];
    for (paths, expected) in lists {
        for path in paths {
            let optional = path.last().is_some_and(|last| OPTIONAL.contains(last));
            let fits = |value: &Value| match expected {
                "an object" => value.is_object() || optional && value.is_null(),
                _ => value.is_string() || optional && value.is_null(),
            };
            if let Some((field, value)) = misfit(file, path, String::new(), &fits) {
                return Err(FieldFault::found(&field, Some(value), expected));
            }
        }
    }
    Ok(known)
}

/// Returns the first field that cannot be read, or an empty string if none of the known fields is at fault.
pub(super) fn faulty_field(file: &Value) -> String {
    if file.get("provenance").is_some_and(is_unreadable::<Provenance>) {
        return "provenance".into();
    }
    for noise in ["noise_m", "noise_rad"] {
        if file.get(noise).is_some_and(|value| !value.is_number()) {
            return noise.into();
        }
    }
    if file.get("level").is_some_and(is_unreadable::<BTreeMap<String, [f64; 3]>>) {
        return "level".into();
    }
    let sentences =
        |words: &Value| words.as_object().is_some_and(|all| all.values().all(Value::is_string));
    if file.get("words").is_some_and(|words| !sentences(words)) {
        return "words".into();
    }
    let goals = faulty_entry::<GoalEntry>(file, "goals");
    let states = || within(file, "states", faulty_entry::<FrameState>(file, "states")?, &[places]);
    let operators = || {
        let entry = faulty_entry::<OperatorEntry>(file, "operators")?;
        within(file, "operators", entry, &[needs, side_effects])
    };
    goals.or_else(states).or_else(operators).unwrap_or_default()
}

type Faulty = fn(&Value) -> Option<String>;

fn places(state: &Value) -> Option<String> {
    faulty_entry::<Place>(state, "places")
}

fn needs(operator: &Value) -> Option<String> {
    faulty_entry::<NeedEntry>(operator, "needs")
}

fn side_effects(operator: &Value) -> Option<String> {
    faulty_entry::<SideEffectEntry>(operator, "side_effects")
}

/// Returns the faulty entry of one of the lists within `entry`, the faulty entry of `list`; `entry` itself if these are
/// sound.
fn within(file: &Value, list: &str, entry: String, inner: &[Faulty]) -> Option<String> {
    let entries = file.get(list).and_then(Value::as_array).into_iter().flatten().enumerate();
    let faulty = entries.into_iter().find(|(i, _)| format!("{list}[{i}]") == entry);
    let fault = faulty.and_then(|(_, value)| inner.iter().find_map(|inner| inner(value)));
    Some(match fault {
        Some(fault) => format!("{entry}.{fault}"),
        None => entry,
    })
}
