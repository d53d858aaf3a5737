//! `symbolt experiment` and `symbolt merge`: run experiments and print their tables.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Error;
use indicatif::{ProgressBar, ProgressStyle};
use symbolt::files::Overwrite;
use symbolt::sim::Seed;
use symbolt::study::catalogue::{all, find};
use symbolt::study::experiment::{Results, Run, Shard};
use symbolt::study::statistics::Statistic;
use symbolt::task::event::{Event, Observer};

use super::Outcome;
use super::args::{BadArgument, Common, ExperimentArgs, MergeArgs};
use super::output::{Grid, emit, emit_json, use_threads};

pub(crate) fn experiment(args: &ExperimentArgs) -> Result<Outcome, Error> {
    let Some(name) = &args.name else {
        let mut grid = Grid::new(&["experiment", "asks"]);
        for (name, question) in all() {
            grid.row([name.to_owned(), question.to_owned()]);
        }
        emit(&grid.to_string())?;
        return Ok(Outcome::Done);
    };
    use_threads(&args.common)?;
    let experiment = find(name, &args.trials.options(&args.common))?;
    let shard: Shard = args.shard.as_deref().map_or(Ok(Shard::default()), str::parse)?;
    let folder = args.out.clone().unwrap_or_else(|| {
        let part = if shard.of > 1 {
            format!("-{}-of-{}", shard.index + 1, shard.of)
        } else {
            String::new()
        };
        PathBuf::from("experiments").join(format!("{name}{part}"))
    });
    let run = Run::new(&*experiment, Seed::new(args.common.seed), shard, &folder)
        .salvaging(args.salvage)
        .restarting(args.force);
    let mut bar = Bar::new(&args.common, run.trials());
    let results = run.go(&mut bar)?;
    drop(bar);
    match results {
        Some(results) => show(&args.common, &results)?,
        None if args.common.json => emit_json(&[serde_json::json!({
            "name": name, "shard": [shard.index + 1, shard.of], "trials": run.trials(),
            "folder": folder,
        })])?,
        None => emit(&format!(
            "{} trials of shard {}/{} are in {}; `symbolt merge` merges the shards",
            run.trials(),
            shard.index + 1,
            shard.of,
            folder.display()
        ))?,
    }
    Ok(Outcome::Done)
}

pub(crate) fn merged(args: &MergeArgs) -> Result<Outcome, Error> {
    let experiment = find(&args.name, &args.trials.options(&args.common))?;
    if args.folders.is_empty() {
        return Err(BadArgument("merge needs the folders of the shards".into()).into());
    }
    let overwrite = if args.force { Overwrite::Allowed } else { Overwrite::Never };
    let seed = Seed::new(args.common.seed);
    let run = Run::new(&*experiment, seed, Shard::default(), &args.out);
    let results = run.merge(&args.folders, overwrite, &mut Bar::new(&args.common, 0))?;
    show(&args.common, &results)?;
    Ok(Outcome::Done)
}

fn show(common: &Common, results: &Results) -> Result<(), Error> {
    if common.json {
        return emit_json(&[results.to_json()]);
    }
    let columns = results.columns();
    let heads: Vec<&str> =
        columns.iter().copied().chain([">value", ">95% interval", ">SD", ">trials"]).collect();
    let mut grid = Grid::new(&heads);
    for row in &results.rows {
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
        let end = [value, interval, sd, trials];
        grid.row(columns.iter().map(setting).chain(end));
    }
    emit(&format!("{}\n\n{grid}", results.question))
}

/// Progress with the time left: a bar on a terminal, a line every 10 seconds elsewhere.
struct Bar {
    bar: Option<ProgressBar>,
    lines: Option<Lines>,
    total: u64,
}

/// The start of timing with the number of trials done by then, and the time of the last line.
struct Lines {
    begun: Option<(Instant, u64)>,
    last: Instant,
}

/// The time between two lines.
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

    /// Tells of a warning, whether or not progress is wanted.
    fn warn(&self, warning: &str) {
        let text = format!("symbolt: warning: {warning}");
        match &self.bar {
            Some(bar) => bar.println(text),
            // If standard error is gone there is nobody to tell.
            None => drop(writeln!(std::io::stderr(), "{text}")),
        }
    }

    fn at(&mut self, done: u64) {
        if let Some(bar) = &self.bar {
            if bar.position() == 0 {
                // Trials of an earlier run must not count towards the speed of this one.
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
                "{done} of {} trials, about {left:.0} s left",
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
