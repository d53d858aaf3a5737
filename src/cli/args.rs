//! The arguments of commands that several files share, and of those that learn and plan.

use std::path::PathBuf;

use clap::Args;

pub(crate) use super::end::BadArgument;
pub(crate) use super::options::{
    Common, DemoArgs, GroundingArgs, MethodArg, OutFile, PlannerArgs, number, whole,
};

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
