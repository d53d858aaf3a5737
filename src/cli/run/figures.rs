//! The figures of a run, as printed text, as `--json` and in `run.json`.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Map, Value, json};
use symbolt::neurons::LayerSaturation;
use symbolt::report::{Filmed, RunFacts, RunWords};
use symbolt::sim::Seed;
use symbolt::study::Tally;
use symbolt::study::statistics::FEW_TRIALS;
use symbolt::task::Demonstrated;
use symbolt::task::event::{Ended, EpisodeReport, InNoState};
use symbolt::task::execute::ActivityRecorder;
use symbolt::task::learn::Learned;
use symbolt::task::planner::PlannerSpec;
use symbolt::task::tasks::Task;

use super::args::RunArgs;
use super::folder::FILES;
use crate::cli::learn::tables;
use crate::cli::options::METHODS;
use crate::cli::output::keys;
use crate::cli::table::{Grid, counted, unbroken, wrapped};

/// The results of a run, and the wall-clock times that it took.
pub(crate) struct Figures<'r> {
    pub shown: &'r Demonstrated,
    pub learned: &'r Learned,
    pub reports: &'r [EpisodeReport],
    /// Why each episode ended, in words.
    pub reasons: Vec<String>,
    pub tally: &'r Tally,
    /// Wall-clock seconds of all episodes.
    pub loop_s: f64,
    /// Wall-clock seconds of the physics steps in all episodes.
    pub physics_s: f64,
    /// Number of actions in the plan for the recorded episode.
    pub least: usize,
    pub words: RunWords,
    /// Number of interventions that were made, if there was a log of them.
    pub interventions: Option<usize>,
    /// Layers of the recorded episode that saturated in neurons and not in exact maths.
    pub saturated: Vec<LayerSaturation>,
}

impl Figures<'_> {
    /// Returns the speed relative to real time.
    fn real_time(&self, wall_s: f64) -> f64 {
        self.tally.simulated_s / wall_s.max(1e-9)
    }

    /// Returns the content of `run.json`: settings and results, the same on every machine.
    pub fn facts(
        &self,
        args: &RunArgs,
        task: &dyn Task,
        scene_seed: Seed,
        activity: &ActivityRecorder,
        also_filmed: Vec<Filmed>,
    ) -> RunFacts {
        let (format, version) = RunFacts::FORMAT;
        let (modules, populations) = RunFacts::of_activity(activity);
        let spec = PlannerSpec { absent: args.planner.absent, ..args.planner.spec() };
        RunFacts {
            format: format.into(),
            version,
            symbolt: env!("CARGO_PKG_VERSION").into(),
            command: args.command(),
            seed: args.common.seed,
            goal: self.learned.domain.goals_in_symbols(),
            goal_words: self.learned.domain.goals_in_words().unwrap_or_default(),
            mode: args.planner.mode.clone(),
            planner: RunFacts::planner_settings(args.planner.kind(), &spec),
            task: task.name().into(),
            scene: task.settings(),
            scene_seed: scene_seed.value(),
            recorded: args.record_episode - 1,
            also_filmed,
            summary: self.figures_json(args),
            modules,
            populations,
            notes: activity.notes(),
            words: self.words.words.clone(),
            planner_only: self.words.planner_only.clone(),
        }
    }

    /// Returns what `--json` prints: the figures, the speeds on this machine and the folder.
    pub fn summary(&self, args: &RunArgs, folder: &Path) -> Value {
        let mut summary = self.figures_json(args);
        summary.extend(keys(json!({
            "real_time_factor": self.real_time(self.loop_s),
            "physics_real_time_factor": self.real_time(self.physics_s),
            "out": folder.display().to_string(),
        })));
        Value::Object(summary)
    }

    fn figures_json(&self, args: &RunArgs) -> Map<String, Value> {
        let tally = self.tally;
        let failures =
            tally.failures.iter().map(|(e, _)| json!({"episode": e, "reason": self.reason(*e)}));
        let replans = tally.failed_skills.iter().map(|((action, outcome), times)| {
            let words = self.words.of_symbol(action);
            json!({"action": action, "words": words, "outcome": outcome, "times": times})
        });
        let saturated = self.saturated.iter();
        let saturated = saturated.map(|layer| {
            json!({"layer": layer.path, "share": layer.share(), "greatest": layer.greatest})
        });
        let method = METHODS.iter().find(|(_, method)| *method == args.method);
        let mut all = keys(json!({
            "episodes": tally.episodes,
            "assembled": tally.succeeded,
            "interval95": tally.interval95(),
            "few_trials": self.few(),
            "minimum_steps": tally.minimum_steps,
            "least_steps": self.least,
            "false_goals": tally.false_goals,
            "unclaimed": tally.unclaimed,
            "unsolved": tally.unsolved(),
            "picks": tally.picks,
            "drops": tally.drops,
            "replans": tally.replans,
            "replans_after": replans.collect::<Vec<_>>(),
            "strays": tally.unexplained,
            "ended_with_strays": tally.ended_unexplained,
            "lost": tally.lost,
            "recoveries": tally.recoveries,
            "meddled": tally.perturbed,
            "displaced": self.displaced(),
            "off_place": self.off_place(),
            "decision_ms": {
                "median": tally.decision_quantile(0.5), "p95": tally.decision_quantile(0.95),
            },
            "slip_mm": 1e3 * tally.slip_m,
            "physics_steps": tally.steps,
            "planner": args.planner.kind().name(),
            "mode": args.planner.mode,
            "method": method.map(|(name, _)| name),
            "failures": failures.collect::<Vec<_>>(),
            "saturated": saturated.collect::<Vec<_>>(),
            "demonstrations": self.shown.recording.demos.len(),
            "demonstrations_assembled": self.shown.solved,
            "states": self.learned.domain.states.len(),
            "operators": self.learned.domain.operators.len(),
        }));
        if let Some(made) = self.interventions {
            all.insert("interventions".into(), json!(made));
        }
        all
    }

    /// Returns what another hand than the robot's changed.
    fn displaced(&self) -> Vec<Value> {
        let all = self.reports.iter().enumerate();
        let all =
            all.flat_map(|(episode, report)| report.displaced.iter().map(move |d| (episode, d)));
        let all =
            all.map(|(episode, one)| json!({"episode": episode, "t": one.t, "words": one.words}));
        all.collect()
    }

    /// Returns the steps whose part is not where it was to go.
    fn off_place(&self) -> Vec<Value> {
        let of = |(episode, report): (usize, &EpisodeReport)| {
            let own = report.decisions.iter().enumerate().filter_map(move |(index, decision)| {
                let landed = decision.landed.as_ref().filter(|landed| !landed.as_planned)?;
                Some(json!({
                    "episode": episode, "decision": index, "action": decision.action,
                    "words": decision.words, "outcome": decision.outcome().map(|o| o.to_string()),
                    "landed": landed.words, "off_mm": landed.off_mm,
                }))
            });
            own.collect::<Vec<_>>()
        };
        self.reports.iter().enumerate().flat_map(of).collect()
    }

    /// Returns what the run prints.
    pub fn text(&self, args: &RunArgs, folder: &Path, total_s: f64) -> String {
        let (shown, tally) = (self.shown, self.tally);
        let goal = self.learned.domain.goals_in_words().unwrap_or_default();
        let mut text = format!(
            "{} in the scene, {} assembled, {} (seed {})\n\n",
            counted(shown.recording.demos.len(), "demonstration"),
            shown.solved,
            counted(shown.recording.snapshot_count(), "snapshot"),
            args.common.seed,
        );
        text += &tables(self.learned);
        if let [report] = self.reports {
            let title = wrapped(&format!("One episode. Its goal: {goal}."), 0);
            let _ = writeln!(text, "{title}\n\n{}", steps(report));
            let lines = [surprises(report), in_no_state(report)].concat();
            for line in &lines {
                let _ = writeln!(text, "{}", wrapped(line, 2));
            }
            if !lines.is_empty() {
                text.push('\n');
            }
            let _ = writeln!(text, "{}\n", wrapped(DECISION_MS, 0));
            text += &recoveries(report);
        } else {
            let episodes = counted(self.reports.len(), "episode");
            let _ = writeln!(text, "{}\n", wrapped(&format!("{episodes}. Their goal: {goal}."), 0));
        }
        text += &self.figures(total_s).to_string();
        text.push('\n');
        if !tally.recoveries.is_empty() {
            let mut grid = Grid::new(&["recovery", "why", ">times"]);
            for ((does, why), times) in &tally.reasons {
                grid.row([does.clone(), why.clone(), times.to_string()]);
            }
            let _ = writeln!(text, "{grid}");
        }
        if !tally.failed_skills.is_empty() {
            let mut grid = Grid::new(&["step that broke off", "outcome", ">times"]);
            for ((action, outcome), times) in &tally.failed_skills {
                let words = self.words.of_symbol(action).to_owned();
                grid.row([words, outcome.clone(), times.to_string()]);
            }
            let _ = writeln!(text, "{grid}");
        }
        for (index, _) in &tally.failures {
            let number = index + 1;
            let advice = match number == args.record_episode {
                true => String::new(),
                false => format!(" (`--record-episode {number}` shows it)"),
            };
            let line = format!("Episode {number} failed: {}{advice}.", self.reason(*index));
            let _ = writeln!(text, "{}", wrapped(&line, 2));
        }
        if let Some((number, worst)) = self.worst_saturated() {
            let line = format!(
                "Neurons saturate in {} where exact maths does not (`saturated` in run.json). Most in {worst}.",
                counted(number, "layer"),
            );
            let _ = writeln!(text, "{}", wrapped(&line, 2));
        }
        let files = FILES.map(|f| unbroken(&folder.join(f).display().to_string()));
        let _ = writeln!(text, "{}", wrapped(&format!("Wrote {}", files.join(", ")), 6));
        text
    }

    /// Returns how many layers saturated, and the one that did so most often.
    fn worst_saturated(&self) -> Option<(usize, &LayerSaturation)> {
        let worst = self.saturated.iter().max_by(|a, b| a.share().total_cmp(&b.share()))?;
        Some((self.saturated.len(), worst))
    }

    /// Returns whether the episodes are too few for an interval that says much.
    fn few(&self) -> bool {
        (self.tally.episodes as u64) < FEW_TRIALS
    }

    /// Returns the figures as a table. `total_s` is the wall-clock time of the whole command in seconds.
    fn figures(&self, total_s: f64) -> Grid {
        let tally = self.tally;
        let [low, high] = tally.interval95();
        let percent = |share: f64| format!("{:.1}%", 100.0 * share);
        let ms = |share: f64| {
            tally.decision_quantile(share).map_or_else(|| "-".into(), |ms| format!("{ms:.0}"))
        };
        let interval =
            if self.few() { "95% interval (rough: few episodes)" } else { "95% interval" };
        let mut grid = Grid::new(&["figure", ">value"]);
        let rows = [
            ("assembled", format!("{} of {}", tally.succeeded, tally.episodes)),
            (interval, format!("{} to {}", percent(low), percent(high))),
            (
                "in the fewest possible steps",
                format!("{} of {} ({} steps)", tally.minimum_steps, tally.episodes, self.least),
            ),
            ("goals wrongly taken as met", tally.false_goals.to_string()),
            ("assembled, but not taken as met", tally.unclaimed.to_string()),
            ("neither assembled nor taken as met", tally.unsolved().to_string()),
            ("picks", tally.picks.to_string()),
            ("drops", tally.drops.to_string()),
            ("steps that broke off", tally.replans.to_string()),
            ("parts that ended up in no state", tally.unexplained.to_string()),
            ("largest slip in the gripper, mm", format!("{:.2}", 1e3 * tally.slip_m)),
            ("decision, simulated ms, median", ms(0.5)),
            ("decision, simulated ms, 95th percentile", ms(0.95)),
            ("simulated time, s", format!("{:.1}", tally.simulated_s)),
            ("physics steps", tally.steps.to_string()),
            (
                "speed of the whole loop, times real time",
                format!("{:.1}", self.real_time(self.loop_s)),
            ),
            (
                "speed of the physics, times real time",
                format!("{:.1}", self.real_time(self.physics_s)),
            ),
            ("wall time in all, s", format!("{total_s:.1}")),
        ];
        for (name, value) in rows {
            grid.row([name.into(), value]);
            if let (true, Some(made)) = (name == "drops", self.interventions) {
                grid.row(["interventions made".into(), made.to_string()]);
            }
            if name == "parts that ended up in no state" && tally.lost > 0 {
                grid.row(["parts that fell off the table".into(), tally.lost.to_string()]);
            }
        }
        grid
    }

    /// Returns the reason why an episode failed, in words.
    fn reason(&self, episode: usize) -> &str {
        self.reasons.get(episode).map_or("unknown", String::as_str)
    }
}

/// The meaning of the column of milliseconds, and the reason why `symbolt plan` prints more for the same scene.
const DECISION_MS: &str = "ms: simulated time from the look at the scene to the answer, in whole steps of the physics. \
                           `symbolt\u{a0}plan` prints a little more: there the planner gets the goal together with \
                           the scene, and here before it.";

/// Returns what the executor changed after failures in an episode and why, one sentence for each change.
fn recoveries(report: &EpisodeReport) -> String {
    let mut text = String::new();
    for (index, decision) in report.decisions.iter().enumerate() {
        if let Some(recovery) = &decision.recovery {
            let line = format!("{}: {}.", index + 1, recovery.text());
            let _ = writeln!(text, "{}", wrapped(&line, 4));
        }
    }
    if !text.is_empty() {
        text.insert_str(0, "Recoveries, by the number of the decision:\n");
        text.push('\n');
    }
    text
}

/// Returns a line for each step whose part is not where it was to go, and for each change that another hand made.
fn surprises(report: &EpisodeReport) -> Vec<String> {
    let steps = report.decisions.iter().enumerate().filter_map(|(index, decision)| {
        let landed = decision.landed.as_ref().filter(|landed| !landed.as_planned)?;
        Some(format!("Step {} did not end as planned: {landed}.", index + 1))
    });
    let hands = report.displaced.iter().map(|one| format!("At {:.2} s {}.", one.t, one.words));
    steps.chain(hands).collect()
}

/// Returns a line for each part that a decision newly found in no state, or nearer to another state, unless the step before it
/// tells so.
fn in_no_state(report: &EpisodeReport) -> Vec<String> {
    let (mut lines, mut before, mut told) = (Vec::new(), &[][..], None);
    for decision in &report.decisions {
        let moved = |part: &&InNoState| told != Some(&part.object);
        for part in decision.in_no_state.iter().filter(moved) {
            let same = |b: &InNoState| {
                (&b.object, &b.nearest, &b.off) == (&part.object, &part.nearest, &part.off)
            };
            if !before.iter().any(same) {
                lines.push(format!("At {:.2} s {part}.", decision.asked_s));
            }
        }
        before = &decision.in_no_state;
        told = decision.landed.as_ref().and(decision.chosen.as_ref()).map(|chosen| &chosen.object);
    }
    lines
}

/// Returns the decisions of one episode and their outcomes.
fn steps(report: &EpisodeReport) -> Grid {
    let mut grid = Grid::new(&["#", ">at s", "decided", ">ms", "outcome"]);
    for (index, decision) in report.decisions.iter().enumerate() {
        let outcome = match (&decision.action, &report.ended) {
            _ if decision.action.is_some() || decision.begun => {
                unbroken(&decision.came_in_words().unwrap_or_default())
            }
            (None, _) if index + 1 < report.decisions.len() => unbroken("no way found"),
            (None, Ended::GoalMet) => unbroken("goal met"),
            _ => "stuck".to_owned(),
        };
        let mut row = vec![(index + 1).to_string(), format!("{:.2}", decision.asked_s)];
        row.push(decision.done_in_words().unwrap_or_else(|| "-".into()));
        row.extend([format!("{:.0}", decision.took_ms), outcome]);
        grid.row(row);
    }
    grid
}
