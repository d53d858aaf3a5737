//! The report: a single page that shows a run or experiments and opens offline.
//!
//! A run's folder holds `run.json` ([`RunFacts`]), `recording.jsonl`, `domain.json`, `scene.json`, `trace.jsonl`
//! ([`trace`]) and `arrays.npz` ([`Arrays`]). The page depends on these files alone. It lists missing and damaged files
//! and shows the rest. Text from the files is embedded as data and shown as text, never as markup.

mod arrays;
mod domain;
mod facts;
mod page;
pub mod trace;

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

pub use arrays::Arrays;
pub use facts::{ModuleFacts, PopulationFacts, RunFacts};
pub use page::TITLE;

use crate::files::{FileError, read_file};
use crate::task::TaskError;
use crate::task::domain::Recording;
use crate::task::scene::{Outline, SceneSpec};

/// A page, and a list of what it cannot show.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The page, as HTML.
    pub html: String,
    /// One sentence for each missing or damaged file.
    pub missing: Vec<String>,
}

/// Files of a run. A folder with any of them is a run's folder.
const RUN: [&str; 5] = ["run.json", "domain.json", "trace.jsonl", "arrays.npz", "recording.jsonl"];
/// File of a finished experiment.
const RESULTS: &str = "results.json";
/// File of an experiment that has begun.
const TRIALS: &str = "trials.bin";

/// Writes the report on the folder of a run, the folder of an experiment, or a folder of such experiment folders. For a
/// run of one minute this takes about 20 ms, plus the time to read the files.
///
/// The scene is drawn again from the task's name and settings. If [`tasks::all`](crate::task::tasks::all) does not have
/// the task, the page omits the replay and says so.
///
/// # Errors
/// [`TaskError::NothingToReport`] if the folder holds no file of a run or experiment; [`TaskError::File`] if the folder
/// cannot be read.
pub fn report(folder: &Path) -> Result<Report, TaskError> {
    let entries = std::fs::read_dir(folder).map_err(FileError::io("read", folder))?;
    if RUN.iter().any(|name| folder.join(name).exists()) {
        return Ok(of_run(folder));
    }
    let mut folders = vec![folder.to_path_buf()];
    folders.extend(entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()));
    folders.retain(|folder| folder.join(RESULTS).exists() || folder.join(TRIALS).exists());
    folders.sort();
    if folders.is_empty() {
        return Err(TaskError::NothingToReport { folder: folder.into() });
    }
    Ok(of_experiments(&folders))
}

/// The parts of `results.json` that the page shows.
#[derive(Serialize, Deserialize)]
struct Table {
    name: String,
    question: String,
    settings: Value,
    cells: Vec<TableRow>,
}

/// A row of `results.json`: a statistic and its settings. Values that are not finite are null in the file.
#[derive(Serialize, Deserialize)]
struct TableRow {
    rate: Option<f64>,
    successes: Option<u64>,
    trials: Option<u64>,
    effective_trials: Option<f64>,
    mean: Option<f64>,
    sd: Option<f64>,
    n: Option<u64>,
    interval95: Option<[Option<f64>; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    few_trials: Option<bool>,
    #[serde(flatten)]
    settings: Map<String, Value>,
}

/// Reads the files of a folder and collects a sentence on each file that cannot be read.
struct Reader<'a> {
    folder: &'a Path,
    missing: Vec<String>,
}

impl Reader<'_> {
    fn take<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(&[u8], &str) -> Result<T, String>,
    ) -> Option<T> {
        let path = self.folder.join(name);
        let taken = match read_file(&path) {
            Ok(bytes) => read(&bytes, name),
            Err(FileError::Io { source, .. }) => Err(match source.kind() {
                std::io::ErrorKind::NotFound => "the file is missing".into(),
                _ => source.to_string(),
            }),
            Err(error) => Err(error.to_string()),
        };
        taken.map_err(|why| self.missing.push(format!("{name}: {why}"))).ok()
    }
}

fn of_run(folder: &Path) -> Report {
    let mut reader = Reader { folder, missing: Vec::new() };
    let facts = reader.take("run.json", |bytes, _| {
        let facts: RunFacts = serde_json::from_slice(bytes).map_err(|e| e.to_string())?;
        let (format, version) = RunFacts::FORMAT;
        if facts.format != format || facts.version != version {
            let is = format!("the file is a {} of version {}", facts.format, facts.version);
            return Err(format!("{is}; expected {format} of version {version}"));
        }
        Ok(facts)
    });
    let scene = facts.as_ref().and_then(|facts| match facts.draw_scene() {
        Ok(scene) => Some(scene),
        Err(TaskError::Input(fault)) => {
            reader.missing.push(fault.to_string());
            None
        }
        Err(error) => {
            reader.missing.push(format!("run.json: {error}"));
            None
        }
    });
    let domain = reader
        .take("domain.json", |bytes, name| domain::to_page(bytes, name).map_err(|e| e.to_string()));
    let shown = reader.take("recording.jsonl", |bytes, name| {
        let (recording, _) = Recording::parse(bytes, name).map_err(|e| e.to_string())?;
        Ok(json!({
            "demonstrations": recording.demos.len(),
            "snapshots": recording.snapshot_count(),
        }))
    });
    let traced = reader.take("trace.jsonl", |bytes, _| Ok(trace::read(bytes)));
    let events = traced.map(|(events, problem)| {
        let episodes = facts.as_ref().and_then(episodes);
        let unfinished = || trace::unfinished(&events, episodes.map(|n| n as usize));
        let problem = problem.or_else(unfinished);
        reader.missing.extend(problem.map(|problem| format!("trace.jsonl: {problem}")));
        events
    });
    let recorded = recorded_episode(facts.as_ref(), events.as_deref());
    if let (Some(facts), None) = (&facts, recorded) {
        let (number, all) = (facts.recorded, episodes(facts).unwrap_or(0));
        let problem = format!("`filmed` is {number}; expected an episode number below {all}");
        reader.missing.push(format!("run.json: {problem}"));
    }
    let mut odd = Vec::new();
    let arrays = reader.take("arrays.npz", |bytes, _| Arrays::from_npz(bytes)).map(|read| {
        let (mut arrays, unread) = read;
        odd.extend(unread);
        if let Some(facts) = &facts {
            let (fitting, others) = arrays.fitting(facts, scene.as_ref().map(SceneSpec::pictured));
            arrays = fitting;
            odd.extend(others);
        }
        let own = |line: &&trace::Line| Some(line.episode) == recorded;
        let end = events.iter().flatten().filter(own).find_map(|line| line.end.as_ref());
        if let Some(end) = end {
            let (lasting, others) = arrays.lasting(end.simulated_s);
            arrays = lasting;
            odd.extend(others);
        }
        arrays
    });
    reader.missing.extend(odd.into_iter().map(|why| format!("arrays.npz: {why}")));
    let outline = scene.as_ref().map(Outline::of);
    let missing = reader.missing;
    let data = json!({
        "kind": "run",
        "missing": missing,
        "run": facts,
        "filmed": recorded,
        "domain": domain,
        "recording": shown,
        "events": events,
        "outline": outline,
        "arrays": arrays.as_ref().map(Arrays::to_page),
    });
    Report { html: page::html(&data), missing }
}

/// Returns the number of episodes that `run.json` states.
fn episodes(facts: &RunFacts) -> Option<u64> {
    facts.summary.get("episodes")?.as_u64()
}

/// Returns the episode that the arrays show: the episode that `run.json` states or, without that file, the only episode
/// of the trace.
fn recorded_episode(facts: Option<&RunFacts>, events: Option<&[trace::Line]>) -> Option<usize> {
    let Some(facts) = facts else {
        return events.is_some_and(|lines| lines.iter().all(|line| line.episode == 0)).then_some(0);
    };
    let there = episodes(facts).is_none_or(|all| (facts.recorded as u64) < all);
    there.then_some(facts.recorded)
}

fn of_experiments(folders: &[std::path::PathBuf]) -> Report {
    let mut missing = Vec::new();
    let mut experiments = Vec::new();
    for folder in folders {
        let name = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let mut reader = Reader { folder, missing: Vec::new() };
        let results = if folder.join(RESULTS).exists() {
            reader.take(RESULTS, |bytes, _| {
                serde_json::from_slice::<Table>(bytes).map_err(|e| e.to_string())
            })
        } else {
            reader.missing.push(format!(
                "{RESULTS}: the file is missing because the trials are unfinished; rerun `symbolt experiment` to resume"
            ));
            None
        };
        let figure = if folder.join("figure.svg").exists() {
            reader.take("figure.svg", |bytes, _| Ok(page::base64(bytes)))
        } else {
            None
        };
        missing.extend(reader.missing.into_iter().map(|why| format!("{name}/{why}")));
        experiments.push(json!({"folder": name, "results": results, "figure": figure}));
    }
    let data = json!({"kind": "experiments", "missing": missing, "experiments": experiments});
    Report { html: page::html(&data), missing }
}
