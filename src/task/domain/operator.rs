//! Operators: what an action needs, does and was learned from.

use serde::{Deserialize, Serialize};

use super::ids::StateId;

/// Something that an action is done with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// What it is to the action, such as [`Parameter::OBJECT`].
    pub name: String,
    /// The kind of object that can take its place.
    pub kind: String,
}

impl Parameter {
    /// The name of the first parameter of every operator: the object acted upon.
    pub const OBJECT: &'static str = "object";

    /// The object acted upon.
    pub fn object(kind: impl Into<String>) -> Self {
        Self { name: Self::OBJECT.into(), kind: kind.into() }
    }
}

/// What an action needs and does, and what it was learned from.
#[derive(Debug, Clone, PartialEq)]
pub struct Operator {
    /// The action's name: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// What it is done with: at least the object acted upon, which comes first.
    pub parameters: Vec<Parameter>,
    /// The state that the object is usually taken from, if it was in one.
    pub from: Option<StateId>,
    /// The state that the object is put into, one of the effects.
    pub to: StateId,
    /// States that must hold before.
    pub preconditions: Vec<StateId>,
    /// States that hold after, `to` among them.
    pub effects: Vec<StateId>,
    /// States that never held before in the demonstrations; a planner may ask for their absence.
    pub absent: Vec<StateId>,
    /// States that it ends.
    pub removes: Vec<StateId>,
    /// The counts behind the lists above, if it was learned from demonstrations.
    pub evidence: Option<Evidence>,
}

impl Operator {
    /// The kind of the object acted upon: the first parameter's. Every operator of a
    /// [`Domain`](super::Domain) has one; empty for an unchecked operator without parameters.
    pub fn kind(&self) -> &str {
        self.parameters.first().map_or("", |object| &object.kind)
    }

    /// How many instances were demonstrated; 0 for an operator that was not learned.
    pub fn instances(&self) -> u32 {
        self.evidence.as_ref().map_or(0, |e| e.instances)
    }
}

/// The counts behind an operator, one entry a state, in the order of the domain's states.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evidence {
    /// How many instances there were.
    pub instances: u32,
    /// `sum G`: before how many of them the state held.
    pub before: Vec<u32>,
    /// `sum (H - G)`: after how many it newly held, less after how many it no longer held.
    pub change: Vec<i32>,
}
