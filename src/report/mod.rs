//! The report: a single page that shows a run or experiments and opens offline.
//!
//! A run's folder holds `run.json` ([`RunFacts`]), `recording.jsonl`, `domain.json`, `scene.json`, `trace.jsonl`
//! ([`trace`]) and `arrays.npz` ([`Arrays`]). The page depends on these files alone. It lists missing and damaged files
//! and shows the rest. Text from the files is embedded as data and shown as text, never as markup.

mod arrays;
mod domain;
mod facts;
mod film;
mod imported;
mod page;
mod situations;
pub mod trace;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

pub use arrays::Arrays;
pub use facts::{Filmed, ModuleFacts, PopulationFacts, RunFacts, RunWords};
pub use imported::import_page;
pub use page::TITLE;

use film::Film;
use situations::Objects;

use crate::files::{FileError, Limit, read_regular_file};
use crate::record::shell::base64;
use crate::robot::scene::{Outline, SceneSpec};
use crate::sim::cut;
use crate::task::TaskError;
use crate::task::domain::RelationalDomain;
use crate::task::event::Decided;
use crate::task::recording::{Demonstration, Recording, SnapshotEvent};

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
/// run of one minute this takes about 100 ms, plus the time to read the files: most of it finds the states of all objects at every
/// frame.
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

/// Greatest number of modules and of populations in `run.json`.
const MAX_LISTED: usize = 4096;
/// Greatest number of experiments in a report.
const MAX_EXPERIMENTS: usize = 1000;
/// Greatest size of all tables and figures in a report on experiments, in bytes.
const MAX_TABLES: u64 = 16 << 20;
/// Greatest length of a sentence on a damaged file, in characters.
const MAX_SENTENCE: usize = 1000;

/// Reads the files of a folder and collects a sentence on each file that cannot be read.
struct Reader<'a> {
    folder: &'a Path,
    missing: Vec<String>,
}

/// Shortens a sentence that quotes a long text of a damaged file.
fn shortened(sentence: String) -> String {
    cut(&sentence, MAX_SENTENCE).into_owned()
}

impl Reader<'_> {
    fn take<T>(
        &mut self,
        name: &str,
        limit: Limit,
        read: impl FnOnce(&[u8], &str) -> Result<T, String>,
    ) -> Option<T> {
        let path = self.folder.join(name);
        let taken = match read_regular_file(&path, limit) {
            Ok(bytes) => read(&bytes, name),
            Err(FileError::Io { source, .. }) => Err(match source.kind() {
                std::io::ErrorKind::NotFound => "the file is missing".into(),
                _ => source.to_string(),
            }),
            Err(error) => Err(error.to_string()),
        };
        taken.map_err(|why| self.missing.push(shortened(format!("{name}: {why}")))).ok()
    }
}

fn of_run(folder: &Path) -> Report {
    let mut reader = Reader { folder, missing: Vec::new() };
    let facts = reader.take("run.json", Limit::FACTS, |bytes, _| {
        let facts: RunFacts = serde_json::from_slice(bytes).map_err(|e| e.to_string())?;
        let (format, version) = RunFacts::FORMAT;
        if facts.format != format || facts.version != version {
            let is = format!("the file is a {} of version {}", facts.format, facts.version);
            return Err(format!("{is}; expected {format} of version {version}"));
        }
        let lists = [("modules", facts.modules.len()), ("populations", facts.populations.len())];
        if let Some((list, long)) = lists.into_iter().find(|(_, long)| *long > MAX_LISTED) {
            return Err(format!("`{list}` has {long} entries; expected at most {MAX_LISTED}"));
        }
        Ok(facts)
    });
    let scene = facts.as_ref().and_then(|facts| match facts.draw_scene(facts.scene_seed) {
        Ok(scene) => Some(scene),
        Err(TaskError::Input(fault)) => {
            reader.missing.push(shortened(fault.to_string()));
            None
        }
        Err(error) => {
            reader.missing.push(shortened(format!("run.json: {error}")));
            None
        }
    });
    let domain = reader.take("domain.json", Limit::DOMAIN, |bytes, name| {
        RelationalDomain::parse(bytes, name).map_err(|e| e.to_string())
    });
    let shown = reader.take("recording.jsonl", Limit::RECORDING, |bytes, name| {
        let (recording, _) = Recording::parse(bytes, name).map_err(|e| e.to_string())?;
        Ok(json!({
            "demonstrations": recording.demos.len(),
            "snapshots": recording.snapshot_count(),
            "moved": recording.demos.first().map(moved),
            "alike": recording.demos.windows(2).all(|two| moved(&two[0]) == moved(&two[1])),
        }))
    });
    let traced = reader.take("trace.jsonl", Limit::TRACE, |bytes, _| Ok(trace::read(bytes)));
    let events = traced.map(|(events, problem)| {
        let episodes = facts.as_ref().and_then(episodes);
        let unfinished = || trace::unfinished(&events, episodes.map(|n| n as usize));
        let problem = problem.or_else(unfinished);
        reader.missing.extend(problem.map(|problem| shortened(format!("trace.jsonl: {problem}"))));
        events
    });
    let recorded = recorded_episode(facts.as_ref(), events.as_deref());
    if let (Some(facts), None) = (&facts, recorded) {
        let (number, all) = (facts.recorded, episodes(facts).unwrap_or(0));
        let problem = format!("`filmed` is {number}; expected an episode number below {all}");
        reader.missing.push(format!("run.json: {problem}"));
    }
    let mut odd = Vec::new();
    let read = reader.take("arrays.npz", Limit::ARCHIVE, |bytes, _| Arrays::from_npz(bytes));
    let arrays = read.map(|read| {
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
    reader.missing.extend(odd.into_iter().map(|why| shortened(format!("arrays.npz: {why}"))));
    let mut arrays = arrays;
    let first = failures(facts.as_ref());
    let (films, numbers) =
        films(&mut arrays, facts.as_ref(), recorded, scene.as_ref(), domain.as_ref(), &first);
    let events = events.map(|events| fitting(events, &[numbers, first].concat()));
    let task = facts.as_ref().and_then(|facts| facts.own_task().ok());
    let data = RunPage {
        kind: "run",
        missing: &reader.missing,
        defaults: facts.as_ref().map(RunFacts::defaults),
        task: task.map(|task| json!({"name": task.name(), "description": task.description()})),
        run: facts,
        filmed: recorded,
        domain: domain.map(|domain| domain::to_page(&domain)),
        recording: shown,
        events: events.map(|events| events.into_iter().map(PageLine::from).collect()),
        outline: scene.as_ref().map(|scene| json!(Outline::of(scene))),
        films,
        arrays: arrays.map(Arrays::into_page),
    };
    Report { html: page::html(&data), missing: reader.missing }
}

/// The data of the page on a run.
#[derive(Serialize)]
struct RunPage<'a> {
    kind: &'a str,
    missing: &'a [String],
    /// Name and description.
    task: Option<Value>,
    run: Option<RunFacts>,
    /// The settings of a run for which nothing else is asked.
    defaults: Option<Value>,
    filmed: Option<usize>,
    domain: Option<Value>,
    recording: Option<Value>,
    events: Option<Vec<PageLine>>,
    /// Shapes of the scene of the recorded episode.
    outline: Option<Value>,
    /// Frames of the recorded episode and of others, with what holds at each.
    films: Vec<Value>,
    arrays: Option<Value>,
}

/// A line of the trace, with what came of its decision in words.
#[derive(Serialize)]
struct PageLine {
    #[serde(flatten)]
    line: trace::Line,
    #[serde(skip_serializing_if = "Option::is_none")]
    came: Option<String>,
}

impl From<trace::Line> for PageLine {
    fn from(line: trace::Line) -> Self {
        Self { came: line.decision.as_ref().and_then(|decision| decision.came_in_words()), line }
    }
}

/// Returns the kinds of the objects that a demonstration took, in order.
fn moved(demo: &Demonstration) -> Vec<String> {
    let taken = demo.snapshots.iter().filter(|s| s.event == Some(SnapshotEvent::Contact));
    let kinds = taken.filter_map(|s| Some(s.objects.get(s.object?)?.kind.to_string()));
    kinds.collect()
}

/// Greatest number of state names in the events of a page. Of further episodes it has the ends only.
const MAX_NAMES: usize = 40_000;

/// Leaves the decisions and contacts of some episodes out of a long trace. The episodes in `first` are kept before others.
fn fitting(events: Vec<trace::Line>, first: &[usize]) -> Vec<trace::Line> {
    let mut names: BTreeMap<usize, usize> = BTreeMap::new();
    for line in &events {
        let of = |d: &Decided| 8 + d.holds.len() + d.needs.len() + d.gives.len() + d.unmet.len();
        *names.entry(line.episode).or_default() += line.decision.as_ref().map_or(1, of);
    }
    let others = names.keys().filter(|episode| !first.contains(episode));
    let mut left = MAX_NAMES;
    let whole: BTreeSet<usize> = (first.iter().chain(others))
        .filter(|episode| {
            let own = names.get(episode).copied().unwrap_or(0);
            let fits = own <= left;
            left -= if fits { own } else { 0 };
            fits
        })
        .copied()
        .collect();
    events.into_iter().filter(|line| line.end.is_some() || whole.contains(&line.episode)).collect()
}

/// Returns the episodes that failed, as `run.json` lists them.
fn failures(facts: Option<&RunFacts>) -> Vec<usize> {
    let list = facts.and_then(|facts| facts.summary.get("failures")?.as_array());
    let number = |failure: &Value| Some(failure.get("episode")?.as_u64()? as usize);
    list.into_iter().flatten().filter_map(number).collect()
}

/// Returns the films of the page, that of the recorded episode first, and the episodes that they show.
fn films(
    arrays: &mut Option<Arrays>,
    facts: Option<&RunFacts>,
    recorded: Option<usize>,
    scene: Option<&SceneSpec>,
    domain: Option<&RelationalDomain>,
    first: &[usize],
) -> (Vec<Value>, Vec<usize>) {
    let Some(arrays) = arrays else { return (Vec::new(), recorded.into_iter().collect()) };
    let (film, others) = arrays.take_films(first);
    let page = |episode: Option<usize>, film: Film, scene: Option<&SceneSpec>, outline: Value| {
        let objects = scene.map(Objects::of);
        let held = objects.as_ref().zip(domain).and_then(|(o, d)| o.situations(&film, d));
        let objects = objects.map(|objects| objects.to_page());
        json!({
            "episode": episode, "objects": objects, "held": held, "outline": outline,
            "frames": film.into_page(),
        })
    };
    let own = scene.map(Outline::of);
    let mut numbers: Vec<usize> = recorded.into_iter().collect();
    let mut films = vec![page(recorded, film, scene, Value::Null)];
    for (number, film) in others {
        let seed = facts.and_then(|f| f.also_filmed.iter().find(|f| f.episode == number));
        let drawn = facts.zip(seed).and_then(|(f, seed)| f.draw_scene(seed.scene_seed).ok());
        // Bodies that stand elsewhere than in the recorded episode.
        let differing = drawn.as_ref().zip(own.as_ref()).map(|(scene, own)| {
            let meshes = Outline::of(scene).meshes.into_iter();
            meshes.filter(|mesh| !own.meshes.contains(mesh)).collect::<Vec<_>>()
        });
        let (Some(scene), Some(meshes)) = (drawn, differing) else { continue };
        films.push(page(Some(number), film, Some(&scene), json!(meshes)));
        numbers.push(number);
    }
    (films, numbers)
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

/// Returns the limit of a file if the files of a report may have `left` further bytes.
fn own(limit: Limit, left: u64) -> Limit {
    Limit { max_bytes: limit.max_bytes.min(left), ..limit }
}

fn of_experiments(folders: &[PathBuf]) -> Report {
    let mut left = MAX_TABLES;
    let mut missing = Vec::new();
    if folders.len() > MAX_EXPERIMENTS {
        let all = folders.len();
        missing.push(format!("only the first {MAX_EXPERIMENTS} of {all} experiments are shown"));
    }
    let mut experiments = Vec::new();
    for folder in folders.iter().take(MAX_EXPERIMENTS) {
        let name = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let mut reader = Reader { folder, missing: Vec::new() };
        let results = if folder.join(RESULTS).exists() {
            reader.take(RESULTS, own(Limit::FACTS, left), |bytes, _| {
                left -= bytes.len() as u64;
                serde_json::from_slice::<Table>(bytes).map_err(|e| e.to_string())
            })
        } else {
            reader.missing.push(format!(
                "{RESULTS}: the file is missing because the trials are unfinished; rerun `symbolt experiment` to resume"
            ));
            None
        };
        let figure = if folder.join("figure.svg").exists() {
            reader.take("figure.svg", own(Limit::FIGURE, left), |bytes, _| {
                left -= bytes.len() as u64;
                Ok(base64(bytes))
            })
        } else {
            None
        };
        missing.extend(reader.missing.into_iter().map(|why| format!("{name}/{why}")));
        experiments.push(json!({"folder": name, "results": results, "figure": figure}));
    }
    let data = json!({"kind": "experiments", "missing": missing, "experiments": experiments});
    Report { html: page::html(&data), missing }
}
