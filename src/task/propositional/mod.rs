//! Propositional domains: states and actions by name, without objects and geometry. Planners run on them.
//!
//! A [`Domain`] is a table of states and a table of operators, which is all that a planner needs. [`DomainBuilder`] builds
//! one in code. From a [learned domain](super::domain) and a scene,
//! [`Problem::ground`](super::compile::Problem::ground) compiles one.
//!
//! * A **state** is a condition of one object, such as `CUP_ON_TABLE`. It *holds* while at least one object is in it.
//! * An **action** changes states. Its **operator** lists the **preconditions**, which must hold before the action,
//!   and the **effects**, which hold after it.
//! * A **cause** of a state is an action that has the state among its effects.
//! * The **goal** is the state that a planner is asked to reach.
//!
//! | purpose | types |
//! |---|---|
//! | write a domain in code | [`DomainBuilder`] |
//! | inspect a domain | [`State`], [`Operator`] |
//! | describe the states that hold | [`WorldState`] |
//! | say what the pointers of states and actions are made of | [`Composition`] |
//! | interpret a planner's answer | [`Verdict`], [`Obstacle`] |
//! | check a planner's answer | [`acceptable_answers`] |
//!
//! Names are stored once, in the two tables. Everything else refers to states and actions by [`StateId`] and
//! [`ActionId`].

mod builder;
mod check;
mod composition;
mod ids;
mod operator;
pub(crate) mod reference_planner;
mod state;
mod verdict;
mod world;

use std::ops::Index;

pub use builder::DomainBuilder;
pub(crate) use check::{Fault, check_names, is_symbol};
pub use composition::{Composition, Factor, Part};
pub use ids::{ActionId, StateId};
pub use operator::Operator;
pub(crate) use reference_planner::obstacles;
pub use reference_planner::{AcceptableAnswers, acceptable_answers};
pub use state::State;
pub use verdict::{Commitment, Obstacle, Rules, Verdict};
pub use world::WorldState;

use crate::sim::nearest_name;
use crate::task::error::TaskError;

/// A checked set of states and operators.
///
/// `domain[id]` returns the [`State`] of a [`StateId`] or the [`Operator`] of an [`ActionId`]. Indexing with an id of
/// another domain panics if the id is out of range.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    states: Vec<State>,
    operators: Vec<Operator>,
    /// Causes of each state, most preferred first.
    causes: Vec<Vec<ActionId>>,
}

impl Index<StateId> for Domain {
    type Output = State;

    fn index(&self, state: StateId) -> &State {
        &self.states[state.index()]
    }
}

impl Index<ActionId> for Domain {
    type Output = Operator;

    fn index(&self, action: ActionId) -> &Operator {
        &self.operators[action.index()]
    }
}

impl Domain {
    /// Checks the tables and builds a domain.
    ///
    /// # Errors
    /// [`TaskError::BadDomain`] if
    /// * a name is invalid or used twice,
    /// * an operator refers to a state that does not exist or lists a state twice, or
    /// * an operator requires a state to be both present and absent, has a state in both `effects` and `removes`, or
    ///   does not have `to` among its effects.
    pub fn new(states: Vec<State>, operators: Vec<Operator>) -> Result<Self, TaskError> {
        check::check(&states, &operators)?;
        let causes =
            (0..states.len()).map(|state| causes_of(StateId::new(state), &operators)).collect();
        Ok(Self { states, operators, causes })
    }

    /// Returns the states, in the order of their ids.
    pub fn states(&self) -> &[State] {
        &self.states
    }

    /// Returns the operators, in the order of their ids.
    pub fn operators(&self) -> &[Operator] {
        &self.operators
    }

    /// Returns the ids of all states.
    pub fn state_ids(&self) -> impl ExactSizeIterator<Item = StateId> + use<> {
        (0..self.states.len()).map(StateId::new)
    }

    /// Returns the ids of all actions.
    pub fn action_ids(&self) -> impl ExactSizeIterator<Item = ActionId> + use<> {
        (0..self.operators.len()).map(ActionId::new)
    }

    /// Returns the id of the state called `name`.
    ///
    /// # Errors
    /// [`TaskError::Unknown`] if there is no such state; the error lists all states.
    pub fn state(&self, name: &str) -> Result<StateId, TaskError> {
        let names = self.states.iter().map(|s| s.name.as_str());
        find(name, "state", names).map(StateId::new)
    }

    /// Returns the id of the action called `name`.
    ///
    /// # Errors
    /// [`TaskError::Unknown`] if there is no such action; the error lists all actions.
    pub fn action(&self, name: &str) -> Result<ActionId, TaskError> {
        let names = self.operators.iter().map(|o| o.name.as_str());
        find(name, "action", names).map(ActionId::new)
    }

    /// Returns the names of `states`, in the same order.
    pub fn names(&self, states: &[StateId]) -> Vec<&str> {
        states.iter().map(|s| self[*s].name.as_str()).collect()
    }

    /// Returns the world state in which exactly the named states hold.
    ///
    /// # Errors
    /// [`TaskError::Unknown`] for a name that is not a state; the error lists all states.
    pub fn world<'n>(
        &self,
        hold: impl IntoIterator<Item = &'n str>,
    ) -> Result<WorldState, TaskError> {
        let mut world = self.empty_world();
        for name in hold {
            world.insert(self.state(name)?);
        }
        Ok(world)
    }

    /// Returns the world state in which no state holds.
    pub fn empty_world(&self) -> WorldState {
        WorldState::empty(self.states.len())
    }

    /// Counts the objects in each state, as input for [`Planner::plan`](super::planner::Planner::plan). `things` names
    /// the state of each object, so a name can occur several times. The result has one count for each state, in the
    /// order of the states' ids.
    ///
    /// # Errors
    /// [`TaskError::Unknown`] for a name that is not a state; the error lists all states.
    pub fn counts<'n>(
        &self,
        things: impl IntoIterator<Item = &'n str>,
    ) -> Result<Vec<usize>, TaskError> {
        let mut counts = vec![0; self.states.len()];
        for name in things {
            counts[self.state(name)?.index()] += 1;
        }
        Ok(counts)
    }

    /// Returns the causes of `state`: all actions that have it among their effects, most preferred first.
    ///
    /// Actions that move their object into the state ([`Operator::to`]) come before actions with the state as a side
    /// effect. The order of the table decides ties.
    ///
    /// # Panics
    /// If `state` belongs to another domain and is out of range.
    pub fn causes(&self, state: StateId) -> &[ActionId] {
        &self.causes[state.index()]
    }
}

pub(crate) fn find<'n>(
    name: &str,
    what: &'static str,
    names: impl Iterator<Item = &'n str> + Clone,
) -> Result<usize, TaskError> {
    names.clone().position(|n| n == name).ok_or_else(|| TaskError::Unknown {
        what,
        name: name.into(),
        nearest: nearest_name(name, names.clone()),
        choices: names.map(str::to_owned).collect(),
    })
}

fn causes_of(state: StateId, operators: &[Operator]) -> Vec<ActionId> {
    let causes = operators.iter().enumerate().filter(|(_, o)| o.effects.contains(&state));
    let mut causes: Vec<(bool, ActionId)> =
        causes.map(|(index, o)| (o.to != state, ActionId::new(index))).collect();
    causes.sort_unstable();
    causes.into_iter().map(|(_, action)| action).collect()
}
