//! Which actions cause a fact, add to it or end it.

use super::compiler::Compiler;
use super::counted::among;
use super::facts::{GroundAction, Test};
use crate::task::domain::{NeedVerdict, Quantity, Role, Subject};

impl Compiler<'_> {
    /// Returns the actions that cause a fact, or add to it.
    pub(super) fn causes(&self, test: &Test) -> Vec<GroundAction> {
        let mut causes = Vec::new();
        for o in 0..self.problem.domain.operators.len() {
            let operator = &self.problem.domain.operators[o];
            let enters = operator.to;
            let leaves = operator.from.iter().any(|s| test.of.iter().any(|(x, _)| x == s));
            let aside = operator.side_effects.iter().any(|e| {
                e.begins != test.forbids() && test.of.iter().any(|(s, _)| *s == e.condition.state)
            });
            let direct =
                if !test.forbids() { test.of.iter().any(|(s, _)| *s == enters) } else { leaves };
            if !direct && !aside {
                continue;
            }
            for object in self.movers(o) {
                for (reference, place) in self.problem.targets(o, object) {
                    let sources = if test.forbids() && direct {
                        self.blockers(test, o, object)
                    } else {
                        self.sources(o, object, reference, test)
                    };
                    let sources =
                        sources.into_iter().flat_map(|s| among(self.problem, &self.counted, s));
                    for (source, among) in sources {
                        let operator = o;
                        let action =
                            GroundAction { operator, object, source, reference, place, among };
                        if self.contributes(&action, test) {
                            causes.push(action);
                        }
                    }
                }
            }
        }
        causes
    }

    /// Returns the objects that an operator can move; `None` for interchangeable objects.
    fn movers(&self, operator: usize) -> Vec<Option<usize>> {
        let to = self.problem.domain.operators[operator].to;
        let kind = &self.problem.domain.states[to].kind;
        let mut all = self.problem.of_kind(kind).map(Some);
        if self.problem.told_apart(kind) {
            all.collect()
        } else {
            all.next().map(|_| None).into_iter().collect()
        }
    }

    /// Returns the sources of a move that takes away what a test forbids.
    fn blockers(&self, test: &Test, operator: usize, object: Option<usize>) -> Vec<Test> {
        let from = self.leaves(operator);
        let of: Vec<_> = test.of.iter().filter(|(s, _)| from.contains(s)).copied().collect();
        let kind = &self.problem.domain.states[self.problem.domain.operators[operator].to].kind;
        let own = match (test.object, object) {
            (Some(one), Some(object)) => one == object,
            (Some(_), None) => false,
            (None, Some(object)) => !test.except.contains(&object),
            (None, None) => true,
        };
        let of: Vec<_> =
            of.into_iter().filter(|(s, _)| self.problem.domain.states[*s].kind == *kind).collect();
        if of.is_empty() || !own {
            return Vec::new();
        }
        let except = if object.is_some() { Vec::new() } else { test.except.clone() };
        vec![Test { of, object, reference: test.reference, except, given: true, ..Test::of([]) }]
    }

    /// Returns the states that an object may leave.
    fn leaves(&self, operator: usize) -> Vec<usize> {
        let all = &self.problem.domain.operators[operator];
        let mut from = all.from.clone();
        for (n, need) in all.needs.iter().enumerate() {
            if need.condition.subject == Subject::Is(Role::Object) && self.counts(operator, n) {
                from.retain(|s| need.states().any(|state| state == *s) == need.is_positive());
            }
        }
        from
    }

    /// Returns whether a need is a condition: it is decided, or undecided and in force.
    pub(super) fn counts(&self, operator: usize, need: usize) -> bool {
        let verdict = self.problem.domain.operators[operator].needs[need].verdict;
        verdict != NeedVerdict::Undecided || self.in_force.contains(&(operator, need))
    }

    /// Returns the sources of a move that adds to a test. States whose objects are counted already are left out.
    fn sources(
        &self,
        operator: usize,
        object: Option<usize>,
        target: Option<usize>,
        test: &Test,
    ) -> Vec<Test> {
        let domain = self.problem.domain;
        let all = &domain.operators[operator];
        let kind = &domain.states[all.to].kind;
        let about_origin = |subject: Subject| {
            matches!(subject, Subject::Is(Role::Origin) | Subject::At(Role::Origin))
        };
        let needs = all.needs.iter().enumerate().filter(|(n, _)| self.counts(operator, *n));
        let apart = needs.clone().any(|(_, n)| {
            let left = |s: usize| domain.states[s].kind == *kind && all.from.contains(&s);
            let own = object.is_none() && n.states().any(left);
            about_origin(n.condition.subject) || own
        }) || self.leaves(operator).iter().any(|s| self.counted.contains(s))
            || all.side_effects.iter().any(|e| about_origin(e.condition.subject));
        let counted =
            |s: usize| !test.forbids() && test.of.iter().any(|(x, p)| *x == s && p.is_none());
        let (mut anywhere, mut single): (Vec<usize>, Vec<Test>) = (Vec::new(), Vec::new());
        for state in self.leaves(operator) {
            let again = state == all.to || counted(state);
            if !again && !apart {
                anywhere.push(state);
                continue;
            }
            for reference in self.problem.references(&domain.states[state].frame, object) {
                let stays = state == all.to && reference == target;
                if stays || !test.forbids() && test.counts(object, state, 0, reference) {
                    continue;
                }
                let spare = if object.is_none() { self.quota(state) } else { 0 };
                let least = if again { 1 + spare } else { 1 };
                let reference = reference.map(Some);
                single.push(Test { object, reference, least, ..Test::of([state]) });
            }
        }
        if !anywhere.is_empty() {
            single.insert(0, Test { object, ..Test::of(anywhere) });
        }
        single
    }

    /// Returns the number of objects that the goal asks for at each reference.
    fn quota(&self, state: usize) -> usize {
        let own = self.problem.goals.iter().filter(|g| g.state == state);
        let each = own.map(|g| match g.quantity {
            Quantity::EachReference(n) => n,
            _ => 0,
        });
        each.max().unwrap_or(0)
    }

    /// Returns whether the action brings an object to where the test counts it.
    pub(super) fn enters(&self, action: &GroundAction, test: &Test) -> bool {
        let to = self.problem.domain.operators[action.operator].to;
        test.counts(action.object, to, action.place, action.reference)
    }

    /// Returns whether an action causes a fact, or adds to it.
    pub(super) fn contributes(&self, action: &GroundAction, test: &Test) -> bool {
        let operator = &self.problem.domain.operators[action.operator];
        let counted_before = |s: &(usize, Option<usize>)| match action.source.reference {
            Some(reference) => test.counts(action.object, s.0, s.1.unwrap_or(0), reference),
            None => test.of.iter().any(|(x, _)| *x == s.0),
        };
        let aside = || {
            operator.side_effects.iter().any(|e| {
                let state = e.condition.state;
                let to = || self.problem.comes_to(&e.condition, &action.parameters());
                let there = |at: Option<usize>| to().is_none_or(|to| at == Some(to));
                e.begins != test.forbids()
                    && test.of.iter().any(|(s, _)| *s == state)
                    && self.about(action, e.condition.subject, test)
                    && (!e.begins || test.reference.is_none_or(there))
            })
        };
        if !test.forbids() {
            let adds = self.enters(action, test) && !action.source.of.iter().any(counted_before);
            return adds || aside();
        }
        let within = |s: &(usize, Option<usize>)| {
            test.of.iter().any(|(x, p)| *x == s.0 && (p.is_none() || *p == s.1))
        };
        let removes = action.source.of.iter().all(within)
            && self.leaves_reference(action, test)
            && match (test.object, action.object) {
                (Some(one), object) => object == Some(one),
                (None, Some(object)) => !test.except.contains(&object),
                (None, None) => true,
            };
        (removes || aside()) && !self.enters(action, test)
    }

    /// Returns whether an action takes its object from the reference that a test is about: it says so, or there is no other.
    fn leaves_reference(&self, action: &GroundAction, test: &Test) -> bool {
        let only = |state: usize| {
            let frame = &self.problem.domain.states[state].frame;
            let all = self.problem.references(frame, action.object);
            matches!(&all[..], [one] if Some(*one) == test.reference)
        };
        let source = &action.source;
        test.reference.is_none()
            || test.reference == source.reference
            || (source.reference.is_none() && source.of.iter().all(|(state, _)| only(*state)))
    }

    /// Returns whether an action ends a fact wherever it is done: it puts an object where none may be, moves the one object that the fact
    /// is about, or leaves too few of those that the fact counts.
    pub(super) fn ends(&self, action: &GroundAction, test: &Test) -> bool {
        if test.forbids() {
            return test.most == Some(0) && self.enters(action, test);
        }
        let one = match test.object {
            Some(object) => action.object == Some(object),
            None => {
                action.object.is_none_or(|object| !test.except.contains(&object))
                    && self.is_alone(action)
            }
        };
        let left =
            action.source.of.iter().all(|s| test.of.contains(s) || test.of.contains(&(s.0, None)));
        let there = test.reference.is_none() || test.reference == action.source.reference;
        let moved = one && left && there && !action.source.of.is_empty();
        (moved || action.uses_up(test)) && !self.enters(action, test)
    }

    /// Returns whether the object of an action is the only one of its kind.
    fn is_alone(&self, action: &GroundAction) -> bool {
        let to = self.problem.domain.operators[action.operator].to;
        self.problem.of_kind(&self.problem.domain.states[to].kind).nth(1).is_none()
    }

    /// Returns whether a side effect of an action can concern the objects of a test.
    fn about(&self, action: &GroundAction, subject: Subject, test: &Test) -> bool {
        let parameters = action.parameters();
        match subject {
            Subject::Is(r) => match (parameters.get(r), test.object) {
                (Some(one), Some(object)) => one == object,
                (Some(one), None) => !test.except.contains(&one),
                (None, _) => false,
            },
            Subject::At(r) => match parameters.get(r) {
                Some(one) => test.reference.is_none_or(|x| x == Some(one)),
                None => false,
            },
            Subject::Any => true,
        }
    }
}
