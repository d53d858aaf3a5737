//! States, by name.

/// A state that an object of one kind can be in.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Name of the state: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// Kind of the objects that can be in the state.
    pub kind: String,
}
