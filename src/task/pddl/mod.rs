//! Writes learned domains, with a situation and a goal, as PDDL.
//!
//! [`of_relational`] writes a relational problem. The domain has a type for each kind, a predicate for each state, such as
//! `(cup_at_plate ?cup ?plate)`, and an action for each operator. Where a condition speaks of the origin and the object
//! may leave references of several kinds, there is one action for each of them. Conditions that count other objects are
//! quantified; effects on other objects are universal. The objects of the scene and the goal are in the problem.
//!
//! The reachable states are the reachable situations of the problem, and the actions that are possible are its moves.

mod actions;
mod conditions;
mod effects;
mod needs;
mod relational;
mod vocabulary;

use thiserror::Error;

pub(crate) use relational::facts_of;
pub use relational::of_relational;

use crate::plan::strips;

/// A domain and a problem in PDDL.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The domain.
    pub domain: strips::Domain,
    /// The problem.
    pub problem: strips::Problem,
}

/// Why a problem cannot be written as PDDL.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum WriteFault {
    /// A condition counts too many objects.
    #[error(
        "a condition or the goal counts so many objects that PDDL would have to choose {count} of them, or objects of too many kinds"
    )]
    TooLarge {
        /// Number of objects that a quantifier would choose.
        count: usize,
    },
    /// An action changes the state of another object, and it is not certain which.
    #[error(
        "the action {action} puts another object into {state}, and any of several; PDDL cannot say which"
    )]
    Uncertain {
        /// Name of the action.
        action: String,
        /// Name of the state.
        state: String,
    },
}
