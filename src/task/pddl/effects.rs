//! The effects of an operator on other objects.

use super::WriteFault;
use super::actions::{Part, Writer};
use super::conditions::Scope;
use crate::plan::strips::{
    Atom, Condition, ConditionalEffect, FALSE, Literal, TRUE, Term, all, any, not, same,
};
use crate::task::domain::{self, Role, SideEffect, Subject};

/// Whose state an effect changes.
pub(super) enum Who {
    One(Term),
    /// All objects of the state's kind but some.
    Others(Vec<Term>),
}

impl Part<'_> {
    /// Adds the effect that objects are in a state, or are not. What is not given of the reference and the place stands for
    /// all. `when` takes the object and the terms of what is not given.
    pub fn change(
        &mut self,
        who: &Who,
        state: usize,
        given: [Option<Term>; 2],
        positive: bool,
        when: impl FnOnce(&mut Scope<'_>, &Term, &[Term]) -> Condition,
    ) {
        let words = self.scope.words;
        let scope = &mut self.scope;
        let depth = scope.variables.len();
        let (object, except) = match who {
            Who::One(term) => (term.clone(), &[][..]),
            Who::Others(except) => (scope.add("", &words.states[state].kind), &except[..]),
        };
        let given = given.each_ref().map(Option::as_ref);
        let open: Vec<Term> =
            words.open(state, given).into_iter().map(|kind| scope.add("", kind)).collect();
        let like = except.iter().filter(|term| scope.kind(term) == scope.kind(&object));
        let mut conditions: Vec<Condition> = like.map(|t| not(same(&object, t))).collect();
        conditions.push(when(scope, &object, &open));
        let condition = all(conditions);
        let effect = Literal { positive, ..words.atom(state, &object, given, &open) };
        let variables = scope.variables.split_off(depth);
        if variables.is_empty() && condition == TRUE {
            self.action.effects.push(effect);
        } else if condition != FALSE {
            let effects = vec![effect];
            self.action.conditional.push(ConditionalEffect { variables, condition, effects });
        }
    }
}

impl Writer<'_, '_> {
    /// Adds the effects of the operator on other objects.
    pub fn side_effects(&self, part: &mut Part<'_>) -> Result<(), WriteFault> {
        let effects = &self.problem.domain().operators[part.operator].side_effects;
        for (n, effect) in effects.iter().enumerate() {
            let domain::Condition { state, subject } = effect.condition;
            if subject == Subject::Is(Role::Object) {
                continue;
            }
            let term = match subject {
                Subject::Is(role) | Subject::At(role) => part.role(role),
                Subject::Any => None,
            };
            let named = &self.words.states[state];
            let kind = term.as_ref().and_then(|term| part.scope.kind(term));
            let fits = match subject {
                Subject::Is(_) => kind == Some(&*named.kind),
                Subject::At(_) => kind == named.frame.as_deref(),
                Subject::Any => true,
            };
            // What begins at an origin that may be missing would begin nowhere.
            let at = matches!(subject, Subject::At(_));
            let nowhere = effect.begins && at && part.has_origin(subject).is_some();
            if !fits || part.lacks(subject) || nowhere {
                if effect.begins && (at || !part.lacks(subject)) {
                    return Err(self.uncertain(part, state));
                }
                continue;
            }
            let when = part.has_origin(subject).unwrap_or(TRUE);
            let (one, reference) = match subject {
                // What the object was taken from comes along to the target, if this is a frame of the state.
                Subject::Is(Role::Origin) if effect.begins => {
                    let target = part.role(Role::Target);
                    let frame = |term: &Term| part.scope.kind(term) == named.frame.as_deref();
                    (term, target.filter(frame))
                }
                Subject::Is(_) => (term, None),
                _ => (None, term),
            };
            if effect.begins {
                let same = |e: &SideEffect| e.begins && e.condition.subject == subject;
                if effects[..n].iter().any(same) {
                    return Err(self.uncertain(part, state));
                }
                self.begin(part, state, (one, reference), &when)?;
            } else {
                let roles =
                    if subject == Subject::Any { &[Role::Origin, Role::Target][..] } else { &[] };
                let except = roles.iter().filter_map(|role| part.role(*role)).collect();
                let who = one.map_or(Who::Others(except), Who::One);
                part.change(&who, state, [reference, None], false, |_, _, _| when);
            }
        }
        Ok(())
    }

    fn uncertain(&self, part: &Part<'_>, state: usize) -> WriteFault {
        let domain = self.problem.domain();
        let (operator, state) = (&domain.operators[part.operator], &domain.states[state]);
        WriteFault::Uncertain { action: operator.name.clone(), state: state.name.clone() }
    }

    /// Adds that an object comes into a state: one, or the only other object of the state's kind. It comes to a reference, or
    /// it keeps that of its old state. If it has none of the right kind, it comes to the first in the scene.
    fn begin(
        &self,
        part: &mut Part<'_>,
        state: usize,
        (one, reference): (Option<Term>, Option<Term>),
        when: &Condition,
    ) -> Result<(), WriteFault> {
        let (domain, words) = (self.problem.domain(), self.words);
        let named = &words.states[state];
        let who = match one {
            Some(term) => Who::One(term),
            None => {
                let own = part.scope.kind(&part.object) == Some(&*named.kind);
                let others = self.present(&domain.states[state].kind).saturating_sub(own.into());
                // What begins of any object is not about the origin and the target, and these may be the only ones.
                let of_kind = |role| {
                    part.role(role).is_some_and(|t| part.scope.kind(&t) == Some(&*named.kind))
                };
                let taken = [Role::Origin, Role::Target].into_iter().any(of_kind);
                if others > 1 || taken && reference.is_none() {
                    return Err(self.uncertain(part, state));
                }
                Who::Others(vec![part.object.clone()])
            }
        };
        let of_kind: Vec<usize> =
            (0..words.states.len()).filter(|s| words.states[*s].kind == named.kind).collect();
        for other in of_kind.iter().filter(|other| **other != state) {
            part.change(&who, *other, [None, None], false, |_, _, _| when.clone());
        }
        let place = words.place(state, 0);
        let Some(frame) = named.frame.as_ref().filter(|_| reference.is_none()) else {
            // An object that is in the state already keeps its place, or leaves the state if that ends.
            let effects = &domain.operators[part.operator].side_effects;
            let ends = effects.iter().any(|e| !e.begins && e.condition.state == state);
            // What comes along is meant by itself, wherever it is in the state.
            let along = reference.is_some() && matches!(who, Who::One(_));
            let stays = ends || along || named.places.is_some();
            let new = |scope: &mut Scope<'_>, x: &Term| {
                let given = [reference.as_ref().filter(|_| !along), None];
                let new = if stays { not(scope.is_in(state, x, given)) } else { TRUE };
                all([when.clone(), new])
            };
            if reference.is_some() {
                part.change(&who, state, [None, None], false, |scope, x, _| new(scope, x));
            }
            let given = [reference.clone(), place];
            part.change(&who, state, given, true, |scope, x, _| new(scope, x));
            return Ok(());
        };
        let framed = of_kind.iter().filter(|s| words.states[**s].frame.as_ref() == Some(frame));
        let framed: Vec<usize> = framed.copied().collect();
        for old in framed.iter().filter(|old| **old != state) {
            part.change(&who, state, [None, place.clone()], true, |scope, x, to| {
                all([when.clone(), scope.is_in(*old, x, [to.first(), None])])
            });
        }
        if let Some(first) = words.firsts.get(frame) {
            part.change(&who, state, [None, place], true, |scope, x, to| {
                let atom = Atom { predicate: first.clone(), arguments: to.to_vec() };
                let first = Condition::Literal(Literal { positive: true, atom });
                let old = framed.iter().map(|old| scope.is_in(*old, x, [None; 2]));
                let old: Vec<Condition> = old.collect();
                all([when.clone(), first, not(any(old))])
            });
        }
        Ok(())
    }
}
