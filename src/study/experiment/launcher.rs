//! The part of an experiment that a cluster's launcher numbers (`--shard auto`).

use std::collections::BTreeMap;
use std::str::FromStr;

use thiserror::Error;

use super::shard::{Shard, unusable};
use crate::task::TaskError;

/// A shard, or the wish to take it from the variables that a cluster's launcher sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShardChoice {
    /// This part.
    Fixed(Shard),
    /// The part that the launcher numbers.
    Auto {
        /// Number of parts; `None` to take it from the launcher as well.
        of: Option<u64>,
    },
}

/// Reads `I/N`, `auto` or `auto/N`.
impl FromStr for ShardChoice {
    type Err = TaskError;

    fn from_str(text: &str) -> Result<Self, TaskError> {
        let Some(rest) = text.strip_prefix("auto") else {
            return text.parse().map(Self::Fixed);
        };
        if rest.is_empty() {
            return Ok(Self::Auto { of: None });
        }
        let of = rest.strip_prefix('/').and_then(|of| of.parse().ok()).filter(|of| *of > 0);
        of.map(|of| Self::Auto { of: Some(of) }).ok_or_else(|| unusable(text))
    }
}

/// The program that numbered a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Launcher {
    /// A task of HyperQueue.
    HyperQueue,
    /// A task of a Slurm job array.
    SlurmArray,
    /// A process of Open MPI's `mpirun`.
    OpenMpi,
    /// A process of a Slurm step, started by `srun`.
    SlurmStep,
}

impl Launcher {
    /// Returns the variable that holds the process's number.
    pub fn variable(self) -> &'static str {
        match self {
            Self::HyperQueue => HQ_TASK_ID,
            Self::SlurmArray => ARRAY_ID,
            Self::OpenMpi => MPI_RANK,
            Self::SlurmStep => STEP_RANK,
        }
    }
}

const HQ_TASK_ID: &str = "HQ_TASK_ID";
const ARRAY_ID: &str = "SLURM_ARRAY_TASK_ID";
const ARRAY_MIN: &str = "SLURM_ARRAY_TASK_MIN";
const ARRAY_MAX: &str = "SLURM_ARRAY_TASK_MAX";
const ARRAY_COUNT: &str = "SLURM_ARRAY_TASK_COUNT";
const ARRAY_STEP: &str = "SLURM_ARRAY_TASK_STEP";
const MPI_RANK: &str = "OMPI_COMM_WORLD_RANK";
const MPI_SIZE: &str = "OMPI_COMM_WORLD_SIZE";
const STEP_RANK: &str = "SLURM_PROCID";
const STEP_TASKS: &str = "SLURM_STEP_NUM_TASKS";
const JOB_TASKS: &str = "SLURM_NTASKS";
const JOB_ID: &str = "SLURM_JOB_ID";

/// Why the variables of the environment do not name a shard.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ShardError {
    /// No launcher has numbered this process.
    #[error(
        "--shard auto: none of the variables {HQ_TASK_ID}, {ARRAY_ID}, {MPI_RANK} and {STEP_RANK} is set; expected a \
         task of HyperQueue, of a Slurm array, of mpirun or of srun; elsewhere give --shard I/N"
    )]
    NoLauncher,
    /// A variable that belongs to another one is not set.
    #[error(
        "--shard auto: {beside} is set and {variable} is not; expected both, or give --shard I/N"
    )]
    Missing {
        /// The variable that is not set.
        variable: &'static str,
        /// The variable that is set.
        beside: &'static str,
    },
    /// A variable is not a whole number.
    #[error("--shard auto: {variable} is `{value}`; expected a whole number of at least {min}")]
    NotANumber {
        /// The variable.
        variable: &'static str,
        /// Its value.
        value: String,
        /// The least valid number.
        min: u64,
    },
    /// The process's number is not one of those that the number of shards allows.
    #[error("--shard auto: {variable} is {value}; expected {min} to {max}{}", .hint)]
    OutOfRange {
        /// The variable.
        variable: &'static str,
        /// Its value.
        value: u64,
        /// The least valid number.
        min: u64,
        /// The greatest valid number.
        max: u64,
        /// Advice that ends the sentence; empty if there is none.
        hint: &'static str,
    },
    /// The launcher started another number of processes than there are shards.
    #[error("--shard auto/{of}: {variable} is {count}; expected {of}, one process for each shard")]
    OtherCount {
        /// The variable.
        variable: &'static str,
        /// Its value.
        count: u64,
        /// The number of shards that was asked for.
        of: u64,
    },
    /// The launcher does not tell how many tasks there are.
    #[error(
        "--shard auto: {variable} is set, but HyperQueue does not give the number of tasks; expected --shard auto/N \
         with `hq submit --array 1-N`"
    )]
    NoCount {
        /// The variable that numbers the task.
        variable: &'static str,
    },
    /// The indices of a Slurm array have gaps, or are listed in uneven distances.
    #[error(
        "--shard auto: {count} tasks from {ARRAY_MIN} {min} to {ARRAY_MAX} {max} in steps of {step} leave gaps; \
         expected an array such as 1-8; for some tasks of it give --shard auto/N with their numbers from 1 to N"
    )]
    Gaps {
        /// The least index.
        min: u64,
        /// The greatest index.
        max: u64,
        /// The number of tasks.
        count: u64,
        /// The distance between two indices.
        step: u64,
    },
    /// A Slurm array begins at another index than 0 or 1, so it is likely to be a part of an array that runs again.
    #[error(
        "--shard auto: {ARRAY_MIN} is {min}; expected 0 or 1, where a whole array begins; for some tasks of it give \
         --shard auto/N with their numbers from 1 to N"
    )]
    Part {
        /// The least index.
        min: u64,
    },
    /// A batch script's own process is not one of the job's tasks.
    #[error(
        "--shard auto: {STEP_RANK} is set, but {STEP_TASKS} is not, so this is a job's script and not one of its \
         {tasks} tasks; expected `srun symbolt ...`, or `sbatch --array`"
    )]
    NotInStep {
        /// The number of tasks of the job.
        tasks: u64,
    },
    /// Several processes share one task of a Slurm array, so all of them would run the same shard.
    #[error(
        "--shard auto: {ARRAY_ID} is set and {variable} is {count}; expected one process for each task of the array, \
         or give --shard I/N"
    )]
    SharedTask {
        /// The variable that counts the processes.
        variable: &'static str,
        /// The number of processes.
        count: u64,
    },
}

/// Environment variables by name.
pub type Variables = BTreeMap<String, String>;

impl ShardChoice {
    /// Returns the shard, and the launcher that numbered it; `None` for a fixed shard. The process's own environment is
    /// not read: `variables` holds what the launcher set.
    ///
    /// The innermost launcher counts. A HyperQueue worker and `mpirun` may run inside a Slurm job, and their processes
    /// inherit its variables. With [`Auto`](Self::Auto) and a number, tasks of HyperQueue and of Slurm arrays are
    /// numbered from 1 as shards are. So some tasks can be submitted again under their own numbers.
    ///
    /// # Errors
    /// [`ShardError`] if no launcher has set its variables, or if they do not name one of the shards.
    ///
    /// **Source**: Slurm's manual pages `sbatch` and `srun` and its `env.c`; Open MPI's documentation, section 11.1;
    /// HyperQueue's documentation, "Jobs" and "Task arrays".
    ///
    /// ```
    /// # use std::collections::BTreeMap;
    /// # use symbolt::study::experiment::{Shard, ShardChoice};
    /// let set = |name: &str, value: &str| (name.to_owned(), value.to_owned());
    /// let variables = BTreeMap::from([set("OMPI_COMM_WORLD_RANK", "2"), set("OMPI_COMM_WORLD_SIZE", "8")]);
    /// let (shard, _) = ShardChoice::Auto { of: None }.resolve(&variables)?;
    /// assert_eq!(shard, Shard { index: 2, of: 8 });
    /// # Ok::<(), symbolt::study::experiment::ShardError>(())
    /// ```
    pub fn resolve(self, variables: &Variables) -> Result<(Shard, Option<Launcher>), ShardError> {
        let of = match self {
            Self::Fixed(shard) => return Ok((shard, None)),
            Self::Auto { of } => of,
        };
        let launchers = [
            (Launcher::HyperQueue, hyperqueue as Rule),
            (Launcher::SlurmArray, array),
            (Launcher::OpenMpi, open_mpi),
            (Launcher::SlurmStep, step),
        ];
        let found = launchers.into_iter().find(|(l, _)| variables.contains_key(l.variable()));
        let (launcher, rule) = found.ok_or(ShardError::NoLauncher)?;
        Ok((rule(variables, of)?, Some(launcher)))
    }
}

type Rule = fn(&Variables, Option<u64>) -> Result<Shard, ShardError>;

/// Returns the number that a variable holds; `None` if it is not set.
fn number(
    variables: &Variables,
    variable: &'static str,
    min: u64,
) -> Result<Option<u64>, ShardError> {
    let Some(value) = variables.get(variable) else { return Ok(None) };
    let number = value.parse().ok().filter(|number| *number >= min);
    let fault = || ShardError::NotANumber { variable, value: value.clone(), min };
    number.map(Some).ok_or_else(fault)
}

/// Returns the number that a variable holds, which must be set because `beside` is.
fn needed(
    variables: &Variables,
    variable: &'static str,
    min: u64,
    beside: &'static str,
) -> Result<u64, ShardError> {
    number(variables, variable, min)?.ok_or(ShardError::Missing { variable, beside })
}

/// Returns the shard of a task that is numbered from 1, as shards are.
fn numbered(
    variable: &'static str,
    value: u64,
    of: u64,
    hint: &'static str,
) -> Result<Shard, ShardError> {
    if !(1..=of).contains(&value) {
        return Err(ShardError::OutOfRange { variable, value, min: 1, max: of, hint });
    }
    Ok(Shard { index: value - 1, of })
}

fn hyperqueue(variables: &Variables, of: Option<u64>) -> Result<Shard, ShardError> {
    let of = of.ok_or(ShardError::NoCount { variable: HQ_TASK_ID })?;
    let id = needed(variables, HQ_TASK_ID, 0, HQ_TASK_ID)?;
    numbered(HQ_TASK_ID, id, of, ", as `hq submit --array 1-N` numbers them")
}

fn array(variables: &Variables, of: Option<u64>) -> Result<Shard, ShardError> {
    for variable in [MPI_SIZE, STEP_TASKS] {
        let count = number(variables, variable, 1)?.unwrap_or(1);
        if count > 1 {
            return Err(ShardError::SharedTask { variable, count });
        }
    }
    let id = needed(variables, ARRAY_ID, 0, ARRAY_ID)?;
    if let Some(of) = of {
        return numbered(ARRAY_ID, id, of, ", as `sbatch --array=1-N` numbers them");
    }
    let min = needed(variables, ARRAY_MIN, 0, ARRAY_ID)?;
    let max = needed(variables, ARRAY_MAX, 0, ARRAY_ID)?;
    let step = number(variables, ARRAY_STEP, 1)?.unwrap_or(1);
    if !(min..=max).contains(&id) {
        return Err(ShardError::OutOfRange { variable: ARRAY_ID, value: id, min, max, hint: "" });
    }
    if min > 1 {
        return Err(ShardError::Part { min });
    }
    let places = ((max - min) / step).saturating_add(1);
    let count = number(variables, ARRAY_COUNT, 1)?.unwrap_or(places);
    if count != places || !(max - min).is_multiple_of(step) || !(id - min).is_multiple_of(step) {
        return Err(ShardError::Gaps { min, max, count, step });
    }
    Ok(Shard { index: ((id - min) / step).min(count - 1), of: count })
}

/// Returns the shard of a process that is numbered from 0.
fn ranked(
    [variable, counter]: [&'static str; 2],
    [rank, count]: [u64; 2],
    of: Option<u64>,
) -> Result<Shard, ShardError> {
    if let Some(of) = of.filter(|of| *of != count) {
        return Err(ShardError::OtherCount { variable: counter, count, of });
    }
    if rank >= count {
        let max = count - 1;
        return Err(ShardError::OutOfRange { variable, value: rank, min: 0, max, hint: "" });
    }
    Ok(Shard { index: rank, of: count })
}

fn open_mpi(variables: &Variables, of: Option<u64>) -> Result<Shard, ShardError> {
    let rank = needed(variables, MPI_RANK, 0, MPI_RANK)?;
    let size = needed(variables, MPI_SIZE, 1, MPI_RANK)?;
    ranked([MPI_RANK, MPI_SIZE], [rank, size], of)
}

fn step(variables: &Variables, of: Option<u64>) -> Result<Shard, ShardError> {
    let rank = needed(variables, STEP_RANK, 0, STEP_RANK)?;
    if let Some(tasks) = number(variables, STEP_TASKS, 1)? {
        return ranked([STEP_RANK, STEP_TASKS], [rank, tasks], of);
    }
    let tasks = needed(variables, JOB_TASKS, 1, STEP_RANK)?;
    // Slurm gives a job's script the rank 0 and the number of tasks that `srun` would start.
    if tasks > 1 && variables.contains_key(JOB_ID) {
        return Err(ShardError::NotInStep { tasks });
    }
    ranked([STEP_RANK, JOB_TASKS], [rank, tasks], of)
}
