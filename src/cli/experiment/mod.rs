//! `symbolt experiment`: runs an experiment and prints its table.

mod bar;
mod results;

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Error;
use clap::Args;
use serde_json::json;
use symbolt::files::{FileError, ResultFolder};
use symbolt::sim::Seed;
use symbolt::study::catalogue::{Options, TAKES_RECORDING, all, find};
use symbolt::study::experiment::{Run, Shard, ShardChoice};

pub(super) use self::bar::Bar;
pub(super) use self::results::show;
use super::end::{BadArgument, Outcome};
use super::options::{Common, whole};
use super::output::{answer, emit, not_standard_output, use_threads};
use super::table::Grid;

/// Options that shards of an experiment and their merge must agree on.
#[derive(Debug, Clone, Args)]
pub(crate) struct TrialArgs {
    /// Trials of each cell
    /// [default: the experiment's own number; to merge, the shards' number]
    #[arg(verbatim_doc_comment, long, value_name = "N", value_parser = whole::<u64>)]
    pub trials: Option<u64>,
    /// Recording for the experiment `threshold`, beside its own scene
    /// [default: nut_bolt_pybullet.jsonl in $SYMBOLT_RECORDINGS, if found]
    #[arg(verbatim_doc_comment, long, value_name = "FILE")]
    pub recording: Option<PathBuf>,
    /// Folder of PDDL problems for the experiment `ipc`
    #[arg(long, value_name = "FOLDER")]
    pub problems: Option<PathBuf>,
}

impl TrialArgs {
    /// # Errors
    /// For `--problems -`, since elsewhere `-` means standard input.
    pub fn options(&self, common: &Common) -> Result<Options, BadArgument> {
        if self.problems.as_deref().is_some_and(|folder| folder.as_os_str() == "-") {
            let expected = "a folder; for a folder of this name write ./-";
            return Err(BadArgument::range("--problems", "-", expected));
        }
        let known = || {
            let folder = PathBuf::from(std::env::var_os("SYMBOLT_RECORDINGS")?);
            Some(folder.join("nut_bolt_pybullet.jsonl")).filter(|path| path.is_file())
        };
        let (seed, recording) = (Seed::new(common.seed), self.recording.clone().or_else(known));
        Ok(Options { seed, trials: self.trials, recording, problems: self.problems.clone() })
    }

    /// Refuses a recording that is named for an experiment that would not read it.
    ///
    /// # Errors
    /// For `--recording` with any experiment but `threshold`.
    pub fn recording_is_used(&self, experiment: &str) -> Result<(), BadArgument> {
        match &self.recording {
            Some(path) if experiment != TAKES_RECORDING => {
                let expected = "absent; only the experiment `threshold` takes a recording";
                Err(BadArgument::range("--recording", path.display(), expected))
            }
            _ => Ok(()),
        }
    }
}

#[derive(Debug, Clone, Args)]
pub(crate) struct ExperimentArgs {
    /// Experiment to run; without it, experiments are listed
    pub name: Option<String>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub trials: TrialArgs,
    /// Folder of trials and results; an earlier run in it is resumed
    /// [default: experiments/NAME]
    #[arg(verbatim_doc_comment, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Delete the folder's trials and start again
    #[arg(long)]
    pub force: bool,
    /// Keep the intact trials of a damaged journal and run the others again
    #[arg(long, conflicts_with = "force")]
    pub salvage: bool,
    /// Run only one part of the trials, such as 2/4; auto takes the part from
    /// Slurm, Open MPI or HyperQueue, auto/8 takes its number in 8 parts
    #[arg(verbatim_doc_comment, long, value_name = "I/N")]
    pub shard: Option<String>,
}

pub(crate) fn experiment(args: &ExperimentArgs) -> Result<Outcome, Error> {
    let Some(name) = &args.name else {
        emit(list())?;
        return Ok(Outcome::Done);
    };
    use_threads(&args.common)?;
    let shard = chosen(args)?;
    // The name and the number of trials are checked first: with a recording, an experiment reads it and learns from it.
    let options = args.trials.options(&args.common)?;
    find(name, &Options { recording: None, ..options.clone() })?;
    args.trials.recording_is_used(name)?;
    let folder = open(args, name, shard)?;
    let path = folder.path().display().to_string();
    let experiment = find(name, &options)?;
    let run = Run::new(&*experiment, Seed::new(args.common.seed), shard, folder)
        .with_trials(options.trials)
        .salvaging(args.salvage)
        .restarting(args.force);
    let mut bar = Bar::new(&args.common, run.trials());
    let results = run.go(&mut bar)?;
    drop(bar);
    match results {
        Some(results) => show(&args.common, &results),
        None => {
            let (index, of, trials) = (shard.index + 1, shard.of, run.trials());
            let json =
                || json!({"name": name, "shard": [index, of], "trials": trials, "folder": path});
            answer(&args.common, json, || {
                format!(
                    "{trials} trials of shard {index}/{of} are in {path}. `symbolt merge` merges the shards."
                )
            })
        }
    }
}

/// Returns the shard of the command line. One that the environment names is printed.
fn chosen(args: &ExperimentArgs) -> Result<Shard, Error> {
    let Some(text) = &args.shard else { return Ok(Shard::default()) };
    let choice: ShardChoice = text.parse()?;
    let lossy = |text: OsString| text.to_string_lossy().into_owned();
    let variables = std::env::vars_os().map(|(name, value)| (lossy(name), lossy(value))).collect();
    let (shard, variable) = choice.resolve(&variables)?;
    if let (Some(name), false) = (variable, args.common.quiet) {
        let value = variables.get(name).map_or("", String::as_str);
        // Nothing can be done if standard error is closed.
        let _ = writeln!(std::io::stderr(), "shard {shard}, because {name} is {value}");
    }
    Ok(shard)
}

/// The folder of the experiments for which `--out` names no other.
const ROOT: &str = "experiments";

/// Opens the folder of an experiment. If the default folder has to be created, git ignores it.
fn open(args: &ExperimentArgs, name: &str, shard: Shard) -> Result<ResultFolder, Error> {
    if let Some(folder) = &args.out {
        not_standard_output(folder)?;
        return Ok(ResultFolder::open(folder)?);
    }
    let part =
        if shard.of > 1 { format!("-{}-of-{}", shard.index + 1, shard.of) } else { String::new() };
    let root = Path::new(ROOT);
    let folder = root.join(format!("{name}{part}"));
    Ok(ResultFolder::open_if::<FileError>(&folder, Some(root), |_| Ok(()))?)
}

/// Returns the table of all experiments and their questions.
fn list() -> String {
    let mut grid = Grid::new(&["experiment", "question"]);
    for (name, question) in all() {
        grid.row([name.to_owned(), question.to_owned()]);
    }
    grid.to_string()
}
