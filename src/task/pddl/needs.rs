//! What an operator needs of other objects, and what its target must not rest on.

use std::collections::BTreeSet;

use super::WriteFault;
use super::actions::{Part, Writer};
use super::conditions::{Least, Scope};
use crate::plan::strips::{Condition, FALSE, TRUE, Term, all, any, not, same};
use crate::task::domain::{Need, NeedVerdict, Role, Subject};

/// Greatest number up to which a condition that counts is written for every scene.
const CAPPED: usize = 3;
/// Greatest number of objects that may rest on each other in a chain, where kinds rest on each other in a circle.
const MOST_CHAINED: usize = 12;

impl Part<'_> {
    /// Returns whether a condition is about the origin, and the action has none.
    pub fn lacks(&self, subject: Subject) -> bool {
        matches!(subject, Subject::Is(role) | Subject::At(role) if self.role(role).is_none())
    }

    /// Returns the condition that there is an origin beside the target for what is about the origin; `None` if there always is.
    pub fn has_origin(&self, subject: Subject) -> Option<Condition> {
        let about = matches!(subject, Subject::Is(Role::Origin) | Subject::At(Role::Origin));
        self.leaves_target().filter(|_| about)
    }
}

impl Writer<'_, '_> {
    /// Returns the condition of a need.
    pub fn need(&self, part: &mut Part<'_>, need: &Need) -> Result<Condition, WriteFault> {
        let (subject, positive) = (need.condition.subject, need.is_positive());
        let without_origin = !positive || need.verdict == NeedVerdict::Required;
        if part.lacks(subject) {
            return Ok(if without_origin { TRUE } else { FALSE });
        }
        let states: Vec<usize> = need.states().collect();
        let condition = match subject {
            Subject::Is(role) => self.of_role(part, need, role),
            Subject::At(_) | Subject::Any => self.counted(part, need, &states)?,
        };
        let condition = if positive { condition } else { not(condition) };
        Ok(match part.has_origin(subject) {
            None => condition,
            Some(has) if without_origin => any([not(has), condition]),
            Some(has) => all([has, condition]),
        })
    }

    /// Returns the condition that a parameter is in one of the states of a need.
    fn of_role(&self, part: &mut Part<'_>, need: &Need, role: Role) -> Condition {
        let Some(term) = part.role(role) else { return FALSE };
        let states = need.states().filter(|state| part.scope.fits(*state, &term, None));
        let mut states: Vec<usize> = states.collect();
        if states.is_empty() && need.every && need.is_positive() {
            return TRUE;
        }
        if role == Role::Object {
            if part.from.iter().all(|state| states.contains(state)) {
                return TRUE;
            }
            states.retain(|state| part.from.contains(state));
        }
        let is_in = states.into_iter().map(|state| part.scope.is_in(state, &term, [None; 2]));
        any(is_in.collect::<Vec<_>>())
    }

    /// Returns the condition that enough other objects, or any, are in one of some states.
    fn counted(
        &self,
        part: &mut Part<'_>,
        need: &Need,
        states: &[usize],
    ) -> Result<Condition, WriteFault> {
        let (domain, words) = (self.problem.domain(), self.words);
        let (reference, except) = match need.condition.subject {
            Subject::At(role) => (part.role(role), vec![Role::Object]),
            _ => (None, vec![Role::Object, Role::Origin, Role::Target]),
        };
        let except: Vec<Term> = except.into_iter().filter_map(|role| part.role(role)).collect();
        let kinds: BTreeSet<&str> =
            states.iter().map(|state| &*domain.states[*state].kind).collect();
        let groups = kinds.iter().map(|kind| {
            let type_of = words.kinds[*kind].as_str();
            let own = except.iter().filter(|term| part.scope.kind(term) == Some(type_of));
            (type_of, self.present(kind).saturating_sub(own.count()))
        });
        let groups: Vec<(&str, usize)> = groups.collect();
        let present: usize = groups.iter().map(|(_, present)| present).sum();
        // If origin and target may be one object, it is not certain how many others there are.
        let certain = except.len() < 3 || part.leaves_target().is_none();
        let least = match need.least {
            _ if !need.is_positive() => Least::Capped(1),
            _ if need.every => Least::Every,
            least if least <= CAPPED || !certain => Least::Capped(least),
            least => {
                let what = domain.names(states).join(" or ");
                part.action.comments.push(format!("{what}: {present} objects of this scene count"));
                Least::Here(least.min(present).max(1))
            }
        };
        let (object, from) = (part.object.clone(), part.from.clone());
        part.scope.at_least(least, &groups, &mut |scope, x, exists| {
            // An object that leaves another state is in none of these.
            let moves = |scope: &Scope<'_>| {
                states.iter().any(|s| from.contains(s) && scope.fits(*s, x, None))
            };
            let aside = exists && !moves(scope);
            let like =
                |term: &&Term| scope.kind(term) == scope.kind(x) && !(aside && **term == object);
            let others: Vec<Condition> =
                except.iter().filter(like).map(|term| not(same(x, term))).collect();
            let given = [reference.as_ref(), None];
            let is_in = states.iter().map(|state| scope.is_in(*state, x, given));
            let is_in: Vec<Condition> = is_in.collect();
            (all(others), any(is_in))
        })
    }

    /// Returns how many objects of a kind the scene has.
    pub fn present(&self, kind: &str) -> usize {
        self.problem.objects().iter().filter(|object| *object.kind == *kind).count()
    }

    /// Returns the condition that the target does not rest on the object, directly or by way of others.
    pub fn not_resting(&self, part: &mut Part<'_>) -> Result<Condition, WriteFault> {
        let domain = self.problem.domain();
        let Some(target) = part.target.clone() else { return Ok(TRUE) };
        let kind = |state: usize| domain.states[state].kind.as_str();
        let on = |state: usize, kind: &str| domain.states[state].frame.kind() == Some(kind);
        let moved = kind(domain.operators[part.operator].to);
        // With the object as their reference, nothing is in these states.
        let absent: BTreeSet<usize> = (self.needs(part.operator))
            .filter(|n| !n.is_positive() && n.condition.subject == Subject::At(Role::Object))
            .flat_map(Need::states)
            .collect();
        let every = 0..domain.states.len();
        let direct = every.clone().filter(|s| on(*s, moved) && !absent.contains(s));
        let direct: Vec<usize> = direct.collect();
        // The kinds of objects that can rest on the object, and the states in which something is on one of them.
        let mut above: BTreeSet<&str> = direct.iter().map(|state| kind(*state)).collect();
        let indirect = loop {
            let on_one = every.clone().filter(|state| above.iter().any(|kind| on(*state, kind)));
            let indirect: Vec<usize> = on_one.collect();
            let before = above.len();
            above.extend(indirect.iter().map(|state| kind(*state)));
            if above.len() == before {
                break indirect;
            }
        };
        let mut open = above.clone();
        for _ in &above {
            let below = indirect.iter().filter(|state| open.contains(kind(**state)));
            open = below.filter_map(|state| domain.states[*state].frame.kind()).collect();
        }
        let depth = if open.is_empty() {
            above.len()
        } else {
            // Kinds rest on each other in a circle, as blocks do, so that a chain is as long as there are objects.
            let all = above.iter().map(|kind| self.present(kind)).sum::<usize>();
            let others = all.saturating_sub(usize::from(above.contains(moved)));
            if others > MOST_CHAINED {
                return Err(WriteFault::TooLarge { count: others });
            }
            part.action.comments.push(format!(
                "what the target rests on is followed through {others} objects of this scene"
            ));
            others
        };
        let object = part.object.clone();
        Ok(unsupported(&mut part.scope, &target, &object, [&direct, &indirect], depth))
    }
}

/// Returns the condition that one object does not rest on another in `direct` states, nor by way of a chain of others that are
/// on each other in `indirect` states.
fn unsupported(
    scope: &mut Scope<'_>,
    top: &Term,
    object: &Term,
    [direct, indirect]: [&[usize]; 2],
    depth: usize,
) -> Condition {
    let words = scope.words;
    let apart = direct.iter().map(|state| not(scope.is_in(*state, top, [Some(object), None])));
    let mut parts: Vec<Condition> = apart.collect();
    let own = |state: &&usize| Some(&*words.states[**state].kind) == scope.kind(top);
    let own: Vec<usize> = indirect.iter().filter(own).copied().collect();
    let bases: BTreeSet<&str> =
        own.iter().filter_map(|state| words.states[*state].frame.as_deref()).collect();
    for base in bases.into_iter().filter(|_| depth > 1) {
        let on = |scope: &mut Scope<'_>, reference: Option<&Term>| {
            let of_base = own.iter().filter(|s| words.states[**s].frame.as_deref() == Some(base));
            let is_in = of_base.map(|state| scope.is_in(*state, top, [reference, None]));
            any(is_in.collect::<Vec<_>>())
        };
        let mut free = TRUE;
        let on_free = scope.quantified(true, &[base], |scope, below| {
            free = unsupported(scope, &below[0], object, [direct, indirect], depth - 1);
            all([on(scope, Some(&below[0])), free.clone()])
        });
        if free != TRUE {
            parts.push(any([not(on(scope, None)), on_free]));
        }
    }
    all(parts)
}
