//! `symbolt merge`: merges the shards of an experiment, or lists what they lack.

mod missing;

use std::path::PathBuf;

use anyhow::{Error, bail};
use clap::Args;
use clap::parser::ValueSource;
use serde_json::Value;
use symbolt::files::ResultFolder;
use symbolt::sim::Seed;
use symbolt::study::catalogue::{Options, find};
use symbolt::study::experiment::{Origin, Plan, Run, Shard, Status};

use self::missing::described;
use super::end::{BadArgument, Outcome};
use super::experiment::{Bar, TrialArgs, show};
use super::options::Common;
use super::output::{answer, not_standard_output, overwrite};

#[derive(Debug, Clone, Args)]
pub(crate) struct MergeArgs {
    /// Experiment
    pub name: String,
    /// Folders of the shards
    pub folders: Vec<PathBuf>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub trials: TrialArgs,
    /// Folder for the merged experiment
    #[arg(long, value_name = "FOLDER", required_unless_present = "status")]
    pub out: Option<PathBuf>,
    /// Replace the trials in that folder
    #[arg(long)]
    pub force: bool,
    /// Merge nothing; list the missing trials of each shard and cell
    #[arg(long, conflicts_with_all = ["out", "force"])]
    pub status: bool,
}

pub(crate) fn merge(args: &MergeArgs) -> Result<Outcome, Error> {
    let Some(first) = args.folders.first() else {
        let problem = "no folder is given; `symbolt merge` needs the folders of the shards";
        bail!(BadArgument(problem.into()));
    };
    if args.status {
        return status(args);
    }
    let out = args.out.as_deref().ok_or_else(|| BadArgument("--out: must be a folder".into()))?;
    let origin = Origin::read(first)?;
    // The settings of the journals are the defaults. An option on the command line must agree with them.
    let mut common = args.common.clone();
    if !was_given("seed") {
        common.seed = origin.seed.value();
    }
    let mut trials = args.trials.clone();
    trials.trials = trials.trials.or(Some(origin.trials));
    let mut options = trials.options(&common)?;
    if origin.settings.get("recording").is_none_or(Value::is_null) {
        // The shards used no recording, so a recording that this machine has is not used either.
        options.recording = args.trials.recording.clone();
    }
    not_standard_output(out)?;
    find(&args.name, &Options { recording: None, ..options.clone() })?;
    args.trials.recording_is_used(&args.name)?;
    let folder = ResultFolder::open(out)?;
    let experiment = find(&args.name, &options)?;
    let run = Run::new(&*experiment, Seed::new(common.seed), Shard::default(), folder)
        .with_trials(options.trials);
    let results = run.merge(&args.folders, overwrite(args.force), &mut Bar::new(&common, 0))?;
    show(&common, &results)
}

/// Lists the trials that a merge would miss. Fails if there are any.
fn status(args: &MergeArgs) -> Result<Outcome, Error> {
    let (name, common) = (&args.name, &args.common);
    let options = args.trials.options(common)?;
    let plan = || {
        let cells = find(name, &options)?.cells();
        Ok(Plan { seed: Seed::new(common.seed), trials: options.trials, cells })
    };
    let status = Status::read(name, &args.folders, plan)?;
    let most = status.cells.iter().map(|cell| cell.trials).max().unwrap_or(0);
    let agree = [
        ("--seed", was_given("seed").then_some(common.seed), status.seed.value()),
        ("--trials", args.trials.trials, most),
    ];
    for (option, given, held) in agree {
        if let Some(given) = given.filter(|given| *given != held) {
            let expected = format!("{held}, as in the folders, or left out");
            bail!(BadArgument::range(option, given, &expected));
        }
    }
    answer(common, || status.to_json(), || described(&status))?;
    let (done, all) = (status.done(), status.trials());
    Ok(match status.is_complete() {
        true => Outcome::Done,
        false if done == all => {
            Outcome::Failed("no trial is missing, but some folders cannot be merged".into())
        }
        false => Outcome::Failed(format!("{} of {all} trials are missing", all - done)),
    })
}

/// Returns whether the command line of `symbolt merge` has this option.
fn was_given(option: &str) -> bool {
    let merge = MergeArgs::augment_args(clap::Command::new("merge"));
    let matches = merge.try_get_matches_from(std::env::args_os().skip(1));
    matches.is_ok_and(|all| all.value_source(option) == Some(ValueSource::CommandLine))
}
