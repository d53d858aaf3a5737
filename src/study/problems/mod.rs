//! Planning problems whose shortest plans are known, on which planners are measured.
//!
//! | file | contents |
//! |---|---|
//! | `kitchen` | the kitchen of 2016, and kitchens with more threats |
//! | `breakfast` | tea, and toast on the same socket |
//! | `packing` | one-way problems in which only one order of the actions succeeds |
//! | `chores` | a generator of households with long plans |
//! | `tangled` | a generator of random domains |
//! | `shuffle` | the same problem with other names and orders |
//! | `distance` | the length of the shortest plan, breadth first |
//! | `folder` | problems in a folder of PDDL files |
//!
//! ```
//! use symbolt::sim::Seed;
//! use symbolt::study::problems::{Distance, tangled};
//!
//! let problem = tangled(6, &mut Seed::new(1).rng())?;
//! assert_eq!(problem.distance(10_000), Distance::Steps(6));
//! # Ok::<(), symbolt::task::TaskError>(())
//! ```

mod breakfast;
mod chores;
mod distance;
mod folder;
mod kitchen;
mod packing;
mod shuffle;
mod tangled;

pub use breakfast::{Breakfast, breakfast};
pub(super) use chores::chores;
pub use distance::{Distance, distance};
pub(super) use folder::{ProblemFiles, problems_in};
pub use kitchen::Kitchen;
pub(super) use packing::packing;
pub use tangled::{TANGLED, tangled};

use std::fmt::Display;
use std::ops::RangeInclusive;

use crate::plan::strips::{Bodies, Domain, Grounded, Problem, validate};
use crate::task::TaskError;

fn outside(name: &'static str, value: usize, range: RangeInclusive<usize>) -> TaskError {
    let [least, most] = [*range.start() as f64, *range.end() as f64];
    TaskError::Range { name, value: value as f64, least, most }
}

/// Refuses a problem, in a sentence.
fn refused(fault: impl Display) -> TaskError {
    TaskError::Problem { reason: fault.to_string() }
}

/// Reads a domain and a problem, each with its name.
fn read(
    [(domain_name, domain), (problem_name, problem)]: [(&str, &[u8]); 2],
) -> Result<(Domain, Problem), TaskError> {
    let domain = Domain::parse(domain, domain_name, Bodies::Read).map_err(refused)?;
    let problem = Problem::parse(problem, problem_name, &domain).map_err(refused)?;
    Ok((domain, problem))
}

/// A problem with its domain, grounded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlanningProblem {
    /// The domain.
    pub domain: Domain,
    /// The problem.
    pub problem: Problem,
    /// Its fluents and operators.
    pub grounded: Grounded,
}

impl PlanningProblem {
    /// Grounds a problem of its domain.
    ///
    /// # Errors
    /// [`TaskError::Problem`] if the problem is too large, or if its goal cannot be reached even if nothing were made false.
    pub fn new(domain: Domain, problem: Problem) -> Result<Self, TaskError> {
        let grounded = Grounded::new(&domain, &problem).map_err(refused)?;
        Ok(Self { domain, problem, grounded })
    }

    /// Reads a domain and a problem from PDDL.
    ///
    /// # Errors
    /// [`TaskError::Problem`] for text that is not read as PDDL, and as [`new`](Self::new).
    pub fn parse(domain: &str, problem: &str) -> Result<Self, TaskError> {
        let (domain, problem) =
            read([("domain.pddl", domain.as_bytes()), ("problem.pddl", problem.as_bytes())])?;
        Self::new(domain, problem)
    }

    /// Returns the length of a plan if it is valid by the action schemas. The plan is a list of operators by position.
    ///
    /// # Panics
    /// If an operator is outside the problem.
    pub(crate) fn valid_length(&self, plan: impl IntoIterator<Item = usize>) -> Option<usize> {
        let plan = self.grounded.steps(plan);
        validate(&self.domain, &self.problem, plan.iter().copied()).ok().map(|_| plan.len())
    }
}
