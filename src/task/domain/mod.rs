//! A learned domain: states and operators, with all that is needed to plan without the recordings.

pub(crate) mod distance;
mod file;
pub(crate) mod grounding;
pub(crate) mod pose;
pub(crate) mod recording;
pub(crate) mod reference;
pub(crate) mod symbolic;

use std::collections::HashSet;

use serde::{Deserialize, Serialize};

pub use grounding::{Classifier, FEW, Gate, Grounded, Grounding};
pub use pose::{Pose, mean_orientation, rotation_between};
pub use recording::{Demonstration, Event, Labels, ObjectPose, Recording, Snapshot};
pub use reference::{Commitment, Obstacle, Outlook, Rules, outlook};
pub use symbolic::SymbolicDomain;

use crate::spa::nearest_name;
use crate::task::error::TaskError;

/// How the parts that are in a state came to be there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// They lay there when a demonstration began, or were knocked there.
    Found,
    /// They were put there.
    Placed,
}

/// A state that an object of one kind can be in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// The state's name: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// The kind of object.
    pub kind: String,
    /// How many poses it was learned from.
    pub count: usize,
    /// How many of them differ by more than the movement of a resting part.
    pub distinct: usize,
    /// How parts came into it.
    pub origin: Origin,
    /// The robust mean pose.
    pub mean: Pose,
    /// Covariance about the mean: coordinates in metres, then rotation about the scene's axes in
    /// radians.
    pub covariance: [[f64; 6]; 6],
}

impl State {
    /// Standard deviation of each coordinate, in metres.
    pub fn spread(&self) -> [f64; 3] {
        std::array::from_fn(|i| self.covariance[i][i].max(0.0).sqrt())
    }
}

/// What an action needs, does and was learned from. States are given by name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Operator {
    /// The action's name: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// The kind of object that is manipulated.
    pub kind: String,
    /// The state that the object is taken from, if it was always in a state.
    pub from: Option<String>,
    /// The state that the object is put into: the one by which the action is told from others.
    pub to: String,
    /// States that must hold before.
    pub preconditions: Vec<String>,
    /// States that hold after, `to` among them.
    pub effects: Vec<String>,
    /// States that never held before in the demonstrations; a planner may ask for their absence.
    pub absent: Vec<String>,
    /// States that every instance ended.
    pub removes: Vec<String>,
    /// The counts behind the lists above.
    pub evidence: OperatorEvidence,
}

/// The counts behind an operator, in the order of the domain's states.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OperatorEvidence {
    /// How many instances there were.
    pub instances: u32,
    /// Before how many of them each state held.
    pub before: Vec<u32>,
    /// How often each state was brought about, less how often it was ended.
    pub change: Vec<i32>,
}

/// How the clusters of one kind were cut.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KindClusters {
    /// The kind.
    pub kind: String,
    /// The threshold used, in metres; `null` if there was nothing to tell apart.
    pub threshold_m: Option<f64>,
    /// The height of the first merge that was not made, in metres.
    pub next_merge_m: Option<f64>,
}

/// What made a domain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// The program's version.
    pub symbolt: String,
    /// The seed given; learning itself draws nothing.
    pub seed: u64,
    /// The exponent of the distance.
    pub p: f64,
    /// The threshold given, in metres; `null` if it was found from the data.
    pub threshold_m: Option<f64>,
    /// How many demonstrations and snapshots were read.
    pub demonstrations: usize,
    /// How many snapshots were read.
    pub snapshots: usize,
    /// The clusters of each kind that moved.
    pub clusters: Vec<KindClusters>,
}

/// States, operators and their origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    states: Vec<State>,
    operators: Vec<Operator>,
    goal: Option<String>,
    provenance: Provenance,
    /// For each state, the operator that causes it.
    causes: Vec<Option<usize>>,
}

impl Domain {
    /// A domain of checked parts.
    ///
    /// # Errors
    /// [`TaskError::BadDomain`] if a name is bad or used twice, an operator names a state that is
    /// not there, lists one twice, does not list `to` among its effects or has no effect, or if the
    /// goal is no state; numbers that are not finite likewise.
    pub fn new(
        states: Vec<State>,
        operators: Vec<Operator>,
        goal: Option<String>,
        provenance: Provenance,
    ) -> Result<Self, TaskError> {
        check(&states, &operators, goal.as_deref())
            .map_err(|reason| TaskError::BadDomain { reason })?;
        let causes = states.iter().map(|s| cause_of(&s.name, &operators)).collect();
        Ok(Self { states, operators, goal, provenance, causes })
    }

    /// The states.
    pub fn states(&self) -> &[State] {
        &self.states
    }

    /// The operators.
    pub fn operators(&self) -> &[Operator] {
        &self.operators
    }

    /// The state that the last action of the demonstrations brought about.
    pub fn goal(&self) -> Option<&str> {
        self.goal.as_deref()
    }

    /// What made the domain.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// The place of the state called `name`.
    ///
    /// # Errors
    /// [`TaskError::Unknown`], listing the states.
    pub fn state_index(&self, name: &str) -> Result<usize, TaskError> {
        self.states.iter().position(|s| s.name == name).ok_or_else(|| TaskError::Unknown {
            what: "state",
            name: name.into(),
            nearest: nearest_name(name, self.states.iter().map(|s| s.name.as_str())),
            choices: self.states.iter().map(|s| s.name.clone()).collect(),
        })
    }

    /// A world in which the named states hold and no others, as [`Planner::decide`](super::planner::Planner::decide)
    /// takes it: a flag for each state, in their order.
    ///
    /// # Errors
    /// [`TaskError::Unknown`], listing the states.
    pub fn world<'n>(
        &self,
        hold: impl IntoIterator<Item = &'n str>,
    ) -> Result<Vec<bool>, TaskError> {
        Ok(self.counts(hold)?.into_iter().map(|count| count > 0).collect())
    }

    /// How many things are in each state, in the states' order, as [`Planner::plan`](super::planner::Planner::plan)
    /// takes it: a state is named once for each thing that is in it.
    ///
    /// # Errors
    /// [`TaskError::Unknown`], listing the states.
    pub fn counts<'n>(
        &self,
        things: impl IntoIterator<Item = &'n str>,
    ) -> Result<Vec<usize>, TaskError> {
        let mut counts = vec![0; self.states.len()];
        for name in things {
            counts[self.state_index(name)?] += 1;
        }
        Ok(counts)
    }

    /// The operator that causes the `state`-th state.
    ///
    /// It is the one by which a part is put into that state; failing that, of those that bring it
    /// about as a further effect, the one with the most evidence, of equal ones the first.
    pub fn cause(&self, state: usize) -> Option<usize> {
        self.causes.get(state).copied().flatten()
    }

    /// The places of the named states; names of a checked operator always have one.
    pub(crate) fn indices(&self, names: &[String]) -> Vec<usize> {
        names.iter().filter_map(|n| self.states.iter().position(|s| s.name == *n)).collect()
    }

    /// The domain with other names for states and actions, given as pairs of old and new name.
    ///
    /// # Errors
    /// If an old name is neither a state nor an action, or the new names make the domain unsound.
    pub fn rename(&self, renames: &[(String, String)]) -> Result<Self, TaskError> {
        let known: Vec<&str> = self
            .states
            .iter()
            .map(|s| s.name.as_str())
            .chain(self.operators.iter().map(|o| o.name.as_str()))
            .collect();
        for (index, (old, _)) in renames.iter().enumerate() {
            if !known.contains(&old.as_str()) {
                return Err(TaskError::Unknown {
                    what: "state or action",
                    name: old.clone(),
                    nearest: nearest_name(old, known.iter().copied()),
                    choices: known.iter().map(|n| (*n).to_owned()).collect(),
                });
            }
            if renames[..index].iter().any(|(earlier, _)| earlier == old) {
                let reason = format!("`{old}` is renamed twice");
                return Err(TaskError::BadDomain { reason });
            }
        }
        let new = |name: &String| {
            renames.iter().find(|(old, _)| old == name).map_or(name, |(_, new)| new).clone()
        };
        let all = |names: &[String]| names.iter().map(new).collect();
        let states =
            self.states.iter().map(|s| State { name: new(&s.name), ..s.clone() }).collect();
        let operators = self
            .operators
            .iter()
            .map(|o| Operator {
                name: new(&o.name),
                from: o.from.as_ref().map(new),
                to: new(&o.to),
                preconditions: all(&o.preconditions),
                effects: all(&o.effects),
                absent: all(&o.absent),
                removes: all(&o.removes),
                ..o.clone()
            })
            .collect();
        Self::new(states, operators, self.goal.as_ref().map(new), self.provenance.clone())
    }
}

fn cause_of(state: &str, operators: &[Operator]) -> Option<usize> {
    if let Some(own) = operators.iter().position(|o| o.to == state) {
        return Some(own);
    }
    let mut best: Option<usize> = None;
    for (index, operator) in operators.iter().enumerate() {
        let causes = operator.effects.iter().any(|e| e == state);
        let more =
            best.is_none_or(|b| operator.evidence.instances > operators[b].evidence.instances);
        if causes && more {
            best = Some(index);
        }
    }
    best
}

/// Names that planners use for themselves.
pub(crate) const RESERVED: [&str; 3] = ["PRECONDITION", "ABSENT", "NOTHING"];

/// Whether `name` can name a state or an action: it has to stand in expressions.
pub(crate) fn is_symbol(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c.is_ascii_uppercase())
        && chars.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && name.len() <= 200
        && !RESERVED.contains(&name)
}

fn check(states: &[State], operators: &[Operator], goal: Option<&str>) -> Result<(), String> {
    let mut names = HashSet::new();
    for name in states.iter().map(|s| &s.name).chain(operators.iter().map(|o| &o.name)) {
        if !is_symbol(name) {
            return Err(format!(
                "`{name}` cannot be a name; use an upper-case letter, then letters, digits and `_`, other than {}",
                RESERVED.join(", ")
            ));
        }
        if !names.insert(name) {
            return Err(format!("`{name}` names two things"));
        }
    }
    let kinds: HashSet<&str> = states.iter().map(|s| s.kind.as_str()).collect();
    for state in states {
        let pose = state.mean.position.iter().chain(&state.mean.orientation);
        if pose.chain(state.covariance.iter().flatten()).any(|v| !v.is_finite()) {
            return Err(format!("state `{}` holds a number that is not finite", state.name));
        }
        let norm = state.mean.orientation.iter().map(|v| v * v).sum::<f64>().sqrt();
        if (norm - 1.0).abs() > 1e-3 {
            return Err(format!("the orientation of state `{}` has norm {norm}", state.name));
        }
        if (0..6).any(|i| state.covariance[i][i] < 0.0) {
            return Err(format!("state `{}` has a negative variance", state.name));
        }
    }
    let known = |name: &str| states.iter().any(|s| s.name == name);
    for operator in operators {
        let at = format!("action `{}`", operator.name);
        let lists = [
            ("preconditions", &operator.preconditions),
            ("effects", &operator.effects),
            ("absent", &operator.absent),
            ("removes", &operator.removes),
        ];
        for (what, list) in lists {
            let mut seen = HashSet::new();
            for name in list {
                if !known(name) {
                    return Err(format!("{at} has `{name}` among its {what}, which is no state"));
                }
                if !seen.insert(name) {
                    return Err(format!("{at} has `{name}` twice among its {what}"));
                }
            }
        }
        for name in operator.from.iter().chain([&operator.to]) {
            if !known(name) {
                return Err(format!("{at} moves from or to `{name}`, which is no state"));
            }
        }
        if !operator.effects.contains(&operator.to) {
            return Err(format!("{at} puts into `{}` but does not list it as effect", operator.to));
        }
        if let Some(both) = operator.preconditions.iter().find(|p| operator.absent.contains(p)) {
            return Err(format!("{at} needs `{both}` both present and absent"));
        }
        if !kinds.contains(operator.kind.as_str()) {
            return Err(format!("{at} manipulates `{}`, which has no state", operator.kind));
        }
        let counts = [operator.evidence.before.len(), operator.evidence.change.len()];
        if counts.iter().any(|n| *n != states.len()) {
            return Err(format!("{at} has evidence for {counts:?} states of {}", states.len()));
        }
    }
    if let Some(other) = operators
        .iter()
        .enumerate()
        .find(|(i, o)| operators[..*i].iter().any(|earlier| earlier.to == o.to))
    {
        return Err(format!("two actions put parts into `{}`", other.1.to));
    }
    if let Some(goal) = goal
        && !known(goal)
    {
        return Err(format!("the goal `{goal}` is no state"));
    }
    Ok(())
}
