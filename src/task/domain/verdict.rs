//! What planners are asked and what they answer, shared by every planner and the reference planner.

use serde::{Deserialize, Serialize};

use super::ids::{ActionId, StateId};

/// When a planner commits to an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Commitment {
    /// When it is shown that everything needed for the goal can be brought about.
    #[default]
    Proven,
    /// When the first action that can be done is found (section II.F of the paper).
    First,
}

/// What a planner may look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rules {
    /// When it commits.
    pub commitment: Commitment,
    /// Whether states that never held before an action must be absent.
    pub absent: bool,
}

/// Why a goal cannot be had.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Obstacle {
    /// No action causes this state.
    NothingCauses {
        /// The state.
        state: StateId,
    },
    /// The action could be done but for a state that holds and must not.
    MustBeAbsent {
        /// The action.
        action: ActionId,
        /// The state that would have to be absent.
        state: StateId,
    },
    /// The state is needed to bring itself about.
    NeedsItself {
        /// The state.
        state: StateId,
    },
}

/// What a planner answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Do this action next.
    Act(ActionId),
    /// The goal holds already.
    Met,
    /// The goal cannot be had, and why.
    Stuck(Obstacle),
}
