//! Grounding of PDDL problems and validation of plans, each checked against the other and against brute force.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeSet;

use symbolt::plan::strips::{
    Bodies, Domain, Fact, GroundFault, Grounded, PlanFault, Problem, Trajectory, Typed, validate,
};
use symbolt::sim::Seed;

use crate::strips;

/// Returns the facts of a state of a trajectory.
fn facts(domain: &Domain, trajectory: &Trajectory, state: usize) -> Vec<Fact> {
    let fact = |atom: &symbolt::plan::strips::GroundAtom| Fact {
        predicate: domain.predicates[atom.predicate].name.clone(),
        arguments: atom.arguments.iter().map(|o| trajectory.objects[*o].name.clone()).collect(),
    };
    trajectory.states[state].iter().map(fact).collect()
}

/// Returns the problem that leads from one state of a trajectory to another.
fn problem(domain: &Domain, trajectory: &Trajectory, from: usize, to: usize) -> Problem {
    let objects = trajectory.objects[domain.constants.len()..].iter();
    Problem {
        name: "p".into(),
        domain: domain.name.clone(),
        objects: objects
            .map(|o| Typed { name: o.name.clone(), types: o.types[0].clone() })
            .collect(),
        init: facts(domain, trajectory, from),
        goal: facts(domain, trajectory, to).into_iter().map(|fact| (true, fact)).collect(),
        ..Problem::default()
    }
}

fn name(domain: &Domain, trajectory: &Trajectory, step: usize) -> String {
    let step = &trajectory.steps[step];
    let objects = step.arguments.iter().map(|o| format!(" {}", trajectory.objects[*o].name));
    format!("({}{})", domain.actions[step.action].name, objects.collect::<String>())
}

/// Returns all calls that are allowed in the initial state and change it, by trying every choice of objects.
fn allowed(domain: &Domain, problem: &Problem) -> BTreeSet<String> {
    let before: BTreeSet<Fact> = problem.init.iter().cloned().collect();
    let open = Problem { goal: Vec::new(), ..problem.clone() };
    let objects: Vec<&Typed> = domain.constants.iter().chain(&problem.objects).collect();
    let mut all = BTreeSet::new();
    for action in &domain.actions {
        let mut calls = vec![format!("({}", action.name)];
        for parameter in &action.parameters {
            let fits = |o: &&&Typed| domain.types.fits(&o.types, &parameter.types);
            let with = |call: &String| {
                let own = objects.iter().filter(fits);
                own.map(|o| format!("{call} {}", o.name)).collect::<Vec<_>>()
            };
            calls = calls.iter().flat_map(with).collect();
        }
        all.extend(calls.into_iter().map(|call| call + ")").filter(|call| {
            validate(domain, &open, [call.as_str()]).is_ok_and(|after| after != before)
        }));
    }
    all
}

/// Returns the fluents that hold when exactly these facts do.
fn fluents(grounded: &Grounded, facts: &[Fact]) -> BTreeSet<usize> {
    let holds = |index: &usize| {
        let fluent = &grounded.fluents[*index];
        facts.contains(&fluent.fact) == fluent.holds
    };
    (0..grounded.fluents.len()).filter(holds).collect()
}

#[test]
fn ground_operators_are_the_allowed_calls_in_every_state_of_fifteen_domains() {
    let (mut steps, mut compared) = (0, 0);
    for case in strips::cases() {
        let domain = strips::truth(&case);
        let texts = strips::traces(&case, &domain, 4, Seed::new(7).derive("pddl", case.name));
        for trajectory in strips::read(&texts, &domain).iter().skip(1).step_by(2) {
            let last = trajectory.steps.len();
            let whole = problem(&domain, trajectory, 0, last);
            let grounded = Grounded::new(&domain, &whole).unwrap();
            let plan: Vec<String> = (0..last).map(|step| name(&domain, trajectory, step)).collect();
            validate(&domain, &whole, plan.iter().map(String::as_str)).expect("a valid plan");
            let start: BTreeSet<usize> = grounded.start.iter().copied().collect();
            assert_eq!(start, fluents(&grounded, &whole.init), "{}", case.name);
            for (step, call) in plan.iter().enumerate() {
                let before = fluents(&grounded, &facts(&domain, trajectory, step));
                let after = fluents(&grounded, &facts(&domain, trajectory, step + 1));
                let operator = grounded.operators.iter().find(|o| o.name == *call);
                let operator = operator.unwrap_or_else(|| panic!("{call} in {}", case.name));
                assert!(Grounded::all_hold(&before, &operator.preconditions));
                let mut state = before.clone();
                state.retain(|fluent| !operator.deletes.contains(fluent));
                state.extend(&operator.adds);
                assert_eq!(state, after, "{call} in {}", case.name);
                steps += 1;
                if step % 6 == 0 {
                    let applicable: BTreeSet<String> = grounded
                        .operators
                        .iter()
                        .filter(|o| Grounded::all_hold(&before, &o.preconditions))
                        .filter(|o| {
                            let adds = o.adds.iter().any(|fluent| !before.contains(fluent));
                            adds || o.deletes.iter().any(|fluent| before.contains(fluent))
                        })
                        .map(|o| o.name.clone())
                        .collect();
                    let here = problem(&domain, trajectory, step, last);
                    assert_eq!(applicable, allowed(&domain, &here), "{}", case.name);
                    compared += applicable.len();
                }
            }
            let end = fluents(&grounded, &facts(&domain, trajectory, last));
            assert!(Grounded::all_hold(&end, &grounded.goal), "{}", case.name);
        }
    }
    assert!(steps > 200 && compared > 300, "{steps} steps, {compared} calls");
}

const DOOR: &str = "(define (domain door) (:requirements :strips :typing :negative-preconditions :equality)
    (:types room key) (:constants hall - room)
    (:predicates (at ?r - room) (joined ?a ?b - room) (locked ?r - room) (has ?k - key) (fits ?k - key ?r - room))
    (:action go :parameters (?a ?b - room)
      :precondition (and (at ?a) (joined ?a ?b) (not (locked ?b)) (not (= ?a ?b)))
      :effect (and (at ?b) (not (at ?a))))
    (:action unlock :parameters (?k - key ?r - room)
      :precondition (and (has ?k) (fits ?k ?r) (locked ?r)) :effect (not (locked ?r))))";

fn door(problem: &str) -> (Domain, Problem) {
    let domain = Domain::parse(DOOR.as_bytes(), "door.pddl", Bodies::Read).unwrap();
    let problem = Problem::parse(problem.as_bytes(), "problem.pddl", &domain).unwrap();
    (domain, problem)
}

#[test]
fn negative_preconditions_become_fluents_and_what_never_changes_is_dropped() {
    let (domain, problem) = door(
        "(define (problem p) (:domain door) (:objects vault cellar - room k - key)
          (:init (at hall) (joined hall vault) (joined vault hall) (joined hall cellar) (joined hall hall)
                 (locked vault) (locked cellar) (has k) (fits k vault))
          (:goal (and (at vault) (has k) (not (locked vault)))))",
    );
    let grounded = Grounded::new(&domain, &problem).unwrap();
    let shown: Vec<String> = grounded.fluents.iter().map(ToString::to_string).collect();
    // The cellar stays locked, so nobody goes there, and the hall is never locked.
    let expected = ["(at hall)", "(at vault)", "(not (locked vault))", "(locked vault)"];
    assert_eq!(shown, expected);
    let names: Vec<&str> = grounded.operators.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["(go hall vault)", "(go vault hall)", "(unlock k vault)"]);
    let unlock = &grounded.operators[2];
    assert_eq!(
        (&unlock.preconditions[..], &unlock.adds[..], &unlock.deletes[..]),
        (&[3][..], &[2][..], &[3][..])
    );
    assert_eq!(grounded.goal, [1, 2]);
    assert!(validate(&domain, &problem, ["(unlock k vault)", "(GO hall Vault)"]).is_ok());
    let fault = |plan: &[&str]| {
        validate(&domain, &problem, plan.iter().copied()).err().map(|e| e.to_string()).unwrap()
    };
    assert_eq!(
        fault(&["(go hall vault)"]),
        "step 1, `(go hall vault)`, needs (not (locked vault)), which does not hold"
    );
    assert_eq!(
        fault(&["(go hall hall)"]),
        "step 1, `(go hall hall)`, needs (not (= hall hall)), which does not hold"
    );
    assert_eq!(
        fault(&["(unlock k vault)"]),
        "after the last step, (at vault) of the goal does not hold"
    );
    for (step, reason) in [
        ("(fly hall)", "expected one of: go, unlock"),
        ("(go hall)", "it has 1 objects; expected 2"),
        ("(go hall attic)", "`attic` is no object"),
        ("(go hall k)", "`k` is of type key; expected room"),
        ("go hall vault", "expected (ACTION OBJECT ...)"),
        ("", "expected (ACTION OBJECT ...)"),
    ] {
        let found = validate(&domain, &problem, [step]).err().unwrap();
        assert!(matches!(found, PlanFault::NoAction { step: 1, .. }));
        assert!(found.to_string().ends_with(reason), "{found}");
    }
}

#[test]
fn goals_that_no_plan_achieves_are_refused_with_the_reason() {
    let refused = |goal: &str| {
        let (domain, problem) = door(&format!(
            "(define (problem p) (:domain door) (:objects vault attic - room k - key)
              (:init (at hall) (joined hall vault) (locked vault) (fits k vault)) (:goal {goal}))"
        ));
        Grounded::new(&domain, &problem).err().unwrap().to_string()
    };
    assert_eq!(
        refused("(at vault)"),
        "the goal (at vault) of the problem `p` cannot be reached; the preconditions of `go` cannot be met for it"
    );
    assert_eq!(
        refused("(has k)"),
        "the goal (has k) of the problem `p` cannot be reached; no action makes `has` true"
    );
    assert_eq!(
        refused("(not (fits k vault))"),
        "the goal (not (fits k vault)) of the problem `p` cannot be reached; no action makes `fits` false"
    );
}

#[test]
fn a_problem_too_large_to_ground_is_refused() {
    let domain = "(define (domain d) (:predicates (p ?a ?b ?c ?d) (q ?a))
        (:action a :parameters (?a ?b ?c ?d) :precondition (and (q ?a) (q ?b) (q ?c) (q ?d)) :effect (p ?a ?b ?c ?d)))";
    let domain = Domain::parse(domain.as_bytes(), "d", Bodies::Read).unwrap();
    let names: Vec<String> = (0..60).map(|i| format!("o{i}")).collect();
    let init: String = names.iter().map(|name| format!("(q {name})")).collect();
    let text = format!(
        "(define (problem p) (:domain d) (:objects {}) (:init {init}) (:goal (p o0 o1 o2 o3)))",
        names.join(" ")
    );
    let problem = Problem::parse(text.as_bytes(), "p", &domain).unwrap();
    let fault = Grounded::new(&domain, &problem).err().unwrap();
    assert!(matches!(fault, GroundFault::TooLarge { most: 200_000, .. }));
    assert_eq!(
        fault.to_string(),
        "the problem `p` is too large: it has more than 200000 reachable actions; use fewer objects, or more precise types"
    );
}

#[test]
fn an_action_of_a_thousand_preconditions_on_constants_is_grounded() {
    let of = |word: &str| (0..1000).map(|i| word.replace('#', &i.to_string())).collect::<String>();
    let (names, facts) = (of("c# "), of("(p c#) "));
    let domain = format!(
        "(define (domain d) (:predicates (p ?x) (q)) (:constants {names})
          (:action a :parameters () :precondition (and {facts}) :effect (q)))"
    );
    let domain = Domain::parse(domain.as_bytes(), "d", Bodies::Read).unwrap();
    let problem = format!("(define (problem p) (:domain d) (:init {facts}) (:goal (q)))");
    let problem = Problem::parse(problem.as_bytes(), "p", &domain).unwrap();
    assert_eq!(Grounded::new(&domain, &problem).unwrap().operators.len(), 1);
}

#[test]
fn a_predicate_of_a_hundred_arguments_is_reached() {
    let of = |word: &str| (0..100).map(|i| word.replace('#', &i.to_string())).collect::<String>();
    let variables = of(" ?x#");
    let domain = format!(
        "(define (domain d) (:predicates (p{variables}) (q ?x))
          (:action a :parameters ({variables}) :precondition (p{variables}) :effect (q ?x99)))"
    );
    let domain = Domain::parse(domain.as_bytes(), "d", Bodies::Read).unwrap();
    let objects = of(" o#");
    let problem = format!(
        "(define (problem p) (:domain d) (:objects {objects}) (:init (p{objects})) (:goal (q o99)))"
    );
    let problem = Problem::parse(problem.as_bytes(), "p", &domain).unwrap();
    assert_eq!(Grounded::new(&domain, &problem).unwrap().operators.len(), 1);
}
