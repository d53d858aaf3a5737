//! Every way in which recordings, learning, domains and plans can fail.

use std::path::PathBuf;

use thiserror::Error;

use crate::files::FileError;
use crate::neurons::SolvedFileError;
use crate::sim::{BuildErrors, SimError};
use crate::spa::VocabError;

/// Something in an input file that is not as it must be.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{file}{}: {problem}; expected {expected}", place(.line, .field))]
pub struct InputFault {
    /// The file, or whatever the text came from.
    pub file: String,
    /// The line, counted from 1, if the fault has one.
    pub line: Option<usize>,
    /// The field, such as `objects[2].orientation`; empty if the fault has none.
    pub field: String,
    /// What was found.
    pub problem: String,
    /// What should stand there.
    pub expected: String,
}

/// What serde found wrong with a JSON text, without the line and column that it appends: a fault has places of
/// its own for these.
pub(super) fn json_problem(error: &serde_json::Error) -> String {
    let mut text = error.to_string();
    if let Some(at) = text.rfind(" at line ") {
        text.truncate(at);
    }
    text
}

fn place(line: &Option<usize>, field: &str) -> String {
    let line = line.map_or_else(String::new, |n| format!(", line {n}"));
    if field.is_empty() { line } else { format!("{line}, field `{field}`") }
}

/// What can go wrong between a recording and a plan.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TaskError {
    /// A file that is not as it must be.
    #[error(transparent)]
    Input(#[from] InputFault),
    /// Pointers with too few dimensions for what is bound into one of them.
    #[error(
        "{dimensions} dimensions are too few: with the {states} states bound into `{action}`, `{other}` \
         cannot be read out rightly; take more dimensions, or another seed"
    )]
    TooFewDimensions {
        /// Dimensions of the pointers.
        dimensions: usize,
        /// The action.
        action: String,
        /// How many states are bound into its deep pointer.
        states: usize,
        /// A state that would be read wrongly.
        other: String,
    },
    /// A file that cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A folder that holds neither a run nor an experiment.
    #[error(
        "{} holds nothing to report; expected a run's folder (run.json, trace.jsonl, ...), an experiment's \
         (results.json), or one of experiments", folder.display()
    )]
    NothingToReport {
        /// The folder.
        folder: PathBuf,
    },
    /// A setting that makes no sense.
    #[error("`{name}` is {value}; expected {expected}")]
    Setting {
        /// The setting's name.
        name: &'static str,
        /// What was given.
        value: String,
        /// What can be given.
        expected: &'static str,
    },
    /// A setting outside its range.
    #[error("`{name}` is {value}; expected {least} to {most}")]
    Range {
        /// The setting's name.
        name: &'static str,
        /// What was given.
        value: f64,
        /// The least that can be given.
        least: f64,
        /// The most.
        most: f64,
    },
    /// A recording from which nothing can be learned.
    #[error("nothing can be learned from this recording: {reason}")]
    NothingToLearn {
        /// Why.
        reason: String,
    },
    /// More poses of one kind than can be clustered.
    #[error(
        "{poses} poses of `{kind}` would need {gigabytes:.0} GB of distances; the most is {most} poses"
    )]
    TooManyPoses {
        /// The kind.
        kind: String,
        /// How many there are.
        poses: usize,
        /// How much memory their distances need.
        gigabytes: f64,
        /// How many can be clustered.
        most: usize,
    },
    /// A name that a domain does not have.
    #[error("the domain has no {what} `{name}`{}; it has: {}", near(.nearest), .choices.join(", "))]
    Unknown {
        /// `state`, `action` or `kind`.
        what: &'static str,
        /// What was asked for.
        name: String,
        /// The most similar name, if one is close.
        nearest: Option<String>,
        /// What exists.
        choices: Vec<String>,
    },
    /// Something that cannot be put into JSON.
    #[error("{what} cannot be written as JSON")]
    Json {
        /// What was to be written.
        what: &'static str,
        /// Serde's reason.
        source: serde_json::Error,
    },
    /// A domain that contradicts itself.
    #[error("the domain is not valid: {reason}")]
    BadDomain {
        /// What is wrong.
        reason: String,
    },
    /// A vocabulary that could not be made.
    #[error(transparent)]
    Vocabulary(#[from] VocabError),
    /// A graph that could not be built.
    #[error(transparent)]
    Build(#[from] BuildErrors),
    /// An experiment that does not exist.
    #[error("there is no experiment `{name}`; the experiments are: {}", .choices.join(", "))]
    UnknownExperiment {
        /// What was asked for.
        name: String,
        /// What exists.
        choices: Vec<String>,
    },
    /// A task that does not exist.
    #[error("there is no task `{name}`; the tasks are: {}", described(.choices))]
    UnknownTask {
        /// What was asked for.
        name: String,
        /// Name and description of each that exists.
        choices: Vec<(&'static str, &'static str)>,
    },
    /// A figure that cannot be drawn.
    #[error("the figure cannot be drawn: {reason}")]
    Figure {
        /// Why.
        reason: String,
    },
    /// Shards that do not make a whole.
    #[error("cannot merge {}: {reason}", folder.display())]
    Merge {
        /// The shard's folder, or the whole's.
        folder: PathBuf,
        /// Why not.
        reason: String,
    },
    /// A file of solved populations that cannot be used.
    #[error(transparent)]
    Solved(#[from] SolvedFileError),
    /// A simulation that could not run.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// A planner that came to no decision in the time given.
    #[error("the planner came to no decision within {limit_ms} simulated ms; it was {doing}")]
    Undecided {
        /// The time given, in simulated milliseconds.
        limit_ms: f64,
        /// What it was doing last.
        doing: String,
    },
}

fn near(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

fn described(choices: &[(&str, &str)]) -> String {
    let choices: Vec<String> =
        choices.iter().map(|(name, what)| format!("{name} ({what})")).collect();
    choices.join(", ")
}
