//! The command line that repeats a run.

use symbolt::task::planner::PlannerKind;

use super::args::{MethodArg, RunArgs};

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
        let path = |path: &Option<std::path::PathBuf>| {
            path.as_ref().map(|path| quoted(&path.display().to_string()))
        };
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
        option("method", (self.method == MethodArg::Paper).then(|| "paper".to_owned()));
        option("episodes", (self.episodes != 1).then(|| self.episodes.to_string()));
        let recorded = self.record_episode;
        option("record-episode", (recorded != 1).then(|| recorded.to_string()));
        option("nuts", count(self.nuts));
        option("bolts", count(self.bolts));
        option("drop-rate", rate(self.drop_rate));
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
    use clap::Parser;

    use crate::cli::args::{Cli, Command};

    fn command(args: &[&str]) -> String {
        let line = ["symbolt", "run"].iter().chain(args);
        match Cli::parse_from(line).command {
            Command::Run(args) => args.command(),
            other => panic!("{other:?}"),
        }
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
