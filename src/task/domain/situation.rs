//! Situations: the state of every object, without poses. A plan passes through them.

use serde::{Deserialize, Serialize};

/// The state of one object: a place of a state, and the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Fact {
    /// Index of the state.
    pub state: usize,
    /// Index of the place.
    pub place: usize,
    /// Index of the reference among the objects; `None` in the world frame.
    pub reference: Option<usize>,
}

/// The state of every object, by index; `None` for objects in no state, such as fixtures.
pub type Situation = Vec<Option<Fact>>;

/// Returns whether a reference is in the state `within`; `true` if that is `None`.
pub(crate) fn is_within(
    within: Option<usize>,
    reference: Option<usize>,
    situation: &Situation,
) -> bool {
    let of = || situation.get(reference?)?.map(|fact| fact.state);
    within.is_none_or(|state| of() == Some(state))
}
