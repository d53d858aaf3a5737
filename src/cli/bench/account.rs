//! `symbolt bench --account`: the speed of everything on one machine, as the page `docs/speed.md` shows it.

use std::hint::black_box;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Error, bail};
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde_json::json;
use symbolt::neurons::Tuning;
use symbolt::sim::{Real, Seed, Threads};
use symbolt::spa::{Algebra, Hrr, ItemMemory, random_pointer};
use symbolt::study::standard::{Limits, Measured, Model, Standard, machine};
use symbolt::study::statistics::Mean;
use symbolt::task::demonstrate;
use symbolt::task::learn::{Settings, learn};
use symbolt::task::planner::{Planner, PlannerSpec};
use symbolt::task::propositional::DomainBuilder;
use symbolt::task::tasks::nuts_and_bolts::{NutsAndBolts, SyntheticDemonstrations};

use super::figures::shown;
use super::{BenchArgs, foretell, scaled};
use crate::cli::end::{BadArgument, Outcome};
use crate::cli::output::{Progress, emit};
use crate::cli::rank;
use crate::cli::table::counted;

/// Measures everything and prints the page.
pub(super) fn account(args: &BenchArgs, progress: &Progress) -> Result<Outcome, Error> {
    if rank::own().is_some() {
        let problem = "--account: measures one process; start it without mpirun";
        bail!(BadArgument(problem.into()));
    }
    let spec = spec(args);
    for (_, model) in Model::ALL {
        foretell(args, &spec, model, progress)?;
    }
    let one = ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut text = format!(
        "Measured on {} by symbolt {} with `symbolt bench --account` on: {}.\n",
        date(),
        env!("CARGO_PKG_VERSION"),
        machine()
    );
    text += &format!(
        "Seconds for {} simulated s in ticks of 1 ms, D = {}, LIF, neuron scale {}, seed {}, medians of {}. `All` is {}.\n\n",
        args.sim_seconds,
        args.dimensions,
        args.neurons_scale,
        args.common.seed,
        counted(args.runs(), "run"),
        counted(rayon::current_num_threads(), "thread"),
    );
    let mut times = Table::new(&[
        "network",
        "neurons",
        "build, one thread",
        "build, all",
        "run, one thread",
        "run, all",
        "quality",
    ]);
    let mut limits = Table::new(&[
        "network, one thread",
        "ns",
        "neurons visited",
        "bytes",
        "operations",
        "least ns",
        "set by",
        "share of the limit",
    ]);
    for (name, model) in Model::ALL {
        progress.say(format!("network {name}"));
        let network = Network::measure(args, &spec, model, &one)?;
        times.row(network.times(name));
        limits.row(network.limits(name));
    }
    text += &format!("{times}\nA neuron and tick of these runs:\n\n{limits}\n");
    text += &format!("Other work, on one thread:\n\n{}", one.install(|| others(progress))?);
    emit(text)?;
    Ok(Outcome::Done)
}

/// Returns the settings of all networks.
fn spec(args: &BenchArgs) -> Standard {
    let (standard, scale) = (Standard::default(), args.neurons_scale);
    Standard {
        dimensions: args.dimensions,
        population: standard.population.tuned(|usual| Tuning { scale, ..usual }),
        sim_ms: (args.sim_seconds * 1e3).round() as u64,
        seed: Seed::new(args.common.seed),
        ..standard
    }
}

/// A network's median runs.
struct Network {
    /// Build times on one thread and on all.
    builds_s: [f64; 2],
    /// Median runs on one thread and on all.
    runs: [Measured; 2],
    limits: Limits,
}

impl Network {
    fn measure(
        args: &BenchArgs,
        spec: &Standard,
        model: Model,
        one: &ThreadPool,
    ) -> Result<Self, Error> {
        let build = || spec.build(model).map_err(|error| scaled(error, args.neurons_scale));
        let first_s = one.install(|| build().map(|built| built.build_s()))?;
        let built = build()?;
        let mut runs = [Vec::new(), Vec::new()];
        for _ in 0..args.runs() {
            for (runs, threads) in runs.iter_mut().zip([Threads::Serial, Threads::Auto]) {
                runs.push(built.run_on(threads)?);
            }
        }
        let runs = runs.map(|mut runs| {
            runs.sort_by(|a, b| a.run_s.total_cmp(&b.run_s));
            runs.swap_remove(runs.len() / 2)
        });
        let limits = Limits::of(&runs[0]);
        Ok(Self { builds_s: [first_s, built.build_s()], runs, limits })
    }

    fn times(&self, name: &str) -> Vec<String> {
        let [one, all] = &self.runs;
        let quality = one.quality.first().map_or_else(String::new, |(name, value)| {
            let digits = if name.ends_with("_ms") { 0 } else { 3 };
            format!("{} {}", name.replace('_', " "), shown(&json!(value), digits))
        });
        let mut cells = vec![format!("`{name}`"), thousands(one.neurons)];
        cells.extend(self.builds_s.map(|s| format!("{s:.2}")));
        cells.extend([one, all].map(|run| format!("{:.3}", run.run_s)));
        cells.push(quality);
        cells
    }

    fn limits(&self, name: &str) -> Vec<String> {
        let [run, _] = &self.runs;
        let each = run.traffic.over(run.neurons as f64);
        let bound = self.limits.bound(run);
        let least = bound.map_or(f64::NAN, |bound| bound.ns_per_neuron_step);
        let by_memory = bound.is_some_and(|bound| bound.by_memory);
        vec![
            format!("`{name}`"),
            format!("{:.2}", run.ns_per_neuron_step),
            format!("{:.0}%", 100.0 * each.visited),
            format!("{:.1}", each.bytes()),
            format!("{:.1}", each.operations),
            format!("{least:.2}"),
            match by_memory {
                true => format!("memory, {:.0} GB/s", self.limits.bytes_per_s / 1e9),
                false => format!("arithmetic, {:.0} x 10^9/s", self.limits.operations_per_s / 1e9),
            },
            format!("{:.0}%", 100.0 * least / run.ns_per_neuron_step),
        ]
    }
}

/// Items of the memory that is queried, and dimensions of their pointers.
const ITEMS: [usize; 2] = [25_000, 1_000];

/// Measures what is not a standard network.
fn others(progress: &Progress) -> Result<Table, Error> {
    let mut table = Table::new(&["work", "time"]);
    progress.say("binding");
    for dim in [256, 512, 1_024] {
        let [a, b] = [1, 2].map(|seed| random_pointer(dim, Seed::new(seed)));
        let (mut out, mut work) = (vec![0.0; dim], Hrr.scratch(dim));
        let took_s = took(|| Hrr.bind_into(black_box(&a), black_box(&b), &mut out, &mut work));
        table.row([format!("bind, D = {dim}"), format!("{:.2} µs", 1e6 * took_s)]);
    }
    progress.say("item memory");
    let [items, dim] = ITEMS;
    let rows: Vec<Real> =
        (0..items).flat_map(|i| random_pointer(dim, Seed::new(i as u64))).collect();
    let query: Vec<Real> = rows[..dim].iter().zip(&rows[dim..]).map(|(a, b)| 0.5 * a + b).collect();
    let memory = ItemMemory::new(rows, dim)?;
    let took_s = took(|| memory.best(black_box(&query)));
    let work = format!("a query among {} items, D = {dim}", thousands(items));
    table.row([work, format!("{:.2} ms", 1e3 * took_s)]);
    drop(memory);
    progress.say("planning");
    let domain = DomainBuilder::of_the_paper().build()?;
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;
    let (scene, goal) =
        (domain.counts(["NUT_ON_TABLE", "BOLT_ON_TABLE"])?, domain.state("BOLT_ASSEMBLED")?);
    let simulated_ms: f64 =
        planner.plan(&scene, goal)?.steps.iter().map(|step| step.decision.time_ms).sum();
    let took_s = took(|| planner.plan(black_box(&scene), goal));
    let work = format!("a plan in exact maths, D = 256, of {simulated_ms} simulated ms");
    table.row([work, format!("{:.2} ms", 1e3 * took_s)]);
    progress.say("learning");
    for demos in [7, 1_000] {
        let shown = SyntheticDemonstrations { demos, ..SyntheticDemonstrations::default() };
        let recording = shown.record(Seed::new(1))?.recording;
        let took_s = took(|| learn(black_box(&recording), &Settings::default()));
        let snapshots = thousands(recording.snapshot_count());
        let work =
            format!("learning from {} demonstrations, {snapshots} snapshots", thousands(demos));
        table.row([work, format!("{:.1} ms", 1e3 * took_s)]);
    }
    progress.say("physics");
    let task = NutsAndBolts { nuts: 3, bolts: 3, ..NutsAndBolts::default() };
    let begun = Instant::now();
    let shown = demonstrate(&task, 1, Seed::new(1))?;
    let took_s = begun.elapsed().as_secs_f64();
    let work = format!(
        "a demonstration in physics, 3 nuts and 3 bolts, of {:.0} simulated s",
        shown.simulated_s
    );
    table.row([work, format!("{took_s:.2} s")]);
    Ok(table)
}

/// Returns the seconds of one call: the median of five rounds of at least 0.1 s each. What takes half a second is called
/// once.
fn took<T>(mut work: impl FnMut() -> T) -> f64 {
    let mut round = || {
        let (begun, mut calls) = (Instant::now(), 0);
        while calls == 0 || begun.elapsed() < Duration::from_millis(100) {
            black_box(work());
            calls += 1;
        }
        begun.elapsed().as_secs_f64() / f64::from(calls)
    };
    let first = round();
    if first > 0.5 {
        return first;
    }
    let rounds = [first, round(), round(), round(), round()];
    Mean::of(rounds.into_iter()).quantiles[1]
}

/// Formats a count with commas: `341,450`.
fn thousands(count: usize) -> String {
    let digits = count.to_string();
    let comma = |at: usize| at > 0 && (digits.len() - at).is_multiple_of(3);
    let digits = digits.chars().enumerate();
    digits.flat_map(|(at, digit)| comma(at).then_some(',').into_iter().chain([digit])).collect()
}

/// Returns the day in UTC, such as `2026-11-27` (Hinnant 2021, "chrono-compatible low-level date algorithms").
fn date() -> String {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    civil(now.as_secs() / 86_400)
}

/// Returns the date of a day after 1970-01-01.
fn civil(day: u64) -> String {
    // Days since 0000-03-01, so that a leap day is the last of its year.
    let day = day + 719_468;
    let (era, of_era) = (day / 146_097, day % 146_097);
    let year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let march = (5 * of_year + 2) / 153;
    let (day, month) =
        (of_year - (153 * march + 2) / 5 + 1, if march < 10 { march + 3 } else { march - 9 });
    format!("{}-{month:02}-{day:02}", era * 400 + year + u64::from(month <= 2))
}

/// A Markdown table as documents have them: its cells are not aligned.
struct Table(String);

impl Table {
    fn new(heads: &[&str]) -> Self {
        let mut table = Self(String::new());
        table.row(heads.iter().map(|head| (*head).to_owned()));
        table.0 += &format!("|{}\n", "---|".repeat(heads.len()));
        table
    }

    fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        let cells: Vec<String> = cells.into_iter().collect();
        self.0 += &format!("| {} |\n", cells.join(" | "));
    }
}

impl std::fmt::Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_have_their_dates() {
        for (day, date) in [(0, "1970-01-01"), (11_016, "2000-02-29"), (20_784, "2026-11-27")] {
            assert_eq!(civil(day), date);
        }
    }

    #[test]
    fn a_quality_that_is_no_number_is_never() {
        assert_eq!([42.4, f64::NAN].map(|value| shown(&json!(value), 0)), ["42", "never"]);
    }

    #[test]
    fn counts_have_commas() {
        assert_eq!([7, 1_000, 2_505_500].map(thousands), ["7", "1,000", "2,505,500"]);
    }
}
