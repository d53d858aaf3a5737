//! `symbolt bench --compare FILE`: this program against an earlier result or another program.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Error, bail};
use serde_json::{Value, json};
use symbolt::files::Limit;
use symbolt::sim::few;
use symbolt::study::statistics::{Mean, Ratio};

use super::BenchArgs;
use super::figures::{Figures, shown};
use crate::cli::end::{BadArgument, Outcome};
use crate::cli::kind::{BENCHED, Given, Kind, beginning, parsed};
use crate::cli::output::{Progress, answer, warn};
use crate::cli::rank;
use crate::cli::table::{Grid, counted};

/// Differences of less than a hundredth are no verdict: the same program, laid out otherwise in memory, differs by as much.
const SMALL: f64 = 1.01;

/// A machine that computes faster or slower by this factor is taken for another.
const OTHER_MACHINE: f64 = 1.15;

/// Compares with an earlier result or another program. `measure` measures this one.
pub(super) fn compare(
    args: &BenchArgs,
    other: &Path,
    progress: Progress,
    measure: impl FnOnce(&Progress) -> Result<Figures, Error>,
) -> Result<Outcome, Error> {
    if rank::own().is_some() {
        bail!(BadArgument(
            "--compare: compares one process with one; start it without mpirun".into()
        ));
    }
    let program = other.as_os_str() != "-"
        && beginning(other).is_some_and(|start| Kind::of(&start).kind.is_program());
    let comparison = if program {
        let least = Ratio::LEAST_PAIRS;
        if args.runs() < least {
            let expected =
                format!("{least} to 1000 with --compare PROGRAM, for an interval of 95%");
            bail!(BadArgument::range("--runs", args.runs(), &expected));
        }
        in_turn(args, other, &progress)?
    } else {
        let earlier = earlier(args, other)?;
        against(measure(&progress)?, earlier)
    };
    drop(progress);
    let sentence = comparison.sentence();
    answer(
        &args.common,
        || comparison.to_json(other, &sentence),
        || format!("{}\n{sentence}", comparison.table()),
    )?;
    match comparison.is_worse() {
        true => {
            Ok(Outcome::Failed(format!("{} against {}: {sentence}", args.model(), other.display())))
        }
        false => Ok(Outcome::Done),
    }
}

/// Two programs, or one program at two times.
struct Comparison {
    own: Figures,
    other: Figures,
    run: Ratio,
    /// Only of two programs: a result knows of one build.
    build: Option<Ratio>,
}

/// Reads an earlier result, and refuses one that cannot be compared.
fn earlier(args: &BenchArgs, path: &Path) -> Result<Figures, Error> {
    let given = Given { path, takes: &[BENCHED] };
    let read = parsed(given, Limit::SETTINGS, &[], |bytes, name| {
        serde_json::from_slice::<Figures>(bytes).map_err(|error| {
            BadArgument(format!("{name} is no whole result of `bench --json`: {error}"))
        })
    })?;
    let name = path.display();
    if let Some(fault) = read.fault() {
        bail!(BadArgument(format!("{name} is no result of `bench --json`: {fault}")));
    }
    let own = json!({
        "model": args.model(), "mode": args.mode, "dimensions": args.dimensions,
        "neurons_scale": args.neurons_scale, "sim_s": (args.sim_seconds * 1e3).round() / 1e3,
        "seed": args.common.seed, "unbinding": args.unbinding(), "choice": args.choice(),
        "threads": rayon::current_num_threads(), "ranks": 1,
        "machine": symbolt::study::standard::machine(),
    });
    let its = read.to_json();
    for (key, own) in own.as_object().into_iter().flatten() {
        match its.get(key) {
            Some(Value::Null) | None => bail!(BadArgument(format!(
                "{name} comes from an earlier symbolt, which does not tell `{key}`; compare with that program instead"
            ))),
            Some(its) if its != own => bail!(BadArgument(format!(
                "{name} cannot be compared: its `{key}` is {}, here it is {}",
                few([its.to_string()]),
                few([own.to_string()])
            ))),
            _ => {}
        }
    }
    let [own, its] = [args.runs(), read.wall_per_sim_s_of_runs.len()];
    if Ratio::of_groups(&vec![1.0; own], &vec![1.0; its]).interval95[0] == 0.0 {
        bail!(BadArgument(format!(
            "{name} has the times of {its} runs, and --runs is {own}: too few for an interval of 95%; expected 4 of each"
        )));
    }
    Ok(read)
}

/// Compares with an earlier result.
fn against(own: Figures, other: Figures) -> Comparison {
    let run = Ratio::of_groups(&own.wall_per_sim_s_of_runs, &other.wall_per_sim_s_of_runs);
    let speed = |figures: &Figures| figures.limit.as_ref().map(|limit| limit.gop_per_s);
    if let (Some(now), Some(then)) = (speed(&own), speed(&other))
        && !(1.0 / OTHER_MACHINE..OTHER_MACHINE).contains(&(now / then))
    {
        warn(&format!(
            "the machine itself does {now:.1} x 10^9 operations/s now and did {then:.1} then, so times differ for that \
             reason too; comparing with a program, in turn, is surer"
        ));
    }
    Comparison { own, other, run, build: None }
}

/// Runs two programs in turn. Each run is a process of its own.
fn in_turn(args: &BenchArgs, other: &Path, progress: &Progress) -> Result<Comparison, Error> {
    let own = std::env::current_exe().context("cannot find the program itself")?;
    let other = other.canonicalize().context("cannot find the other program")?;
    let name = other.display();
    let said = Command::new(&other).arg("--version").stdin(Stdio::null()).output();
    let said = said.with_context(|| BadArgument(format!("cannot start {name}")))?;
    if !said.stdout.starts_with(b"symbolt ") {
        bail!(BadArgument(format!("{name} is a program, but not symbolt")));
    }
    let (mut all, count) = ([Vec::new(), Vec::new()], args.runs());
    for pair in 0..count {
        progress.say(format!("pair {} of {count}", pair + 1));
        // Neither is always the first.
        for side in [pair % 2, 1 - pair % 2] {
            all[side].push(run(args, [&own, &other][side])?);
        }
    }
    let pairs = |of: fn(&Figures) -> f64| -> Vec<[f64; 2]> {
        all[0].iter().zip(&all[1]).map(|(own, other)| [of(own), of(other)]).collect()
    };
    let run = Ratio::of_pairs(&pairs(|figures| figures.wall_per_sim_s));
    let build = Ratio::of_pairs(&pairs(|figures| figures.build_s));
    let [own, other] = all.map(medians);
    match (own, other) {
        (Some(own), Some(other)) => Ok(Comparison { own, other, run, build: Some(build) }),
        _ => bail!("no program was run"),
    }
}

/// Returns the figures of some runs: the medians of their times, and the rest of the first.
fn medians(runs: Vec<Figures>) -> Option<Figures> {
    let median = |of: fn(&Figures) -> f64| Mean::of(runs.iter().map(of)).quantiles[1];
    let times = [median(|run| run.wall_per_sim_s), median(|run| run.build_s)];
    let [wall_per_sim_s, build_s] = times;
    runs.into_iter().next().map(|first| Figures { wall_per_sim_s, build_s, ..first })
}

/// Measures one run of a program.
fn run(args: &BenchArgs, program: &Path) -> Result<Figures, Error> {
    let mut command = Command::new(program);
    command.args(["bench", args.model(), "--runs", "1", "--quiet", "--json"]);
    for (option, value) in [
        ("--mode", args.mode.clone()),
        ("--neurons-scale", args.neurons_scale.to_string()),
        ("--dimensions", args.dimensions.to_string()),
        ("--sim-seconds", args.sim_seconds.to_string()),
        ("--seed", args.common.seed.to_string()),
        ("--threads", args.common.threads.to_string()),
    ] {
        command.args([option, &value]);
    }
    for (option, value) in [("--unbinding", &args.unbinding), ("--choice", &args.choice)] {
        if let Some(value) = value {
            command.args([option, value]);
        }
    }
    let name = program.display();
    let output = command.stdin(Stdio::null()).output();
    let output = output.with_context(|| format!("cannot start {name}"))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said.lines().last().unwrap_or("it says nothing");
        bail!(BadArgument(format!("{name} could not measure the network: {last}")));
    }
    let other = || {
        BadArgument(format!("{name} is another symbolt: its `bench --json` prints other figures"))
    };
    let figures: Figures = serde_json::from_slice(&output.stdout).with_context(other)?;
    match figures.fault() {
        Some(fault) => Err(Error::msg(fault).context(other())),
        None => Ok(figures),
    }
}

/// What a ratio of times says.
#[derive(Clone, Copy, PartialEq)]
enum Verdict {
    Slower,
    Faster,
    Alike,
}

fn verdict(ratio: &Ratio) -> Verdict {
    match ratio.interval95 {
        [low, _] if low > SMALL => Verdict::Slower,
        [_, high] if high < 1.0 / SMALL => Verdict::Faster,
        _ => Verdict::Alike,
    }
}

/// Says in words what a ratio of times says.
fn in_words(ratio: &Ratio) -> String {
    let percent = |ratio: f64| 100.0 * (ratio - 1.0).abs();
    let [low, high] = ratio.interval95;
    let range = |from: f64, to: f64| match (format!("{from:.0}"), format!("{to:.0}")) {
        (from, to) if from == to => format!("{to}%"),
        (from, to) => format!("{from} to {to}%"),
    };
    match verdict(ratio) {
        Verdict::Slower => format!("slower by {}", range(percent(low), percent(high))),
        Verdict::Faster => format!("faster by {}", range(percent(high), percent(low))),
        Verdict::Alike => {
            let (low, high) = (100.0 * (low - 1.0), 100.0 * (high - 1.0));
            format!("no difference seen ({low:+.0} to {high:+.0}% of time)")
        }
    }
}

impl Comparison {
    /// The figures of quality of this program that differ, with their values here and there.
    fn differ(&self) -> Vec<(&str, [&Value; 2])> {
        const NONE: &Value = &Value::Null;
        let (own, other) = (&self.own.quality, &self.other.quality);
        let all =
            own.iter().map(|(name, own)| (name.as_str(), [own, other.get(name).unwrap_or(NONE)]));
        all.filter(|(_, [own, other])| own != other).collect()
    }

    /// The number of figures of quality that only the other has.
    fn unknown(&self) -> usize {
        self.other.quality.keys().filter(|name| !self.own.quality.contains_key(*name)).count()
    }

    /// Whether the outputs have the same bits; `None` if the other does not say.
    fn same_bits(&self) -> Option<bool> {
        self.own.bits.as_ref().zip(self.other.bits.as_ref()).map(|(own, other)| own == other)
    }

    fn is_worse(&self) -> bool {
        let slower = |ratio: &Ratio| verdict(ratio) == Verdict::Slower;
        let results =
            self.same_bits() == Some(false) || !self.differ().is_empty() || self.unknown() > 0;
        slower(&self.run) || self.build.as_ref().is_some_and(slower) || results
    }

    fn sentence(&self) -> String {
        let mut sentence = format!("run: {}", in_words(&self.run));
        if let Some(build) = &self.build {
            sentence += &format!("; build: {}", in_words(build));
        }
        let mut names: Vec<String> =
            self.differ().into_iter().map(|(name, _)| name.to_owned()).collect();
        // What only the other names is not repeated: its names may be anything.
        let unknown = self.unknown();
        names.extend((unknown > 0).then(|| counted(unknown, "unknown figure")));
        sentence += &match (names.is_empty(), self.same_bits()) {
            (false, _) => format!("; results: other {}", names.join(", ")),
            (_, Some(true)) => "; results: the same bits".into(),
            (_, Some(false)) => "; results: other bits, the same figures".into(),
            (_, None) => "; results: the same figures".into(),
        };
        sentence
    }

    fn table(&self) -> Grid {
        let title = format!("{} in {}", self.own.model, self.own.mode);
        let mut grid = Grid::new(&[&title, ">this", ">other", ">ratio", ">95% interval"]);
        let mut timed = |name: &str, times: [f64; 2], ratio: Option<&Ratio>| {
            let [own, other] = times.map(|time| format!("{time:.4}"));
            let ratio = ratio.map_or_else(Default::default, |ratio| {
                let [low, high] = ratio.interval95;
                [format!("{:.3}", ratio.median), format!("{low:.3} to {high:.3}")]
            });
            grid.row([name.to_owned(), own, other].into_iter().chain(ratio));
        };
        let sides = |of: fn(&Figures) -> f64| [of(&self.own), of(&self.other)];
        let runs = sides(|figures| figures.wall_per_sim_s);
        timed("s per simulated second", runs, Some(&self.run));
        timed("build time, s", sides(|figures| figures.build_s), self.build.as_ref());
        for (name, value) in &self.own.quality {
            let other = self.other.quality.get(name).unwrap_or(&Value::Null);
            let none = String::new();
            grid.row([
                name.replace('_', " "),
                shown(value, 4),
                shown(other, 4),
                none.clone(),
                none,
            ]);
        }
        grid
    }

    fn to_json(&self, other: &Path, sentence: &str) -> Value {
        let timed = |ratio: &Ratio, of: fn(&Figures) -> f64| {
            let verdict = match verdict(ratio) {
                Verdict::Slower => "slower",
                Verdict::Faster => "faster",
                Verdict::Alike => "alike",
            };
            json!({
                "this_s": of(&self.own), "other_s": of(&self.other), "ratio": ratio.median,
                "interval95": ratio.interval95, "verdict": verdict,
            })
        };
        let differ = self.differ().into_iter();
        let differ =
            differ.map(|(name, [own, other])| json!({"name": name, "this": own, "other": other}));
        json!({
            "model": self.own.model, "mode": self.own.mode, "other": other, "sentence": sentence,
            "run": timed(&self.run, |figures| figures.wall_per_sim_s),
            "build": self.build.as_ref().map(|build| timed(build, |figures| figures.build_s)),
            "same_bits": self.same_bits(), "quality_differs": differ.collect::<Vec<_>>(),
            "worse": self.is_worse(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_name_the_interval() {
        let ratio = |low, high| Ratio { median: (low + high) / 2.0, interval95: [low, high] };
        for (low, high, expected) in [
            (1.04, 1.09, "slower by 4 to 9%"),
            (0.9, 0.95, "faster by 5 to 10%"),
            (0.98, 1.03, "no difference seen (-2 to +3% of time)"),
            (1.002, 1.004, "no difference seen (+0 to +0% of time)"),
            (2.0, 2.001, "slower by 100%"),
        ] {
            assert_eq!(in_words(&ratio(low, high)), expected);
        }
    }
}
