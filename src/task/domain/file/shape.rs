//! The shape of a domain file: which values must be objects or strings, and which field has a fault.

use serde::Deserialize;
use serde_json::Value;

use super::fields::{FieldFault, faulty_entry, misfit};
use super::{FORMAT, VERSION, v1};
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
    if !file.is_object() {
        return Err(FieldFault::found("", Some(file), "an object, as written by `symbolt learn`"));
    }
    // Check the version before other fields, because another version may have different fields.
    let format = file.get("format");
    if format.and_then(Value::as_str) != Some(FORMAT) {
        return Err(FieldFault::found("format", format, format!("`{FORMAT}`")));
    }
    let version = file.get("version");
    let Some(known @ (v1::VERSION | VERSION)) = version.and_then(Value::as_u64) else {
        let expected = format!(
            "{} or {VERSION}, the versions without frames (`RelationalDomain` reads version 3)",
            v1::VERSION
        );
        return Err(FieldFault::found("version", version, expected));
    };
    for path in OBJECTS {
        let optional = known == VERSION && path.last().is_some_and(|last| OPTIONAL.contains(last));
        let fits = |value: &Value| value.is_object() || optional && value.is_null();
        if let Some((field, value)) = misfit(file, path, String::new(), &fits) {
            return Err(FieldFault::found(&field, Some(value), "an object"));
        }
    }
    for path in STRINGS {
        if let Some((field, value)) = misfit(file, path, String::new(), &Value::is_string) {
            return Err(FieldFault::found(&field, Some(value), "a string"));
        }
    }
    Ok(known)
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
