//! Commands, their arguments, and what they return to the shell.

mod args;
mod bench;
mod check;
mod classify;
mod experiment;
mod figures;
mod learn;
mod output;
mod plan;
mod record;
mod rename;
mod repeat;
mod report;
mod run;
mod watch;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use anyhow::Error;
use clap::{CommandFactory, Parser};
use symbolt::files::{FileError, write_atomic};
use symbolt::neurons::{SolvedFileError, UnknownMode};
use symbolt::study::standard::UnknownModel;
use symbolt::task::TaskError;
use symbolt::task::tasks;

use args::{Cli, Command};

/// How a command that did not break off went.
pub(crate) enum Outcome {
    /// It did what it was asked for.
    Done,
    /// It ran, and what it tried could not be done; said in one sentence.
    Failed(String),
}

/// Runs the command line: 0 on success, 1 on a failed run, 2 on bad usage or input.
pub(crate) fn main() -> ExitCode {
    match dispatch(Cli::parse_from(with_command(std::env::args_os()))) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Failed(sentence)) => {
            complain(&sentence);
            ExitCode::from(1)
        }
        Err(error) => {
            // A reader that went away (`symbolt learn ... | head`) is no failure.
            if let Some(io) = error.downcast_ref::<std::io::Error>()
                && io.kind() == std::io::ErrorKind::BrokenPipe
            {
                return ExitCode::SUCCESS;
            }
            complain(&sentence(&error));
            ExitCode::from(code(&error))
        }
    }
}

/// Puts `run` in where no command is given: `symbolt --seed 3` is `symbolt run --seed 3`.
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

/// An error and its causes, leaving out those that the error says itself.
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
    // If standard error is gone there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "symbolt: {sentence}");
}

/// What the shell is told about an error: 2 where the user gave something that cannot be used.
fn code(error: &Error) -> u8 {
    if error.is::<UnknownMode>() || error.is::<UnknownModel>() || error.is::<args::BadArgument>() {
        return 2;
    }
    if error.is::<SolvedFileError>() {
        return 2;
    }
    if let Some(file) = error.downcast_ref::<FileError>() {
        return file_code(file);
    }
    match error.downcast_ref::<TaskError>() {
        Some(TaskError::File(file)) => file_code(file),
        Some(TaskError::Sim(_) | TaskError::Undecided { .. }) | None => 1,
        Some(_) => 2,
    }
}

fn file_code(error: &FileError) -> u8 {
    match error {
        FileError::Io { what: "read", .. } | FileError::Exists { .. } => 2,
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
        Command::Rename(args) => rename::rename(&args),
        Command::Check(args) => check::check(&args),
        Command::Bench(args) => bench::bench(&args),
        Command::Report(args) => report::make(&args),
        Command::Experiment(args) => experiment::experiment(&args),
        Command::Merge(args) => experiment::merged(&args),
        Command::Config(args) => {
            let text = format!("{:#}\n", tasks::default().settings());
            match &args.out.out {
                Some(path) => write_atomic(path, text, args.out.overwrite())?,
                None => output::emit(&text)?,
            }
            Ok(Outcome::Done)
        }
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "symbolt", &mut text);
            output::emit(&String::from_utf8_lossy(&text))?;
            Ok(Outcome::Done)
        }
    }
}
