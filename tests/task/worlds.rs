//! Kinematic worlds with known truth: what they accept and refuse, and what they record.

#![allow(clippy::unwrap_used)]

use std::collections::HashSet;
use std::sync::Arc;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use rand::RngExt;
use symbolt::robot::Pose;
use symbolt::sim::Seed;
use symbolt::study::worlds::{
    Planning, Run, Stage, Trial, World, all, evaluate, named, plain, varied,
};
use symbolt::task::{Demonstration, Recording, Sensing, SnapshotEvent};

/// The pose of an object.
fn pose_of(run: &Run, object: &str) -> Pose {
    run.snapshot().objects.iter().find(|o| &*o.id == object).unwrap().pose
}

fn find(run: &Run, object: &str) -> Isometry3<f64> {
    let Pose { position, orientation: [x, y, z, w] } = pose_of(run, object);
    let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    Isometry3::from_parts(Translation3::from(position), turn)
}

fn stages() -> [Stage; 3] {
    [Stage::Demonstration(0), Stage::Demonstration(1), Stage::Test]
}

fn of(name: &str) -> World {
    named(name).unwrap_or_else(|| panic!("no world {name}"))
}

#[test]
fn the_demonstrator_solves_every_world() {
    for world in all() {
        for seed in 0..6 {
            for stage in stages() {
                let mut run = world.begin(Seed::new(seed), stage);
                assert!(!run.solved(), "{} {seed} {stage:?}", world.name());
                let mut moves = 0;
                while let Some((object, target)) = run.next_move() {
                    assert!(run.act(&object, &target), "{} {seed}: {object}", world.name());
                    moves += 1;
                    assert!(moves < 60, "{} {seed}", world.name());
                }
                assert!(run.solved(), "{} {seed} {stage:?}", world.name());
            }
        }
    }
}

#[test]
fn random_moves_solve_no_plain_world() {
    for world in plain() {
        let mut refused = 0;
        for seed in 0..3 {
            let mut run = world.begin(Seed::new(seed), Stage::Test);
            let mut rng = Seed::new(seed).derive("random", "moves").rng();
            for _ in 0..300 {
                let scene = run.snapshot();
                let object = &scene.objects[rng.random_range(0..scene.objects.len())];
                let near = &scene.objects[rng.random_range(0..scene.objects.len())];
                // Near another object, which is more dangerous than anywhere in the scene.
                let mut target = near.pose;
                for value in &mut target.position {
                    *value += rng.random_range(-0.2..0.2);
                }
                refused += usize::from(!run.act(&object.id, &target));
            }
            assert!(!run.solved(), "{} {seed}", world.name());
        }
        assert!(refused > 300, "{}: {refused}", world.name());
    }
}

#[test]
fn what_nobody_touches_stays_exactly_and_placements_scatter() {
    let recording = of("nuts_distractors").record(10, Seed::new(5));
    let mut seated = Vec::new();
    let mut compared = 0;
    for demo in &recording.demos {
        for pair in demo.snapshots.windows(2) {
            let touched = pair[1].object.filter(|_| pair[1].event == Some(SnapshotEvent::Release));
            for (index, (a, b)) in pair[0].objects.iter().zip(&pair[1].objects).enumerate() {
                if Some(index) == touched {
                    assert_ne!(a.pose, b.pose);
                    let pocket = Pose::at([0.31, -0.22, 0.0522]);
                    if &*b.kind == "nut" {
                        seated.push(b.pose.distance(&pocket));
                    }
                } else {
                    assert_eq!(a.pose, b.pose);
                    compared += 1;
                }
            }
        }
    }
    assert_eq!(seated.len(), 10);
    assert!(compared > 400, "{compared}");
    let worst = seated.iter().copied().fold(0.0, f64::max);
    assert!(worst > 1e-4 && worst < 1e-3, "{worst}");
}

#[test]
fn the_content_moves_with_the_drawer_and_cannot_be_taken_out_of_a_closed_one() {
    let world = of("drawer");
    let mut run = world.begin(Seed::new(1), Stage::Test);
    let table = (pose_of(&run, "box_0"), find(&run, "box_0"));
    let mut closed = false;
    while let Some((object, target)) = run.next_move() {
        let before = find(&run, "drawer_0").inverse() * find(&run, "box_0");
        let was = find(&run, "box_0");
        closed = &*object == "drawer_0";
        assert!(run.act(&object, &target));
        if closed && was != table.1 {
            let after = find(&run, "drawer_0").inverse() * find(&run, "box_0");
            assert!((before.translation.vector - after.translation.vector).norm() < 1e-9);
            let moved = find(&run, "box_0").translation.vector - was.translation.vector;
            assert!((moved.norm() - 0.24).abs() < 2e-3, "{moved}");
        }
    }
    assert!(closed);
    assert!(!run.act("box_0", &table.0));
}

#[test]
fn recordings_repeat_to_the_bit_and_can_be_read_back() {
    for world in all() {
        let recording = world.record(3, Seed::new(9));
        assert_eq!(recording, world.record(3, Seed::new(9)), "{}", world.name());
        assert_ne!(recording, world.record(3, Seed::new(10)), "{}", world.name());
        // A longer recording begins with the same demonstrations.
        assert_eq!(recording.demos[..2], world.record(2, Seed::new(9)).demos[..]);
        for demo in &recording.demos {
            assert!(demo.snapshots.len() >= 4, "{}", world.name());
            for snapshot in &demo.snapshots {
                let contact =
                    matches!(snapshot.event, Some(SnapshotEvent::Contact | SnapshotEvent::Release));
                assert_eq!(snapshot.object.is_some(), contact);
            }
        }
        let text = recording.to_jsonl(None).unwrap();
        let (read, _) = Recording::parse(text.as_bytes(), "recording").unwrap();
        assert_eq!(read.snapshot_count(), recording.snapshot_count());
    }
}

/// Which state's kind the demonstrator touches first, in 20 demonstrations.
fn first_touched(name: &str) -> HashSet<Arc<str>> {
    let recording = of(name).record(20, Seed::new(1));
    let first = recording.demos.iter().map(|d| {
        let contact = &d.snapshots[1];
        contact.objects[contact.object.unwrap()].kind.clone()
    });
    first.collect()
}

#[test]
fn the_order_varies_unless_it_is_a_habit() {
    assert_eq!(first_touched("nuts").len(), 2);
    assert_eq!(first_touched("nuts_nut_first"), HashSet::from(["nut".into()]));
    assert_eq!(first_touched("table").len(), 3);
    assert_eq!(first_touched("table_knife_first"), HashSet::from(["knife".into()]));
    // A habit is not a need: the world accepts the other order.
    let world = of("nuts_nut_first");
    let mut run = world.begin(Seed::new(1), Stage::Test);
    let mut habitual = world.begin(Seed::new(1), Stage::Test);
    let (bolt, hole) = loop {
        let (object, target) = habitual.next_move().unwrap();
        if object.starts_with("bolt") {
            break (object, target);
        }
        assert!(habitual.act(&object, &target));
    };
    assert!(run.act(&bolt, &hole));
}

#[test]
fn heaps_fill_their_bins_and_vary_by_centimetres() {
    let recording = of("bins").record(300, Seed::new(1));
    let mut heights = Vec::new();
    let mut across = Vec::new();
    for demo in &recording.demos {
        for object in &demo.snapshots[0].objects {
            heights.push(object.pose.position[2]);
            across.push(object.pose.position[0]);
        }
    }
    assert!(heights.len() > 1000);
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    let square = heights.iter().map(|h| (h - mean).powi(2)).sum::<f64>();
    let deviation = (square / heights.len() as f64).sqrt();
    assert!(deviation > 0.01, "{deviation}");
    across.sort_by(f64::total_cmp);
    let gap = across.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
    assert!(gap < 0.01, "{gap}");
}

/// How often objects of a kind were touched in each of ten demonstrations.
fn touched(world: &str, kind: &str) -> Vec<usize> {
    let recording = of(world).record(10, Seed::new(1));
    let touches = |demo: &Demonstration| {
        let contacts = demo.snapshots.iter().filter(|s| s.event == Some(SnapshotEvent::Contact));
        contacts.filter(|s| s.object.is_some_and(|o| &*s.objects[o].kind == kind)).count()
    };
    recording.demos.iter().map(touches).collect()
}

#[test]
fn what_is_shown_once_or_twice_is_shown_so_often() {
    assert_eq!(touched("tower_blocked_once", "yellow"), [1, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(touched("drawer_opened_twice", "drawer"), [2, 2, 1, 1, 1, 1, 1, 1, 1, 1]);
    assert_eq!(touched("lever_open_or_closed", "lever"), [2, 1, 2, 1, 2, 1, 2, 1, 2, 1]);
    // Demonstrations that end differently.
    assert_eq!(touched("two_goals", "cube"), [1, 0, 1, 0, 1, 0, 1, 0, 1, 0]);
}

#[test]
fn a_careless_demonstrator_uses_the_whole_tolerance() {
    let farthest = |world: &str| {
        let recording = of(world).record(40, Seed::new(2));
        let ends = recording.demos.iter().map(|demo| demo.snapshots.last().unwrap());
        let off = ends.flat_map(|scene| {
            let of_kind =
                move |kind: &'static str| scene.objects.iter().filter(move |o| &*o.kind == kind);
            let near = |p: &Pose, q: &Pose| (p.distance(q) - 0.16).abs();
            of_kind("fork").filter_map(move |fork| {
                let gaps = of_kind("plate").map(|plate| near(&plate.pose, &fork.pose));
                gaps.min_by(f64::total_cmp).filter(|gap| *gap < 0.03)
            })
        });
        off.fold(0.0, f64::max)
    };
    let (careful, careless) = (farthest("table"), farthest("table_wide"));
    assert!(careful < 0.0125 && careless > 0.013 && careless < 0.016, "{careful} {careless}");
}

#[test]
fn another_hand_moves_what_lies_loose_and_no_event_tells_of_it() {
    let recording = of("tower_bystander").record(10, Seed::new(3));
    let (mut moved, mut steps) = (0, 0);
    for demo in &recording.demos {
        for pair in demo.snapshots.windows(2) {
            let between = pair[0].event == Some(SnapshotEvent::Release);
            let differ = pair[0].objects.iter().zip(&pair[1].objects).filter(|(a, b)| a != b);
            if between {
                steps += 1;
                for (a, b) in differ {
                    moved += 1;
                    assert!((a.pose.position[2] - 0.02).abs() < 1e-3, "{a:?}");
                    assert!((b.pose.position[2] - 0.02).abs() < 1e-3, "{b:?}");
                }
            }
        }
    }
    assert!(moved >= 5 && moved < steps, "{moved} {steps}");
}

#[test]
fn objects_of_a_kind_have_their_sizes_in_every_run() {
    for stage in stages() {
        let scene = of("pegs").begin(Seed::new(4), stage).snapshot();
        let pegs = scene.objects.iter().filter(|o| &*o.kind == "peg");
        let heights: HashSet<i64> =
            pegs.map(|peg| (peg.pose.position[2] * 1e3).round() as i64).collect();
        assert_eq!(heights, HashSet::from([7, 14]));
    }
}

/// Whether the world lets the demonstrator put an object of a kind before anything else is done.
fn may_begin_with(world: &str, kind: &str, seed: u64) -> bool {
    let mut later = of(world).begin(Seed::new(seed), Stage::Test);
    let (object, target) = loop {
        let (object, target) = later.next_move().unwrap();
        if object.starts_with(kind) {
            break (object, target);
        }
        assert!(later.act(&object, &target));
    };
    assert!(later.act(&object, &target), "{world} {seed}");
    of(world).begin(Seed::new(seed), Stage::Test).act(&object, &target)
}

#[test]
fn either_key_is_needed_and_every_block() {
    for seed in 0..6 {
        assert!(!may_begin_with("either_key", "box", seed));
        assert!(!may_begin_with("either_key_both", "box", seed));
        assert!(!may_begin_with("all_of", "lid", seed));
    }
    // One of the keys alone lies there.
    let keys = |seed| {
        let scene = of("either_key").begin(Seed::new(seed), Stage::Test).snapshot();
        scene.objects.iter().filter(|o| ["red", "blue"].contains(&&*o.kind)).count()
    };
    assert!((0..6).all(|seed| keys(seed) == 1));
}

/// A trial of five demonstrations and four episodes.
fn trial(seed: u64, sensing: Sensing) -> Trial {
    let seed = Seed::new(seed);
    Trial { demos: 5, episodes: 4, planner: Planning::Symbolic, sensing, seed }
}

/// Number of episodes done and recognised, of 16 from five demonstrations each.
fn done(world: &str, sensing: Sensing) -> usize {
    (720..724).map(|seed| evaluate(&of(world), &trial(seed, sensing)).unwrap().done()).sum()
}

#[test]
fn a_move_shown_once_is_kept_under_noise() {
    let sensing = Sensing { pose_noise_m: 1e-3, pose_noise_deg: 1.0, ..Sensing::default() };
    assert!(done("tower_blocked_once", sensing) >= 15);
    assert!(done("gate_opened_once", sensing) >= 15);
}

/// On seeds 90210 and 90211, 165 of 184 scenes were done, with one false goal; 132 with 16 before areas of one height, either-or,
/// all-of and offered goals were learned. Two of these worlds are not learned yet: `slabs` and `thin_and_thick`.
#[test]
fn varied_worlds_are_done_from_five_demonstrations() {
    let (mut done, mut wrong, mut of) = (0, 0, 0);
    for world in varied() {
        for seed in 730..734 {
            let found = evaluate(&world, &trial(seed, Sensing::default())).unwrap();
            done += found.done();
            wrong += found.false_goals();
            of += found.outcomes.len();
        }
    }
    println!("{done} of {of}, {wrong} false goals");
    assert!(100 * done >= 85 * of && 100 * wrong <= 3 * of, "{done} of {of}, {wrong} false goals");
}
