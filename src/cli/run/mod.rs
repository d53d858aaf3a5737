//! `symbolt run`: demonstrations in physics, learning, and episodes in which the robot plans again after every step.

mod args;
mod figures;
mod folder;
mod stream;
#[cfg(feature = "view")]
mod view;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::{Error, bail, ensure};
use rayon::prelude::*;
use serde_json::json;
use symbolt::files::{Overwrite, write_atomic};
use symbolt::report::trace::Tracer;
use symbolt::report::{Arrays, Filmed, RunWords};
use symbolt::robot::scene::{Scene, SceneFrame};
use symbolt::sim::{InterventionLog, LiveError, LogError, Seed};
use symbolt::study::Tally;
use symbolt::task::domain::RelationalDomain;
use symbolt::task::event::{Ended, EpisodeReport, Observer, Observers};
use symbolt::task::execute::{
    ActivityRecorder, Demonstrated, Episode, EpisodeSpec, PreparedEpisode, Unsolved,
    demonstrate_sensed,
};
use symbolt::task::learn::{Learned, Settings, learn_observed};
use symbolt::task::planner::PlannerBuild;
use symbolt::task::{Recorder, Snapshot, TaskError};

pub(super) use self::args::{RunArgs, ViewArgs};
use self::figures::Figures;
use self::stream::Stream;
#[cfg(feature = "view")]
pub(super) use self::view::view;
use super::end::{BadArgument, Outcome};
use super::kind::{Kind, beginning};
use super::output::{Progress, answer, use_threads, warn};
use super::table::counted;
use super::watch::ProgressLine;
use super::{config, rank, ranks, report};

/// Time between two frames of the recorded episode, in simulated milliseconds.
const FRAME_MS: u64 = 40;
/// Time between two frames of another episode, in simulated milliseconds.
const OTHER_FRAME_MS: u64 = 200;
/// Number of the first episodes that may be filmed, and greatest number of other episodes whose frames are written. Those
/// that failed go before the rest.
const FILMED: (usize, usize) = (100, 20);

pub(crate) fn run(args: &RunArgs) -> Result<Outcome, Error> {
    if args.demos.task.listed() {
        return config::list(args.common.json);
    }
    check(args)?;
    let task = args.demos.task()?;
    let spec = episode_spec(args)?;
    use_threads(&args.common)?;
    ranks::check_alike(None)?;
    let folder = rank::leads().then(|| folder::open(args)).transpose()?;
    let stream = args.stream.as_deref().filter(|_| rank::leads());
    stream.map_or(Ok(()), stream::checked)?;
    let begun = Instant::now();
    let progress = Progress::new(&args.common);
    let (shown, learned) = match teach(args, &spec, &progress)? {
        Ok(taught) => taught,
        Err(nothing) => return Ok(nothing),
    };
    progress.say("building the planner graph");
    let runner = Runner {
        args,
        spec: &spec,
        domain: &args.planner.domain(&learned.domain),
        build: args.planner.build(args.common.seed)?,
    };
    let looping = Instant::now();
    let (episodes, activity) =
        episodes(&runner, &progress).map_err(|error| of_interventions(error, args))?;
    let not_made: usize = episodes.iter().map(|ran| ran.episode.not_made).sum();
    if not_made > 0 {
        let some = counted(not_made, "intervention");
        warn(&format!("{some} not made: the episode, or its first planner graph, ended before"));
    }
    let interventions = args.interventions.is_some();
    let interventions = interventions.then(|| spec.interventions.entries().len() - not_made);
    let loop_s = looping.elapsed().as_secs_f64();
    let reports: Vec<EpisodeReport> = episodes.iter().map(|e| e.episode.report.clone()).collect();
    let grounds = episodes.iter().flat_map(|e| &e.episode.grounds).map(|ground| &**ground);
    let words = RunWords::of(&learned.domain, grounds, &activity);
    let reasons: Vec<String> = episodes.iter().map(|e| e.reason.clone()).collect();
    let recorded = args.record_episode - 1;
    let scene_seed = scene_seed(args, recorded);
    let scene = first_scene(&spec, scene_seed)?;
    let least = task.min_actions();
    let tally = Tally::of(&reports, least);

    let outcome = match tally.failures.len() {
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
    let result = Figures {
        shown,
        learned,
        reports,
        reasons,
        tally,
        loop_s,
        physics_s,
        least,
        words,
        interventions,
        saturated: activity.saturated().cloned().collect(),
    };
    let also = also_filmed(&episodes, recorded);
    let seeds = also.iter().map(|episode| {
        let scene_seed = self::scene_seed(args, *episode).value();
        Filmed { episode: *episode, scene_seed }
    });
    let facts = result.facts(args, &*spec.task, scene_seed, &activity, seeds.collect());
    let frames = |episode: usize| episodes.get(episode).map_or(&[][..], |e| &e.episode.frames);
    let arrays = also.iter().fold(Arrays::of(frames(recorded), &activity), |arrays, episode| {
        arrays.with_episode(*episode, frames(*episode))
    });
    let trace: String = episodes.iter().map(|episode| episode.tracer.text()).collect();
    let contents = [
        shown.recording.to_jsonl(None)?.into_bytes(),
        learned.domain.to_json()?.into_bytes(),
        (scene.to_json()? + "\n").into_bytes(),
        trace.into_bytes(),
        arrays.to_npz()?,
        format!("{:#}\n", json!(facts)).into_bytes(),
    ];
    folder::write(&folder, contents)?;
    let page = symbolt::report::report(folder.path())?.html;
    write_atomic(&folder.path().join(report::NAME), page, Overwrite::Allowed)?;
    drop(progress);
    let json = || result.summary(args, folder.path());
    answer(&args.common, json, || result.text(args, folder.path(), begun.elapsed().as_secs_f64()))?;
    let unwritten = episodes.into_iter().find_map(|ran| ran.unwritten);
    let Some(fault) = unwritten else { return Ok(outcome) };
    if let Outcome::Failed(sentence) = &outcome {
        warn(sentence);
    }
    Err(Error::msg(fault))
}

/// Refuses `symbolt view`: this build does not have it.
#[cfg(not(feature = "view"))]
pub(crate) fn view(_: &ViewArgs) -> Result<Outcome, Error> {
    bail!(BadArgument(
        "view: this build of symbolt shows no live runs; use one with `--features view`".into()
    ));
}

/// Shows demonstrations and learns from them. Returns both, or how the command ends if there is nothing to go on with.
fn teach(
    args: &RunArgs,
    spec: &EpisodeSpec,
    progress: &Progress,
) -> Result<Result<(Demonstrated, Learned), Outcome>, Error> {
    let seed = Seed::new(args.common.seed);
    let count = args.demos.demos;
    let mut line = ProgressLine::new(progress);
    let shown = demonstrate_sensed(&*args.demos.task()?, count, &spec.sensing, seed, &mut line)?;
    let whys = |of: &[Unsolved]| -> String { of.iter().map(|why| format!("\n{why}")).collect() };
    if !shown.shown_again.is_empty() {
        let again = counted(shown.shown_again.len(), "demonstration");
        let whys = whys(&shown.shown_again);
        warn(&format!("{again} did not solve the task, so another was shown in its place{whys}"));
    }
    if shown.solved < count {
        let whys = whys(&shown.unsolved);
        let some = match (count, shown.solved) {
            (1, _) => "the demonstration did not solve the task".into(),
            (_, 0) => format!("none of {count} demonstrations solved the task"),
            (_, some) => format!("{some} of {count} demonstrations solved the task"),
        };
        // What most of them end with is then not the goal.
        if 2 * shown.solved < count {
            let sentence = format!("{some}, so there is nothing to learn{whys}");
            return Ok(Err(Outcome::Failed(sentence)));
        }
        warn(&format!("{some}, so what is learned as the goal may be a part of it{whys}"));
    }
    let settings = Settings { method: args.method, seed: args.common.seed, ..Settings::default() };
    let learned = learn_observed(&shown.recording, &settings, &mut line)?;
    // The text of the run has them.
    if args.common.json || learned.domain.goals.is_empty() {
        learned.remarks.iter().for_each(|remark| warn(&remark.to_string()));
    }
    if learned.domain.goals.is_empty() {
        let sentence = "the demonstrations reached no state that could be the goal".into();
        return Ok(Err(Outcome::Failed(sentence)));
    }
    Ok(Ok((shown, learned)))
}

/// Refuses options that cannot be used.
fn check(args: &RunArgs) -> Result<(), Error> {
    args.planner.check()?;
    args.demos.check(false)?;
    let least = if args.episodes > 1 { "1 to " } else { "" };
    let expected = format!("{least}{}, the number of --episodes", args.episodes);
    ensure!(
        (1..=args.episodes).contains(&args.record_episode),
        BadArgument::range("--record-episode", args.record_episode, &expected)
    );
    Ok(())
}

fn episode_spec(args: &RunArgs) -> Result<EpisodeSpec, Error> {
    let task = args.demos.with_parts([("--nuts", args.nuts), ("--bolts", args.bolts)])?;
    let spec = EpisodeSpec {
        task,
        drop_rate: args.drop_rate,
        sensing: args.demos.sensing.sensing()?,
        interventions: match &args.interventions {
            Some(file) => InterventionLog::read(file).map_err(|why| unusable(file, why))?,
            None => InterventionLog::default(),
        },
        ..EpisodeSpec::default()
    };
    spec.check()?;
    if args.perturb && spec.task.perturbation(Seed::new(args.common.seed)).is_none() {
        let problem = format!("--perturb: the task {} has no perturbation", spec.task.name());
        bail!(BadArgument(problem));
    }
    Ok(spec)
}

/// An error of an episode, which names the file if its interventions cannot be followed.
fn of_interventions(error: TaskError, args: &RunArgs) -> Error {
    match (error, &args.interventions) {
        (TaskError::Live(LiveError::Log(why)), Some(file)) => unusable(file, why),
        (error, _) => error.into(),
    }
}

/// A log of interventions that cannot be read or followed.
fn unusable(file: &Path, why: LogError) -> Error {
    let found = beginning(file).map_or(Kind::Json, |bytes| Kind::of(&bytes).kind);
    if matches!(why, LogError::Line { .. }) && found != Kind::Json {
        let (file, found) = (file.display(), found.name());
        let problem = format!("{file} is {found}; expected a log of interventions");
        return BadArgument(format!("--interventions: {problem}")).into();
    }
    BadArgument(format!("--interventions {}: {why}", file.display())).into()
}

fn episode_seed(args: &RunArgs, index: usize) -> Seed {
    Seed::new(args.common.seed).derive_index("episode", index as u64)
}

/// An episode with its trace.
struct Ran {
    episode: Episode,
    tracer: Tracer,
    /// Why the episode ended, in words.
    reason: String,
    /// Why the files of `--stream` are not whole, if they are not.
    unwritten: Option<String>,
}

impl Ran {
    /// Adds to the reason the undecided conditions that the planner did without in an action of the episode: if the episode
    /// failed, they may have been needed.
    fn explained(mut self, domain: &RelationalDomain) -> Self {
        let dropped: BTreeSet<_> = self.episode.grounds.iter().flat_map(|g| g.dropped()).collect();
        let chosen = self.episode.report.decisions.iter().filter_map(|d| d.chosen.as_ref());
        let done: BTreeSet<&str> = chosen.map(|chosen| &*chosen.operator).collect();
        for (o, n) in dropped {
            let operator = &domain.operators[*o];
            if done.contains(&*operator.name) {
                let need = domain.need_in_words(operator, &operator.needs[*n]);
                let _ = write!(
                    self.reason,
                    "; \"{}\" was done without an undecided condition, \"{need}\", which may be needed",
                    domain.operator_in_words(operator)
                );
            }
        }
        self
    }
}

/// What runs the episodes. Each builds its own planner graph, over the objects of its scene.
struct Runner<'l> {
    args: &'l RunArgs,
    spec: &'l EpisodeSpec,
    domain: &'l RelationalDomain,
    build: PlannerBuild,
}

impl Runner<'_> {
    /// Prepares an episode. The recorded one keeps more frames than others, and only it has interventions.
    fn prepared(&self, index: usize) -> Result<PreparedEpisode<'_>, TaskError> {
        let own = episode_seed(self.args, index);
        let recorded = index == self.args.record_episode - 1;
        let frame_ms = match recorded {
            true => Some(FRAME_MS),
            false => (index < FILMED.0).then_some(OTHER_FRAME_MS),
        };
        let perturbation = self.args.perturb.then(|| self.spec.task.perturbation(own)).flatten();
        let interventions = match recorded {
            true => self.spec.interventions.clone(),
            false => InterventionLog::default(),
        };
        let spec = EpisodeSpec { frame_ms, perturbation, interventions, ..self.spec.clone() };
        PreparedEpisode::new(self.domain, &self.build, &spec, own)
    }
}

/// Returns the episodes beside the recorded one whose frames are written, in ascending order.
fn also_filmed(episodes: &[Ran], recorded: usize) -> Vec<usize> {
    let others = episodes
        .iter()
        .enumerate()
        .filter(|(i, ran)| *i != recorded && !ran.episode.frames.is_empty());
    let mut others: Vec<(bool, usize)> =
        others.map(|(i, ran)| (ran.episode.report.succeeded(), i)).collect();
    others.sort_unstable();
    let mut kept: Vec<usize> = others.into_iter().take(FILMED.1).map(|(_, i)| i).collect();
    kept.sort_unstable();
    kept
}

/// Runs an episode, traces it, and shows it to these observers.
fn traced(
    prepared: PreparedEpisode<'_>,
    index: usize,
    observers: Vec<&mut dyn Observer>,
) -> Result<Ran, TaskError> {
    let mut tracer = Tracer::new(index);
    let mut all: Vec<&mut dyn Observer> = vec![&mut tracer];
    all.extend(observers.into_iter().map(|observer| observer as &mut dyn Observer));
    let episode = prepared.run(&mut Observers(all))?;
    let ended = reason_in_words(&episode.report);
    let reason = match episode.report.unclaimed() {
        true => format!("the task was solved, but the robot did not take it as solved: {ended}"),
        false => ended,
    };
    Ok(Ran { episode, tracer, reason, unwritten: None })
}

/// An episode that fails before it begins, because what is seen gives no problem. The others go on.
fn without_problem(why: &TaskError, index: usize, frames: Vec<SceneFrame>) -> Ran {
    let mut tracer = Tracer::new(index);
    let episode = Episode { frames, ..Episode::without_problem(why, &mut tracer) };
    Ran { episode, tracer, reason: why.to_string(), unwritten: None }
}

/// Runs all episodes. Returns them, and the planner's activity in the recorded one.
fn episodes(
    runner: &Runner<'_>,
    progress: &Progress,
) -> Result<(Vec<Ran>, ActivityRecorder), TaskError> {
    let (all, chosen) = (runner.args.episodes, runner.args.record_episode - 1);
    let done = AtomicUsize::new(0);
    let tell = || {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if all > 1 {
            progress.say(format!("{done} of {all} episodes done"));
        }
    };
    let recorded = || {
        let name = format!("episode {} of {all}", chosen + 1);
        let mut line = ProgressLine::of_episode(progress, name);
        let (over, activity) = match runner.prepared(chosen) {
            Ok(prepared) => {
                let mut activity = ActivityRecorder::new(prepared.planner().clone());
                let folder = runner.args.stream.as_deref().filter(|_| rank::leads());
                let mut stream = folder.map(|folder| Stream::new(folder, prepared.planner()));
                let mut all: Vec<&mut dyn Observer> = vec![&mut line, &mut activity];
                all.extend(stream.iter_mut().map(|stream| stream as &mut dyn Observer));
                let ran = traced(prepared, chosen, all);
                // What came before a fault is what is wanted then.
                let unwritten = stream.and_then(|stream| stream.end(f64::INFINITY));
                (Ran { unwritten, ..ran? }, activity)
            }
            Err(why @ TaskError::Problem { .. }) => {
                // The page shows the scene as it was.
                let seed = scene_seed(runner.args, chosen);
                let frame = Scene::new(runner.spec.task.scene(seed)?)?.frame();
                let mut ran = without_problem(&why, chosen, vec![frame]);
                ran.episode.not_made = runner.spec.interventions.entries().len();
                let folder = runner.args.stream.as_deref().filter(|_| rank::leads());
                ran.unwritten = folder.map(|folder| {
                    format!("--stream {}: is empty: the episode did not begin", folder.display())
                });
                (ran, ActivityRecorder::default())
            }
            Err(error) => return Err(error),
        };
        tell();
        Ok::<_, TaskError>((over, activity))
    };
    let other = |index: usize| {
        let over = match runner.prepared(index) {
            Ok(prepared) => traced(prepared, index, Vec::new())?,
            Err(why @ TaskError::Problem { .. }) => without_problem(&why, index, Vec::new()),
            Err(error) => return Err(error),
        };
        tell();
        Ok::<_, TaskError>(over)
    };
    let rest = |index: &usize| *index != chosen;
    let others = || (0..all).into_par_iter().filter(rest).map(other).collect();
    let in_order = || (0..all).filter(rest).map(other).collect();
    let (recorded, others): (_, Result<Vec<Ran>, TaskError>) = match (all, rank::own()) {
        // Alone, the episode has all threads for its ticks. Ranks must run their episodes in the same order.
        (1, _) => (recorded(), Ok(Vec::new())),
        (_, Some(_)) => (recorded(), in_order()),
        _ => rayon::join(recorded, others),
    };
    let ((recorded, activity), mut episodes) = (recorded?, others?);
    episodes.insert(chosen, recorded);
    Ok((episodes.into_iter().map(|ran| ran.explained(runner.domain)).collect(), activity))
}

/// Returns the seed of an episode's scene.
fn scene_seed(args: &RunArgs, index: usize) -> Seed {
    episode_seed(args, index).derive("", "world")
}

/// Returns the first snapshot of the episode whose scene has this seed.
fn first_scene(spec: &EpisodeSpec, seed: Seed) -> Result<Snapshot, TaskError> {
    let scene = Scene::new(spec.task.scene(seed)?)?;
    Ok(Recorder::default().look(&scene).0)
}

/// Returns why an episode ended, as a part of a sentence.
fn reason_in_words(report: &EpisodeReport) -> String {
    match report.ended {
        Ended::GoalMet if !report.solved => {
            "the planner took the goal as met, although it is not".into()
        }
        _ => report.ended_words.clone(),
    }
}
