//! The commands, their arguments and their exit codes.

mod actions;
mod bench;
mod check;
mod classify;
mod completions;
mod config;
mod domain_tables;
mod end;
mod experiment;
mod import;
mod kind;
mod learn;
mod learn_model;
mod look;
mod man;
mod merge;
mod options;
mod output;
mod pddl;
mod plan;
mod rank;
mod ranks;
mod record;
mod rename;
mod report;
mod run;
mod table;
mod watch;

use std::error::Error as _;
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use anyhow::Error;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};
use symbolt::files::FileError;
use symbolt::neurons::UnknownMode;
use symbolt::sim::{meant, nearest_first, plain};
use symbolt::spa::VocabError;
use symbolt::task::TaskError;

use end::{BadArgument, Ended, Outcome, code, sentence};

/// Learns symbols from demonstrations of a robot's task and plans with them.
#[derive(Debug, Parser)]
#[command(
    name = "symbolt",
    version,
    disable_help_subcommand = true,
    override_usage = "symbolt [OPTIONS OF run]\n       symbolt <COMMAND> [OPTIONS]",
    after_help = "Without a command, `symbolt` does what `symbolt run` does: it records\n\
                  demonstrations, learns from them, runs an episode, and writes the folder out/.\n\
                  `symbolt COMMAND --help` lists the options of a command and their defaults."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// Makes the enum of all commands, and the call of the chosen one.
macro_rules! commands {
    ($($(#[$help:meta])* $name:ident($args:path) => $run:expr,)*) => {
        #[derive(Debug, Subcommand)]
        enum Command {
            $(
                #[command(next_line_help = true, allow_negative_numbers = true)]
                $(#[$help])*
                $name($args),
            )*
        }

        fn dispatch(cli: Cli) -> Result<Outcome, Error> {
            match cli.command {
                $(Command::$name(args) => ($run)(&args),)*
            }
        }
    };
}

// A new command is a file of its own, with its arguments, and a line here, in the order of `--help`.
commands! {
    /// Record demonstrations, learn from them, run episodes (default)
    Run(run::RunArgs) => run::run,
    /// Do what run does, live in a browser: watch, stop, go back, change
    View(run::ViewArgs) => run::view,
    /// Record demonstrations or a single scene, with or without physics
    Record(record::RecordArgs) => record::record,
    /// Make a recording from logs of poses
    Import(import::ImportArgs) => import::import,
    /// Learn states and actions from a recording
    Learn(learn::LearnArgs) => learn::learn,
    /// Print the state of every object in a recording or scene
    Classify(classify::ClassifyArgs) => classify::classify,
    /// Print the next action in a scene, the plan, and the decision time
    Plan(plan::PlanArgs) => plan::plan,
    /// Print every action that is possible in a scene
    Actions(actions::ActionsArgs) => actions::actions,
    /// Write a learned domain and a scene as PDDL
    Pddl(pddl::PddlArgs) => pddl::pddl,
    /// Learn an action model in PDDL from state-action trajectories
    LearnModel(learn_model::LearnModelArgs) => learn_model::learn_model,
    /// Rename states and actions in place, or to a new file with --out
    Rename(rename::RenameArgs) => rename::rename,
    /// Check a recording, scene, scene settings, domain or model file
    Check(check::CheckArgs) => check::check,
    /// Measure the speed and quality of a standard network of neurons
    Bench(bench::BenchArgs) => bench::bench,
    /// Write an HTML page about a run or experiments
    Report(report::ReportArgs) => report::make,
    /// Run or resume an experiment and print its table
    Experiment(experiment::ExperimentArgs) => experiment::experiment,
    /// Merge the shards of an experiment
    Merge(merge::MergeArgs) => merge::merge,
    /// Print the default settings of a task, for use with --config
    Config(config::ConfigArgs) => config::config,
    /// Print a completion script for a shell
    #[command(next_line_help = false, allow_negative_numbers = false)]
    Completions(completions::CompletionsArgs) => |args| completions::completions(args, Cli::command()),
    /// Print a manual page, for use with man
    #[command(next_line_help = false, allow_negative_numbers = false)]
    Man(man::ManArgs) => |args| man::man(args, Cli::command()),
}

/// Runs the command line. Returns 0 on success, 1 if the command failed, 2 for bad usage or input.
pub(crate) fn main() -> ExitCode {
    let args = with_command(std::env::args_os());
    let command = args.get(1).map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    ranks::together(&command, || match Cli::try_parse_from(&args).map(dispatch) {
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
        Err(usage) if usage.use_stderr() => {
            let sentence = of_usage(&usage, &command);
            if rank::leads() {
                tell_as_json(&args, &sentence);
            }
            Ended { code: 2, sentence: Some(sentence) }
        }
        Err(help) => {
            if rank::leads() {
                // If standard output is closed, nobody reads it.
                let _ = help.print();
            }
            Ended { code: 0, sentence: None }
        }
    })
}

/// Prints the object that `symbolt plan --json` owes for a problem in PDDL, though its arguments could not be read.
fn tell_as_json(args: &[OsString], fault: &str) {
    let given = |option: &str| args.iter().any(|arg| arg.to_string_lossy().starts_with(option));
    if args.get(1).is_none_or(|name| name != "plan") || !given("--json") || given("--scene") {
        return;
    }
    if let Ok(Cli { command: Command::Plan(stand_in) }) =
        Cli::try_parse_from(["symbolt", "plan", "domain", "problem", "--json"])
    {
        // If standard output is closed, nobody reads it.
        let _ = output::emit(plan::unread(&stand_in, fault));
    }
}

/// Returns a sentence about wrong usage.
fn of_usage(usage: &clap::Error, command: &str) -> String {
    let mut program = Cli::command();
    let known = program.find_subcommand(command).is_some();
    let help = match known {
        true => format!("`symbolt {command} --help` lists the options"),
        false => "`symbolt --help` describes them".into(),
    };
    if !known && usage.kind() == ErrorKind::InvalidSubcommand {
        return format!("{}; {help}", unknown(command, &mut program));
    }
    if let Some(argument) = of_value(usage) {
        return argument.to_string();
    }
    let text = usage.to_string();
    let lines = text.trim_start_matches("error: ").lines().map(str::trim);
    let own = lines.take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more"));
    let mut sentence = String::new();
    // An option that does not exist is no value that begins with a dash.
    for line in own.filter(|line| !line.is_empty() && !line.starts_with("tip: to pass")) {
        let gap = match (sentence.is_empty(), sentence.ends_with(':'), line.starts_with('[')) {
            (true, ..) => "",
            (_, true, _) | (_, _, true) => " ",
            _ => "; ",
        };
        sentence = sentence + gap + line;
    }
    format!("{sentence}; {help}")
}

/// Returns the sentence that a value is not what its option must have.
fn of_value(usage: &clap::Error) -> Option<BadArgument> {
    let text = |kind| match usage.get(kind) {
        Some(ContextValue::String(text)) => Some(text),
        _ => None,
    };
    let [argument, value] = [text(ContextKind::InvalidArg)?, text(ContextKind::InvalidValue)?];
    let why = usage.source()?.to_string();
    let option = argument.split_once(" <").map_or(argument.as_str(), |(option, _)| option);
    Some(BadArgument::range(option, plain(value), why.strip_prefix("must be ")?))
}

/// Returns the sentence that no command has this name, with those that there are.
fn unknown(command: &str, program: &mut clap::Command) -> String {
    program.build();
    let names = || program.get_subcommands().map(clap::Command::get_name);
    let (meant, names) = (meant(command, names()), nearest_first(command, names()));
    format!("unrecognized command '{command}'{meant}; the commands are: {names}")
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
