//! PDDL as people write it: each form is read, with a warning where it is sloppy, or refused in a sentence.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use symbolt::plan::strips::{Bodies, Domain, GroundFault, Grounded, Problem, validate};

const DOMAIN: &str = include_str!("../fixtures/pddl/move.pddl");
const PROBLEM: &str = include_str!("../fixtures/pddl/move_one.pddl");

type Read = Result<(Domain, Problem), String>;

fn read(domain: &[u8], problem: &[u8]) -> Read {
    let domain = Domain::parse(domain, "d.pddl", Bodies::Read).map_err(|f| f.to_string())?;
    let problem = Problem::parse(problem, "p.pddl", &domain).map_err(|f| f.to_string())?;
    Ok((domain, problem))
}

/// Reads the domain and the problem after a change of each.
fn changed(domain: [&str; 2], problem: [&str; 2]) -> Read {
    let change = |text: &str, [from, to]: [&str; 2]| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    };
    read(change(DOMAIN, domain).as_bytes(), change(PROBLEM, problem).as_bytes())
}

const NONE: [&str; 2] = ["", ""];

/// Asserts that a plan of one action is found valid, and returns the warnings.
fn moved(read: Read) -> Vec<String> {
    let (domain, problem) = read.unwrap_or_else(|fault| panic!("{fault}"));
    let grounded = Grounded::new(&domain, &problem).unwrap();
    assert!(grounded.operators.iter().any(|o| o.name == "(move x p1 p2)"), "{domain}{problem}");
    assert!(!grounded.goal.is_empty());
    validate(&domain, &problem, ["(move x p1 p2)"]).unwrap();
    assert!(validate(&domain, &problem, []).is_err());
    [domain.warnings, problem.warnings].concat()
}

fn warned(read: Read, warning: &str) {
    let warnings = moved(read);
    assert!(warnings.iter().any(|w| w.ends_with(warning)), "{warnings:?}\nexpected {warning}");
}

#[test]
fn adl_is_declared_and_not_used() {
    for requirement in
        [":adl", ":disjunctive-preconditions :universal-preconditions", ":fluents", ":time"]
    {
        let warnings = moved(changed([":strips :typing", requirement], NONE));
        assert_eq!(warnings.len(), usize::from([":fluents", ":time"].contains(&requirement)));
    }
    assert_eq!(moved(changed(["(:requirements :strips :typing)", ""], NONE)), [""; 0]);
}

#[test]
fn nested_empty_and_missing_parts_are_read() {
    moved(changed(["(at ?t ?a) (free ?b)", "(and (at ?t ?a)) (and) () (free ?b)"], NONE));
    moved(changed(["(not (free ?b)))", "(and (not (free ?b)) ()))"], NONE));
    moved(changed(
        ["(:action move", "(:action rest :precondition () :effect (and)) (:action move"],
        NONE,
    ));
    warned(
        changed(
            [
                "(:action move",
                "(:action rest :parameters () :precondition :effect (and)) (:action move",
            ],
            NONE,
        ),
        "`:precondition` of `rest` is empty",
    );
    moved(changed(NONE, ["(:init", "(:requirements :adl) (:init"]));
    warned(changed(NONE, ["(:init", "(:length (:serial 3)) (:init"]), "is ignored");
    warned(
        changed(NONE, ["(at x p1) (free p2)", "(and (at x p1) (free p2))"]),
        "the initial state has an `and`",
    );
}

#[test]
fn a_constant_is_listed_again_as_an_object() {
    let constant = ["(:predicates", "(:constants p1 - place) (:predicates"];
    warned(changed(constant, NONE), "the object `p1` is declared twice");
    // With its supertype, the constant stays what it is.
    warned(
        changed(constant, ["p1 p2 - place", "p2 - place p1 - object"]),
        "the object `p1` is declared twice",
    );
    // With a narrower type, the constant is of it in this problem.
    let wide = ["(:predicates", "(:constants p1) (:predicates"];
    warned(changed(wide, NONE), "the object `p1` is declared twice");
    let (domain, problem) = changed(wide, NONE).unwrap();
    moved(read(domain.to_string().as_bytes(), problem.to_string().as_bytes()));
    let fault = changed(constant, ["p1 p2 - place", "p2 - place p1 - thing"]).unwrap_err();
    assert!(
        fault.contains("the object `p1` is declared twice; expected one declaration"),
        "{fault}"
    );
}

#[test]
fn action_costs_are_read_and_counted() {
    let costs = |metric: &str| {
        let domain = DOMAIN
            .replace(
                "(:predicates",
                "(:functions (total-cost) - number (way ?a ?b - place)) (:predicates",
            )
            .replace(
                "(not (free ?b))",
                "(not (free ?b)) (increase (total-cost) (+ (way ?a ?b) 0.5))",
            );
        let problem = PROBLEM
            .replace("(:init", "(:init (= (total-cost) 0) (= (way p1 p2) 7)")
            .replace("(:goal", &format!("{metric} (:goal"));
        let (domain, problem) = read(domain.as_bytes(), problem.as_bytes()).unwrap();
        assert_eq!(moved(Ok((domain.clone(), problem.clone()))), [""; 0]);
        let grounded = Grounded::new(&domain, &problem).unwrap();
        let there = grounded.operators.iter().find(|o| o.name == "(move x p1 p2)");
        let printed = [domain.to_string(), problem.to_string()];
        let (again, same) = read(printed[0].as_bytes(), printed[1].as_bytes()).unwrap();
        assert_eq!([again.to_string(), same.to_string()], printed);
        there.unwrap().cost.value()
    };
    assert_eq!(costs("(:metric minimize (total-cost))"), 7.5);
    assert_eq!(costs(""), 7.5);
    let cost = |change: [&str; 2], metric: &str| {
        changed(change, ["(:goal", &format!("(:metric {metric}) (:goal")])
    };
    warned(
        cost(NONE, "maximize (total-cost)"),
        "the metric is ignored; only (minimize (FUNCTION OBJECT ...)) is read",
    );
    assert_eq!(moved(cost(NONE, "minimize (total-time)")), [""; 0]);
    let undeclared = ["(not (free ?b))", "(not (free ?b)) (increase (total-cost) 2)"];
    warned(changed(undeclared, NONE), "`total-cost` is not declared in :functions");
}

#[test]
fn a_cost_without_value_warns_and_a_fact_without_predicate_is_not_reached() {
    let costs = "(:functions (total-cost) (way ?a ?b - place)) (:predicates";
    let domain = DOMAIN.replace("(:predicates", costs).replace(
        "(not (free ?b))",
        "(not (free ?b)) (increase (total-cost) 2) (increase (total-cost) (way ?a ?b))",
    );
    let (domain, mut problem) = read(domain.as_bytes(), PROBLEM.as_bytes()).unwrap();
    let grounded = Grounded::new(&domain, &problem).unwrap();
    assert_eq!(grounded.operators[0].cost.value(), 2.0);
    let [warning] = grounded.warnings.as_slice() else { panic!("{:?}", grounded.warnings) };
    assert!(
        warning.starts_with("the problem gives no value for a part of the cost of `(move x p1")
    );
    problem.goal[0].1.predicate = "nowhere".into();
    let fault = Grounded::new(&domain, &problem).unwrap_err().to_string();
    assert!(fault.ends_with("the problem has no such predicate or objects"), "{fault}");
}

#[test]
fn numeric_fluents_other_than_costs_are_refused_where_a_condition_reads_them() {
    let with = |condition: &str, effect: &str| {
        let domain = DOMAIN
            .replace(
                "(:predicates",
                "(:functions (fuel ?t - thing) (size ?p - place)) (:predicates",
            )
            .replace("(at ?t ?a) (free ?b)", &format!("(at ?t ?a) (free ?b) {condition}"))
            .replace("(not (free ?b))", &format!("(not (free ?b)) {effect}"));
        let problem =
            PROBLEM.replace("(:init", "(:init (= (fuel x) 9) (= (size p1) 1) (= (size p2) 3)");
        read(domain.as_bytes(), problem.as_bytes())
    };
    let burn = "(decrease (fuel ?t) 1)";
    warned(with("", burn), "changes of the number `fuel` decide nothing and are ignored");
    let fault = with("(>= (fuel ?t) 1)", burn).unwrap_err();
    assert!(
        fault.contains("line 6, column") && fault.contains("the condition depends on the numeric fluent `fuel`, which actions change; of those only costs are read; expected a condition on predicates"),
        "{fault}"
    );
    // What no action changes is known.
    moved(with("(> (size ?b) (* 2 (size ?a))) (<= 1 (fuel ?t))", ""));
    let (domain, problem) = with("(< (size ?b) (size ?a))", "").unwrap();
    assert!(matches!(Grounded::new(&domain, &problem), Err(GroundFault::Unreachable { .. })));
    let (domain, _) = with("", burn).unwrap();
    let goal =
        Problem::parse(PROBLEM.replace("(at x p2)", "(= (fuel x) 3)").as_bytes(), "p", &domain);
    assert!(goal.unwrap_err().to_string().contains("numeric fluent `fuel`"));
}

#[test]
fn types_are_sloppy() {
    moved(changed(NONE, ["x - thing", "x - (either thing tool)"]));
    moved(changed(["?t - thing ?a", "?t - (either thing tool) ?a"], NONE));
    warned(
        changed(["(:types place thing", "(:types place\n  shelf table - place thing"], NONE),
        "the type `place` is declared as its own supertype",
    );
    moved(changed(["(:types place thing", "(:types object - object place thing - object"], NONE));
    warned(
        changed(["?a ?b - place)", "?a ?b -place)"], NONE),
        "a space is missing after `-` in `-place`",
    );
    warned(
        changed(["?a ?b - place)", "?a ?b- place)"], NONE),
        "a space is missing before `-` in `?b-`",
    );
    warned(
        changed(["?a ?b - place)", "?a?b - place)"], NONE),
        "a space is missing before `?` in `?a?b`",
    );
    warned(changed(["(at ?t ?a)", "(at?t ?a)"], NONE), "a space is missing before `?` in `at?t`");
    warned(
        changed(["?a ?b - place)", "?a ?b)"], NONE),
        "`?b` is of type object where place is expected",
    );
    let fault = changed(["(at ?t ?a)", "(at ?a ?t)"], NONE).unwrap_err();
    assert!(fault.contains("`?a` is of type place; expected thing"), "{fault}");
    let fault = changed(["?a ?b - place)", "?a ?b - plase)"], NONE).unwrap_err();
    assert!(
        fault.contains("has the unknown type `plase` (did you mean `place`?); expected one of"),
        "{fault}"
    );
}

#[test]
fn types_are_used_as_predicates() {
    let in_condition = ["(free ?b))", "(free ?b) (thing ?t) (not (tool ?t)) (place ?b))"];
    warned(changed(in_condition, NONE), "the type `place` is used as a predicate");
    let (domain, problem) = changed(["(free ?b))", "(free ?b) (tool ?t))"], NONE).unwrap();
    assert!(Grounded::new(&domain, &problem).is_err(), "x is no tool");
    warned(
        changed(NONE, ["(:init", "(:init (thing x)"]),
        "the type `thing` is used as a predicate",
    );
}

#[test]
fn a_type_is_a_predicate_of_the_goal_alone() {
    let goal = |goal: &str| changed(NONE, ["(at x p2)", goal]);
    let some =
        "(exists (?o) (and (thing ?o) (forall (?p) (imply (place ?p) (or (free ?p) (at x p2))))))";
    warned(
        goal(&format!("(and (at x p2) (thing x) (not (tool x)) {some})")),
        "`tool` is used as a predicate",
    );
    for never in ["(tool x)", "(not (thing x))", "(exists (?o) (tool ?o))"] {
        let (domain, problem) = goal(&format!("(and (at x p2) {never})")).unwrap();
        assert!(validate(&domain, &problem, ["(move x p1 p2)"]).is_err(), "{never}");
        let fault = Grounded::new(&domain, &problem).unwrap_err();
        assert!(matches!(fault, GroundFault::Unreachable { .. }), "{fault}");
        read(domain.to_string().as_bytes(), problem.to_string().as_bytes()).unwrap();
    }
}

#[test]
fn variables_of_one_name_stay_apart_when_they_are_printed() {
    let domain =
        "(define (domain d) (:types box) (:predicates (p ?x) (q ?x)) (:action a :parameters (?x)
        :effect (when (not (q ?x)) (forall (?x) (when (p ?x) (forall (?x) (q ?x)))))))";
    let problem =
        "(define (problem p) (:domain d) (:objects o1 o2 - object b - box) (:init (p o1) (q o2))
        (:goal (and (q b) (exists (?a-box) (and (box ?a-box) (q ?a-box))))))";
    let (domain, problem) = read(domain.as_bytes(), problem.as_bytes()).unwrap();
    let (domain_text, problem_text) = (domain.to_string(), problem.to_string());
    let again = read(domain_text.as_bytes(), problem_text.as_bytes()).unwrap();
    for plan in [["(a o1)"], ["(a o2)"]] {
        let sound = plan == ["(a o1)"];
        assert_eq!(validate(&domain, &problem, plan).is_ok(), sound);
        assert_eq!(validate(&again.0, &again.1, plan).is_ok(), sound, "{domain_text}");
    }
    let operators = |(domain, problem)| Grounded::new(domain, problem).unwrap().operators;
    assert_eq!(operators((&domain, &problem)), operators((&again.0, &again.1)), "{problem_text}");
}

#[test]
fn predicates_are_declared_twice_and_by_arity() {
    warned(
        changed(["(free ?p - place)", "(free ?p - place) (free ?q - place)"], NONE),
        "the predicate `free` is declared twice",
    );
    warned(
        changed(["(free ?p - place)", "(free ?p - place) (at ?t - thing)"], NONE),
        "the predicate `at` is declared with several numbers of arguments",
    );
    // The two are told apart.
    let both = changed(
        ["(free ?p - place)", "(free ?p - place) (at ?t - thing)"],
        ["(at x p2)", "(and (at x p2) (not (at x)))"],
    );
    moved(both);
    let fault = changed(["(at ?t ?a)", "(at ?t ?a ?b)"], NONE).unwrap_err();
    assert!(fault.contains("`(at ...)` has 3 arguments; expected 2"), "{fault}");
    warned(
        changed(["(free ?p - place)", "(free ?p - place) (near ?p ?p - place)"], NONE),
        "the parameter `?p` is declared twice",
    );
    let fault = changed(["(free ?b)", "(freee ?b)"], NONE).unwrap_err();
    assert!(
        fault.contains(
            "`(freee ...)` is no predicate; expected one of: at, free, seen (did you mean `free`?)"
        ),
        "{fault}"
    );
}

#[test]
fn a_predicate_of_objects_is_called_less() {
    let wants = |condition: &str| {
        let domain = DOMAIN
            .replace("(:predicates", "(:functions (f)) (:predicates (< ?a ?b - place)")
            .replace("(free ?b))\n", &format!("(free ?b) {condition})\n"));
        let problem = PROBLEM.replace("(at x p1)", "(= (f) 1) (at x p1) (< p1 p2)");
        read(domain.as_bytes(), problem.as_bytes())
    };
    moved(wants("(< ?a ?b) (< 0 (f)) (< (f) 2)"));
    let (domain, problem) = wants("(< ?b ?a)").unwrap();
    assert!(matches!(Grounded::new(&domain, &problem), Err(GroundFault::Unreachable { .. })));
}

#[test]
fn commas_an_equality_that_is_declared_and_costs_without_parentheses_are_read() {
    warned(
        changed(["(?t - thing ?a ?b - place)", "(?t - thing, ?a, ?b - place)"], NONE),
        "`?a,` is ignored",
    );
    warned(changed(["?a ?b - place)", "?a,?b , - place)"], NONE), "the comma in `,` is ignored");
    warned(
        changed(["(seen ?t - thing)", "(seen ?t - thing) (= ?a ?b)"], NONE),
        "`=` compares objects without a declaration",
    );
    let domain = DOMAIN.replace("(:predicates", "(:functions (total-cost)) (:predicates");
    let domain = domain.replace("(not (free ?b))", "(not (free ?b)) (increase total-cost 3)");
    let problem = PROBLEM.replace("(:goal", "(:metric minimize total-cost) (:goal");
    let (domain, problem) = read(domain.as_bytes(), problem.as_bytes()).unwrap();
    assert_eq!(Grounded::new(&domain, &problem).unwrap().operators[0].cost.value(), 3.0);
    let warnings = moved(Ok((domain, problem)));
    let sloppy = |w: &&String| w.ends_with("`total-cost` has no parentheses");
    assert_eq!(warnings.iter().filter(sloppy).count(), 2, "{warnings:?}");
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    warned(
        changed(NONE, ["(:goal", "(:metric minimize (total-cost)) (:goal"]),
        "the domain has no function `total-cost`: the metric is ignored; only (minimize (FUNCTION OBJECT ...)) is read",
    );
}

#[test]
fn names_in_another_case_and_other_alphabets_are_the_same() {
    moved(changed(["(at ?t ?a)", "(AT ?T ?A)"], ["(at x p2)", "(At X P2)"]));
    let domain = DOMAIN.replace("free", "FREI-ÄÖ").replacen("FREI-ÄÖ", "frei-äö", 1);
    moved(read(domain.as_bytes(), PROBLEM.replace("free", "Frei-Äö").as_bytes()));
}

#[test]
fn comments_and_names_in_latin_1_are_read() {
    let latin =
        |text: &str| text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect::<Vec<u8>>();
    let domain = latin(&format!("; für alle\n{}", DOMAIN.replace("free", "frei-ä")));
    let problem = latin(&PROBLEM.replace("free", "FREI-Ä"));
    warned(read(&domain, &problem), "a byte is no character of UTF-8; the text is read as Latin-1");
    let wide: Vec<u8> =
        [0xfeff].into_iter().chain(DOMAIN.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    warned(read(&wide, PROBLEM.as_bytes()), "the text is UTF-16, not UTF-8");
}

#[test]
fn a_domain_with_thousands_of_constants_is_read_at_once() {
    let names: String = (0..5000).map(|i| format!("k{i} ")).collect();
    let began = std::time::Instant::now();
    moved(changed(["(:predicates", &format!("(:constants {names}- tool) (:predicates")], NONE));
    assert!(began.elapsed().as_secs() < 5, "{:?}", began.elapsed());
}

#[test]
fn a_problem_names_another_domain_and_objects_are_numbers() {
    let other = ["(:domain shelf)", "(:domain shelfs)"];
    warned(changed(NONE, other), "the problem names another domain than `shelf`");
    // Equality of objects whose names are numbers is no comparison of numbers.
    let (condition, more) = ("(at ?t ?a)", "(at ?t ?a) (not (= ?a 2)) (not (= 2 ?a))");
    let domain = DOMAIN.replacen(condition, more, 1);
    let domain = domain.replace("(:predicates", "(:constants 2 - place) (:predicates");
    moved(read(domain.as_bytes(), PROBLEM.as_bytes()));
}

#[test]
fn domain_and_problem_are_in_one_file_or_swapped() {
    let both = format!("{DOMAIN}\n{PROBLEM}");
    assert_eq!(moved(read(both.as_bytes(), both.as_bytes())), [""; 0]);
    let fault = read(PROBLEM.as_bytes(), DOMAIN.as_bytes()).unwrap_err();
    assert!(fault.contains("`(define (problem ...)` is no domain"), "{fault}");
    for (text, what) in [
        ("(:trajectory (:state))", "a trajectory is no domain"),
        ("((:objects a) (:init))", "a trajectory is no domain"),
        ("{\"format\": 1}", "this seems to be JSON and is no domain"),
        ("(define (domain))", "the domain has no name"),
        ("", "the text is empty"),
    ] {
        let fault = read(text.as_bytes(), b"").unwrap_err();
        assert!(fault.contains(what), "{fault}");
    }
}

#[test]
fn quantifiers_alternatives_and_effects_under_conditions_are_read() {
    moved(changed(NONE, ["(at x p2)", "(forall (?t - thing) (at ?t p2))"]));
    moved(changed(NONE, ["(at x p2)", "(exists (?t - thing) (or (at ?t p2) (seen ?t)))"]));
    moved(changed(["(free ?b))", "(or (free ?b) (seen ?t)))"], NONE));
    moved(changed(["(free ?b))", "(imply (seen ?t) (at ?t ?b)) (free ?b))"], NONE));
    moved(changed(
        ["(at ?t ?b)", "(forall (?o - thing) (when (and (at ?o ?a) (= ?o ?t)) (at ?o ?b)))"],
        NONE,
    ));
    moved(changed(
        [
            "(:action move",
            "(:derived (busy ?p - place) (exists (?t - thing) (at ?t ?p))) (:action move",
        ],
        ["(at x p2)", "(and (busy p2) (not (busy p1)))"],
    ));
}

#[test]
fn a_derived_predicate_that_needs_itself_is_read_and_one_that_needs_its_opposite_refused() {
    let rules = |of: &str| {
        format!(
            "(:derived (above ?a ?b - place) (or (free ?a) {of})) (:derived (below ?a ?b - place) (above ?b ?a)) (:action move"
        )
    };
    changed(["(:action move", &rules("(below ?b ?a)")], NONE).expect("recursion");
    let fault = changed(["(:action move", &rules("(not (below ?b ?a))")], NONE).unwrap_err();
    assert!(
        fault.contains(
            "`above` is derived by way of its own opposite; expected derived predicates that do not need their opposites"
        ),
        "{fault}"
    );
    let rule = "(:derived (free ?p - place) (not (seen x))) (:action move";
    let fault = changed(
        ["(:action move", &rule.replace("(seen x)", "(exists (?t - thing) (seen ?t))")],
        NONE,
    );
    assert!(fault.unwrap_err().contains("an action changes the derived predicate `free`"));
}

#[test]
fn durative_actions_are_read_as_instant_ones() {
    let text = include_str!("../fixtures/pddl/rooms_durative.pddl");
    let domain = Domain::parse(text.as_bytes(), "d", Bodies::Read).unwrap();
    let lost = |domain: &Domain| {
        let lost = domain.warnings.iter().filter(|w| w.contains("are read as instant ones"));
        lost.count()
    };
    assert_eq!(lost(&domain), 1, "{:?}", domain.warnings);
    let domain = Domain::parse(text.as_bytes(), "d", Bodies::Instant).unwrap();
    assert_eq!(lost(&domain), 0);
    let problem =
        "(define (problem p) (:domain rooms) (:objects kitchen hall - room r2 - robot apple - food)
        (:init (robot_at r2 hall) (connected hall kitchen) (charged r2) (item_at apple kitchen))
        (:goal (and (item_held r2 apple) (robot_at r2 kitchen))))";
    let problem = Problem::parse(problem.as_bytes(), "p", &domain).unwrap();
    validate(&domain, &problem, ["(move r2 hall kitchen)", "(grasp r2 apple kitchen)"]).unwrap();
    let fault = validate(&domain, &problem, ["(grasp r2 apple kitchen)"]).unwrap_err();
    assert!(fault.to_string().contains("needs (robot_at r2 kitchen)"), "{fault}");
    let grounded = Grounded::new(&domain, &problem).unwrap();
    let there = grounded.operators.iter().find(|o| o.name == "(move r2 hall kitchen)").unwrap();
    // (moving r2) holds during the action alone.
    let shown: Vec<String> =
        there.preconditions.iter().map(|f| grounded.fluents[*f].to_string()).collect();
    assert_eq!(shown, ["(robot_at r2 hall)"]);
    assert_eq!(there.cost.value(), 5.0);
}

#[test]
fn a_durative_effect_that_another_may_undo_is_refused_under_conditions() {
    let read = |effect: &str| {
        let text = format!(
            "(define (domain d) (:predicates (p) (c)) (:durative-action a :parameters () :duration (= ?duration 1) :condition () :effect (and {effect})))"
        );
        Domain::parse(text.as_bytes(), "d", Bodies::Instant)
    };
    for effect in [
        "(at start (p)) (at end (when (c) (not (p))))",
        "(at start (when (c) (p))) (at end (not (p)))",
        "(at start (when (c) (p))) (at end (when (c) (not (p))))",
    ] {
        let fault = read(effect).unwrap_err().to_string();
        let said =
            "effects at the start and at the end of `a` on `p` under conditions cannot be read";
        assert!(fault.contains(said), "{fault}");
    }
    // What is made true is true afterwards.
    read("(at start (not (p))) (at end (when (c) (p)))").unwrap();
    read("(at start (p)) (at end (not (p))) (at end (when (c) (c)))").unwrap();
}

#[test]
fn preferences_are_left_out_with_one_warning() {
    let wished =
        "(free ?b) (preference (seen ?t)) (forall (?p - place) (preference two (free ?p))))";
    let warnings = moved(changed(
        ["(free ?b))", wished],
        ["(at x p2)", "(and (at x p2) (preference p1 (at x p1)))"],
    ));
    let left_out = warnings.iter().filter(|w| w.contains("preferences are left out"));
    assert_eq!(left_out.count(), 2, "one for the action and one for the goal: {warnings:?}");
}

#[test]
fn what_this_planner_does_not_have_is_refused_in_words_of_planning() {
    let sections = [
        ["(:action move", "(:process p :parameters () :precondition () :effect ()) (:action move"],
        ["(:action move", "(:constraints (always (free p1))) (:action move"],
        ["(:action move", "(:method m) (:action move"],
        ["(free ?b))", "(free ?b) (or (seen ?t) (preference one (seen ?t))))"],
        ["(not (free ?b))", "(when (preference one (seen ?t)) (not (free ?b)))"],
        ["(not (free ?b))", "(probabilistic 0.5 (not (free ?b)))"],
        ["(not (free ?b))", "(oneof (seen ?t) (not (free ?b)))"],
        ["(not (free ?b))", "(exists (?x - place) (free ?x))"],
    ];
    for (change, words) in sections.into_iter().zip([
        "needs processes and events, which go on by themselves",
        "needs constraints on the states along a plan",
        "needs hierarchical tasks and methods",
        "a preference stands where it would decide whether something else holds",
        "a preference stands where it would decide whether something else holds",
        "makes the effect uncertain",
        "makes the effect uncertain",
        "makes the effect uncertain",
    ]) {
        let fault = changed(change, NONE).unwrap_err();
        assert!(fault.starts_with("d.pddl, line ") && fault.contains(words), "{fault}");
    }
    for (change, words) in [
        (["(:init", "(:init (at 5 (free p1))"], "a timed initial literal"),
        (
            ["(:goal", "(:constraints (always (free p1))) (:goal"],
            "constraints on the states along a plan",
        ),
        (["(at x p2)", "(sometime (at x p2))"], "`(sometime ...)` is a constraint"),
        (["(:init", "(:init (oneof (free p1) (at x p1))"], "makes the initial state uncertain"),
    ] {
        let fault = changed(NONE, change).unwrap_err();
        assert!(fault.starts_with("p.pddl, line ") && fault.contains(words), "{fault}");
    }
}

#[test]
fn a_part_of_an_action_is_misspelt_or_has_several_values() {
    for (change, words) in [
        ([":precondition", ":preconditions"], "(did you mean `:precondition`?)"),
        ([":effect", ":effects"], "(did you mean `:effect`?)"),
        (
            [":effect", "(free ?a) :effect"],
            "`(free ...)` follows a complete part of the action; expected several in one (and ...)",
        ),
        (
            [":parameters", ":parameters ?t"],
            "`?t` is no list of parameters; expected (?PARAMETER - TYPE ...)",
        ),
        (["(domain ", "(domain my "], "the domain has no name of one word"),
    ] {
        let fault = changed(change, NONE).unwrap_err();
        assert!(fault.starts_with("d.pddl, line ") && fault.contains(words), "{fault}");
    }
}

#[test]
fn an_object_that_a_goal_misspells_is_looked_for_among_the_objects_of_the_problem() {
    for goal in ["(not (at x p22))", "(or (at x p22) (at x p1))", "(at x p22)"] {
        let fault = changed(NONE, ["(at x p2)", goal]).unwrap_err();
        let words =
            "`p22` is no object; expected an object of :objects or :constants (did you mean `p2`?)";
        assert!(fault.contains(words), "{fault}");
    }
    let quantified = "(exists (?o - object) (and (at ?o p22) (at ?o p2)))";
    let fault = changed(NONE, ["(at x p2)", quantified]).unwrap_err();
    assert!(fault.contains("one of: ?o, ") && fault.contains("did you mean `p2`?"), "{fault}");
}

#[test]
fn a_goal_of_many_facts_is_not_printed_whole() {
    let objects: String = (0..40).map(|i| format!("y{i} ")).collect();
    let goal: String = (0..40).map(|i| format!("(at y{i} p2) ")).collect();
    let problem = PROBLEM
        .replace("x - thing", &format!("x {objects}- thing"))
        .replace("(at x p2)", &format!("(and {goal})"));
    let (domain, problem) = read(DOMAIN.as_bytes(), problem.as_bytes()).unwrap();
    let fault = validate(&domain, &problem, []).unwrap_err().to_string();
    assert_eq!(
        fault,
        "after the last step, (at y0 p2), (at y1 p2), (at y2 p2) and 37 more of the goal do not hold"
    );
}

#[test]
fn domains_in_the_shapes_of_public_collections_mean_what_they_say() {
    macro_rules! file {
        ($name:literal) => {
            ($name, include_str!(concat!("../fixtures/pddl/", $name, ".pddl")))
        };
    }
    let cases = [
        (file!("lift"), 5),
        (file!("suitcase"), 3),
        (file!("paint_shop"), 3),
        (file!("forks"), 2),
        (file!("orders"), 8),
        (file!("pushing"), 2),
        (file!("parcels"), 6),
        (file!("trays"), 3),
        (file!("patrol_durative"), 5),
    ];
    for ((name, text), length) in cases {
        let (domain, problem) =
            read(text.as_bytes(), text.as_bytes()).unwrap_or_else(|f| panic!("{name}: {f}"));
        let (states, calls, shortest) = super::adl::compare(&domain, &problem, 3_000);
        assert_eq!(shortest, Some(length), "{name}: {states} states, {calls} calls");
        let again = [domain.to_string(), problem.to_string()];
        let (same, _) = read(again[0].as_bytes(), again[1].as_bytes()).unwrap();
        assert_eq!(same.to_string(), again[0], "{name}");
    }
}

#[test]
fn what_is_said_twice_or_both_ways_is_warned_of() {
    let [facts, twice] = ["(free p2))", "(free p2)) (:init (seen x))"];
    warned(changed(NONE, [facts, twice]), "a second `(:init ...)`; both are read as one");
    let both = "(free p2) (not (free p2)))";
    warned(
        changed(NONE, [facts, both]),
        "`(free p2)` is said to hold at first and not to; it holds",
    );
    let [last, more] = ["(seen ?t - thing))", "(seen ?t - thing)) (:predicates (red ?t))"];
    warned(changed([last, more], NONE), "a second `(:predicates ...)`; both are read as one");
    let read = changed([":strips :typing", "typing"], NONE);
    warned(read, "the requirement `typing` has no colon, and is read as if it had");
    assert_eq!(moved(changed(NONE, [facts, "(free p2) (not (seen x)))"])), [""; 0]);
}

#[test]
fn conditions_that_lack_a_word_are_told_what_they_lack() {
    let needs = "(and (at ?t ?a) (free ?b))";
    for (domain, problem, said) in [
        ([needs, "((at ?t ?a) (free ?b))"], NONE, "no literal; expected (and (PREDICATE ...) ...)"),
        (
            ["(not (at ?t ?a)) (not (free ?b))", "(not (at ?t ?a) (free ?b))"],
            NONE,
            "`(not ...)` has 2 parts; expected one",
        ),
        (
            NONE,
            ["(free p2))", "(forall (?p - place) (free ?p)))"],
            "`(forall ...)` is no fact; expected each fact that holds at first, one by one",
        ),
    ] {
        let fault = changed(domain, problem).expect_err("refused");
        assert!(fault.contains(said), "{fault}");
    }
}
