//! `symbolt run`: the main job. Demonstrations in physics, learning, and episodes in which the robot does
//! what it has learned, planning anew at every step.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::Error;
use rand::RngExt;
use rayon::prelude::*;
use serde_json::{Value, json};
use symbolt::sim::{Seed, SimView};
use symbolt::task::execute::{
    AssemblyWorld, Ended, Episode, EpisodeReport, EpisodeSpec, Meddling, Tally, Thoughts,
    episode_watched,
};
use symbolt::task::learn::{Learned, Settings};
use symbolt::task::planner::Planner;
use symbolt::task::report::{Arrays, RunFacts, trace};
use symbolt::task::scene::{Scene, SceneSpec};
use symbolt::task::{
    Classifier, Demonstrated, Grounding, Overwrite, Pose, Recorder, Snapshot, TaskError,
    demonstrate, write_whole,
};

use super::Outcome;
use super::args::{BadArgument, RunArgs};
use super::output::{Grid, Progress, counted, emit, emit_json, use_threads};
use super::watch::{Watch, demonstrations};
use super::{learn, plan, report};

/// The files that a run leaves in its folder.
const FILES: [&str; 7] = [
    "recording.jsonl",
    "domain.json",
    "scene.json",
    "trace.jsonl",
    "arrays.npz",
    "run.json",
    report::NAME,
];

/// Milliseconds between the frames that are kept of the first episode.
const FRAME_MS: u64 = 40;

pub(crate) fn run(args: &RunArgs) -> Result<Outcome, Error> {
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("out"));
    check(args, &folder)?;
    let shown_in = args.demos.scene()?;
    let spec = episode_spec(args)?;
    use_threads(&args.common)?;
    let begun = Instant::now();
    let progress = Progress::new(&args.common);
    let seed = Seed::new(args.common.seed);
    let count = args.demos.demos;
    let shown = demonstrate(&shown_in, count, seed, &mut demonstrations(&progress, count))?;
    if shown.assembled == 0 {
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
    let first = first_scene(&spec, seed)?;
    let least = least_skills(&planner, &first, &goal)?;
    let tally = Tally::of(&reports, least);

    progress.say(format!("writing {}", folder.display()));
    std::fs::create_dir_all(&folder).map_err(|source| TaskError::Io {
        what: "write",
        path: folder.clone(),
        source,
    })?;
    let result = Results {
        shown: &shown,
        learned: &learned,
        reports: &reports,
        tally: &tally,
        loop_s,
        physics_s: episodes.iter().map(|e| e.physics_wall.as_secs_f64()).sum(),
        least,
    };
    let facts = result.facts(args, &goal, &spec.scene, &thoughts);
    let frames = episodes.first().map_or(&[][..], |e| &e.frames);
    let contents = [
        shown.recording.to_jsonl(None).into_bytes(),
        domain.to_json().into_bytes(),
        (first.to_json() + "\n").into_bytes(),
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
    let page = symbolt::task::report::report(&folder)?.html;
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
    Ok(())
}

fn episode_spec(args: &RunArgs) -> Result<EpisodeSpec, TaskError> {
    let mut scene = args.demos.setting()?;
    scene.nuts = args.nuts.unwrap_or(scene.nuts);
    scene.bolts = args.bolts.unwrap_or(scene.bolts);
    let spec = EpisodeSpec { scene, drop_rate: args.drop_rate, ..EpisodeSpec::default() };
    spec.check().map(|()| spec)
}

/// Another hand lets the last bolt fall into the hole.
fn meddling(spec: &SceneSpec, seed: Seed) -> Meddling {
    let [x, y] = spec.jig.hole;
    let position = [x, y, spec.jig.hole_top_m + 1e-3];
    Meddling {
        at_s: 20.0 * seed.derive("meddling", "moment").rng().random::<f64>(),
        part: spec.nuts + spec.bolts - 1,
        pose: Pose::at(position),
    }
}

fn episode_seed(seed: Seed, index: usize) -> Seed {
    seed.derive_index("episode", index as u64)
}

/// All episodes, and what the planner thought in the first.
fn episodes(
    args: &RunArgs,
    planner: &Arc<Planner>,
    goal: &str,
    spec: &EpisodeSpec,
    seed: Seed,
    progress: &Progress,
) -> Result<(Vec<Episode>, Thoughts), TaskError> {
    let run = |index: usize, watch: &mut dyn FnMut(&SimView<'_>, &AssemblyWorld)| {
        let frame_ms = (index == 0).then_some(FRAME_MS);
        let own = episode_seed(seed, index);
        let meddling = args.meddle.then(|| meddling(&spec.scene, own));
        let spec = EpisodeSpec { frame_ms, meddling, ..spec.clone() };
        episode_watched(planner, Grounding::default(), goal, &spec, own, watch)
    };
    let (done, all) = (AtomicUsize::new(0), args.episodes);
    let first = || {
        let mut thoughts = Thoughts::of(planner);
        let mut watch = Watch::new(progress, format!("episode 1 of {all}"));
        progress.say(format!("episode 1 of {all}"));
        let over = run(0, &mut |view, world| {
            thoughts.watch(planner, view, world);
            watch.tick(view, world);
        })?;
        done.fetch_add(1, Ordering::Relaxed);
        Ok::<_, TaskError>((over, thoughts))
    };
    let others = || {
        (1..all)
            .into_par_iter()
            .map(|index| {
                let over = run(index, &mut |_, _| {})?;
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress.say(format!("{done} of {all} episodes done"));
                Ok(over)
            })
            .collect::<Result<Vec<_>, TaskError>>()
    };
    let (first, others) = rayon::join(first, others);
    let (first, thoughts) = first?;
    Ok((std::iter::once(first).chain(others?).collect(), thoughts))
}

/// What is to be seen at the beginning of the first episode.
fn first_scene(spec: &EpisodeSpec, seed: Seed) -> Result<Snapshot, TaskError> {
    let scene = Scene::new(&spec.scene, episode_seed(seed, 0).derive("", "world"))?;
    Ok(Recorder::new(&spec.scene).look(&scene).0)
}

/// How many skills the plan for a scene has.
fn least_skills(planner: &Planner, scene: &Snapshot, goal: &str) -> Result<usize, TaskError> {
    let classifier = Classifier::new(planner.domain(), Grounding::default())?;
    let (counts, _) = plan::count(&classifier, planner.domain(), scene);
    Ok(planner.plan(&counts, goal)?.steps.len())
}

struct Results<'r> {
    shown: &'r Demonstrated,
    learned: &'r Learned,
    reports: &'r [EpisodeReport],
    tally: &'r Tally,
    loop_s: f64,
    physics_s: f64,
    least: usize,
}

impl Results<'_> {
    fn real_time(&self, wall_s: f64) -> f64 {
        self.tally.simulated_s / wall_s.max(1e-9)
    }

    /// What the run was and what came of it, the same on every machine.
    fn facts(
        &self,
        args: &RunArgs,
        goal: &str,
        scene: &SceneSpec,
        thoughts: &Thoughts,
    ) -> RunFacts {
        let (format, version) = RunFacts::FORMAT;
        let (modules, populations) = RunFacts::of_thoughts(thoughts);
        let spec = args.planner.spec();
        RunFacts {
            format: format.into(),
            version,
            symbolt: env!("CARGO_PKG_VERSION").into(),
            command: args.command(),
            seed: args.common.seed,
            goal: goal.into(),
            mode: args.planner.mode.clone(),
            planner: json!({
                "dimensions": spec.dimensions,
                "max_similarity": spec.max_similarity,
                "absent": args.planner.absent,
                "first": args.planner.first,
                "products": args.planner.products,
            }),
            scene: scene.clone(),
            summary: self.figures_json(args).as_object().cloned().unwrap_or_default(),
            modules,
            populations,
        }
    }

    /// What `--json` prints: the run's figures, and what differs between machines and runs.
    fn summary(&self, args: &RunArgs, folder: &Path) -> Value {
        let mut summary = self.figures_json(args);
        summary["real_time_factor"] = json!(self.real_time(self.loop_s));
        summary["physics_real_time_factor"] = json!(self.real_time(self.physics_s));
        summary["out"] = json!(folder.display().to_string());
        summary
    }

    fn figures_json(&self, args: &RunArgs) -> Value {
        let tally = self.tally;
        let failures: Vec<Value> = tally
            .failures
            .iter()
            .map(|(episode, ended)| json!({"episode": episode, "reason": self.reason(ended)}))
            .collect();
        let replans: Vec<Value> = tally
            .failed_skills
            .iter()
            .map(|((action, outcome), times)| {
                json!({"action": action, "outcome": outcome, "times": times})
            })
            .collect();
        json!({
            "episodes": tally.episodes,
            "assembled": tally.assembled,
            "interval95": tally.interval95(),
            "minimum_steps": tally.minimum_steps,
            "least_steps": self.least,
            "false_goals": tally.false_goals,
            "picks": tally.picks,
            "drops": tally.drops,
            "replans": tally.replans,
            "replans_after": replans,
            "strays": tally.strays,
            "ended_with_strays": tally.ended_with_strays,
            "meddled": tally.meddled,
            "decision_ms": {
                "median": tally.decision_quantile(0.5),
                "p95": tally.decision_quantile(0.95),
            },
            "slip_mm": 1e3 * tally.slip_m,
            "physics_steps": tally.steps,
            "mode": args.planner.mode,
            "failures": failures,
            "demonstrations": self.shown.recording.demos.len(),
            "demonstrations_assembled": self.shown.assembled,
            "states": self.learned.domain.states().len(),
            "operators": self.learned.domain.operators().len(),
        })
    }

    fn text(&self, args: &RunArgs, folder: &Path, goal: &str, total_s: f64) -> String {
        let (shown, tally) = (self.shown, self.tally);
        let mut text = format!(
            "{} in the scene, {} assembled, {} (seed {})\n\n",
            counted(shown.recording.demos.len(), "demonstration"),
            shown.assembled,
            counted(shown.recording.snapshot_count(), "snapshot"),
            args.common.seed,
        );
        text += &learn::tables(self.learned);
        if let [report] = self.reports {
            let _ = writeln!(text, "One episode towards {goal}:\n\n{}", steps(report));
        } else {
            let _ = writeln!(text, "{} towards {goal}:\n", counted(self.reports.len(), "episode"));
        }
        text += &self.figures(total_s).to_string();
        text.push('\n');
        if !tally.failed_skills.is_empty() {
            let mut grid = Grid::new(&["planned anew after", "outcome", ">times"]);
            for ((action, outcome), times) in &tally.failed_skills {
                grid.row([action.clone(), outcome.clone(), times.to_string()]);
            }
            let _ = writeln!(text, "{grid}");
        }
        for (index, ended) in &tally.failures {
            let _ = writeln!(text, "Episode {index} failed: {}.", self.reason(ended));
        }
        let files: Vec<String> =
            FILES.iter().map(|f| folder.join(f).display().to_string()).collect();
        let _ = writeln!(text, "Wrote {}", files.join(", "));
        text
    }

    fn figures(&self, total_s: f64) -> Grid {
        let tally = self.tally;
        let [low, high] = tally.interval95();
        let percent = |share: f64| format!("{:.1}%", 100.0 * share);
        let ms = |share: f64| {
            tally.decision_quantile(share).map_or_else(|| "-".into(), |ms| format!("{ms:.0}"))
        };
        let mut grid = Grid::new(&["figure", ">value"]);
        let rows = [
            ("assembled", format!("{} of {}", tally.assembled, tally.episodes)),
            ("95% interval", format!("{} to {}", percent(low), percent(high))),
            (
                "in the least number of steps",
                format!("{} ({} steps)", tally.minimum_steps, self.least),
            ),
            ("goals taken to be met that were not", tally.false_goals.to_string()),
            ("picks", tally.picks.to_string()),
            ("drops", tally.drops.to_string()),
            ("re-plans after a failed step", tally.replans.to_string()),
            ("parts that came to be in no state", tally.strays.to_string()),
            ("greatest slip in the hand, mm", format!("{:.2}", 1e3 * tally.slip_m)),
            ("decision, simulated ms, median", ms(0.5)),
            ("decision, simulated ms, 95%", ms(0.95)),
            ("simulated s", format!("{:.1}", tally.simulated_s)),
            ("physics steps", tally.steps.to_string()),
            ("times real time, whole loop", format!("{:.1}", self.real_time(self.loop_s))),
            ("times real time, physics alone", format!("{:.1}", self.real_time(self.physics_s))),
            ("wall s, everything", format!("{total_s:.1}")),
        ];
        for (name, value) in rows {
            grid.row([name.into(), value]);
        }
        grid
    }

    fn reason(&self, ended: &Ended) -> String {
        match ended {
            Ended::GoalMet => "the goal was taken to be met and is not".into(),
            Ended::Stuck(obstacle) => plan::obstacle_text(&self.learned.domain, *obstacle),
            Ended::NoWay { action } => format!("no part could be taken and put as {action} wants"),
            Ended::Occupied { action } => format!("something lies where {action} puts its part"),
            Ended::GaveUp => "time or skills were used up".into(),
        }
    }
}

/// The decisions of one episode, and what came of them.
fn steps(report: &EpisodeReport) -> Grid {
    let mut grid = Grid::new(&["step", ">at s", "holds", "decided", ">in ms", "outcome"]);
    let mut skills = report.skills.iter();
    for (index, decision) in report.decisions.iter().enumerate() {
        let outcome = match (&decision.action, &report.ended) {
            (Some(_), _) if !decision.begun => "not begun".to_owned(),
            (Some(_), _) => {
                skills.next().map_or_else(|| "cut short".to_owned(), |s| s.outcome.to_string())
            }
            (None, Ended::GoalMet) => "goal met".to_owned(),
            (None, _) => "stuck".to_owned(),
        };
        grid.row([
            (index + 1).to_string(),
            format!("{:.2}", decision.asked_s),
            decision.holds.join(", "),
            decision.action.clone().unwrap_or_else(|| "-".into()),
            format!("{:.0}", decision.took_ms),
            outcome,
        ]);
    }
    grid
}
