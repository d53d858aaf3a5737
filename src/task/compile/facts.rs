//! Ground facts, as tests of a situation, and ground actions.

use crate::task::domain::{Fact, Parameters, Situation, is_within};

/// A test of a situation.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Test {
    /// The states, each with its place; `None` for any place.
    pub of: Vec<(usize, Option<usize>)>,
    /// The object; `None` for any object.
    pub object: Option<usize>,
    /// The reference; the outer `None` for any reference.
    pub reference: Option<Option<usize>>,
    /// State in which a reference has to be for its objects to count; `None` for any state. Actions that add to the fact
    /// require this state of their target, and it is an earlier term of the goal (`RelationalDomain::check`).
    pub within: Option<usize>,
    /// Objects that do not count.
    pub except: Vec<usize>,
    /// Least number of objects.
    pub least: usize,
    /// Greatest number of objects; `None` for any number.
    pub most: Option<usize>,
    /// Whether the fact is given: no action is sought to cause it, but one that is there for something else may.
    pub given: bool,
}

impl Test {
    /// Returns a test for objects in some states, at any place.
    pub fn of(states: impl IntoIterator<Item = usize>) -> Self {
        let of = states.into_iter().map(|s| (s, None)).collect();
        Self {
            of,
            object: None,
            reference: None,
            within: None,
            except: Vec::new(),
            least: 1,
            most: None,
            given: false,
        }
    }

    /// Returns the test that no object passes this test.
    pub fn none(self) -> Self {
        Self { least: 0, most: Some(0), ..self }
    }

    /// Returns whether the test sets an upper limit, so that objects can be in the way.
    pub fn forbids(&self) -> bool {
        self.most.is_some()
    }

    /// Returns whether an object with this state counts.
    pub fn matches(&self, object: usize, fact: &Fact) -> bool {
        self.counts(Some(object), fact.state, fact.place, fact.reference)
    }

    /// Returns whether an object in this state counts. `object` is `None` for an object of a kind whose objects are
    /// interchangeable.
    pub fn counts(
        &self,
        object: Option<usize>,
        state: usize,
        place: usize,
        reference: Option<usize>,
    ) -> bool {
        let own = match (self.object, object) {
            (None, Some(object)) => !self.except.contains(&object),
            (None, None) => true,
            (own, object) => own == object,
        };
        own && self.reference.is_none_or(|r| r == reference)
            && self.of.iter().any(|(s, p)| *s == state && p.is_none_or(|p| p == place))
    }

    /// Returns the objects that match, with their states. The state of the reference is not looked at.
    pub fn matching<'t>(
        &'t self,
        situation: &'t Situation,
    ) -> impl Iterator<Item = (usize, Fact)> + 't {
        let all = situation.iter().enumerate();
        all.filter_map(|(i, fact)| Some((i, fact.filter(|fact| self.matches(i, fact))?)))
    }

    /// Returns the number of objects that count.
    fn count(&self, situation: &Situation) -> usize {
        let placed = |(_, f): &(usize, Fact)| is_within(self.within, f.reference, situation);
        self.matching(situation).filter(placed).count()
    }

    /// Returns whether the fact holds.
    pub fn holds(&self, situation: &Situation) -> bool {
        let count = self.count(situation);
        count >= self.least && self.most.is_none_or(|most| count <= most)
    }

    /// Returns the number of objects that are lacking.
    pub fn lacking(&self, situation: &Situation) -> usize {
        self.least.saturating_sub(self.count(situation))
    }
}

/// An operator with its parameters bound.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct GroundAction {
    pub operator: usize,
    /// The object; `None` for any object of a kind whose objects are interchangeable.
    pub object: Option<usize>,
    /// The states and the reference that the object leaves.
    pub source: Test,
    pub reference: Option<usize>,
    pub place: usize,
    /// Least number of objects of its kind in the state that the object leaves, if a condition counts those that are left there.
    pub among: Option<usize>,
}

impl GroundAction {
    /// Returns the objects that conditions of the action are about.
    pub fn parameters(&self) -> Parameters {
        Parameters { object: self.object, origin: self.origin(), target: self.reference }
    }

    /// Returns the reference that the object leaves, if it is known.
    pub fn origin(&self) -> Option<usize> {
        self.source.reference.flatten()
    }
}
