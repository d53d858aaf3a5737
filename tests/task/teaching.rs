//! What a teacher shows and is told: one of several ways, all of a kind, numbers, demonstrations that end differently, a
//! single demonstration, and the demonstration that is asked for next.

use std::path::Path;

use rand::RngExt;
use rand::seq::SliceRandom;
use symbolt::robot::Pose;
use symbolt::sim::Seed;
use symbolt::study::asking::{Question, ask};
use symbolt::task::classify::{Classifier, Layout};
use symbolt::task::compile::Problem;
use symbolt::task::domain::{GoalTerm, NeedVerdict, Quantity, RelationalDomain};
use symbolt::task::learn::{Learned, learn};
use symbolt::task::planner::{PlannerBuild, PlannerKind, SceneEnd};
use symbolt::task::recording::{Demonstration, ObjectPose};
use symbolt::task::{Recording, Snapshot, SnapshotEvent};

/// Numbers of objects, by kind.
type Counts = Vec<usize>;
/// Whether something may be done with a kind, or holds, given the parts that are placed and those that exist.
type Law = Box<dyn Fn(usize, &Counts, &Counts) -> bool>;
type Test = Box<dyn Fn(&Counts, &Counts) -> bool>;
/// Draws an order of kinds, given the parts that exist.
type Order = Box<dyn Fn(&Counts, &mut rand_chacha::ChaCha8Rng) -> Vec<usize>>;

/// A world in which parts lie on a table and are put on a base that stands anywhere.
struct World {
    /// The kinds of parts, each with the number of its places on the base.
    kinds: Vec<(&'static str, usize)>,
    /// Draws how many parts of each kind there are.
    present: Box<dyn Fn(&mut rand_chacha::ChaCha8Rng) -> Counts>,
    /// Whether a part of a kind may be put on the base, given those that are there and those that exist.
    allowed: Law,
    /// The kinds that the demonstrator puts there, in order, given those that exist.
    shown: Order,
    solved: Test,
}

/// A scene of a world.
struct Run<'w> {
    world: &'w World,
    base: Pose,
    /// The kind of each part, its pose, and its place on the base.
    parts: Vec<(usize, Pose, Option<usize>)>,
    rng: rand_chacha::ChaCha8Rng,
}

fn turned(position: [f64; 3], angle: f64) -> Pose {
    let orientation = [0.0, 0.0, (0.5 * angle).sin(), (0.5 * angle).cos()];
    Pose { orientation, ..Pose::at(position) }
}

fn rotation(pose: &Pose) -> nalgebra::UnitQuaternion<f64> {
    nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::from(pose.orientation))
}

/// A place of a kind, in the frame of the base.
fn place(kind: usize, index: usize) -> [f64; 3] {
    [0.06 * kind as f64 - 0.12, 0.06 * index as f64 - 0.1, 0.02 + 0.007 * kind as f64]
}

impl<'w> Run<'w> {
    fn begin(world: &'w World, seed: Seed) -> Self {
        let mut rng = seed.rng();
        let at = [rng.random_range(0.4..0.6), rng.random_range(-0.2..0.3), 0.1];
        let base = turned(at, rng.random_range(-0.6..0.6));
        let mut parts = Vec::new();
        for (kind, count) in (world.present)(&mut rng).into_iter().enumerate() {
            for _ in 0..count {
                let z = 0.01 + 0.004 * kind as f64;
                let at = [rng.random_range(-0.5..0.1), rng.random_range(-0.4..0.4), z];
                parts.push((kind, turned(at, rng.random_range(-3.0..3.0)), None));
            }
        }
        Self { world, base, parts, rng }
    }

    fn counts(&self, placed: bool) -> Counts {
        let own =
            |kind| self.parts.iter().filter(move |p| p.0 == kind && (!placed || p.2.is_some()));
        (0..self.world.kinds.len()).map(|kind| own(kind).count()).collect()
    }

    fn id(&self, part: usize) -> String {
        let kind = self.parts[part].0;
        let before = self.parts[..part].iter().filter(|p| p.0 == kind).count();
        format!("{}_{before}", self.world.kinds[kind].0)
    }

    fn snapshot(&self) -> Snapshot {
        let object =
            |id: String, kind: &str, pose| ObjectPose { id: id.into(), kind: kind.into(), pose };
        let parts = (0..self.parts.len())
            .map(|p| object(self.id(p), self.world.kinds[self.parts[p].0].0, self.parts[p].1));
        let base = object("base_0".into(), "base", self.base);
        Snapshot { objects: [base].into_iter().chain(parts).collect(), ..Snapshot::default() }
    }

    /// Puts a part at a free place, if the world allows it.
    fn put(&mut self, part: usize, at: usize) -> bool {
        let kind = self.parts[part].0;
        let free = !self.parts.iter().any(|p| p.0 == kind && p.2 == Some(at));
        let (placed, present) = (self.counts(true), self.counts(false));
        if !free || self.parts[part].2.is_some() || !(self.world.allowed)(kind, &placed, &present) {
            return false;
        }
        let mut off = || self.rng.random_range(-4e-4..4e-4);
        let there = place(kind, at).map(|v| v + off());
        let turn = rotation(&turned([0.0; 3], off()));
        let position = rotation(&self.base) * nalgebra::Vector3::from(there);
        let position = std::array::from_fn(|i| position[i] + self.base.position[i]);
        let q = rotation(&self.base) * turn;
        let orientation = [q.i, q.j, q.k, q.w];
        self.parts[part].1 = Pose { position, orientation };
        self.parts[part].2 = Some(at);
        true
    }

    /// Puts a part of a kind at a free place.
    fn put_kind(&mut self, kind: usize) -> Option<usize> {
        let mut own: Vec<usize> = (0..self.parts.len())
            .filter(|p| self.parts[*p].0 == kind && self.parts[*p].2.is_none())
            .collect();
        own.shuffle(&mut self.rng);
        let part = *own.first()?;
        let places = shuffled((0..self.world.kinds[kind].1).collect(), &mut self.rng);
        places.into_iter().find_map(|at| self.put(part, at).then_some(part))
    }

    /// Moves a part to a pose; `false` if the world refuses it.
    fn act(&mut self, part: usize, target: &Pose) -> bool {
        let kind = self.parts[part].0;
        let turn = rotation(&self.base).inverse();
        let far =
            nalgebra::Vector3::from(target.position) - nalgebra::Vector3::from(self.base.position);
        let there = turn * far;
        let near = |at: &usize| (there - nalgebra::Vector3::from(place(kind, *at))).norm() < 5e-3;
        let at = (0..self.world.kinds[kind].1).find(near);
        at.is_some_and(|at| self.put(part, at))
    }

    fn solved(&self) -> bool {
        (self.world.solved)(&self.counts(true), &self.counts(false))
    }
}

/// Films moves of a run: each puts a part of a kind on the base, or returns `None` if it cannot.
fn film(mut run: Run<'_>, number: u64, moves: impl Iterator<Item = usize>) -> Demonstration {
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let mut take = |snapshot: Snapshot, event, object| {
        let number = snapshots.len() as u64;
        let time_s = Some(number as f64);
        snapshots.push(Snapshot { number, time_s, event: Some(event), object, ..snapshot });
    };
    take(run.snapshot(), SnapshotEvent::Start, None);
    for kind in moves {
        let before = run.snapshot();
        if let Some(part) = run.put_kind(kind) {
            take(before, SnapshotEvent::Contact, Some(part + 1));
            take(run.snapshot(), SnapshotEvent::Release, Some(part + 1));
        }
    }
    take(run.snapshot(), SnapshotEvent::End, None);
    Demonstration { number, snapshots }
}

fn demonstration(world: &World, seed: Seed, number: u64) -> Demonstration {
    let mut run = Run::begin(world, seed.derive_index("shown", number));
    let order = (world.shown)(&run.counts(false), &mut run.rng);
    film(run, number, order.into_iter())
}

fn demonstrations(world: &World, seed: Seed, demos: u64) -> Recording {
    Recording { demos: (0..demos).map(|number| demonstration(world, seed, number)).collect() }
}

fn learned(recording: &Recording) -> Learned {
    learn(recording, &Default::default()).expect("it can be learned")
}

/// Plans anew after each move in a new scene. Returns whether the goal is reached without a move that the world refuses.
fn done(domain: &RelationalDomain, world: &World, seed: Seed) -> bool {
    let mut run = Run::begin(world, seed);
    let classifier = Classifier::new(domain);
    let mut last: Option<Layout> = None;
    for _ in 0..20 {
        let scene = run.snapshot();
        let layout = match &last {
            Some(before) => classifier.classify_after(before, &scene),
            None => classifier.classify(&scene),
        };
        let Ok(problem) = Problem::new(domain, &layout) else { return false };
        let Ok(plan) = problem.plan(&layout.situation(), &[]) else { return false };
        let Some(step) = plan.first().map(|step| step.action) else {
            return run.solved();
        };
        let target = problem.target(&step, &layout);
        // The base is the first object.
        if !run.act(step.object - 1, &target.pose) {
            return false;
        }
        last = Some(layout);
    }
    false
}

/// The number of scenes, of ten for each seed, that are done after five demonstrations.
fn rate(world: &World, seeds: std::ops::Range<u64>) -> (usize, usize) {
    let (mut solved, mut of) = (0, 0);
    for seed in seeds {
        let seed = Seed::new(seed);
        let Ok(learned) = learn(&demonstrations(world, seed, 5), &Default::default()) else {
            of += 10;
            continue;
        };
        for test in 0..10 {
            let met = done(&learned.domain, world, seed.derive_index("test", test));
            solved += usize::from(met);
            of += 1;
        }
    }
    (solved, of)
}

fn shuffled(mut all: Vec<usize>, rng: &mut rand_chacha::ChaCha8Rng) -> Vec<usize> {
    all.shuffle(rng);
    all
}

/// One of several keys opens a vault, and then the box goes in.
fn either(keys: usize, of_two: bool) -> World {
    let names = ["red", "blue", "green"];
    let mut kinds: Vec<(&'static str, usize)> =
        names[..keys].iter().map(|name| (*name, 1)).collect();
    kinds.push(("box", 1));
    World {
        kinds,
        present: Box::new(move |rng| {
            let mut all: Counts =
                (0..keys).map(|_| usize::from(rng.random_range(0..3) > 0)).collect();
            if of_two || all.iter().sum::<usize>() == 0 {
                all = vec![1; keys];
            }
            all.push(1);
            all
        }),
        allowed: Box::new(move |kind, placed, _| kind < keys || placed[..keys].contains(&1)),
        shown: Box::new(move |present, rng| {
            let own = (0..keys).filter(|k| present[*k] > 0).collect();
            vec![shuffled(own, rng)[0], keys]
        }),
        solved: Box::new(move |placed, _| placed[keys] == 1),
    }
}

/// A lid goes on when all tiles are in, however many there are.
fn all_of() -> World {
    World {
        kinds: vec![("tile", 5), ("lid", 1)],
        present: Box::new(|rng| vec![rng.random_range(1..=5), 1]),
        allowed: Box::new(|kind, placed, present| match kind {
            0 => placed[1] == 0,
            _ => placed[0] == present[0],
        }),
        shown: Box::new(|present, _| [vec![0; present[0]], vec![1]].concat()),
        solved: Box::new(|placed, present| placed == present),
    }
}

/// Every tile goes on the base.
fn every() -> World {
    World {
        kinds: vec![("tile", 5), ("peg", 1)],
        present: Box::new(|rng| vec![rng.random_range(1..=5), 1]),
        allowed: Box::new(|_, _, _| true),
        shown: Box::new(|present, rng| shuffled([vec![0; present[0]], vec![1]].concat(), rng)),
        solved: Box::new(|placed, present| placed == present),
    }
}

/// A lid goes on two tiles of some.
fn number() -> World {
    World {
        kinds: vec![("tile", 2), ("lid", 1)],
        present: Box::new(|rng| vec![rng.random_range(2..=5), 1]),
        allowed: Box::new(|kind, placed, _| match kind {
            0 => placed[1] == 0,
            _ => placed[0] >= 2,
        }),
        shown: Box::new(|_, _| vec![0, 0, 1]),
        solved: Box::new(|placed, _| placed[0] == 2 && placed[1] == 1),
    }
}

/// Parts in an order that is partly needed, and the pairs of kinds of which the first has to be there before the second.
fn ordered(seed: Seed) -> (World, Vec<(usize, usize)>) {
    let mut rng = seed.derive("", "world").rng();
    let count: usize = rng.random_range(4..=6);
    let names = ["ring", "plate", "wheel", "pin", "cap", "disc"];
    let mut pairs: Vec<(usize, usize)> = (0..count)
        .flat_map(|k| (0..k).map(move |n| (n, k)))
        .filter(|_| rng.random_range(0..4) == 0)
        .collect();
    for middle in 0..count {
        let longer = pairs.iter().filter(|p| p.1 == middle).flat_map(|(first, _)| {
            pairs.iter().filter(|p| p.0 == middle).map(move |(_, last)| (*first, *last))
        });
        pairs.extend(longer.collect::<Vec<_>>());
    }
    let (needs, before) = (pairs.clone(), pairs.clone());
    let world = World {
        kinds: names[..count].iter().map(|name| (*name, 1)).collect(),
        present: Box::new(move |_| vec![1; count]),
        allowed: Box::new(move |kind, placed, _| {
            needs.iter().all(|(first, then)| *then != kind || placed[*first] == 1)
        }),
        shown: Box::new(move |_, rng| {
            let mut order: Vec<usize> = Vec::new();
            while order.len() < count {
                let ready = |k: &usize| {
                    let mut own = before.iter().filter(|(_, then)| then == k);
                    !order.contains(k) && own.all(|(first, _)| order.contains(first))
                };
                let ready: Vec<usize> = (0..count).filter(ready).collect();
                order.push(shuffled(ready, rng)[0]);
            }
            order
        }),
        solved: Box::new(|placed, present| placed == present),
    };
    (world, pairs)
}

fn fixture(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/learned").join(name)
}

#[test]
fn either_key_opens_it_and_the_box_does_not_go_first() {
    let recording = Recording::read(&fixture("either_key.jsonl")).expect("a recording");
    let domain = learned(&recording).domain;
    let scene = Snapshot::read(&fixture("either_key_scene.json")).expect("a scene");
    let layout = Classifier::new(&domain).classify(&scene);
    for kind in [PlannerKind::GoalSets, PlannerKind::Chain] {
        let problem = Problem::new(&domain, &layout).expect("a problem");
        let build = PlannerBuild { kind, ..PlannerBuild::default() };
        let plan = build.plan(&problem, &layout, PlannerBuild::LIMIT).expect("a plan");
        let actions: Vec<&str> = plan.moves.iter().map(|m| &*m.action).collect();
        assert_eq!(actions, ["PUT_RED_AT_VAULT", "PUT_BOX_AT_VAULT"], "{kind:?}");
        assert_eq!(plan.end, SceneEnd::Met);
    }
    // The condition survives its file, and is said in words.
    let again = RelationalDomain::parse(domain.to_json().expect("text").as_bytes(), "again");
    let again = again.expect("a domain");
    assert_eq!(again, domain);
    let words: Vec<String> = (again.operators.iter())
        .flat_map(|o| o.needs.iter().map(|need| again.need_in_words(o, need)))
        .filter(|words| words.contains(" or "))
        .collect();
    let expected = "a blue is at the vault or a red is at the vault";
    assert_eq!(words, [expected]);
}

#[test]
fn one_of_several_keys_is_learned_from_five_demonstrations() {
    for world in [either(2, false), either(2, true)] {
        let (solved, of) = rate(&world, 300..306);
        assert!(10 * solved >= 9 * of, "{solved} of {of}");
    }
}

#[test]
fn all_of_a_kind_are_counted_in_the_scene_and_not_in_the_demonstrations() {
    for (name, world) in [("a condition", all_of()), ("a goal", every())] {
        let (solved, of) = rate(&world, 300..306);
        assert!(10 * solved >= 9 * of, "{name}: {solved} of {of}");
    }
}

#[test]
fn a_number_that_is_less_than_all_stays_a_number() {
    let (solved, of) = rate(&number(), 300..306);
    assert!(10 * solved >= 9 * of, "{solved} of {of}");
}

#[test]
fn a_condition_on_more_objects_than_there_are_asks_for_all_of_them() {
    // Two tiles each time, both in before the lid.
    let shown = World { present: Box::new(|_| vec![2, 1]), ..all_of() };
    let domain = learned(&demonstrations(&shown, Seed::new(5), 5)).domain;
    let one = World { present: Box::new(|_| vec![1, 1]), ..all_of() };
    let run = Run::begin(&one, Seed::new(6));
    let layout = Classifier::new(&domain).classify(&run.snapshot());
    let lid = domain.goals.iter().find(|goal| domain.states[goal.state].kind == "lid");
    let goal = GoalTerm { quantity: Quantity::AtLeast(1), ..lid.expect("a term").clone() };
    let problem = Problem::with_goals(&domain, &layout, vec![goal]).expect("a problem");
    let plan = problem.plan(&layout.situation(), &[]).expect("a plan");
    assert_eq!(plan.len(), 2, "{plan:?}");
}

#[test]
fn demonstrations_that_end_differently_offer_their_goals() {
    let recording = Recording::read(&fixture("two_goals.jsonl")).expect("a recording");
    let domain = learned(&recording).domain;
    assert_eq!(domain.names(&domain.other_goals()), ["CUBE_AT_CASE", "DISC_AT_CASE"]);
    // Where they end alike, or where something is done for something else, there is nothing to offer.
    for world in [either(2, false), all_of(), every(), ordered(Seed::new(1)).0] {
        let domain = learned(&demonstrations(&world, Seed::new(1), 6)).domain;
        assert!(domain.other_goals().is_empty(), "{:?}", domain.names(&domain.other_goals()));
    }
    let same = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/learned/flange.json");
    let domain = RelationalDomain::read(&same).expect("a domain");
    assert!(domain.other_goals().is_empty());
}

#[test]
fn one_demonstration_says_that_its_frames_are_not_certain() {
    let world = every();
    let learned = learned(&demonstrations(&world, Seed::new(3), 1));
    let kinds: Vec<&str> = learned.unsure_frames.iter().map(|(_, kind)| &**kind).collect();
    assert!(!kinds.is_empty());
    assert!(kinds.contains(&"base"), "{kinds:?}");
    let two = demonstrations(&world, Seed::new(3), 2);
    assert_eq!(learn(&two, &Default::default()).expect("learned").unsure_frames, []);
}

/// The number of undecided conditions.
fn undecided(domain: &RelationalDomain) -> usize {
    domain.operators.iter().map(|o| o.needs_with(NeedVerdict::Undecided).count()).sum()
}

/// The kind that a symbol or a sentence of a state or an action is about.
fn kind_in(world: &World, name: &str) -> usize {
    let name = name.to_lowercase();
    let one = |word: &str| {
        let own = |kind: &str| word == kind || word.strip_suffix('s') == Some(kind);
        world.kinds.iter().position(|(kind, _)| own(kind))
    };
    let word = name.split(['_', ' ']).find_map(one);
    word.expect("a kind")
}

/// Does what is asked, as far as the world allows: what it refuses is done as soon as it can be.
fn answer(question: &Question, mut run: Run<'_>) -> Demonstration {
    let world = run.world;
    let mut open: Vec<usize> =
        question.moves.iter().map(|(action, _)| kind_in(world, action)).collect();
    let gone = |part: &(usize, Pose, Option<usize>)| open.contains(&part.0);
    run.parts.retain(gone);
    let (mut placed, present) = (run.counts(true), run.counts(false));
    let mut possible = Vec::new();
    while let Some(next) = open.iter().position(|k| (world.allowed)(*k, &placed, &present)) {
        let kind = open.remove(next);
        placed[kind] += 1;
        possible.push(kind);
    }
    film(run, 0, possible.into_iter())
}

/// What three questions decide, and six demonstrations at random, after two demonstrations.
#[derive(Debug, Default)]
struct Decided {
    /// Conditions that an answer shows to be a coincidence.
    dismissed: i64,
    /// Conditions that the teacher says are needed, because they keep what was asked from being shown.
    confirmed: i64,
    /// Conditions that the demonstrations at random show to be a coincidence, and those that 60 more do.
    random: i64,
    most: i64,
}

fn decided(seeds: std::ops::Range<u64>) -> Decided {
    let mut sum = Decided::default();
    for seed in seeds {
        let seed = Seed::new(seed);
        let (world, pairs) = ordered(seed);
        let left = |recording: &Recording| undecided(&learned(recording).domain) as i64;
        let mut recording = demonstrations(&world, seed, 2);
        let two = left(&recording);
        let mut needed: Vec<(String, String)> = Vec::new();
        for number in 2..5 {
            let domain = learned(&recording).domain;
            let Some(question) = ask(&domain, &recording, &needed) else { break };
            let run = Run::begin(&world, seed.derive_index("asked", number));
            recording.demos.push(Demonstration { number, ..answer(&question, run) });
            let real = |(action, need): &(String, String)| {
                let (a, b) = (kind_in(&world, action), kind_in(&world, need));
                pairs.contains(&(a, b)) || pairs.contains(&(b, a))
            };
            needed.extend(question.decides.into_iter().filter(real));
        }
        sum.dismissed += two - left(&recording);
        sum.confirmed += needed.len() as i64;
        sum.random += two - left(&demonstrations(&world, seed, 8));
        sum.most += two - left(&demonstrations(&world, seed, 62));
    }
    sum
}

#[test]
fn three_demonstrations_that_are_asked_for_decide_as_much_as_six_at_random() {
    let decided = decided(400..406);
    assert!(decided.dismissed + decided.confirmed >= decided.random, "{decided:?}");
    // Without what the teacher says, they dismiss nearly as much.
    assert!(10 * decided.dismissed >= 9 * decided.random, "{decided:?}");
}

#[test]
fn what_no_order_decides_is_asked_for_with_fewer_objects() {
    // There is always a tile left on the table when the lid goes on.
    let domain = learned(&demonstrations(&spare(), Seed::new(8), 5)).domain;
    let recording = demonstrations(&spare(), Seed::new(8), 5);
    let question = ask(&domain, &recording, &[]).expect("a question");
    assert!(question.without.iter().all(|id| id.starts_with("tile")), "{question:?}");
    assert!(!question.without.is_empty(), "{question:?}");
    let about = |(_, need): &(String, String)| need.contains("other tiles are in");
    assert!(question.decides.iter().any(about), "{question:?}");
}

/// One tile of three goes on the base, then the lid.
fn spare() -> World {
    World {
        present: Box::new(|_| vec![3, 1]),
        allowed: Box::new(|kind, placed, _| kind == 0 || placed[0] >= 1),
        shown: Box::new(|_, _| vec![0, 1]),
        solved: Box::new(|placed, _| placed[0] == 1 && placed[1] == 1),
        ..number()
    }
}

/// `SEEDS=500 cargo test --test task every_way -- --ignored --nocapture` prints the figures of other seeds.
#[test]
#[ignore = "long statistics: twenty learning seeds of each world"]
fn every_way_of_teaching_is_learned_with_twenty_seeds() {
    let from = std::env::var("SEEDS").ok().and_then(|s| s.parse().ok()).unwrap_or(500);
    let seeds = || from..from + 20;
    let worlds = [
        ("either of 2, one or both present", either(2, false)),
        ("either of 2, both present", either(2, true)),
        ("either of 3", either(3, true)),
        ("all of, before the lid", all_of()),
        ("every, as a goal", every()),
        ("two of some", number()),
    ];
    for (name, world) in worlds {
        let (solved, of) = rate(&world, seeds());
        println!("{name}: {solved} of {of}");
        assert!(10 * solved >= 9 * of, "{name}: {solved} of {of}");
        assert!(10 * solved >= 9 * of, "{name}: {solved} of {of}");
    }
    println!("{:?}", decided(seeds()));
}
