//! `symbolt check`: checks a recording, scene, scene configuration, domain or model of solved populations.

use std::fmt::Formatter;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Error;
use clap::Args;
use serde::de::{Deserialize, Deserializer, IgnoredAny, MapAccess, Visitor};
use serde_json::{Value, json};
use symbolt::doubt::{Doubt, doubts};
use symbolt::files::{Limit, read_file};
use symbolt::neurons::{SolvedFileError, SolvedModel};
use symbolt::robot::scene::{PAYLOAD_N, Scene};
use symbolt::sim::Seed;
use symbolt::task::domain::RelationalDomain;
use symbolt::task::tasks::file::{DataTask, FORMAT};
use symbolt::task::tasks::nuts_and_bolts::NutsAndBolts;
use symbolt::task::tasks::{self, Task};
use symbolt::task::{Recording, Snapshot, TaskError, demonstrate};

use super::end::Outcome;
use super::options::Common;
use super::output::{answer, facts, warn};

#[derive(Debug, Clone, Args)]
pub(crate) struct CheckArgs {
    /// File to check; - for standard input
    pub file: PathBuf,
    #[command(flatten)]
    pub common: Common,
}

pub(crate) fn check(args: &CheckArgs) -> Result<Outcome, Error> {
    let bytes = read_file(&args.file, Limit::ANY)?;
    let name = args.file.display().to_string();
    let found = inspect(&bytes, &args.file)?;
    let kind = found["kind"].as_str().unwrap_or("file");
    let text = || format!("{name}: a valid {kind}: {}", facts(&found));
    answer(&args.common, || found.clone(), text)
}

/// Recognises the kind of a file, reads it and returns its counts.
fn inspect(bytes: &[u8], path: &Path) -> Result<Value, TaskError> {
    let name = &*path.display().to_string();
    let allow = |limit: Limit| limit.check(path, bytes.len() as u64);
    if SolvedModel::recognises(bytes) {
        let solved = SolvedModel::decode(bytes)
            .map_err(|source| SolvedFileError::Content { file: name.into(), source })?;
        return Ok(json!({
            "kind": "model", "layers": solved.paths().count(), "neurons": solved.neurons(),
        }));
    }
    // A larger file can only be a recording.
    let small = bytes.len() as u64 <= Limit::SCENE.max_bytes;
    let header: Option<Head> = small.then(|| serde_json::from_slice(bytes).ok()).flatten();
    // Of these files, only domains name their format, so even a truncated domain is recognised.
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]);
    if header.as_ref().is_some_and(|v| v.format.as_ref().and_then(Value::as_str) == Some(FORMAT)) {
        allow(Limit::SETTINGS)?;
        let task = DataTask::parse(bytes, name)?;
        let parts = task.scene(Seed::new(0))?.parts.len();
        let unsolved = unsolved(&task)?;
        return Ok(json!({"kind": "task", "parts": parts, "unsolved": unsolved}));
    }
    if header.as_ref().map_or(head.contains("\"format\""), |v| v.format.is_some()) {
        allow(Limit::DOMAIN)?;
        let domain = RelationalDomain::parse(bytes, name)?;
        return Ok(json!({
            "kind": "domain", "states": domain.states.len(),
            "actions": domain.operators.len(),
        }));
    }
    if header.as_ref().is_some_and(|v| v.has("objects") && (!v.has("demo") || !one_line(bytes))) {
        allow(Limit::SCENE)?;
        let scene = Snapshot::parse(bytes, name)?;
        let objects = scene.objects.len();
        // A scene is examined as the start of a demonstration.
        let recording = Recording::of_scene(scene);
        return Ok(json!({"kind": "scene", "objects": objects, "warnings": doubted(&recording)}));
    }
    if let Some(task) = header.as_ref().map(task_of).transpose()?.flatten() {
        allow(Limit::SETTINGS)?;
        if task.name() == NutsAndBolts::default().name() {
            let spec = NutsAndBolts::parse(bytes, name)?;
            let (kind, unsolved) = ("scene configuration", unsolved(&spec)?);
            let (nuts, bolts) = (spec.nuts, spec.bolts);
            return Ok(json!({"kind": kind, "nuts": nuts, "bolts": bolts, "unsolved": unsolved}));
        }
        let task = task.with_settings(bytes, name)?;
        let (parts, unsolved) = (task.scene(Seed::new(0))?.parts.len(), unsolved(&*task)?);
        return Ok(json!({"kind": "scene configuration", "parts": parts, "unsolved": unsolved}));
    }
    allow(Limit::RECORDING)?;
    let (recording, labels) = Recording::parse(bytes, name)?;
    let labelled = labels.iter().flatten().filter(|l| l.is_some()).count();
    Ok(json!({
        "kind": "recording", "demonstrations": recording.demos.len(),
        "snapshots": recording.snapshot_count(), "labels": labelled,
        "warnings": doubted(&recording),
    }))
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

/// The keys of a JSON object and its format. The other values are skipped without being kept.
struct Head {
    /// The first [`MAX_KEYS`] keys.
    keys: Vec<String>,
    format: Option<Value>,
}

/// Number of keys by which the kind of a file is recognised.
const MAX_KEYS: usize = 100;

impl Head {
    fn has(&self, key: &str) -> bool {
        self.keys.iter().any(|own| own == key)
    }
}

impl<'de> Deserialize<'de> for Head {
    fn deserialize<D: Deserializer<'de>>(file: D) -> Result<Self, D::Error> {
        struct Keys;
        impl<'de> Visitor<'de> for Keys {
            type Value = Head;

            fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Head, A::Error> {
                let mut head = Head { keys: Vec::new(), format: None };
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "format" => head.format = Some(map.next_value()?),
                        _ => drop(map.next_value::<IgnoredAny>()?),
                    }
                    if head.keys.len() < MAX_KEYS {
                        head.keys.push(key);
                    }
                }
                Ok(head)
            }
        }
        file.deserialize_map(Keys)
    }
}

/// Returns the task that has most of these settings; `None` if no task has the first.
fn task_of(Head { keys, .. }: &Head) -> Result<Option<Arc<dyn Task>>, TaskError> {
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

/// Returns whether a file has a single line, as a recording of one snapshot does.
fn one_line(bytes: &[u8]) -> bool {
    bytes.trim_ascii().iter().all(|b| *b != b'\n')
}
