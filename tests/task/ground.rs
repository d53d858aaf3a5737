//! Ground problems: relational problems compiled for the planner graph.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::time::Instant;

use rand::RngExt;
use symbolt::neurons::PopulationPlan;
use symbolt::sim::{PointerRef, Seed, Threads, VocabTag};
use symbolt::spa::{VocabularyBuilder, dot};
use symbolt::study::worlds::{self, Stage, World};
use symbolt::task::classify::{Classifier, Layout};
use symbolt::task::compile::{GroundProblem, Problem};
use symbolt::task::domain::{Fact, RelationalDomain, Situation};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::planner::{Encoded, Planner, PlannerSpec};
use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
use symbolt::task::{ObjectPose, Part, Snapshot, State, StateId, TaskError, Verdict};

/// What became of a plan of the planner graph.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Rolled {
    Met { moves: usize },
    Stuck(String),
    NoMove(String),
    Endless,
}

fn planner(ground: &GroundProblem) -> Planner {
    let (spec, plan) = (PlannerSpec::default(), PopulationPlan::direct());
    let built = Planner::composed(ground.domain(), ground.composition(), spec, &plan, Seed::new(1));
    built.expect("it builds").with_threads(Threads::Serial)
}

/// Carries out the decisions of the planner graph by the rules of the domain. Compiles the problem anew if the graph is
/// stuck.
fn roll(
    problem: &Problem<'_>,
    mut ground: GroundProblem,
    start: &Situation,
    log: &mut Vec<String>,
) -> Rolled {
    let mut now = start.clone();
    let mut asked = planner(&ground);
    for moves in 0..40 {
        let Some(goal) = ground.goal(&now) else { return Rolled::Met { moves } };
        let decision = asked.decide(&ground.present(&now), goal).expect("it decides");
        match decision.verdict {
            Verdict::Act(action) => {
                let name = &ground.domain()[action].name;
                log.push(name.clone());
                let Some(first) = ground.moves_for(problem, action, &now).first().copied() else {
                    return Rolled::NoMove(name.clone());
                };
                now = problem.after(&first, &now);
            }
            Verdict::Met => return Rolled::Met { moves },
            Verdict::Stuck(why) => {
                let again = problem.ground(&now).expect("it compiles");
                if again.dropped() == ground.dropped() {
                    return Rolled::Stuck(format!("{} by {why:?}", ground.domain()[goal].name));
                }
                log.push("again".into());
                ground = again;
                asked = planner(&ground);
            }
        }
    }
    Rolled::Endless
}

/// Learns a world from the five demonstrations of a seed.
fn taught(world: &World, seed: u64) -> RelationalDomain {
    let recording = world.record(5, Seed::new(seed));
    learn(&recording, &Settings::default()).expect("it teaches").domain
}

/// Learns a world from the demonstrations of seed 1.
fn learned(name: &str) -> (World, RelationalDomain) {
    let world = worlds::named(name).expect("it exists");
    let domain = taught(&world, 1);
    assert!(!domain.goals.is_empty(), "{name} has no goal");
    (world, domain)
}

#[test]
fn eight_of_eight_seeds_teach_a_goal() {
    for world in worlds::plain() {
        let goals = (1..9).filter(|seed| !taught(&world, *seed).goals.is_empty()).count();
        assert_eq!(goals, 8, "{}", world.name());
    }
}

/// Returns the layout of a test scene in which `fits` holds.
fn scene(world: &World, domain: &RelationalDomain, fits: impl Fn(&Layout) -> bool) -> Layout {
    let classifier = Classifier::new(domain);
    let drawn = (0..50).map(|n| world.begin(Seed::new(9).derive_index("test", n), Stage::Test));
    let mut layouts = drawn.map(|run| classifier.classify(&run.snapshot()));
    layouts.find(fits).expect("such a scene is drawn")
}

fn decide(ground: &GroundProblem, now: &Situation) -> String {
    let goal = ground.goal(now).expect("something is left to do");
    let decision = planner(ground).decide(&ground.present(now), goal).expect("it decides");
    let Verdict::Act(action) = decision.verdict else { panic!("{:?}", decision.verdict) };
    ground.domain()[action].name.clone()
}

#[test]
fn objects_of_a_kind_that_is_nobodys_reference_share_their_facts_and_actions() {
    let (world, domain) = learned("conveyor");
    let layout = scene(&world, &domain, |l| l.objects.len() >= 4);
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let start = layout.situation();
    let ground = problem.ground(&start).expect("it compiles");
    let states: Vec<&str> = ground.domain().states().iter().map(|s| s.name.as_str()).collect();
    let counted = |name: &str| name.starts_with("AT_LEAST_") && name.contains("PART_AT_PALLET");
    assert!(states.iter().any(|name| counted(name)), "{states:?}");
    assert!(states.iter().all(|name| !name.contains("PART_0")), "{states:?}");
    assert!(ground.domain().operators().len() <= 6, "{:?}", ground.domain());
    assert!(ground.out_of_reach(&start).is_empty());
    let mut log = Vec::new();
    let plan = problem.plan(&start, &[]).expect("a plan").len();
    assert_eq!(roll(&problem, ground, &start, &mut log), Rolled::Met { moves: plan }, "{log:?}");
    assert!(log[0].starts_with("PUT_"), "{log:?}");
}

#[test]
fn what_is_in_the_way_is_moved_first_as_a_subgoal() {
    let (world, domain) = learned("tower_blocked");
    let on_base = |l: &Layout, kind: &str| {
        l.objects.iter().zip(&l.located).any(|(o, located)| {
            &*o.kind == kind && located.fact.is_some_and(|f| f.reference.is_some())
        })
    };
    let blocked = scene(&world, &domain, |l| on_base(l, "yellow"));
    let problem = Problem::new(&domain, &blocked).expect("a problem");
    let start = blocked.situation();
    let ground = problem.ground(&start).expect("it compiles");
    let clear = ground.domain().states().iter().position(|s| s.name.starts_with("NO_YELLOW"));
    assert!(clear.is_some(), "{:?}", ground.domain());
    assert!(decide(&ground, &start).contains("YELLOW"));
    let free = scene(&world, &domain, |l| !on_base(l, "yellow"));
    let problem = Problem::new(&domain, &free).expect("a problem");
    let start = free.situation();
    let ground = problem.ground(&start).expect("it compiles");
    assert!(decide(&ground, &start).contains("RED"));
}

/// Teaches the assembly of a nut and a bolt, and returns the domain with the end of the first demonstration.
fn assembly() -> (RelationalDomain, Snapshot) {
    let made = SyntheticDemonstrations::default().record(Seed::new(3)).expect("it is valid");
    let learned = learn(&made.recording, &Settings::default()).expect("it teaches");
    let last = made.recording.demos[0].snapshots.last().expect("it has snapshots").clone();
    (learned.domain, last)
}

/// With one demonstration in which the bolt began in line with the pocket, two places became one state.
#[test]
fn a_bolt_that_begins_in_line_with_the_pocket_is_learned_from_one_demonstration() {
    let spec = SyntheticDemonstrations { demos: 1, ..SyntheticDemonstrations::default() };
    let mut recording = spec.record(Seed::new(3)).expect("it is valid").recording;
    let of = |snapshot: &Snapshot| {
        let index = snapshot.objects.iter().position(|o| &*o.kind == "bolt").expect("there");
        (index, snapshot.objects[index].pose)
    };
    let snapshots = &mut recording.demos[0].snapshots;
    let (begun, end) = (of(&snapshots[0]).1, of(snapshots.last().expect("some")).1);
    for snapshot in snapshots.iter_mut() {
        let (index, pose) = of(snapshot);
        if pose.distance(&begun) < 1e-3 {
            snapshot.objects[index].pose.position[0] = end.position[0] + 9e-4;
        }
    }
    let paper = learn(&recording, &Settings::paper()).expect("it teaches");
    assert!(paper.domain.states.len() < 5, "{:?}", paper.domain);
    let learned = learn(&recording, &Settings::default()).expect("it teaches").domain;
    assert_eq!((learned.states.len(), learned.operators.len()), (5, 3), "{learned:?}");
}

/// Moves an object by a distance along y, in metres.
fn moved(object: &ObjectPose, id: &str, by_m: f64) -> ObjectPose {
    let mut pose = object.pose;
    pose.position[1] += by_m;
    ObjectPose { id: id.into(), kind: object.kind.clone(), pose }
}

/// A bolt in a nut beside the jig was taken for the goal once another nut was in the pocket.
#[test]
fn a_bolt_counts_towards_the_goal_only_in_a_nut_that_is_in_place() {
    let (domain, end) = assembly();
    let words: Vec<String> = domain.goals.iter().map(|g| domain.goal_in_words(g)).collect();
    let expected = ["a nut is in a nut pocket", "a bolt is in a nut that is in a nut pocket"];
    assert_eq!(words, expected);
    let of = |kind: &str| end.objects.iter().find(|o| &*o.kind == kind).expect("it is there");
    let (nut, bolt) = (of("nut").clone(), of("bolt").clone());
    // The pair lies on the table; a second nut is in the pocket, and a second bolt is in the hole or on the table.
    let mut scene = end.clone();
    scene.objects.retain(|o| !["nut", "bolt"].contains(&&*o.kind));
    let down = |o: &ObjectPose, id: &str| {
        let mut low = moved(o, id, 0.35);
        low.pose.position[2] -= 0.042;
        low
    };
    scene.objects.extend([down(&nut, "nut_0"), down(&bolt, "bolt_0"), moved(&nut, "nut_1", 0.0)]);
    let classifier = Classifier::new(&domain);
    let goal_of = |domain: &RelationalDomain| {
        let layout = classifier.classify(&scene);
        let start = layout.situation();
        let name = |s: usize| domain.states[s].name.clone();
        let held: Vec<String> = start.iter().flatten().map(|f| name(f.state)).collect();
        assert!(held.contains(&"BOLT_AT_NUT".into()), "{held:?}");
        assert!(held.contains(&"NUT_AT_NUT_POCKET".into()), "{held:?}");
        let problem = Problem::new(domain, &layout).expect("a problem");
        let ground = problem.ground(&start).expect("it compiles");
        (problem.lacking(&start), ground.goal(&start).is_some())
    };
    assert_eq!(goal_of(&domain), (1, true));
    // One bolt is left in a nut out of place: the planner is stuck, and the pair is to be taken apart.
    let layout = classifier.classify(&scene);
    let start = layout.situation();
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let ground = problem.ground(&start).expect("it compiles");
    let goal = ground.goal(&start).expect("something is left to do");
    assert_eq!(ground.domain()[goal].name, "BOLT_AT_NUT_IN_NUT_AT_NUT_POCKET");
    let decision = planner(&ground).decide(&ground.present(&start), goal).expect("it decides");
    assert!(matches!(decision.verdict, Verdict::Stuck(_)), "{:?}", decision.verdict);
    let apart = ground.misplaced(&start).into_iter().map(|i| &*layout.objects[i].id);
    assert_eq!(apart.collect::<Vec<_>>(), ["bolt_0", "nut_0"]);
    let mut unbound = domain.clone();
    unbound.goals.iter_mut().for_each(|goal| goal.reference = None);
    assert_eq!(goal_of(&unbound), (0, false), "any bolt in any nut would do");
}

/// With a single nut out of its pocket and the bolt in it, the planner was stuck and nothing was tried.
#[test]
fn what_keeps_a_fact_from_holding_is_told_with_its_reference() {
    let (domain, mut scene) = assembly();
    for object in scene.objects.iter_mut().filter(|o| ["nut", "bolt"].contains(&&*o.kind)) {
        object.pose.position[1] += 0.35;
        object.pose.position[2] -= 0.042;
    }
    let layout = Classifier::new(&domain).classify(&scene);
    let start = layout.situation();
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let ground = problem.ground(&start).expect("it compiles");
    let ids = |fact: &str| -> Vec<&str> {
        let index = ground.domain().states().iter().position(|s| s.name == fact);
        let fact = StateId::new(index.unwrap_or_else(|| panic!("{fact}: {:?}", ground.domain())));
        let objects = ground.in_the_way(fact, &start);
        objects.into_iter().map(|i| &*layout.objects[i].id).collect()
    };
    let of = |kind: &str| scene.objects.iter().find(|o| &*o.kind == kind).expect("there");
    assert_eq!(ids("NO_BOLT_AT_NUT_0"), [&*of("bolt").id, &*of("nut").id]);
    assert!(ids("NUT_AT_NUT_POCKET").is_empty(), "it asks for objects");
    assert!(ids("BOLT_AT_BOLT_HOLE_0_PLACE_FREE").is_empty(), "it holds");
}

#[test]
fn four_holes_are_filled_one_after_another() {
    let (world, domain) = learned("flange");
    let layout = scene(&world, &domain, |_| true);
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let start = layout.situation();
    let ground = problem.ground(&start).expect("it compiles");
    let holes = |name: &str| name.starts_with("PUT_BOLT") && name.contains("_PLACE_");
    let actions = ground.domain().operators().iter();
    assert_eq!(actions.filter(|a| holes(&a.name)).count(), 4, "{:?}", ground.domain());
    assert!(ground.domain().state("AT_LEAST_4_BOLT_AT_FLANGE").is_ok(), "{:?}", ground.domain());
    let mut log = Vec::new();
    let rolled = roll(&problem, ground, &start, &mut log);
    assert_eq!(rolled, Rolled::Met { moves: 5 }, "{log:?}");
    let mut filled: Vec<&String> = log.iter().filter(|name| holes(name)).collect();
    filled.sort_unstable();
    filled.dedup();
    assert_eq!(filled.len(), 4, "{log:?}");
    assert!(log[log.len() - 1].starts_with("PUT_COVER"), "{log:?}");
}

#[test]
fn a_need_that_no_object_can_fulfil_is_dropped_and_the_rest_is_kept() {
    let (world, domain) = learned("nuts_nut_first");
    let layout = scene(&world, &domain, |_| true);
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let mut start = layout.situation();
    let whole = problem.ground(&start).expect("it compiles");
    assert!(whole.dropped().is_empty(), "{:?}", whole.dropped());
    // All objects but one nut and one bolt are in no state: nothing but these can be moved.
    let mut seen = std::collections::BTreeSet::new();
    for (object, fact) in layout.objects.iter().zip(&mut start) {
        if !seen.insert(object.kind.clone()) {
            *fact = None;
        }
    }
    let ground = problem.ground(&start).expect("it compiles");
    assert!(ground.out_of_reach(&start).is_empty(), "{:?}", ground.domain());
    let rolled = roll(&problem, ground, &start, &mut Vec::new());
    assert!(matches!(rolled, Rolled::Met { .. }), "{rolled:?}");
}

enum Parts {}

impl VocabTag for Parts {
    const NAME: &'static str = "parts";
}

#[test]
fn pointers_are_products_of_roles_and_identities_and_stay_apart() {
    let (world, domain) = learned("cup_stack");
    let layout = scene(&world, &domain, |_| true);
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let ground = problem.ground(&layout.situation()).expect("it compiles");
    let planner = planner(&ground);
    let encoded = planner.encoded();
    let atoms = encoded.atoms.as_ref().expect("built from roles");
    // Unbinding everything but one identity leaves this identity.
    let with = |part: Part, s: &&State| ground.composition().filler(&s.name, part).is_some();
    let states = ground.domain().states().iter();
    let mut about: Vec<&State> = states
        .filter(|s| with(Part::Object, s) && with(Part::Reference, s))
        .filter(|s| with(Part::Count, s) && ground.composition().factors(&s.name).len() == 4)
        .collect();
    assert!(about.len() >= 2, "{:?}", ground.domain());
    about.sort_by_key(|s| s.name.clone());
    let raw = |pointer: &[f32]| -> Vec<f32> { pointer.to_vec() };
    for state in about {
        let filler = |part| ground.composition().filler(&state.name, part).expect("it has one");
        let mut parts = VocabularyBuilder::<Parts>::new(atoms.dim(), Seed::new(1));
        for (name, values) in [
            ("FACT", raw(&encoded.states.get(&state.name).unwrap())),
            ("OBJECT", raw(&atoms.get("OBJECT").unwrap())),
            ("REFERENCE", raw(&atoms.get("REFERENCE").unwrap())),
            ("OWN", raw(&atoms.get(&format!("IDENTITY_{}", filler(Part::Object))).unwrap())),
            ("COUNT", raw(&atoms.get("COUNT").unwrap())),
            ("NUMBER", raw(&atoms.get(&format!("NUMBER_{}", filler(Part::Count))).unwrap())),
            ("STATE", raw(&atoms.get(&format!("SYMBOL_{}", filler(Part::Symbol))).unwrap())),
        ] {
            parts = parts.vector(name, &PointerRef::<Parts>::from_raw(&values));
        }
        let parts = parts.build().expect("it builds");
        let read = parts
            .parse("~(FACT * ~STATE * ~COUNT * ~NUMBER * ~OBJECT * ~OWN * ~REFERENCE)")
            .expect("unbound");
        let nearest = atoms.names().iter().max_by(|a, b| {
            let near = |name: &str| dot(&raw(&read), &raw(&atoms.get(name).unwrap()));
            near(a).total_cmp(&near(b))
        });
        let expected = format!("IDENTITY_{}", filler(Part::Reference));
        assert_eq!(nearest, Some(&expected), "{}", state.name);
    }
    // "A on B" and "B on A" are dissimilar, like any two.
    let names: Vec<&String> = ground.domain().states().iter().map(|s| &s.name).collect();
    for (i, a) in names.iter().enumerate() {
        for b in &names[..i] {
            let [x, y] = [a, b].map(|n| raw(&encoded.states.get(n).unwrap()));
            assert!(dot(&x, &y).abs() < 0.45, "{a} and {b}: {}", dot(&x, &y));
        }
    }
}

#[test]
fn pointers_of_too_few_dimensions_are_refused_and_enough_are_chosen() {
    let (world, domain) = learned("table_knife_first");
    let layout = scene(&world, &domain, |_| true);
    let problem = Problem::new(&domain, &layout).expect("a problem");
    let ground = problem.ground(&layout.situation()).expect("it compiles");
    let d = ground.domain();
    let few = Encoded::composed(d, ground.composition(), 16, Seed::new(1)).map(|_| ());
    assert!(matches!(few, Err(TaskError::TooFewDimensions { dimensions: 16, .. })), "{few:?}");
    let needed = Encoded::dimensions_for(d, 64);
    assert!((128..=1024).contains(&needed), "{needed}");
    let spec = PlannerSpec { dimensions: 64, ..PlannerSpec::default() };
    let plan = PopulationPlan::direct();
    let built = Planner::composed(d, ground.composition(), spec, &plan, Seed::new(1));
    assert!(built.expect("it builds").spec().dimensions >= needed);
}

/// How many plans of the planner graph reached the goal, in how many situations with a plan of the reference planner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Agreement {
    /// Scenes of which no problem could be made.
    no_problem: usize,
    situations: usize,
    reached: usize,
    /// Reached with at most as many moves as the reference planner takes.
    as_short: usize,
    /// Situations from which the reference planner finds no plan.
    without_plan: usize,
    /// Situations without a plan in which the graph reached the goal.
    only_graph: usize,
}

/// Compares plans in random situations: each is reached from a test scene by random moves that the operators allow.
fn compare(world: &World, seeds: u64, scenes: u64, walks: u64) -> Agreement {
    let mut found = Agreement::default();
    let (mut built_ms, mut size) = (0.0f64, (0, 0, 0));
    for seed in 1..=seeds {
        let domain = taught(world, seed);
        let classifier = Classifier::new(&domain);
        for scene in 0..scenes {
            let seed = Seed::new(seed).derive_index("test", scene);
            let layout = classifier.classify(&world.begin(seed, Stage::Test).snapshot());
            let Ok(problem) = Problem::new(&domain, &layout) else {
                found.no_problem += 1;
                continue;
            };
            for walk in 0..walks {
                let mut rng = seed.derive_index("walk", walk).rng();
                let mut start = layout.situation();
                for _ in 0..walk {
                    let moves = problem.moves(&start);
                    if let Some(m) = moves.get(rng.random_range(0..moves.len().max(1))) {
                        start = problem.after(m, &start);
                    }
                }
                let began = Instant::now();
                let ground = problem.ground(&start).expect("it compiles");
                planner(&ground);
                built_ms = built_ms.max(began.elapsed().as_secs_f64() * 1e3);
                let d = ground.domain();
                let dimensions = planner(&ground).spec().dimensions;
                size = size.max((d.states().len(), d.operators().len(), dimensions));
                let mut log = Vec::new();
                let rolled = roll(&problem, ground.clone(), &start, &mut log);
                let Ok(plan) = problem.plan(&start, &[]) else {
                    found.without_plan += 1;
                    found.only_graph += usize::from(matches!(rolled, Rolled::Met { .. }));
                    continue;
                };
                found.situations += 1;
                match rolled {
                    Rolled::Met { moves } => {
                        found.reached += 1;
                        found.as_short += usize::from(moves <= plan.len());
                    }
                    other => tell(world, &problem, &ground, &start, &other, &log),
                }
            }
        }
    }
    println!(
        "{:20} {found:?} facts, actions, dimensions {size:?}, built in {built_ms:.0} ms",
        world.name()
    );
    found
}

/// Prints a plan that failed.
fn tell(
    world: &World,
    problem: &Problem<'_>,
    ground: &GroundProblem,
    start: &Situation,
    rolled: &Rolled,
    log: &[String],
) {
    let plan = problem.plan(start, &[]).unwrap_or_default();
    println!("   {}: {rolled:?} after {log:?}; dropped {:?}", world.name(), ground.dropped());
    if std::env::var("WORLD").is_ok() {
        for m in &plan {
            println!("     {} {:?}", problem.domain().operators[m.action.operator].name, m.action);
        }
        let (d, present) = (ground.domain(), ground.present(start));
        for s in d.state_ids() {
            println!("    fact {} {}", d[s].name, present.holds(s));
        }
        for a in d.operators() {
            let (needs, effects) = (d.names(&a.preconditions), d.names(&a.effects));
            println!("    {} {needs:?} -> {effects:?}", a.name);
        }
    }
}

#[test]
#[ignore = "long statistics: 720 situations of all worlds"]
fn the_graph_agrees_with_the_reference_planner() {
    let only = std::env::var("WORLD").ok();
    let mut all = Agreement::default();
    for world in worlds::plain().iter().filter(|w| only.as_ref().is_none_or(|o| o == w.name())) {
        let own = compare(world, 2, 3, 6);
        all.no_problem += own.no_problem;
        all.situations += own.situations;
        all.reached += own.reached;
        all.as_short += own.as_short;
        all.without_plan += own.without_plan;
        all.only_graph += own.only_graph;
    }
    println!("{all:?}");
    let expected = Agreement {
        no_problem: 0,
        situations: 720,
        reached: 720,
        as_short: 720,
        without_plan: 0,
        only_graph: 0,
    };
    assert!(only.is_some() || all == expected, "{all:?}");
}

/// Returns a situation in which each object is anywhere: at any place of any state of its kind, or in no state.
fn anywhere(problem: &Problem<'_>, rng: &mut impl rand::Rng) -> Situation {
    let domain = problem.domain();
    let of_kind = |kind: &str| {
        let objects = problem.objects().iter().enumerate();
        objects.filter(|(_, o)| *o.kind == *kind).map(|(i, _)| i).collect::<Vec<_>>()
    };
    let draw = |(object, laid): (usize, &ObjectPose)| {
        let states = domain.states.iter().enumerate().filter(|(_, s)| s.kind == *laid.kind);
        let states: Vec<_> = states.collect();
        if states.is_empty() || rng.random_bool(0.1) {
            return None;
        }
        let (state, s) = states[rng.random_range(0..states.len())];
        let place = rng.random_range(0..s.places.len());
        let reference = match s.frame.kind() {
            None => None,
            Some(kind) => {
                let others: Vec<_> = of_kind(kind).into_iter().filter(|r| *r != object).collect();
                if others.is_empty() {
                    return None;
                }
                Some(others[rng.random_range(0..others.len())])
            }
        };
        Some(Fact { state, place, reference })
    };
    problem.objects().iter().enumerate().map(draw).collect()
}

#[test]
fn facts_that_exclude_each_other_hold_together_in_no_situation_and_most_such_pairs_are_found() {
    let mut rng = Seed::new(5).rng();
    let (mut found, mut never) = (0, 0);
    for world in worlds::plain() {
        let name = world.name();
        let (world, domain) = learned(name);
        let layout = scene(&world, &domain, |layout| Problem::new(&domain, layout).is_ok());
        let problem = Problem::new(&domain, &layout).expect("checked");
        let ground = problem.ground(&layout.situation()).expect("it compiles");
        let facts = ground.domain().states().len();
        let mut together = vec![vec![false; facts]; facts];
        for _ in 0..3_000 {
            let situation = anywhere(&problem, &mut rng);
            let present = ground.present(&situation);
            let holds: Vec<usize> = present.iter().map(|state| state.index()).collect();
            for a in &holds {
                holds.iter().for_each(|b| together[*a][*b] = true);
            }
        }
        for [a, b] in ground.exclusions().iter().map(|pair| pair.map(StateId::index)) {
            let names = [a, b].map(|f| ground.domain()[StateId::new(f)].name.clone());
            assert!(a < b && !together[a][b], "{name}: {names:?}");
            found += usize::from(together[a][a] && together[b][b]);
        }
        let apart = (0..facts).flat_map(|b| (0..b).map(move |a| (a, b)));
        never += apart
            .filter(|(a, b)| !together[*a][*b] && together[*a][*a] && together[*b][*b])
            .count();
    }
    println!("{found} pairs found, {never} that were never seen together");
    assert!(found >= 100 && found * 2 >= never, "{found} {never}");
}
