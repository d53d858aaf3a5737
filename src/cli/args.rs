//! The commands and their arguments.

use std::fmt::Display;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use symbolt::sim::Seed;
use symbolt::study::catalogue::{Options, TAKES_RECORDING};
use thiserror::Error;

pub(crate) use super::options::{
    Common, DemoArgs, GroundingArgs, MethodArg, OutFile, PlannerArgs, SensingArgs, SyntheticArgs,
    TaskArgs, demonstrated, number, whole,
};

/// A sentence on a well-formed argument that the command cannot use.
#[derive(Debug, Error)]
#[error("{0}")]
pub(crate) struct BadArgument(pub String);

impl BadArgument {
    /// Builds the sentence for a value outside the range of its option.
    pub fn range(option: &str, value: impl Display, expected: &str) -> Self {
        Self(format!("{option} {value}: must be {expected}"))
    }
}

/// Learns symbols from demonstrations of a robot's task and plans with them.
#[derive(Debug, Parser)]
#[command(
    name = "symbolt",
    version,
    disable_help_subcommand = true,
    override_usage = "symbolt [OPTIONS OF run]\n       symbolt <COMMAND> [OPTIONS]",
    after_help = "Without a command, `symbolt` does what `symbolt run` does: it records\n\
                  demonstrations, learns from them, runs an episode, and writes the folder out/.\n\
                  `symbolt COMMAND --help` lists the options of a command and their defaults."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Record demonstrations, learn from them, run episodes (default)
    Run(RunArgs),
    /// Record demonstrations or a single scene, with or without physics
    Record(RecordArgs),
    /// Learn states and actions from a recording
    Learn(LearnArgs),
    /// Print the state of every object in a recording or scene
    Classify(ClassifyArgs),
    /// Print the next action in a scene, the plan, and the decision time
    Plan(PlanArgs),
    /// Print every action that is possible in a scene
    Actions(ActionsArgs),
    /// Write a learned domain and a scene as PDDL
    Pddl(PddlArgs),
    /// Learn an action model in PDDL from state-action trajectories
    LearnModel(LearnModelArgs),
    /// Rename states and actions in place, or to a new file with --out
    Rename(RenameArgs),
    /// Check a recording, scene, scene settings, domain or model file
    Check(CheckArgs),
    /// Measure the speed and quality of a standard network of neurons
    Bench(BenchArgs),
    /// Write an HTML page about a run or experiments
    Report(ReportArgs),
    /// Run or resume an experiment and print its table
    Experiment(ExperimentArgs),
    /// Merge the shards of an experiment
    Merge(MergeArgs),
    /// Print the default settings of a task, for use with --config
    Config(ConfigArgs),
    /// Print a completion script for a shell
    Completions {
        /// Shell
        shell: clap_complete::Shell,
    },
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub demos: DemoArgs,
    /// Learner: relational (states in the frames of objects, actions with
    /// parameters) or paper (states in the world frame, as in the paper)
    /// [default: relational]
    #[arg(verbatim_doc_comment, hide_possible_values = true, hide_default_value = true)]
    #[arg(long, value_name = "METHOD", value_enum, default_value = "relational")]
    pub method: MethodArg,
    /// Number of episodes after learning, at most 1000
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<usize>)]
    pub episodes: usize,
    /// Episode to record for the report, with frames, activity and spikes;
    /// counted from 1
    #[arg(verbatim_doc_comment, long, alias = "film", value_name = "N")]
    #[arg(default_value_t = 1, value_parser = whole::<usize>)]
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

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct BenchArgs {
    /// Network: bind, state, memory, select, channel, planner, large or brain
    pub model: String,
    #[command(flatten)]
    pub common: Common,
    /// Mode of the layers: direct, rate or lif (spiking)
    #[arg(long, default_value = "lif")]
    pub mode: String,
    /// Factor by which to multiply the neurons of every ensemble
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", value_parser = number::<f64>)]
    pub neurons_scale: f64,
    /// Dimensions of the pointers
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = whole::<usize>)]
    pub dimensions: usize,
    /// Simulated time in seconds, 0.3 to 3600
    #[arg(long, default_value_t = 1.0, value_name = "SECONDS", value_parser = number::<f64>)]
    pub sim_seconds: f64,
    /// Number of runs; the median one is reported
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = whole::<usize>)]
    pub runs: usize,
    /// Unbinding of the network `planner`: products (neurons)
    /// or fixed (a linear map)
    #[arg(verbatim_doc_comment, long, value_name = "WAY", default_value = "products")]
    pub unbinding: String,
    /// Selection of the network `memory`: winner, accumulators
    /// or threshold
    #[arg(verbatim_doc_comment, long, value_name = "RULE", default_value = "winner")]
    pub choice: String,
    /// File to write the solved populations to; it must not exist
    #[arg(long, value_name = "FILE", conflicts_with = "load")]
    pub save: Option<PathBuf>,
    /// Replace the file of --save if it exists
    #[arg(long, requires = "save")]
    pub force: bool,
    /// File to read the solved populations from
    #[arg(long, value_name = "FILE")]
    pub load: Option<PathBuf>,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct ReportArgs {
    /// Folder of a run, of an experiment, or of several experiments' folders
    pub folder: PathBuf,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub out: OutFile,
}

/// Options that shards of an experiment and their merge must agree on.
#[derive(Debug, Clone, Args)]
pub(crate) struct TrialArgs {
    /// Trials of each cell
    /// [default: the experiment's own number; to merge, the shards' number]
    #[arg(verbatim_doc_comment, long, value_name = "N", value_parser = whole::<u64>)]
    pub trials: Option<u64>,
    /// Recording for the experiment `threshold`, beside its own scene
    /// [default: nut_bolt_pybullet.jsonl in $SYMBOLT_RECORDINGS, if found]
    #[arg(verbatim_doc_comment, long, value_name = "FILE")]
    pub recording: Option<PathBuf>,
    /// Folder of PDDL problems for the experiment `ipc`
    #[arg(long, value_name = "FOLDER")]
    pub problems: Option<PathBuf>,
}

impl TrialArgs {
    /// # Errors
    /// For `--problems -`, since elsewhere `-` means standard input.
    pub fn options(&self, common: &Common) -> Result<Options, BadArgument> {
        if self.problems.as_deref().is_some_and(|folder| folder.as_os_str() == "-") {
            let expected = "a folder; for a folder of this name write ./-";
            return Err(BadArgument::range("--problems", "-", expected));
        }
        let known = || {
            let folder = PathBuf::from(std::env::var_os("SYMBOLT_RECORDINGS")?);
            Some(folder.join("nut_bolt_pybullet.jsonl")).filter(|path| path.is_file())
        };
        let (seed, recording) = (Seed::new(common.seed), self.recording.clone().or_else(known));
        Ok(Options { seed, trials: self.trials, recording, problems: self.problems.clone() })
    }

    /// Refuses a recording that is named for an experiment that would not read it.
    ///
    /// # Errors
    /// For `--recording` with any experiment but `threshold`.
    pub fn recording_is_used(&self, experiment: &str) -> Result<(), BadArgument> {
        match &self.recording {
            Some(path) if experiment != TAKES_RECORDING => {
                let expected = "absent; only the experiment `threshold` takes a recording";
                Err(BadArgument::range("--recording", path.display(), expected))
            }
            _ => Ok(()),
        }
    }
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct ExperimentArgs {
    /// Experiment to run; without it, experiments are listed
    pub name: Option<String>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub trials: TrialArgs,
    /// Folder of trials and results; an earlier run in it is resumed
    /// [default: experiments/NAME]
    #[arg(verbatim_doc_comment, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Delete the folder's trials and start again
    #[arg(long)]
    pub force: bool,
    /// Keep the intact trials of a damaged journal and run the others again
    #[arg(long, conflicts_with = "force")]
    pub salvage: bool,
    /// Run only one part of the trials, such as 2/4; auto takes the part from
    /// Slurm, Open MPI or HyperQueue, auto/8 takes its number in 8 parts
    #[arg(verbatim_doc_comment, long, value_name = "I/N")]
    pub shard: Option<String>,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct MergeArgs {
    /// Experiment
    pub name: String,
    /// Folders of the shards
    pub folders: Vec<PathBuf>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub trials: TrialArgs,
    /// Folder for the merged experiment
    #[arg(long, value_name = "FOLDER", required_unless_present = "status")]
    pub out: Option<PathBuf>,
    /// Replace the trials in that folder
    #[arg(long)]
    pub force: bool,
    /// Merge nothing; list the missing trials of each shard and cell
    #[arg(long, conflicts_with_all = ["out", "force"])]
    pub status: bool,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct ConfigArgs {
    #[command(flatten)]
    pub task: TaskArgs,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub demos: DemoArgs,
    /// Generate the demonstrations without physics, which is much faster
    #[arg(long)]
    pub kinematic: bool,
    #[command(flatten)]
    pub synthetic: SyntheticArgs,
    /// Write a single scene with all parts on the table, no demonstrations
    #[arg(long, conflicts_with = "demos")]
    pub scene: bool,
    /// Write the names of actions to `next_action`; needs --kinematic
    #[arg(long)]
    pub labels: bool,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct LearnArgs {
    /// Recording with one JSON object per line; - for standard input
    pub recording: PathBuf,
    #[command(flatten)]
    pub common: Common,
    /// Learner: relational (states in the frames of objects, actions with
    /// parameters) or paper (states in the world frame, as in the paper)
    /// [default: relational; paper if --threshold is given]
    #[arg(verbatim_doc_comment, hide_possible_values = true)]
    #[arg(long, value_name = "METHOD", value_enum)]
    pub method: Option<MethodArg>,
    /// Clustering threshold for every kind, such as 1.169mm (the paper's)
    /// or 0.001169m; without a unit in metres; needs the method paper
    /// [default: found from the data]
    #[arg(verbatim_doc_comment, long, value_name = "LENGTH", allow_negative_numbers = true)]
    pub threshold: Option<String>,
    /// Exponent p of the p-norm that measures distances; not 0
    #[arg(long, default_value_t = -2.0, value_parser = number::<f64>)]
    pub p: f64,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct LearnModelArgs {
    /// PDDL domain with types, predicates and the actions' parameters;
    /// preconditions and effects are not used; - for standard input
    #[arg(verbatim_doc_comment)]
    pub domain: PathBuf,
    /// Trajectories of SAM or AMLGym; - for standard input
    #[arg(required = true)]
    pub trajectories: Vec<PathBuf>,
    #[command(flatten)]
    pub common: Common,
    /// Keep every precondition that always held (safe action model
    /// learning); by default the evidence for each is weighed
    #[arg(verbatim_doc_comment, long)]
    pub safe: bool,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct ClassifyArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Recording or scene; - for standard input
    pub recording: PathBuf,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub grounding: GroundingArgs,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct PlanArgs {
    /// Learned domain, or a domain in PDDL; - for standard input
    pub domain: PathBuf,
    /// Problem in PDDL: the planner of goal sets plans and acts until the
    /// goal holds
    #[arg(verbatim_doc_comment)]
    pub problem: Option<PathBuf>,
    /// Scene, a file with one JSON object; - for standard input
    #[arg(long, value_name = "FILE", conflicts_with = "problem")]
    pub scene: Option<PathBuf>,
    /// Goal sets that are remembered with a problem in PDDL; a plan has fewer
    /// actions [default: 48]
    #[arg(verbatim_doc_comment, long, value_name = "N", value_parser = whole::<usize>)]
    pub slots: Option<usize>,
    /// Simulated time for planning and acting on PDDL; with a scene, for each
    /// decision of the planner goal-sets [default: 10]
    #[arg(verbatim_doc_comment, long, value_name = "SECONDS", value_parser = number::<f64>)]
    pub time: Option<f64>,
    /// State to reach [default: the goal of the demonstrations]
    #[arg(long, value_name = "STATE")]
    pub goal: Option<String>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub planner: PlannerArgs,
    #[command(flatten)]
    pub grounding: GroundingArgs,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct ActionsArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Scene, a file with one JSON object; - for standard input
    #[arg(long, value_name = "FILE")]
    pub scene: PathBuf,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub grounding: GroundingArgs,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct PddlArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Scene, a file with one JSON object; - for standard input
    #[arg(long, value_name = "FILE")]
    pub scene: PathBuf,
    /// State to reach [default: the goal of the demonstrations]
    #[arg(long, value_name = "STATE")]
    pub goal: Option<String>,
    /// Folder for domain.pddl and problem.pddl
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Replace the files if they exist
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub grounding: GroundingArgs,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct RenameArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Old and new name of a state or action
    #[arg(required = true, value_name = "OLD=NEW")]
    pub names: Vec<String>,
    #[command(flatten)]
    pub common: Common,
    /// File to write; it must not exist; - for standard output
    /// [default: the domain file itself, which is replaced]
    #[arg(verbatim_doc_comment, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replace the file of --out if it exists
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Clone, Args)]
#[command(next_line_help = true, allow_negative_numbers = true)]
pub(crate) struct CheckArgs {
    /// File to check; - for standard input
    pub file: PathBuf,
    #[command(flatten)]
    pub common: Common,
}
