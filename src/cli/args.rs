//! The arguments of every command.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use symbolt::files::Overwrite;
use symbolt::sim::{Real, Seed};
use symbolt::study::catalogue::Options;
use symbolt::task::planner::{PlannerSpec, Unbinding};
use symbolt::task::tasks::nuts_and_bolts::{NutsAndBolts, Order, SyntheticDemonstrations};
use symbolt::task::{Commitment, GaussianGate, Grounding, TaskError};
use thiserror::Error;

/// An argument that clap accepts and the command does not.
#[derive(Debug, Error)]
#[error("{0}")]
pub(crate) struct BadArgument(pub String);

/// Learns symbols from demonstrations and plans with a graph of semantic-pointer modules.
#[derive(Debug, Parser)]
#[command(name = "symbolt", version, about, disable_help_subcommand = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Record demonstrations, learn from them and run episodes; the default command, writes out/
    Run(RunArgs),
    /// Write demonstrations, or a single scene, from physics or from the kinematic generator
    Record(RecordArgs),
    /// Learn states and operators from a recording
    Learn(LearnArgs),
    /// Print the state of every object in a recording or scene
    Classify(ClassifyArgs),
    /// Print the next action in a scene, the whole plan, and when the planner graph decided
    Plan(PlanArgs),
    /// Rename learned states and actions
    Rename(RenameArgs),
    /// Check whether a recording, scene, domain or model file is valid
    Check(CheckArgs),
    /// Run a standard network in neurons and measure its speed and quality
    Bench(BenchArgs),
    /// Write a page that shows a run or experiments
    Report(ReportArgs),
    /// Run or resume an experiment and print its table
    Experiment(ExperimentArgs),
    /// Merge the shards of an experiment
    Merge(MergeArgs),
    /// Print the default scene settings, for use with --config
    Config(ConfigArgs),
    /// Print completions for a shell
    Completions {
        /// Shell
        shell: clap_complete::Shell,
    },
}

/// Options of every command.
#[derive(Debug, Clone, Args)]
pub(crate) struct Common {
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Worker threads; 0 for one per core. Results do not depend on it
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// Print no progress to standard error
    #[arg(long)]
    pub quiet: bool,
    /// Print JSON instead of tables
    #[arg(long)]
    pub json: bool,
}

/// An output file.
#[derive(Debug, Clone, Args)]
pub(crate) struct OutFile {
    /// File to write; must not exist
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    pub force: bool,
}

impl OutFile {
    pub fn overwrite(&self) -> Overwrite {
        if self.force { Overwrite::Allowed } else { Overwrite::Never }
    }
}

/// Options of the planner graph.
#[derive(Debug, Clone, Args)]
pub(crate) struct PlannerArgs {
    /// Mode of the graph's layers: direct, rate or lif
    #[arg(long, default_value = "direct")]
    pub mode: String,
    /// Dimensions of the pointers
    #[arg(long, default_value_t = 256)]
    pub dimensions: usize,
    /// Maximum cosine similarity of two pointers
    #[arg(long, default_value_t = 0.1)]
    pub max_similarity: Real,
    /// Also require that states never seen before an action are absent
    #[arg(long)]
    pub absent: bool,
    /// Act as soon as any action is possible (the paper's rule), instead of when the goal is known to be reachable
    #[arg(long)]
    pub first: bool,
    /// Unbind preconditions with a layer of products instead of a fixed linear map
    #[arg(long)]
    pub products: bool,
}

impl PlannerArgs {
    pub fn spec(&self) -> PlannerSpec {
        PlannerSpec {
            dimensions: self.dimensions,
            max_similarity: self.max_similarity,
            commitment: if self.first { Commitment::First } else { Commitment::Proven },
            absent: self.absent,
            unbinding: if self.products { Unbinding::Products } else { Unbinding::Fixed },
            ..PlannerSpec::default()
        }
    }
}

/// How objects are classified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Rule {
    /// The state with the greatest density, if it is within the limit
    Gated,
    /// The nearest state by p-norm, at any distance (the paper's rule)
    Nearest,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct GroundingArgs {
    /// How objects are assigned to states
    #[arg(long, value_enum, default_value = "gated")]
    pub grounding: Rule,
    /// Maximum distance to a state, in standard deviations
    #[arg(long, default_value_t = GaussianGate::default().limit)]
    pub limit: f64,
}

impl GroundingArgs {
    pub fn rule(&self) -> Grounding {
        match self.grounding {
            Rule::Gated => {
                Grounding::Gated(GaussianGate { limit: self.limit, ..GaussianGate::default() })
            }
            Rule::Nearest => Grounding::paper(),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum OrderArg {
    /// The nut goes into the jig first
    NutFirst,
    /// The bolt goes into the jig first
    BoltFirst,
    /// Either order, at random
    Either,
}

impl From<OrderArg> for Order {
    fn from(order: OrderArg) -> Self {
        match order {
            OrderArg::NutFirst => Self::NutFirst,
            OrderArg::BoltFirst => Self::BoltFirst,
            OrderArg::Either => Self::Either,
        }
    }
}

/// Options of demonstrations.
#[derive(Debug, Clone, Args)]
pub(crate) struct DemoArgs {
    /// Number of demonstrations
    #[arg(long, default_value_t = 5)]
    pub demos: usize,
    /// Nuts in each demonstration, 1 to 4
    #[arg(long)]
    pub demo_nuts: Option<usize>,
    /// Bolts in each demonstration, 1 to 4
    #[arg(long)]
    pub demo_bolts: Option<usize>,
    /// JSON file with the scene's sizes, friction, motors and speeds (see `symbolt config`)
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
}

impl DemoArgs {
    /// The task that they show.
    pub fn task(&self) -> Result<NutsAndBolts, TaskError> {
        let mut spec = self.setting()?;
        spec.nuts = self.demo_nuts.unwrap_or(spec.nuts);
        spec.bolts = self.demo_bolts.unwrap_or(spec.bolts);
        spec.check().map(|()| spec)
    }

    /// The task as it is configured.
    pub fn setting(&self) -> Result<NutsAndBolts, TaskError> {
        self.config.as_deref().map_or_else(|| Ok(NutsAndBolts::default()), NutsAndBolts::read)
    }
}

#[derive(Debug, Clone, Args)]
pub(crate) struct SyntheticArgs {
    /// Which part goes into the jig first
    #[arg(long, value_enum, default_value = "either", requires = "kinematic")]
    pub order: OrderArg,
    /// Probability that an attempt fails
    #[arg(long, default_value_t = 0.0, requires = "kinematic")]
    pub fail_rate: f64,
    /// Probability that a failed attempt drops its part off the table
    #[arg(long, default_value_t = 0.0, requires = "kinematic")]
    pub loss_rate: f64,
    /// Probability that an attempt knocks another part aside
    #[arg(long, default_value_t = 0.0, requires = "kinematic")]
    pub knock_rate: f64,
    /// Omit times, events and touched objects
    #[arg(long, requires = "kinematic")]
    pub no_events: bool,
}

impl SyntheticArgs {
    pub fn synthetic(&self, demos: &DemoArgs) -> SyntheticDemonstrations {
        SyntheticDemonstrations {
            demos: demos.demos,
            nuts: demos.demo_nuts.unwrap_or(1),
            bolts: demos.demo_bolts.unwrap_or(1),
            order: self.order.into(),
            fail_rate: self.fail_rate,
            loss_rate: self.loss_rate,
            knock_rate: self.knock_rate,
            events: !self.no_events,
        }
    }
}

#[derive(Debug, Clone, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub demos: DemoArgs,
    /// Number of episodes after learning
    #[arg(long, default_value_t = 1)]
    pub episodes: usize,
    /// Episode to record and show in the report, with frames, activity and spikes; counted from 1
    #[arg(long, alias = "film", default_value_t = 1, value_name = "NUMBER")]
    pub record_episode: usize,
    /// Nuts in each episode, 1 to 4 [default: as configured, 1]
    #[arg(long)]
    pub nuts: Option<usize>,
    /// Bolts in each episode, 1 to 4 [default: as configured, 1]
    #[arg(long)]
    pub bolts: Option<usize>,
    /// Probability that a carried part is dropped, at a uniformly random moment
    #[arg(long, default_value_t = 0.0, value_name = "RATE")]
    pub drop_rate: f64,
    /// Perturb each episode: the last bolt is moved into the jig at a random moment of the first 20 s
    #[arg(long, alias = "meddle")]
    pub perturb: bool,
    #[command(flatten)]
    pub planner: PlannerArgs,
    /// Folder to write; must not hold an earlier run. Without this, `out` is replaced
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Replace an earlier run in the folder
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct BenchArgs {
    /// Network: bind, state, memory, select, channel, planner or large
    pub model: String,
    #[command(flatten)]
    pub common: Common,
    /// Mode of the layers: lif, rate or direct
    #[arg(long, default_value = "lif")]
    pub mode: String,
    /// Factor on the number of neurons of every ensemble
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR")]
    pub neurons_scale: f64,
    /// Dimensions of pointers
    #[arg(long, default_value_t = 256)]
    pub dimensions: usize,
    /// Simulated seconds, at least 0.3
    #[arg(long, default_value_t = 1.0, value_name = "SECONDS")]
    pub sim_seconds: f64,
    /// Number of runs, whose median time is reported
    #[arg(long, default_value_t = 3)]
    pub runs: usize,
    /// Unbinding in the planner network: products (neurons) or fixed (a linear map)
    #[arg(long, default_value = "products")]
    pub unbinding: String,
    /// Selection in the memory network: winner, accumulators or threshold
    #[arg(long, default_value = "winner")]
    pub choice: String,
    /// Save the solved populations to a file
    #[arg(long, value_name = "FILE", conflicts_with = "load")]
    pub save: Option<PathBuf>,
    /// Replace that file if it exists
    #[arg(long, requires = "save")]
    pub force: bool,
    /// Load the populations from a file instead of solving them
    #[arg(long, value_name = "FILE")]
    pub load: Option<PathBuf>,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct ReportArgs {
    /// Folder of a run or an experiment, or a folder of experiment folders
    pub folder: PathBuf,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub out: OutFile,
}

/// Options that shards of an experiment and their merge must agree on.
#[derive(Debug, Clone, Args)]
pub(crate) struct TrialArgs {
    /// Trials of each cell [default: the experiment's own number]
    #[arg(long, value_name = "N")]
    pub trials: Option<u64>,
    /// Recording to use in addition to our own scene, for `threshold` [default: `nut_bolt_pybullet.jsonl` in the
    /// folder SYMBOLT_RECORDINGS, if it exists]
    #[arg(long, value_name = "FILE")]
    pub recording: Option<PathBuf>,
}

impl TrialArgs {
    pub fn options(&self, common: &Common) -> Options {
        let known = || {
            let folder = PathBuf::from(std::env::var_os("SYMBOLT_RECORDINGS")?);
            Some(folder.join("nut_bolt_pybullet.jsonl")).filter(|path| path.is_file())
        };
        let (seed, recording) = (Seed::new(common.seed), self.recording.clone().or_else(known));
        Options { seed, trials: self.trials, recording }
    }
}

#[derive(Debug, Clone, Args)]
pub(crate) struct ExperimentArgs {
    /// Experiment to run; without it, experiments are listed
    pub name: Option<String>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub trials: TrialArgs,
    /// Folder of trials and results; an earlier run in it is resumed [default: experiments/NAME]
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Delete the folder's trials and start again
    #[arg(long)]
    pub force: bool,
    /// Keep the intact trials of a damaged journal and run the others again
    #[arg(long, conflicts_with = "force")]
    pub salvage: bool,
    /// Run one part of the trials only, such as 2/4
    #[arg(long, value_name = "I/N")]
    pub shard: Option<String>,
}

#[derive(Debug, Clone, Args)]
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
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Replace the trials in that folder
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct ConfigArgs {
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub demos: DemoArgs,
    /// Generate demonstrations without physics, which is much faster
    #[arg(long)]
    pub kinematic: bool,
    #[command(flatten)]
    pub synthetic: SyntheticArgs,
    /// Write a single scene with all parts on the table instead of demonstrations
    #[arg(long)]
    pub scene: bool,
    /// Write the demonstrator's action names to `next_action`
    #[arg(long)]
    pub labels: bool,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct LearnArgs {
    /// Recording, one JSON object per line; - for standard input
    pub recording: PathBuf,
    #[command(flatten)]
    pub common: Common,
    /// Clustering threshold in metres, for every kind; the paper's is 0.001169 [default: found from the data]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    pub threshold: Option<f64>,
    /// Exponent of the distance between positions
    #[arg(long, default_value_t = -2.0, allow_negative_numbers = true)]
    pub p: f64,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct ClassifyArgs {
    /// Learned domain
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
pub(crate) struct PlanArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Scene, one JSON object; - for standard input
    #[arg(long, value_name = "FILE")]
    pub scene: PathBuf,
    /// Goal state [default: the effect of the last action of the demonstrations]
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
pub(crate) struct RenameArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Old and new names, as OLD=NEW
    #[arg(required = true, value_name = "OLD=NEW")]
    pub names: Vec<String>,
    #[command(flatten)]
    pub common: Common,
    /// File to write; must not exist. Without this the domain file is replaced
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replace the file given with --out if it exists
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct CheckArgs {
    /// File to check; - for standard input
    pub file: PathBuf,
    #[command(flatten)]
    pub common: Common,
}
