//! Planning problems with known shortest plans.

#![allow(clippy::expect_used)]

use std::collections::BTreeSet;

use symbolt::plan::goal_sets::Regression;
use symbolt::plan::strips::{Bodies, Domain, Grounded, PddlFault, Problem};
use symbolt::sim::Seed;
use symbolt::study::problems::{
    Breakfast, Distance, Kitchen, PlanningProblem, breakfast, distance, tangled,
};

/// Whether some plan of at most `depth` actions reaches the goal, depth first.
fn reaches(problem: &Grounded, state: &BTreeSet<usize>, depth: usize) -> bool {
    Grounded::all_hold(state, &problem.goal)
        || depth > 0
            && problem.operators.iter().any(|operator| {
                let mut next = state.clone();
                operator.apply(&mut next);
                Grounded::all_hold(state, &operator.preconditions)
                    && next != *state
                    && reaches(problem, &next, depth - 1)
            })
}

#[test]
fn shortest_plans_have_the_length_that_was_asked_for() {
    for length in 2..=7 {
        for seed in 0..4 {
            let made = tangled(length, &mut Seed::new(seed).rng()).expect("a problem");
            let start: BTreeSet<usize> = made.grounded.start.iter().copied().collect();
            assert!(reaches(&made.grounded, &start, length), "{length}");
            assert!(!reaches(&made.grounded, &start, length - 1), "{length}");
        }
    }
}

#[test]
fn long_ones_are_as_far_as_a_search_of_the_grounded_problem_says() {
    for length in [10, 12, 15, 16] {
        let made = tangled(length, &mut Seed::new(3).rng()).expect("a problem");
        assert_eq!(made.distance(5000), Distance::Steps(length));
        assert_eq!(made.distance(10), Distance::Unknown);
    }
    for length in [0, 1, 17, usize::MAX] {
        assert!(tangled(length, &mut Seed::new(1).rng()).is_err());
    }
}

#[test]
fn a_shuffled_kitchen_is_the_same_kitchen() {
    let plain = Kitchen::default().problem(5).expect("a problem");
    let mut first = std::collections::BTreeSet::new();
    for seed in 0..20 {
        let other = plain.shuffled(&mut Seed::new(seed).rng()).expect("a problem");
        let (made, kept) = (&other.grounded, &plain.grounded);
        assert_eq!(made.fluents.len(), kept.fluents.len());
        assert_eq!(made.operators.len(), kept.operators.len());
        assert_eq!(other.distance(1000), Distance::Steps(5));
        // What is printed is read again as the same problem.
        let (domain, problem) = (other.domain.to_string(), other.problem.to_string());
        assert_eq!(PlanningProblem::parse(&domain, &problem).expect("PDDL"), other);
        first.insert(made.operators.iter().map(|o| o.preconditions.len()).collect::<Vec<_>>());
    }
    assert!(first.len() > 8, "{} orders of the operators", first.len());
}

#[test]
fn objects_and_parameters_keep_their_places() {
    let domain = "(define (domain d) (:requirements :strips :typing) (:types place)
        (:constants home - place) (:predicates (at ?p - place) (road ?p ?q - place))
        (:action go :parameters (?p ?q - place) :precondition (and (at ?p) (road ?p ?q))
            :effect (and (not (at ?p)) (at ?q))))";
    let problem = "(define (problem p) (:domain d) (:objects a b c - place)
        (:init (at a) (road a b) (road b c) (road c home)) (:goal (at home)))";
    let plain = PlanningProblem::parse(domain, problem).expect("a problem");
    for seed in 0..5 {
        let other = plain.shuffled(&mut Seed::new(seed).rng()).expect("a problem");
        assert_eq!(other.distance(100), Distance::Steps(3));
        assert_ne!(other.problem.init, plain.problem.init);
    }
}

#[test]
fn kitchens_need_their_actions() {
    let mut checked = 0;
    for (put_back, one_fuse) in [(false, false), (false, true), (true, false), (true, true)] {
        let kitchen = Kitchen { put_back, one_fuse };
        for actions in 2..=kitchen.most_actions() {
            let made = kitchen.problem(actions).expect("a problem");
            assert_eq!(made.distance(1000), Distance::Steps(actions), "{kitchen:?}");
            checked += 1;
        }
        assert!(kitchen.problem(1).is_err());
        assert!(kitchen.problem(kitchen.most_actions() + 1).is_err());
    }
    assert_eq!(checked, 4 + 4 + 5 + 5);
}

#[test]
fn with_one_fuse_a_kettle_that_was_plugged_in_too_early_never_boils() {
    for (one_fuse, expected) in [(true, Distance::Never), (false, Distance::Steps(5))] {
        let kitchen = Kitchen { put_back: false, one_fuse };
        let made = kitchen.problem(4).expect("a problem").grounded;
        let early = made.operators.iter().find(|o| o.name == "(plug-in-kettle)");
        let early = early.expect("an operator");
        let mut state: BTreeSet<usize> = made.start.iter().copied().collect();
        early.apply(&mut state);
        assert_eq!(distance(&made, &state, 1000), expected);
    }
}

#[test]
fn breakfasts_have_their_sizes_and_lengths() {
    for (name, wanted) in Breakfast::ALL {
        let made = breakfast(wanted).expect("a problem");
        let size = (made.grounded.fluents.len(), made.grounded.operators.len());
        assert_eq!(size, (18, 14), "{name}");
        assert_eq!(made.distance(100_000), Distance::Steps(wanted.shortest()), "{name}");
    }
}

#[test]
fn an_operator_serves_what_others_with_its_preconditions_add() {
    let domain = b"(define (domain lift) (:predicates (down) (up) (a) (b) (c))
        (:action raise :parameters () :precondition (down) :effect (and (up) (not (down))))
        (:action take-a :parameters () :precondition (up) :effect (a))
        (:action take-b :parameters () :precondition (and (up) (a)) :effect (b))
        (:action take-c :parameters () :precondition (down) :effect (c)))";
    let problem = b"(define (problem p) (:domain lift) (:init (down)) (:goal (and (b) (c))))";
    let domain = Domain::parse(domain, "domain", Bodies::Read).unwrap();
    let problem = Problem::parse(problem, "problem", &domain).unwrap();
    let grounded = Grounded::new(&domain, &problem).unwrap();
    let served = |name: &str| {
        let rules = Regression::new(&grounded);
        let place = grounded.operators.iter().position(|o| o.name == name).unwrap();
        let names = rules.operators[place].serves.iter();
        names.map(|f| grounded.fluents[*f].to_string()).collect::<BTreeSet<_>>()
    };
    let set = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<BTreeSet<_>>();
    assert_eq!(served("(raise)"), set(&["(c)"]));
    assert_eq!(served("(take-a)"), set(&["(b)"]));
    assert_eq!(served("(take-b)"), set(&["(a)"]));
    assert_eq!(served("(take-c)"), set(&["(up)"]));
}

fn read(bytes: &[u8], file: &str) -> PddlFault {
    Domain::parse(bytes, file, Bodies::Read).expect_err("a fault")
}

#[test]
fn faults_name_line_and_column() {
    let deep = "(".repeat(65);
    let cases = [
        ("(a", "x.pddl, line 1, column 1: this list is not closed; expected `)`"),
        ("(a b\u{1b}[2J)", "x.pddl, line 1, column 4: the word \"b\\u{1b}[2J\" has a control"),
        ("(a)\n é )", "x.pddl, line 2, column 4: `)` closes no list"),
        (deep.as_str(), "x.pddl, line 1, column 65: lists are nested more than 64 deep"),
    ];
    for (text, message) in cases {
        let fault = read(text.as_bytes(), "x.pddl").to_string();
        assert!(fault.starts_with(message), "{fault}");
    }
    // What is no UTF-8 is read as Latin-1.
    assert!(read(b"(a\n b\xff) )", "x").to_string().starts_with("x, line 2, column 6: `)` closes"));
}
