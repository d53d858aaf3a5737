//! The builder for domains written in code: states and actions by name, without geometry.

use super::Domain;
use super::check::Fault;
use super::ids::StateId;
use super::operator::Operator;
use super::state::State;
use crate::task::error::TaskError;

/// The kind of every object.
const KIND: &str = "object";

/// Builds a domain in code, for planning without geometry.
///
/// Naming a state adds it to the domain, in the order of first mention. All states belong to one kind of object, `object`.
/// A state may have several causes.
///
/// ```
/// use symbolt::task::DomainBuilder;
/// let domain = DomainBuilder::new()
///     .action("BOIL_WATER", ["KETTLE_FULL"], ["WATER_HOT"])
///     .action("BREW_TEA", ["WATER_HOT", "LEAVES_IN_POT"], ["TEA_READY"])
///     .state("LEAVES_IN_TIN")
///     .build()?;
/// assert_eq!(domain.states().len(), 5);
/// # Ok::<(), symbolt::task::TaskError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct DomainBuilder {
    states: Vec<String>,
    actions: Vec<Action>,
}

#[derive(Debug, Clone)]
struct Action {
    name: String,
    preconditions: Vec<StateId>,
    absent: Vec<StateId>,
    effects: Vec<StateId>,
}

impl DomainBuilder {
    /// Returns a builder without states and actions.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a state, unless it was named before.
    pub fn state(mut self, name: &str) -> Self {
        self.note(name);
        self
    }

    /// Adds an action with its preconditions and effects. The first effect is the state that the action moves its
    /// object into ([`Operator::to`]). [`build`](Self::build) requires at least one effect.
    pub fn action<'n>(
        self,
        name: &str,
        preconditions: impl IntoIterator<Item = &'n str>,
        effects: impl IntoIterator<Item = &'n str>,
    ) -> Self {
        self.action_unless(name, preconditions, [], effects)
    }

    /// Adds an action, as [`action`](Self::action) does, that also requires the states in `absent` to be absent. A
    /// planner checks these only if [`Rules::absent`](super::Rules::absent) is set.
    pub fn action_unless<'n>(
        mut self,
        name: &str,
        preconditions: impl IntoIterator<Item = &'n str>,
        absent: impl IntoIterator<Item = &'n str>,
        effects: impl IntoIterator<Item = &'n str>,
    ) -> Self {
        let preconditions = preconditions.into_iter().map(|n| self.note(n)).collect();
        let absent = absent.into_iter().map(|n| self.note(n)).collect();
        let effects = effects.into_iter().map(|n| self.note(n)).collect();
        self.actions.push(Action { name: name.into(), preconditions, absent, effects });
        self
    }

    fn note(&mut self, name: &str) -> StateId {
        let at = self.states.iter().position(|s| s == name).unwrap_or_else(|| {
            self.states.push(name.into());
            self.states.len() - 1
        });
        StateId::new(at)
    }

    /// Checks the states and actions and builds the domain.
    ///
    /// # Errors
    /// As [`Domain::new`]; also [`TaskError::BadDomain`] for an action without effects.
    pub fn build(self) -> Result<Domain, TaskError> {
        let mut operators = Vec::new();
        for Action { name, preconditions, absent, effects } in self.actions {
            let Some(to) = effects.first().copied() else {
                let problem = format!("action `{name}` has no effects");
                return Err(Fault::new(problem, "at least one").into());
            };
            operators.push(Operator {
                name,
                from: None,
                to,
                preconditions,
                effects,
                absent,
                removes: Vec::new(),
            });
        }
        let states = self.states.into_iter();
        let states = states.map(|name| State { name, kind: KIND.into() });
        Domain::new(states.collect(), operators)
    }
}
