//! Version 1 of the domain file: every domain was learned, and every state had geometry.

use serde::Deserialize;
use serde_json::Value;

use super::{OperatorEntry, StateEntry, shape};
use crate::task::domain::{Evidence, LearnedState, Origin, Parameter, Pose, Provenance};

/// Version number of this layout.
pub(super) const VERSION: u64 = 1;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DomainFile {
    format: String,
    /// Already checked.
    #[serde(rename = "version")]
    _version: u64,
    provenance: Provenance,
    goal: Option<String>,
    states: Vec<State>,
    operators: Vec<Operator>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct State {
    name: String,
    kind: String,
    count: usize,
    distinct: usize,
    origin: Origin,
    mean: Pose,
    covariance: [[f64; 6]; 6],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Operator {
    name: String,
    kind: String,
    from: Option<String>,
    to: String,
    preconditions: Vec<String>,
    effects: Vec<String>,
    absent: Vec<String>,
    removes: Vec<String>,
    evidence: Evidence,
}

/// Returns the first field that cannot be read.
pub(super) fn faulty_field(file: &Value) -> String {
    shape::faulty_field::<State, Operator>(file)
}

impl From<DomainFile> for super::DomainFile {
    fn from(old: DomainFile) -> Self {
        Self {
            format: old.format,
            version: super::VERSION,
            provenance: Some(old.provenance),
            goal: old.goal,
            states: old.states.into_iter().map(StateEntry::from).collect(),
            operators: old.operators.into_iter().map(OperatorEntry::from).collect(),
        }
    }
}

impl From<State> for StateEntry {
    fn from(old: State) -> Self {
        let State { name, kind, count, distinct, origin, mean, covariance } = old;
        let learned = LearnedState { count, distinct, origin, mean, covariance };
        Self { name, kind, learned: Some(learned) }
    }
}

impl From<Operator> for OperatorEntry {
    fn from(old: Operator) -> Self {
        Self {
            name: old.name,
            parameters: vec![Parameter::object(old.kind)],
            from: old.from,
            to: old.to,
            preconditions: old.preconditions,
            effects: old.effects,
            absent: old.absent,
            removes: old.removes,
            evidence: Some(old.evidence),
        }
    }
}
