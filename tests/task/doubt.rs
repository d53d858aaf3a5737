//! Doubts: mistakes planted in good recordings are named by the right warning, and good recordings have none.

use std::collections::BTreeSet;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use symbolt::doubt::{DoubtKind, doubts};
use symbolt::robot::Pose;
use symbolt::sim::Seed;
use symbolt::study::worlds;
use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
use symbolt::task::{Demonstration, ObjectPose, Recording, Sensing, Snapshot, SnapshotEvent};

type Turn = UnitQuaternion<f64>;

fn good(world: &str, seed: u64) -> Recording {
    worlds::named(world).unwrap().record(5, Seed::new(seed))
}

fn kinds(recording: &Recording) -> BTreeSet<DoubtKind> {
    doubts(recording).iter().map(|doubt| doubt.kind).collect()
}

fn objects(demo: &mut Demonstration) -> impl Iterator<Item = &mut ObjectPose> {
    demo.snapshots.iter_mut().flat_map(|s| &mut s.objects)
}

/// Changes all poses of all demonstrations, or of the third alone.
fn change(recording: &mut Recording, one: bool, how: impl Fn(&mut ObjectPose)) {
    let demos = recording.demos.iter_mut().enumerate().filter(|(d, _)| !one || *d == 2);
    demos.for_each(|(_, demo)| objects(demo).for_each(&how));
}

fn turn(pose: &Pose) -> Turn {
    let [x, y, z, w] = pose.orientation;
    Turn::from_quaternion(Quaternion::new(w, x, y, z))
}

fn moved(pose: &Pose, by: &Turn, to: [f64; 3]) -> Pose {
    let at = by * Vector3::from(pose.position) + Vector3::from(to);
    let q = by * turn(pose);
    Pose { position: at.into(), orientation: [q.i, q.j, q.k, q.w] }
}

/// Multiplies times.
fn slower(recording: &mut Recording, factor: f64, one: bool) {
    let demos = recording.demos.iter_mut().enumerate().filter(|(d, _)| !one || *d == 2);
    for snapshot in demos.flat_map(|(_, demo)| &mut demo.snapshots) {
        snapshot.time_s = snapshot.time_s.map(|t| factor * t);
    }
}

/// Returns the snapshot and the object of the first contact.
fn contact(demo: &Demonstration) -> (usize, usize) {
    let is = |s: &Snapshot| s.event == Some(SnapshotEvent::Contact);
    let at = demo.snapshots.iter().position(is).unwrap();
    (at, demo.snapshots[at].object.unwrap())
}

/// Exchanges two objects from a snapshot on.
fn exchange(demo: &mut Demonstration, from: usize, (a, b): (usize, usize)) {
    for snapshot in &mut demo.snapshots[from..] {
        let pose = snapshot.objects[a].pose;
        snapshot.objects[a].pose = snapshot.objects[b].pose;
        snapshot.objects[b].pose = pose;
    }
}

type Plant = fn(&mut Recording);

/// The mistakes: a name, the right doubt, the worlds in which they can be seen, and how they are made.
const PLANTED: [(&str, DoubtKind, &[&str], Plant); 33] = [
    ("millimetres", DoubtKind::LengthUnit, &["tower", "pegs", "bins", "drawer"], |r| {
        scale(r, 1e3, false)
    }),
    ("centimetres", DoubtKind::LengthUnit, &["tower", "pegs", "bins", "drawer"], |r| {
        scale(r, 1e2, false)
    }),
    ("inches", DoubtKind::LengthUnit, &["tower", "pegs", "bins", "drawer"], |r| {
        scale(r, 39.37, false)
    }),
    ("metres taken for millimetres", DoubtKind::LengthUnit, &["tower", "pegs", "nuts"], |r| {
        scale(r, 1e-3, false)
    }),
    ("millimetres in one", DoubtKind::LengthUnit, &["tower", "pegs", "bins", "nuts"], |r| {
        scale(r, 1e3, true)
    }),
    ("one kind in millimetres", DoubtKind::LengthUnit, &["tower", "nuts", "table"], |r| {
        let kind = r.demos[0].snapshots[0].objects[1].kind.clone();
        change(r, false, |o| {
            if o.kind == kind {
                o.pose.position = o.pose.position.map(|v| 1e3 * v);
            }
        });
    }),
    ("milliseconds", DoubtKind::TimeUnit, &["tower", "lever", "bins"], |r| slower(r, 1e3, false)),
    ("nanoseconds", DoubtKind::TimeUnit, &["tower", "lever", "bins"], |r| slower(r, 1e9, false)),
    ("milliseconds in one", DoubtKind::TimeUnit, &["tower", "lever", "bins"], |r| {
        slower(r, 1e3, true)
    }),
    ("wxyz", DoubtKind::QuaternionOrder, &["tower", "nuts", "table", "flange", "lever"], |r| {
        reorder(r, false)
    }),
    ("wxyz in one", DoubtKind::QuaternionOrder, &["tower", "nuts", "flange"], |r| reorder(r, true)),
    ("radians taken for degrees", DoubtKind::AngleUnit, &["tower", "nuts", "table"], |r| {
        change(r, false, |o| {
            let q = Turn::from_scaled_axis(turn(&o.pose).scaled_axis() / 57.29578);
            o.pose.orientation = [q.i, q.j, q.k, q.w];
        });
    }),
    ("y and z exchanged", DoubtKind::UpAxis, &["tower", "nuts", "table", "flange"], |r| {
        change(r, false, |o| o.pose.position.swap(1, 2));
    }),
    ("x and z exchanged", DoubtKind::UpAxis, &["tower", "nuts", "table", "flange"], |r| {
        change(r, false, |o| o.pose.position.swap(0, 2));
    }),
    ("y and z exchanged in one", DoubtKind::UpAxis, &["tower", "nuts", "table"], |r| {
        change(r, true, |o| o.pose.position.swap(1, 2));
    }),
    ("z down", DoubtKind::UpsideDown, &["tower", "nuts", "flange"], |r| {
        change(r, false, |o| o.pose.position[2] *= -1.0);
    }),
    ("turned over", DoubtKind::UpsideDown, &["tower", "nuts", "table", "flange"], |r| {
        let over = Turn::from_scaled_axis(Vector3::x() * std::f64::consts::PI);
        change(r, false, |o| o.pose = moved(&o.pose, &over, [0.0; 3]));
    }),
    ("z down in one", DoubtKind::UpsideDown, &["tower", "nuts", "table", "flange"], |r| {
        change(r, true, |o| o.pose.position[2] *= -1.0);
    }),
    ("frame of a camera", DoubtKind::TiltedFrame, &["tower", "nuts", "table", "lever"], |r| {
        let look = Turn::from_euler_angles(2.2, 0.1, 0.4);
        change(r, false, |o| o.pose = moved(&o.pose, &look, [0.1, 0.05, 0.9]));
    }),
    ("tilted by 8 degrees", DoubtKind::TiltedFrame, &["tower", "nuts", "table", "lever"], |r| {
        let tilt = Turn::from_euler_angles(0.14, 0.03, 0.0);
        change(r, false, |o| o.pose = moved(&o.pose, &tilt, [0.0; 3]));
    }),
    ("frame of a moving camera", DoubtKind::MovingCamera, &["tower", "table", "flange"], |r| {
        drift(r, false)
    }),
    (
        "frame of a moving camera in one",
        DoubtKind::MovingCamera,
        &["tower", "table", "nuts"],
        |r| drift(r, true),
    ),
    ("left-handed", DoubtKind::LeftHanded, &["table", "nuts_jig_anywhere"], |r| {
        change(r, false, |o| o.pose.position[1] *= -1.0);
    }),
    ("x and y exchanged", DoubtKind::LeftHanded, &["table", "nuts_jig_anywhere"], |r| {
        change(r, false, |o| o.pose.position.swap(0, 1));
    }),
    ("z raised in one", DoubtKind::Shifted, &["tower", "nuts", "table", "flange"], |r| {
        change(r, true, |o| o.pose.position[2] += 0.05);
    }),
    ("wrong label", DoubtKind::WrongObject, &["tower", "nuts", "table", "flange"], |r| {
        let demo = &mut r.demos[2];
        let (at, object) = contact(demo);
        let other = (object + 1) % demo.snapshots[at].objects.len();
        demo.snapshots[at].object = Some(other);
        demo.snapshots[at + 1].object = Some(other);
    }),
    ("glitch", DoubtKind::Jump, &["tower", "nuts", "table"], |r| {
        let demo = &mut r.demos[2];
        let (at, object) = contact(demo);
        let other = (object + 1) % demo.snapshots[at].objects.len();
        demo.snapshots[at].objects[other].pose.position[0] += 0.4;
    }),
    ("repeated line", DoubtKind::DuplicateTime, &["tower", "lever", "bins"], |r| {
        let again = r.demos[2].snapshots[1].clone();
        r.demos[2].snapshots.insert(1, again);
    }),
    ("time that stands", DoubtKind::DuplicateTime, &["tower", "lever", "bins"], |r| {
        r.demos[2].snapshots[2].time_s = r.demos[2].snapshots[1].time_s;
    }),
    ("ids exchanged", DoubtKind::SwappedIds, &["tower", "table", "pegs"], |r| {
        let demo = &mut r.demos[2];
        let (at, touched) = contact(demo);
        let all = &demo.snapshots[at].objects;
        let pairs = (0..all.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let mut pairs =
            pairs.filter(|(a, b)| all[*a].kind == all[*b].kind && *a != touched && *b != touched);
        let pair = pairs.next().unwrap();
        exchange(demo, at, pair);
    }),
    ("object under two ids", DoubtKind::SamePlace, &["tower", "nuts", "table"], |r| {
        for snapshot in r.demos.iter_mut().flat_map(|d| &mut d.snapshots) {
            let again = ObjectPose { id: "again".into(), ..snapshot.objects[1].clone() };
            snapshot.objects.push(again);
        }
    }),
    ("poses that stop", DoubtKind::NothingMoves, &["tower", "nuts", "drawer"], |r| {
        let demo = &mut r.demos[2];
        let first = demo.snapshots[0].objects.clone();
        demo.snapshots.iter_mut().for_each(|s| s.objects.clone_from(&first));
    }),
    ("one demonstration", DoubtKind::FewDemonstrations, &["tower", "lever", "bins"], |r| {
        r.demos.truncate(1)
    }),
];

fn scale(recording: &mut Recording, factor: f64, one: bool) {
    change(recording, one, |o| o.pose.position = o.pose.position.map(|v| factor * v));
}

fn reorder(recording: &mut Recording, one: bool) {
    change(recording, one, |o| o.pose.orientation.rotate_right(1));
}

fn drift(recording: &mut Recording, one: bool) {
    for (_, demo) in recording.demos.iter_mut().enumerate().filter(|(d, _)| !one || *d == 2) {
        for (s, snapshot) in demo.snapshots.iter_mut().enumerate() {
            let (s, by) = (s as f64, Turn::from_euler_angles(0.0, 0.0, 0.07 * s as f64));
            let to = [0.04 * s, 0.05 * (1.3 * s).sin(), 0.02 * (2.1 * s).cos()];
            snapshot.objects.iter_mut().for_each(|o| o.pose = moved(&o.pose, &by, to));
        }
    }
}

#[test]
fn planted_mistakes_are_named_by_the_right_doubt() {
    let (mut planted, mut wrong) = (0, Vec::new());
    for (name, right, worlds, plant) in PLANTED {
        for world in worlds {
            for seed in 1..=3 {
                let mut recording = good(world, seed);
                plant(&mut recording);
                planted += 1;
                let found = kinds(&recording);
                if found != BTreeSet::from([right]) {
                    wrong.push(format!("{name}, {world} {seed}: {found:?}"));
                }
            }
        }
    }
    assert!(planted > 300, "{planted}");
    assert!(wrong.is_empty(), "{} of {planted}:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn good_recordings_have_no_doubts() {
    let (mut count, mut wrong) = (0, Vec::new());
    let noisy = Sensing { pose_noise_m: 2e-3, pose_noise_deg: 1.0, ..Sensing::default() };
    let missing = Sensing { missing_rate: 0.1, ..Sensing::default() };
    let mut check = |name: String, recording: &Recording| {
        count += 1;
        wrong.extend(doubts(recording).iter().map(|doubt| format!("{name}: {doubt}")));
    };
    for world in worlds::all() {
        let recording = world.record(5, Seed::new(11));
        check(world.name().into(), &recording);
        for sensing in [&noisy, &missing] {
            let seen = sensing.apply_recording(&recording, Seed::new(11));
            check(format!("{}, {sensing:?}", world.name()), &seen);
        }
    }
    let synthetic = SyntheticDemonstrations::default().record(Seed::new(1)).unwrap();
    check("synthetic".into(), &synthetic.recording);
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/learned");
    for file in std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()) {
        if file.extension().is_some_and(|end| end == "jsonl") {
            check(file.display().to_string(), &Recording::read(&file).unwrap());
        }
    }
    assert!(count > 100, "{count}");
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn doubts_name_the_unit_and_how_to_ask_for_it() {
    for (factor, unit) in [(1e3, "mm"), (1e2, "cm"), (39.37, "inch")] {
        let mut recording = good("tower", 1);
        scale(&mut recording, factor, false);
        let doubt = &doubts(&recording)[0];
        assert!(doubt.reading.contains(unit), "{doubt}");
        assert!(doubt.ask.contains("`length`"), "{doubt}");
    }
    let mut recording = good("tower", 1);
    scale(&mut recording, 1e3, true);
    assert_eq!(doubts(&recording)[0].place, "demo 2");
}

#[test]
fn warnings_give_the_numbers_of_snapshots_that_the_file_has() {
    let mut recording = good("tower", 1);
    let (at, object) = contact(&recording.demos[2]);
    for snapshot in recording.demos.iter_mut().flat_map(|d| &mut d.snapshots) {
        snapshot.number = 10 * snapshot.number + 7;
    }
    recording.demos[2].snapshots[at].objects[(object + 1) % 3].pose.position[0] += 0.4;
    let number = recording.demos[2].snapshots[at].number;
    assert_eq!(doubts(&recording)[0].place, format!("demo 2, snapshot {number}"));
    recording.demos[2].snapshots[at].time_s = recording.demos[2].snapshots[at - 1].time_s;
    let found = doubts(&recording);
    let twice = found.iter().find(|d| d.kind == DoubtKind::DuplicateTime).unwrap();
    assert_eq!(twice.place, format!("demo 2, snapshot {number}"));
}

#[test]
fn two_hands_do_not_repeat_a_line() {
    use SnapshotEvent::{Contact, End, Release, Start};
    let steps = [
        (Start, None),
        (Contact, Some(0)),
        (Contact, Some(1)),
        (Release, Some(0)),
        (Release, Some(1)),
        (End, None),
    ];
    let demo = |number: u64| {
        let x = |by: u64| 0.05 * ((by * number) % 11) as f64;
        let (mut at, tray) = ([[x(3), x(5), 0.02], [x(7), 0.7 - x(4), 0.02]], [0.9, x(2), 0.01]);
        let snapshot = |(s, (event, object)): (usize, (SnapshotEvent, Option<usize>))| {
            if let (Release, Some(o)) = (event, object) {
                at[o] = [tray[0] - 0.1 * o as f64, tray[1], 0.03];
            }
            let names = [("a", "part"), ("b", "part"), ("tray", "tray")];
            let objects = names.iter().zip([at[0], at[1], tray]).map(|((id, kind), at)| {
                ObjectPose { id: (*id).into(), kind: (*kind).into(), pose: Pose::at(at) }
            });
            let objects = objects.collect();
            Snapshot { number: s as u64, time_s: None, event: Some(event), object, objects }
        };
        Demonstration { number, snapshots: steps.into_iter().enumerate().map(snapshot).collect() }
    };
    let mut recording = Recording { demos: (1..6).map(demo).collect() };
    assert_eq!(doubts(&recording), []);
    let again = recording.demos[2].snapshots[1].clone();
    recording.demos[2].snapshots.insert(1, again);
    assert_eq!(kinds(&recording), BTreeSet::from([DoubtKind::DuplicateTime]));
}

/// Five demonstrations in which four parts of a stack or a wall go elsewhere, with a door that stays.
fn parted(apart: [f64; 3], kind: &str, to: [f64; 3]) -> Recording {
    let demo = |number: u64| {
        let draw = |by: u64| 0.1 * ((by * number) % 11) as f64;
        let [x, z] = [draw(3), 0.8 + draw(5)];
        let start =
            |p: usize| [x, 0.0, z].into_iter().zip(apart).map(move |(a, by)| a + by * p as f64);
        let mut at: Vec<Vec<f64>> = (0..4).map(|p| start(p).collect()).collect();
        let mut snapshots = Vec::new();
        let mut take = |event, object, at: &[Vec<f64>]| {
            let part = |(p, at): (usize, &Vec<f64>)| ObjectPose {
                id: format!("p{p}").into(),
                kind: kind.into(),
                pose: Pose::at([at[0], at[1], at[2]]),
            };
            let mut objects: Vec<ObjectPose> = at.iter().enumerate().map(part).collect();
            objects.push(ObjectPose {
                id: "door".into(),
                kind: "door".into(),
                pose: Pose::at([1.6, 0.0, 1.0]),
            });
            snapshots.push(Snapshot {
                number: snapshots.len() as u64,
                time_s: None,
                event: Some(event),
                object,
                objects,
            });
        };
        take(SnapshotEvent::Start, None, &at);
        for p in (0..4).rev() {
            take(SnapshotEvent::Contact, Some(p), &at);
            at[p] = (0..3).map(|i| to[i] + if i == 0 { 0.2 * p as f64 } else { 0.0 }).collect();
            take(SnapshotEvent::Release, Some(p), &at);
        }
        take(SnapshotEvent::End, None, &at);
        Demonstration { number, snapshots }
    };
    Recording { demos: (1..6).map(demo).collect() }
}

#[test]
fn cards_in_a_stack_are_not_in_each_other() {
    let mut recording = parted([0.0, 0.0, 0.0003], "card", [0.3, 0.4, 0.9]);
    assert!(!kinds(&recording).contains(&DoubtKind::SamePlace), "{:?}", doubts(&recording));
    let first = &mut recording.demos[0].snapshots[0].objects;
    first[1].pose = first[0].pose;
    assert!(kinds(&recording).contains(&DoubtKind::SamePlace));
}

#[test]
fn pictures_on_a_wall_are_upright() {
    let recording = parted([0.3, 0.0, 0.07], "picture", [-0.4, 0.0, 1.3]);
    assert!(!kinds(&recording).contains(&DoubtKind::UpAxis), "{:?}", doubts(&recording));
}

#[test]
fn a_hall_may_be_driven_through_and_a_task_may_be_slow() {
    let mut recording = good("tower", 1);
    scale(&mut recording, 30.0, false);
    let (at, _) = contact(&recording.demos[2]);
    recording.demos[2].snapshots[at].time_s = recording.demos[2].snapshots[at - 1].time_s;
    let found = doubts(&recording);
    assert!(found[0].reading.ends_with("or the robot drives"), "{}", found[0]);
    assert!(kinds(&recording).contains(&DoubtKind::DuplicateTime), "{found:?}");
    let mut recording = good("tower", 1);
    slower(&mut recording, 300.0, false);
    let found = doubts(&recording);
    assert!(found[0].reading.ends_with("or the task is slow"), "{}", found[0]);
}

#[test]
fn a_table_below_the_base_of_the_robot_is_not_upside_down() {
    for world in ["tower", "nuts", "table", "flange"] {
        let mut recording = good(world, 1);
        let starts = recording.demos.iter().flat_map(|d| &d.snapshots[0].objects);
        let top = starts.map(|o| o.pose.position[2]).fold(f64::MIN, f64::max);
        for below in [0.01, 0.2] {
            let mut lowered = recording.clone();
            change(&mut lowered, false, |o| o.pose.position[2] -= top + below);
            assert_eq!(doubts(&lowered), [], "{world}, {below}");
        }
        change(&mut recording, false, |o| o.pose.position[2] = -0.1 - o.pose.position[2]);
        let down = kinds(&recording).contains(&DoubtKind::UpsideDown);
        assert!(down || world == "table", "{world}");
    }
}

#[test]
fn a_frame_with_y_up_is_no_mistake() {
    let up = Turn::from_scaled_axis(-Vector3::x() * std::f64::consts::FRAC_PI_2);
    let mut recording = good("tower", 1);
    change(&mut recording, false, |o| o.pose = moved(&o.pose, &up, [0.0; 3]));
    assert_eq!(doubts(&recording), []);
}

#[test]
fn objects_that_are_all_at_zero_are_counted_and_not_all_put_into_words() {
    let mut recording = good("tower", 1);
    for demo in &mut recording.demos {
        demo.snapshots.truncate(1);
        let snapshot = &mut demo.snapshots[0];
        let part = ObjectPose { pose: Pose::at([0.0; 3]), ..snapshot.objects[0].clone() };
        let named = |i: usize| ObjectPose { id: format!("p{i}").into(), ..part.clone() };
        snapshot.objects = (0..600).map(named).collect();
    }
    let found = doubts(&recording);
    let same: Vec<_> = found.iter().filter(|d| d.kind == DoubtKind::SamePlace).collect();
    assert_eq!(same.len(), 5, "{found:?}");
    let more = 5 * 600 * 599 / 2 - 5;
    assert!(same[4].seen.ends_with(&format!("and there are {more} more such")), "{}", same[4]);
    assert!(!same[3].seen.contains("more such"), "{}", same[3]);
}
