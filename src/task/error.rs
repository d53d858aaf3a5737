//! Errors of recordings, learning, domains, planning and execution.

use std::path::PathBuf;

use thiserror::Error;

use crate::files::FileError;
use crate::neurons::SolvedFileError;
use crate::plan::goal_sets::GoalSetError;
use crate::robot::RobotError;
use crate::sim::{BuildErrors, LiveError, SimError, cut, meant, nearest_first, question};
use crate::spa::VocabError;

/// A fault in an input file: where it is, what was found and what was expected.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}{}: {}; expected {}", file, place(.line, .field), cut(.problem, LONGEST), cut(.expected, LONGEST))]
pub struct InputFault {
    /// Name of the file, or another name for the source of the text.
    pub file: String,
    /// The line, counted from 1; `None` if the fault is not in a single line.
    pub line: Option<usize>,
    /// The field, such as `objects[2].orientation`; empty if the fault is not in a single field.
    pub field: String,
    /// What was found.
    pub problem: String,
    /// What was expected instead.
    pub expected: String,
}

/// Greatest number of characters of a problem, which may quote thousands of a file.
const LONGEST: usize = 400;

/// Number of names that serde may list.
const FEW: usize = 10;

/// Returns serde's message without its line and column, which [`InputFault`] reports separately. Of many names it lists
/// the nearest.
pub(super) fn json_problem(error: &serde_json::Error) -> String {
    let mut text = error.to_string();
    if let Some(at) = text.rfind(" at line ") {
        text.truncate(at);
    }
    // As in "unknown field `part`, expected one of `parts`, `place`" or "expected `parts` or `place`".
    let unknown = text.starts_with("unknown ").then(|| text.rsplit_once("`, expected ")).flatten();
    if let Some((found, names)) = unknown
        && let Some((_, written)) = found.split_once('`')
    {
        let names: Vec<&str> = names.split('`').skip(1).step_by(2).collect();
        let question = meant(written, names.iter().copied());
        if names.len() > FEW {
            let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
            let names = nearest_first(&format!("`{written}`"), quoted.iter().map(String::as_str));
            text = format!("{found}`, expected one of {names}");
        }
        text += &question;
    }
    text
}

fn place(line: &Option<usize>, field: &str) -> String {
    let line = line.map_or_else(String::new, |n| format!(", line {n}"));
    if field.is_empty() { line } else { format!("{line}, field `{field}`") }
}

/// An error of recording, learning, planning or execution.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TaskError {
    /// An input file has invalid content.
    #[error(transparent)]
    Input(#[from] InputFault),
    /// The pointers have too few dimensions to decode every state that is bound into one of them.
    #[error(
        "{dimensions} dimensions are too few: `{action}` binds {states} states, and `{other}` cannot be decoded \
         correctly; use more dimensions or another seed"
    )]
    TooFewDimensions {
        /// Number of dimensions of the pointers.
        dimensions: usize,
        /// Name of the action.
        action: String,
        /// Number of states bound into the action's deep pointer.
        states: usize,
        /// Name of a state that would be decoded incorrectly.
        other: String,
    },
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A folder contains neither a run nor an experiment.
    #[error(
        "{} holds nothing to report; expected the folder of a run (run.json, trace.jsonl, ...), of an experiment \
         (results.json) or of several experiments", folder.display()
    )]
    NothingToReport {
        /// The folder.
        folder: PathBuf,
    },
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
    /// The recording is valid, but contains nothing to learn from.
    #[error("nothing can be learned from this recording: {reason}")]
    NothingToLearn {
        /// Why nothing can be learned.
        reason: String,
    },
    /// A kind has more poses than can be clustered.
    #[error(
        "{poses} poses of `{kind}` would need {gigabytes:.0} GB for their distances; expected at most {most} poses"
    )]
    TooManyPoses {
        /// The kind of object.
        kind: String,
        /// Number of poses of that kind.
        poses: usize,
        /// Memory that the distance matrix would need, in gigabytes.
        gigabytes: f64,
        /// The largest number of poses that can be clustered.
        most: usize,
    },
    /// The domain has no state or action with this name.
    #[error("the domain has no {what} `{name}`{}; it has: {}", question(.nearest.as_deref()), nearest_first(.name, .choices.iter().map(String::as_str)))]
    Unknown {
        /// What was looked up: `state`, `action` or `state or action`.
        what: &'static str,
        /// The name given.
        name: String,
        /// The most similar name, if one is close.
        nearest: Option<String>,
        /// The names that exist.
        choices: Vec<String>,
    },
    /// A value cannot be written as JSON.
    #[error("{what} cannot be written as JSON")]
    Json {
        /// Name of the value that could not be written, such as `the domain`.
        what: &'static str,
        /// The error from serde.
        source: serde_json::Error,
    },
    /// The domain contradicts itself or cannot be used.
    #[error("the domain is not valid: {reason}")]
    BadDomain {
        /// What is wrong with the domain.
        reason: String,
    },
    /// A scene and a relational domain give no planning problem.
    #[error("{reason}")]
    Problem {
        /// Why they give no problem.
        reason: String,
    },
    /// The planner of goal sets cannot be built.
    #[error(transparent)]
    GoalSets(#[from] GoalSetError),
    /// A vocabulary could not be built.
    #[error(transparent)]
    Vocabulary(#[from] VocabError),
    /// A graph could not be built.
    #[error(transparent)]
    Build(#[from] BuildErrors),
    /// There is no experiment with this name.
    #[error(
        "there is no experiment `{name}`{}; the experiments are: {}; `symbolt experiment` describes them",
        meant(.name, .choices.iter().map(String::as_str)), nearest_first(.name, .choices.iter().map(String::as_str))
    )]
    UnknownExperiment {
        /// The name given.
        name: String,
        /// The names of all experiments.
        choices: Vec<String>,
    },
    /// A cell of an experiment lacks a setting that its trial reads.
    #[error("`{setting}` is not a setting of the cell `{cell}` that is {expected}")]
    CellSetting {
        /// The cell, by its settings.
        cell: String,
        /// The setting that was read.
        setting: String,
        /// The valid values.
        expected: String,
    },
    /// There is no task with this name.
    #[error(
        "there is no task `{name}`{}; the tasks are: {}; `--task` without a name describes them",
        meant(.name, .choices.iter().map(|task| &*task.0)), nearest_first(.name, .choices.iter().map(|task| &*task.0))
    )]
    UnknownTask {
        /// The name given.
        name: String,
        /// Name and description of every task.
        choices: Vec<(String, String)>,
    },
    /// A figure cannot be drawn.
    #[error("the figure cannot be drawn: {reason}")]
    Figure {
        /// Why the figure cannot be drawn.
        reason: String,
    },
    /// The shards do not add up to a complete experiment.
    #[error("cannot merge {}: {reason}", folder.display())]
    Merge {
        /// The folder of the shard, or of the merged experiment.
        folder: PathBuf,
        /// Why the shards cannot be merged.
        reason: String,
    },
    /// A file of solved populations cannot be used.
    #[error(transparent)]
    Solved(#[from] SolvedFileError),
    /// A simulation could not run.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// Interventions that are not possible in an episode.
    #[error(transparent)]
    Live(LiveError),
    /// The planner reached no decision within its time limit.
    #[error("the planner reached no decision within {limit_ms} simulated ms; it was still {doing}")]
    Undecided {
        /// The time limit, in simulated milliseconds.
        limit_ms: f64,
        /// What the planner was doing at the limit, such as `recognising the goal`.
        doing: String,
    },
}

impl From<RobotError> for TaskError {
    fn from(error: RobotError) -> Self {
        match error {
            RobotError::Setting { name, value, expected } => {
                Self::Setting { name, value, expected }
            }
            RobotError::Range { name, value, least, most } => {
                Self::Range { name, value, least, most }
            }
        }
    }
}

impl From<LiveError> for TaskError {
    fn from(error: LiveError) -> Self {
        match error {
            LiveError::Sim(error) => Self::Sim(error),
            other => Self::Live(other),
        }
    }
}
