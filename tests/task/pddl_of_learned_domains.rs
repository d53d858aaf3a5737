//! Learned domains written as PDDL: the same reachable situations, and plans that carry over in both directions.

#![allow(clippy::expect_used)]

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use symbolt::plan::goal_sets::{GoalSetSpec, StripsWorld, pursue};
use symbolt::plan::strips::{self, Bodies, Fact, Grounded, Literal, Term, validate};
use symbolt::prelude::*;
use symbolt::study::worlds::{self, Stage, World};
use symbolt::task::DomainBuilder;
use symbolt::task::classify::{Classifier, Layout};
use symbolt::task::compile::{Move, Problem};
use symbolt::task::domain::{NeedVerdict, RelationalDomain, Situation};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::pddl::{WriteFault, Written, of_grounded, of_relational};
use symbolt::task::planner::strips_problem;
use symbolt::task::propositional::Rules;

fn learned(world: &World) -> Option<RelationalDomain> {
    let recording = world.record(5, Seed::new(2));
    let learned = learn(&recording, &Settings::default()).ok()?;
    Some(learned.domain).filter(|domain| !domain.goals.is_empty())
}

/// Returns the scene in which a test of a world begins.
fn scene(world: &World, domain: &RelationalDomain) -> Layout {
    let run = world.begin(Seed::new(9), Stage::Test);
    Classifier::new(domain).classify(&run.snapshot())
}

/// Reads back what is written.
fn read(written: &Written) -> (strips::Domain, strips::Problem) {
    let domain =
        strips::Domain::parse(written.domain_text().as_bytes(), "domain.pddl", Bodies::Read);
    let domain = domain.expect("a domain");
    let text = written.problem_text();
    let problem = strips::Problem::parse(text.as_bytes(), "problem.pddl", &domain);
    (domain, problem.expect("a problem"))
}

fn fact(literal: &Literal) -> Fact {
    let name = |term: &Term| match term {
        Term::Constant(name) => name.clone(),
        Term::Parameter(_) => unreachable!("the actions have no parameters"),
    };
    let arguments = literal.atom.arguments.iter().map(name).collect();
    Fact { predicate: literal.atom.predicate.clone(), arguments }
}

type State = BTreeSet<Fact>;

/// Returns the state after an action by the rules of PDDL, if its preconditions hold.
fn after(action: &strips::Action, state: &State) -> Option<State> {
    let holds = |l: &Literal| state.contains(&fact(l)) == l.positive;
    if !action.preconditions.iter().all(holds) {
        return None;
    }
    let mut next = state.clone();
    for effect in action.effects.iter().filter(|e| !e.positive) {
        next.remove(&fact(effect));
    }
    next.extend(action.effects.iter().filter(|e| e.positive).map(fact));
    Some(next)
}

/// Follows all moves of a problem and all actions of its PDDL side by side. Returns the number of situations, the number
/// of moves, and the first difference.
fn compare(
    problem: &Problem<'_>,
    written: &Written,
    domain: &strips::Domain,
    (start, strict): (&Situation, bool),
    most: usize,
) -> (usize, usize, Option<String>) {
    let first: State = written.problem.init.iter().cloned().collect();
    let mut seen = BTreeMap::from([(start.clone(), first)]);
    let mut open = VecDeque::from([start.clone()]);
    let mut moves = 0;
    while let Some(now) = open.pop_front() {
        let state = seen[&now].clone();
        let mut reached: BTreeMap<(usize, State), Move> = BTreeMap::new();
        for (action, m) in domain.actions.iter().zip(&written.moves) {
            let Some(m) = m else { continue };
            reached.extend(after(action, &state).map(|next| ((m.operator, next), *m)));
        }
        for m in problem.moves(&now) {
            if strict && !problem.decided(&m, &now) {
                continue;
            }
            moves += 1;
            let next = problem.after(&m, &now);
            let found =
                reached.iter().find(|((operator, _), of)| *operator == m.operator && **of == m);
            let Some(((_, state), _)) = found else {
                return (seen.len(), moves, Some(format!("no action for {m:?}")));
            };
            let state = state.clone();
            reached.remove(&(m.operator, state.clone()));
            if let Some(known) = seen.get(&next) {
                if *known != state {
                    return (seen.len(), moves, Some(format!("another state after {m:?}")));
                }
            } else if seen.len() < most {
                seen.insert(next.clone(), state);
                open.push_back(next);
            }
        }
        if let Some(m) = reached.values().next() {
            return (seen.len(), moves, Some(format!("an action for {m:?}, which is no move")));
        }
    }
    (seen.len(), moves, None)
}

fn undecided(domain: &RelationalDomain) -> Vec<(usize, usize)> {
    let operators = domain.operators.iter().enumerate();
    let needs = operators
        .flat_map(|(o, op)| op.needs.iter().enumerate().map(move |(n, need)| (o, n, need)));
    needs.filter(|(.., n)| n.verdict == NeedVerdict::Undecided).map(|(o, n, _)| (o, n)).collect()
}

#[test]
fn the_actions_are_the_moves_in_every_reachable_situation() {
    let (mut compared, mut all) = (0, [0; 2]);
    for world in worlds::plain() {
        let Some(domain) = learned(&world) else { continue };
        let layout = scene(&world, &domain);
        let now = layout.situation();
        let Ok(problem) = Problem::new(&domain, &layout) else { continue };
        for (dropped, strict) in [(Vec::new(), true), (undecided(&domain), false)] {
            let written = match of_relational(&problem, &dropped, &now, world.name()) {
                Ok(written) => written,
                Err(WriteFault::Uncertain { .. }) => continue,
                Err(fault) => panic!("{}: {fault}", world.name()),
            };
            let (read_back, task) = read(&written);
            assert_eq!(read_back.actions.len(), written.domain.actions.len());
            assert_eq!(task.goal.len(), written.problem.goal.len());
            let (states, moves, fault) =
                compare(&problem, &written, &read_back, (&now, strict), 60);
            assert_eq!(fault, None, "{} {strict}", world.name());
            compared += 1;
            all = [all[0] + states, all[1] + moves];
        }
    }
    assert!(compared >= 36 && all[0] > 800 && all[1] > 10_000, "{compared} {all:?}");
}

#[test]
fn a_writer_that_forgets_what_an_action_ends_is_found_out() {
    let world = worlds::named("nuts").expect("a world");
    let domain = learned(&world).expect("it teaches");
    let layout = scene(&world, &domain);
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let now = layout.situation();
    let written = of_relational(&problem, &[], &now, "nuts").expect("it is written");
    let mut wrong = written.domain.clone();
    wrong.actions.iter_mut().for_each(|action| action.effects.retain(|e| e.positive));
    assert_eq!(compare(&problem, &written, &written.domain, (&now, true), 60).2, None);
    assert!(compare(&problem, &written, &wrong, (&now, true), 60).2.is_some());
}

/// Returns the names of the actions along moves and, behind them, of those that check the goal.
fn calls(domain: &strips::Domain, written: &Written, moves: &[Move]) -> Vec<String> {
    let mut state: State = written.problem.init.iter().cloned().collect();
    let mut calls = Vec::new();
    let mut take = |wanted: Option<Move>, calls: &mut Vec<String>| {
        let actions = domain.actions.iter().zip(&written.moves);
        let next = actions.filter(|(_, m)| **m == wanted);
        let next = next.filter_map(|(action, _)| Some((action, after(action, &state)?))).next();
        if let Some((action, after)) = &next {
            calls.push(format!("({})", action.name));
            state = after.clone();
        }
        next.is_some()
    };
    for m in moves {
        assert!(take(Some(*m), &mut calls), "no action for {m:?}");
    }
    while take(None, &mut calls) {}
    calls
}

#[test]
fn plans_of_the_symbolic_planner_are_valid_in_pddl_and_plans_in_pddl_reach_the_goal() {
    let mut counts = [0; 2];
    for world in worlds::plain() {
        let Some(domain) = learned(&world) else { continue };
        let layout = scene(&world, &domain);
        let now = layout.situation();
        let Ok(problem) = Problem::new(&domain, &layout) else { continue };
        let (Ok(plan), false) = (problem.plan(&now, &[]), problem.lacking(&now) == 0) else {
            continue;
        };
        let dropped = undecided(&domain);
        let Ok(written) = of_relational(&problem, &dropped, &now, world.name()) else { continue };
        let (read_back, task) = read(&written);
        let moves: Vec<Move> = plan.iter().map(|step| step.action).collect();
        let steps = calls(&read_back, &written, &moves);
        let valid = validate(&read_back, &task, steps.iter().map(String::as_str));
        valid.unwrap_or_else(|fault| panic!("{}: {fault}", world.name()));
        counts[0] += 1;
        if read_back.actions.len() > 60 {
            continue;
        }
        let grounded = Grounded::new(&read_back, &task).expect("it is grounded");
        let world_of = StripsWorld::new(&grounded, SimDuration::from_millis(100));
        let Ok(course) = pursue(&grounded, world_of, &GoalSetSpec::default(), Seed::new(1)) else {
            continue;
        };
        let mut at = now.clone();
        for step in course.plan().map(|a| &grounded.operators[a].name) {
            let action = read_back.actions.iter().position(|a| format!("({})", a.name) == *step);
            let Some(m) = action.and_then(|a| written.moves[a]) else { continue };
            assert!(problem.moves(&at).contains(&m), "{}: {m:?}", world.name());
            at = problem.after(&m, &at);
        }
        assert_eq!(course.reached, problem.lacking(&at) == 0, "{}", world.name());
        counts[1] += usize::from(course.reached);
    }
    assert!(counts[0] >= 12 && counts[1] >= 8, "{counts:?}");
}

#[test]
fn a_domain_of_the_papers_method_is_written_without_arguments() {
    let domain = DomainBuilder::of_the_paper().build().expect("the paper's domain");
    let present = domain.world(["NUT_ON_TABLE", "BOLT_ON_TABLE"]).expect("states");
    let goal = domain.state("BOLT_ASSEMBLED").expect("the goal");
    let grounded = strips_problem(&domain, Rules::default(), &present, &[goal]);
    let written = of_grounded(&grounded, "Nuts & bolts");
    assert_eq!(written.domain.name, "nuts---bolts");
    let (read_back, task) = read(&written);
    let again = Grounded::new(&read_back, &task).expect("it is grounded");
    let world = StripsWorld::new(&again, SimDuration::from_millis(100));
    let course = pursue(&again, world, &GoalSetSpec::default(), Seed::new(1)).expect("it runs");
    let steps: Vec<&str> = course.plan().map(|a| again.operators[a].name.as_str()).collect();
    assert_eq!(steps.len(), 3);
    validate(&read_back, &task, steps.iter().copied()).expect("a valid plan");
    assert!(validate(&read_back, &task, steps[1..].iter().copied()).is_err());
}

#[cfg(feature = "cli")]
#[test]
fn the_command_writes_both_files_or_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let world = worlds::named("nuts").expect("a world");
    let domain = learned(&world).expect("it teaches");
    let run = world.begin(Seed::new(9), Stage::Test);
    let scene = run.snapshot().to_json().expect("plain data");
    let file = |name: &str| folder.path().join(name);
    std::fs::write(file("domain.json"), domain.to_json().expect("plain data")).expect("writes");
    std::fs::write(file("scene.json"), scene).expect("writes");
    let call = |arguments: &[&str]| {
        let mut command = assert_cmd::Command::cargo_bin("symbolt").expect("the program was built");
        let common = ["pddl", "domain.json", "--scene", "scene.json", "--out", "made"];
        let output = command.current_dir(folder.path()).args(common).args(arguments).output();
        let output = output.expect("it starts");
        let [out, err] =
            [output.stdout, output.stderr].map(|b| String::from_utf8_lossy(&b).into_owned());
        (output.status.code(), out, err)
    };
    let (code, _, err) = call(&["--goal", "NOWHERE"]);
    assert!(code == Some(2) && err.contains("NOWHERE"), "{err}");
    assert!(!file("made/domain.pddl").exists() && !file("made/problem.pddl").exists());
    let (code, out, err) = call(&[]);
    assert_eq!((code, out.lines().count()), (Some(0), 1), "{err}");
    let first = std::fs::read(file("made/problem.pddl")).expect("it was written");
    std::fs::remove_file(file("made/domain.pddl")).expect("it was written");
    let (code, _, err) = call(&[]);
    assert!(code == Some(2) && err.contains("problem.pddl"), "{err}");
    assert!(!file("made/domain.pddl").exists(), "one file without the other");
    let (code, out, _) = call(&["--force", "--json"]);
    assert!(code == Some(0) && out.contains("\"actions\""), "{out}");
    assert_eq!(std::fs::read(file("made/problem.pddl")).expect("it was written"), first);
}

#[test]
fn a_fact_that_only_negative_conditions_name_changes_all_the_same() {
    let domain = b"(define (domain door) (:predicates (locked) (open))
        (:action unlock :parameters () :precondition () :effect (not (locked)))
        (:action push :parameters () :precondition (not (locked)) :effect (open)))";
    let problem = b"(define (problem leave) (:domain door) (:init (locked)) (:goal (open)))";
    let domain = strips::Domain::parse(domain, "door.pddl", Bodies::Read).expect("a domain");
    let problem = strips::Problem::parse(problem, "leave.pddl", &domain).expect("a problem");
    let grounded = Grounded::new(&domain, &problem).expect("it is grounded");
    let (again, task) = read(&of_grounded(&grounded, "door"));
    validate(&again, &task, ["(unlock)", "(push)"]).expect("a valid plan");
    assert!(validate(&again, &task, ["(push)"]).is_err());
}
