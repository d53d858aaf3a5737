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
mod names;
mod needs;
mod relational;
mod vocabulary;

use std::fmt::{self, Display, Formatter};

use thiserror::Error;

pub use relational::of_relational;

use crate::plan::strips;

/// A domain and a problem in PDDL, with comments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The domain.
    pub domain: strips::Domain,
    /// The problem.
    pub problem: strips::Problem,
    /// Comments on the domain, on each of its actions, and on the problem.
    notes: [Vec<String>; 2],
    of_actions: Vec<Vec<String>>,
}

impl Written {
    /// Returns the text of the domain, with comments on what its names and conditions stand for.
    pub fn domain_text(&self) -> String {
        format!("{}{}", Comments(&self.notes[0], ""), DomainText(self))
    }

    /// Returns the text of the problem.
    pub fn problem_text(&self) -> String {
        format!("{}{}", Comments(&self.notes[1], ""), self.problem)
    }
}

/// Comments, a line each, behind an indentation.
struct Comments<'a>(&'a [String], &'a str);

impl Display for Comments<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for comment in self.0 {
            let comment = comment.replace(char::is_control, " ");
            writeln!(f, "{}; {comment}", self.1)?;
        }
        Ok(())
    }
}

struct DomainText<'a>(&'a Written);

impl Display for DomainText<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.0.domain.write_head(f)?;
        for (action, comments) in self.0.domain.actions.iter().zip(&self.0.of_actions) {
            write!(f, "\n{}{action}\n", Comments(comments, "  "))?;
        }
        f.write_str(")\n")
    }
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
