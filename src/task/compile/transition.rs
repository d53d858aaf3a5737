//! Which moves are allowed in a situation, and the situations that they lead to.

use std::collections::BTreeSet;

use super::facts::Test;
use super::moves::Move;
use super::problem::Problem;
use crate::task::domain::{
    Condition, Counted, Fact, Need, NeedVerdict, Parameters, Role, Situation, Subject,
};

impl Problem<'_> {
    /// Returns every move that the operators allow in `situation`, whether its undecided needs are met or not.
    pub fn moves(&self, situation: &Situation) -> Vec<Move> {
        let mut moves = Vec::new();
        for (o, operator) in self.domain.operators.iter().enumerate() {
            for object in self.of_kind(&self.domain.states[operator.to].kind) {
                let Some(now) = situation[object] else { continue };
                if !operator.from.contains(&now.state) {
                    continue;
                }
                for (reference, place) in self.targets(o, Some(object)) {
                    let stays = now.state == operator.to && now.reference == reference;
                    let below = reference.is_some_and(|r| self.rests_on(r, object, situation));
                    let m = Move { operator: o, object, reference, place };
                    let mut hard =
                        operator.needs.iter().filter(|n| n.verdict != NeedVerdict::Undecided);
                    let allowed = !stays
                        && !below
                        && self.place_is_free(&m, situation)
                        && self.in_order(&m, situation)
                        && hard.all(|n| self.met(&m, n, situation));
                    if allowed {
                        moves.push(m);
                    }
                }
            }
        }
        moves
    }

    /// Returns whether all undecided needs of a move are met.
    pub fn decided(&self, m: &Move, situation: &Situation) -> bool {
        let needs = self.domain.operators[m.operator].needs.iter();
        needs.filter(|n| n.verdict == NeedVerdict::Undecided).all(|n| self.met(m, n, situation))
    }

    /// Returns whether the undecided needs that are in force are met.
    pub(super) fn permitted(&self, m: &Move, situation: &Situation) -> bool {
        self.unmet(m, situation, &self.in_force).next().is_none()
    }

    /// Returns those of some undecided needs that a move leaves unmet, as pairs of operator and need.
    pub(crate) fn unmet<'n>(
        &'n self,
        m: &'n Move,
        situation: &'n Situation,
        needs: &'n BTreeSet<(usize, usize)>,
    ) -> impl Iterator<Item = (usize, usize)> + 'n {
        let own = needs.range((m.operator, 0)..=(m.operator, usize::MAX)).copied();
        own.filter(move |(o, n)| !self.met(m, &self.domain.operators[*o].needs[*n], situation))
    }

    /// Returns a move's needs that are not met, in words for tables: the state's name, and whose state it is.
    pub fn open_needs(&self, m: &Move, situation: &Situation) -> Vec<String> {
        let operator = &self.domain.operators[m.operator];
        let open = operator.needs.iter().filter(|n| !self.met(m, n, situation));
        open.map(|n| self.domain.need_in_words(operator, n)).collect()
    }

    /// Returns whether a need of a move is met.
    pub(super) fn met(&self, m: &Move, need: &Need, situation: &Situation) -> bool {
        let counted = need.counted(&m.parameters(situation[m.object].as_ref()));
        let count = counted.as_ref().map_or(0, |c| c.holders(situation).count());
        if !need.is_positive() {
            return count == 0;
        }
        // The origin can be missing where the object left another state.
        let lacking = need.verdict == NeedVerdict::Required && counted.is_none();
        lacking || counted.is_some_and(|c| count >= self.least(need, &c, None))
    }

    /// Returns the least number of objects that a need of an action asks for in this scene. If the action moves any
    /// object of a kind, `any` is this kind: the one that moves does not count.
    pub(super) fn least(&self, need: &Need, counted: &Counted<'_>, any: Option<&str>) -> usize {
        let kinds: BTreeSet<&str> =
            counted.states().map(|state| &*self.domain.states[state].kind).collect();
        let objects = self.objects.iter().enumerate();
        let counts = objects.filter(|(i, object)| {
            kinds.contains(&*object.kind)
                && counted.object.is_none_or(|one| one == *i)
                && !counted.except.contains(&Some(*i))
        });
        let moved = usize::from(any.is_some_and(|kind| kinds.contains(kind)));
        need.least_of(counts.count().saturating_sub(moved))
    }

    /// Returns whether no other object is at a place that the move needs.
    pub(super) fn place_is_free(&self, m: &Move, situation: &Situation) -> bool {
        let to = self.domain.operators[m.operator].to;
        let wanted = (to, m.place);
        situation.iter().enumerate().all(|(i, fact)| {
            i == m.object
                || !fact.is_some_and(|f| {
                    f.reference == m.reference
                        && self.conflicts.contains(&(wanted, (f.state, f.place)))
                })
        })
    }

    /// Returns whether the places that are filled before that of a move are.
    fn in_order(&self, m: &Move, situation: &Situation) -> bool {
        let own = (m.operator, m.place, m.reference, Some(m.object));
        self.before(own).all(|test| test.holds(situation))
    }

    /// Returns what has to hold before an operator puts an object at a place of a reference, by the order of the places. `own` is
    /// the operator with the place, the reference and the object, which does not count.
    pub(super) fn before(
        &self,
        own: (usize, usize, Option<usize>, Option<usize>),
    ) -> impl Iterator<Item = Test> + '_ {
        let (operator, place, reference, object) = own;
        let order = self.domain.operators[operator].order.iter();
        order.filter(move |before| before.place == place).map(move |before| Test {
            of: before.one_of.iter().map(|(state, place)| (*state, Some(*place))).collect(),
            reference: Some(reference),
            except: object.into_iter().collect(),
            ..Test::of([])
        })
    }

    /// Returns whether `object` rests on `base`, directly or by way of other objects.
    pub(super) fn rests_on(&self, object: usize, base: usize, situation: &Situation) -> bool {
        let mut at = object;
        for _ in 0..situation.len() {
            match situation[at].and_then(|f| f.reference) {
                Some(reference) if reference == base => return true,
                Some(reference) => at = reference,
                None => return false,
            }
        }
        false
    }

    /// Returns the situation after a move.
    pub fn after(&self, m: &Move, situation: &Situation) -> Situation {
        let operator = &self.domain.operators[m.operator];
        let parameters = m.parameters(situation[m.object].as_ref());
        let mut next = situation.clone();
        let (begins, ends): (Vec<_>, Vec<_>) = operator.side_effects.iter().partition(|e| e.begins);
        for effect in &ends {
            for i in effect.condition.counted(&parameters).iter().flat_map(|c| c.holders(situation))
            {
                next[i] = None;
            }
        }
        for effect in begins {
            let counted = effect.condition.counted(&parameters);
            if counted.is_some_and(|c| c.holders(situation).next().is_some()) {
                continue;
            }
            let all = self.changeable(&effect.condition, &parameters);
            let left = |i: &&usize| {
                let fact = situation[**i];
                fact.is_some_and(|f| ends.iter().any(|e| e.condition.state == f.state))
            };
            if let Some(i) = all.iter().find(left).or(all.first()) {
                let old = situation[*i].as_ref();
                next[*i] = Some(self.begun(&effect.condition, &parameters, old));
            }
        }
        next[m.object] = Some(m.result(operator));
        next
    }

    /// Returns the objects whose state an action can change so that a condition begins to hold.
    fn changeable(&self, condition: &Condition, action: &Parameters) -> Vec<usize> {
        match condition.subject {
            Subject::Is(role) => action.get(role).into_iter().collect(),
            Subject::At(_) | Subject::Any => {
                let kind = &self.domain.states[condition.state].kind;
                self.of_kind(kind).filter(|i| Some(*i) != action.object).collect()
            }
        }
    }

    /// Returns the reference at which an action lets a condition begin if the action says so: that of the condition, or the target to which
    /// what the object was taken from comes along, as a part on a spatula does.
    pub(super) fn comes_to(&self, condition: &Condition, action: &Parameters) -> Option<usize> {
        match condition.subject {
            Subject::At(role) => action.get(role),
            Subject::Is(Role::Origin) => {
                let kind = self.domain.states[condition.state].frame.kind();
                action.target.filter(|to| kind.is_some_and(|kind| *self.objects[*to].kind == *kind))
            }
            Subject::Is(_) | Subject::Any => None,
        }
    }

    /// Returns the fact of an object for which an action lets a condition begin. Its reference is that of the action, or
    /// its old one if that has the right kind, or the first of this kind.
    fn begun(&self, condition: &Condition, action: &Parameters, old: Option<&Fact>) -> Fact {
        let other = || {
            let kind = self.domain.states[condition.state].frame.kind()?;
            let old = old.and_then(|fact| fact.reference);
            let kept = old.filter(|r| *self.objects[*r].kind == *kind);
            kept.or_else(|| self.of_kind(kind).next())
        };
        let reference = self.comes_to(condition, action).or_else(|| match condition.subject {
            Subject::At(_) => None,
            Subject::Is(_) | Subject::Any => other(),
        });
        Fact { state: condition.state, place: 0, reference }
    }
}
