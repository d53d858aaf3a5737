//! Whether conditions hold in a state, by their meaning.
//!
//! Nothing here is compiled, so that it is a reference for what is.

use std::collections::{BTreeSet, HashMap};

use super::formula::{Condition, Number};
use super::pddl::{Action, Atom, Domain, EQUAL, Fact, Literal, Problem, Term, Typed};
use super::strata::Strata;

/// The objects of a problem, by which conditions are judged.
pub(super) struct World<'a> {
    pub domain: &'a Domain,
    pub objects: Vec<&'a Typed>,
    strata: Strata<'a>,
    numbers: HashMap<&'a Fact, Number>,
}

/// A state: the facts that hold, and what is known of derived facts.
pub(super) struct State {
    pub facts: BTreeSet<Fact>,
    derived: HashMap<Fact, bool>,
    /// Facts of a stratum that are being derived from each other.
    round: Option<Round>,
}

/// Facts of one stratum that need each other.
struct Round {
    stratum: usize,
    /// In the order in which they were asked for.
    asked: Vec<Fact>,
    /// Whether each was derived so far.
    found: HashMap<Fact, bool>,
}

impl Round {
    /// Returns whether a fact was derived so far. One that is new is asked for.
    fn found(&mut self, fact: Fact) -> bool {
        *self.found.entry(fact).or_insert_with_key(|fact| {
            self.asked.push(fact.clone());
            false
        })
    }
}

impl State {
    pub fn new(facts: BTreeSet<Fact>) -> Self {
        Self { facts, derived: HashMap::new(), round: None }
    }
}

impl<'a> World<'a> {
    pub fn new(domain: &'a Domain, problem: &'a Problem) -> Self {
        let numbers = problem.numbers.iter().map(|(function, value)| (function, *value));
        let objects = problem.all_objects(domain);
        Self { domain, objects, strata: Strata::new(&domain.derived), numbers: numbers.collect() }
    }

    /// Returns the fact of an atom whose parameters are `bound`.
    pub fn fact(atom: &Atom, bound: &[&str]) -> Fact {
        let word = |term: &Term| match term {
            Term::Parameter(position) => {
                bound.get(*position).copied().unwrap_or_default().to_owned()
            }
            Term::Constant(name) => name.clone(),
        };
        let arguments = atom.arguments.iter().map(word).collect();
        Fact { predicate: atom.predicate.clone(), arguments }
    }

    /// Returns whether a literal holds.
    pub fn literal<'s>(&'s self, literal: &Literal, bound: &[&'s str], state: &mut State) -> bool {
        let fact = Self::fact(&literal.atom, bound);
        let holds = match fact.predicate == EQUAL {
            true => fact.arguments.first() == fact.arguments.get(1),
            false => self.atom(fact, state),
        };
        holds == literal.positive
    }

    fn atom(&self, fact: Fact, state: &mut State) -> bool {
        let (name, arguments) = (&*fact.predicate, fact.arguments.len());
        if self.strata.stratum(name, arguments).is_none() {
            return state.facts.contains(&fact);
        }
        if let Some(known) = state.derived.get(&fact) {
            return *known;
        }
        if let Some(stratum) = self.strata.recursive(name, arguments) {
            return self.recursive(fact, stratum, state);
        }
        let holds = self.by_rules(&fact, state);
        state.derived.insert(fact, holds);
        holds
    }

    /// Derives a fact that may need itself, with all that it needs of its stratum, until nothing new is found. What was asked for
    /// last is looked at first: it is what the others need.
    fn recursive(&self, fact: Fact, stratum: usize, state: &mut State) -> bool {
        if let Some(round) = state.round.as_mut().filter(|round| round.stratum == stratum) {
            return round.found(fact);
        }
        let mut own = Round { stratum, asked: Vec::new(), found: HashMap::new() };
        own.found(fact.clone());
        let around = state.round.replace(own);
        let (mut looked_at, mut news) = (0, true);
        while std::mem::take(&mut news) {
            while let Some(next) =
                state.round.as_ref().and_then(|r| r.asked.get(looked_at)).cloned()
            {
                looked_at += 1;
                news |= self.finds(next, state);
            }
            for at in (0..looked_at).rev() {
                let next = state.round.as_ref().and_then(|round| round.asked.get(at)).cloned();
                news |= next.is_some_and(|next| self.finds(next, state));
            }
            news |= state.round.as_ref().is_some_and(|round| round.asked.len() > looked_at);
        }
        let round = std::mem::replace(&mut state.round, around);
        state.derived.extend(round.into_iter().flat_map(|round| round.found));
        state.derived.get(&fact).copied().unwrap_or_default()
    }

    /// Returns whether a fact of the present stratum is derived that was not before.
    fn finds(&self, fact: Fact, state: &mut State) -> bool {
        let known = state.round.as_ref().and_then(|round| round.found.get(&fact)) == Some(&true);
        let fresh = !known && self.by_rules(&fact, state);
        if fresh && let Some(round) = &mut state.round {
            round.found.insert(fact, true);
        }
        fresh
    }

    /// Returns whether some rule derives a fact.
    fn by_rules(&self, fact: &Fact, state: &mut State) -> bool {
        let bound: Vec<&str> = fact.arguments.iter().map(String::as_str).collect();
        let known = |name: &str| self.objects.iter().find(|o| o.name == name);
        let of_types = |parameters: &[Typed]| {
            parameters.iter().zip(&bound).all(|(parameter, name)| {
                known(name).is_some_and(|o| self.domain.types.may_be(&o.types, &parameter.types))
            })
        };
        let own = |d: &&super::Derived| {
            d.predicate == fact.predicate && d.parameters.len() == fact.arguments.len()
        };
        let mut rules = self.domain.derived.iter().filter(own);
        rules.any(|rule| {
            of_types(&rule.parameters) && self.holds(&rule.condition, &mut bound.clone(), state)
        })
    }

    /// Returns whether a condition holds. `bound` has the objects of the parameters and of the quantifiers around it.
    pub fn holds<'s>(
        &'s self,
        condition: &Condition,
        bound: &mut Vec<&'s str>,
        state: &mut State,
    ) -> bool {
        match condition {
            Condition::Literal(literal) => self.literal(literal, bound, state),
            Condition::Compare(comparison, left, right) => {
                let value = |atom: &Atom| self.numbers.get(&Self::fact(atom, bound)).copied();
                let sides = left.value(&value).zip(right.value(&value));
                sides.is_some_and(|(left, right)| comparison.holds(left, right))
            }
            Condition::Not(inner) => !self.holds(inner, bound, state),
            Condition::All(parts) => parts.iter().all(|part| self.holds(part, bound, state)),
            Condition::Any(parts) => parts.iter().any(|part| self.holds(part, bound, state)),
            Condition::Exists(variables, inner) => {
                let mut any = false;
                self.each(variables, bound, &mut |bound| {
                    any = any || self.holds(inner, bound, state);
                    !any
                });
                any
            }
            Condition::Forall(variables, inner) => {
                let mut all = true;
                self.each(variables, bound, &mut |bound| {
                    all = all && self.holds(inner, bound, state);
                    all
                });
                all
            }
        }
    }

    /// Calls `visit` with each choice of objects for variables, while it returns `true`.
    fn each<'s>(
        &'s self,
        variables: &[Typed],
        bound: &mut Vec<&'s str>,
        visit: &mut impl FnMut(&mut Vec<&'s str>) -> bool,
    ) -> bool {
        let Some((first, rest)) = variables.split_first() else { return visit(bound) };
        for object in &self.objects {
            if !self.domain.types.may_be(&object.types, &first.types) {
                continue;
            }
            bound.push(&object.name);
            let go_on = self.each(rest, bound, visit);
            bound.pop();
            if !go_on {
                return false;
            }
        }
        true
    }

    /// Carries an action out with the objects of its parameters. Whether its conditions hold is not looked at.
    pub fn apply<'s>(&'s self, action: &Action, objects: &[&'s str], state: &mut State) {
        let mut changes: Vec<(bool, Fact)> = Vec::new();
        for effect in &action.effects {
            changes.push((effect.positive, Self::fact(&effect.atom, objects)));
        }
        for effect in &action.conditional {
            self.each(&effect.variables, &mut objects.to_vec(), &mut |bound| {
                if self.holds(&effect.condition, bound, state) {
                    let effects = effect.effects.iter();
                    changes.extend(effects.map(|e| (e.positive, Self::fact(&e.atom, bound))));
                }
                true
            });
        }
        for (_, fact) in changes.iter().filter(|(positive, _)| !positive) {
            state.facts.remove(fact);
        }
        state.facts.extend(changes.into_iter().filter(|(positive, _)| *positive).map(|(_, f)| f));
        state.derived.clear();
    }
}
