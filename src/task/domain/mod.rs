//! A domain: states and operators, learned or written in code, with all that is needed to plan.
//!
//! Names stand once, in the tables of states and operators; everything else refers to them by
//! [`StateId`] and [`ActionId`]. Poses, counts and provenance belong to learned domains only.

mod builder;
mod check;
pub(crate) mod distance;
mod file;
pub(crate) mod grounding;
mod ids;
mod operator;
pub(crate) mod pose;
mod provenance;
pub(crate) mod recording;
pub(crate) mod reference;
mod state;
mod verdict;
mod world;

use std::ops::Index;

pub use builder::DomainBuilder;
pub(crate) use check::is_symbol;
pub use grounding::{Classifier, GaussianGate, Grounded, Grounding, MIN_DISTINCT};
pub use ids::{ActionId, StateId};
pub use operator::{Evidence, Operator, Parameter};
pub use pose::{Pose, mean_orientation, rotation_between};
pub use provenance::{KindClusters, Provenance};
pub use recording::{Demonstration, Labels, ObjectPose, Recording, Snapshot, SnapshotEvent};
pub use reference::{AcceptableAnswers, acceptable_answers};
pub use state::{LearnedState, Origin, State};
pub use verdict::{Commitment, Obstacle, Rules, Verdict};
pub use world::WorldState;

use crate::spa::nearest_name;
use crate::task::error::TaskError;

/// States and operators, checked as a whole.
///
/// Index it with a [`StateId`] or an [`ActionId`]; an id of another domain may be out of range, and then
/// indexing panics.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    states: Vec<State>,
    operators: Vec<Operator>,
    goal: Option<StateId>,
    provenance: Option<Provenance>,
    /// For each state, the actions that cause it, preferred ones first.
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
    /// A domain of checked tables; `provenance` says what it was learned from, if it was.
    ///
    /// # Errors
    /// [`TaskError::BadDomain`] if a name is bad or used twice; if an operator has no parameter, or one without a
    /// name, with another's name or of a kind that no state has; if it names a state that is not there, lists one
    /// twice, needs one both present and absent, both causes and ends one, or does not list `to` among its effects;
    /// if the goal is no state; if a number is not finite, or a covariance greater than any recording's.
    pub fn new(
        states: Vec<State>,
        operators: Vec<Operator>,
        goal: Option<StateId>,
        provenance: Option<Provenance>,
    ) -> Result<Self, TaskError> {
        check::check(&states, &operators, goal)
            .map_err(|reason| TaskError::BadDomain { reason })?;
        let causes =
            (0..states.len()).map(|state| causes_of(StateId::new(state), &operators)).collect();
        Ok(Self { states, operators, goal, provenance, causes })
    }

    /// The states, in the order of their ids.
    pub fn states(&self) -> &[State] {
        &self.states
    }

    /// The operators, in the order of their ids.
    pub fn operators(&self) -> &[Operator] {
        &self.operators
    }

    /// The ids of all states.
    pub fn state_ids(&self) -> impl ExactSizeIterator<Item = StateId> + use<> {
        (0..self.states.len()).map(StateId::new)
    }

    /// The ids of all actions.
    pub fn action_ids(&self) -> impl ExactSizeIterator<Item = ActionId> + use<> {
        (0..self.operators.len()).map(ActionId::new)
    }

    /// The state that the last action of the demonstrations brought about.
    pub fn goal(&self) -> Option<StateId> {
        self.goal
    }

    /// The goal's name.
    pub fn goal_name(&self) -> Option<&str> {
        self.goal.map(|goal| self[goal].name.as_str())
    }

    /// What the domain was learned from; `None` for a domain written in code.
    pub fn provenance(&self) -> Option<&Provenance> {
        self.provenance.as_ref()
    }

    /// The state called `name`.
    ///
    /// # Errors
    /// [`TaskError::Unknown`], listing the states.
    pub fn state(&self, name: &str) -> Result<StateId, TaskError> {
        let names = self.states.iter().map(|s| s.name.as_str());
        find(name, "state", names).map(StateId::new)
    }

    /// The action called `name`.
    ///
    /// # Errors
    /// [`TaskError::Unknown`], listing the actions.
    pub fn action(&self, name: &str) -> Result<ActionId, TaskError> {
        let names = self.operators.iter().map(|o| o.name.as_str());
        find(name, "action", names).map(ActionId::new)
    }

    /// The names of states, in their order.
    pub fn names(&self, states: &[StateId]) -> Vec<&str> {
        states.iter().map(|s| self[*s].name.as_str()).collect()
    }

    /// A world in which the named states hold and no others.
    ///
    /// # Errors
    /// [`TaskError::Unknown`], listing the states.
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

    /// A world in which no state holds.
    pub fn empty_world(&self) -> WorldState {
        WorldState::empty(self.states.len())
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
            counts[self.state(name)?.index()] += 1;
        }
        Ok(counts)
    }

    /// The actions that cause a state: all that have it among their effects, in the order in which a planner
    /// prefers them. Actions by which a part is put into that state come before those that bring it about as a
    /// further effect; then those demonstrated more often come first; then the order of the table decides.
    ///
    /// # Panics
    /// If the state is of another domain and out of range.
    pub fn causes(&self, state: StateId) -> &[ActionId] {
        &self.causes[state.index()]
    }

    /// The domain with other names for states and actions, given as pairs of old and new name.
    ///
    /// # Errors
    /// If an old name is neither a state nor an action or is given twice, or if the new names make the
    /// domain invalid.
    pub fn rename(&self, renames: &[(String, String)]) -> Result<Self, TaskError> {
        let names = || {
            let states = self.states.iter().map(|s| s.name.as_str());
            states.chain(self.operators.iter().map(|o| o.name.as_str()))
        };
        for (index, (old, _)) in renames.iter().enumerate() {
            find(old, "state or action", names())?;
            if renames[..index].iter().any(|(earlier, _)| earlier == old) {
                let reason = format!("`{old}` is renamed twice");
                return Err(TaskError::BadDomain { reason });
            }
        }
        let mut renamed = self.clone();
        let states = renamed.states.iter_mut().map(|s| &mut s.name);
        for name in states.chain(renamed.operators.iter_mut().map(|o| &mut o.name)) {
            if let Some((_, new)) = renames.iter().find(|(old, _)| old == name) {
                name.clone_from(new);
            }
        }
        Self::new(renamed.states, renamed.operators, renamed.goal, renamed.provenance)
    }
}

fn find<'n>(
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
    let mut causes: Vec<(bool, u32, ActionId)> = operators
        .iter()
        .enumerate()
        .filter(|(_, o)| o.effects.contains(&state))
        .map(|(index, o)| (o.to == state, o.instances(), ActionId::new(index)))
        .collect();
    causes.sort_by_key(|(own, instances, action)| (!own, u32::MAX - instances, *action));
    causes.into_iter().map(|(_, _, action)| action).collect()
}
