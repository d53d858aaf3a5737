//! Rules and verdicts, shared by the planner graph and the reference planner.

use serde::{Deserialize, Serialize};

use super::ids::{ActionId, StateId};

/// When a planner commits to an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Commitment {
    /// Once it has shown that every state needed for the goal is reachable.
    #[default]
    Proven,
    /// As soon as it finds an action that can be done: the paper's rule (section II.F).
    First,
}

/// The rules that a planner follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rules {
    /// When the planner commits to an action.
    pub commitment: Commitment,
    /// Whether an action requires the states in [`Operator::absent`](super::Operator::absent) to be absent.
    pub absent: bool,
}

/// Why a goal cannot be reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Obstacle {
    /// No action causes this state.
    NothingCauses {
        /// The state without a cause.
        state: StateId,
    },
    /// All preconditions of the action hold, but a state that must be absent holds too.
    MustBeAbsent {
        /// The action.
        action: ActionId,
        /// The state that holds and must be absent.
        state: StateId,
    },
    /// Reaching the state requires the state itself.
    NeedsItself {
        /// The state that depends on itself.
        state: StateId,
    },
    /// The planner found no plan in time, although each goal by itself may be within reach.
    NoPlan {
        /// The first goal that does not hold.
        state: StateId,
    },
}

impl Obstacle {
    /// Returns the obstacle in words, with these words for a state and an action.
    // `assets/report/words.js` has the same sentences.
    pub(crate) fn in_words(
        self,
        state: impl Fn(StateId) -> String,
        action: impl Fn(ActionId) -> String,
    ) -> String {
        match self {
            Self::NothingCauses { state: s } => {
                format!("{} does not hold and no action causes it", state(s))
            }
            Self::MustBeAbsent { action: a, state: s } => {
                format!("{} holds, but must be absent before {}", state(s), action(a))
            }
            Self::NeedsItself { state: s } => {
                format!("every way to reach {} requires {} itself", state(s), state(s))
            }
            Self::NoPlan { .. } => "no plan that reaches the goal was found".into(),
        }
    }
}

/// A planner's answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// Do this action next.
    Act(ActionId),
    /// The goal holds already.
    Met,
    /// The goal cannot be reached, for this reason.
    Stuck(Obstacle),
}
