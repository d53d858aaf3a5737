//! `symbolt bench`: the speed and quality of a standard network.

mod account;
mod compare;
mod figures;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Error, bail};
use clap::Args;
use symbolt::files::{Limit, Overwrite, check_output, read_beginning, write_atomic};
use symbolt::neurons::{Population, SelectRule, SolvedFileError, SolvedModel, Tuning};
use symbolt::sim::{Seed, SimDuration, few, meant};
use symbolt::study::standard::{Built, Model, Standard};
use symbolt::task::TaskError;
use symbolt::task::planner::Unbinding;

use super::end::{BadArgument, Outcome};
use super::kind::{Given, Kind, parsed};
use super::options::{Common, number, unused, whole};
use super::output::{Progress, answer, overwrite, use_threads};
use super::{rank, ranks};
use figures::{Figures, MOST_RUNS};

#[derive(Debug, Clone, Args)]
pub(crate) struct BenchArgs {
    /// Network: bind, state, memory, select, channel, planner, large or brain
    #[arg(required_unless_present = "account")]
    pub model: Option<String>,
    #[command(flatten)]
    pub common: Common,
    /// Mode of the layers: direct, rate or lif (spiking)
    #[arg(long, default_value = "lif")]
    pub mode: String,
    /// Factor by which to multiply the neurons of every ensemble
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", value_parser = number::<f64>)]
    pub neurons_scale: f64,
    /// Dimensions of the pointers
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = whole::<usize>)]
    pub dimensions: usize,
    /// Simulated time in seconds, 0.3 to 3600
    #[arg(long, default_value_t = 1.0, value_name = "SECONDS", value_parser = number::<f64>)]
    pub sim_seconds: f64,
    /// Number of runs; the median one is reported
    /// [default: 3; 9 with --compare]
    #[arg(verbatim_doc_comment, long, value_name = "N", value_parser = whole::<usize>)]
    pub runs: Option<usize>,
    /// Unbinding of the network `planner`: products (neurons)
    /// or fixed (a linear map)
    /// [default: products]
    #[arg(verbatim_doc_comment, long, value_name = "WAY")]
    pub unbinding: Option<String>,
    /// Selection of the network `memory`: winner, accumulators
    /// or threshold
    /// [default: winner]
    #[arg(verbatim_doc_comment, long, value_name = "RULE")]
    pub choice: Option<String>,
    /// File to write the solved populations to; it must not exist
    #[arg(long, value_name = "FILE", conflicts_with = "load")]
    pub save: Option<PathBuf>,
    /// Replace the file of --save if it exists
    #[arg(long, requires = "save")]
    pub force: bool,
    /// File to read the solved populations from
    #[arg(long, value_name = "FILE")]
    pub load: Option<PathBuf>,
    /// Earlier result of `bench --json`, or another program symbolt, to
    /// compare with; exit code 1 if this one is slower or has other results
    #[arg(verbatim_doc_comment, long, value_name = "FILE", conflicts_with_all = ["save", "load"])]
    pub compare: Option<PathBuf>,
    /// Measure all networks, and the rest of the program, as a page in
    /// Markdown
    #[arg(verbatim_doc_comment, long)]
    #[arg(conflicts_with_all = ["model", "mode", "unbinding", "choice", "save", "force", "load", "compare", "json"])]
    pub account: bool,
}

impl BenchArgs {
    fn model(&self) -> &str {
        self.model.as_deref().unwrap_or_default()
    }

    fn runs(&self) -> usize {
        self.runs.unwrap_or(if self.compare.is_some() { 9 } else { 3 })
    }

    fn unbinding(&self) -> &str {
        self.unbinding.as_deref().unwrap_or("products")
    }

    fn choice(&self) -> &str {
        self.choice.as_deref().unwrap_or("winner")
    }
}

pub(crate) fn bench(args: &BenchArgs) -> Result<Outcome, Error> {
    check(args)?;
    use_threads(&args.common)?;
    let progress = Progress::new(&args.common);
    if args.account {
        return account::account(args, &progress);
    }
    let spec = spec(args)?;
    let model: Model = args.model().parse()?;
    if let Some(other) = &args.compare {
        return compare::compare(args, other, progress, |progress| {
            figures(args, &spec, model, progress)
        });
    }
    match args.save.as_deref() {
        Some(_) if rank::own().is_some() => {
            let problem = "--save: several processes share the network, and none has all of it; save it in one process";
            bail!(BadArgument(problem.into()));
        }
        Some(path) if path.as_os_str() == "-" => {
            bail!(BadArgument("--save -: must be a file name; the file is binary".into()));
        }
        Some(path) => check_output(path, overwrite(args.force))?,
        None => {}
    }
    ranks::check_alike(args.load.as_deref())?;
    let figures = figures(args, &spec, model, &progress)?;
    drop(progress);
    answer(&args.common, || figures.to_json(), || figures.table().to_string())
}

/// Checks the numbers among the options.
fn check(args: &BenchArgs) -> Result<(), BadArgument> {
    let ranges = [
        ("--sim-seconds", args.sim_seconds, 0.3..=3600.0, "0.3 to 3600"),
        ("--runs", args.runs() as f64, 1.0..=MOST_RUNS as f64, "1 to 1000"),
        (
            "--neurons-scale",
            args.neurons_scale,
            f64::MIN_POSITIVE..=1e3,
            "more than 0 and at most 1000",
        ),
    ];
    match ranges.into_iter().find(|(_, value, range, _)| !range.contains(value)) {
        Some((option, value, _, expected)) => Err(BadArgument::range(option, value, expected)),
        None => Ok(()),
    }
}

/// Returns the settings of the network.
fn spec(args: &BenchArgs) -> Result<Standard, Error> {
    let model: Model = args.model().parse()?;
    let population: Population = args.mode.parse()?;
    let population = population.tuned(|usual| Tuning { scale: args.neurons_scale, ..usual });
    if population == Population::Direct && (args.save.is_some() || args.load.is_some()) {
        let problem = "--save and --load need --mode rate or lif: direct mode has no neurons";
        bail!(BadArgument(problem.into()));
    }
    let unbinding = choice("unbinding", args.unbinding(), &UNBINDINGS)?;
    let selection = choice("choice", args.choice(), &CHOICES)?;
    let of_networks = [
        ("--unbinding", &args.unbinding, Model::Planner),
        ("--choice", &args.choice, Model::Memory),
    ];
    for (option, given, own) in of_networks {
        if given.is_some() && model != own {
            bail!(unused(option, &format!("the network `{}`", name_of(own))));
        }
    }
    Ok(Standard {
        dimensions: args.dimensions,
        population,
        unbinding,
        choice: selection,
        sim_ms: (args.sim_seconds * 1e3).round() as u64,
        seed: Seed::new(args.common.seed),
        ranks: rank::own().cloned(),
    })
}

fn name_of(model: Model) -> &'static str {
    Model::ALL.into_iter().find(|(_, own)| *own == model).map_or("", |(name, _)| name)
}

/// Builds the network and measures it.
fn figures(
    args: &BenchArgs,
    spec: &Standard,
    model: Model,
    progress: &Progress,
) -> Result<Figures, Error> {
    foretell(args, spec, model, progress)?;
    progress.say(format!("building {}", args.model()));
    let Ready { built, load_s, peak_mb } = ready(args, spec, model)?;
    let mut runs = Vec::new();
    for run in 0..args.runs() {
        progress.say(format!("run {} of {}", run + 1, args.runs()));
        runs.push(built.run()?);
    }
    Ok(Figures::new(args, runs, load_s, peak_mb))
}

/// Dimensions that need no estimate, and dimensions of the network that gives one.
const USUAL: [usize; 2] = [2_048, 256];

/// Says what a network of many dimensions will need, as measured on one of fewer, and refuses it if it needs more memory
/// than there is.
fn foretell(
    args: &BenchArgs,
    spec: &Standard,
    model: Model,
    progress: &Progress,
) -> Result<(), Error> {
    if spec.dimensions <= USUAL[0] || rank::own().is_some() || args.load.is_some() {
        return Ok(());
    }
    let name = name_of(model);
    progress.say(format!("building {name} of {} dimensions for an estimate", USUAL[1]));
    let before_mb = peak_rss_mb();
    let began = Instant::now();
    let small = Standard { dimensions: USUAL[1], ..spec.clone() };
    let built = small.build(model).map_err(|error| scaled(error, args.neurons_scale))?;
    let times = spec.dimensions as f64 / USUAL[1] as f64;
    let build_s = began.elapsed().as_secs_f64() * times;
    let neurons = built.solved().neurons() as f64 * times;
    // Every neuron takes some nanoseconds a step, and some tens of bytes.
    let run_s = neurons * spec.sim_ms as f64 * 2e-9;
    let measured_mb = peak_rss_mb().zip(before_mb).map_or(0.0, |(after, before)| after - before);
    let need_mb = (neurons * 64.0 / 1e6).max(measured_mb * times);
    let need = format!(
        "{name} of {} dimensions: up to about {} neurons, {:.1} GB, {:.0} s to build and {:.0} s for each of {} runs",
        spec.dimensions,
        neurons as u64,
        need_mb / 1e3,
        build_s,
        run_s,
        args.runs()
    );
    if let Some(free_mb) = memory_mb("/proc/meminfo", "MemAvailable:").filter(|mb| *mb < need_mb) {
        bail!(BadArgument(format!("{need}; {:.1} GB are free", free_mb / 1e3)));
    }
    progress.say(need);
    Ok(())
}

const UNBINDINGS: [(&str, Unbinding); 2] =
    [("products", Unbinding::Products), ("fixed", Unbinding::Fixed)];

const CHOICES: [(&str, SelectRule); 3] = [
    ("winner", SelectRule::WinnerTakeAll { level: 0.5 }),
    (
        "accumulators",
        SelectRule::IndependentAccumulators { level: 0.5, tau: SimDuration::from_millis(50) },
    ),
    ("threshold", SelectRule::Threshold { level: 0.5 }),
];

fn choice<T: Copy>(option: &str, asked: &str, choices: &[(&str, T)]) -> Result<T, BadArgument> {
    let found = choices.iter().find(|(name, _)| *name == asked).map(|(_, value)| *value);
    found.ok_or_else(|| {
        let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
        let expected = format!("one of {}{}", few(&names), meant(asked, names.iter().copied()));
        BadArgument::range(&format!("--{option}"), asked, &expected)
    })
}

/// A network ready to run.
struct Ready {
    built: Built,
    /// Wall-clock seconds to build it from a file; `None` if processes share the network and load no file.
    load_s: Option<f64>,
    /// Peak memory of the build in MB, if the system reports it.
    peak_mb: Option<f64>,
}

/// Builds the network, or loads it from a file.
fn ready(args: &BenchArgs, spec: &Standard, model: Model) -> Result<Ready, Error> {
    if let Some(path) = &args.load {
        let (built, load_s) = load(spec, model, path)?;
        return Ok(Ready { built, load_s: Some(load_s), peak_mb: peak_rss_mb() });
    }
    let built = spec.build(model).map_err(|error| scaled(error, args.neurons_scale))?;
    let peak_mb = peak_rss_mb();
    if rank::own().is_some() {
        return Ok(Ready { built, load_s: None, peak_mb });
    }
    let bytes = built.solved().encode()?;
    if let Some(path) = &args.save {
        write_atomic(path, &bytes, overwrite(args.force))?;
    }
    let folder = tempfile::tempdir().context("cannot make a temporary folder")?;
    let path = folder.path().join("solved");
    write_atomic(&path, &bytes, Overwrite::Never)?;
    let (again, load_s) = load(spec, model, &path)?;
    if again.solved() != built.solved() {
        bail!("the network loaded from its file differs from the network that was built");
    }
    Ok(Ready { built, load_s: Some(load_s), peak_mb })
}

/// Names the option in an error about the numbers of neurons, which `scale` multiplies.
fn scaled(error: TaskError, scale: f64) -> Error {
    match error {
        TaskError::Build(faults) if scale != 1.0 && !faults.0.is_empty() => {
            let (first, count) = (&faults.0[0], faults.0.len());
            let (plural, more) = match count {
                1 => ("", String::new()),
                _ => ("s", format!("; and {} more", count - 1)),
            };
            BadArgument(format!(
                "--neurons-scale {scale}: the graph has {count} fault{plural}: - {first}{more}"
            ))
            .into()
        }
        error => error.into(),
    }
}

fn load(spec: &Standard, model: Model, path: &Path) -> Result<(Built, f64), Error> {
    let begun = Instant::now();
    let solved =
        parsed(Given { path, takes: &[Kind::Model] }, Limit::MODEL, &[], |bytes, name| {
            let content = |source| SolvedFileError::Content { file: name.into(), source };
            SolvedModel::decode(bytes).map_err(content)
        })?;
    let built = spec.build_from(model, solved)?;
    Ok((built, begun.elapsed().as_secs_f64()))
}

/// Returns the peak memory of the process in MB, if the system reports it.
fn peak_rss_mb() -> Option<f64> {
    memory_mb("/proc/self/status", "VmHWM:")
}

/// Returns a size in MB that the system reports in a file under this name.
fn memory_mb(file: &str, name: &str) -> Option<f64> {
    let status = read_beginning(Path::new(file), 1 << 14).ok()?;
    let status = String::from_utf8_lossy(&status);
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes / 1e3)
}
