//! Conditions of an action, and the objects that each of them counts.

use serde::{Deserialize, Serialize};

use super::situation::{Fact, Situation};

/// A parameter of an operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// The object that the action moves.
    Object,
    /// The reference of the state that the object leaves.
    Origin,
    /// The reference of the state that the object enters.
    Target,
}

impl Role {
    /// Returns the role's name in tables and pointers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Object => "object",
            Self::Origin => "origin",
            Self::Target => "target",
        }
    }
}

/// The object that a condition is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Subject {
    /// A parameter itself is in the state.
    Is(Role),
    /// Another object is in the state, with the parameter as its reference.
    At(Role),
    /// Any other object is in the state, with any reference.
    Any,
}

/// A condition: a state, and whose state it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Condition {
    /// Index of the state.
    pub state: usize,
    /// The object that is in the state.
    pub subject: Subject,
}

/// The objects that the parameters of an action stand for; `None` for a parameter that it lacks, or that is not known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parameters {
    pub object: Option<usize>,
    pub origin: Option<usize>,
    pub target: Option<usize>,
}

impl Parameters {
    /// Returns the parameters of an action that takes an object from the reference `from` to the reference `target`. An
    /// action at one reference has no origin beside its target.
    pub fn new(object: Option<usize>, from: Option<usize>, target: Option<usize>) -> Self {
        Self { object, origin: from.filter(|_| from != target), target }
    }

    /// Returns the object that a role stands for.
    pub fn get(&self, role: Role) -> Option<usize> {
        match role {
            Role::Object => self.object,
            Role::Origin => self.origin,
            Role::Target => self.target,
        }
    }
}

/// What a condition of an action counts: objects in a state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Counted<'n> {
    pub state: usize,
    /// Further states whose objects count as well.
    pub or: &'n [usize],
    /// The only object that counts; `None` if any does.
    pub object: Option<usize>,
    /// The reference of the objects that count; `None` if any will do.
    pub reference: Option<usize>,
    /// Objects that do not count.
    pub except: [Option<usize>; 3],
}

impl Condition {
    /// Returns what the condition counts before an action; `None` if it is about a parameter that the action lacks.
    pub(crate) fn counted(&self, action: &Parameters) -> Option<Counted<'static>> {
        let (state, except) = (self.state, [None; 3]);
        let any = Counted { state, or: &[], object: None, reference: None, except };
        Some(match self.subject {
            Subject::Is(role) => Counted { object: Some(action.get(role)?), ..any },
            Subject::At(role) => Counted {
                reference: Some(action.get(role)?),
                except: [action.object, None, None],
                ..any
            },
            Subject::Any => {
                Counted { except: [action.object, action.origin, action.target], ..any }
            }
        })
    }
}

impl Counted<'_> {
    /// Returns the states whose objects count.
    pub fn states(&self) -> impl Iterator<Item = usize> + '_ {
        std::iter::once(self.state).chain(self.or.iter().copied())
    }

    /// Returns whether an object with this state counts.
    pub fn includes(&self, object: usize, fact: &Fact) -> bool {
        self.states().any(|state| state == fact.state)
            && self.object.is_none_or(|one| one == object)
            && (self.reference.is_none() || self.reference == fact.reference)
            && !self.except.contains(&Some(object))
    }

    /// Returns the objects that count in a situation.
    pub fn holders<'s>(&'s self, situation: &'s Situation) -> impl Iterator<Item = usize> + 's {
        let all = situation.iter().enumerate();
        all.filter(|(i, fact)| fact.is_some_and(|f| self.includes(*i, &f))).map(|(i, _)| i)
    }
}
