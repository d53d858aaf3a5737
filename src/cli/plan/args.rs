//! The arguments of `symbolt plan`.

use std::path::PathBuf;

use clap::Args;
use symbolt::sim::SimDuration;

use crate::cli::end::BadArgument;
use crate::cli::options::{Common, GroundingArgs, OutFile, PlannerArgs, number, whole};

#[derive(Debug, Clone, Args)]
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
    /// Goal sets and states that are remembered with a problem in PDDL; a
    /// plan has fewer actions [default: 48 to 600, by the number of fluents]
    #[arg(verbatim_doc_comment, long, value_name = "N", value_parser = whole::<usize>)]
    pub slots: Option<usize>,
    /// Simulated time for planning and acting on PDDL; with a scene, for each
    /// decision of the planner goal-sets [default: 10]
    #[arg(verbatim_doc_comment, long, value_name = "SECONDS", value_parser = number::<f64>)]
    pub time: Option<f64>,
    /// Read the durative actions of a domain in PDDL as instant ones, without
    /// a warning
    #[arg(verbatim_doc_comment, long, conflicts_with = "scene")]
    pub as_instant: bool,
    /// Count spikes and synaptic events of a plan in PDDL with --mode lif
    #[arg(long)]
    pub spikes: bool,
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

/// Greatest simulated time in seconds.
const LONGEST_S: f64 = 3600.0;

impl PlanArgs {
    /// Checks and returns the simulated time for planning.
    pub fn limit(&self) -> Result<SimDuration, BadArgument> {
        let limit = self.time.unwrap_or(10.0);
        if !(limit > 0.0 && limit <= LONGEST_S) {
            let problem = format!("--time must be above 0 and at most {LONGEST_S} s; got {limit}");
            return Err(BadArgument(problem));
        }
        // A tick of the planner takes a millisecond.
        Ok(SimDuration::from_millis(((limit * 1e3).round() as u64).max(1)))
    }
}
