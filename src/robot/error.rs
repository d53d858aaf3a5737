//! Errors of the settings of a robot or a scene.

use thiserror::Error;

/// A robot or a scene cannot be built as described.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RobotError {
    /// A setting has an invalid value.
    #[error("`{name}` is {value}; expected {expected}")]
    Setting {
        /// The setting's name.
        name: &'static str,
        /// The value given.
        value: String,
        /// The valid values.
        expected: &'static str,
    },
    /// A numeric setting is out of range.
    #[error("`{name}` is {value}; expected {least} to {most}")]
    Range {
        /// The setting's name.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The smallest valid value.
        least: f64,
        /// The largest valid value.
        most: f64,
    },
}

/// Returns an error for the first number outside its range. Each entry holds name, number, least and greatest value.
#[cfg(feature = "physics")]
pub(crate) fn in_range(numbers: &[(&'static str, f64, f64, f64)]) -> Result<(), RobotError> {
    match numbers.iter().find(|(_, value, least, most)| !(least..=most).contains(&value)) {
        Some(&(name, value, least, most)) => Err(RobotError::Range { name, value, least, most }),
        None => Ok(()),
    }
}
