//! A domain's tables as semantic pointers: vocabularies, and the memories' pairs.
//!
//! Every state has one random pointer, every action a shallow one, and a deep one in the states' space:
//! PRECONDITION bound to the sum of its preconditions (section II.E of the paper), with PRECONDITION unitary so
//! that unbinding it is exact. An action that needs nothing has the deep pointer `PRECONDITION * NOTHING`.
//! What must be absent has a deep pointer of its own, `ABSENT * (...)`, since it would be noise in
//! the first.

use crate::sim::{Real, Seed, VocabTag};
use crate::spa::{Vocabulary, VocabularyBuilder};
use crate::task::domain::{Domain, Operator};
use crate::task::error::TaskError;

/// The space of states and roles.
#[derive(Debug, Clone, Copy)]
pub enum StateSpace {}

/// The space of actions.
#[derive(Debug, Clone, Copy)]
pub enum ActionSpace {}

impl VocabTag for StateSpace {
    const NAME: &'static str = "states";
}

impl VocabTag for ActionSpace {
    const NAME: &'static str = "actions";
}

/// The role that preconditions are bound to.
pub const PRECONDITION: &str = "PRECONDITION";
/// The role that states which must be absent are bound to.
pub const ABSENT: &str = "ABSENT";
/// What an action needs that needs nothing.
pub const NOTHING: &str = "NOTHING";

/// A domain as pointers.
#[derive(Debug)]
pub struct Encoded {
    /// Pointers of all states, of [`NOTHING`], and of the roles.
    pub states: Vocabulary<StateSpace>,
    /// Shallow pointers of all actions.
    pub actions: Vocabulary<ActionSpace>,
}

impl Encoded {
    /// Draws the pointers of `domain` from `seed`, `dim` dimensions, with cosines within
    /// `-ceiling..=ceiling`.
    ///
    /// # Errors
    /// If the dimension cannot be used or is too small for the ceiling.
    pub fn new(domain: &Domain, dim: usize, ceiling: Real, seed: Seed) -> Result<Self, TaskError> {
        let states = VocabularyBuilder::new(dim, seed)
            .max_similarity(ceiling)
            .unitary(PRECONDITION)
            .unitary(ABSENT)
            .pointer(NOTHING)
            .pointers(domain.states().iter().map(|s| s.name.as_str()))
            .build()?;
        let actions = VocabularyBuilder::new(dim, seed)
            .max_similarity(ceiling)
            .pointers(domain.operators().iter().map(|o| o.name.as_str()))
            .build()?;
        Ok(Self { states, actions })
    }
}

/// The deep pointer of an action's preconditions, as an expression.
///
/// ```
/// use symbolt::task::deep_preconditions;
/// assert_eq!(deep_preconditions(["NUT_IN_JIG", "BOLT_IN_JIG"]),
///            "PRECONDITION * (NUT_IN_JIG + BOLT_IN_JIG)");
/// assert_eq!(deep_preconditions([]), "PRECONDITION * (NOTHING)");
/// ```
pub fn deep_preconditions<'n>(names: impl IntoIterator<Item = &'n str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    let sum = if names.is_empty() { NOTHING.to_owned() } else { names.join(" + ") };
    format!("{PRECONDITION} * ({sum})")
}

/// The deep pointer of what must be absent before an action, as an expression; `None` if nothing
/// must.
pub(crate) fn deep_absent(domain: &Domain, operator: &Operator) -> Option<String> {
    let absent = domain.names(&operator.absent);
    (!absent.is_empty()).then(|| format!("{ABSENT} * ({})", absent.join(" + ")))
}
