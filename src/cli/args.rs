//! The arguments of every command.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use symbolt::sim::{Real, Seed};
use symbolt::study::experiment::Options;
use symbolt::task::planner::{PlannerSpec, Unbinding};
use symbolt::task::tasks::nuts_and_bolts::{NutsAndBolts, Order, SyntheticDemonstrations};
use symbolt::task::{Commitment, Gate, Grounding, Overwrite, TaskError};
use thiserror::Error;

/// An argument that does not fit, found after parsing.
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
    /// The main job (also without a command): demonstrations, learning, a plan; writes out/
    Run(RunArgs),
    /// Writes demonstrations, or a single scene, from physics or from the kinematic generator
    Record(RecordArgs),
    /// Learns states and operators from a recording
    Learn(LearnArgs),
    /// Says in which state every object of a recording or scene is
    Classify(ClassifyArgs),
    /// Says what to do next in a scene, the whole plan, and when the planner graph knew
    Plan(PlanArgs),
    /// Gives learned states and actions other names
    Rename(RenameArgs),
    /// Says whether a recording, scene, domain or model file is sound
    Check(CheckArgs),
    /// Runs a standard network in neurons and says how fast and how well
    Bench(BenchArgs),
    /// Writes one page that shows a run, or experiments
    Report(ReportArgs),
    /// Runs an experiment's trials, or goes on with them, and prints its table
    Experiment(ExperimentArgs),
    /// Puts the shards of an experiment together
    Merge(MergeArgs),
    /// Prints the scene's settings, to be changed and given to --config
    Config(ConfigArgs),
    /// Prints completions for a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// What every command takes.
#[derive(Debug, Clone, Args)]
pub(crate) struct Common {
    /// Where all randomness comes from
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Worker threads; 0 for one a core. Results do not depend on it
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// No progress on standard error
    #[arg(long)]
    pub quiet: bool,
    /// JSON on standard output instead of tables
    #[arg(long)]
    pub json: bool,
}

/// Where a file goes.
#[derive(Debug, Clone, Args)]
pub(crate) struct OutFile {
    /// The file to write; refused if it exists
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

/// How a planner graph is made.
#[derive(Debug, Clone, Args)]
pub(crate) struct PlannerArgs {
    /// How the graph's layers are computed: direct, rate or lif
    #[arg(long, default_value = "direct")]
    pub mode: String,
    /// Dimensions of the pointers
    #[arg(long, default_value_t = 256)]
    pub dimensions: usize,
    /// Greatest cosine between any two pointers
    #[arg(long, default_value_t = 0.1)]
    pub max_similarity: Real,
    /// States that never held before an action must be absent
    #[arg(long)]
    pub absent: bool,
    /// Act as soon as any action can be done (the paper's rule), instead of when the goal is shown to
    /// be within reach
    #[arg(long)]
    pub first: bool,
    /// Unbind preconditions by a layer of products instead of a fixed linear map
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

/// Which rule says in which state an object is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Rule {
    /// The state of greatest density within the limit, or none
    Gated,
    /// The paper's: the nearest state by p-norm, however far
    Nearest,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct GroundingArgs {
    /// How an object's state is found
    #[arg(long, value_enum, default_value = "gated")]
    pub grounding: Rule,
    /// Greatest distance to a state, in standard deviations
    #[arg(long, default_value_t = Gate::default().limit)]
    pub limit: f64,
}

impl GroundingArgs {
    pub fn rule(&self) -> Grounding {
        match self.grounding {
            Rule::Gated => Grounding::Gated(Gate { limit: self.limit, ..Gate::default() }),
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
    /// Both orders occur
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

/// What demonstrations show.
#[derive(Debug, Clone, Args)]
pub(crate) struct DemoArgs {
    /// How many demonstrations
    #[arg(long, default_value_t = 5)]
    pub demos: usize,
    /// Nuts in each demonstration, 1 to 4
    #[arg(long)]
    pub demo_nuts: Option<usize>,
    /// Bolts in each demonstration, 1 to 4
    #[arg(long)]
    pub demo_bolts: Option<usize>,
    /// The scene's sizes, friction, motors and speeds, as JSON (see `symbolt config`)
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
    /// Probability that a try fails
    #[arg(long, default_value_t = 0.0, requires = "kinematic")]
    pub fail_rate: f64,
    /// Probability that a failed try loses its part off the table
    #[arg(long, default_value_t = 0.0, requires = "kinematic")]
    pub loss_rate: f64,
    /// Probability that a try knocks another part aside
    #[arg(long, default_value_t = 0.0, requires = "kinematic")]
    pub knock_rate: f64,
    /// Leave out times, events and touched objects
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
    /// Episodes after learning
    #[arg(long, default_value_t = 1)]
    pub episodes: usize,
    /// The episode whose frames, modules and spikes are kept and shown in the report
    #[arg(long, default_value_t = 1, value_name = "NUMBER")]
    pub film: usize,
    /// Nuts in each episode's scene, 1 to 4 (the configuration's: 1)
    #[arg(long)]
    pub nuts: Option<usize>,
    /// Bolts in each episode's scene, 1 to 4 (the configuration's: 1)
    #[arg(long)]
    pub bolts: Option<usize>,
    /// Probability, for each grasp, that the fingers open at a uniformly drawn moment of the carrying
    #[arg(long, default_value_t = 0.0, value_name = "RATE")]
    pub drop_rate: f64,
    /// A person puts the last bolt into the jig at some moment of each episode's first 20 s
    #[arg(long, alias = "meddle")]
    pub perturb: bool,
    #[command(flatten)]
    pub planner: PlannerArgs,
    /// The folder to write; refused if it holds an earlier run. Without this, `out` is replaced
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Replace an earlier run in the folder
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct BenchArgs {
    /// bind, state, memory, select, channel, planner or large
    pub model: String,
    #[command(flatten)]
    pub common: Common,
    /// How the layers are computed: lif, rate or direct
    #[arg(long, default_value = "lif")]
    pub mode: String,
    /// Multiplies every number of neurons
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR")]
    pub neurons_scale: f64,
    /// Dimensions of pointers
    #[arg(long, default_value_t = 256)]
    pub dimensions: usize,
    /// Simulated seconds (at least 0.3)
    #[arg(long, default_value_t = 1.0, value_name = "SECONDS")]
    pub sim_seconds: f64,
    /// Runs, of which the median time counts
    #[arg(long, default_value_t = 3)]
    pub runs: usize,
    /// How the planner unbinds: products, in neurons, or fixed, by a linear map
    #[arg(long, default_value = "products")]
    pub unbinding: String,
    /// How the memory chooses: winner, accumulators or threshold
    #[arg(long, default_value = "winner")]
    pub choice: String,
    /// Write the solved populations to a file
    #[arg(long, value_name = "FILE", conflicts_with = "load")]
    pub save: Option<PathBuf>,
    /// Replace that file if it exists
    #[arg(long, requires = "save")]
    pub force: bool,
    /// Take the populations from a file instead of solving for them
    #[arg(long, value_name = "FILE")]
    pub load: Option<PathBuf>,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct ReportArgs {
    /// The folder of a run, of an experiment, or of experiments' folders
    pub folder: PathBuf,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub out: OutFile,
}

/// What an experiment's trials are; shards and their merging take the same.
#[derive(Debug, Clone, Args)]
pub(crate) struct TrialArgs {
    /// Trials a cell, instead of the experiment's own number
    #[arg(long, value_name = "N")]
    pub trials: Option<u64>,
    /// A recording to use beside our own scene (threshold); without it, `nut_bolt_pybullet.jsonl` in the folder that
    /// SYMBOLT_RECORDINGS names, if it is there
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
    /// The experiment; without one, a list of them
    pub name: Option<String>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub trials: TrialArgs,
    /// The folder of trials and results [default: experiments/NAME]; what is there is gone on with
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Forget the folder's trials and begin anew
    #[arg(long)]
    pub force: bool,
    /// Keep the sound trials of a damaged folder and do the others again
    #[arg(long, conflicts_with = "force")]
    pub salvage: bool,
    /// Do only one part of the trials, such as 2/4
    #[arg(long, value_name = "I/N")]
    pub shard: Option<String>,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct MergeArgs {
    /// The experiment
    pub name: String,
    /// The folders of its shards
    pub folders: Vec<PathBuf>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub trials: TrialArgs,
    /// The folder for the whole
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Replace the trials of that folder
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
    /// Write where parts would be instead of simulating them: many demonstrations in no time
    #[arg(long)]
    pub kinematic: bool,
    #[command(flatten)]
    pub synthetic: SyntheticArgs,
    /// Write a single scene with all parts on the table instead of demonstrations
    #[arg(long)]
    pub scene: bool,
    /// Write the demonstrator's names for its actions into `next_action`
    #[arg(long)]
    pub labels: bool,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct LearnArgs {
    /// The recording, one JSON object a line; - for standard input
    pub recording: PathBuf,
    #[command(flatten)]
    pub common: Common,
    /// The clustering threshold in metres for every kind (the paper's is 0.001169); by default it is
    /// found from the data
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    pub threshold: Option<f64>,
    /// The exponent of the distance between positions
    #[arg(long, default_value_t = -2.0, allow_negative_numbers = true)]
    pub p: f64,
    #[command(flatten)]
    pub out: OutFile,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct ClassifyArgs {
    /// The learned domain
    pub domain: PathBuf,
    /// The recording or scene; - for standard input
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
    /// The learned domain; - for standard input
    pub domain: PathBuf,
    /// The scene, one JSON object; - for standard input
    #[arg(long, value_name = "FILE")]
    pub scene: PathBuf,
    /// The state that is wanted; by default what the last action of the demonstrations brought about
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
    /// The learned domain; - for standard input
    pub domain: PathBuf,
    /// Old and new names, as OLD=NEW
    #[arg(required = true, value_name = "OLD=NEW")]
    pub names: Vec<String>,
    #[command(flatten)]
    pub common: Common,
    /// The file to write; refused if it exists. Without this the domain file itself is replaced
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replace the file given with --out if it exists
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct CheckArgs {
    /// The file; - for standard input
    pub file: PathBuf,
    #[command(flatten)]
    pub common: Common,
}
