//! Checks that the tables of a domain are consistent.

use std::collections::HashSet;

use super::ids::StateId;
use super::operator::Operator;
use super::state::{LearnedState, State};

/// Names that planners reserve for their own symbols.
pub(crate) const RESERVED: [&str; 3] = ["PRECONDITION", "ABSENT", "NOTHING"];

/// Maximum length of a name of a state or an action, in characters.
pub(crate) const MAX_NAME: usize = 200;

/// Greatest number of states and of actions in a domain file.
const MAX_COUNT: usize = 2_000;

/// Largest accepted deviation of an orientation's norm from 1.
const NORM_TOLERANCE: f64 = 1e-3;

/// Largest magnitude of a covariance entry. No recording exceeds it, as coordinates are at most 1e6 m in magnitude.
const MAX_COVARIANCE: f64 = 4e12;

/// Returns whether `name` can name a state or an action. Names are used in vocabulary expressions.
pub(crate) fn is_symbol(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c.is_ascii_uppercase())
        && chars.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && name.len() <= MAX_NAME
        && !RESERVED.contains(&name)
}

/// Returns the first inconsistency in a domain's tables as a message: `<problem>` or `<problem>; expected <choices>`.
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
            Err(format!("the goal is state number {}; {}", goal.index(), below(states.len())))
        }
        _ => Ok(()),
    }
}

/// The valid numbers of states, in words.
fn below(states: usize) -> String {
    format!("expected a number below {states}, as there are {states} states")
}

/// Returns a message if a domain file has too many states or actions.
pub(crate) fn check_counts(states: usize, operators: usize) -> Result<(), String> {
    let counts = [("states", states), ("actions", operators)];
    match counts.into_iter().find(|(_, count)| *count > MAX_COUNT) {
        Some((what, count)) => Err(format!("it has {count} {what}; expected at most {MAX_COUNT}")),
        None => Ok(()),
    }
}

/// Returns the first invalid or repeated name as a message.
pub(crate) fn check_names<'n>(all: impl Iterator<Item = &'n String>) -> Result<(), String> {
    let mut names = HashSet::new();
    for name in all {
        if !is_symbol(name) {
            return Err(format!(
                "`{name}` cannot be a name; expected an upper-case letter followed by letters, digits or `_` (ASCII, \
                 at most {MAX_NAME} characters), and none of the reserved names {}",
                RESERVED.join(", ")
            ));
        }
        if !names.insert(name) {
            return Err(format!(
                "the name `{name}` is used twice; expected a unique name for every state and action"
            ));
        }
    }
    Ok(())
}

fn check_geometry(name: &str, learned: &LearnedState) -> Result<(), String> {
    let LearnedState { mean, covariance, .. } = learned;
    let pose = mean.position.iter().chain(&mean.orientation);
    if pose.chain(covariance.iter().flatten()).any(|v| !v.is_finite()) {
        return Err(format!(
            "state `{name}` has a number that is not finite; expected finite numbers"
        ));
    }
    let norm = mean.orientation.iter().map(|v| v * v).sum::<f64>().sqrt();
    if (norm - 1.0).abs() > NORM_TOLERANCE {
        return Err(format!(
            "the orientation of state `{name}` has norm {norm}; expected 1 within {NORM_TOLERANCE}"
        ));
    }
    if (0..6).any(|i| covariance[i][i] < 0.0) {
        return Err(format!("state `{name}` has a negative variance; expected at least 0"));
    }
    if let Some(value) = covariance.iter().flatten().find(|v| v.abs() > MAX_COVARIANCE) {
        return Err(format!(
            "state `{name}` has {value:e} in its covariance; expected at most {MAX_COVARIANCE:e} in magnitude"
        ));
    }
    Ok(())
}

fn check_parameters(operator: &Operator, kinds: &HashSet<&str>) -> Result<(), String> {
    if operator.parameters.is_empty() {
        return Err("has no parameters; expected at least the object that it moves".into());
    }
    let mut names = HashSet::new();
    for (index, parameter) in operator.parameters.iter().enumerate() {
        if parameter.name.is_empty() {
            return Err(format!(
                "has no name for parameter {}; expected a name such as `object`",
                index + 1
            ));
        }
        if !names.insert(&parameter.name) {
            return Err(format!(
                "has two parameters called `{}`; expected different names",
                parameter.name
            ));
        }
        if !kinds.contains(parameter.kind.as_str()) {
            let mut known: Vec<&str> = kinds.iter().copied().collect();
            known.sort_unstable();
            return Err(format!(
                "has a parameter of kind `{}`, which has no states; expected one of the kinds: {}",
                parameter.kind,
                known.join(", ")
            ));
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
                let (index, below) = (state.index(), below(states.len()));
                return Err(format!("lists state number {index} in `{what}`; {below}"));
            };
            if !seen.insert(state) {
                return Err(format!("lists `{name}` twice in `{what}`; expected each state once"));
            }
        }
    }
    for state in operator.from.iter().chain([&operator.to]) {
        if name(*state).is_none() {
            let (index, below) = (state.index(), below(states.len()));
            return Err(format!("has state number {index} as `from` or `to`; {below}"));
        }
    }
    if !operator.effects.contains(&operator.to) {
        let to = name(operator.to).unwrap_or("?");
        return Err(format!("has `{to}` as `to` but not in `effects`; expected it in both"));
    }
    if let Some(both) = operator.preconditions.iter().find(|p| operator.absent.contains(p)) {
        let name = name(*both).unwrap_or("?");
        return Err(format!(
            "lists `{name}` in both `preconditions` and `absent`; expected it in at most one"
        ));
    }
    match operator.effects.iter().find(|e| operator.removes.contains(e)) {
        Some(both) => {
            let name = name(*both).unwrap_or("?");
            Err(format!(
                "lists `{name}` in both `effects` and `removes`; expected it in at most one"
            ))
        }
        None => Ok(()),
    }
}

fn check_evidence(operator: &Operator, states: usize) -> Result<(), String> {
    let Some(evidence) = &operator.evidence else { return Ok(()) };
    for (list, length) in [("before", evidence.before.len()), ("change", evidence.change.len())] {
        if length != states {
            return Err(format!(
                "has {length} counts in `evidence.{list}`; expected {states}, one for each state"
            ));
        }
    }
    Ok(())
}
