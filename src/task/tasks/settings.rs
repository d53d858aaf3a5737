//! Reads a task's settings from JSON.

use serde::de::DeserializeOwned;

use crate::task::error::{InputFault, TaskError, json_problem};

/// Reads a task's settings from JSON text, and checks them with `check`. `name` is the name of the file in error
/// messages.
///
/// # Errors
/// [`TaskError::Input`], which names the line if the text is not such a JSON object, or the field if `check` returns a
/// [`TaskError::Setting`] or [`TaskError::Range`]. Other errors of `check` are passed on.
pub fn parse_settings<T: DeserializeOwned>(
    text: &[u8],
    name: &str,
    check: impl FnOnce(&T) -> Result<(), TaskError>,
) -> Result<T, TaskError> {
    let fault = |line, field: &str, problem: String, expected: &str| InputFault {
        file: name.into(),
        line,
        field: field.into(),
        problem,
        expected: expected.into(),
    };
    // Serde would also accept a list of values in order.
    if text.trim_ascii_start().first() != Some(&b'{') {
        let expected = "an object of settings, as `symbolt config` prints them";
        return Err(fault(Some(1), "", "the text is not a JSON object".into(), expected).into());
    }
    let settings: T = serde_json::from_slice(text).map_err(|error| {
        let line = (error.line() > 0).then(|| error.line());
        fault(line, "", json_problem(&error), "a task's settings, as `symbolt config` prints them")
    })?;
    match check(&settings) {
        Err(TaskError::Setting { name: field, value, expected }) => {
            Err(fault(None, field, value, expected).into())
        }
        Err(TaskError::Range { name: field, value, least, most }) => {
            let expected = format!("{least} to {most}");
            Err(fault(None, field, value.to_string(), &expected).into())
        }
        other => other.map(|()| settings),
    }
}
