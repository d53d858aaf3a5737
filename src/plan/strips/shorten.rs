//! Takes detours out of a plan.

use std::collections::{BTreeSet, HashMap, VecDeque};

use super::ground::Grounded;
use super::sets::{Bits, bits, contains};

type State = BTreeSet<usize>;

/// Words of sets that are looked at around a plan, unless its own states have more.
const LOOKS: usize = 50_000_000;
/// States around a plan from which all operators are tried.
const MOST_STATES: usize = 100_000;

/// Returns a plan without the detours of `plan`: positions of operators, in order. It is valid if `plan` is.
///
/// An action is left out, with all later ones that then cannot be done, if the goal still holds at the end (greedy action
/// elimination). Then all operators are tried from the states of the plan, and from those that they lead to, up to 100,000 states in all;
/// the plan becomes the shortest way among them (Nakhost and Müller, "Action elimination and plan neighborhood graph search", 2010).
/// Both are repeated until neither helps.
///
/// This is a program, not a network. Each repetition looks at up to 50 million words of sets, and costs O(actions²) set operations besides. A
/// plan that is not valid is returned as it is.
pub fn shorten(problem: &Grounded, plan: &[usize]) -> Vec<usize> {
    let mut best = plan.to_vec();
    if !states(problem, &best).is_some_and(|states| reached(problem, states.last())) {
        return best;
    }
    loop {
        let before = best.len();
        eliminate(problem, &mut best);
        cut(problem, &mut best);
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

/// States around a plan, and the operators that lead from one to another.
struct Neighbourhood {
    numbers: HashMap<Bits, usize>,
    states: Vec<Bits>,
    /// Of each state, in the order of `states`: operators and where they lead. Of the last ones, nothing is known.
    edges: Vec<Vec<(usize, usize)>>,
}

impl Neighbourhood {
    /// Looks at what all operators lead to: from the states of the plan, then from those that are found, in this order.
    fn around(problem: &Grounded, states: &[State]) -> Self {
        let words = problem.fluents.len().div_ceil(64);
        let of = |fluents: &[usize]| bits(fluents.iter().copied(), words);
        let operators = problem.operators.iter();
        let operators: Vec<[Bits; 3]> =
            operators.map(|o| [of(&o.preconditions), of(&o.deletes), of(&o.adds)]).collect();
        let (numbers, empty) = (HashMap::new(), Vec::new());
        let mut found = Self { numbers, states: Vec::new(), edges: empty };
        let own = states.len();
        states.iter().for_each(|state| _ = found.number(bits(state.iter().copied(), words)));
        let most = (LOOKS / (operators.len() * words).max(1)).clamp(own, MOST_STATES);
        while found.edges.len() < found.states.len().min(most) {
            let state = found.states[found.edges.len()].clone();
            let mut edges = Vec::new();
            for (operator, [needs, deletes, adds]) in operators.iter().enumerate() {
                if contains(&state, needs) {
                    let changed = state.iter().zip(deletes).zip(adds);
                    let after = changed.map(|((s, d), a)| (s & !d) | a).collect();
                    edges.push((operator, found.number(after)));
                }
            }
            found.edges.push(edges);
        }
        found
    }

    fn number(&mut self, state: Bits) -> usize {
        let next = self.states.len();
        let number = *self.numbers.entry(state.clone()).or_insert(next);
        if number == next {
            self.states.push(state);
        }
        number
    }

    /// Returns the operators of a shortest way from the first state to one with the goal.
    fn way(&self, goal: &[u64]) -> Option<Vec<usize>> {
        let mut before: Vec<Option<(usize, usize)>> = vec![None; self.states.len()];
        let mut queue = VecDeque::from([0]);
        while let Some(at) = queue.pop_front() {
            if contains(&self.states[at], goal) {
                let back = |state: &usize| before[*state].map(|(from, _)| from);
                let path = std::iter::successors(Some(at), back);
                let mut way: Vec<usize> = path.filter_map(|s| before[s].map(|(_, o)| o)).collect();
                way.reverse();
                return Some(way);
            }
            for (operator, to) in self.edges.get(at).into_iter().flatten() {
                if *to != 0 && before[*to].is_none() {
                    before[*to] = Some((at, *operator));
                    queue.push_back(*to);
                }
            }
        }
        None
    }
}

/// Takes the shortest way within the neighbourhood of the plan.
fn cut(problem: &Grounded, plan: &mut Vec<usize>) {
    let Some(states) = states(problem, plan) else { return };
    let goal = bits(problem.goal.iter().copied(), problem.fluents.len().div_ceil(64));
    if let Some(way) = Neighbourhood::around(problem, &states).way(&goal)
        && way.len() < plan.len()
    {
        *plan = way;
    }
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
    fn a_way_beside_the_plan_is_taken_if_it_is_shorter() {
        let problem = rooms();
        let plan = named(&problem, &["(take a)", "(go a f)", "(go f e)", "(go e d)", "(put d)"]);
        assert_eq!(shorten(&problem, &plan), plan, "three rooms either way");
        let mut far = problem.clone();
        let goal = far.fluents.iter().position(|f| f.to_string() == "(box c)");
        far.goal = goal.into_iter().collect();
        // No action can be left out, and no single one leads from one of its states to a later one.
        let round = ["(take a)", "(go a f)", "(go f e)", "(go e d)", "(go d c)", "(put c)"];
        let direct = ["(take a)", "(go a b)", "(go b c)", "(put c)"];
        assert_eq!(shorten(&far, &named(&far, &round)), named(&far, &direct));
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
