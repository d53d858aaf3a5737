//! Operators with parameters: the needs and effects of an action, with the counts behind them.

use serde::{Deserialize, Serialize};

use super::condition::{Condition, Counted, Parameters, Role, Subject};

/// What the demonstrations say about a condition before an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NeedVerdict {
    /// The condition always held, and it is about a parameter.
    Required,
    /// The condition always held, or never, but it is about another object: it may be a coincidence.
    Undecided,
    /// The condition never held, and it is about something that rests on a parameter.
    Absent,
}

/// A condition before an action.
#[derive(Debug, Clone, PartialEq)]
pub struct Need {
    /// The condition.
    pub condition: Condition,
    /// Indices of further states that fulfil the condition as well as its own, for the same subject.
    pub or: Vec<usize>,
    /// Whether the condition is required, undecided or must be absent.
    pub verdict: NeedVerdict,
    /// Whether the condition has to hold, for undecided needs. `false`: it never held.
    pub holds: bool,
    /// Least number of objects in the state, at least 1. Where there are fewer objects of the kind, all of them will do.
    pub least: usize,
    /// Whether all objects of the kind have to be in the state, however many there are.
    pub every: bool,
    /// Number of demonstrated instances in which the condition held.
    pub held: usize,
    /// Number of demonstrated instances.
    pub of: usize,
}

impl Need {
    /// Returns the states that fulfil the condition.
    pub fn states(&self) -> impl Iterator<Item = usize> + '_ {
        std::iter::once(self.condition.state).chain(self.or.iter().copied())
    }

    /// Returns what the condition counts before an action, as [`Condition::counted`].
    pub(crate) fn counted(&self, action: &Parameters) -> Option<Counted<'_>> {
        Some(Counted { or: &self.or, ..self.condition.counted(action)? })
    }

    /// Returns the least number of objects in the state if `present` objects could be in it.
    pub(crate) fn least_of(&self, present: usize) -> usize {
        if self.every { present } else { self.least.min(present).max(1) }
    }

    /// Returns whether the condition has to hold; `false` if it must not.
    pub fn is_positive(&self) -> bool {
        match self.verdict {
            NeedVerdict::Required => true,
            NeedVerdict::Absent => false,
            NeedVerdict::Undecided => self.holds,
        }
    }
}

/// A change of another object's state.
#[derive(Debug, Clone, PartialEq)]
pub struct SideEffect {
    /// The condition that begins to hold, or ends.
    pub condition: Condition,
    /// Whether the condition begins to hold.
    pub begins: bool,
    /// Number of demonstrated instances in which the condition changed.
    pub changed: usize,
    /// Number of demonstrated instances in which it could have changed.
    pub of: usize,
}

/// The displacement of the object in the coordinates that its new place leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Displacement {
    /// Mean displacement in the frame of the new state, in metres.
    pub mean: [f64; 3],
    /// Greatest standard deviation over the open coordinates, in metres.
    pub sd: f64,
}

/// What has to be at the target before an object is put at one of the places of its new state: rows are filled from one end.
#[derive(Debug, Clone, PartialEq)]
pub struct Before {
    /// Index of the place.
    pub place: usize,
    /// States in the same frame, each with a place: an object has to be in one of them.
    pub one_of: Vec<(usize, usize)>,
}

/// The needs and effects of an action that moves one object.
#[derive(Debug, Clone, PartialEq)]
pub struct RelationalOperator {
    /// Name of the action: an upper-case letter, then letters, digits and `_`.
    pub name: String,
    /// Indices of the states that the object may leave, the most frequent first.
    pub from: Vec<usize>,
    /// Index of the state that the object enters.
    pub to: usize,
    /// Conditions before the action.
    pub needs: Vec<Need>,
    /// The order in which the places of the new state are filled, if they always were in one; none where any will do.
    pub order: Vec<Before>,
    /// Changes of other objects' states.
    pub side_effects: Vec<SideEffect>,
    /// How the object is displaced in open coordinates; `None` if it may be put anywhere in their range.
    pub displacement: Option<Displacement>,
    /// Number of demonstrated instances.
    pub instances: usize,
    /// Indices of the states that never held before the action, of any object.
    pub never_seen: Vec<usize>,
}

impl RelationalOperator {
    /// Returns the states that the operator achieves, for the object or for another one.
    pub(crate) fn achieves(&self) -> impl Iterator<Item = usize> + '_ {
        let begun = self.side_effects.iter().filter(|e| e.begins).map(|e| e.condition.state);
        std::iter::once(self.to).chain(begun)
    }

    /// Returns the needs with this verdict.
    pub fn needs_with(&self, verdict: NeedVerdict) -> impl Iterator<Item = &Need> {
        self.needs.iter().filter(move |need| need.verdict == verdict)
    }

    /// Returns whether the target has to be in a state before the action.
    pub(crate) fn needs_of_target(&self, state: usize) -> bool {
        let condition = Condition { state, subject: Subject::Is(Role::Target) };
        self.needs_with(NeedVerdict::Required).any(|need| need.condition == condition)
    }
}
