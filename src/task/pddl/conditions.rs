//! Conditions on the states of objects, as formulas with quantifiers.

use super::WriteFault;
use super::vocabulary::{Vocabulary, typed};
use crate::plan::strips::{
    Condition, FALSE, Term, Typed, all, any, not, quantified, same, variable,
};

/// How many objects, or which, a condition asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Least {
    /// This number, or all if there are fewer. What is written fits every scene.
    Capped(usize),
    /// This number, and all objects of the scene are counted.
    Here(usize),
    /// All, however many there are.
    Every,
}

/// Greatest number of objects that one quantifier chooses.
const MOST_CHOSEN: usize = 32;
/// Greatest number of quantifiers of one condition that counts objects of several types.
const MOST_MIXED: usize = 256;

/// Says of a term whether it counts at all, and whether it passes. The last argument says whether one that passes is looked
/// for, or all that count are judged.
pub(super) type Test<'t> = dyn FnMut(&mut Scope<'_>, &Term, bool) -> (Condition, Condition) + 't;

/// The variables that a condition may name: parameters, and quantified variables behind them.
pub(super) struct Scope<'v> {
    pub words: &'v Vocabulary,
    pub variables: Vec<Typed>,
}

impl<'v> Scope<'v> {
    /// Adds a variable of a type, under a name if that is free.
    pub fn add(&mut self, name: &str, kind: &str) -> Term {
        let free = !name.is_empty() && self.variables.iter().all(|v| v.name != name);
        let of_place =
            self.words.states.iter().any(|s| s.places.as_ref().is_some_and(|p| p.0 == kind));
        let name = match free {
            true => name.to_owned(),
            false => variable(if of_place { "place" } else { kind }, &self.variables),
        };
        self.variables.push(typed(name, kind));
        Term::Parameter(self.variables.len() - 1)
    }

    /// Returns the type of a variable; `None` for a constant.
    pub fn kind(&self, term: &Term) -> Option<&str> {
        match term {
            Term::Parameter(at) => Some(&self.variables[*at].types[0]),
            Term::Constant(_) => None,
        }
    }

    /// Returns a condition that holds for some objects of types, or for all.
    pub fn quantified(
        &mut self,
        exists: bool,
        kinds: &[&str],
        inner: impl FnOnce(&mut Self, &[Term]) -> Condition,
    ) -> Condition {
        let depth = self.variables.len();
        let terms: Vec<Term> = kinds.iter().map(|kind| self.add("", kind)).collect();
        let inner = inner(self, &terms);
        quantified(exists, self.variables.split_off(depth), inner)
    }

    /// Returns whether an object of a term's type can be in a state, and with a term as its reference.
    pub fn fits(&self, state: usize, object: &Term, reference: Option<&Term>) -> bool {
        let named = &self.words.states[state];
        self.kind(object) == Some(&named.kind)
            && reference.is_none_or(|r| self.kind(r) == named.frame.as_deref())
    }

    /// Returns the condition that an object is in a state, with a reference and at a place or with any.
    pub fn is_in(&mut self, state: usize, object: &Term, given: [Option<&Term>; 2]) -> Condition {
        if !self.fits(state, object, given[0]) {
            return FALSE;
        }
        let words = self.words;
        self.quantified(true, &words.open(state, given), |_, open| {
            Condition::Literal(words.atom(state, object, given, open))
        })
    }

    /// Returns the condition that at least so many objects pass a test. `groups` has the types of the objects, with how many
    /// of each are in the scene and count.
    pub fn at_least(
        &mut self,
        least: Least,
        groups: &[(&str, usize)],
        test: &mut Test<'_>,
    ) -> Result<Condition, WriteFault> {
        let present: usize = groups.iter().map(|(_, present)| present).sum();
        Ok(match least {
            Least::Every => self.choices(false, 1, groups, test)?,
            Least::Capped(0 | 1) | Least::Here(0 | 1) => self.choices(true, 1, groups, test)?,
            Least::Capped(least) => {
                let enough = self.choices(true, least, groups, test)?;
                let one = self.choices(true, 1, groups, test)?;
                any([enough, all([one, self.choices(false, 1, groups, test)?])])
            }
            Least::Here(_) if present == 0 => FALSE,
            Least::Here(least) => match present - least.min(present) + 1 {
                // Fewer than this number do not pass.
                others if others < least => self.choices(false, others, groups, test)?,
                _ => self.choices(true, least, groups, test)?,
            },
        })
    }

    /// Returns the condition that some choice of so many different objects passes a test, or that each choice has one that
    /// does.
    fn choices(
        &mut self,
        exists: bool,
        count: usize,
        groups: &[(&str, usize)],
        test: &mut Test<'_>,
    ) -> Result<Condition, WriteFault> {
        let mut kinds: Vec<Vec<&str>> = vec![Vec::new()];
        for _ in 0..count.min(MOST_CHOSEN) {
            let longer = kinds.iter().flat_map(|chosen| {
                let from = groups.iter().position(|(kind, _)| chosen.last() == Some(kind));
                let rest = &groups[from.unwrap_or(0)..];
                rest.iter().map(|(kind, _)| [chosen.as_slice(), &[*kind]].concat())
            });
            kinds = longer.take(MOST_MIXED + 1).collect();
        }
        if count > MOST_CHOSEN || kinds.len() > MOST_MIXED {
            return Err(WriteFault::TooLarge { count });
        }
        let parts: Vec<Condition> = kinds
            .iter()
            .map(|kinds| {
                self.quantified(exists, kinds, |scope, terms| {
                    let mut parts = Vec::new();
                    for (at, term) in terms.iter().enumerate() {
                        let like = |t: &&Term| scope.kind(t) == scope.kind(term);
                        let others = terms[..at].iter().filter(like);
                        parts.extend(others.map(|other| not(same(other, term))));
                    }
                    let mut passes = Vec::new();
                    for term in terms {
                        let (counts, pass) = test(scope, term, exists);
                        parts.push(counts);
                        passes.push(pass);
                    }
                    match exists {
                        true => all(parts.into_iter().chain(passes)),
                        false => any(parts.into_iter().map(negated).chain(passes)),
                    }
                })
            })
            .collect();
        Ok(if exists { any(parts) } else { all(parts) })
    }
}

/// Returns the opposite of a conjunction of literals as a disjunction.
fn negated(condition: Condition) -> Condition {
    match condition {
        Condition::All(parts) => any(parts.into_iter().map(not)),
        other => not(other),
    }
}
