//! The commands, their arguments and their exit codes.

mod actions;
mod args;
mod bench;
mod check;
mod classify;
mod config;
mod experiment;
mod figures;
mod folder;
mod goal_sets;
mod learn;
mod learn_model;
mod missing;
mod options;
mod output;
mod pddl;
mod plan;
mod ranks;
mod record;
mod relational;
mod rename;
mod repeat;
mod report;
mod run;
mod table;
mod threshold;
mod watch;

use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use anyhow::Error;
use clap::{CommandFactory, Parser};
use symbolt::files::FileError;
use symbolt::neurons::{SolvedFileError, UnknownMode};
use symbolt::spa::VocabError;
use symbolt::study::experiment::ShardError;
use symbolt::study::standard::UnknownModel;
use symbolt::task::TaskError;
use symbolt::task::pddl::WriteFault;
use symbolt::task::regression::GoalSetError;
use symbolt::task::strips::learn::LearnError;
use symbolt::task::strips::{GroundFault, PddlFault};

use args::{BadArgument, Cli, Command};
use ranks::Ended;

/// The result of a command that ran to its end.
pub(crate) enum Outcome {
    /// The command succeeded.
    Done,
    /// The command failed, for the reason in this sentence.
    Failed(String),
}

/// Runs the command line. Returns 0 on success, 1 if the command failed, 2 for bad usage or input.
pub(crate) fn main() -> ExitCode {
    let args = with_command(std::env::args_os());
    let command = args.get(1).map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    ranks::together(&command, || match Cli::try_parse_from(args).map(dispatch) {
        Ok(Ok(Outcome::Done)) => Ended { code: 0, sentence: None },
        Ok(Ok(Outcome::Failed(sentence))) => Ended { code: 1, sentence: Some(sentence) },
        Ok(Err(error)) => {
            // The reader has closed the pipe, as in `symbolt learn ... | head`.
            let closed = |io: &std::io::Error| io.kind() == std::io::ErrorKind::BrokenPipe;
            if error.chain().filter_map(|cause| cause.downcast_ref()).any(closed) {
                return Ended { code: 0, sentence: None };
            }
            let error = with_options(error, &command);
            Ended { code: code(&error), sentence: Some(sentence(&error)) }
        }
        Err(usage) if ranks::seat().is_none() => usage.exit(),
        Err(usage) if usage.use_stderr() => {
            let text = usage.to_string();
            let sentence = text.trim_start_matches("error: ").trim_end().to_owned();
            Ended { code: 2, sentence: Some(sentence) }
        }
        Err(help) => {
            if ranks::leads() {
                // If standard output is closed, nobody reads it.
                let _ = help.print();
            }
            Ended { code: 0, sentence: None }
        }
    })
}

/// Inserts `run` if no command is given: `symbolt --seed 3` becomes `symbolt run --seed 3`.
fn with_command(args: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut args: Vec<OsString> = args.collect();
    let own = ["-h", "--help", "-V", "--version"];
    let missing = match args.get(1) {
        None => true,
        Some(first) => first.to_string_lossy().starts_with('-') && own.iter().all(|o| first != o),
    };
    if missing {
        args.insert(args.len().min(1), "run".into());
    }
    args
}

/// Rewrites an error about a setting so that it names the option that the user typed.
fn with_options(error: Error, command: &str) -> Error {
    let program = Cli::command();
    let command = program.find_subcommand(command);
    let has = |option: &str| {
        command.is_some_and(|c| c.get_arguments().any(|a| a.get_long() == Some(option)))
    };
    if error.is::<UnknownMode>() && has("mode") {
        return BadArgument(format!("--mode: {error}")).into();
    }
    let range = |option: &str, value: String, expected: &str| {
        has(option).then(|| BadArgument::range(&format!("--{option}"), value, expected))
    };
    let exists = |path: &Path| {
        let path = path.display();
        let sentence = format!("{path} exists already; choose another name or add --force");
        has("force").then_some(BadArgument(sentence))
    };
    let named = match (error.downcast_ref::<TaskError>(), error.downcast_ref::<FileError>()) {
        (Some(TaskError::Setting { name, value, expected }), _) => {
            range(&name.replace('_', "-"), value.clone(), expected)
        }
        (Some(TaskError::Vocabulary(VocabError::Dimension { dim, min, max })), _) => {
            range("dimensions", dim.to_string(), &format!("{min} to {max}"))
        }
        (Some(TaskError::Vocabulary(VocabError::TooSimilar { .. })), _) => {
            has("dimensions").then(|| BadArgument(format!("{error} (--dimensions)")))
        }
        (Some(TaskError::File(FileError::Exists { path })), _)
        | (_, Some(FileError::Exists { path })) => exists(path),
        _ => None,
    };
    named.map_or(error, Error::from)
}

/// Joins an error and its causes in one sentence, without repetitions.
fn sentence(error: &Error) -> String {
    error.chain().map(ToString::to_string).fold(String::new(), |text, cause| {
        match (text.is_empty(), text.contains(&cause)) {
            (true, _) => cause,
            (_, true) => text,
            _ => format!("{text}: {cause}"),
        }
    })
}

fn complain(sentence: &str) {
    // If standard error is closed, the message is lost.
    let _ = writeln!(std::io::stderr(), "symbolt: {sentence}");
}

/// Returns the exit code for an error: 2 if an argument or an input file is to blame, 1 otherwise.
fn code(error: &Error) -> u8 {
    if error.is::<UnknownMode>() || error.is::<UnknownModel>() || error.is::<BadArgument>() {
        return 2;
    }
    if error.is::<SolvedFileError>()
        || error.is::<PddlFault>()
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
        GoalSetError::Sim(_)
        | GoalSetError::Unreachable { .. }
        | GoalSetError::NeverHolds { .. } => 1,
        _ => 2,
    }
}

fn file_code(error: &FileError) -> u8 {
    match error {
        FileError::Io { what: "read", .. }
        | FileError::Exists { .. }
        | FileError::TooLarge { .. }
        | FileError::TooManyEntries { .. } => 2,
        _ => 1,
    }
}

fn dispatch(cli: Cli) -> Result<Outcome, Error> {
    match cli.command {
        Command::Run(args) => run::run(&args),
        Command::Record(args) => record::record(&args),
        Command::Learn(args) => learn::learn(&args),
        Command::Classify(args) => classify::classify(&args),
        Command::Plan(args) => plan::plan(&args),
        Command::Actions(args) => actions::actions(&args),
        Command::Pddl(args) => pddl::pddl(&args),
        Command::LearnModel(args) => learn_model::learn_model(&args),
        Command::Rename(args) => rename::rename(&args),
        Command::Check(args) => check::check(&args),
        Command::Bench(args) => bench::bench(&args),
        Command::Report(args) => report::make(&args),
        Command::Experiment(args) => experiment::experiment(&args),
        Command::Merge(args) => experiment::merged(&args),
        Command::Config(args) => config::config(&args),
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "symbolt", &mut text);
            output::emit(&String::from_utf8_lossy(&text))?;
            Ok(Outcome::Done)
        }
    }
}
