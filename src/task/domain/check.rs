//! Checks that a domain's tables do not contradict themselves.

use std::collections::HashSet;

use super::ids::StateId;
use super::operator::Operator;
use super::state::{LearnedState, State};

/// Names that planners use for themselves.
pub(crate) const RESERVED: [&str; 3] = ["PRECONDITION", "ABSENT", "NOTHING"];

/// Longest name of a state or an action, in characters.
const MAX_NAME: usize = 200;

/// Greatest difference from 1 of the norm of an orientation.
const NORM_TOLERANCE: f64 = 1e-3;

/// Greatest entry of a covariance, either way: no two coordinates of a recording, each at most 1e6 m, vary more.
const MAX_COVARIANCE: f64 = 4e12;

/// Whether `name` can name a state or an action: it has to stand in expressions.
pub(crate) fn is_symbol(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c.is_ascii_uppercase())
        && chars.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && name.len() <= MAX_NAME
        && !RESERVED.contains(&name)
}

/// The first contradiction in a domain's tables, in words.
pub(super) fn check(
    states: &[State],
    operators: &[Operator],
    goal: Option<StateId>,
) -> Result<(), String> {
    check_names(states.iter().map(|s| &s.name).chain(operators.iter().map(|o| &o.name)))?;
    for state in states {
        if let Some(learned) = &state.learned {
            check_geometry(&state.name, learned)?;
        }
    }
    let kinds: HashSet<&str> = states.iter().map(|s| s.kind.as_str()).collect();
    for operator in operators {
        check_lists(operator, states)
            .and_then(|()| check_evidence(operator, states.len()))
            .map_err(|why| format!("action `{}` {why}", operator.name))?;
        check_parameters(operator, &kinds)
            .map_err(|why| format!("action `{}` {why}", operator.name))?;
    }
    match goal {
        Some(goal) if goal.index() >= states.len() => {
            Err(format!("the goal is state {}, and there are {}", goal.index(), states.len()))
        }
        _ => Ok(()),
    }
}

/// The first bad or repeated name, in words.
pub(super) fn check_names<'n>(all: impl Iterator<Item = &'n String>) -> Result<(), String> {
    let mut names = HashSet::new();
    for name in all {
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
    Ok(())
}

fn check_geometry(name: &str, learned: &LearnedState) -> Result<(), String> {
    let LearnedState { mean, covariance, .. } = learned;
    let pose = mean.position.iter().chain(&mean.orientation);
    if pose.chain(covariance.iter().flatten()).any(|v| !v.is_finite()) {
        return Err(format!("state `{name}` holds a number that is not finite"));
    }
    let norm = mean.orientation.iter().map(|v| v * v).sum::<f64>().sqrt();
    if (norm - 1.0).abs() > NORM_TOLERANCE {
        return Err(format!("the orientation of state `{name}` has norm {norm}"));
    }
    if (0..6).any(|i| covariance[i][i] < 0.0) {
        return Err(format!("state `{name}` has a negative variance"));
    }
    if let Some(value) = covariance.iter().flatten().find(|v| v.abs() > MAX_COVARIANCE) {
        return Err(format!(
            "state `{name}` has {value:e} in its covariance; the most is {MAX_COVARIANCE:e}"
        ));
    }
    Ok(())
}

fn check_parameters(operator: &Operator, kinds: &HashSet<&str>) -> Result<(), String> {
    if operator.parameters.is_empty() {
        return Err("has no object to act upon".into());
    }
    let mut names = HashSet::new();
    for (index, parameter) in operator.parameters.iter().enumerate() {
        if parameter.name.is_empty() {
            return Err(format!("has no name for parameter {}", index + 1));
        }
        if !names.insert(&parameter.name) {
            return Err(format!("has two parameters called `{}`", parameter.name));
        }
        if !kinds.contains(parameter.kind.as_str()) {
            return Err(format!("manipulates `{}`, which has no state", parameter.kind));
        }
    }
    Ok(())
}

fn check_lists(operator: &Operator, states: &[State]) -> Result<(), String> {
    let name = |state: StateId| states.get(state.index()).map(|s| s.name.as_str());
    let lists = [
        ("preconditions", &operator.preconditions),
        ("effects", &operator.effects),
        ("absent", &operator.absent),
        ("removes", &operator.removes),
    ];
    for (what, list) in lists {
        let mut seen = HashSet::new();
        for state in list {
            let Some(name) = name(*state) else {
                let (index, count) = (state.index(), states.len());
                return Err(format!("has state {index} among its {what}, and there are {count}"));
            };
            if !seen.insert(state) {
                return Err(format!("has `{name}` twice among its {what}"));
            }
        }
    }
    for state in operator.from.iter().chain([&operator.to]) {
        if name(*state).is_none() {
            let (index, count) = (state.index(), states.len());
            return Err(format!("moves from or to state {index}, and there are {count}"));
        }
    }
    if !operator.effects.contains(&operator.to) {
        let to = name(operator.to).unwrap_or("?");
        return Err(format!("puts into `{to}` but does not list it as effect"));
    }
    if let Some(both) = operator.preconditions.iter().find(|p| operator.absent.contains(p)) {
        return Err(format!("needs `{}` both present and absent", name(*both).unwrap_or("?")));
    }
    match operator.effects.iter().find(|e| operator.removes.contains(e)) {
        Some(both) => Err(format!("both causes and ends `{}`", name(*both).unwrap_or("?"))),
        None => Ok(()),
    }
}

fn check_evidence(operator: &Operator, states: usize) -> Result<(), String> {
    let Some(evidence) = &operator.evidence else { return Ok(()) };
    let counts = [evidence.before.len(), evidence.change.len()];
    if counts.iter().any(|n| *n != states) {
        return Err(format!("has evidence for {counts:?} states of {states}"));
    }
    Ok(())
}
