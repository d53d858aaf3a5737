//! Operators: the preconditions and effects of actions, and the evidence behind them.

use serde::{Deserialize, Serialize};

use super::ids::StateId;

/// A parameter of an operator: an object that the action involves.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Name of the parameter, such as [`Parameter::OBJECT`].
    pub name: String,
    /// Kind of the objects that the parameter stands for.
    pub kind: String,
}

impl Parameter {
    /// Name of the parameter for the object that the action moves.
    pub const OBJECT: &'static str = "object";

    /// Returns a parameter for the object that the action moves.
    pub fn object(kind: impl Into<String>) -> Self {
        Self { name: Self::OBJECT.into(), kind: kind.into() }
    }
}

/// The preconditions and effects of an action, and the evidence for them.
#[derive(Debug, Clone, PartialEq)]
pub struct Operator {
    /// Name of the action: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// Objects that the action involves. The first is the object that it moves.
    pub parameters: Vec<Parameter>,
    /// The state that the object most often leaves; `None` if it was never in a state.
    pub from: Option<StateId>,
    /// The state that the object enters; also listed in `effects`.
    pub to: StateId,
    /// States that must hold before the action.
    pub preconditions: Vec<StateId>,
    /// States that hold after the action.
    pub effects: Vec<StateId>,
    /// States that must be absent before the action, used only if [`Rules::absent`](super::Rules::absent) is set. In
    /// a learned operator, these are the states that never held before the action.
    pub absent: Vec<StateId>,
    /// States that no longer hold after the action.
    pub removes: Vec<StateId>,
    /// Counts behind `preconditions`, `effects`, `absent` and `removes`; `None` in a domain written in code.
    pub evidence: Option<Evidence>,
}

impl Operator {
    /// Returns the kind of the object that the action moves: the kind of the first parameter. Empty for an operator
    /// without parameters, which [`Domain::new`](super::Domain::new) rejects.
    pub fn kind(&self) -> &str {
        self.parameters.first().map_or("", |object| &object.kind)
    }

    /// Returns the number of demonstrated instances of the action; 0 for an operator that was not learned.
    pub fn instances(&self) -> u32 {
        self.evidence.as_ref().map_or(0, |e| e.instances)
    }
}

/// The counts behind an operator, over all demonstrated instances of its action. Each list has one entry for each
/// state, in the order of the domain's states.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evidence {
    /// Number of instances.
    pub instances: u32,
    /// For each state, the number of instances in which it held before the action: `sum G` (section II.E of the paper).
    pub before: Vec<u32>,
    /// For each state, the number of instances in which it began to hold, minus the number in which it ceased to hold:
    /// `sum (H - G)` (section II.E).
    pub change: Vec<i32>,
}
