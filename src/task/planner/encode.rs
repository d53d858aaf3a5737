//! A domain as semantic pointers: its vocabularies and the expressions that its memories store.
//!
//! Every state has a random pointer. Every action has two pointers: a random *shallow* pointer in the space of actions,
//! and a *deep* pointer in the space of states. The deep pointer is PRECONDITION bound to the sum of the action's
//! preconditions (section II.E of the paper). PRECONDITION is unitary, so unbinding it is exact. The deep pointer of an
//! action without preconditions is `PRECONDITION * NOTHING`. States that must be absent are kept in a second deep
//! pointer, `ABSENT * (...)`; in the first they would only add noise.

use crate::sim::{Real, Seed, VocabTag};
use crate::spa::{Vocabulary, VocabularyBuilder};
use crate::task::domain::{Domain, Operator};
use crate::task::error::TaskError;

/// The vocabulary space of states and roles.
#[derive(Debug, Clone, Copy)]
pub enum StateSpace {}

/// The vocabulary space of actions.
#[derive(Debug, Clone, Copy)]
pub enum ActionSpace {}

impl VocabTag for StateSpace {
    const NAME: &'static str = "states";
}

impl VocabTag for ActionSpace {
    const NAME: &'static str = "actions";
}

/// Name of the role for preconditions.
pub const PRECONDITION: &str = "PRECONDITION";
/// Name of the role for states that must be absent.
pub const ABSENT: &str = "ABSENT";
/// Name of the item that stands for "no precondition".
pub const NOTHING: &str = "NOTHING";

/// A domain's vocabularies.
#[derive(Debug)]
pub struct Encoded {
    /// Pointers of all states, of [`NOTHING`] and of the roles.
    pub states: Vocabulary<StateSpace>,
    /// Shallow pointers of all actions.
    pub actions: Vocabulary<ActionSpace>,
}

impl Encoded {
    /// Draws the pointers of `domain` from `seed`, with `dim` dimensions. No two pointers of a vocabulary
    /// have a cosine outside `-ceiling..=ceiling`.
    ///
    /// # Errors
    /// [`TaskError::Vocabulary`] if `dim` is invalid or too small for this ceiling, or if `ceiling` is out of range.
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

/// Returns the expression of the deep pointer for an action with these preconditions.
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

/// Returns the expression of the deep pointer for the states that must be absent before an action; `None` if
/// there are none.
pub(crate) fn deep_absent(domain: &Domain, operator: &Operator) -> Option<String> {
    let absent = domain.names(&operator.absent);
    (!absent.is_empty()).then(|| format!("{ABSENT} * ({})", absent.join(" + ")))
}
