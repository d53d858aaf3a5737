//! A planner's decision, with the time of every milestone.

use std::fmt;

use crate::task::propositional::{ActionId, StateId, Verdict};

/// The stages of a decision. Each gives a milestone.
///
/// The first six are those of a [`Planner`](super::Planner). A [`GoalSetPlanner`](super::GoalSetPlanner) has the others,
/// and `Decision`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// The goal buffer holds the examined state.
    Goal,
    /// The action that causes the examined state is recalled.
    Action,
    /// The action's preconditions are unbound and cleaned up.
    Preconditions,
    /// The preconditions are compared with the world, and an unmet precondition, if any, is chosen.
    Comparison,
    /// The executive has drawn its conclusion about the examined state: the next question, or the verdict.
    Conclusion,
    /// The decision is at the graph's outputs.
    Decision,
    /// The planner begins to plan, or begins anew.
    Start,
    /// It is known how far each state is from what holds.
    Costs,
    /// An action is chosen, and the goal set before it is written.
    GoalSet,
    /// No action leads on from the goal set; the planner goes back.
    DeadEnd,
    /// The goal set holds: the plan is found.
    Plan,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Goal => "goal",
            Self::Action => "action",
            Self::Preconditions => "preconditions",
            Self::Comparison => "comparison",
            Self::Conclusion => "conclusion",
            Self::Decision => "decision",
            Self::Start => "start",
            Self::Costs => "costs",
            Self::GoalSet => "goal set",
            Self::DeadEnd => "dead end",
            Self::Plan => "plan",
        })
    }
}

/// A milestone: the time at which a stage of a question was reached.
///
/// A stage is reached when the last item that it depends on becomes active or inactive.
#[derive(Debug, Clone, PartialEq)]
pub struct Milestone {
    /// Number of the question, or of the step of the search, counted from 1. A step is a start, a goal set or a dead end.
    pub question: u32,
    /// The stage that was reached.
    pub stage: Stage,
    /// Name of the examined state. With goal sets: the chosen action, the goal, or `all goals`.
    pub subject: String,
    /// Simulated time since the planner was asked, in milliseconds.
    pub time_ms: f64,
}

/// A planner's decision, with its milestones and choices.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// The verdict: act, met or stuck.
    pub verdict: Verdict,
    /// The milestones, in order of time.
    pub milestones: Vec<Milestone>,
    /// Simulated time from request to answer, in milliseconds.
    pub time_ms: f64,
    /// Number of questions; a state that is examined twice counts twice. With goal sets: the number that were written.
    pub questions: u32,
    /// Choices among several causes of a state, in order of time. A later choice for the same state replaces the
    /// earlier choice. Empty if no state has several causes.
    pub choices: Vec<Choice>,
}

/// A choice among several causes of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice {
    /// Number of the question, counted from 1.
    pub question: u32,
    /// The state.
    pub state: StateId,
    /// The chosen cause.
    pub action: ActionId,
    /// Number of causes that were not ruled out yet.
    pub among: usize,
    /// Why this cause was chosen.
    pub why: Why,
}

/// Why one cause of a state was chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Why {
    /// All other causes had been ruled out.
    OnlyOneLeft,
    /// The cause has fewer unmet preconditions than any other cause.
    FewestUnmet {
        /// Number of unmet preconditions.
        unmet: usize,
    },
    /// No other cause has fewer unmet preconditions. Among the causes with equally many, the chosen cause comes first
    /// in [`Domain::causes`](crate::task::propositional::Domain::causes).
    Preferred {
        /// Number of unmet preconditions.
        unmet: usize,
    },
    /// The neurons were not precise enough: by the rule, another cause should have won. Never occurs in direct mode.
    Imprecision,
}
