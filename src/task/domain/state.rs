//! States of objects, and how objects come into them.

use serde::{Deserialize, Serialize};

/// A state that an object of one kind can be in.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Name of the state: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// Kind of the objects that can be in the state.
    pub kind: String,
}

/// How objects came into a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// The objects lay there when a demonstration began, or were knocked there.
    Found,
    /// The objects were put there.
    Placed,
}
