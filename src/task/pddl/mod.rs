//! Writes learned domains, with a situation and a goal, as PDDL that any STRIPS planner reads.
//!
//! [`of_relational`] writes a relational problem. Its facts say where an object is: `(cup_at_plate cup1 plate2)`. There is one
//! action for each move, for each state that the object may leave, and for each way to meet its conditions, so that
//! neither quantifiers nor conditional effects are needed. The reachable states are the reachable situations of the
//! problem. [`of_grounded`] writes a grounded problem, such as that of a domain learned as in the paper. Its facts have no
//! arguments.
//!
//! Both need `:strips`, `:typing` and `:negative-preconditions` alone.

mod conditions;
mod goals;
mod names;
mod plain;
mod relational;

use std::fmt::Write as _;

use thiserror::Error;

pub use plain::of_grounded;
pub use relational::of_relational;

use crate::plan::strips::{self, MAX_ACTIONS};
use crate::task::compile::Move;
use names::Names;

/// A domain and a problem in PDDL, and what their names stand for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The domain.
    pub domain: strips::Domain,
    /// The problem.
    pub problem: strips::Problem,
    /// The move of each action of the domain, in its order; `None` for the actions that check the goal. Empty for a
    /// grounded problem, whose actions are those of its operators.
    pub moves: Vec<Option<Move>>,
    /// Original names, each with its name in PDDL, where they differ.
    pub renamed: Vec<(String, String)>,
    notes: Vec<String>,
}

impl Written {
    /// Returns the text of the domain, with what its names stand for as comments.
    pub fn domain_text(&self) -> String {
        let mut text = String::from("; Written by symbolt.\n");
        for note in &self.notes {
            let _ = writeln!(text, "; {note}");
        }
        for (original, name) in &self.renamed {
            let original: String =
                original.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
            let _ = writeln!(text, "; {name} stands for {original}");
        }
        let _ = write!(text, "{}", self.domain);
        text
    }

    /// Returns the text of the problem.
    pub fn problem_text(&self) -> String {
        format!("; Written by symbolt.\n{}", self.problem)
    }
}

/// Why a problem cannot be written as PDDL.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum WriteFault {
    /// There are too many actions.
    #[error("the problem has more than {MAX_ACTIONS} actions; use a scene with fewer objects")]
    TooLarge,
    /// An action changes the state of another object, and it is not certain which.
    #[error(
        "the action {action} puts another object into {state}, and any of several; STRIPS cannot say which"
    )]
    Uncertain {
        /// Name of the action.
        action: String,
        /// Name of the state.
        state: String,
    },
}
