//! How a command ends: its outcome, its faults, and the exit codes.

use std::fmt::Display;
use std::io::ErrorKind;
use std::path::Path;
use std::process::ExitCode;

use anyhow::Error;
use symbolt::files::FileError;
use symbolt::neurons::{SolvedFileError, UnknownMode};
use symbolt::plan::goal_sets::GoalSetError;
use symbolt::plan::model::LearnError;
use symbolt::plan::strips::{GroundFault, PddlFault};
use symbolt::sim::{is_plain, meant};
use symbolt::study::experiment::ShardError;
use symbolt::study::standard::UnknownModel;
use symbolt::task::pddl::WriteFault;
use symbolt::task::{InputFault, TaskError};

use super::output::{tell, warn_of_the_rest};

/// The result of a command that ran to its end.
pub(crate) enum Outcome {
    /// The command succeeded.
    Done,
    /// The command failed, for the reason in this sentence.
    Failed(String),
}

/// A sentence on a well-formed argument that the command cannot use.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct BadArgument(pub String);

impl BadArgument {
    /// Builds the sentence for a value outside the range of its option.
    pub fn range(option: &str, value: impl Display, expected: &str) -> Self {
        Self(format!("{option} {value}: must be {expected}"))
    }
}

/// How a command ended.
pub(crate) struct Ended {
    /// Exit code.
    pub code: u8,
    /// What to say on standard error.
    pub sentence: Option<String>,
}

impl Ended {
    /// Says the sentence, if there is one, and returns the exit code.
    pub fn tell(self) -> ExitCode {
        warn_of_the_rest();
        if let Some(sentence) = self.sentence {
            tell(&sentence);
        }
        ExitCode::from(self.code)
    }
}

/// Joins an error and its causes in one sentence, without repetitions. Of a file that is not there, it asks about the name that
/// was probably meant.
pub(crate) fn sentence(error: &Error) -> String {
    let joined = error.chain().map(ToString::to_string).fold(String::new(), |text, cause| {
        match (text.is_empty(), text.contains(&cause)) {
            (true, _) => cause,
            (_, true) => text,
            _ => format!("{text}: {cause}"),
        }
    });
    joined + &unread(error).map(neighbour).unwrap_or_default()
}

/// Returns the file that an error did not find.
fn unread(error: &Error) -> Option<&Path> {
    let file = error.chain().find_map(|cause| match cause.downcast_ref() {
        Some(TaskError::File(file) | TaskError::Solved(SolvedFileError::File(file))) => Some(file),
        _ => match cause.downcast_ref() {
            Some(SolvedFileError::File(file)) => Some(file),
            _ => cause.downcast_ref(),
        },
    });
    match file? {
        FileError::Io { what: "read", path, source } if source.kind() == ErrorKind::NotFound => {
            Some(path)
        }
        _ => None,
    }
}

/// Returns a question about the file of a folder whose name is nearest to that of a file which is not there.
fn neighbour(path: &Path) -> String {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new("."))).into_iter().flatten();
    let written = path.file_name().unwrap_or_default().to_string_lossy();
    // A misspelt name is about as long as the right one.
    let near = |name: &String| name.len().abs_diff(written.len()) <= 3 && is_plain(name);
    let names = entries.flatten().filter(|entry| entry.path().is_file());
    let names = names.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(near).collect();
    names.sort();
    let asked = meant(&written, names.iter().map(String::as_str));
    let name = names.iter().find(|name| asked.contains(&format!("`{name}`")));
    let file = |name| format!(" (did you mean `{}`?)", path.with_file_name(name).display());
    name.map(file).unwrap_or_default()
}

/// Returns the exit code for an error: 2 if an argument or an input file is to blame, 1 otherwise.
pub(crate) fn code(error: &Error) -> u8 {
    if error.is::<UnknownMode>() || error.is::<UnknownModel>() || error.is::<BadArgument>() {
        return 2;
    }
    if error.is::<SolvedFileError>()
        || error.is::<PddlFault>()
        || error.is::<InputFault>()
        || error.is::<GroundFault>()
        || error.is::<WriteFault>()
        || error.is::<LearnError>()
        || error.is::<ShardError>()
    {
        return 2;
    }
    if let Some(fault) = error.downcast_ref::<GoalSetError>() {
        return goal_set_code(fault);
    }
    if let Some(file) = error.downcast_ref::<FileError>() {
        return file_code(file);
    }
    match error.downcast_ref::<TaskError>() {
        Some(TaskError::File(file)) => file_code(file),
        Some(TaskError::GoalSets(fault)) => goal_set_code(fault),
        Some(TaskError::Sim(_) | TaskError::Undecided { .. }) | None => 1,
        Some(_) => 2,
    }
}

/// Returns 1 if the planner ran, or if no plan reaches the goal, and 2 if a setting is to blame.
fn goal_set_code(error: &GoalSetError) -> u8 {
    match error {
        GoalSetError::Sim(_) | GoalSetError::Unreachable { .. } => 1,
        _ => 2,
    }
}

fn file_code(error: &FileError) -> u8 {
    match error {
        // A name that no file can have, such as that of a folder.
        FileError::Io { source, .. }
            if matches!(source.kind(), ErrorKind::InvalidInput | ErrorKind::NotADirectory) =>
        {
            2
        }
        FileError::Io { what: "read", .. }
        | FileError::Exists { .. }
        | FileError::TooLarge { .. }
        | FileError::TooManyEntries { .. } => 2,
        _ => 1,
    }
}
