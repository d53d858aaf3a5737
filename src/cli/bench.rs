//! `symbolt bench`: a standard network, how fast it was built and run, and how well it did.

use anyhow::Error;
use serde_json::{Map, Value, json};
use symbolt::neurons::Population;
use symbolt::sim::Seed;
use symbolt::task::standard::{Measured, Model, Standard};

use super::Outcome;
use super::args::{BadArgument, BenchArgs};
use super::output::{Grid, Progress, emit, emit_json, use_threads};

pub(crate) fn bench(args: &BenchArgs) -> Result<Outcome, Error> {
    let model: Model = args.model.parse()?;
    let mut population: Population = args.mode.parse()?;
    if let Population::Lif(spec) | Population::Rate(spec) = &mut population {
        spec.scale = args.neurons_scale;
    }
    if !(0.3..=3600.0).contains(&args.sim_seconds) {
        let problem = format!("--sim-seconds is {}; 0.3 to 3600 are possible", args.sim_seconds);
        return Err(BadArgument(problem).into());
    }
    if args.runs == 0 || args.runs > 1_000 {
        return Err(BadArgument(format!("--runs is {}; 1 to 1000 are possible", args.runs)).into());
    }
    if !(args.neurons_scale > 0.0 && args.neurons_scale <= 1e3) {
        let scale = args.neurons_scale;
        let problem = format!("--neurons-scale is {scale}; above 0 and up to 1000 are possible");
        return Err(BadArgument(problem).into());
    }
    use_threads(&args.common)?;
    let spec = Standard {
        dimensions: args.dimensions,
        population,
        sim_ms: (args.sim_seconds * 1e3).round() as u64,
        seed: Seed::new(args.common.seed),
    };
    let progress = Progress::new(&args.common);
    progress.say(format!("building {}", args.model));
    let built = spec.build(model)?;
    let mut runs = Vec::new();
    for run in 0..args.runs {
        progress.say(format!("run {} of {}", run + 1, args.runs));
        // Within the pool, so that a tick can share its work.
        let threads = rayon::current_num_threads();
        let one = || built.run();
        runs.push(if threads > 1 { rayon::scope(|_| one()) } else { one() }?);
    }
    runs.sort_by(|a, b| a.run_s.total_cmp(&b.run_s));
    let middle = runs.swap_remove(runs.len() / 2);
    drop(progress);
    if args.common.json {
        emit_json(&[summary(args, &middle)])?;
    } else {
        emit(&table(args, &middle).to_string())?;
    }
    Ok(Outcome::Done)
}

fn summary(args: &BenchArgs, measured: &Measured) -> Value {
    let quality: Map<String, Value> =
        measured.quality.iter().map(|(name, value)| ((*name).into(), json!(value))).collect();
    json!({
        "model": args.model,
        "mode": args.mode,
        "neurons": measured.neurons,
        "dimensions": args.dimensions,
        "threads": rayon::current_num_threads(),
        "build_s": measured.build_s,
        "wall_per_sim_s": measured.run_s / measured.sim_s,
        "ns_per_neuron_step": measured.ns_per_neuron_step,
        "quality": quality,
    })
}

fn table(args: &BenchArgs, measured: &Measured) -> Grid {
    let mut grid = Grid::new(&[&format!("{} in {}", args.model, args.mode), ">value"]);
    grid.row(["neurons".into(), measured.neurons.to_string()]);
    grid.row(["built in s".into(), format!("{:.2}", measured.build_s)]);
    let name = format!("{} s simulated in s", measured.sim_s);
    grid.row([name, format!("{:.3}", measured.run_s)]);
    grid.row(["ns a neuron and step".into(), format!("{:.2}", measured.ns_per_neuron_step)]);
    for (name, value) in &measured.quality {
        grid.row([(*name).to_owned(), format!("{value:.4}")]);
    }
    grid
}
