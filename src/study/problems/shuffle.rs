//! The same problem with other names and orders.

use std::collections::BTreeMap;

use rand::Rng;
use rand::seq::SliceRandom;

use super::PlanningProblem;
use crate::plan::strips::{Atom, EQUAL, Fact, Term};
use crate::task::TaskError;

/// New names for old ones.
struct Names(BTreeMap<String, String>);

impl Names {
    /// Draws names that begin with a letter. Their order in the alphabet is random.
    fn draw(old: impl Iterator<Item = String>, letter: char, rng: &mut impl Rng) -> Self {
        let old: Vec<String> = old.collect();
        let mut numbers: Vec<usize> = (0..old.len()).collect();
        numbers.shuffle(rng);
        let width = old.len().to_string().len();
        let new = numbers.into_iter().map(|n| format!("{letter}{n:0width$}"));
        Self(old.into_iter().zip(new).collect())
    }

    fn change(&self, name: &mut String) {
        if let Some(new) = self.0.get(name) {
            name.clone_from(new);
        }
    }
}

impl PlanningProblem {
    /// Returns the same problem with random names of predicates, actions and objects, and with predicates, actions,
    /// preconditions, effects, objects, initial facts and goals in random order. The order of its fluents and operators, and
    /// thus of all units of a planner, is random as well.
    ///
    /// # Errors
    /// As [`new`](Self::new), which does not fail for a problem that was grounded already.
    pub fn shuffled(&self, rng: &mut impl Rng) -> Result<Self, TaskError> {
        let (mut domain, mut problem) = (self.domain.clone(), self.problem.clone());
        let declared = domain.predicates.iter().map(|p| p.name.clone());
        let predicates = Names::draw(declared.filter(|name| name != EQUAL), 'p', rng);
        let actions = Names::draw(domain.actions.iter().map(|a| a.name.clone()), 'a', rng);
        let objects = problem.all_objects(&domain).into_iter().map(|o| o.name.clone());
        let objects = Names::draw(objects, 'o', rng);
        let atom = |atom: &mut Atom| {
            predicates.change(&mut atom.predicate);
            for term in &mut atom.arguments {
                if let Term::Constant(name) = term {
                    objects.change(name);
                }
            }
        };
        let fact = |fact: &mut Fact| {
            predicates.change(&mut fact.predicate);
            fact.arguments.iter_mut().for_each(|name| objects.change(name));
        };
        domain.predicates.iter_mut().for_each(|p| predicates.change(&mut p.name));
        for rule in &mut domain.derived {
            predicates.change(&mut rule.predicate);
            rule.condition.literals_mut(&mut |literal| atom(&mut literal.atom));
        }
        domain.constants.iter_mut().for_each(|o| objects.change(&mut o.name));
        for action in &mut domain.actions {
            actions.change(&mut action.name);
            action.preconditions.iter_mut().for_each(|literal| atom(&mut literal.atom));
            action.effects.iter_mut().for_each(|literal| atom(&mut literal.atom));
            for condition in &mut action.conditions {
                condition.literals_mut(&mut |literal| atom(&mut literal.atom));
            }
            for effect in &mut action.conditional {
                effect.condition.literals_mut(&mut |literal| atom(&mut literal.atom));
                effect.effects.iter_mut().for_each(|literal| atom(&mut literal.atom));
            }
            action.preconditions.shuffle(rng);
            action.effects.shuffle(rng);
        }
        domain.predicates.shuffle(rng);
        domain.actions.shuffle(rng);
        problem.objects.iter_mut().for_each(|o| objects.change(&mut o.name));
        problem.init.iter_mut().for_each(fact);
        problem.goal.iter_mut().for_each(|(_, goal)| fact(goal));
        for condition in &mut problem.conditions {
            condition.literals_mut(&mut |literal| atom(&mut literal.atom));
        }
        problem.objects.shuffle(rng);
        problem.init.shuffle(rng);
        problem.goal.shuffle(rng);
        Self::new(domain, problem)
    }
}
