//! Grounded problems as PDDL, with facts and actions without arguments.

use std::collections::{BTreeMap, BTreeSet};

use super::{Names, Written};
use crate::plan::strips::{
    Action, Atom, Domain, Fact, Fluent, GroundOperator, Grounded, Literal, Predicate, Problem,
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
    let literal = |name: &str, positive: bool| Literal {
        positive,
        atom: Atom { predicate: name.to_owned(), arguments: Vec::new() },
    };
    // A fluent that says that a fact does not hold begins when the fact ends, whether or not another says that it holds.
    let effects = |operator: &GroundOperator| {
        let changed = |list: &[usize], begins: bool| {
            list.iter().map(|f| (facts[*f].0.clone(), facts[*f].1 == begins)).collect::<Vec<_>>()
        };
        let mut effects: BTreeMap<String, bool> = BTreeMap::new();
        effects.extend(changed(&operator.deletes, false));
        effects.extend(changed(&operator.adds, true));
        effects.into_iter().map(|(name, positive)| literal(&name, positive)).collect()
    };
    let mut calls = Names::new();
    let actions = problem.operators.iter().map(|operator| {
        let needs = operator.preconditions.iter().map(|f| literal(&facts[*f].0, facts[*f].1));
        Action {
            name: calls.of(operator.name.trim_matches(['(', ')'])),
            parameters: Vec::new(),
            preconditions: needs.collect(),
            effects: effects(operator),
            ..Action::default()
        }
    });
    let actions: Vec<Action> = actions.collect();
    let mut predicates: Vec<String> = facts.iter().map(|(name, _)| name.clone()).collect();
    predicates.sort_unstable();
    predicates.dedup();
    let plain = |name: &String| Fact { predicate: name.clone(), arguments: Vec::new() };
    let start: BTreeSet<usize> = problem.start.iter().copied().collect();
    let all = facts.iter().enumerate();
    let holding: BTreeSet<&String> = all
        .filter(|(f, (_, holds))| start.contains(f) == *holds)
        .map(|(_, (name, _))| name)
        .collect();
    let written = Problem {
        name: format!("{own}-problem"),
        domain: own.clone(),
        objects: Vec::new(),
        init: holding.into_iter().map(plain).collect(),
        goal: problem.goal.iter().map(|f| (facts[*f].1, plain(&facts[*f].0))).collect(),
        ..Problem::default()
    };
    let domain = Domain {
        name: own,
        requirements: [":strips", ":negative-preconditions"].map(str::to_owned).into(),
        predicates: predicates
            .into_iter()
            .map(|name| Predicate { name, ..Predicate::default() })
            .collect(),
        actions,
        ..Domain::default()
    };
    let mut renamed = names.renamed();
    renamed.extend(calls.renamed());
    Written { domain, problem: written, moves: Vec::new(), renamed, notes: Vec::new() }
}
