//! Operators: the preconditions and effects of actions.

use super::ids::StateId;

/// The preconditions and effects of an action.
#[derive(Debug, Clone, PartialEq)]
pub struct Operator {
    /// Name of the action: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// The state that the object leaves; `None` if it is not known.
    pub from: Option<StateId>,
    /// The state that the object enters; also listed in `effects`.
    pub to: StateId,
    /// States that must hold before the action.
    pub preconditions: Vec<StateId>,
    /// States that hold after the action.
    pub effects: Vec<StateId>,
    /// States that must be absent before the action, used only if [`Rules::absent`](super::Rules::absent) is set.
    pub absent: Vec<StateId>,
    /// States that no longer hold after the action.
    pub removes: Vec<StateId>,
}
