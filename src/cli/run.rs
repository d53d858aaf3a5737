//! `symbolt run`: the main job. Demonstrations in physics, learning, and episodes in which the robot does
//! what it has learned, planning anew at every step.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::Error;
use rayon::prelude::*;
use serde_json::json;
use symbolt::report::{Arrays, trace};
use symbolt::sim::{Seed, SimView};
use symbolt::study::Tally;
use symbolt::task::execute::{
    AssemblyWorld, Episode, EpisodeReport, EpisodeSpec, Thoughts, episode_watched,
};
use symbolt::task::learn::Settings;
use symbolt::task::planner::Planner;
use symbolt::task::scene::Scene;
use symbolt::task::{
    Classifier, Grounding, Overwrite, Recorder, Snapshot, TaskError, demonstrate, write_whole,
};

use super::Outcome;
use super::args::{BadArgument, RunArgs};
use super::figures::Figures;
use super::output::{Progress, counted, emit, emit_json, use_threads};
use super::watch::{Watch, demonstrations};
use super::{learn, plan, report};

/// The files that a run leaves in its folder.
pub(crate) const FILES: [&str; 7] = [
    "recording.jsonl",
    "domain.json",
    "scene.json",
    "trace.jsonl",
    "arrays.npz",
    "run.json",
    report::NAME,
];

/// Milliseconds between the frames that are kept of the filmed episode.
const FRAME_MS: u64 = 40;

pub(crate) fn run(args: &RunArgs) -> Result<Outcome, Error> {
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("out"));
    check(args, &folder)?;
    let task = args.demos.task()?;
    let spec = episode_spec(args)?;
    use_threads(&args.common)?;
    let begun = Instant::now();
    let progress = Progress::new(&args.common);
    let seed = Seed::new(args.common.seed);
    let count = args.demos.demos;
    let shown = demonstrate(&task, count, seed, &mut demonstrations(&progress, count))?;
    if shown.solved == 0 {
        let sentence =
            format!("none of {count} demonstrations was assembled: nothing to learn from");
        return Ok(Outcome::Failed(sentence));
    }
    let settings = Settings { seed: args.common.seed, ..Settings::default() };
    let learned = learn::learn_with_progress(&shown.recording, &settings, &progress)?;
    let domain = &learned.domain;
    let Some(goal) = domain.goal().map(str::to_owned) else {
        return Ok(Outcome::Failed("the demonstrations achieved nothing to plan for".into()));
    };
    progress.say("building the planner graph");
    let planner = Arc::new(plan::build(domain, &args.planner, args.common.seed)?);
    let looping = Instant::now();
    let (episodes, thoughts) = episodes(args, &planner, &goal, &spec, seed, &progress)?;
    let loop_s = looping.elapsed().as_secs_f64();
    let reports: Vec<EpisodeReport> = episodes.iter().map(|e| e.report.clone()).collect();
    let filmed = args.film - 1;
    let scene = first_scene(&spec, scene_seed(seed, filmed))?;
    let least = least_skills(&planner, &scene, &goal)?;
    let tally = Tally::of(&reports, least);

    progress.say(format!("writing {}", folder.display()));
    std::fs::create_dir_all(&folder).map_err(|source| TaskError::Io {
        what: "write",
        path: folder.clone(),
        source,
    })?;
    let result = Figures {
        shown: &shown,
        learned: &learned,
        reports: &reports,
        tally: &tally,
        loop_s,
        physics_s: episodes.iter().map(|e| e.physics_wall.as_secs_f64()).sum(),
        least,
    };
    let facts = result.facts(args, &goal, &*spec.task, scene_seed(seed, filmed), &thoughts);
    let frames = episodes.get(filmed).map_or(&[][..], |e| &e.frames);
    let contents = [
        shown.recording.to_jsonl(None).into_bytes(),
        domain.to_json().into_bytes(),
        (scene.to_json() + "\n").into_bytes(),
        trace::write(reports.iter()).into_bytes(),
        Arrays::of(frames, &thoughts).to_npz()?,
        format!("{:#}\n", json!(facts)).into_bytes(),
    ];
    // Whoever is killed here leaves files missing, not those of two runs side by side.
    let plain = |path: &PathBuf| path.symlink_metadata().is_ok_and(|m| m.is_file());
    for path in FILES.iter().map(|file| folder.join(file)).filter(plain) {
        std::fs::remove_file(&path).map_err(|source| TaskError::Io {
            what: "remove",
            path,
            source,
        })?;
    }
    for (file, content) in FILES.iter().zip(contents) {
        write_whole(&folder.join(file), content, Overwrite::Allowed)?;
    }
    let page = symbolt::report::report(&folder)?.html;
    write_whole(&folder.join(report::NAME), page, Overwrite::Allowed)?;
    drop(progress);
    if args.common.json {
        emit_json(&[result.summary(args, &folder)])?;
    } else {
        let text = result.text(args, &folder, &goal, begun.elapsed().as_secs_f64());
        emit(&text)?;
    }
    match tally.failures.len() {
        0 => Ok(Outcome::Done),
        failed => {
            let sentence =
                format!("{failed} of {} not assembled", counted(tally.episodes, "episode"));
            Ok(Outcome::Failed(sentence))
        }
    }
}

/// What can be refused before any work is done.
fn check(args: &RunArgs, folder: &Path) -> Result<(), Error> {
    if args.out.is_some()
        && !args.force
        && let Some(there) = FILES.iter().map(|f| folder.join(f)).find(|f| f.exists())
    {
        return Err(TaskError::Exists { path: there }.into());
    }
    if folder.exists() && !folder.is_dir() {
        return Err(BadArgument(format!("{} is no folder", folder.display())).into());
    }
    for (name, count) in [("--demos", args.demos.demos), ("--episodes", args.episodes)] {
        if count == 0 || count > 100_000 {
            return Err(BadArgument(format!("{name} is {count}; 1 to 100000 are possible")).into());
        }
    }
    if !(1..=args.episodes).contains(&args.film) {
        let (film, all) = (args.film, args.episodes);
        return Err(BadArgument(format!("--film is {film}; 1 to {all} (--episodes) exist")).into());
    }
    Ok(())
}

fn episode_spec(args: &RunArgs) -> Result<EpisodeSpec, TaskError> {
    let mut task = args.demos.setting()?;
    task.nuts = args.nuts.unwrap_or(task.nuts);
    task.bolts = args.bolts.unwrap_or(task.bolts);
    let spec = EpisodeSpec { drop_rate: args.drop_rate, ..EpisodeSpec::of(task) };
    spec.check().map(|()| spec)
}

fn episode_seed(seed: Seed, index: usize) -> Seed {
    seed.derive_index("episode", index as u64)
}

/// All episodes, and what the planner thought in the filmed one.
fn episodes(
    args: &RunArgs,
    planner: &Arc<Planner>,
    goal: &str,
    spec: &EpisodeSpec,
    seed: Seed,
    progress: &Progress,
) -> Result<(Vec<Episode>, Thoughts), TaskError> {
    let filmed = args.film - 1;
    let run = |index: usize, watch: &mut dyn FnMut(&SimView<'_>, &AssemblyWorld)| {
        let frame_ms = (index == filmed).then_some(FRAME_MS);
        let own = episode_seed(seed, index);
        let perturbation = args.perturb.then(|| spec.task.perturbation(own)).flatten();
        let spec = EpisodeSpec { frame_ms, perturbation, ..spec.clone() };
        episode_watched(planner, Grounding::default(), goal, &spec, own, watch)
    };
    let (done, all) = (AtomicUsize::new(0), args.episodes);
    let watched = || {
        let mut thoughts = Thoughts::of(planner);
        let what = format!("episode {} of {all}", args.film);
        progress.say(&what);
        let mut watch = Watch::new(progress, what);
        let over = run(filmed, &mut |view, world| {
            thoughts.watch(planner, view, world);
            watch.tick(view, world);
        })?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if all > 1 {
            progress.say(format!("{done} of {all} episodes done"));
        }
        Ok::<_, TaskError>((over, thoughts))
    };
    let others = || {
        (0..all)
            .into_par_iter()
            .filter(|index| *index != filmed)
            .map(|index| {
                let over = run(index, &mut |_, _| {})?;
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress.say(format!("{done} of {all} episodes done"));
                Ok(over)
            })
            .collect::<Result<Vec<_>, TaskError>>()
    };
    let (watched, others) = rayon::join(watched, others);
    let ((watched, thoughts), mut episodes) = (watched?, others?);
    episodes.insert(filmed, watched);
    Ok((episodes, thoughts))
}

/// What the scene of an episode is drawn from.
fn scene_seed(seed: Seed, index: usize) -> Seed {
    episode_seed(seed, index).derive("", "world")
}

/// What is to be seen at the beginning of the episode whose scene is drawn from this seed.
fn first_scene(spec: &EpisodeSpec, seed: Seed) -> Result<Snapshot, TaskError> {
    let scene = Scene::new(spec.task.scene(seed)?)?;
    Ok(Recorder::default().look(&scene).0)
}

/// How many skills the plan for a scene has.
fn least_skills(planner: &Planner, scene: &Snapshot, goal: &str) -> Result<usize, TaskError> {
    let classifier = Classifier::new(planner.domain(), Grounding::default())?;
    let (counts, _) = plan::count(&classifier, planner.domain(), scene);
    Ok(planner.plan(&counts, goal)?.steps.len())
}
