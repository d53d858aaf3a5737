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
use symbolt::spa::VocabError;
use symbolt::study::Tally;
use symbolt::task::event::{Ended, EpisodeReport, Ignore, Observer, Observers};
use symbolt::task::execute::{
    ActivityRecorder, Episode, EpisodeSpec, PreparedEpisode, demonstrate_sensed, episode_observed,
};
use symbolt::task::learn::Settings;
use symbolt::task::planner::{Decider, Planner, PlannerBuild, PlannerKind, PlannerSpec};
use symbolt::task::relational::RelationalDomain;
use symbolt::task::scene::Scene;
use symbolt::task::tasks::Task;
use symbolt::task::{
    Classifier, Domain, DomainBuilder, Grounding, Recorder, Snapshot, StateId, TaskError,
};

use super::Outcome;
use super::args::{BadArgument, Method, RunArgs};
use super::figures::Figures;
use super::learn::AnyLearned;
use super::output::{Progress, counted, emit, emit_json, use_threads};
use super::watch::ProgressLine;
use super::{config, folder, plan, report};
use super::{rank, ranks};

/// Time between two frames of the recorded episode, in simulated milliseconds.
const FRAME_MS: u64 = 40;
/// Greatest number of episodes. Long ones take 22 kB of the trace each, and `report` reads 32 MiB.
const MAX_EPISODES: usize = 1_000;

pub(crate) fn run(args: &RunArgs) -> Result<Outcome, Error> {
    if args.demos.task.listed() {
        return config::list(args.common.json);
    }
    check(args)?;
    let task = args.demos.task()?;
    let spec = episode_spec(args)?;
    check_dimensions(args, &*task)?;
    use_threads(&args.common)?;
    ranks::check_alike(None)?;
    let folder = rank::leads().then(|| folder::open(args)).transpose()?;
    let begun = Instant::now();
    let progress = Progress::new(&args.common);
    let seed = Seed::new(args.common.seed);
    let count = args.demos.demos;
    let mut line = ProgressLine::new(&progress);
    let shown = demonstrate_sensed(&*task, count, &spec.sensing, seed, &mut line)?;
    if shown.solved == 0 {
        let sentence =
            format!("none of {count} demonstrations solved the task, so there is nothing to learn");
        return Ok(Outcome::Failed(sentence));
    }
    let settings = Settings { seed: args.common.seed, ..Settings::default() };
    let learned = AnyLearned::from(args.method, &shown.recording, &settings, &mut line)?;
    if learned.goal().is_none() {
        return Ok(Outcome::Failed(
            "the demonstrations reached no state that could be the goal".into(),
        ));
    }
    progress.say("building the planner graph");
    let runner = Runner::new(args, &learned, &task)?;
    let looping = Instant::now();
    let (episodes, activity) = episodes(args, &runner, &spec, seed, &progress)?;
    let loop_s = looping.elapsed().as_secs_f64();
    let reports: Vec<EpisodeReport> = episodes.iter().map(|e| e.episode.report.clone()).collect();
    let reasons: Vec<String> = episodes.iter().map(|e| e.reason.clone()).collect();
    let recorded = args.record_episode - 1;
    let scene = first_scene(&spec, scene_seed(seed, recorded))?;
    let least = runner.least_skills(&scene)?;
    let tally = Tally::of(&reports, least);

    let failed = tally.failures.len();
    let outcome = match failed {
        0 => Outcome::Done,
        failed => {
            let sentence = format!("{failed} of {} failed", counted(tally.episodes, "episode"));
            Outcome::Failed(sentence)
        }
    };
    let Some(folder) = folder else { return Ok(outcome) };
    progress.say(format!("writing {}", folder.path().display()));
    let physics_s = episodes.iter().map(|e| e.episode.physics_wall.as_secs_f64()).sum();
    let (shown, learned, reports, tally) = (&shown, &learned, &reports, &tally);
    let result = Figures { shown, learned, reports, reasons, tally, loop_s, physics_s, least };
    let facts = result.facts(args, &*spec.task, scene_seed(seed, recorded), &activity);
    let frames = episodes.get(recorded).map_or(&[][..], |e| &e.episode.frames);
    let trace: String = episodes.iter().map(|e| e.tracer.text()).collect();
    let contents = [
        shown.recording.to_jsonl(None)?.into_bytes(),
        learned.to_json()?.into_bytes(),
        (scene.to_json()? + "\n").into_bytes(),
        trace.into_bytes(),
        Arrays::of(frames, &activity).to_npz()?,
        format!("{:#}\n", json!(facts)).into_bytes(),
    ];
    folder::write(&folder, contents)?;
    let page = symbolt::report::report(folder.path())?.html;
    write_atomic(&folder.path().join(report::NAME), page, Overwrite::Allowed)?;
    drop(progress);
    if args.common.json {
        emit_json(&[result.summary(args, folder.path())])?;
    } else {
        emit(&result.text(args, folder.path(), begun.elapsed().as_secs_f64()))?;
    }
    Ok(outcome)
}

/// Refuses options that cannot be used.
fn check(args: &RunArgs) -> Result<(), Error> {
    args.planner.check()?;
    args.demos.check(false)?;
    if args.method == Method::Relational {
        args.planner.check_relational("add --method paper")?;
    }
    if !(1..=MAX_EPISODES).contains(&args.episodes) {
        let expected = format!("1 to {MAX_EPISODES}");
        return Err(BadArgument::range("--episodes", args.episodes, &expected).into());
    }
    if !(1..=args.episodes).contains(&args.record_episode) {
        let least = if args.episodes > 1 { "1 to " } else { "" };
        let expected = format!("{least}{}, the number of --episodes", args.episodes);
        return Err(BadArgument::range("--record-episode", args.record_episode, &expected).into());
    }
    Ok(())
}

/// Number of states that a learned domain has beside those of the actions, at least or nearly so.
const MORE_STATES: usize = 3;

/// Refuses dimensions that are too few for a domain of the task, before anything is demonstrated. Only the planner `chain`
/// has dimensions, and only with the method `paper` does it keep to the given number.
fn check_dimensions(args: &RunArgs, task: &dyn Task) -> Result<(), Error> {
    if args.method != Method::Paper || args.planner.kind() != PlannerKind::Chain {
        return Ok(());
    }
    let actions = task.min_actions().max(1);
    let states: Vec<String> = (0..actions + MORE_STATES).map(|n| format!("STATE_{n}")).collect();
    let starts: Vec<&str> = states[..MORE_STATES].iter().map(String::as_str).collect();
    let domain = (0..actions).fold(DomainBuilder::new(), |domain, n| {
        let effect = states[n + MORE_STATES].as_str();
        domain.action(&format!("ACTION_{n}"), starts.iter().copied(), [effect])
    });
    match Planner::new(&domain.build()?, args.planner.spec(), Seed::new(args.common.seed)) {
        Err(
            TaskError::TooFewDimensions { .. }
            | TaskError::Vocabulary(VocabError::TooSimilar { .. }),
        ) => {
            let (dimensions, similarity) =
                (args.planner.dimensions(), args.planner.max_similarity());
            Err(BadArgument(format!(
                "--dimensions {dimensions}: too few for about {} states and {actions} actions with --max-similarity \
                 {similarity}; choose more dimensions, such as 256, or a higher similarity",
                states.len()
            ))
            .into())
        }
        built => Ok(built.map(drop)?),
    }
}

fn episode_spec(args: &RunArgs) -> Result<EpisodeSpec, Error> {
    let task = args.demos.with_parts([("--nuts", args.nuts), ("--bolts", args.bolts)])?;
    let spec = EpisodeSpec {
        task,
        drop_rate: args.drop_rate,
        sensing: args.demos.sensing.sensing()?,
        ..EpisodeSpec::default()
    };
    spec.check()?;
    if args.perturb && spec.task.perturbation(Seed::new(args.common.seed)).is_none() {
        let problem = format!("--perturb: the task {} has no perturbation", spec.task.name());
        return Err(BadArgument(problem).into());
    }
    Ok(spec)
}

fn episode_seed(seed: Seed, index: usize) -> Seed {
    seed.derive_index("episode", index as u64)
}

/// An episode with its trace.
struct Ran {
    episode: Episode,
    tracer: Tracer,
    /// Why the episode ended, in words.
    reason: String,
}

/// What runs the episodes: a planner graph for all of them, or a domain over which each episode builds its own.
enum Runner<'l> {
    Plain { planner: Arc<dyn Decider>, goal: StateId },
    Relational { domain: &'l RelationalDomain, build: Box<PlannerBuild>, least: usize },
}

impl<'l> Runner<'l> {
    fn new(args: &RunArgs, learned: &'l AnyLearned, task: &Arc<dyn Task>) -> Result<Self, Error> {
        Ok(match learned {
            AnyLearned::Paper(learned) => {
                let domain = &learned.domain;
                let Some(goal) = domain.goal() else {
                    return Err(BadArgument("the domain has no goal".into()).into());
                };
                let planner = args.planner.build(args.common.seed)?.over(domain)?;
                Self::Plain { planner, goal }
            }
            AnyLearned::Relational(learned) => {
                let build = Box::new(args.planner.build(args.common.seed)?);
                Self::Relational { domain: &learned.domain, build, least: task.min_actions() }
            }
        })
    }

    /// Runs one episode. `activity` is filled if the planner's activity is to be recorded.
    fn run(
        &self,
        spec: &EpisodeSpec,
        seed: Seed,
        index: usize,
        line: &mut dyn Observer,
        activity: Option<&mut Option<ActivityRecorder>>,
    ) -> Result<Ran, TaskError> {
        let mut tracer = Tracer::new(index);
        let prepared = match self {
            Self::Plain { .. } => None,
            Self::Relational { domain, build, .. } => {
                Some(PreparedEpisode::new(domain, build, spec, seed)?)
            }
        };
        let planner = match (self, &prepared) {
            (Self::Plain { planner, .. }, _) => Some(planner.clone()),
            (_, prepared) => prepared.as_ref().map(|p| p.planner().clone()),
        };
        let mut recorder = planner.filter(|_| activity.is_some()).map(ActivityRecorder::new);
        let mut observers = Observers(vec![line, &mut tracer]);
        if let Some(recorder) = &mut recorder {
            observers.0.push(recorder);
        }
        let (episode, reason) = match (self, prepared) {
            (_, Some(prepared)) => {
                let over = prepared.run(&mut observers)?;
                let ended = &over.episode.report.ended;
                let ground = over.grounds.last().map(|ground| ground.domain());
                let reason = ended_text(ended, ground);
                (over.episode, reason)
            }
            (Self::Plain { planner, goal }, None) => {
                let grounding = Grounding::default();
                let over = episode_observed(
                    planner.clone(),
                    grounding,
                    *goal,
                    spec,
                    seed,
                    &mut observers,
                )?;
                let reason = ended_text(&over.report.ended, Some(planner.domain()));
                (over, reason)
            }
            // Every relational episode was prepared above.
            (Self::Relational { .. }, None) => {
                return Err(TaskError::Problem { reason: "the episode was not prepared".into() });
            }
        };
        drop(observers);
        if let Some(activity) = activity {
            *activity = recorder;
        }
        Ok(Ran { episode, tracer, reason })
    }

    /// Returns the least number of actions that solve the recorded scene.
    fn least_skills(&self, scene: &Snapshot) -> Result<usize, TaskError> {
        match self {
            Self::Relational { least, .. } => Ok(*least),
            Self::Plain { planner, goal } => {
                let classifier = Classifier::new(planner.domain(), Grounding::default())?;
                let (counts, _) = plan::count(&classifier, planner.domain(), scene);
                // The count is the same in every mode and for every planner.
                let planner = Planner::new(planner.domain(), PlannerSpec::default(), Seed::new(1))?;
                Ok(planner.plan(&counts, *goal)?.steps.len())
            }
        }
    }
}

/// Returns why an episode ended, in words. Obstacles refer to `domain`.
fn ended_text(ended: &Ended, domain: Option<&Domain>) -> String {
    match (ended, domain) {
        (Ended::GoalMet, _) => "the planner took the goal as met, although it is not".into(),
        (Ended::Stuck(obstacle), Some(domain)) => plan::obstacle_text(domain, *obstacle),
        (Ended::Stuck(_), None) => "the goal cannot be reached".into(),
        (Ended::NoWay { action }, _) => {
            format!("no part could be grasped and placed for {action}")
        }
        (Ended::Occupied { action }, _) => {
            format!("another part lies where {action} puts its part")
        }
        (Ended::Lost { objects }, _) => {
            format!("{} fell off the table, and the goal needs more parts", objects.join(", "))
        }
        (Ended::GaveUp, _) => "the limit on time or skills was reached".into(),
    }
}

/// Runs all episodes. Returns them, and the planner's activity in the recorded one.
fn episodes(
    args: &RunArgs,
    runner: &Runner<'_>,
    spec: &EpisodeSpec,
    seed: Seed,
    progress: &Progress,
) -> Result<(Vec<Ran>, ActivityRecorder), Error> {
    let chosen = args.record_episode - 1;
    let run =
        |index: usize, line: &mut dyn Observer, activity: Option<&mut Option<ActivityRecorder>>| {
            let frame_ms = (index == chosen).then_some(FRAME_MS);
            let own = episode_seed(seed, index);
            let perturbation = args.perturb.then(|| spec.task.perturbation(own)).flatten();
            let spec = EpisodeSpec { frame_ms, perturbation, ..spec.clone() };
            runner.run(&spec, own, index, line, activity)
        };
    let (done, all) = (AtomicUsize::new(0), args.episodes);
    let recorded = || {
        let mut activity = None;
        let name = format!("episode {} of {all}", args.record_episode);
        let mut line = ProgressLine::of_episode(progress, name);
        let over = run(chosen, &mut line, Some(&mut activity))?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if all > 1 {
            progress.say(format!("{done} of {all} episodes done"));
        }
        Ok::<_, TaskError>((over, activity))
    };
    let other = |index: usize| {
        let over = run(index, &mut Ignore, None)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress.say(format!("{done} of {all} episodes done"));
        Ok(over)
    };
    let rest = |index: &usize| *index != chosen;
    let others = || {
        let others = (0..all).into_par_iter().filter(rest).map(other);
        others.collect::<Result<Vec<_>, TaskError>>()
    };
    let in_order = || (0..all).filter(rest).map(other).collect();
    let (recorded, others) = match (all, rank::own()) {
        // Alone, the episode has all threads for its ticks. Ranks must run their episodes in the same order.
        (1, _) => (recorded(), Ok(Vec::new())),
        (_, Some(_)) => (recorded(), in_order()),
        _ => rayon::join(recorded, others),
    };
    let ((recorded, activity), mut episodes) = (recorded?, others?);
    episodes.insert(chosen, recorded);
    let activity = activity.ok_or_else(|| BadArgument("no activity was recorded".into()))?;
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
