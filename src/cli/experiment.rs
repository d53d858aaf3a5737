//! `symbolt experiment` and `symbolt merge`: run experiments and print their tables.

use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Error;
use clap::Args;
use clap::parser::ValueSource;
use indicatif::{ProgressBar, ProgressStyle};
use symbolt::files::{FileError, Overwrite, ResultFolder};
use symbolt::sim::Seed;
use symbolt::study::catalogue::{Options, TAKES_RECORDING, all, find};
use symbolt::study::experiment::{Origin, Plan, Results, Row, Run, Shard, ShardChoice, Status};
use symbolt::study::statistics::{FEW_TRIALS, Statistic};
use symbolt::task::event::{Event, Observer};

use super::end::{BadArgument, Outcome};
use super::folder::not_standard_output;
use super::missing::described;
use super::options::{Common, whole};
use super::output::{Grid, emit, emit_json, use_threads, wrapped};

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
#[command(next_line_help = true, allow_negative_numbers = true)]
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

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
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

pub(crate) fn experiment(args: &ExperimentArgs) -> Result<Outcome, Error> {
    let Some(name) = &args.name else {
        emit(&list())?;
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
        .salvaging(args.salvage)
        .restarting(args.force);
    let mut bar = Bar::new(&args.common, run.trials());
    let results = run.go(&mut bar)?;
    drop(bar);
    match results {
        Some(results) => show(&args.common, &results)?,
        None if args.common.json => emit_json(&[serde_json::json!({
            "name": name, "shard": [shard.index + 1, shard.of], "trials": run.trials(),
            "folder": path,
        })])?,
        None => emit(&format!(
            "{} trials of shard {}/{} are in {}. `symbolt merge` merges the shards.",
            run.trials(),
            shard.index + 1,
            shard.of,
            path
        ))?,
    }
    Ok(Outcome::Done)
}

/// Returns the shard of the command line. One that the environment names is printed.
fn chosen(args: &ExperimentArgs) -> Result<Shard, Error> {
    let Some(text) = &args.shard else { return Ok(Shard::default()) };
    let choice: ShardChoice = text.parse()?;
    let lossy = |text: OsString| text.to_string_lossy().into_owned();
    let variables = std::env::vars_os().map(|(name, value)| (lossy(name), lossy(value))).collect();
    let (shard, launcher) = choice.resolve(&variables)?;
    if let (Some(launcher), false) = (launcher, args.common.quiet) {
        let name = launcher.variable();
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

pub(crate) fn merged(args: &MergeArgs) -> Result<Outcome, Error> {
    let Some(first) = args.folders.first() else {
        return Err(BadArgument(
            "no folder is given; `symbolt merge` needs the folders of the shards".into(),
        )
        .into());
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
    if origin.settings.get("recording").is_none_or(serde_json::Value::is_null) {
        // The shards used no recording, so a recording that this machine has is not used either.
        options.recording = args.trials.recording.clone();
    }
    not_standard_output(out)?;
    find(&args.name, &Options { recording: None, ..options.clone() })?;
    args.trials.recording_is_used(&args.name)?;
    let folder = ResultFolder::open(out)?;
    let experiment = find(&args.name, &options)?;
    let overwrite = if args.force { Overwrite::Allowed } else { Overwrite::Never };
    let run = Run::new(&*experiment, Seed::new(common.seed), Shard::default(), folder);
    let results = run.merge(&args.folders, overwrite, &mut Bar::new(&common, 0))?;
    show(&common, &results)?;
    Ok(Outcome::Done)
}

/// Lists the trials that a merge would miss. Fails if there are any.
fn status(args: &MergeArgs) -> Result<Outcome, Error> {
    let (name, common) = (&args.name, &args.common);
    let options = args.trials.options(common)?;
    let plan = || {
        let cells = find(name, &options)?.cells();
        Ok(Plan { seed: Seed::new(common.seed), cells })
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
            return Err(BadArgument::range(option, given, &expected).into());
        }
    }
    match common.json {
        true => emit_json(&[status.to_json()])?,
        false => emit(&described(&status))?,
    }
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

fn show(common: &Common, results: &Results) -> Result<(), Error> {
    if common.json {
        return emit_json(&[results.to_json()]);
    }
    emit(&format!("{}\n\n{}", wrapped(results.question, 0), tables(results)))
}

/// The headings of the columns that every experiment has.
const STATISTICS: [&str; 4] = [">value", ">95% interval", ">SD", ">trials"];

/// Returns the table of an experiment. If the terminal is too narrow for it, the settings on its left become headings
/// of several narrower tables.
fn tables(results: &Results) -> String {
    let columns = results.columns();
    let few = results.rows.iter().filter(|row| row.statistic.is_of_few_trials()).count();
    let mark = few > 0 && few < results.rows.len();
    let rows: Vec<Vec<String>> =
        results.rows.iter().map(|row| cells(row, &columns, mark)).collect();
    let heads: Vec<&str> = columns.iter().copied().chain(STATISTICS).collect();
    let table = |rows: &[Vec<String>], from: usize| {
        let mut grid = Grid::new(&heads[from..]);
        rows.iter().for_each(|row| grid.row(row[from..].iter().cloned()));
        grid
    };
    let most = columns.len().saturating_sub(1);
    let cut = (0..most).find(|from| table(&rows, *from).fits()).unwrap_or(most);
    let mut text = String::new();
    for group in rows.chunk_by(|a, b| a[..cut] == b[..cut]) {
        if cut > 0 {
            let settings = columns.iter().zip(&group[0][..cut]).filter(|(_, v)| !v.is_empty());
            let settings: Vec<String> = settings.map(|(name, v)| format!("{name} = {v}")).collect();
            let gap = if text.is_empty() { "" } else { "\n" };
            text += &format!("{gap}{}\n\n", wrapped(&settings.join(", "), 0));
        }
        text += &table(group, cut).to_string();
    }
    if few > 0 {
        let which = if mark { "* Intervals from" } else { "All intervals are from" };
        let warning = format!(
            "{which} fewer than {FEW_TRIALS} independent trials. Take them as a rough guide: so few trials hardly \
             show how much the results vary."
        );
        text += &format!("\n{}\n", wrapped(&warning, 0));
    }
    text
}

/// Returns the cells of a row: its settings, then its statistic. With `mark`, an asterisk marks few trials.
fn cells(row: &Row, columns: &[&str], mark: bool) -> Vec<String> {
    let setting = |key: &&str| match row.settings.get(*key) {
        Some(serde_json::Value::String(text)) => text.clone(),
        Some(value) => value.to_string(),
        None => String::new(),
    };
    let [low, high] = row.statistic.interval95();
    let (value, interval) = match row.statistic {
        Statistic::Rate(rate) => (
            format!("{:.2} %", 100.0 * rate.share()),
            format!("{:.2} to {:.2}", 100.0 * low, 100.0 * high),
        ),
        Statistic::Mean(mean) => {
            let known = mean.half95.is_finite();
            let interval = || format!("{low:.4} to {high:.4}");
            (format!("{:.4}", mean.mean), if known { interval() } else { "-".into() })
        }
    };
    let sd = row.statistic.sd().filter(|sd| sd.is_finite());
    let sd = sd.map_or_else(String::new, |sd| format!("{sd:.4}"));
    let all = row.statistic.trials();
    // Correlated trials count as fewer.
    let trials = match row.statistic.effective_trials() {
        Some(effective) if effective < 0.95 => format!("{all} (as less than 1)"),
        Some(effective) if effective.round() < all as f64 => {
            format!("{all} (as {effective:.0})")
        }
        _ => all.to_string(),
    };
    let few = if mark && row.statistic.is_of_few_trials() { " *" } else { "" };
    let end = [value, interval, sd, format!("{trials}{few}")];
    columns.iter().map(setting).chain(end).collect()
}

/// Shows progress and the remaining time: a bar on a terminal, a line every 10 seconds elsewhere.
struct Bar {
    bar: Option<ProgressBar>,
    lines: Option<Lines>,
    total: u64,
}

/// State of the progress lines.
struct Lines {
    /// Time at which timing began, and number of trials that were already done.
    begun: Option<(Instant, u64)>,
    /// Time at which the last line was printed.
    last: Instant,
}

/// Time between two progress lines.
const EVERY: Duration = Duration::from_secs(10);

impl Bar {
    fn new(common: &Common, total: u64) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = (terminal && !common.quiet).then(|| {
            let bar = ProgressBar::new(total);
            let template = "{wide_bar} {pos} of {len} trials, {eta} left";
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar
        });
        let lines =
            (!terminal && !common.quiet).then(|| Lines { begun: None, last: Instant::now() });
        Self { bar, lines, total }
    }

    /// Prints a warning, even with `--quiet`.
    fn warn(&self, warning: &str) {
        let text = format!("symbolt: warning: {warning}");
        match &self.bar {
            Some(bar) => bar.println(text),
            // Nothing can be done if standard error is closed.
            None => drop(writeln!(std::io::stderr(), "{text}")),
        }
    }

    fn at(&mut self, done: u64) {
        if let Some(bar) = &self.bar {
            if bar.position() == 0 {
                // Trials of an earlier run must not count towards the speed of this run.
                bar.set_position(done);
                bar.reset_eta();
            }
            bar.set_position(done);
        }
        let Some(lines) = &mut self.lines else { return };
        let (begun, before) = *lines.begun.get_or_insert_with(|| (Instant::now(), done));
        if lines.last.elapsed() >= EVERY {
            let spent = begun.elapsed().as_secs_f64();
            let left =
                spent * (self.total - done) as f64 / done.saturating_sub(before).max(1) as f64;
            let _ = writeln!(
                std::io::stderr(),
                "{done} of {} trials done, about {left:.0} s left",
                self.total
            );
            lines.last = Instant::now();
        }
    }
}

impl Observer for Bar {
    fn observe(&mut self, event: &Event<'_>) {
        match event {
            Event::Trials { done, .. } => self.at(*done),
            Event::Warned(warning) => self.warn(warning),
            _ => {}
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use symbolt::study::statistics::{Mean, Rate};

    use super::*;

    #[test]
    fn rows_of_few_trials_are_marked_and_words_are_kept_whole() {
        let row = |what: &str, statistic| {
            let settings = json!({"a_long_name_of_a_setting": 0.25, "what": what});
            Row { settings: settings.as_object().cloned().unwrap_or_default(), statistic }
        };
        let long = "share of pairs within below those between and_a_word_of_20_char";
        let rows = vec![
            row(long, Statistic::Rate(Rate::new(3, 4))),
            row("mean", Statistic::Mean(Mean::of((0..12).map(f64::from)))),
        ];
        let results = Results { name: "a", question: "b?", settings: json!({}), rows };
        let text = tables(&results);
        assert!(text.starts_with("a_long_name_of_a_setting = 0.25\n\n| what"), "{text}");
        assert!(text.contains("4 * |") && text.contains(" 12 |"), "{text}");
        assert!(text.contains("\n* Intervals from fewer than 10 independent trials."), "{text}");
        assert!(text.contains("| and_a_word_of_20_char "), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    }
}
