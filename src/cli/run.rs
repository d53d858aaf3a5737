//! `symbolt run`: demonstrations in physics, learning, and episodes in which the robot plans again after every step.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::Error;
use rayon::prelude::*;
use serde_json::json;
use symbolt::files::{Overwrite, write_atomic};
use symbolt::report::Arrays;
use symbolt::report::trace::Tracer;
use symbolt::sim::Seed;
use symbolt::study::Tally;
use symbolt::task::event::{EpisodeReport, Ignore, Observer, Observers};
use symbolt::task::execute::{
    ActivityRecorder, Episode, EpisodeSpec, demonstrate_observed, episode_observed,
};
use symbolt::task::learn::{Settings, learn_observed};
use symbolt::task::planner::Planner;
use symbolt::task::scene::Scene;
use symbolt::task::{Classifier, Grounding, Recorder, Snapshot, StateId, TaskError};

use super::Outcome;
use super::args::{BadArgument, RunArgs};
use super::figures::Figures;
use super::output::{Progress, counted, emit, emit_json, use_threads};
use super::watch::ProgressLine;
use super::{folder, plan, report};

/// Time between two frames of the recorded episode, in simulated milliseconds.
const FRAME_MS: u64 = 40;

pub(crate) fn run(args: &RunArgs) -> Result<Outcome, Error> {
    check(args)?;
    let folder = folder::folder(args)?;
    let task = args.demos.task()?;
    let spec = episode_spec(args)?;
    use_threads(&args.common)?;
    let begun = Instant::now();
    let progress = Progress::new(&args.common);
    let seed = Seed::new(args.common.seed);
    let count = args.demos.demos;
    let mut line = ProgressLine::new(&progress);
    let shown = demonstrate_observed(&task, count, seed, &mut line)?;
    if shown.solved == 0 {
        let sentence =
            format!("none of {count} demonstrations solved the task, so there is nothing to learn");
        return Ok(Outcome::Failed(sentence));
    }
    let settings = Settings { seed: args.common.seed, ..Settings::default() };
    let learned = learn_observed(&shown.recording, &settings, &mut line)?;
    let domain = &learned.domain;
    let Some(goal) = domain.goal() else {
        return Ok(Outcome::Failed(
            "the demonstrations reached no state that could be the goal".into(),
        ));
    };
    progress.say("building the planner graph");
    let planner = Arc::new(plan::build(domain, &args.planner, args.common.seed)?);
    let looping = Instant::now();
    let (episodes, activity) = episodes(args, &planner, goal, &spec, seed, &progress)?;
    let loop_s = looping.elapsed().as_secs_f64();
    let reports: Vec<EpisodeReport> = episodes.iter().map(|(e, _)| e.report.clone()).collect();
    let recorded = args.record_episode - 1;
    let scene = first_scene(&spec, scene_seed(seed, recorded))?;
    let least = least_skills(&planner, &scene, goal)?;
    let tally = Tally::of(&reports, least);

    progress.say(format!("writing {}", folder.display()));
    let result = Figures {
        shown: &shown,
        learned: &learned,
        reports: &reports,
        tally: &tally,
        loop_s,
        physics_s: episodes.iter().map(|(e, _)| e.physics_wall.as_secs_f64()).sum(),
        least,
    };
    let facts =
        result.facts(args, &domain[goal].name, &*spec.task, scene_seed(seed, recorded), &activity);
    let frames = episodes.get(recorded).map_or(&[][..], |(e, _)| &e.frames);
    let trace: String = episodes.iter().map(|(_, tracer)| tracer.text()).collect();
    let contents = [
        shown.recording.to_jsonl(None)?.into_bytes(),
        domain.to_json()?.into_bytes(),
        (scene.to_json()? + "\n").into_bytes(),
        trace.into_bytes(),
        Arrays::of(frames, &activity).to_npz()?,
        format!("{:#}\n", json!(facts)).into_bytes(),
    ];
    folder::write(&folder, contents)?;
    let page = symbolt::report::report(&folder)?.html;
    write_atomic(&folder.join(report::NAME), page, Overwrite::Allowed)?;
    drop(progress);
    if args.common.json {
        emit_json(&[result.summary(args, &folder)])?;
    } else {
        let text = result.text(args, &folder, &domain[goal].name, begun.elapsed().as_secs_f64());
        emit(&text)?;
    }
    match tally.failures.len() {
        0 => Ok(Outcome::Done),
        failed => {
            let sentence = format!("{failed} of {} failed", counted(tally.episodes, "episode"));
            Ok(Outcome::Failed(sentence))
        }
    }
}

/// Refuses options that cannot be used.
fn check(args: &RunArgs) -> Result<(), Error> {
    args.planner.check()?;
    for (option, count) in [("--demos", args.demos.demos), ("--episodes", args.episodes)] {
        if !(1..=100_000).contains(&count) {
            return Err(BadArgument::range(option, count, "1 to 100000").into());
        }
    }
    if !(1..=args.episodes).contains(&args.record_episode) {
        let least = if args.episodes > 1 { "1 to " } else { "" };
        let expected = format!("{least}{}, the number of --episodes", args.episodes);
        return Err(BadArgument::range("--record-episode", args.record_episode, &expected).into());
    }
    Ok(())
}

fn episode_spec(args: &RunArgs) -> Result<EpisodeSpec, TaskError> {
    let mut task = args.demos.configured()?;
    task.nuts = args.nuts.unwrap_or(task.nuts);
    task.bolts = args.bolts.unwrap_or(task.bolts);
    let spec = EpisodeSpec { drop_rate: args.drop_rate, ..EpisodeSpec::of(task) };
    spec.check().map(|()| spec)
}

fn episode_seed(seed: Seed, index: usize) -> Seed {
    seed.derive_index("episode", index as u64)
}

/// Runs all episodes. Returns them with their traces, and the planner's activity in the recorded one.
fn episodes(
    args: &RunArgs,
    planner: &Arc<Planner>,
    goal: StateId,
    spec: &EpisodeSpec,
    seed: Seed,
    progress: &Progress,
) -> Result<(Vec<(Episode, Tracer)>, ActivityRecorder), TaskError> {
    let chosen = args.record_episode - 1;
    let run = |index: usize, other: &mut dyn Observer| {
        let frame_ms = (index == chosen).then_some(FRAME_MS);
        let own = episode_seed(seed, index);
        let perturbation = args.perturb.then(|| spec.task.perturbation(own)).flatten();
        let spec = EpisodeSpec { frame_ms, perturbation, ..spec.clone() };
        let mut tracer = Tracer::new(index);
        let mut observers = Observers(vec![other, &mut tracer]);
        let over =
            episode_observed(planner, Grounding::default(), goal, &spec, own, &mut observers)?;
        Ok::<_, TaskError>((over, tracer))
    };
    let (done, all) = (AtomicUsize::new(0), args.episodes);
    let recorded = || {
        let mut activity = ActivityRecorder::new(planner.clone());
        let name = format!("episode {} of {all}", args.record_episode);
        let mut line = ProgressLine::of_episode(progress, name);
        let over = run(chosen, &mut Observers(vec![&mut activity, &mut line]))?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if all > 1 {
            progress.say(format!("{done} of {all} episodes done"));
        }
        Ok::<_, TaskError>((over, activity))
    };
    let others = || {
        (0..all)
            .into_par_iter()
            .filter(|index| *index != chosen)
            .map(|index| {
                let over = run(index, &mut Ignore)?;
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress.say(format!("{done} of {all} episodes done"));
                Ok(over)
            })
            .collect::<Result<Vec<_>, TaskError>>()
    };
    let (recorded, others) = rayon::join(recorded, others);
    let ((recorded, activity), mut episodes) = (recorded?, others?);
    episodes.insert(chosen, recorded);
    Ok((episodes, activity))
}

/// Returns the seed of an episode's scene.
fn scene_seed(seed: Seed, index: usize) -> Seed {
    episode_seed(seed, index).derive("", "world")
}

/// Returns the first snapshot of the episode whose scene has this seed.
fn first_scene(spec: &EpisodeSpec, seed: Seed) -> Result<Snapshot, TaskError> {
    let scene = Scene::new(spec.task.scene(seed)?)?;
    Ok(Recorder::default().look(&scene).0)
}

/// Returns the number of actions in the plan for a scene.
fn least_skills(planner: &Planner, scene: &Snapshot, goal: StateId) -> Result<usize, TaskError> {
    let classifier = Classifier::new(planner.domain(), Grounding::default())?;
    let (counts, _) = plan::count(&classifier, planner.domain(), scene);
    Ok(planner.plan(&counts, goal)?.steps.len())
}
