//! The arguments of a run, and the command line that repeats it.

use std::path::PathBuf;

use clap::Args;
use symbolt::task::learn::Method;
use symbolt::task::planner::PlannerKind;

use crate::cli::options::{Common, DemoArgs, METHODS, PlannerArgs, named, number, whole, within};

/// Greatest number of episodes. Long ones take 22 kB of the trace each, and `report` reads 32 MiB.
const MAX_EPISODES: usize = 1_000;

#[derive(Debug, Clone, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub demos: DemoArgs,
    /// Learner: relational (states in the frames of objects, actions with
    /// parameters) or paper (states in the world frame, as in the paper)
    /// [default: relational]
    #[arg(verbatim_doc_comment, hide_possible_values = true, hide_default_value = true)]
    #[arg(long, value_name = "METHOD", default_value = "relational", value_parser = named(&METHODS))]
    pub method: Method,
    /// Number of episodes after learning, at most 1000
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = within(1..=MAX_EPISODES))]
    pub episodes: usize,
    /// Episode to record for the report, with frames, activity and spikes;
    /// counted from 1
    #[arg(verbatim_doc_comment, long, alias = "film", value_name = "N")]
    #[arg(default_value_t = 1, value_parser = within(1..=MAX_EPISODES))]
    pub record_episode: usize,
    /// Nuts in each episode, 1 to 4 [default: as in --config, or 1]
    #[arg(long, value_name = "N", value_parser = whole::<usize>)]
    pub nuts: Option<usize>,
    /// Bolts in each episode, 1 to 4 [default: as in --config, or 1]
    #[arg(long, value_name = "N", value_parser = whole::<usize>)]
    pub bolts: Option<usize>,
    /// Probability that a carried part is dropped, at a random time on its
    /// way; 0 to 1
    #[arg(verbatim_doc_comment, long, default_value_t = 0.0, value_name = "RATE")]
    #[arg(value_parser = number::<f64>)]
    pub drop_rate: f64,
    /// In each episode, let a person change the scene at a random time, as
    /// the task defines it: with nuts and bolts, the last bolt is moved into
    /// the jig within the first 20 s
    #[arg(verbatim_doc_comment, long, alias = "meddle")]
    pub perturb: bool,
    /// Log of interventions in the planner graph, as JSON lines with their
    /// ticks; they are made in the recorded episode
    #[arg(verbatim_doc_comment, long, value_name = "FILE")]
    pub interventions: Option<PathBuf>,
    /// New folder for what the planner's modules show in every tick of the
    /// recorded episode, as .npy files that grow with it
    #[arg(verbatim_doc_comment, long, value_name = "FOLDER")]
    pub stream: Option<PathBuf>,
    #[command(flatten)]
    pub planner: PlannerArgs,
    /// Folder to write; it must not hold a run
    /// [default: out, where an earlier run is replaced]
    #[arg(verbatim_doc_comment, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Replace the files of the folder, even if no run wrote them
    #[arg(long)]
    pub force: bool,
}

/// The arguments of `symbolt view`.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("out", |arg| arg.hide(true)))]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub run: RunArgs,
    /// Let windows watch the run, but not change it; it begins with the
    /// first window, and ends when it is over and the last has left
    #[arg(verbatim_doc_comment, long)]
    pub read_only: bool,
    /// File to write the log of interventions to; it grows with every change,
    /// so Ctrl-C loses nothing
    #[arg(verbatim_doc_comment, long, value_name = "FILE")]
    pub log: Option<PathBuf>,
}

/// Quotes a word for a shell, if it needs quotes.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_./-,".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.into();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

impl RunArgs {
    /// Returns a command line that writes the same files. It has only the options that differ from the defaults.
    pub fn command(&self) -> String {
        let mut words = vec!["symbolt run --seed".to_owned(), self.common.seed.to_string()];
        let mut option = |name: &str, value: Option<String>| {
            words.extend(value.map(|value| format!("--{name} {value}")));
        };
        let count = |count: Option<usize>| count.map(|n| n.to_string());
        let Self { demos, planner, .. } = self;
        let path =
            |path: &Option<PathBuf>| path.as_ref().map(|path| quoted(&path.display().to_string()));
        option("task", demos.task.task.as_deref().map(quoted));
        option("task-file", path(&demos.task.task_file));
        option("demos", (demos.demos != 5).then(|| demos.demos.to_string()));
        option("demo-nuts", count(demos.demo_nuts));
        option("demo-bolts", count(demos.demo_bolts));
        option("config", path(&demos.config));
        let sensing = &demos.sensing;
        option("pose-noise", sensing.pose_noise.as_deref().map(quoted));
        let rate = |rate: f64| (rate != 0.0).then(|| rate.to_string());
        option("outliers", rate(sensing.outliers));
        option("missing", rate(sensing.missing));
        option("swaps", rate(sensing.swaps));
        option("method", (self.method == Method::Paper).then(|| "paper".to_owned()));
        option("episodes", (self.episodes != 1).then(|| self.episodes.to_string()));
        let recorded = self.record_episode;
        option("record-episode", (recorded != 1).then(|| recorded.to_string()));
        option("nuts", count(self.nuts));
        option("bolts", count(self.bolts));
        option("drop-rate", rate(self.drop_rate));
        option("interventions", path(&self.interventions));
        let kind = planner.kind();
        option("planner", (kind != PlannerKind::default()).then(|| kind.name().to_owned()));
        option("mode", (planner.mode != "direct").then(|| quoted(&planner.mode)));
        option("dimensions", count(planner.dimensions));
        let flags = [
            ("--perturb", self.perturb),
            ("--absent", planner.absent),
            ("--first", planner.first),
            ("--products", planner.products),
        ];
        words.extend(flags.into_iter().filter(|f| f.1).map(|f| f.0.to_owned()));
        words.join(" ")
    }
}

#[cfg(test)]
mod tests {
    use clap::{Args, FromArgMatches};

    use super::*;

    fn command(args: &[&str]) -> String {
        let line = ["run"].iter().chain(args);
        let matches = RunArgs::augment_args(clap::Command::new("run")).get_matches_from(line);
        RunArgs::from_arg_matches(&matches).expect("arguments of run").command()
    }

    #[test]
    fn the_command_has_options_that_differ_from_defaults_and_quotes_words() {
        assert_eq!(command(&[]), "symbolt run --seed 1");
        assert_eq!(command(&["--threads", "2", "--json", "--out", "x"]), "symbolt run --seed 1");
        let all = ["--seed", "7", "--drop-rate", "0.3", "--mode", "lif", "--absent", "--meddle"];
        let said = command(&all);
        assert_eq!(said, "symbolt run --seed 7 --drop-rate 0.3 --mode lif --perturb --absent");
        let chain = command(&["--planner", "chain", "--products", "--dimensions", "512"]);
        let expected = "symbolt run --seed 1 --planner chain --dimensions 512 --products";
        assert_eq!(chain, expected);
        let recorded = command(&["--episodes", "9", "--film", "3"]);
        assert_eq!(recorded, "symbolt run --seed 1 --episodes 9 --record-episode 3");
        let task = command(&["--task", "drawer", "--pose-noise", "1,0.5", "--swaps", "0.05"]);
        assert_eq!(task, "symbolt run --seed 1 --task drawer --pose-noise 1,0.5 --swaps 0.05");
        assert_eq!(command(&["--method", "paper"]), "symbolt run --seed 1 --method paper");
        let odd = command(&["--config", "a b;it's.json"]);
        assert_eq!(odd, "symbolt run --seed 1 --config 'a b;it'\\''s.json'");
    }
}
