//! A run's figures: the text it prints, its `--json`, and `run.json`.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Map, Value, json};
use symbolt::report::RunFacts;
use symbolt::sim::Seed;
use symbolt::study::Tally;
use symbolt::task::Demonstrated;
use symbolt::task::event::{Ended, EpisodeReport};
use symbolt::task::execute::ActivityRecorder;
use symbolt::task::learn::Learned;
use symbolt::task::tasks::Task;

use super::args::RunArgs;
use super::output::{Grid, counted};
use super::{learn, plan};

/// What a run came to.
pub(crate) struct Figures<'r> {
    pub shown: &'r Demonstrated,
    pub learned: &'r Learned,
    pub reports: &'r [EpisodeReport],
    pub tally: &'r Tally,
    pub loop_s: f64,
    pub physics_s: f64,
    pub least: usize,
}

impl Figures<'_> {
    fn real_time(&self, wall_s: f64) -> f64 {
        self.tally.simulated_s / wall_s.max(1e-9)
    }

    /// What the run was and what came of it, the same on every machine.
    pub fn facts(
        &self,
        args: &RunArgs,
        goal: &str,
        task: &dyn Task,
        scene_seed: Seed,
        activity: &ActivityRecorder,
    ) -> RunFacts {
        let (format, version) = RunFacts::FORMAT;
        let (modules, populations) = RunFacts::of_activity(activity);
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
            task: task.name().into(),
            scene: task.settings(),
            scene_seed: scene_seed.value(),
            recorded: args.record_episode - 1,
            summary: self.figures_json(args),
            modules,
            populations,
        }
    }

    /// What `--json` prints: the run's figures, and what differs between machines and runs.
    pub fn summary(&self, args: &RunArgs, folder: &Path) -> Value {
        let mut summary = self.figures_json(args);
        let own = [
            ("real_time_factor", json!(self.real_time(self.loop_s))),
            ("physics_real_time_factor", json!(self.real_time(self.physics_s))),
            ("out", json!(folder.display().to_string())),
        ];
        summary.extend(own.map(|(name, figure)| (name.to_owned(), figure)));
        Value::Object(summary)
    }

    fn figures_json(&self, args: &RunArgs) -> Map<String, Value> {
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
        let figures = [
            ("episodes", json!(tally.episodes)),
            ("assembled", json!(tally.solved)),
            ("interval95", json!(tally.interval95())),
            ("minimum_steps", json!(tally.minimum_steps)),
            ("least_steps", json!(self.least)),
            ("false_goals", json!(tally.false_goals)),
            ("picks", json!(tally.picks)),
            ("drops", json!(tally.drops)),
            ("replans", json!(tally.replans)),
            ("replans_after", json!(replans)),
            ("strays", json!(tally.unexplained)),
            ("ended_with_strays", json!(tally.ended_unexplained)),
            ("meddled", json!(tally.perturbed)),
            (
                "decision_ms",
                json!({
                    "median": tally.decision_quantile(0.5),
                    "p95": tally.decision_quantile(0.95),
                }),
            ),
            ("slip_mm", json!(1e3 * tally.slip_m)),
            ("physics_steps", json!(tally.steps)),
            ("mode", json!(args.planner.mode)),
            ("failures", json!(failures)),
            ("demonstrations", json!(self.shown.recording.demos.len())),
            ("demonstrations_assembled", json!(self.shown.solved)),
            ("states", json!(self.learned.domain.states().len())),
            ("operators", json!(self.learned.domain.operators().len())),
        ];
        figures.into_iter().map(|(name, figure)| (name.to_owned(), figure)).collect()
    }

    pub fn text(&self, args: &RunArgs, folder: &Path, goal: &str, total_s: f64) -> String {
        let (shown, tally) = (self.shown, self.tally);
        let mut text = format!(
            "{} in the scene, {} assembled, {} (seed {})\n\n",
            counted(shown.recording.demos.len(), "demonstration"),
            shown.solved,
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
            let number = index + 1;
            let _ = write!(text, "Episode {number} failed: {}", self.reason(ended));
            let _ = if number == args.record_episode {
                writeln!(text, ".")
            } else {
                writeln!(text, " (`--record-episode {number}` shows it).")
            };
        }
        let files: Vec<String> =
            super::run::FILES.iter().map(|f| folder.join(f).display().to_string()).collect();
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
            ("assembled", format!("{} of {}", tally.solved, tally.episodes)),
            ("95% interval", format!("{} to {}", percent(low), percent(high))),
            (
                "in the least number of steps",
                format!("{} ({} steps)", tally.minimum_steps, self.least),
            ),
            ("goals taken to be met that were not", tally.false_goals.to_string()),
            ("picks", tally.picks.to_string()),
            ("drops", tally.drops.to_string()),
            ("re-plans after a failed step", tally.replans.to_string()),
            ("parts that came to be in no state", tally.unexplained.to_string()),
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
    for (index, decision) in report.decisions.iter().enumerate() {
        let outcome = match (&decision.action, &report.ended) {
            (Some(_), _) if !decision.begun => "not begun".to_owned(),
            (Some(_), _) => decision.outcome().map_or("cut short".into(), |o| o.to_string()),
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
