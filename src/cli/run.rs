//! `symbolt run`: the main job, from demonstrations to a plan.
//!
//! Until the physics scene exists the demonstrations come from the kinematic generator, and the job
//! ends with a plan for a fresh scene.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Error;
use serde_json::{Value, json};
use symbolt::sim::Seed;
use symbolt::task::kinematic::Rehearsal;
use symbolt::task::learn::Settings;
use symbolt::task::planner::{Planner, RolledOut};
use symbolt::task::{Classifier, Grounding, Overwrite, TaskError, write_whole};

use super::Outcome;
use super::args::RunArgs;
use super::output::{Progress, counted, emit, emit_json, use_threads};
use super::{learn, plan};

/// The files that a run leaves in its folder.
const FILES: [&str; 4] = ["recording.jsonl", "domain.json", "scene.json", "trace.jsonl"];

pub(crate) fn run(args: &RunArgs) -> Result<Outcome, Error> {
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("out"));
    if args.out.is_some()
        && !args.force
        && let Some(there) = FILES.iter().map(|f| folder.join(f)).find(|f| f.exists())
    {
        return Err(TaskError::Exists { path: there }.into());
    }
    use_threads(&args.common)?;
    let progress = Progress::new(&args.common);
    let seed = Seed::new(args.common.seed);
    let rehearsal = args.rehearsal.rehearsal();
    progress.say(format!("generating {} demonstrations", rehearsal.demos));
    let made = rehearsal.record(seed)?;
    let scene = Rehearsal { nuts: args.nuts, bolts: args.bolts, ..rehearsal.clone() }
        .scene(seed.derive("run", "scene"))?;
    let settings = Settings { seed: args.common.seed, ..Settings::default() };
    let learned = learn::learn_with_progress(&made.recording, &settings, &progress)?;
    let domain = &learned.domain;
    let Some(goal) = domain.goal().map(str::to_owned) else {
        return Ok(Outcome::Failed("the demonstrations achieved nothing to plan for".into()));
    };
    progress.say("building the planner graph");
    let planner = plan::build(domain, &args.planner, args.common.seed)?;
    let classifier = Classifier::new(domain, Grounding::default())?;
    progress.say(format!("planning towards {goal}"));
    let (counts, _) = plan::count(&classifier, domain, &scene);
    let plan = planner.plan(&counts, &goal)?;

    progress.say(format!("writing {}", folder.display()));
    std::fs::create_dir_all(&folder).map_err(|source| TaskError::Io {
        what: "write",
        path: folder.clone(),
        source,
    })?;
    let texts = [
        made.recording.to_jsonl(None),
        domain.to_json(),
        scene.to_json() + "\n",
        trace(&planner, &plan),
    ];
    for (file, text) in FILES.iter().zip(texts) {
        write_whole(&folder.join(file), &text, Overwrite::Allowed)?;
    }
    drop(progress);

    if args.common.json {
        let mut summary = plan::summary(&planner, &plan, &goal);
        summary["demonstrations"] = json!(made.recording.demos.len());
        summary["snapshots"] = json!(made.recording.snapshot_count());
        summary["failed_tries"] = json!(made.failed);
        summary["states"] = json!(domain.states().len());
        summary["operators"] = json!(domain.operators().len());
        summary["out"] = json!(folder.display().to_string());
        emit_json(&[summary])?;
    } else {
        let mut text = format!(
            "{}, {}, {} (kinematic generator, seed {})\n\n",
            counted(made.recording.demos.len(), "demonstration"),
            counted(made.recording.snapshot_count(), "snapshot"),
            match made.failed {
                0 => "no failed tries".into(),
                1 => "1 failed try".into(),
                many => format!("{many} failed tries"),
            },
            args.common.seed,
        );
        text += &learn::tables(&learned);
        let _ = writeln!(
            text,
            "A fresh scene with {} and {}:\n",
            counted(args.nuts, "nut"),
            counted(args.bolts, "bolt")
        );
        text += &plan::table(&planner, &plan, &counts, &goal);
        let _ = writeln!(text, "Wrote {}", written(&folder));
        emit(&text)?;
    }
    Ok(plan::outcome(&planner, &plan))
}

fn written(folder: &Path) -> String {
    let files: Vec<String> = FILES.iter().map(|f| folder.join(f).display().to_string()).collect();
    files.join(", ")
}

/// Every decision with its milestones, one JSON object a line.
fn trace(planner: &Planner, plan: &RolledOut) -> String {
    let mut text = String::new();
    let decisions = plan.steps.iter().map(|s| &s.decision).chain([&plan.last]);
    for (step, decision) in decisions.enumerate() {
        let action = plan.steps.get(step).map(|s| &planner.domain().operators()[s.action].name);
        let milestones: Vec<Value> = decision
            .milestones
            .iter()
            .map(|m| {
                json!({
                    "question": m.question, "stage": m.stage.to_string(),
                    "subject": m.subject, "ms": m.time_ms,
                })
            })
            .collect();
        let line = json!({
            "step": step + 1, "action": action, "decision_ms": decision.time_ms,
            "questions": decision.questions, "milestones": milestones,
        });
        let _ = writeln!(text, "{line}");
    }
    text
}
