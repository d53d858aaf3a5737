//! Parts that sit as demonstrated, and parts that nearly do.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "physics")]

use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt;
use symbolt::robot::Pose;
use symbolt::sim::Seed;
use symbolt::task::classify::{Classifier, Layout, Miss};
use symbolt::task::domain::{Quantity, RelationalDomain};
use symbolt::task::learn::{Learned, Settings, learn};
use symbolt::task::{Demonstration, ObjectPose, Recording, Snapshot, SnapshotEvent};

const POCKET: [f64; 3] = [0.42, -0.22, 0.042];
/// Heights of a nut's centre and of a bolt's head in the jig, and of both on the table, in metres.
const SEATED: [f64; 2] = [0.050, 0.058];
const LYING: [f64; 2] = [0.008, 0.0148];

fn pose(position: [f64; 3], [about_x, about_z]: [f64; 2]) -> Pose {
    let turn = UnitQuaternion::from_euler_angles(about_x.to_radians(), 0.0, 0.0)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), about_z.to_radians());
    Pose { position, orientation: [turn.i, turn.j, turn.k, turn.w] }
}

fn scene(nut: Pose, bolt: Pose) -> Snapshot {
    let object = |id: &str, kind: &str, pose| ObjectPose { id: id.into(), kind: kind.into(), pose };
    Snapshot {
        objects: vec![
            object("nut_0", "nut", nut),
            object("bolt_0", "bolt", bolt),
            object("pocket_0", "pocket", Pose::at(POCKET)),
        ],
        ..Snapshot::default()
    }
}

/// Puts a nut into its pocket and a bolt through it, each time to within 30 micrometres. With `door`, a door closes by
/// itself when all is done, after the last attempt.
fn recording(demos: u64, door: bool) -> Recording {
    let demo = |number: u64| {
        let mut rng = Seed::new(7).derive_index("demo", number).rng();
        let mut draw = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let mut lying = |z: f64, on_side: f64| {
            pose([draw(0.38, 0.58), draw(0.03, 0.29), z], [on_side, draw(-180.0, 180.0)])
        };
        let start = [lying(LYING[0], 0.0), lying(LYING[1], 90.0)];
        let mut seated = |z: f64| {
            let [x, y] = [0, 1].map(|i| POCKET[i] + draw(-3e-5, 3e-5));
            pose([x, y, z + draw(-1e-7, 1e-7)], [draw(-1e-3, 1e-3), draw(-180.0, 180.0)])
        };
        let end = SEATED.map(&mut seated);
        let steps = [
            (SnapshotEvent::Start, None, [start[0], start[1]]),
            (SnapshotEvent::Contact, Some(0), [start[0], start[1]]),
            (SnapshotEvent::Release, Some(0), [end[0], start[1]]),
            (SnapshotEvent::Contact, Some(1), [end[0], start[1]]),
            (SnapshotEvent::Release, Some(1), end),
            (SnapshotEvent::End, None, end),
            (SnapshotEvent::End, None, end),
        ];
        let snapshots = steps.into_iter().enumerate().map(|(number, (event, object, poses))| {
            let mut scene = scene(poses[0], poses[1]);
            if door {
                let x = if number == 6 { 0.2 } else { 0.1 };
                let pose = Pose::at([x, 0.5, 0.1]);
                scene.objects.push(ObjectPose { id: "door_0".into(), kind: "door".into(), pose });
            }
            let (event, time_s) = (Some(event), Some(number as f64));
            Snapshot { number: number as u64, time_s, event, object, ..scene }
        });
        Demonstration { number, snapshots: snapshots.collect() }
    };
    Recording { demos: (0..demos).map(demo).collect() }
}

fn relational(demos: u64) -> RelationalDomain {
    learn(&recording(demos, false), &Settings::default()).expect("it teaches").domain
}

fn plain(demos: u64) -> RelationalDomain {
    learn(&recording(demos, false), &Settings::paper()).expect("it teaches").domain
}

fn lying_bolt() -> Pose {
    pose([0.5, 0.2, LYING[1]], [90.0, 30.0])
}

/// A nut in its pocket, this far off.
fn nut(aside_m: f64, high_m: f64, tilt_deg: f64) -> Pose {
    pose([POCKET[0] + aside_m, POCKET[1], SEATED[0] + high_m], [tilt_deg, 25.0])
}

fn state_of(domain: &RelationalDomain, layout: &Layout, object: usize) -> Option<String> {
    layout.located[object].fact.map(|fact| domain.states[fact.state].name.clone())
}

/// Says whether a nut counts as seated in the domain of each method, after this many demonstrations.
fn seated(demos: u64, nut: Pose) -> [bool; 2] {
    [relational(demos), plain(demos)].map(|domain| {
        let layout = Classifier::new(&domain).classify(&scene(nut, lying_bolt()));
        state_of(&domain, &layout, 0).is_some_and(|name| name.ends_with("POCKET"))
    })
}

#[test]
fn a_nut_tilted_by_ten_degrees_or_2_6_mm_high_is_not_seated() {
    for demos in [5, 1] {
        assert_eq!(seated(demos, nut(0.0, 0.0, 0.0)), [true; 2], "{demos}");
        for (high_m, tilt_deg) in [(2.6e-3, 10.0), (2.6e-3, 0.0), (0.0, 10.0), (0.0, -10.0)] {
            let wrong = nut(2e-4, high_m, tilt_deg);
            assert_eq!(seated(demos, wrong), [false; 2], "{demos}: {high_m} m, {tilt_deg} degrees");
        }
    }
}

#[test]
fn the_spread_of_a_fixed_prior_would_take_the_tilted_nut_as_seated() {
    // A prior of 3 mm leaves 1.3 mm after five demonstrations, and the tilt was not compared.
    let wrong = nut(2e-4, 2.6e-3, 10.0);
    let framed = relational(5);
    let loose = Classifier::new(&framed).with_noise(1.3e-3, 0.06);
    let layout = loose.classify(&scene(wrong, lying_bolt()));
    assert!(state_of(&framed, &layout, 0).is_some_and(|name| name.ends_with("POCKET")));
}

#[test]
fn every_part_with_the_play_of_its_place_is_seated() {
    // Greatest deviations of correctly seated parts in 584 cases of the physics, and a half more.
    let domains = [relational(5), relational(1), plain(5), plain(1)];
    let mut rng = Seed::new(3).rng();
    let mut count = 0;
    for _ in 0..500 {
        let turn = std::f64::consts::TAU * rng.random::<f64>();
        let (far, up): (f64, f64) = (rng.random(), rng.random());
        let mut pose = nut(0.0, 1e-4 * (2.0 * up - 1.0), 0.15);
        pose.position[0] += 2e-3 * far * turn.cos();
        pose.position[1] += 2e-3 * far * turn.sin();
        for domain in &domains {
            let layout = Classifier::new(domain).classify(&scene(pose, lying_bolt()));
            let name = state_of(domain, &layout, 0);
            assert!(name.as_ref().is_some_and(|n| n.ends_with("POCKET")), "{name:?} at {pose:?}");
            count += 1;
        }
    }
    assert_eq!(count, 2000);
}

#[test]
fn found_states_stay_wide() {
    let domains = [relational(5), plain(5)];
    // Elsewhere on the table, on something 5 mm high, and not level.
    for (x, y, high, tilt) in
        [(0.40, 0.1, 0.0, 0.0), (0.60, 0.31, 5e-3, 0.0), (0.45, 0.0, 5e-3, 30.0)]
    {
        let there = pose([x, y, LYING[0] + high], [tilt, 70.0]);
        for domain in &domains {
            let layout = Classifier::new(domain).classify(&scene(there, lying_bolt()));
            assert_eq!(state_of(domain, &layout, 0).as_deref(), Some("NUT_AT_START"));
        }
    }
}

#[test]
fn the_miss_of_a_part_in_no_state_is_named() {
    let framed = relational(5);
    let layout = Classifier::new(&framed).classify(&scene(nut(2e-4, 2.6e-3, 10.0), lying_bolt()));
    let Some(Miss { nearest, offset }) = layout.located[0].miss else { panic!("in a state") };
    assert!(framed.states[nearest.state].name.ends_with("POCKET"));
    assert_eq!(nearest.reference, Some(2));
    assert_eq!(offset.in_words(), "2.6 mm too high and tilted by 10 degrees");
    assert!((offset.high_m - 2.6e-3).abs() < 1e-4 && offset.off_m >= offset.high_m);
    // A fixture has no states, and a part in a state has no miss.
    assert_eq!((layout.located[1].miss, layout.located[2].miss), (None, None));
    let flat = plain(5);
    let located = Classifier::new(&flat).classify_alone("nut", &nut(0.0, 2.6e-3, 10.0));
    let Some(Miss { nearest, offset }) = located.miss else { panic!("in a state") };
    assert!(flat.states[nearest.state].name.ends_with("POCKET"));
    assert_eq!(offset.in_words(), "2.6 mm too high and tilted by 10 degrees");
}

#[test]
fn a_part_that_creeps_out_of_its_place_loses_its_state() {
    // Steps of 0.1 mm are below the movement that counts. With the pose of the look before as the measure, as `reset`
    // does it, the part would keep its state for ever.
    let framed = relational(5);
    let classifier = Classifier::new(&framed);
    for reset in [false, true] {
        let mut layout = classifier.classify(&scene(nut(0.0, 0.0, 0.0), lying_bolt()));
        let mut left = None;
        for step in 1..=60 {
            if reset {
                for (object, located) in layout.objects.iter().zip(&mut layout.located) {
                    located.taken = object.pose;
                }
            }
            let now = scene(nut(1e-4 * f64::from(step), 0.0, 0.0), lying_bolt());
            layout = classifier.classify_after(&layout, &now);
            if layout.located[0].fact.is_none() && left.is_none() {
                left = Some(step);
            }
        }
        match (reset, left) {
            (true, left) => assert_eq!(left, None),
            (false, left) => assert!(left.is_some_and(|s| (25..45).contains(&s)), "{left:?}"),
        }
    }
}

#[test]
fn a_part_at_rest_keeps_its_state_in_spite_of_small_movements() {
    let framed = relational(5);
    let classifier = Classifier::new(&framed);
    // At the limit of the place, a geometric look alone would change its mind from look to look.
    let at = |aside_m: f64| scene(nut(aside_m, 0.0, 0.0), lying_bolt());
    let mut layout = classifier.classify(&at(2.8e-3));
    let (mut kept, mut alone) = (0, 0);
    for step in 0..20 {
        let now = at(2.8e-3 + if step % 2 == 0 { 4e-4 } else { 0.0 });
        layout = classifier.classify_after(&layout, &now);
        kept += usize::from(layout.located[0].fact.is_some());
        alone += usize::from(classifier.classify(&now).located[0].fact.is_some());
    }
    assert_eq!(kept, 20);
    assert_eq!(alone, 10);
}

#[test]
fn a_door_that_closes_by_itself_has_no_states_and_is_no_goal() {
    let learned = learn(&recording(5, true), &Settings::default()).expect("it teaches");
    let remarks: Vec<String> = learned.remarks.iter().map(ToString::to_string).collect();
    assert!(remarks.iter().any(|said| said.contains("door")), "{remarks:?}");
    let names = |learned: &Learned| {
        let states = learned.domain.states.iter().map(|s| s.name.clone());
        states.collect::<Vec<_>>()
    };
    assert!(names(&learned).iter().all(|name| !name.starts_with("DOOR")), "{learned:?}");
    let without = learn(&recording(5, false), &Settings::default()).expect("it teaches");
    assert!(without.remarks.is_empty(), "{:?}", without.remarks);
    assert_eq!(names(&learned), names(&without));
    assert_eq!(learned.domain.goals, without.domain.goals);
}

#[test]
fn the_goal_of_one_demonstration_has_a_term_for_each_state_that_it_reached() {
    let domain = relational(1);
    let goals: Vec<&str> = domain.goals.iter().map(|g| &domain.states[g.state].name[..]).collect();
    assert_eq!(goals.len(), 2, "{goals:?}");
    assert!(goals[0].starts_with("NUT_AT") && goals[1].starts_with("BOLT_AT"), "{goals:?}");
    assert!(domain.goals.iter().all(|g| g.quantity == Quantity::AtLeast(1)), "{domain:?}");
}

#[test]
fn a_bolt_in_a_nut_that_lies_upside_down_is_recognised() {
    let domain = relational(5);
    let bolt = pose([POCKET[0], POCKET[1], SEATED[1]], [0.0, 40.0]);
    let [upright, over] = [0.0, 180.0].map(|about_x| {
        let nut = pose([POCKET[0], POCKET[1], SEATED[0]], [about_x, 25.0]);
        Classifier::new(&domain).classify(&scene(nut, bolt))
    });
    for object in 0..2 {
        let states = [&upright, &over].map(|layout| state_of(&domain, layout, object));
        assert!(states[0].is_some(), "{object}");
        assert_eq!(states[0], states[1]);
    }
}
