//! `symbolt view`: the main job live, in a browser.

use std::path::Path;

use anyhow::{Context, Error, bail, ensure};
use serde_json::json;
use symbolt::robot::scene::Outline;
use symbolt::sim::{InterventionLog, Live, LiveError, LiveOptions, SimView, Stop};
use symbolt::task::event::{Decided, Doing, Ignore};
use symbolt::task::execute::{Driver, EpisodeWorld, PreparedEpisode, RECOMPILE};
use symbolt::view::{Driven, View};

use super::{Runner, Stream, ViewArgs, check, episode_spec, of_interventions, scene_seed, teach};
use crate::cli::config;
use crate::cli::end::{BadArgument, Outcome};
use crate::cli::options::unused;
use crate::cli::output::{Place, Progress, emit, use_threads, warn};
use crate::cli::table::counted;

/// Ticks between two new checkpoints to go back to. One takes a scene's save as well.
const SPACING_TICKS: u64 = 200;

pub(crate) fn view(args: &ViewArgs) -> Result<Outcome, Error> {
    let ViewArgs { run: args, read_only, log } = args;
    if args.demos.task.listed() {
        return config::list(args.common.json);
    }
    ensure!(args.out.is_none(), unused("--out", "`symbolt run`"));
    check(args)?;
    args.stream.as_deref().map_or(Ok(()), super::stream::checked)?;
    let same = |a: &Path, b: &Path| {
        let both = a.canonicalize().ok().zip(b.canonicalize().ok());
        both.is_some_and(|(a, b)| a == b)
    };
    if let (Some(log), Some(made)) = (log, &args.interventions)
        && same(log, made)
    {
        let problem = "--log: is the file of --interventions, which it would empty; name another";
        bail!(BadArgument(problem.into()));
    }
    let log = match log {
        Some(file) => Some(Place::checked(Some(file), args.force)?),
        None => None,
    };
    let spec = episode_spec(args)?;
    use_threads(&args.common)?;
    let progress = Progress::new(&args.common);
    let (_, learned) = match teach(args, &spec, &progress)? {
        Ok(taught) => taught,
        Err(nothing) => return Ok(nothing),
    };
    progress.say("building the planner graph");
    let domain = &args.planner.domain(&learned.domain);
    let build = args.planner.build(args.common.seed)?;
    let runner = Runner { args, spec: &spec, domain, build };
    let shown = args.record_episode - 1;
    let prepared = runner.prepared(shown)?;
    let scene = spec.task.scene(scene_seed(args, shown))?;
    let view = if *read_only { View::bind_read_only() } else { View::bind() }?;
    let view = match &log {
        Some(Place::File(path, _)) => {
            view.with_log(path).with_context(|| format!("{} cannot be written", path.display()))?
        }
        _ => view,
    };
    let view = with_planner(view.titled(spec.task.name()), &prepared)
        .with_scene(json!(Outline::of(&scene)), poses)
        .with_events(happened)
        .with_list(decided);
    drop(progress);
    match args.common.json {
        true => emit(json!({ "address": view.address() }))?,
        false => emit(format!("Open {}", view.address()))?,
    }
    let mut window = Window { view, log: None, end_s: 0.0, ended: false };
    let mut stream = args.stream.as_deref().map(|to| Stream::new(to, prepared.planner()));
    let driven = match &mut stream {
        Some(stream) => prepared.run_driven(stream, &mut window),
        None => prepared.run_driven(&mut Ignore, &mut window),
    };
    let unwritten = stream.and_then(|stream| stream.end(window.end_s));
    let made = window.log.unwrap_or_default();
    // A run that failed is worth repeating as well. A file has been written as the run went on.
    if let Some(place @ Place::Stdout) = &log {
        place.write(&made)?;
    }
    let episode = driven.map_err(|error| of_interventions(error, args))?;
    if let Some(fault) = window.view.log_fault() {
        bail!("the log could not be written to its end: {fault}");
    }
    let ended = match window.ended {
        true => "ended by a window".into(),
        false => super::reason_in_words(&episode.report),
    };
    match args.common.json {
        true => emit(json!({
            "solved": episode.report.solved, "reason": ended, "decisions": episode.report.decisions.len(),
            "interventions": made.entries().len(),
        }))?,
        false => emit(format!(
            "Ended after {}: {ended}. {} in the log.",
            counted(episode.report.decisions.len(), "decision"),
            counted(made.entries().len(), "intervention"),
        ))?,
    }
    unwritten.map_or(Ok(Outcome::Done), |fault| Err(Error::msg(fault)))
}

/// Offers the modules of the planner for plots.
fn with_planner(mut view: View, prepared: &PreparedEpisode<'_>) -> View {
    for (index, module) in prepared.planner().modules().iter().enumerate() {
        let planner = prepared.planner().clone();
        view = view.with_reading(&module.note.name, &module.names, move |view, out| {
            if let Some(module) = planner.modules().get(index) {
                module.read(view, out);
            }
        });
    }
    view
}

fn poses(view: &SimView<'_>, out: &mut Vec<f32>) {
    let Some(scene) = EpisodeWorld::of(view.world()).and_then(EpisodeWorld::scene) else { return };
    let frame = scene.frame();
    out.extend(frame.angles.iter().chain(&frame.fingers).map(|value| *value as f32));
    for pose in &frame.parts {
        out.extend(pose.position.iter().chain(&pose.orientation).map(|value| *value as f32));
    }
}

/// Says what the robot does. Returns the number of decisions.
fn happened(view: &SimView<'_>, text: &mut String) -> u32 {
    let Some(world) = EpisodeWorld::of(view.world()) else { return 0 };
    text.clear();
    match world.doing() {
        Doing::Looking => text.push_str("Looking"),
        Doing::Deciding => text.push_str("Deciding"),
        Doing::Acting(action) => {
            let words = world.decisions().last().and_then(Decided::done_in_words);
            text.push_str("Doing: ");
            text.push_str(words.as_deref().unwrap_or(action));
        }
        Doing::Over => text.push_str("Over"),
    }
    u32::try_from(world.decisions().len()).unwrap_or(u32::MAX)
}

/// Returns a decision in words, by its number.
fn decided(view: &SimView<'_>, number: u32) -> Option<String> {
    let decided = EpisodeWorld::of(view.world())?.decisions().get(number as usize)?;
    let time_s = decided.asked_s + decided.took_ms / 1e3;
    let nothing =
        || if decided.unmet.is_empty() { "nothing: the goal is met" } else { "no action" };
    let words = decided.done_in_words().unwrap_or_else(|| nothing().into());
    Some(format!("{time_s:.3} s: {words}"))
}

/// The windows of an episode.
struct Window {
    view: View,
    /// Where the first planner graph ended, in seconds.
    end_s: f64,
    /// The interventions in the first planner graph.
    log: Option<InterventionLog>,
    /// Whether a window ended the run before its end.
    ended: bool,
}

impl Window {
    /// Returns whether the episode goes on in another graph.
    fn goes_on(
        &mut self,
        live: &mut Live,
        stop: &mut dyn FnMut(SimView<'_>) -> Stop,
    ) -> Result<bool, LiveError> {
        loop {
            match self.view.drive(live, &mut *stop)? {
                Driven::Stopped(RECOMPILE) => return Ok(true),
                Driven::Stopped(_) => {
                    let world = EpisodeWorld::of(live.sim().world());
                    let ended = world.and_then(EpisodeWorld::ended_in_words);
                    let why = ended.unwrap_or_else(|| "the time is up".into());
                    if self.view.hold(live, &why)? != Driven::WentBack {
                        return Ok(false);
                    }
                }
                Driven::WentBack => {}
                Driven::Ended => {
                    self.ended = true;
                    return Ok(false);
                }
            }
        }
    }
}

impl Driver for Window {
    fn options(&self) -> LiveOptions {
        LiveOptions { spacing_ticks: SPACING_TICKS, ..LiveOptions::default() }
    }

    fn drive(
        &mut self,
        live: &mut Live,
        stop: &mut dyn FnMut(SimView<'_>) -> Stop,
    ) -> Result<bool, LiveError> {
        let goes_on = self.goes_on(live, stop);
        match self.log {
            None => {
                self.end_s = live.sim().time_s();
                self.log = Some(live.log());
                // Interventions in another graph are not repeated.
                self.view.end_log();
            }
            Some(_) if live.made().is_empty() => {}
            Some(_) => {
                let some = counted(live.made().len(), "intervention");
                warn(&format!(
                    "{some} in a planner graph that was compiled anew: a run with --interventions does not repeat them"
                ));
            }
        }
        if matches!(goes_on, Ok(true)) {
            self.view.forget_readings();
        }
        goes_on
    }
}
