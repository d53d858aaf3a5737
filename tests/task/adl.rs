//! Conditions and effects beyond STRIPS, compiled, against a search by their meaning.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::{BTreeSet, HashMap, HashSet, VecDeque};

use rand::{Rng, RngExt};
use symbolt::plan::strips::{
    Bodies, Domain, Fact, Fluent, GroundFault, Grounded, Problem, Typed, validate,
};
use symbolt::sim::Seed;

fn parse(domain: &str, problem: &str) -> (Domain, Problem) {
    let domain = Domain::parse(domain.as_bytes(), "domain.pddl", Bodies::Read)
        .unwrap_or_else(|fault| panic!("{fault}\n{domain}"));
    let problem = Problem::parse(problem.as_bytes(), "problem.pddl", &domain)
        .unwrap_or_else(|fault| panic!("{fault}\n{problem}"));
    (domain, problem)
}

/// Returns all calls of a domain with objects of the right types.
fn calls(domain: &Domain, problem: &Problem) -> Vec<String> {
    let objects: Vec<&Typed> = domain.constants.iter().chain(&problem.objects).collect();
    let mut all = Vec::new();
    for action in &domain.actions {
        let mut calls = vec![format!("({}", action.name)];
        for parameter in &action.parameters {
            let fits = |o: &&&Typed| domain.types.may_be(&o.types, &parameter.types);
            let with = |call: &String| {
                let own = objects.iter().filter(fits);
                own.map(|o| format!("{call} {}", o.name)).collect::<Vec<_>>()
            };
            calls = calls.iter().flat_map(with).collect();
        }
        all.extend(calls.into_iter().map(|call| call + ")"));
    }
    all
}

/// A problem by the meaning of its conditions.
pub struct Meaning<'a> {
    domain: &'a Domain,
    problem: &'a Problem,
    calls: Vec<String>,
}

impl<'a> Meaning<'a> {
    pub fn new(domain: &'a Domain, problem: &'a Problem) -> Self {
        Self { domain, problem, calls: calls(domain, problem) }
    }

    fn at(&self, state: &BTreeSet<Fact>) -> Problem {
        Problem { init: state.iter().cloned().collect(), ..self.problem.clone() }
    }

    pub fn met(&self, state: &BTreeSet<Fact>) -> bool {
        validate(self.domain, &self.at(state), []).is_ok()
    }

    pub fn after(&self, state: &BTreeSet<Fact>) -> Vec<(&str, BTreeSet<Fact>)> {
        let here = Problem { goal: Vec::new(), conditions: Vec::new(), ..self.at(state) };
        let next = self.calls.iter().filter_map(|call| {
            let after = validate(self.domain, &here, [call.as_str()]).ok()?;
            (after != *state).then_some((call.as_str(), after))
        });
        next.collect()
    }

    /// Returns the length of the shortest plan, and the states that were seen. At most so many states are looked at.
    fn shortest(&self, most: usize) -> (Option<usize>, Vec<BTreeSet<Fact>>, bool) {
        let start: BTreeSet<Fact> = self.problem.init.iter().cloned().collect();
        let mut seen = HashSet::from([start.clone()]);
        let (mut order, mut open, mut found) = (Vec::new(), VecDeque::from([(start, 0)]), None);
        while let Some((state, length)) = open.pop_front() {
            if found.is_none() && self.met(&state) {
                found = Some(length);
            }
            if seen.len() < most {
                for (_, next) in self.after(&state) {
                    if seen.insert(next.clone()) {
                        open.push_back((next, length + 1));
                    }
                }
            }
            order.push(state);
        }
        let whole = seen.len() < most;
        (found, order, whole)
    }
}

/// Carries out all hidden operators that can be, until nothing changes. They make nothing false.
pub fn close(grounded: &Grounded, state: &mut BTreeSet<usize>, mut done: impl FnMut(usize)) {
    let hidden = || grounded.operators.iter().enumerate().filter(|(_, o)| o.is_hidden());
    let mut changed = true;
    while std::mem::take(&mut changed) {
        for (at, operator) in hidden() {
            let fresh = operator.adds.iter().any(|fluent| !state.contains(fluent));
            if fresh && Grounded::all_hold(state, &operator.preconditions) {
                assert!(operator.deletes.is_empty());
                operator.apply(state);
                done(at);
                changed = true;
            }
        }
    }
}

/// Returns a plan of a grounded problem with as few actions as possible.
fn plan_of(grounded: &Grounded) -> Option<Vec<usize>> {
    let mut first = Vec::new();
    let mut start: BTreeSet<usize> = grounded.start.iter().copied().collect();
    close(grounded, &mut start, |at| first.push(at));
    type From = Option<(BTreeSet<usize>, Vec<usize>)>;
    let mut from: HashMap<BTreeSet<usize>, From> = HashMap::from([(start.clone(), None)]);
    let mut open = VecDeque::from([start]);
    while let Some(state) = open.pop_front() {
        if Grounded::all_hold(&state, &grounded.goal) {
            let (mut plan, mut at) = (Vec::new(), &state);
            while let Some((before, steps)) = &from[at] {
                plan.extend(steps.iter().rev());
                at = before;
            }
            plan.reverse();
            return Some([first, plan].concat());
        }
        let actions = grounded.operators.iter().enumerate().filter(|(_, o)| !o.is_hidden());
        for (at, operator) in actions {
            if Grounded::all_hold(&state, &operator.preconditions) {
                let (mut next, mut steps) = (state.clone(), vec![at]);
                operator.apply(&mut next);
                close(grounded, &mut next, |at| steps.push(at));
                if !from.contains_key(&next) {
                    from.insert(next.clone(), Some((state.clone(), steps)));
                    open.push_back(next);
                }
            }
        }
    }
    None
}

/// Returns the fluents that hold when exactly these facts do, of those that are facts of the problem.
pub fn fluents(grounded: &Grounded, facts: &BTreeSet<Fact>) -> BTreeSet<usize> {
    let holds = |index: &usize| {
        let fluent = &grounded.fluents[*index];
        facts.contains(&fluent.fact) == fluent.holds
    };
    (0..grounded.fluents.len()).filter(holds).collect()
}

/// Returns the fluents of a state without those that stand for conditions.
pub fn of_facts(grounded: &Grounded, mut state: BTreeSet<usize>) -> BTreeSet<usize> {
    state.retain(|fluent| !grounded.fluents[*fluent].fact.predicate.contains(' '));
    state
}

/// Returns the facts that hold in a state of fluents.
fn of(grounded: &Grounded, state: &BTreeSet<usize>) -> BTreeSet<Fact> {
    let fluents = state.iter().map(|fluent| &grounded.fluents[*fluent]);
    let facts = fluents.filter(|f| f.holds && !f.fact.predicate.contains(' '));
    facts.map(|fluent| fluent.fact.clone()).collect()
}

/// Compares the operators in each state with what the actions do there by their meaning. Returns the number of states and
/// of calls, and the length of the shortest plan.
pub fn compare(domain: &Domain, problem: &Problem, most: usize) -> (usize, usize, Option<usize>) {
    compare_written(domain, problem, most, usize::MAX)
}

/// Compares with at most so many ways of a condition written out.
fn compare_written(
    domain: &Domain,
    problem: &Problem,
    most: usize,
    ways: usize,
) -> (usize, usize, Option<usize>) {
    let meaning = Meaning::new(domain, problem);
    let (shortest, states, whole) = meaning.shortest(most);
    let grounded = match Grounded::with_most_ways(domain, problem, ways) {
        Ok(grounded) => grounded,
        Err(fault @ GroundFault::Unreachable { .. }) => {
            assert!(shortest.is_none(), "{fault}\n{domain}{problem}");
            return (states.len(), 0, None);
        }
        Err(fault) => panic!("{fault}"),
    };
    let mut compared = 0;
    for state in &states {
        let before = fluents(&grounded, state);
        let mut able_in = before.clone();
        close(&grounded, &mut able_in, |_| {});
        let wanted: BTreeSet<(String, BTreeSet<usize>)> = meaning
            .after(state)
            .into_iter()
            .map(|(call, after)| (call.to_owned(), fluents(&grounded, &after)))
            .filter(|(_, after)| *after != before)
            .collect();
        let able = grounded.operators.iter().filter(|o| !o.is_hidden());
        let able = able.filter(|o| Grounded::all_hold(&able_in, &o.preconditions));
        let found: BTreeSet<(String, BTreeSet<usize>)> = able
            .map(|o| {
                let mut after = able_in.clone();
                o.apply(&mut after);
                // What is made false is derived anew where it still holds.
                let (mut kept, mut fresh) =
                    (after.clone(), fluents(&grounded, &of(&grounded, &after)));
                close(&grounded, &mut kept, |_| {});
                close(&grounded, &mut fresh, |_| {});
                // A goal of one part with alternatives ends the plan.
                for set in [&mut kept, &mut fresh] {
                    set.retain(|f| grounded.fluents[*f].fact.predicate != "the goal");
                }
                assert_eq!(kept, fresh, "after {} in {state:?}\n{domain}{problem}", o.name);
                (o.name.clone(), of_facts(&grounded, after))
            })
            .filter(|(_, after)| *after != before)
            .collect();
        assert_eq!(found, wanted, "in {state:?}\n{domain}{problem}{grounded:?}");
        compared += wanted.len();
    }
    let plan = plan_of(&grounded);
    let steps = plan.as_ref().map(|plan| grounded.steps(plan.iter().copied()));
    if whole {
        assert_eq!(steps.as_ref().map(Vec::len), shortest, "{domain}{problem}{grounded:?}");
    }
    if let Some(steps) = steps {
        validate(domain, problem, steps).expect("a valid plan");
    }
    (states.len(), compared, shortest)
}

/// Draws formulas over variables in scope.
struct Draw<'r> {
    rng: &'r mut dyn Rng,
}

impl Draw<'_> {
    fn upto(&mut self, most: usize) -> usize {
        self.rng.random_range(0..=most)
    }

    fn term(&mut self, scope: &[String]) -> String {
        match self.upto(scope.len()) {
            0 => "c".into(),
            at => scope[at - 1].clone(),
        }
    }

    fn atom(&mut self, scope: &[String], derived: bool) -> String {
        match self.upto(if derived { 5 } else { 3 }) {
            0 => "(p)".into(),
            1 | 2 => format!("(q {})", self.term(scope)),
            3 => format!("(r {} {})", self.term(scope), self.term(scope)),
            4 => format!("(d {})", self.term(scope)),
            _ => format!("(e {})", self.term(scope)),
        }
    }

    fn formula(&mut self, scope: &[String], depth: usize, derived: bool) -> String {
        if depth == 0 {
            return match self.upto(5) {
                0 => format!("(= {} {})", self.term(scope), self.term(scope)),
                1 => format!("(s {})", self.term(scope)),
                2 => format!("(not {})", self.atom(scope, derived)),
                _ => self.atom(scope, derived),
            };
        }
        let inner = |draw: &mut Self, scope: &[String]| {
            let depth = draw.upto(depth - 1);
            draw.formula(scope, depth, derived)
        };
        match self.upto(6) {
            0 => format!("(not {})", inner(self, scope)),
            1 => format!("(imply {} {})", inner(self, scope), inner(self, scope)),
            kind @ (2 | 3) => {
                let word = if kind == 2 { "and" } else { "or" };
                format!("({word} {} {})", inner(self, scope), inner(self, scope))
            }
            4 => inner(self, scope),
            kind => {
                // A name may hide another.
                let name = if self.upto(3) == 0 { "?x".into() } else { format!("?v{depth}") };
                let scope = [scope, std::slice::from_ref(&name)].concat();
                let word = if kind == 5 { "exists" } else { "forall" };
                let of = if self.upto(1) == 0 { "thing" } else { "object" };
                format!("({word} ({name} - {of}) {})", inner(self, &scope))
            }
        }
    }

    fn effect(&mut self, scope: &[String], depth: usize) -> String {
        match self.upto(if depth == 0 { 1 } else { 5 }) {
            0 => format!("(not {})", self.atom(scope, false)),
            1 => self.atom(scope, false),
            2 => {
                format!("(and {} {})", self.effect(scope, depth - 1), self.effect(scope, depth - 1))
            }
            3 => {
                let scope = [scope, &["?w".to_owned()]].concat();
                format!("(forall (?w - thing) {})", self.effect(&scope, depth - 1))
            }
            _ => {
                let condition = self.formula(scope, 1, true);
                format!("(when {condition} {})", self.effect(scope, depth - 1))
            }
        }
    }

    fn texts(&mut self) -> (String, String) {
        self.texts_with("")
    }

    /// Draws a domain that has further rules for derived predicates, and a problem.
    fn texts_with(&mut self, rules: &str) -> (String, String) {
        let mut domain = String::from(
            "(define (domain random) (:types thing) (:constants c - thing)
            (:predicates (p) (q ?x) (r ?x ?y) (s ?x) (d ?x) (e ?x))\n",
        );
        let x = ["?x".to_owned()];
        domain += &format!("(:derived (e ?x) {})\n", self.formula(&x, 2, false));
        // The rule for `d` may name `e`, which stands before it.
        let of_e = self.formula(&x, 1, false);
        domain += &format!("(:derived (d ?x - thing) (and (e ?x) {of_e}))\n");
        if self.upto(1) == 0 {
            domain += &format!("(:derived (d ?x) {})\n", self.formula(&x, 2, false));
        }
        domain += rules;
        for name in ["one", "two", "three"] {
            let scope = [x.as_slice(), &["?y".to_owned()]].concat();
            let (condition, effect) = (self.formula(&scope, 2, true), self.effect(&scope, 3));
            domain += &format!(
                "(:action {name} :parameters (?x - thing ?y) :precondition {condition} :effect {effect})\n"
            );
        }
        let mut init = String::new();
        for fact in ["(p)", "(q a)", "(q b)", "(q c)", "(r a b)", "(r c c)", "(s a)", "(s c)"] {
            if self.upto(2) == 0 {
                init += fact;
            }
        }
        let goal = self.formula(&[], 3, true);
        let problem = format!(
            "(define (problem p) (:domain random) (:objects a - thing b) (:init {init}) (:goal {goal}))"
        );
        (domain + ")", problem)
    }
}

/// What random problems show, compared with their meaning: the number of calls, of problems that have a plan of some actions and
/// that have none, and of those that are too large.
fn compared(cases: u64, seed: Seed, rules: &[&str], ways: usize) -> [usize; 5] {
    let [mut calls, mut solved, mut unsolved, mut skipped, mut parts] = [0; 5];
    for case in 0..cases {
        let mut rng = seed.derive_index("adl", case).rng();
        let rule = rules[case as usize % rules.len()];
        let (domain, problem) = Draw { rng: &mut rng }.texts_with(rule);
        let (domain, problem) = parse(&domain, &problem);
        match Grounded::with_most_ways(&domain, &problem, ways) {
            Err(GroundFault::TooLarge { .. }) => {
                skipped += 1;
                continue;
            }
            Err(_) => {}
            Ok(grounded) => {
                let part = |f: &Fluent| f.fact.predicate == "a condition";
                parts += grounded.fluents.iter().filter(|f| part(f)).count();
            }
        }
        let (_, more, shortest) = compare_written(&domain, &problem, 60, ways);
        calls += more;
        match shortest {
            Some(0) => {}
            Some(_) => solved += 1,
            None => unsolved += 1,
        }
    }
    [calls, solved, unsolved, skipped, parts]
}

#[test]
fn compiled_problems_have_the_transitions_and_the_shortest_plans_of_their_meaning() {
    let cases = std::env::var("SYMBOLT_ADL_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(150);
    let counts = compared(cases, Seed::new(4), &[""], usize::MAX);
    let [calls, solved, unsolved, skipped, _] = counts;
    assert!(calls > 2_000 && solved > 8 && unsolved > 20 && skipped < 3, "{counts:?}");
    // The same where facts stand for the parts of conditions.
    let counts = compared(cases, Seed::new(4), &[""], 1);
    let [calls, solved, unsolved, skipped, parts] = counts;
    assert!(calls > 2_000 && solved > 8 && unsolved > 20 && skipped < 3, "{counts:?}");
    assert!(parts > 0, "{counts:?}");
}

#[test]
fn derived_predicates_that_need_themselves_mean_the_least_set_of_facts() {
    let rules = [
        "(:derived (d ?x) (exists (?z) (and (r ?x ?z) (d ?z))))\n",
        "(:derived (e ?x) (and (q ?x) (d ?x)))\n(:derived (d ?x) (exists (?z) (and (r ?z ?x) (e ?z))))\n",
        "(:derived (d ?x) (forall (?z) (or (not (r ?x ?z)) (d ?z))))\n",
        "(:derived (d ?x) (d ?x))\n(:derived (e ?x) (or (e c) (and (d ?x) (p))))\n",
    ];
    for ways in [usize::MAX, 1] {
        let counts = compared(120, Seed::new(6), &rules, ways);
        let [calls, solved, _, skipped, parts] = counts;
        assert!(calls > 1_500 && solved > 5 && skipped < 5, "{counts:?}");
        assert_eq!(parts > 30, ways == 1, "{counts:?}");
    }
}

#[test]
fn what_only_needs_itself_never_holds() {
    let problem = "(define (problem p) (:domain d) (:init (p)) (:goal (and (done) (not (up)))))";
    let of = |rule: &str| {
        let text = format!(
            "(define (domain d) (:predicates (p) (up) (down) (done)) {rule}
            (:action go :precondition (not (up)) :effect (done)))"
        );
        let (domain, problem) = parse(&text, problem);
        compare(&domain, &problem, 60).2
    };
    assert_eq!(of("(:derived (up) (down)) (:derived (down) (up))"), Some(1));
    // Something else derives it as well.
    assert_eq!(of("(:derived (up) (down)) (:derived (down) (or (up) (p)))"), None);
}

#[test]
fn blocks_above_each_other_are_planned() {
    let domain = "(define (domain blocks) (:predicates (on ?x ?y) (table ?x) (clear ?x) (above ?x ?y))
        (:derived (above ?x ?y) (or (on ?x ?y) (exists (?z) (and (on ?x ?z) (above ?z ?y)))))
        (:action stack :parameters (?x ?y) :precondition (and (table ?x) (clear ?x) (clear ?y) (not (= ?x ?y)))
          :effect (and (on ?x ?y) (not (table ?x)) (not (clear ?y))))
        (:action unstack :parameters (?x ?y) :precondition (and (on ?x ?y) (clear ?x))
          :effect (and (table ?x) (clear ?y) (not (on ?x ?y)))))";
    let problem = |goal: &str| {
        format!(
            "(define (problem p) (:domain blocks) (:objects a b c d) (:init (on a b) (on b c) (table c) (table d)
            (clear a) (clear d)) (:goal {goal}))"
        )
    };
    for (goal, length) in [
        ("(above a c)", Some(0)),
        ("(above c a)", Some(3)),
        ("(and (above c a) (above a d))", Some(4)),
        ("(and (not (above a c)) (above a d))", Some(2)),
        ("(and (above a b) (above b a))", None),
    ] {
        let (domain, problem) = parse(domain, &problem(goal));
        assert_eq!(compare(&domain, &problem, 200).2, length, "{goal}");
    }
    // Of seven blocks one is above another in 326 ways, and in many more that go round in circles. Facts stand for what is
    // above `b`, each with a way for each block between.
    let blocks = "(define (problem p) (:domain blocks) (:objects a b c d e f g) (:init (table a) (table b) (table c) (table d)
        (table e) (table f) (table g) (clear a) (clear b) (clear c) (clear d) (clear e) (clear f) (clear g)) (:goal (above a b)))";
    let (domain, problem) = parse(domain, blocks);
    let grounded = Grounded::new(&domain, &problem).unwrap();
    let hidden = |grounded: &Grounded| grounded.operators.iter().filter(|o| o.is_hidden()).count();
    assert!(hidden(&grounded) < 60, "{}", hidden(&grounded));
    let written = Grounded::with_most_ways(&domain, &problem, 2_048).unwrap();
    assert_eq!(hidden(&written), 326);
}

#[test]
fn what_can_be_reached_over_a_thousand_fixed_roads_is_settled_while_grounding() {
    // As a tree, and one after the other.
    over_roads((1..1000).map(|n| format!("(road p{} p{n})", n / 2)).collect());
    over_roads((1..1000).map(|n| format!("(road p{} p{n})", n - 1)).collect());
}

fn over_roads(roads: String) {
    let places: String = (0..1000).map(|n| format!("p{n} ")).collect();
    let (domain, problem) = parse(
        "(define (domain d) (:predicates (road ?a ?b) (lit ?a) (reached ?a))
        (:derived (reached ?a) (or (= ?a p0) (exists (?b) (and (road ?b ?a) (reached ?b))))) (:constants p0)
        (:action light :parameters (?a) :precondition (reached ?a) :effect (lit ?a)))",
        &format!(
            "(define (problem p) (:domain d) (:objects {places} q) (:init {roads}) (:goal (and (lit p999) (not (reached q)))))"
        ),
    );
    let began = std::time::Instant::now();
    let grounded = Grounded::new(&domain, &problem).unwrap();
    assert_eq!((grounded.operators.len(), grounded.goal.len()), (1000, 1));
    validate(&domain, &problem, ["(light p999)"]).unwrap();
    assert!(began.elapsed().as_secs() < 20, "{:?}", began.elapsed());
}

#[test]
fn what_is_printed_of_a_domain_beyond_strips_is_read_as_the_same() {
    for case in 0..100 {
        let mut rng = Seed::new(5).derive_index("adl", case).rng();
        let (domain, problem) = Draw { rng: &mut rng }.texts();
        let (domain, problem) = parse(&domain, &problem);
        let (again, same) = parse(&domain.to_string(), &problem.to_string());
        // Nested conjunctions are printed as one.
        assert_eq!(again.to_string(), domain.to_string());
        assert_eq!(again.derived, domain.derived);
        assert_eq!(same, problem);
    }
}

#[test]
fn a_validator_that_forgets_conditional_effects_is_found_out() {
    let text = "(define (domain d) (:predicates (in ?x) (at ?x) (out))
        (:action go :parameters () :precondition ()
          :effect (and (out) (forall (?x) (when (in ?x) (at ?x))))))";
    let problem = "(define (problem p) (:domain d) (:objects a b) (:init (in a)) (:goal (and (at a) (not (at b)))))";
    let (domain, problem) = parse(text, problem);
    assert_eq!(compare(&domain, &problem, 60).2, Some(1));
    let mut wrong = domain.clone();
    wrong.actions[0].conditional.clear();
    assert!(validate(&wrong, &problem, ["(go)"]).is_err());
    assert!(validate(&domain, &problem, ["(go)"]).is_ok());
}

/// Each box needs a part, whichever; parts can be taken out again.
fn boxes(count: usize) -> (Domain, Problem) {
    let domain = "(define (domain boxes) (:types part box) (:predicates (free ?p - part) (in ?p - part ?b - box))
        (:action put :parameters (?p - part ?b - box) :precondition (free ?p)
          :effect (and (not (free ?p)) (in ?p ?b)))
        (:action take :parameters (?p - part ?b - box) :precondition (in ?p ?b)
          :effect (and (free ?p) (not (in ?p ?b)))))";
    let all = |name: &str| (0..count).map(|n| format!("{name}{n} ")).collect::<String>();
    let free = (0..count).map(|n| format!("(in p{n} b0) ")).collect::<String>();
    let problem = format!(
        "(define (problem p) (:domain boxes) (:objects {}- part {}- box) (:init {free})
         (:goal (forall (?b - box) (exists (?p - part) (in ?p ?b)))))",
        all("p"),
        all("b")
    );
    parse(domain, &problem)
}

#[test]
fn a_goal_that_each_of_eight_boxes_has_a_part_is_grounded() {
    let (domain, problem) = boxes(3);
    // Two parts leave the first box, where one of three has to stay.
    assert_eq!(compare(&domain, &problem, 200).2, Some(4));
    let (domain, problem) = boxes(8);
    let grounded = Grounded::new(&domain, &problem).unwrap();
    let hidden = grounded.operators.iter().filter(|o| o.is_hidden()).count();
    assert_eq!((grounded.goal.len(), hidden), (8, 64));
}

#[test]
fn a_goal_with_alternatives_is_reached_and_its_hidden_operator_is_not_in_the_plan() {
    let text = "(define (domain d) (:predicates (a) (b) (c))
        (:action make-a :precondition (c) :effect (and (a) (not (c))))
        (:action make-b :precondition (a) :effect (b)))";
    let problem = "(define (problem p) (:domain d) (:init (c)) (:goal (and (a) (or (b) (not (a)) (and (b) (c))))))";
    let (domain, problem) = parse(text, problem);
    let grounded = Grounded::new(&domain, &problem).unwrap();
    let plan = plan_of(&grounded).unwrap();
    assert_eq!(grounded.steps(plan.iter().copied()), ["(make-a)", "(make-b)"]);
    let never = Problem::parse(
        b"(define (problem p) (:domain d) (:init) (:goal (or (a) (b))))",
        "p",
        &domain,
    );
    let fault = Grounded::new(&domain, &never.unwrap()).unwrap_err().to_string();
    assert_eq!(
        fault,
        "the goal (or (a) (b)) of the problem `p` cannot be reached; it holds in no state that the actions can reach"
    );
}

#[test]
fn an_exists_of_a_negation_over_hundreds_of_objects_is_one_action() {
    let objects: String = (0..600).map(|i| format!("o{i} ")).collect();
    let (domain, problem) = parse(
        "(define (domain d) (:predicates (near ?x ?y) (done ?x))
            (:action a :parameters (?x) :precondition (exists (?y) (not (near ?x ?y))) :effect (done ?x)))",
        &format!("(define (problem p) (:domain d) (:objects {objects}) (:init) (:goal (done o7)))"),
    );
    assert_eq!(Grounded::new(&domain, &problem).unwrap().operators.len(), 600);
}

#[test]
fn a_condition_with_more_ways_than_atoms_in_the_world_is_planned_by_facts_that_stand_for_its_parts()
{
    let objects: String = (0..1000).map(|i| format!("o{i} ")).collect();
    let (domain, problem) = parse(
        "(define (domain d) (:predicates (q ?x) (t ?x) (p))
            (:action a :precondition (forall (?x) (or (q ?x) (t ?x))) :effect (p))
            (:action b :parameters (?x) :effect (q ?x))
            (:action c :parameters (?x) :effect (and (not (q ?x)) (t ?x))))",
        &format!("(define (problem p) (:domain d) (:objects {objects}) (:init) (:goal (p)))"),
    );
    let grounded = Grounded::new(&domain, &problem).unwrap();
    let hidden = grounded.operators.iter().filter(|o| o.is_hidden()).count();
    assert_eq!((grounded.operators.len(), hidden), (4_001, 2_000));
}

#[test]
fn four_of_six_bolts_in_any_of_six_holes_are_planned() {
    let holes = "(exists (?h - hole) (in ?b1 ?h)) (exists (?h - hole) (in ?b2 ?h)) (exists (?h - hole) (in ?b3 ?h))
        (exists (?h - hole) (in ?b4 ?h))";
    let unlike = "(not (= ?b1 ?b2)) (not (= ?b1 ?b3)) (not (= ?b1 ?b4)) (not (= ?b2 ?b3)) (not (= ?b2 ?b4)) (not (= ?b3 ?b4))";
    let (domain, problem) = parse(
        &format!(
            "(define (domain d) (:types bolt hole) (:predicates (in ?b - bolt ?h - hole) (loose ?b - bolt) (closed))
            (:action put :parameters (?b - bolt ?h - hole)
              :precondition (and (loose ?b) (not (exists (?o - bolt) (in ?o ?h)))) :effect (and (not (loose ?b)) (in ?b ?h)))
            (:action close :precondition (exists (?b1 ?b2 ?b3 ?b4 - bolt) (and {unlike} {holes})) :effect (closed)))"
        ),
        "(define (problem p) (:domain d) (:objects a b c d e f - bolt h1 h2 h3 h4 h5 h6 - hole)
        (:init (loose a) (loose b) (loose c) (loose d) (loose e) (loose f)) (:goal (closed)))",
    );
    let grounded = Grounded::new(&domain, &problem).unwrap();
    let calls = |of: &str| grounded.operators.iter().filter(|o| o.name.starts_with(of)).count();
    // Of four bolts each is in a hole, in one of six: 15 sets of four in place of 19,440 ways.
    assert_eq!((calls("(put"), calls("(close"), grounded.operators.len()), (36, 15, 87));
}

#[test]
fn roads_that_forty_cars_share_are_derived_once() {
    // Deriving anew for each car what holds in too many ways took more than 50 million steps.
    let names = |letter: char, count: usize| {
        (0..count).map(|i| format!("{letter}{i} ")).collect::<String>()
    };
    let starts: String = (0..40).map(|i| format!("(at k{i} o0)")).collect();
    let (domain, problem) = parse(
        "(define (domain d) (:types t c) (:predicates (l ?v0 ?v1 - t) (reach ?v0 ?v1 - t) (at ?v0 - c ?v1 - t))
        (:derived (reach ?x ?y - t) (or (l ?x ?y) (exists (?z - t) (and (l ?x ?z) (reach ?z ?y)))))
        (:action mk :parameters (?x ?y - t) :effect (l ?x ?y))
        (:action rm :parameters (?x ?y - t) :precondition (l ?x ?y) :effect (not (l ?x ?y)))
        (:action go :parameters (?k - c ?x ?y - t) :precondition (and (at ?k ?x) (reach ?x ?y))
          :effect (and (not (at ?k ?x)) (at ?k ?y))))",
        &format!(
            "(define (problem p) (:domain d) (:objects {} - t {} - c) (:init {starts}) (:goal (at k0 o3)))",
            names('o', 16),
            names('k', 40)
        ),
    );
    let grounded = Grounded::new(&domain, &problem).unwrap();
    // Each car goes from each place to each other, or to where it is, which changes nothing.
    assert_eq!(
        grounded.operators.iter().filter(|o| o.name.starts_with("(go")).count(),
        40 * 16 * 15
    );
}

#[test]
fn a_goal_with_hundreds_of_ways_beside_one_that_others_settle_is_grounded() {
    let objects: String = (0..20).map(|i| format!("o{i} ")).collect();
    let (domain, problem) = parse(
        "(define (domain d) (:predicates (p ?x) (q) (z))
        (:action setp :parameters (?x) :effect (and (p ?x) (not (z))))
        (:action clr :parameters (?x) :precondition (p ?x) :effect (not (p ?x)))
        (:action doq :precondition (not (z)) :effect (q))
        (:action unq :effect (and (not (q)) (z)))
        (:action unz :precondition (z) :effect (not (z))))",
        &format!(
            "(define (problem p) (:domain d) (:objects {objects}) (:init (z)) (:goal (and (forall (?c) (imply (p ?c) (not (z))))
            (forall (?c) (imply (= ?c o1) (not (z)))) (or (z) (q))
            (exists (?a ?b) (and (not (= ?a ?b)) (p ?a) (or (p ?b) (not (p ?b))) (not (p ?b)))))))"
        ),
    );
    assert!(Grounded::new(&domain, &problem).is_ok());
}

#[test]
fn a_goal_that_is_out_of_reach_is_named_as_it_is_written() {
    let (domain, problem) = parse(
        "(define (domain d) (:predicates (l ?v0 ?v1) (reach ?v0 ?v1) (z) (w))
        (:derived (reach ?x ?y) (or (and (w) (not (z)) (l ?x ?y)) (exists (?z) (and (l ?x ?z) (reach ?z ?y)))))
        (:action mk :parameters (?x ?y) :effect (l ?x ?y))
        (:action mkw :precondition (not (z)) :effect (w))
        (:action mkz :effect (z))
        (:action unz :precondition (w) :effect (not (z))))",
        "(define (problem p) (:domain d) (:objects o0 o1 o2 o3 o4 o5) (:init (z)) (:goal (reach o0 o3)))",
    );
    let fault = Grounded::new(&domain, &problem).unwrap_err().to_string();
    assert!(
        fault.contains("the goal (reach o0 o3) of the problem `p` cannot be reached"),
        "{fault}"
    );
}

#[test]
fn quantifiers_and_alternatives_that_multiply_are_refused_with_their_number() {
    let objects: String = (0..1000).map(|i| format!("o{i} ")).collect();
    let refused = |condition: &str, effect: &str| {
        let (domain, problem) = parse(
            &format!(
                "(define (domain d) (:predicates (r ?x ?y ?z) (q ?x) (p) (t ?x))
                (:action a :parameters () :precondition {condition} :effect (and (p) {effect}))
                (:action b :parameters (?x) :effect (and (q ?x) (t ?x)))
                (:action c :parameters (?x) :effect (and (not (q ?x)) (not (t ?x)))))"
            ),
            &format!("(define (problem p) (:domain d) (:objects {objects}) (:init) (:goal (p)))"),
        );
        let began = std::time::Instant::now();
        let fault = Grounded::new(&domain, &problem).unwrap_err();
        assert!(began.elapsed().as_secs() < 5, "{:?}", began.elapsed());
        assert!(matches!(fault, GroundFault::TooLarge { .. }));
        fault.to_string()
    };
    assert_eq!(
        refused("(forall (?x ?y ?z) (r ?x ?y ?z))", ""),
        "the problem `p` is too large: it has more than 1000000 choices of objects in a condition of the action `a` (1000000000); use fewer objects, or more precise types"
    );
    let effects = refused("()", "(forall (?x) (when (q ?x) (t ?x)))");
    assert!(
        effects.contains("more than 2048 operators of one action: `a` has 1000 effects"),
        "{effects}"
    );
}
