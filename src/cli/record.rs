//! `symbolt record`: demonstrations or a single scene, in physics or from the generator without physics.

use anyhow::{Error, bail};
use clap::Args;
use serde_json::{Value, json};
use symbolt::robot::scene::Scene;
use symbolt::sim::Seed;
use symbolt::task::execute::demonstrate_sensed;
use symbolt::task::{Recorder, Sensing, Snapshot};

use super::config;
use super::end::{BadArgument, Outcome};
use super::options::{Common, DemoArgs, OutFile, SensingArgs, SyntheticArgs, demonstrated};
use super::output::{Place, Progress, answer_unless_quiet, facts, use_threads};
use super::table::wrapped;
use super::watch::ProgressLine;

#[derive(Debug, Clone, Args)]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub demos: DemoArgs,
    /// Generate the demonstrations without physics, which is much faster
    #[arg(long)]
    pub kinematic: bool,
    #[command(flatten)]
    pub synthetic: SyntheticArgs,
    /// Write a single scene with all parts on the table, no demonstrations
    #[arg(long, conflicts_with = "demos")]
    pub scene: bool,
    /// Write the names of actions to `next_action`; needs --kinematic
    #[arg(long)]
    pub labels: bool,
    #[command(flatten)]
    pub out: OutFile,
}

pub(crate) fn record(args: &RecordArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    if !args.scene {
        args.demos.check(args.kinematic)?;
    }
    if args.kinematic && args.demos.config.is_some() {
        let problem = "--config needs the scene in physics; it cannot be used with --kinematic";
        bail!(BadArgument(problem.into()));
    }
    if args.demos.task.listed() {
        return config::list(args.common.json);
    }
    if args.kinematic && (args.demos.task.task.is_some() || args.demos.task.task_file.is_some()) {
        let problem =
            "--kinematic generates only nuts and bolts; without it, every --task can be recorded";
        bail!(BadArgument(problem.into()));
    }
    let sensing = args.demos.sensing.sensing()?;
    use_threads(&args.common)?;
    let (text, summary) =
        if args.kinematic { synthetic(args, &sensing)? } else { physical(args, &sensing)? };
    out.write(&text)?;
    if let Place::File(path, _) = &out {
        let text = || wrapped(&format!("Wrote {}: {}", path.display(), facts(&summary)), 6);
        answer_unless_quiet(&args.common, || summary.clone(), text)?;
    }
    Ok(Outcome::Done)
}

/// Returns demonstrations or a scene in physics as text, and a summary.
fn physical(args: &RecordArgs, sensing: &Sensing) -> Result<(String, Value), Error> {
    let (task, seed) = (args.demos.task()?, Seed::new(args.common.seed));
    if args.labels {
        let problem = "--labels needs --kinematic: demonstrations in physics have no labels";
        bail!(BadArgument(problem.into()));
    }
    if args.scene {
        let (seen, _) = Recorder::default().look(&Scene::new(task.scene(seed)?)?);
        return single(sensing.apply(&seen, SensingArgs::seed(args.common.seed), 0));
    }
    let progress = Progress::new(&args.common);
    let count = args.demos.demos;
    let made = demonstrate_sensed(&*task, count, sensing, seed, &mut ProgressLine::new(&progress))?;
    for unsolved in &made.shown_again {
        progress.say(format!("shown again: {unsolved}"));
    }
    for unsolved in &made.unsolved {
        progress.say(unsolved.to_string());
    }
    let summary = json!({
        "demonstrations": made.recording.demos.len(),
        "snapshots": made.recording.snapshot_count(),
        "assembled": made.solved,
        "unsolved": made.unsolved.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "shown_again": made.shown_again.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "simulated_s": made.simulated_s,
    });
    Ok((made.recording.to_jsonl(None)?, summary))
}

/// Returns demonstrations or a scene without physics as text, and a summary.
fn synthetic(args: &RecordArgs, sensing: &Sensing) -> Result<(String, Value), Error> {
    let synthetic = args.synthetic.synthetic(&args.demos);
    let seed = Seed::new(args.common.seed);
    if args.scene {
        let scene = synthetic.scene(seed).map_err(demonstrated)?;
        return single(sensing.apply(&scene, SensingArgs::seed(args.common.seed), 0));
    }
    let made = synthetic.record(seed).map_err(demonstrated)?;
    let summary = json!({
        "demonstrations": made.recording.demos.len(),
        "snapshots": made.recording.snapshot_count(),
        "failed": made.failed,
        "lost": made.lost,
        "assembled": made.assembled,
    });
    let seen = sensing.apply_recording(&made.recording, SensingArgs::seed(args.common.seed));
    Ok((seen.to_jsonl(args.labels.then_some(&made.labels))?, summary))
}

fn single(scene: Snapshot) -> Result<(String, Value), Error> {
    let summary = json!({"objects": scene.objects.len()});
    Ok((scene.to_json()? + "\n", summary))
}
