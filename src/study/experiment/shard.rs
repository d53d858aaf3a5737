//! The part of an experiment that one process runs.

use std::fmt;
use std::str::FromStr;

use crate::task::TaskError;

/// A part of an experiment's trials: those whose number has the remainder `index` when divided by `of`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Index of the part, counted from 0.
    pub index: u64,
    /// Number of parts.
    pub of: u64,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, of: 1 }
    }
}

/// Writes the part as on the command line, counted from 1: `2/4`.
impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index.saturating_add(1), self.of)
    }
}

impl FromStr for Shard {
    type Err = TaskError;

    fn from_str(text: &str) -> Result<Self, TaskError> {
        let parts =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, of)) if (1..=of).contains(&index) => Ok(Self { index: index - 1, of }),
            _ => Err(unusable(text)),
        }
    }
}

pub(super) fn unusable(text: &str) -> TaskError {
    TaskError::Setting {
        name: "shard",
        value: text.into(),
        expected: "I/N with I from 1 to N, such as 2/4; or auto, or auto/N, on a cluster",
    }
}
