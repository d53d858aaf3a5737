//! Grounded problems as PDDL, with facts and actions without arguments.

use super::{Names, Written};
use crate::task::strips::{
    Action, Atom, Domain, Fact, Fluent, Grounded, Literal, Predicate, Problem, Types,
};

/// Writes a grounded problem. A fluent that says that a fact does not hold becomes a negative condition.
///
/// Costs O(size of the problem).
pub fn of_grounded(problem: &Grounded, name: &str) -> Written {
    let mut names = Names::new();
    let own = names.fresh(name);
    let fact = |fluent: &Fluent| {
        let mut words = vec![fluent.fact.predicate.clone()];
        words.extend(fluent.fact.arguments.iter().cloned());
        words.join(" ")
    };
    let facts: Vec<(String, bool)> =
        problem.fluents.iter().map(|f| (names.of(&fact(f)), f.holds)).collect();
    let literal = |at: &usize, positive: bool| Literal {
        positive,
        atom: Atom { predicate: facts[*at].0.clone(), arguments: Vec::new() },
    };
    let mut calls = Names::new();
    let actions = problem.operators.iter().map(|operator| {
        let needs = operator.preconditions.iter().map(|f| literal(f, facts[*f].1));
        // A fluent that says that a fact does not hold changes with the fact.
        let states = |list: &[usize], positive: bool| {
            let states = list.iter().filter(|f| facts[**f].1);
            states.map(|f| literal(f, positive)).collect::<Vec<_>>()
        };
        let mut effects = states(&operator.deletes, false);
        effects.extend(states(&operator.adds, true));
        Action {
            name: calls.of(operator.name.trim_matches(['(', ')'])),
            parameters: Vec::new(),
            preconditions: needs.collect(),
            effects,
        }
    });
    let actions: Vec<Action> = actions.collect();
    let mut predicates: Vec<String> = facts.iter().map(|(name, _)| name.clone()).collect();
    predicates.sort_unstable();
    predicates.dedup();
    let plain = |at: &usize| Fact { predicate: facts[*at].0.clone(), arguments: Vec::new() };
    let holding = problem.start.iter().filter(|f| facts[**f].1);
    let written = Problem {
        name: format!("{own}-problem"),
        domain: own.clone(),
        objects: Vec::new(),
        init: holding.map(plain).collect(),
        goal: problem.goal.iter().map(|f| (facts[*f].1, plain(f))).collect(),
    };
    let domain = Domain {
        name: own,
        requirements: [":strips", ":negative-preconditions"].map(str::to_owned).into(),
        types: Types::default(),
        constants: Vec::new(),
        predicates: predicates
            .into_iter()
            .map(|name| Predicate { name, parameters: Vec::new() })
            .collect(),
        actions,
    };
    let mut renamed = names.renamed();
    renamed.extend(calls.renamed());
    Written { domain, problem: written, moves: Vec::new(), renamed, notes: Vec::new() }
}
