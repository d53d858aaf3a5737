//! The log of interventions: JSON lines, one intervention with its tick on each.

use std::fmt;
use std::path::Path;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::files::{Limit, read_file};
use crate::sim::build::graph::Graph;
use crate::sim::run::changes::Changes;
use crate::sim::run::intervention::{Intervention, InterventionError};
use crate::sim::words::cut;

/// An intervention with its tick.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Logged {
    /// Number of ticks completed before the intervention.
    pub tick: u64,
    /// The intervention.
    #[serde(rename = "do")]
    pub what: Intervention,
}

/// Interventions by rising tick. Its text ([`Display`](fmt::Display)) is JSON lines, which [`parse`](Self::parse) reads:
///
/// ```
/// use symbolt::sim::InterventionLog;
/// let text = "{\"tick\":120,\"do\":{\"silence\":{\"at\":\"memory\"}}}\n";
/// let log = InterventionLog::parse(text)?;
/// assert_eq!(log.entries()[0].tick, 120);
/// assert_eq!(log.to_string(), text);
/// let cut = InterventionLog::parse(&text[..30]).unwrap_err();
/// assert!(cut.to_string().starts_with("line 1 is cut"), "{cut}");
/// # Ok::<(), symbolt::sim::LogError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct InterventionLog {
    pub(super) entries: Vec<Logged>,
}

/// Why a log cannot be read or followed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LogError {
    /// A file that cannot be read.
    #[error("{0}")]
    File(String),
    /// A last line without a line break: the rest of the file is missing.
    #[error("line {line} is cut: the last line of a log ends with a line break")]
    Cut {
        /// Line, counted from 1.
        line: usize,
    },
    /// A line that is not an intervention.
    #[error("line {line}, column {column} is no intervention: {reason}")]
    Line {
        /// Line, counted from 1.
        line: usize,
        /// Column in bytes, counted from 1.
        column: usize,
        /// Reason.
        reason: String,
    },
    /// An intervention after one of a later tick.
    #[error("intervention {number} belongs to tick {tick}, but the one before it to tick {before}")]
    Order {
        /// Place in the log, counted from 1; the line in its text.
        number: usize,
        /// Its tick.
        tick: u64,
        /// The tick of the one before.
        before: u64,
    },
    /// An intervention of a tick that the run has passed.
    #[error("intervention {number} belongs to tick {tick}, but the run stands at tick {now}")]
    Past {
        /// Place in the log, counted from 1; the line in its text.
        number: usize,
        /// Its tick.
        tick: u64,
        /// Number of completed ticks.
        now: u64,
    },
    /// An intervention after the end of the run.
    #[error(
        "intervention {number} belongs to tick {tick}, but the run ends at tick {end} at the latest"
    )]
    Late {
        /// Place in the log, counted from 1; the line in its text.
        number: usize,
        /// Its tick.
        tick: u64,
        /// The latest tick at which the run ends.
        end: u64,
    },
    /// An intervention that is not possible in the graph.
    #[error("intervention {number}, at tick {tick}: {error}")]
    Impossible {
        /// Place in the log, counted from 1; the line in its text.
        number: usize,
        /// Its tick.
        tick: u64,
        /// Why it is not possible.
        error: InterventionError,
    },
}

/// Greatest number of interventions, and of their values, that a live run logs.
const MOST: [usize; 2] = [100_000, 2_000_000];

/// Checks that a log has room for an intervention.
pub(super) fn check_room(log: &[Logged], what: &Intervention) -> Result<(), InterventionError> {
    let [most, most_values] = MOST;
    let values = match what.values() {
        0 => 0,
        own => own + log.iter().map(|entry| entry.what.values()).sum::<usize>(),
    };
    match log.len() < most && values <= most_values {
        true => Ok(()),
        false => Err(InterventionError::LogFull { most, most_values }),
    }
}

impl InterventionLog {
    /// Makes a log of entries by rising tick.
    ///
    /// # Errors
    /// [`LogError::Order`].
    pub fn new(entries: Vec<Logged>) -> Result<Self, LogError> {
        match entries.windows(2).position(|pair| pair[0].tick > pair[1].tick) {
            None => Ok(Self { entries }),
            Some(at) => {
                let (before, tick) = (entries[at].tick, entries[at + 1].tick);
                Err(LogError::Order { number: at + 2, tick, before })
            }
        }
    }

    /// Reads JSON lines. An empty text is an empty log.
    ///
    /// # Errors
    /// [`LogError::Line`], [`LogError::Cut`] or [`LogError::Order`].
    pub fn parse(text: &str) -> Result<Self, LogError> {
        let entry = |(at, row): (usize, &str)| {
            let line = at + 1;
            let Some(row) = row.strip_suffix('\n') else { return Err(LogError::Cut { line }) };
            serde_json::from_str(row).map_err(|error| {
                let column = error.column();
                let place = format!(" at line {} column {column}", error.line());
                let reason = cut(&error.to_string().replace(&place, ""), 300).into();
                LogError::Line { line, column, reason }
            })
        };
        let entries: Result<_, LogError> =
            text.split_inclusive('\n').enumerate().map(entry).collect();
        Self::new(entries?)
    }

    /// Reads a file of JSON lines, at most 64 MiB.
    ///
    /// # Errors
    /// [`LogError::File`], or as [`parse`](Self::parse).
    pub fn read(path: &Path) -> Result<Self, LogError> {
        let bytes = read_file(path, Limit::INTERVENTIONS).map_err(|error| {
            let cause = std::error::Error::source(&error).map(|cause| format!(": {cause}"));
            LogError::File(format!("{error}{}", cause.unwrap_or_default()))
        })?;
        let text = std::str::from_utf8(&bytes).map_err(|error| {
            let before = &bytes[..error.valid_up_to()];
            let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
            let column = 1 + before.iter().rev().take_while(|byte| **byte != b'\n').count();
            LogError::Line { line, column, reason: "it is not UTF-8".into() }
        })?;
        Self::parse(text)
    }

    /// Returns the interventions.
    pub fn entries(&self) -> &[Logged] {
        &self.entries
    }

    /// Checks that a run of `graph` that ends at tick `end` can follow the log from its start.
    ///
    /// # Errors
    /// [`LogError::Impossible`] or [`LogError::Late`].
    pub fn check(&self, graph: &Graph, end: u64) -> Result<(), LogError> {
        self.check_from(0, Changes::default(), graph)?;
        match self.entries.iter().position(|entry| entry.tick >= end) {
            None => Ok(()),
            Some(at) => Err(LogError::Late { number: at + 1, tick: self.entries[at].tick, end }),
        }
    }

    /// Checks that a run with these changes can follow the log from tick `now`.
    pub(super) fn check_from(
        &self,
        now: u64,
        mut changes: Changes,
        graph: &Graph,
    ) -> Result<(), LogError> {
        for (at, Logged { tick, what }) in self.entries.iter().enumerate() {
            let (number, tick) = (at + 1, *tick);
            if tick < now {
                return Err(LogError::Past { number, tick, now });
            }
            changes.add(graph, what).map_err(|error| LogError::Impossible {
                number,
                tick,
                error,
            })?;
        }
        Ok(())
    }
}

impl fmt::Display for InterventionLog {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for entry in &self.entries {
            writeln!(f, "{}", serde_json::to_string(entry).map_err(|_| fmt::Error)?)?;
        }
        Ok(())
    }
}
