//! The actions of an operator: where the object comes from and goes to.

use std::collections::{BTreeMap, BTreeSet};

use super::WriteFault;
use super::conditions::Scope;
use super::effects::Who;
use super::vocabulary::Vocabulary;
use crate::plan::strips::{Action, Condition, FALSE, TRUE, Term, all, any, not, same};
use crate::task::compile::Problem;
use crate::task::domain::{Frame, Need, NeedVerdict, RelationalOperator, Role, Subject};

/// What the actions of all operators are written with.
pub(super) struct Writer<'w, 'p> {
    pub problem: &'w Problem<'p>,
    pub words: &'w Vocabulary,
    /// Needs that do not count, as pairs of operator and need.
    pub dropped: &'w BTreeSet<(usize, usize)>,
}

/// An action while it is written.
pub(super) struct Part<'w> {
    pub scope: Scope<'w>,
    /// Index of the operator.
    pub operator: usize,
    /// States that the object may leave.
    pub from: Vec<usize>,
    pub object: Term,
    pub origin: Option<Term>,
    pub target: Option<Term>,
    place: Option<Term>,
    pub action: Action,
}

impl Part<'_> {
    pub fn role(&self, role: Role) -> Option<Term> {
        match role {
            Role::Object => Some(self.object.clone()),
            Role::Origin => self.origin.clone(),
            Role::Target => self.target.clone(),
        }
    }

    /// Returns the condition that the origin is not the target; `None` if they always differ.
    pub fn leaves_target(&self) -> Option<Condition> {
        let (origin, target) = (self.origin.as_ref()?, self.target.as_ref()?);
        (self.scope.kind(origin) == self.scope.kind(target)).then(|| not(same(origin, target)))
    }
}

impl<'p> Writer<'_, 'p> {
    /// Returns the actions of an operator. There are several if a condition speaks of the origin, and origins are of several
    /// kinds; there is none if the operator is never possible.
    pub fn actions(&self, o: usize) -> Result<Vec<Action>, WriteFault> {
        let domain = self.problem.domain();
        let operator = &domain.operators[o];
        let frame = |state: usize| domain.states[state].frame.kind();
        let mut frames: Vec<(Option<&str>, Vec<usize>)> = Vec::new();
        for state in operator.from.iter().copied() {
            // In the world frame, what is in the state stays there.
            if state == operator.to && frame(state).is_none() {
                continue;
            }
            match frames.iter_mut().find(|(kind, _)| *kind == frame(state)) {
                Some((_, states)) if states.contains(&state) => {}
                Some((_, states)) => states.push(state),
                None => frames.push((frame(state), vec![state])),
            }
        }
        let several = frames.len() > 1;
        if several && !frames.iter().any(|(kind, _)| self.speaks_of_origin(o, *kind)) {
            let states = frames.into_iter().flat_map(|(_, states)| states).collect();
            frames = vec![(None, states)];
        }
        let several = frames.len() > 1;
        let mut found = Vec::new();
        for (kind, states) in frames {
            let origin = kind.unwrap_or(Frame::World.name()).to_owned();
            let name = if several {
                format!("{}_from_{origin}", operator.name)
            } else {
                operator.name.clone()
            };
            found.extend(self.action(o, kind, states, name)?);
        }
        Ok(found)
    }

    /// Returns the needs of an operator that count.
    pub fn needs(&self, o: usize) -> impl Iterator<Item = &'p Need> {
        let needs = self.problem.domain().operators[o].needs.iter().enumerate();
        needs.filter(move |(n, _)| !self.dropped.contains(&(o, *n))).map(|(_, need)| need)
    }

    /// Returns whether a condition or an effect of an operator depends on which object of a kind is the origin.
    fn speaks_of_origin(&self, o: usize, kind: Option<&str>) -> bool {
        let domain = self.problem.domain();
        let speaks = |subject: Subject, mut states: Vec<usize>| match subject {
            Subject::Is(role) | Subject::At(role) => role == Role::Origin,
            Subject::Any => states.drain(..).any(|s| Some(&*domain.states[s].kind) == kind),
        };
        let mut effects = domain.operators[o].side_effects.iter().map(|e| e.condition);
        effects.any(|c| speaks(c.subject, vec![c.state]))
            || self.needs(o).any(|n| speaks(n.condition.subject, n.states().collect()))
    }

    /// Returns the action for objects that leave certain states, with references of one kind if the origin is a parameter;
    /// `None` if it is never possible.
    fn action(
        &self,
        o: usize,
        origin: Option<&str>,
        from: Vec<usize>,
        name: String,
    ) -> Result<Option<Action>, WriteFault> {
        let (domain, words) = (self.problem.domain(), self.words);
        let operator = &domain.operators[o];
        let to = &words.states[operator.to];
        let mut scope = Scope { words, variables: Vec::new() };
        let object = scope.add("", &to.kind);
        let origin = origin.map(|kind| scope.add("?from", &words.kinds[kind]));
        let target = to.frame.as_ref().map(|kind| scope.add("", kind));
        let mut place = |state: usize, name: &str| {
            let (kind, _) = words.states[state].places.as_ref()?;
            Some(scope.add(name, kind))
        };
        let left = if let [one] = from[..] { place(one, "?from_place") } else { None };
        let place = place(operator.to, "?place");
        let shown = format!("{}: shown {}", operator.name, times(operator.instances));
        let (parameters, comments) = (scope.variables.clone(), vec![shown]);
        let action = Action { name, parameters, comments, ..Action::default() };
        let mut part = Part { scope, operator: o, from, object, origin, target, place, action };
        self.leave(&mut part, left);
        self.enter(&mut part, operator.to);
        self.in_order(&mut part, operator);
        let resting = self.not_resting(&mut part)?;
        part.action.require(resting);
        for (n, need) in operator.needs.iter().enumerate() {
            let counts = !self.dropped.contains(&(o, n));
            if need.verdict == NeedVerdict::Undecided {
                let what = if counts { "taken as a condition" } else { "left out" };
                let (need_in_words, held) = (domain.need_in_words(operator, need), need.held);
                let evidence = format!("held {held} of {}", need.of);
                part.action
                    .comments
                    .push(format!("undecided, {what}: {need_in_words} ({evidence})"));
            }
            match counts.then(|| self.need(&mut part, need)).transpose()? {
                Some(never) if never == FALSE => return Ok(None),
                Some(condition) => part.action.require(condition),
                None => {}
            }
        }
        self.side_effects(&mut part)?;
        let (who, place) = (Who::One(part.object.clone()), part.place.clone());
        let at = [part.target.clone(), place];
        part.change(&who, operator.to, at, true, |_, _, _| TRUE);
        let begun: Vec<_> = part.action.effects.iter().filter(|e| e.positive).cloned().collect();
        let mut seen = BTreeSet::new();
        // What an action makes false and true is true.
        part.action.effects.retain(|e| {
            (e.positive || begun.iter().all(|b| b.atom != e.atom)) && seen.insert(e.clone())
        });
        Ok(Some(part.action))
    }

    /// Adds that the object is in a state that it may leave, and that it leaves it.
    fn leave(&self, part: &mut Part<'_>, place: Option<Term>) {
        let (object, given) = (part.object.clone(), [part.origin.clone(), place]);
        let from = part.from.clone();
        let given_of = given.each_ref().map(Option::as_ref);
        let is_in = from.iter().map(|state| part.scope.is_in(*state, &object, given_of));
        let is_in: Vec<Condition> = is_in.collect();
        part.action.require(any(is_in));
        for state in from {
            part.change(&Who::One(object.clone()), state, given.clone(), false, |_, _, _| TRUE);
        }
    }

    /// Adds that the object does not stay at its reference, and that no other object is in its way.
    fn enter(&self, part: &mut Part<'_>, to: usize) {
        let (domain, words) = (self.problem.domain(), self.words);
        let places = domain.states[to].places.len();
        let (object, target, own) = (part.object.clone(), part.target.clone(), part.place.clone());
        let mut pairs: BTreeMap<usize, BTreeSet<(usize, usize)>> = BTreeMap::new();
        for place in 0..places {
            for (state, other) in self.problem.excluded_by(to, place) {
                pairs.entry(state).or_default().insert((place, other));
            }
        }
        if let Some(target) =
            target.as_ref().filter(|t| part.scope.kind(t) == part.scope.kind(&object))
        {
            part.action.require(not(same(&object, target)));
        }
        // That no object at all is at the only place says as well that this one is not.
        if part.from.contains(&to) && (places > 1 || !pairs.contains_key(&to)) {
            let leaves = match part.leaves_target() {
                Some(leaves) if part.from == [to] => leaves,
                _ => not(part.scope.is_in(to, &object, [target.as_ref(), None])),
            };
            part.action.require(leaves);
        }
        for (state, pairs) in pairs {
            // The object itself is in its own way nowhere. In its new state at this reference it does not move.
            let like = part.from.contains(&state) && state != to;
            let mut free = |at: Vec<Option<Term>>| {
                let found =
                    part.scope.quantified(true, &[&words.states[state].kind], |scope, x| {
                        let other = if like { not(same(&x[0], &object)) } else { TRUE };
                        let at = at.iter().map(|place| {
                            scope.is_in(state, &x[0], [target.as_ref(), place.as_ref()])
                        });
                        let at: Vec<Condition> = at.collect();
                        all([other, any(at)])
                    });
                not(found)
            };
            let condition = if pairs.len() == places * domain.states[state].places.len() {
                free(vec![None])
            } else if state == to && pairs.len() == places && pairs.iter().all(|(p, q)| p == q) {
                free(vec![own.clone()])
            } else {
                let of_place = |place: usize| {
                    let others = pairs.range((place, 0)..=(place, usize::MAX));
                    let others: Vec<_> = others.map(|(_, q)| words.place(state, *q)).collect();
                    let own = own.as_ref().zip(words.place(to, place));
                    let elsewhere = own.map_or(FALSE, |(own, place)| not(same(own, &place)));
                    if others.is_empty() { TRUE } else { any([elsewhere, free(others)]) }
                };
                all((0..places).map(of_place).collect::<Vec<_>>())
            };
            part.action.require(condition);
        }
    }

    /// Adds that the places that are filled before that of the object are.
    fn in_order(&self, part: &mut Part<'_>, operator: &RelationalOperator) {
        let words = self.words;
        let (target, own) = (part.target.clone(), part.place.clone());
        let (object, kind) = (part.object.clone(), &words.states[operator.to].kind);
        for before in &operator.order {
            let there = own.as_ref().zip(words.place(operator.to, before.place));
            let elsewhere = there.map_or(FALSE, |(own, place)| not(same(own, &place)));
            let filled = before.one_of.iter().map(|(state, place)| {
                let place = words.place(*state, *place);
                let other = &words.states[*state].kind;
                part.scope.quantified(true, &[other], |scope, x| {
                    let is_in = scope.is_in(*state, &x[0], [target.as_ref(), place.as_ref()]);
                    // The object that moves does not count.
                    let apart = if other == kind { not(same(&object, &x[0])) } else { TRUE };
                    all([is_in, apart])
                })
            });
            let filled: Vec<Condition> = filled.collect();
            part.action.require(any([elsewhere, any(filled)]));
        }
    }
}

/// Returns `once` or `N times`.
fn times(count: usize) -> String {
    if count == 1 { "once".into() } else { format!("{count} times") }
}
