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

// The variables that number a process: a task of HyperQueue or of a Slurm job array, a process of Open MPI's `mpirun`,
// and a process of a Slurm step, started by `srun`; and those beside them.
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

/// Why the variables of the environment do not name a shard: a sentence that names the variable and what was expected.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("--shard auto{0}")]
pub struct ShardError(String);

/// Refuses what `--shard auto` found, in a sentence.
fn refused<T>(problem: String) -> Result<T, ShardError> {
    Err(ShardError(format!(": {problem}")))
}

/// Environment variables by name.
type Variables = BTreeMap<String, String>;

impl ShardChoice {
    /// Returns the shard, and the variable by which a launcher numbered it; `None` for a fixed shard. The process's own environment is
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
    pub fn resolve(
        self,
        variables: &Variables,
    ) -> Result<(Shard, Option<&'static str>), ShardError> {
        let of = match self {
            Self::Fixed(shard) => return Ok((shard, None)),
            Self::Auto { of } => of,
        };
        let launchers = [
            (HQ_TASK_ID, hyperqueue as Rule),
            (ARRAY_ID, array),
            (MPI_RANK, open_mpi),
            (STEP_RANK, step),
        ];
        match launchers.into_iter().find(|(variable, _)| variables.contains_key(*variable)) {
            Some((variable, rule)) => Ok((rule(variables, of)?, Some(variable))),
            None => refused(format!(
                "none of the variables {HQ_TASK_ID}, {ARRAY_ID}, {MPI_RANK} and {STEP_RANK} is set; expected a task of \
                 HyperQueue, of a Slurm array, of mpirun or of srun; elsewhere give --shard I/N"
            )),
        }
    }
}

type Rule = fn(&Variables, Option<u64>) -> Result<Shard, ShardError>;

/// Returns the number that a variable holds; `None` if it is not set.
fn number(variables: &Variables, variable: &str, min: u64) -> Result<Option<u64>, ShardError> {
    let Some(value) = variables.get(variable) else { return Ok(None) };
    match value.parse().ok().filter(|number| *number >= min) {
        None => {
            refused(format!("{variable} is `{value}`; expected a whole number of at least {min}"))
        }
        number => Ok(number),
    }
}

/// Returns the number that a variable holds, which must be set because `beside` is.
fn needed(
    variables: &Variables,
    variable: &str,
    min: u64,
    beside: &str,
) -> Result<u64, ShardError> {
    match number(variables, variable, min)? {
        Some(number) => Ok(number),
        None => refused(format!(
            "{beside} is set and {variable} is not; expected both, or give --shard I/N"
        )),
    }
}

/// Checks that a process's number is one of those that the number of shards allows. `hint` ends the sentence.
fn in_range(
    variable: &str,
    value: u64,
    [min, max]: [u64; 2],
    hint: &str,
) -> Result<(), ShardError> {
    match (min..=max).contains(&value) {
        true => Ok(()),
        false => refused(format!("{variable} is {value}; expected {min} to {max}{hint}")),
    }
}

/// Returns the shard of a task that is numbered from 1, as shards are.
fn numbered(variable: &str, value: u64, of: u64, hint: &str) -> Result<Shard, ShardError> {
    in_range(variable, value, [1, of], hint)?;
    Ok(Shard { index: value - 1, of })
}

fn hyperqueue(variables: &Variables, of: Option<u64>) -> Result<Shard, ShardError> {
    let Some(of) = of else {
        return refused(format!(
            "{HQ_TASK_ID} is set, but HyperQueue does not give the number of tasks; expected --shard auto/N with \
             `hq submit --array 1-N`"
        ));
    };
    let id = needed(variables, HQ_TASK_ID, 0, HQ_TASK_ID)?;
    numbered(HQ_TASK_ID, id, of, ", as `hq submit --array 1-N` numbers them")
}

fn array(variables: &Variables, of: Option<u64>) -> Result<Shard, ShardError> {
    // Several processes that share one task would all run the same shard.
    for variable in [MPI_SIZE, STEP_TASKS] {
        let count = number(variables, variable, 1)?.unwrap_or(1);
        if count > 1 {
            return refused(format!(
                "{ARRAY_ID} is set and {variable} is {count}; expected one process for each task of the array, or give \
                 --shard I/N"
            ));
        }
    }
    let id = needed(variables, ARRAY_ID, 0, ARRAY_ID)?;
    if let Some(of) = of {
        return numbered(ARRAY_ID, id, of, ", as `sbatch --array=1-N` numbers them");
    }
    let min = needed(variables, ARRAY_MIN, 0, ARRAY_ID)?;
    let max = needed(variables, ARRAY_MAX, 0, ARRAY_ID)?;
    let step = number(variables, ARRAY_STEP, 1)?.unwrap_or(1);
    in_range(ARRAY_ID, id, [min, max], "")?;
    let numbers = "for some tasks of it give --shard auto/N with their numbers from 1 to N";
    // It is likely to be a part of an array that runs again.
    if min > 1 {
        return refused(format!(
            "{ARRAY_MIN} is {min}; expected 0 or 1, where a whole array begins; {numbers}"
        ));
    }
    let places = ((max - min) / step).saturating_add(1);
    let count = number(variables, ARRAY_COUNT, 1)?.unwrap_or(places);
    if count != places || !(max - min).is_multiple_of(step) || !(id - min).is_multiple_of(step) {
        return refused(format!(
            "{count} tasks from {ARRAY_MIN} {min} to {ARRAY_MAX} {max} in steps of {step} leave gaps; expected an array \
             such as 1-8; {numbers}"
        ));
    }
    Ok(Shard { index: ((id - min) / step).min(count - 1), of: count })
}

/// Returns the shard of a process that is numbered from 0.
fn ranked(
    [variable, counter]: [&str; 2],
    [rank, count]: [u64; 2],
    of: Option<u64>,
) -> Result<Shard, ShardError> {
    if let Some(of) = of.filter(|of| *of != count) {
        return Err(ShardError(format!(
            "/{of}: {counter} is {count}; expected {of}, one process for each shard"
        )));
    }
    in_range(variable, rank, [0, count - 1], "")?;
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
        return refused(format!(
            "{STEP_RANK} is set, but {STEP_TASKS} is not, so this is a job's script and not one of its {tasks} tasks; \
             expected `srun symbolt ...`, or `sbatch --array`"
        ));
    }
    ranked([STEP_RANK, JOB_TASKS], [rank, tasks], of)
}
