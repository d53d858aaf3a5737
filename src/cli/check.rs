//! `symbolt check`: checks a recording, scene, scene configuration, domain or model of solved populations.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Error;
use clap::Args;
use serde_json::{Value, json};
use symbolt::doubt::{Doubt, doubts};
use symbolt::files::Limit;
use symbolt::neurons::{SolvedFileError, SolvedModel};
use symbolt::robot::scene::{PAYLOAD_N, Scene};
use symbolt::sim::Seed;
use symbolt::task::domain::RelationalDomain;
use symbolt::task::import::Mapping;
use symbolt::task::tasks::file::DataTask;
use symbolt::task::tasks::nuts_and_bolts::NutsAndBolts;
use symbolt::task::tasks::{self, Task};
use symbolt::task::{Recording, Snapshot, TaskError, demonstrate};

use super::end::Outcome;
use super::kind::{Given, Kind, parsed};
use super::options::Seedless;
use super::output::{answer, facts, use_threads, warn};

#[derive(Debug, Clone, Args)]
pub(crate) struct CheckArgs {
    /// File to check; - for standard input
    pub file: PathBuf,
    // Nothing that is checked depends on a seed.
    #[command(flatten)]
    pub common: Seedless,
}

pub(crate) fn check(args: &CheckArgs) -> Result<Outcome, Error> {
    use_threads(&args.common)?;
    let given = Given { path: &args.file, takes: &CHECKED };
    let name = args.file.display().to_string();
    let found = parsed(given, Limit::ANY, &[], |bytes, _| inspect(bytes, &args.file))?;
    let kind = found["kind"].as_str().unwrap_or("file");
    let text = || format!("{name}: a valid {kind}: {}", facts(&found));
    answer(&args.common, || found.clone(), text)
}

/// The kinds that can be checked.
const CHECKED: [Kind; 7] = [
    Kind::Recording,
    Kind::Scene,
    Kind::Domain,
    Kind::Task,
    Kind::Settings,
    Kind::Mapping,
    Kind::Model,
];

/// Recognises the kind of a file, reads it and returns its counts.
fn inspect(bytes: &[u8], path: &Path) -> Result<Value, TaskError> {
    let name = &*path.display().to_string();
    let allow = |limit: Limit| limit.check(path, bytes.len() as u64);
    let found = Kind::of(bytes);
    match found.kind {
        Kind::Model => {
            let content = |source| SolvedFileError::Content { file: name.into(), source };
            let solved = SolvedModel::decode(bytes).map_err(content)?;
            Ok(json!({
                "kind": "model", "layers": solved.paths().count(), "neurons": solved.neurons(),
            }))
        }
        Kind::Task => {
            allow(Limit::SETTINGS)?;
            let task = DataTask::parse(bytes, name)?;
            let parts = task.scene(Seed::new(0))?.parts.len();
            let (unsolved, warnings) = (unsolved(&task)?, task.empty_grasps()?);
            warnings.iter().for_each(|warning| warn(warning));
            Ok(json!({"kind": "task", "parts": parts, "unsolved": unsolved, "warnings": warnings}))
        }
        Kind::Domain => {
            allow(Limit::DOMAIN)?;
            let domain = RelationalDomain::parse(bytes, name)?;
            Ok(json!({
                "kind": "domain", "states": domain.states.len(),
                "actions": domain.operators.len(),
            }))
        }
        Kind::Scene => {
            allow(Limit::SCENE)?;
            let scene = Snapshot::parse(bytes, name)?;
            let objects = scene.objects.len();
            // A scene is examined as the start of a demonstration.
            let doubts = doubted(&Recording::of_scene(scene));
            Ok(json!({"kind": "scene", "objects": objects, "warnings": doubts}))
        }
        Kind::Settings => {
            allow(Limit::SETTINGS)?;
            let kind = "scene configuration";
            let Some(task) = task_of(&found.keys)? else { return Ok(json!({"kind": kind})) };
            if task.name() == NutsAndBolts::default().name() {
                let spec = NutsAndBolts::parse(bytes, name)?;
                let (nuts, bolts, unsolved) = (spec.nuts, spec.bolts, unsolved(&spec)?);
                return Ok(
                    json!({"kind": kind, "nuts": nuts, "bolts": bolts, "unsolved": unsolved}),
                );
            }
            let task = task.with_settings(bytes, name)?;
            let (parts, unsolved) = (task.scene(Seed::new(0))?.parts.len(), unsolved(&*task)?);
            Ok(json!({"kind": kind, "parts": parts, "unsolved": unsolved}))
        }
        Kind::Mapping => {
            allow(Limit::SETTINGS)?;
            Mapping::parse(bytes, name)?;
            Ok(json!({"kind": "mapping"}))
        }
        // The format is not known, which the reader of domains says.
        Kind::Json if found.keys.iter().any(|key| key == "format") => {
            allow(Limit::DOMAIN)?;
            RelationalDomain::parse(bytes, name).map(|_| json!({}))
        }
        _ => {
            allow(Limit::RECORDING)?;
            let (recording, labels) = Recording::parse(bytes, name)?;
            let labelled = labels.iter().flatten().filter(|l| l.is_some()).count();
            Ok(json!({
                "kind": "recording", "demonstrations": recording.demos.len(),
                "snapshots": recording.snapshot_count(), "labels": labelled,
                "warnings": doubted(&recording),
            }))
        }
    }
}

/// Warns of what is doubtful in a recording, and returns it.
pub(super) fn doubted(recording: &Recording) -> Vec<Doubt> {
    let doubts = doubts(recording);
    doubts.iter().for_each(|doubt| warn(&doubt.to_string()));
    doubts
}

/// Weighs the parts of a task and demonstrates it once. Returns what the robot cannot do, with the number that rules it out:
/// payload, reach, grip against weight, or opening of the fingers. Warns of it, too.
fn unsolved(task: &dyn Task) -> Result<Vec<String>, TaskError> {
    let spec = task.scene(Seed::new(0))?;
    let scene = Scene::new(spec.clone())?;
    let carried = (0..spec.parts.len()).filter(|part| spec.parts[*part].slider.is_none());
    let heavy = carried.filter_map(|part| Some((part, scene.weight_n(part)?)));
    let heavy = heavy.filter(|(_, weight_n)| *weight_n > PAYLOAD_N);
    let heavy = heavy.map(|(part, weight_n)| {
        format!("part {part} weighs {weight_n:.2} N, and the arm carries {PAYLOAD_N} N")
    });
    let mut unsolved: Vec<String> = heavy.collect();
    let shown = demonstrate(task, 1, Seed::new(0))?.unsolved;
    unsolved.extend(shown.iter().map(|why| format!("a trial did not solve the task: {why}")));
    unsolved.iter().for_each(|why| warn(why));
    Ok(unsolved)
}

/// Returns the task that has most of these settings; `None` if no task has the first.
fn task_of(keys: &[String]) -> Result<Option<Arc<dyn Task>>, TaskError> {
    let known = |task: &Arc<dyn Task>| {
        let own = task.settings();
        let known = keys.iter().filter(|key| own.get(*key).is_some()).count();
        keys.first().and_then(|first| own.get(first)).map_or(0, |_| known)
    };
    let mut best: Option<(usize, Arc<dyn Task>)> = None;
    for task in tasks::all()? {
        let known = known(&task);
        if known > best.as_ref().map_or(0, |(most, _)| *most) {
            best = Some((known, task));
        }
    }
    Ok(best.map(|(_, task)| task))
}
