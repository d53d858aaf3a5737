//! Relational problems as PDDL.

use std::collections::BTreeSet;

use super::actions::Writer;
use super::conditions::{Least, Scope};
use super::vocabulary::{Vocabulary, typed};
use super::{WriteFault, Written};
use crate::plan::strips::{self, Condition, Domain, Fact, Names, TRUE, Term, all, any, quantified};
use crate::task::compile::Problem;
use crate::task::domain::{GoalTerm, Quantity, Situation};

/// Writes a relational problem with a situation and the problem's goal.
///
/// Needs in `dropped`, pairs of operator and need, do not count; take [`GroundProblem::dropped`](crate::task::compile::GroundProblem::dropped).
/// Objects of kinds that the domain does not know are left out.
///
/// Costs O(states x operators + objects), whatever the number of moves.
///
/// # Errors
/// [`WriteFault`] if a condition counts too many objects, or if it is not certain what an action changes.
///
/// # Panics
/// If `now` does not have one entry for each object of the problem.
pub fn of_relational(
    problem: &Problem<'_>,
    dropped: &[(usize, usize)],
    now: &Situation,
    name: &str,
) -> Result<Written, WriteFault> {
    let learned = problem.domain();
    let mut words = Vocabulary::new(learned);
    let dropped: BTreeSet<(usize, usize)> = dropped.iter().copied().collect();
    let writer = Writer { problem, words: &words, dropped: &dropped };
    let mut calls = Names::new();
    let mut actions = Vec::new();
    for o in 0..learned.operators.len() {
        for mut action in writer.actions(o)? {
            action.name = calls.fresh(&action.name);
            actions.push(action);
        }
    }
    let goals = problem.goals().iter().map(|goal| of_goal(&writer, goal));
    let goals = all(goals.collect::<Result<Vec<_>, _>>()?);
    let own = Names::new().fresh(name);
    let mut domain = Domain {
        name: own.clone(),
        types: words.types(),
        constants: words.constants(),
        predicates: words.predicates(),
        actions,
        comments: notes_of_domain(problem, &words),
        ..Domain::default()
    };
    domain.requirements = domain.used();
    let mut of_problem = strips::Problem {
        name: format!("{own}-problem"),
        domain: own,
        conditions: if let Condition::All(parts) = goals { parts } else { vec![goals] },
        ..strips::Problem::default()
    };
    of_problem.requirements = of_problem.used(&domain);
    let mut notes = vec!["Written by symbolt.".to_owned()];
    notes.extend(
        problem.goals().iter().map(|goal| format!("Goal: {}.", learned.goal_in_words(goal))),
    );
    let (objects, names) = (problem.objects(), object_names(problem, &mut words));
    for ((object, name), fact) in objects.iter().zip(&names).zip(now) {
        let Some(kind) = words.kinds.get(&*object.kind) else {
            let (id, kind) = (&object.id, &object.kind);
            notes.push(format!("{id} is left out: nothing is known of its kind, {kind}."));
            continue;
        };
        of_problem.objects.push(typed(name, kind));
        if object.id.to_ascii_lowercase() != *name {
            notes.push(format!("{name} stands for {}.", object.id));
        }
        if fact.is_none() && words.states.iter().any(|state| state.kind == *kind) {
            notes.push(format!("{name} is in no state."));
        }
    }
    of_problem.init.extend(facts(&words, &names, now));
    for (kind, predicate) in &words.firsts {
        let first = of_problem.objects.iter().find(|object| object.types[0] == *kind);
        let arguments: Vec<String> = first.iter().map(|object| object.name.clone()).collect();
        if !arguments.is_empty() {
            of_problem.init.push(Fact { predicate: predicate.clone(), arguments });
        }
    }
    of_problem.comments = notes;
    Ok(Written { domain, problem: of_problem })
}

/// Returns how [`of_relational`] writes the situations of a problem: the states of the objects.
pub(crate) fn facts_of(problem: &Problem<'_>) -> impl Fn(&Situation) -> Vec<Fact> + use<> {
    let mut words = Vocabulary::new(problem.domain());
    let names = object_names(problem, &mut words);
    move |now| facts(&words, &names, now).collect()
}

fn object_names(problem: &Problem<'_>, words: &mut Vocabulary) -> Vec<String> {
    problem.objects().iter().map(|object| words.names.fresh(&object.id)).collect()
}

fn facts<'a>(
    words: &'a Vocabulary,
    names: &'a [String],
    now: &'a Situation,
) -> impl Iterator<Item = Fact> + 'a {
    let all = now.iter().enumerate().filter_map(|(object, fact)| Some((object, (*fact)?)));
    all.map(|(object, fact)| words.fact(object, &fact, names))
}

/// Returns the condition of a term of the goal.
fn of_goal(writer: &Writer<'_, '_>, goal: &GoalTerm) -> Result<Condition, WriteFault> {
    let (domain, words) = (writer.problem.domain(), writer.words);
    let (state, named) = (goal.state, &words.states[goal.state]);
    let mut scope = Scope { words, variables: Vec::new() };
    let groups = [(named.kind.as_str(), writer.present(&domain.states[state].kind))];
    let enough = |scope: &mut Scope<'_>, least: Least, reference: Option<&Term>| {
        scope.at_least(least, &groups, &mut |scope, x, _| {
            let is_in = match (goal.reference, &named.frame) {
                (Some(within), Some(frame)) => scope.quantified(true, &[frame], |scope, r| {
                    let there = scope.is_in(state, x, [Some(&r[0]), None]);
                    all([there, scope.is_in(within, &r[0], [None; 2])])
                }),
                _ => any(goal.states().map(|state| scope.is_in(state, x, [reference, None]))),
            };
            (TRUE, is_in)
        })
    };
    match (goal.quantity.clone(), &named.frame) {
        (Quantity::AtLeast(0) | Quantity::EachReference(0), _) => Ok(TRUE),
        (Quantity::AtLeast(least), _) => {
            let present = groups[0].1;
            enough(&mut scope, Least::Here(least.min(present.max(1))), None)
        }
        (Quantity::EachObject, _) => enough(&mut scope, Least::Every, None),
        (Quantity::EachReference(_), None) => Ok(TRUE),
        (Quantity::EachReference(least), Some(frame)) => {
            let reference = scope.add("", frame);
            let each = enough(&mut scope, Least::Here(least), Some(&reference))?;
            Ok(quantified(false, scope.variables, each))
        }
    }
}

/// Returns the comments on a domain.
fn notes_of_domain(problem: &Problem<'_>, words: &Vocabulary) -> Vec<String> {
    let mut notes = vec![
        "Written by symbolt. A predicate says that an object is in a state, with its reference if it has one.".to_owned(),
    ];
    if problem.undecided().next().is_some() {
        let which = "Undecided conditions are those that always held, or never, and may be coincidences. Which are left out is judged by the scene.";
        notes.push(which.to_owned());
    }
    let renamed = words.renamed().into_iter();
    notes.extend(renamed.map(|(original, name)| format!("{name} stands for {original}.")));
    let firsts = words.firsts.iter();
    notes.extend(firsts.map(|(kind, name)| {
        format!(
            "({name} ?{kind}) holds for the first {kind} of the scene, to which goes what had none."
        )
    }));
    notes
}
