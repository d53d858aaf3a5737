//! Operators that are in no plan are left out of both searches, and no others are.

#![allow(clippy::expect_used)]

use std::collections::{BTreeSet, VecDeque};
use std::fmt::Write as _;

use rand::RngExt as _;
use symbolt::neurons::{LifSpec, Population};
use symbolt::plan::goal_sets::{Directions, GoalSetSpec, Regression, StripsWorld, pursue};
use symbolt::plan::strips::{Bodies, Domain, Grounded, Problem, validate};
use symbolt::prelude::*;

/// Two hands, a jug and a glass. Nothing says that the hands of an action differ, as in many files: the facts do.
const BAR: &str = "(define (domain bar) (:requirements :typing)
    (:types hand vessel juice) (:constants jug glass - vessel)
    (:predicates (stands ?v - vessel) (holds ?h - hand ?v - vessel) (free ?h - hand) (inside ?v - vessel ?j - juice)
        (empty ?v - vessel) (differ ?a ?b - juice) (mixed) (served))
    (:action grasp :parameters (?h - hand ?v - vessel) :precondition (and (stands ?v) (free ?h))
        :effect (and (not (stands ?v)) (not (free ?h)) (holds ?h ?v)))
    (:action put :parameters (?h - hand ?v - vessel) :precondition (holds ?h ?v)
        :effect (and (not (holds ?h ?v)) (free ?h) (stands ?v)))
    (:action fill :parameters (?h ?other - hand ?j - juice)
        :precondition (and (holds ?h glass) (free ?other) (empty glass))
        :effect (and (inside glass ?j) (not (empty glass))))
    (:action pour :parameters (?h - hand ?j - juice) :precondition (and (holds ?h glass) (inside glass ?j))
        :effect (and (inside jug ?j) (not (inside glass ?j)) (empty glass)))
    (:action shake :parameters (?h ?other - hand ?a ?b - juice)
        :precondition (and (holds ?h jug) (free ?other) (inside jug ?a) (inside jug ?b) (differ ?a ?b))
        :effect (mixed))
    (:action serve :parameters (?h ?other - hand) :precondition (and (holds ?h jug) (holds ?other glass) (empty glass) (mixed))
        :effect (served)))";

const ROUND: &str = "(define (problem round) (:domain bar)
    (:objects left right - hand apple cherry - juice)
    (:init (stands jug) (stands glass) (free left) (free right) (empty glass) (differ apple cherry))
    (:goal (served)))";

/// A passage of rock, with gold at its end. A torch clears rock and burns gold; a charge clears rock alone.
fn mine(cells: usize) -> (String, String) {
    let domain = "(define (domain mine) (:requirements :typing)
        (:types cell)
        (:predicates (at ?c - cell) (next ?a ?b - cell) (rock ?c - cell) (way ?c - cell) (gold ?c - cell)
            (charges ?c - cell) (torch) (charge) (bare) (rich))
        (:action walk :parameters (?a ?b - cell) :precondition (and (at ?a) (next ?a ?b) (way ?b))
            :effect (and (at ?b) (not (at ?a))))
        (:action light :parameters () :precondition (bare) :effect (and (torch) (not (bare))))
        (:action drop :parameters () :precondition (torch) :effect (and (bare) (not (torch))))
        (:action take :parameters (?c - cell) :precondition (and (at ?c) (charges ?c) (bare))
            :effect (and (charge) (not (bare))))
        (:action burn :parameters (?a ?b - cell) :precondition (and (at ?a) (next ?a ?b) (rock ?b) (torch))
            :effect (and (way ?b) (not (rock ?b)) (not (gold ?b))))
        (:action blast :parameters (?a ?b - cell) :precondition (and (at ?a) (next ?a ?b) (rock ?b) (charge))
            :effect (and (way ?b) (not (rock ?b)) (not (charge)) (bare)))
        (:action dig :parameters (?c - cell) :precondition (and (at ?c) (gold ?c) (bare))
            :effect (and (rich) (not (bare)) (not (gold ?c)))))";
    let mut facts = String::from("(at c0) (way c0) (charges c0) (bare)");
    let names: String = (0..=cells).map(|i| format!(" c{i}")).collect();
    for i in 1..=cells {
        let _ = write!(facts, "(next c{} c{i})(next c{i} c{})(rock c{i})", i - 1, i - 1);
    }
    let problem = format!(
        "(define (problem p) (:domain mine) (:objects{names} - cell) (:init {facts} (gold c{cells})) (:goal (rich)))"
    );
    (domain.into(), problem)
}

fn grounded(domain: &str, problem: &str) -> (Domain, Problem, Grounded) {
    let domain = Domain::parse(domain.as_bytes(), "domain", Bodies::Read).expect("a domain");
    let problem = Problem::parse(problem.as_bytes(), "problem", &domain).expect("a problem");
    let grounded = Grounded::new(&domain, &problem).expect("a small problem");
    (domain, problem, grounded)
}

/// Returns the names of the operators that are left out.
fn left_out(problem: &Grounded) -> BTreeSet<&str> {
    let rules = Regression::new(problem);
    let both = problem.operators.iter().zip(&rules.operators);
    both.filter(|(o, seen)| seen.adds.is_empty() && !o.adds.is_empty())
        .map(|(o, _)| &*o.name)
        .collect()
}

#[test]
fn a_hand_that_would_have_to_be_full_and_free_misleads_no_search() {
    let (domain, problem, bar) = grounded(BAR, ROUND);
    let useless = left_out(&bar);
    assert!(useless.contains("(shake left left apple cherry)"), "{useless:?}");
    assert!(!useless.contains("(shake left right apple cherry)"), "{useless:?}");
    for population in [Population::Direct, Population::Lif(LifSpec::default())] {
        let world = StripsWorld::new(&bar, SimDuration::from_millis(100));
        let limit = SimDuration::from_millis(15_000);
        let directions = Directions::Forward;
        let spec = GoalSetSpec { population, limit, directions, ..GoalSetSpec::default() };
        let course = pursue(&bar, world, &spec, Seed::new(1)).expect("a course");
        let steps = bar.steps(course.plan());
        assert!(validate(&domain, &problem, steps).is_ok() && course.starts() == 1, "{course:?}");
    }
}

#[test]
fn what_puts_the_goal_out_of_reach_for_good_is_not_done() {
    let (domain, problem) = mine(3);
    let (domain, problem, mine) = grounded(&domain, &problem);
    let useless = left_out(&mine);
    assert!(useless.contains("(burn c2 c3)"), "{useless:?}");
    // Others are left out because there is no way round the rock, never these.
    let needed = ["(burn c0 c1)", "(burn c1 c2)", "(blast c2 c3)", "(light)", "(dig c3)"];
    assert_eq!(needed.map(|name| useless.contains(name)), [false; 5], "{useless:?}");
    let world = StripsWorld::new(&mine, SimDuration::from_millis(100));
    let spec = GoalSetSpec { directions: Directions::Forward, ..GoalSetSpec::default() };
    let course = pursue(&mine, world, &spec, Seed::new(1)).expect("a course");
    assert!(validate(&domain, &problem, mine.steps(course.plan())).is_ok(), "{course:?}");
}

/// Makes a random problem of nine facts and ten actions.
fn random(seed: u64) -> Option<Grounded> {
    let mut rng = Seed::new(seed).rng();
    let mut domain = String::from("(define (domain d) (:predicates");
    domain.extend((0..9).map(|f| format!(" (f{f})")));
    domain.push(')');
    let mut some = |most: usize| -> BTreeSet<usize> {
        (0..rng.random_range(1..=most)).map(|_| rng.random_range(0..9)).collect()
    };
    let all = |facts: &BTreeSet<usize>, not: bool| -> String {
        let one = |f| if not { format!("(not (f{f}))") } else { format!("(f{f})") };
        facts.iter().map(one).collect()
    };
    for a in 0..10 {
        let (needs, adds, mut deletes) = (some(2), some(2), some(3));
        deletes.retain(|f| !adds.contains(f));
        let [needs, adds, deletes] = [all(&needs, false), all(&adds, false), all(&deletes, true)];
        let _ = write!(
            domain,
            "(:action a{a} :parameters () :precondition (and {needs}) :effect (and {adds} {deletes}))"
        );
    }
    domain.push(')');
    let (start, goal) = (all(&some(4), false), all(&some(2), false));
    let problem = format!("(define (problem p) (:domain d) (:init {start}) (:goal (and {goal})))");
    let domain = Domain::parse(domain.as_bytes(), "domain", Bodies::Read).expect("a domain");
    let problem = Problem::parse(problem.as_bytes(), "problem", &domain).expect("a problem");
    Grounded::new(&domain, &problem).ok()
}

/// Returns the states that can be reached from one.
fn reachable(problem: &Grounded, from: BTreeSet<usize>) -> BTreeSet<BTreeSet<usize>> {
    let (mut seen, mut next) = (BTreeSet::from([from.clone()]), VecDeque::from([from]));
    while let Some(state) = next.pop_front() {
        for after in problem.operators.iter().filter_map(|o| applied(o, &state)) {
            if seen.insert(after.clone()) {
                next.push_back(after);
            }
        }
    }
    seen
}

fn applied(
    operator: &symbolt::plan::strips::GroundOperator,
    state: &BTreeSet<usize>,
) -> Option<BTreeSet<usize>> {
    Grounded::all_hold(state, &operator.preconditions).then(|| {
        let mut after = state.clone();
        after.retain(|f| !operator.deletes.contains(f));
        after.extend(&operator.adds);
        after
    })
}

#[test]
fn no_operator_is_left_out_that_some_plan_has() {
    // Operators that can be applied, and those among them that are left out or delete a goal: how many of them lead to the goal.
    let [mut applied_all, mut out, mut deleting] = [[0; 2]; 3];
    for problem in (0..600).filter_map(random) {
        let rules = Regression::new(&problem);
        let states = reachable(&problem, problem.start.iter().copied().collect());
        let solved = |from: BTreeSet<usize>| {
            reachable(&problem, from).iter().any(|s| Grounded::all_hold(s, &problem.goal))
        };
        let solvable = states.iter().any(|s| Grounded::all_hold(s, &problem.goal));
        let world = StripsWorld::new(&problem, SimDuration::from_millis(100));
        let spec = GoalSetSpec { limit: SimDuration::from_millis(1), ..GoalSetSpec::default() };
        let refused = pursue(&problem, world, &spec, Seed::new(1));
        assert!(!solvable || refused.is_ok(), "{refused:?}");
        for (operator, seen) in problem.operators.iter().zip(&rules.operators) {
            let afters: BTreeSet<_> = states.iter().filter_map(|s| applied(operator, s)).collect();
            let leads = usize::from(afters.into_iter().any(solved));
            applied_all[leads] += 1;
            if seen.adds.is_empty() && !operator.adds.is_empty() {
                out[leads] += 1;
            }
            if operator.deletes.iter().any(|f| problem.goal.contains(f)) {
                deleting[leads] += 1;
            }
        }
    }
    assert_eq!(out[1], 0);
    assert!(out[0] > 100 && applied_all[1] > 500, "{applied_all:?} {out:?}");
    // A rule that leaves out whatever deletes a goal would be caught.
    assert!(deleting[1] > 20, "{deleting:?}");
}
