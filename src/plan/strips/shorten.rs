//! Takes detours out of a plan.

use std::collections::{BTreeSet, HashMap};

use super::ground::Grounded;

type State = BTreeSet<usize>;

/// Returns a plan without the detours of `plan`: positions of operators, in order. It is valid if `plan` is.
///
/// An action is left out, with all later ones that then cannot be done, if the goal still holds at the end (greedy action
/// elimination; Nakhost and Müller, "Action elimination and plan neighborhood graph search", 2010). Then, of the states that
/// the plan passes, one operator leads from each to the latest that it can. Both are repeated until neither helps.
///
/// This is a program, not a network. Costs O(actions² x operators) set operations at most. A plan that is not valid is
/// returned as it is.
pub fn shorten(problem: &Grounded, plan: &[usize]) -> Vec<usize> {
    let mut best = plan.to_vec();
    if !states(problem, &best).is_some_and(|states| reached(problem, states.last())) {
        return best;
    }
    loop {
        let before = best.len();
        eliminate(problem, &mut best);
        jump(problem, &mut best);
        if best.len() == before {
            return best;
        }
    }
}

fn reached(problem: &Grounded, state: Option<&State>) -> bool {
    state.is_some_and(|state| Grounded::all_hold(state, &problem.goal))
}

fn applicable(problem: &Grounded, state: &State, operator: usize) -> bool {
    Grounded::all_hold(state, &problem.operators[operator].preconditions)
}

/// Returns the state before each action and after the last, or nothing if an action cannot be done.
fn states(problem: &Grounded, plan: &[usize]) -> Option<Vec<State>> {
    let mut states: Vec<State> = vec![problem.start.iter().copied().collect()];
    for operator in plan {
        let mut state = states.last()?.clone();
        if *operator >= problem.operators.len() || !applicable(problem, &state, *operator) {
            return None;
        }
        problem.operators[*operator].apply(&mut state);
        states.push(state);
    }
    Some(states)
}

/// Leaves out each action that is not needed, and those that need it.
fn eliminate(problem: &Grounded, plan: &mut Vec<usize>) {
    let mut state: State = problem.start.iter().copied().collect();
    let mut first = 0;
    while first < plan.len() {
        let mut without = state.clone();
        let mut kept = Vec::with_capacity(plan.len() - first);
        for operator in &plan[first + 1..] {
            if applicable(problem, &without, *operator) {
                problem.operators[*operator].apply(&mut without);
                kept.push(*operator);
            }
        }
        if reached(problem, Some(&without)) {
            plan.truncate(first);
            plan.append(&mut kept);
        } else {
            problem.operators[plan[first]].apply(&mut state);
            first += 1;
        }
    }
}

/// Goes from each state straight to the latest that one operator leads to.
fn jump(problem: &Grounded, plan: &mut Vec<usize>) {
    let Some(states) = states(problem, plan) else { return };
    // A later state of the same contents takes the place of an earlier one.
    let latest: HashMap<&State, usize> = states.iter().enumerate().map(|(i, s)| (s, i)).collect();
    let mut short = Vec::with_capacity(plan.len());
    let mut at = latest[&states[0]];
    while at < plan.len() {
        let mut next = (at + 1, plan[at]);
        for operator in
            (0..problem.operators.len()).filter(|o| applicable(problem, &states[at], *o))
        {
            let mut state = states[at].clone();
            problem.operators[operator].apply(&mut state);
            if let Some(to) = latest.get(&state).filter(|to| **to > next.0) {
                next = (*to, operator);
            }
        }
        short.push(next.1);
        at = latest[&states[next.0]];
    }
    *plan = short;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::strips::{Bodies, Domain, Problem};

    /// A ring of six rooms, a lamp that can be switched at any time, and a box that is carried from room a to room d.
    fn rooms() -> Grounded {
        let domain = b"(define (domain rooms) (:predicates (at ?r) (next ?a ?b) (box ?r) (held) (lit))
            (:action go :parameters (?a ?b) :precondition (and (at ?a) (next ?a ?b)) :effect (and (at ?b) (not (at ?a))))
            (:action take :parameters (?r) :precondition (and (at ?r) (box ?r)) :effect (and (held) (not (box ?r))))
            (:action put :parameters (?r) :precondition (and (at ?r) (held)) :effect (and (box ?r) (not (held))))
            (:action light :parameters () :precondition () :effect (lit)))";
        let problem = b"(define (problem p) (:domain rooms) (:objects a b c d e f)
            (:init (at a) (box a) (next a b) (next b c) (next c d) (next d e) (next e f) (next f a)
                (next b a) (next c b) (next d c) (next e d) (next f e) (next a f))
            (:goal (and (box d))))";
        let domain = Domain::parse(domain, "rooms", Bodies::Read).unwrap();
        let problem = Problem::parse(problem, "p", &domain).unwrap();
        Grounded::new(&domain, &problem).unwrap()
    }

    fn named(problem: &Grounded, names: &[&str]) -> Vec<usize> {
        let of = |name: &&str| problem.operators.iter().position(|o| o.name == *name).unwrap();
        names.iter().map(of).collect()
    }

    #[test]
    fn what_is_not_needed_and_what_leads_back_is_left_out() {
        let problem = rooms();
        let plan = named(
            &problem,
            &[
                "(light)", "(take a)", "(go a f)", "(go f e)", "(put e)", "(go e f)", "(go f e)",
                "(take e)", "(go e f)", "(go f a)", "(go a b)", "(go b c)", "(go c d)", "(put d)",
                "(go d e)",
            ],
        );
        let short = shorten(&problem, &plan);
        assert_eq!(
            short,
            named(&problem, &["(take a)", "(go a b)", "(go b c)", "(go c d)", "(put d)"])
        );
        assert_eq!(shorten(&problem, &short), short);
    }

    #[test]
    fn a_plan_that_is_not_valid_is_left_alone() {
        let problem = rooms();
        let wrong = named(&problem, &["(light)", "(put d)"]);
        assert_eq!(shorten(&problem, &wrong), wrong);
        assert_eq!(shorten(&problem, &[99]), [99]);
        assert_eq!(shorten(&problem, &[]), Vec::<usize>::new());
    }
}
