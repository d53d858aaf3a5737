//! Relational problems as PDDL.

use std::collections::BTreeSet;

use super::actions::Writer;
use super::conditions::{Least, Scope, all, any};
use super::names::Names;
use super::vocabulary::{Vocabulary, typed};
use super::{WriteFault, Written};
use crate::plan::strips::{self, Condition, Domain, EQUAL, Fact, Literal, Term};
use crate::task::compile::Problem;
use crate::task::domain::{GoalTerm, Quantity, Situation};

/// Writes a relational problem with a situation and the problem's goal.
///
/// Needs in `dropped`, pairs of operator and need, do not count; take [`Problem::dropped`] or that of the ground problem.
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
    let (mut actions, mut of_actions) = (Vec::new(), Vec::new());
    for o in 0..learned.operators.len() {
        for (mut action, notes) in writer.actions(o)? {
            action.name = calls.fresh(&action.name);
            actions.push(action);
            of_actions.push(notes);
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
        ..Domain::default()
    };
    let mut seen = Seen::default();
    seen.typed(!words.kinds.is_empty());
    domain.actions.iter().for_each(|action| seen.action(action));
    domain.requirements = seen.requirements();
    let mut of_goal = Seen::default();
    of_goal.typed(!words.kinds.is_empty());
    of_goal.condition(&goals);
    let mut of_problem = strips::Problem {
        name: format!("{own}-problem"),
        domain: own,
        requirements: of_goal.requirements(),
        conditions: if let Condition::All(parts) = goals { parts } else { vec![goals] },
        ..strips::Problem::default()
    };
    let domain_notes = notes_of_domain(problem, &words);
    let mut notes = vec!["Written by symbolt.".to_owned()];
    notes.extend(
        problem.goals().iter().map(|goal| format!("Goal: {}.", learned.goal_in_words(goal))),
    );
    let objects = problem.objects();
    let names: Vec<String> = objects.iter().map(|object| words.names.fresh(&object.id)).collect();
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
    for (object, fact) in now.iter().enumerate() {
        of_problem.init.extend(fact.map(|fact| words.fact(object, &fact, &names)));
    }
    for (kind, predicate) in &words.firsts {
        let first = of_problem.objects.iter().find(|object| object.types[0] == *kind);
        let arguments: Vec<String> = first.iter().map(|object| object.name.clone()).collect();
        if !arguments.is_empty() {
            of_problem.init.push(Fact { predicate: predicate.clone(), arguments });
        }
    }
    Ok(Written { domain, problem: of_problem, notes: [domain_notes, notes], of_actions })
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
                _ => scope.is_in(state, x, [reference, None]),
            };
            (all([]), is_in)
        })
    };
    match (goal.quantity.clone(), &named.frame) {
        (Quantity::AtLeast(0) | Quantity::EachReference(0), _) => Ok(all([])),
        (Quantity::AtLeast(least), _) => enough(&mut scope, Least::Here(least), None),
        (Quantity::EachObject, _) => enough(&mut scope, Least::Every, None),
        (Quantity::EachReference(_), None) => Ok(all([])),
        (Quantity::EachReference(least), Some(frame)) => {
            let mut fault = None;
            let each = scope.quantified(false, &[frame], |scope, r| {
                let found = enough(scope, Least::Here(least), Some(&r[0]));
                found.unwrap_or_else(|why| {
                    fault = Some(why);
                    any([])
                })
            });
            fault.map_or(Ok(each), Err)
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

/// What conditions and effects use of PDDL.
#[derive(Default)]
struct Seen([bool; 7]);

impl Seen {
    const ALL: [&'static str; 7] = [
        ":typing",
        ":negative-preconditions",
        ":disjunctive-preconditions",
        ":equality",
        ":existential-preconditions",
        ":universal-preconditions",
        ":conditional-effects",
    ];

    fn typed(&mut self, typed: bool) {
        self.0[0] |= typed;
    }

    fn literal(&mut self, literal: &Literal) {
        self.0[1] |= !literal.positive;
        self.0[3] |= literal.atom.predicate == EQUAL;
    }

    fn condition(&mut self, condition: &Condition) {
        match condition {
            Condition::Literal(l) => self.literal(l),
            Condition::Compare(..) => {}
            Condition::Not(inner) => {
                self.0[1] = true;
                self.condition(inner);
            }
            Condition::All(parts) => parts.iter().for_each(|part| self.condition(part)),
            Condition::Any(parts) => {
                self.0[2] = true;
                parts.iter().for_each(|part| self.condition(part));
            }
            Condition::Exists(_, inner) | Condition::Forall(_, inner) => {
                self.0[if matches!(condition, Condition::Exists(..)) { 4 } else { 5 }] = true;
                self.condition(inner);
            }
        }
    }

    fn action(&mut self, action: &strips::Action) {
        action.preconditions.iter().for_each(|l| self.literal(l));
        action.conditions.iter().for_each(|c| self.condition(c));
        for effect in &action.conditional {
            self.0[6] = true;
            self.condition(&effect.condition);
        }
    }

    fn requirements(&self) -> Vec<String> {
        let used = Self::ALL.iter().zip(self.0).filter(|(_, used)| *used);
        [":strips"].into_iter().chain(used.map(|(name, _)| *name)).map(str::to_owned).collect()
    }
}
