//! Checks that the tables of a domain are consistent.

use std::collections::HashSet;

use super::ids::StateId;
use super::operator::Operator;
use super::state::State;
use crate::task::error::TaskError;
use crate::task::recording::MAX_NAME;

/// Names that planners reserve for their own symbols.
pub(crate) const RESERVED: [&str; 3] = ["PRECONDITION", "ABSENT", "NOTHING"];

/// What is wrong with a domain, and what was expected instead.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Fault {
    pub problem: String,
    pub expected: String,
}

impl Fault {
    pub fn new(problem: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { problem: problem.into(), expected: expected.into() }
    }

    /// Says which part of the domain has the fault.
    pub fn of(self, part: std::fmt::Arguments<'_>) -> Self {
        Self { problem: format!("{part} {}", self.problem), ..self }
    }
}

impl From<Fault> for TaskError {
    fn from(fault: Fault) -> Self {
        Self::BadDomain { reason: format!("{}; expected {}", fault.problem, fault.expected) }
    }
}

/// Returns whether `name` can name a state or an action. Names are used in vocabulary expressions.
pub(crate) fn is_symbol(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c.is_ascii_uppercase())
        && chars.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && name.len() <= MAX_NAME
        && !RESERVED.contains(&name)
}

/// Returns the first inconsistency in a domain's tables.
pub(super) fn check(states: &[State], operators: &[Operator]) -> Result<(), Fault> {
    check_names(states.iter().map(|s| &s.name).chain(operators.iter().map(|o| &o.name)))?;
    operators.iter().try_for_each(|operator| {
        check_lists(operator, states).map_err(|f| f.of(format_args!("action `{}`", operator.name)))
    })
}

/// The valid numbers of states, in words.
fn below(states: usize) -> String {
    format!("a number below {states}, as there are {states} states")
}

/// Refuses invalid and repeated names.
pub(crate) fn check_names<'n>(all: impl Iterator<Item = &'n String>) -> Result<(), Fault> {
    let mut names = HashSet::new();
    for name in all {
        if !is_symbol(name) {
            let expected = format!(
                "an upper-case letter followed by letters, digits or `_` (ASCII, at most {MAX_NAME} characters), and \
                 none of the reserved names {}",
                RESERVED.join(", ")
            );
            return Err(Fault::new(format!("`{name}` cannot be a name"), expected));
        }
        if !names.insert(name) {
            let problem = format!("the name `{name}` is used twice");
            return Err(Fault::new(problem, "a unique name for every state and action"));
        }
    }
    Ok(())
}

fn check_lists(operator: &Operator, states: &[State]) -> Result<(), Fault> {
    let known = |state: StateId| states.get(state.index()).map(|s| s.name.as_str());
    let name = |state: StateId| known(state).unwrap_or("?");
    let lists = [
        ("preconditions", &operator.preconditions),
        ("effects", &operator.effects),
        ("absent", &operator.absent),
        ("removes", &operator.removes),
    ];
    for (what, list) in lists {
        let mut seen = HashSet::new();
        for state in list {
            let Some(name) = known(*state) else {
                let problem = format!("lists state number {} in `{what}`", state.index());
                return Err(Fault::new(problem, below(states.len())));
            };
            if !seen.insert(state) {
                let problem = format!("lists `{name}` twice in `{what}`");
                return Err(Fault::new(problem, "each state once"));
            }
        }
    }
    if let Some(state) = operator.from.iter().chain([&operator.to]).find(|s| known(**s).is_none()) {
        let problem = format!("has state number {} as `from` or `to`", state.index());
        return Err(Fault::new(problem, below(states.len())));
    }
    if !operator.effects.contains(&operator.to) {
        let problem = format!("has `{}` as `to` but not in `effects`", name(operator.to));
        return Err(Fault::new(problem, "it in both"));
    }
    let pairs = [
        ("preconditions", &operator.preconditions, "absent", &operator.absent),
        ("effects", &operator.effects, "removes", &operator.removes),
    ];
    for (one, list, other, others) in pairs {
        if let Some(both) = list.iter().find(|s| others.contains(s)) {
            let problem = format!("lists `{}` in both `{one}` and `{other}`", name(*both));
            return Err(Fault::new(problem, "it in at most one"));
        }
    }
    Ok(())
}
