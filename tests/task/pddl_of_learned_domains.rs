//! Learned domains written as PDDL: the same moves and situations, and plans that carry over in both directions.

#![allow(clippy::expect_used)]

use std::collections::BTreeSet;

use rand::{Rng, RngExt};
use symbolt::plan::goal_sets::{GoalSetSpec, StripsWorld, pursue};
use symbolt::plan::strips::{self, Bodies, Fact, GroundFault, Grounded, validate};
use symbolt::prelude::*;
use symbolt::study::worlds::{self, Stage, World};
use symbolt::task::ObjectPose;
use symbolt::task::classify::{Classifier, Layout, Located};
use symbolt::task::compile::{Move, Problem};
use symbolt::task::domain::{
    Condition, Coordinate, Frame, FrameState, GoalTerm, Need, NeedVerdict, Quantity,
    RelationalDomain, RelationalOperator, Role, SideEffect, Situation, Subject,
};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::pddl::{WriteFault, Written, of_relational};

use crate::adl::{Meaning, close, fluents, of_facts};

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
        strips::Domain::parse(written.domain.to_string().as_bytes(), "domain.pddl", Bodies::Read);
    let domain = domain.expect("a domain");
    let text = written.problem.to_string();
    let problem = strips::Problem::parse(text.as_bytes(), "problem.pddl", &domain);
    (domain, problem.expect("a problem"))
}

type State = BTreeSet<Fact>;

/// Returns the facts that stand for a situation, by the names of states and objects.
fn facts(problem: &Problem<'_>, now: &Situation) -> State {
    let id = |object: usize| problem.objects()[object].id.to_lowercase();
    let fact = |(object, fact): (usize, &symbolt::task::domain::Fact)| {
        let state = &problem.domain().states[fact.state];
        let predicate = state.name.to_lowercase();
        let place = format!("{predicate}_place_{}", fact.place + 1);
        let place = Some(place).filter(|_| state.places.len() > 1);
        let arguments = [Some(id(object)), fact.reference.map(id), place];
        Fact { predicate, arguments: arguments.into_iter().flatten().collect() }
    };
    now.iter().enumerate().filter_map(|(i, f)| Some(fact((i, f.as_ref()?)))).collect()
}

/// Returns the operator of an action, or of a call of it: that with the longest name that begins it.
fn operator(domain: &RelationalDomain, call: &str) -> usize {
    let call = call.trim_start_matches('(');
    let begins = |o: &usize| {
        let rest = call.strip_prefix(&domain.operators[*o].name.to_lowercase());
        rest.is_some_and(|r| r.is_empty() || r.starts_with([' ', ')']) || r.starts_with("_from_"))
    };
    let all = (0..domain.operators.len()).filter(begins);
    all.max_by_key(|o| domain.operators[*o].name.len()).expect("an operator")
}

/// What is written, read back.
struct Pddl {
    domain: strips::Domain,
    problem: strips::Problem,
    /// Facts that no action changes.
    fixed: State,
    grounded: Option<Grounded>,
}

impl Pddl {
    fn new(learned: &RelationalDomain, domain: strips::Domain, problem: strips::Problem) -> Self {
        let names: BTreeSet<String> =
            learned.states.iter().map(|state| state.name.to_lowercase()).collect();
        let fixed = problem.init.iter().filter(|f| !names.contains(&f.predicate));
        let fixed = fixed.cloned().collect();
        let grounded = match Grounded::new(&domain, &problem) {
            Ok(grounded) => Some(grounded),
            Err(GroundFault::Unreachable { .. } | GroundFault::TooLarge { .. }) => None,
            Err(fault) => panic!("{fault}"),
        };
        Self { domain, problem, fixed, grounded }
    }

    /// Compares the moves in a situation with the actions by their meaning and, where the goal can be reached, with the
    /// operators of the grounded problem. Returns the moves, or a difference.
    fn compare(
        &self,
        problem: &Problem<'_>,
        now: &Situation,
        strict: bool,
    ) -> Result<Vec<Move>, String> {
        let learned = problem.domain();
        let state = |situation: &Situation| &facts(problem, situation) | &self.fixed;
        let mut moves = problem.moves(now);
        moves.retain(|m| !strict || problem.decided(m, now));
        // A move to where the object is in all but its name changes nothing.
        let after = |m: &Move| (m.operator, state(&problem.after(m, now)));
        let here = state(now);
        let wanted: BTreeSet<(usize, State)> =
            moves.iter().map(after).filter(|(_, next)| *next != here).collect();
        let meaning = Meaning::new(&self.domain, &self.problem);
        let found = meaning.after(&here).into_iter();
        let found: BTreeSet<(usize, State)> =
            found.map(|(call, next)| (operator(learned, call), next)).collect();
        if found != wanted {
            let lacking: Vec<_> = wanted.difference(&found).collect();
            let further: Vec<_> = found.difference(&wanted).collect();
            return Err(format!("in {here:?}\nno action for {lacking:?}\nno move for {further:?}"));
        }
        if meaning.met(&here) != (problem.lacking(now) == 0) {
            return Err(format!("another goal in {here:?}"));
        }
        let Some(grounded) = &self.grounded else { return Ok(moves) };
        let before = fluents(grounded, &here);
        let wanted: BTreeSet<(usize, BTreeSet<usize>)> =
            wanted.into_iter().map(|(o, next)| (o, fluents(grounded, &next))).collect();
        let able = grounded.operators.iter().filter(|o| !o.is_hidden());
        let mut closed = before.clone();
        close(grounded, &mut closed, |_| {});
        let able = able.filter(|o| Grounded::all_hold(&closed, &o.preconditions));
        let found: BTreeSet<(usize, BTreeSet<usize>)> = able
            .map(|o| {
                let mut next = closed.clone();
                o.apply(&mut next);
                (operator(learned, &o.name), of_facts(grounded, next))
            })
            .collect();
        let changing = |set: BTreeSet<(usize, BTreeSet<usize>)>| {
            set.into_iter().filter(|(_, next)| *next != before).collect::<BTreeSet<_>>()
        };
        let (found, wanted) = (changing(found), changing(wanted));
        if found == wanted { Ok(moves) } else { Err(format!("other operators in {here:?}")) }
    }

    /// Compares in the situations of random walks. Returns the number of situations, of moves and of those of the grounded
    /// problem, or a difference.
    fn walk(
        &self,
        problem: &Problem<'_>,
        (start, strict): (&Situation, bool),
        [walks, steps]: [usize; 2],
        rng: &mut impl Rng,
    ) -> Result<[usize; 3], String> {
        let (mut seen, mut counts) = (BTreeSet::new(), [0; 3]);
        for _ in 0..walks {
            let mut now = start.clone();
            for _ in 0..steps {
                let mut moves = self.compare(problem, &now, strict)?;
                if seen.insert(facts(problem, &now)) {
                    counts[0] += 1;
                    counts[1] += moves.len();
                    counts[2] += usize::from(self.grounded.is_some());
                }
                if moves.is_empty() {
                    break;
                }
                let m = moves.swap_remove(rng.random_range(0..moves.len()));
                now = problem.after(&m, &now);
            }
        }
        Ok(counts)
    }
}

fn undecided(domain: &RelationalDomain) -> Vec<(usize, usize)> {
    let operators = domain.operators.iter().enumerate();
    let needs = operators
        .flat_map(|(o, op)| op.needs.iter().enumerate().map(move |(n, need)| (o, n, need)));
    needs.filter(|(.., n)| n.verdict == NeedVerdict::Undecided).map(|(o, n, _)| (o, n)).collect()
}

#[test]
fn the_ground_actions_are_the_moves_in_the_situations_of_random_walks() {
    let (mut compared, mut all) = (0, [0; 3]);
    for world in worlds::all() {
        let Some(domain) = learned(&world) else { continue };
        let layout = scene(&world, &domain);
        let now = layout.situation();
        let Ok(problem) = Problem::new(&domain, &layout) else { continue };
        let rng = &mut Seed::new(3).derive("walks", world.name()).rng();
        for (dropped, strict) in [(Vec::new(), true), (undecided(&domain), false)] {
            let written = match of_relational(&problem, &dropped, &now, world.name()) {
                Ok(written) => written,
                Err(WriteFault::Uncertain { .. }) => continue,
                Err(fault) => panic!("{}: {fault}", world.name()),
            };
            let (read_back, task) = read(&written);
            assert_eq!(read_back.actions.len(), written.domain.actions.len());
            let pddl = Pddl::new(&domain, read_back, task);
            let counts = pddl.walk(&problem, (&now, strict), [3, 8], rng);
            let counts = counts.unwrap_or_else(|why| {
                panic!("{} {strict}: {why}\n{}", world.name(), written.domain)
            });
            compared += 1;
            all = [all[0] + counts[0], all[1] + counts[1], all[2] + counts[2]];
        }
    }
    assert!(compared >= 36 && all[0] > 300 && all[1] > 3_000 && all[2] > 200, "{compared} {all:?}");
}

#[test]
fn a_writer_that_forgets_an_effect_or_a_condition_is_found_out() {
    let world = worlds::named("nuts").expect("a world");
    let domain = learned(&world).expect("it teaches");
    let layout = scene(&world, &domain);
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let now = layout.situation();
    let written = of_relational(&problem, &[], &now, "nuts").expect("it is written");
    let found = |change: &dyn Fn(&mut strips::Action)| {
        let (mut wrong, task) = read(&written);
        wrong.actions.iter_mut().for_each(change);
        let pddl = Pddl::new(&domain, wrong, task);
        pddl.walk(&problem, (&now, true), [6, 8], &mut Seed::new(1).rng()).is_err()
    };
    assert!(!found(&|_| {}));
    assert!(found(&|action| action.effects.retain(|e| e.positive)));
    assert!(found(&|action| action.conditions.clear()));
    assert!(found(&|action| action.preconditions.clear()));
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
        // The move of a call is the one that leads to the same facts.
        let meaning = Meaning::new(&read_back, &task);
        let (mut at, mut steps) = (now.clone(), Vec::new());
        for step in &plan {
            let before = facts(&problem, &at);
            at = problem.after(&step.action, &at);
            let next = facts(&problem, &at);
            let call = meaning.after(&before).into_iter().find(|(_, after)| *after == next);
            steps.push(call.expect("an action for the move").0.to_owned());
        }
        let valid = validate(&read_back, &task, steps.iter().map(String::as_str));
        valid.unwrap_or_else(|fault| panic!("{}: {fault}", world.name()));
        counts[0] += 1;
        let Ok(grounded) = Grounded::new(&read_back, &task) else { continue };
        if grounded.operators.len() > 60 {
            continue;
        }
        let world_of = StripsWorld::new(&grounded, SimDuration::from_millis(100));
        let Ok(course) = pursue(&grounded, world_of, &GoalSetSpec::default(), Seed::new(1)) else {
            continue;
        };
        let (mut at, taken) = (now.clone(), grounded.steps(course.plan()));
        for step in taken {
            let before = facts(&problem, &at);
            let found = meaning.after(&before).into_iter().find(|(call, _)| *call == step);
            let (_, next) = found.unwrap_or_else(|| panic!("{}: {step}", world.name()));
            let moves = problem.moves(&at);
            let m = moves.iter().find(|m| facts(&problem, &problem.after(m, &at)) == next);
            at = problem.after(m.expect("a move for the action"), &at);
        }
        assert_eq!(course.reached, problem.lacking(&at) == 0, "{}", world.name());
        counts[1] += usize::from(course.reached);
    }
    assert!(counts[0] >= 12 && counts[1] >= 8, "{counts:?}");
}

/// Runs `symbolt pddl` with a domain, in the scene in which a test of the world begins. Returns the exit code and the outputs.
#[cfg(feature = "cli")]
fn command(
    folder: &std::path::Path,
    (world, domain): (&World, &RelationalDomain),
    arguments: &[&str],
) -> (Option<i32>, String, String) {
    let run = world.begin(Seed::new(9), Stage::Test);
    let scene = run.snapshot().to_json().expect("plain data");
    let domain = domain.to_json().expect("plain data");
    std::fs::write(folder.join("domain.json"), domain).expect("writes");
    std::fs::write(folder.join("scene.json"), scene).expect("writes");
    let mut command = assert_cmd::Command::cargo_bin("symbolt").expect("the program was built");
    let common = ["pddl", "domain.json", "--scene", "scene.json", "--out", "made"];
    let output = command.current_dir(folder).args(common).args(arguments).output();
    let output = output.expect("it starts");
    let [out, err] =
        [output.stdout, output.stderr].map(|b| String::from_utf8_lossy(&b).into_owned());
    (output.status.code(), out, err)
}

#[cfg(feature = "cli")]
#[test]
fn a_goal_that_is_met_is_written_with_a_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    let world = worlds::named("nuts").expect("a world");
    let domain = learned(&world).expect("it teaches");
    let met = "the goal is met in this scene: its plan is empty";
    let run = world.begin(Seed::new(9), Stage::Test);
    let now = Classifier::new(&domain).classify(&run.snapshot()).situation();
    let held = now.iter().flatten().next().expect("something is in a state").state;
    let goal = [&*domain.states[held].name];
    let call = |arguments: &[&str]| command(folder.path(), (&world, &domain), arguments);
    let (code, out, err) = call(&[&["--goal"], &goal[..], &["--json"]].concat());
    assert!(code == Some(0) && err.contains(&format!("warning: {met}\n")), "{err}");
    let said: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(said["warnings"], serde_json::json!([met]));
    let [domain, problem] = ["domain.pddl", "problem.pddl"]
        .map(|name| std::fs::read(folder.path().join("made").join(name)).expect("it was written"));
    let domain = strips::Domain::parse(&domain, "domain", Bodies::Read).expect("a domain");
    let problem = strips::Problem::parse(&problem, "problem", &domain).expect("a problem");
    assert!(validate(&domain, &problem, []).is_ok());
    let (code, _, err) = call(&["--force"]);
    assert!(code == Some(0) && !err.contains(met), "{err}");
}

#[cfg(feature = "cli")]
#[test]
fn a_goal_that_asks_for_more_than_there_is_is_written_with_a_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    let world = worlds::named("nuts").expect("a world");
    let mut domain = learned(&world).expect("it teaches");
    let run = world.begin(Seed::new(9), Stage::Test);
    let kind = domain.states[domain.goals[0].state].kind.clone();
    let present = run.snapshot().objects.iter().filter(|o| *o.kind == *kind).count();
    for (least, warned) in [(present, false), (present + 1, true)] {
        domain.goals[0].quantity = Quantity::AtLeast(least);
        let (code, _, err) = command(folder.path(), (&world, &domain), &["--force"]);
        let words = format!("the scene has {present} of the kind {kind}, and all of them will do");
        assert!(code == Some(0) && err.contains(&words) == warned, "{err}");
    }
}

#[cfg(feature = "cli")]
#[test]
fn the_command_writes_both_files_or_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let world = worlds::named("nuts").expect("a world");
    let domain = learned(&world).expect("it teaches");
    let file = |name: &str| folder.path().join(name);
    let call = |arguments: &[&str]| command(folder.path(), (&world, &domain), arguments);
    let (code, _, err) = call(&["--goal", "NOWHERE"]);
    assert!(code == Some(2) && err.contains("NOWHERE"), "{err}");
    assert!(!file("made/domain.pddl").exists() && !file("made/problem.pddl").exists());
    let (code, out, err) = call(&[]);
    assert_eq!((code, out.lines().count()), (Some(0), 1), "{err}");
    let first = std::fs::read(file("made/problem.pddl")).expect("it was written");
    let text = std::fs::read_to_string(file("made/domain.pddl")).expect("it was written");
    assert!(text.contains("(define (domain learned)") && text.contains(":parameters (?"), "{text}");
    std::fs::remove_file(file("made/domain.pddl")).expect("it was written");
    let (code, _, err) = call(&[]);
    assert!(code == Some(2) && err.contains("problem.pddl"), "{err}");
    assert!(!file("made/domain.pddl").exists(), "one file without the other");
    let (code, out, _) = call(&["--force", "--json"]);
    assert!(code == Some(0) && out.contains("\"actions\""), "{out}");
    assert_eq!(std::fs::read(file("made/problem.pddl")).expect("it was written"), first);
}

#[test]
fn one_domain_serves_several_scenes_and_names_no_object_of_them() {
    let mut compared = 0;
    for world in worlds::plain() {
        let Some(domain) = learned(&world) else { continue };
        let of_scene = |seed: u64| {
            let run = world.begin(Seed::new(seed), Stage::Test);
            let layout = Classifier::new(&domain).classify(&run.snapshot());
            let problem = Problem::new(&domain, &layout).ok()?;
            let written = of_relational(&problem, &[], &layout.situation(), world.name()).ok()?;
            let ids: Vec<String> = layout
                .objects
                .iter()
                .map(|object| format!(" {}", object.id.to_lowercase()))
                .collect();
            let text = written.domain.to_string();
            assert!(ids.iter().all(|id| !text.contains(&format!("{id})"))), "{text}");
            // Comments say where a condition depends on the scene.
            (!text.contains("of this scene")).then_some(text)
        };
        let texts: Vec<String> = [9, 10, 11].into_iter().filter_map(of_scene).collect();
        assert!(texts.windows(2).all(|two| two[0] == two[1]), "{}", world.name());
        compared += usize::from(texts.len() == 3);
    }
    assert!(compared >= 12, "{compared}");
}

/// A domain with any conditions and effects, and objects anywhere.
struct Anything<'r, R: Rng> {
    rng: &'r mut R,
    domain: RelationalDomain,
}

const KINDS: [&str; 3] = ["block", "tray", "mark"];

impl<R: Rng> Anything<'_, R> {
    fn below(&mut self, count: usize) -> usize {
        self.rng.random_range(0..count)
    }

    fn states(&mut self) {
        let template = self.domain.states[0].clone();
        self.domain.states.clear();
        for n in 0..4 + self.below(4) {
            let kind = KINDS[if n < 3 { n } else { self.below(3) }];
            let frame = match self.below(5) {
                0 | 1 => Frame::World,
                k => Frame::Kind(KINDS[k - 2].into()),
            };
            let mut place = template.places[0];
            let several = 1 + self.below(5) / 3 * self.below(3);
            let places = (0..several).map(|p| {
                // Some places are one, and some are wide.
                let mean = 0.1 * (p / (1 + n % 2)) as f64;
                place.coordinates = [Coordinate::Tight { mean, sd: 0.001 }; 3];
                if self.rng.random_bool(0.3) {
                    place.coordinates[0] = Coordinate::Open { low: mean, high: mean + 0.05 };
                }
                place
            });
            let places = places.collect();
            let (name, kind) = (format!("STATE_{n}"), kind.to_owned());
            self.domain.states.push(FrameState { name, kind, frame, places, ..template.clone() });
        }
    }

    fn condition(&mut self, roles: &[Role]) -> Condition {
        let role = roles[self.below(roles.len())];
        let subject = match self.below(3) {
            0 => Subject::Is(role),
            1 => Subject::At(role),
            _ => Subject::Any,
        };
        // Most conditions can hold.
        let state = self.below(self.domain.states.len());
        Condition { state, subject }
    }

    fn operators(&mut self) {
        let template = self.domain.operators[0].clone();
        self.domain.operators.clear();
        for n in 0..1 + self.below(3) {
            let states = self.domain.states.len();
            let to = self.below(states);
            let kind = &self.domain.states[to].kind;
            let of_kind = (0..states).filter(|s| self.domain.states[*s].kind == *kind);
            let mut from: Vec<usize> = of_kind.collect();
            while from.len() > 1 && self.rng.random_bool(0.4) {
                let out = self.below(from.len());
                from.swap_remove(out);
            }
            let framed = |s: &usize| self.domain.states[*s].frame != Frame::World;
            let mut roles = vec![Role::Object];
            roles.extend(from.iter().any(framed).then_some(Role::Origin));
            roles.extend(Some(Role::Target).filter(|_| framed(&to)));
            let needs = (0..self.below(4)).map(|_| Need {
                condition: self.condition(&roles),
                or: (0..self.below(3) / 2).map(|_| self.below(states)).collect(),
                verdict: [NeedVerdict::Required, NeedVerdict::Undecided, NeedVerdict::Absent]
                    [self.below(3)],
                holds: self.rng.random_bool(0.7),
                least: 1 + self.below(3) * self.below(3),
                every: self.rng.random_bool(0.2),
                held: 3,
                of: 3,
            });
            let needs = needs.collect();
            let mut side_effects = Vec::new();
            for _ in 0..self.below(3) {
                let mut condition = self.condition(&roles);
                let begins = self.rng.random_bool(0.5);
                if begins && condition.subject == Subject::At(Role::Origin) {
                    condition.subject = Subject::Is(Role::Origin);
                }
                side_effects.push(SideEffect { condition, begins, changed: 3, of: 3 });
            }
            let name = format!("MOVE_{n}");
            let own =
                RelationalOperator { name, from, to, needs, side_effects, ..template.clone() };
            self.domain.operators.push(own);
        }
    }

    fn layout(&mut self, template: &Layout) -> Layout {
        let mut objects = Vec::new();
        for kind in KINDS {
            for n in 0..1 + self.below(3) {
                let own = ObjectPose {
                    id: format!("{kind}_{n}").into(),
                    kind: kind.into(),
                    pose: template.objects[0].pose,
                };
                objects.push(own);
            }
        }
        let located = (0..objects.len()).map(|i| {
            let of_kind = |s: &usize| *self.domain.states[*s].kind == *objects[i].kind;
            let states: Vec<usize> = (0..self.domain.states.len()).filter(of_kind).collect();
            let state = states[self.below(states.len())];
            let described = &self.domain.states[state];
            let references: Vec<Option<usize>> = match described.frame.kind() {
                None => vec![None],
                Some(kind) => {
                    let others = (0..objects.len()).filter(|r| *r != i);
                    others.filter(|r| *objects[*r].kind == *kind).map(Some).collect()
                }
            };
            let place = self.rng.random_range(0..described.places.len());
            let one = (!references.is_empty() && self.rng.random_bool(0.95))
                .then(|| references[self.rng.random_range(0..references.len().max(1))]);
            let fact = one.map(|reference| symbolt::task::domain::Fact { state, place, reference });
            Located { fact, ..template.located[0] }
        });
        let located = located.collect();
        Layout { objects, located }
    }
}

#[test]
fn the_actions_of_random_domains_are_their_moves() {
    let world = worlds::named("nuts").expect("a world");
    let template = learned(&world).expect("it teaches");
    let laid = scene(&world, &template);
    let (mut counts, mut all, mut refused) = (0, [0; 3], 0);
    let cases = std::env::var("SYMBOLT_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(600);
    for case in 0..cases {
        let mut rng = Seed::new(6).derive_index("domains", case).rng();
        let mut any = Anything { rng: &mut rng, domain: template.clone() };
        any.states();
        any.operators();
        let layout = any.layout(&laid);
        let domain = any.domain.clone();
        let state = domain.operators[0].to;
        let quantity = match any.below(3) {
            0 => Quantity::EachObject,
            1 if domain.states[state].frame != Frame::World => Quantity::EachReference(1),
            _ => Quantity::AtLeast(1 + any.below(3)),
        };
        let goal = GoalTerm { state, or: Vec::new(), quantity, reference: None, held: 1, of: 1 };
        let domain = RelationalDomain { goals: vec![goal], ..domain };
        if domain.check().is_err() {
            continue;
        }
        let now = layout.situation();
        let Ok(problem) = Problem::new(&domain, &layout) else { continue };
        let written = match of_relational(&problem, &[], &now, "random") {
            Ok(written) => written,
            Err(_) => {
                refused += 1;
                continue;
            }
        };
        let (read_back, task) = read(&written);
        let pddl = Pddl::new(&domain, read_back, task);
        let found = pddl.walk(&problem, (&now, true), [3, 4], &mut rng);
        let found = found.unwrap_or_else(|why| {
            let texts = [written.domain.to_string(), written.problem.to_string()].concat();
            panic!(
                "case {case}: {why}\n{texts}{:?}{:?}",
                domain.operators,
                domain
                    .states
                    .iter()
                    .map(|s| (&s.name, &s.kind, &s.frame, s.places.len()))
                    .collect::<Vec<_>>()
            )
        });
        counts += usize::from(found[1] > 0);
        all = [all[0] + found[0], all[1] + found[1], all[2] + found[2]];
    }
    assert!(counts >= 40 && all[1] > 400 && all[2] > 150, "{counts} {all:?} {refused}");
}
