//! Recordings as cameras and people make them: objects that are not seen, views that disagree, other people's hands, objects
//! that nobody names, and demonstrations without a common end.

use symbolt::robot::Pose;
use symbolt::sim::Seed;
use symbolt::study::worlds::{Planning, Trial, evaluate, named};
use symbolt::task::domain::RelationalDomain;
use symbolt::task::learn::{Learned, NoGoal, Remark, Settings, learn};
use symbolt::task::{
    Demonstration, ObjectPose, Recording, Sensing, Snapshot, SnapshotEvent as Event,
};

fn learned(recording: &Recording) -> Learned {
    learn(recording, &Settings::default()).expect("something is learned")
}

/// Scenes done and recognised, of four seeds with one each.
fn done(world: &str, sensing: Sensing) -> usize {
    let world = named(world).expect("a world");
    let trial = |seed| Trial {
        demos: 5,
        episodes: 1,
        planner: Planning::Symbolic,
        sensing,
        seed: Seed::new(seed),
    };
    (90310..90314).map(|seed| evaluate(&world, &trial(seed)).expect("an evaluation").done()).sum()
}

/// Of these 36 scenes, 23 were done before what a hand moved and nobody saw since was taken to be nowhere.
#[test]
fn a_tenth_of_the_objects_left_out_costs_no_scene() {
    let missing = Sensing { missing_rate: 0.1, ..Sensing::default() };
    let worlds = [
        "nuts",
        "nuts_jig_anywhere",
        "keyed_peg",
        "conveyor",
        "tower",
        "cup_stack",
        "gate",
        "lever",
        "either_key",
    ];
    let done: Vec<usize> = worlds.iter().map(|world| done(world, missing)).collect();
    assert!(done.iter().sum::<usize>() >= 35, "{done:?} of {worlds:?}");
}

#[test]
fn anywhere_inside_boxes_that_stand_anywhere_is_a_place_and_a_goal() {
    let worlds = ["boxes_alike", "boxes_by_kind", "boxes_emptied", "two_bins"];
    let done: Vec<usize> = worlds.iter().map(|w| done(w, Sensing::default())).collect();
    assert!(done.iter().sum::<usize>() >= 15, "{done:?} of {worlds:?}");
}

/// Eight demonstrations of a world, in which some objects of every second demonstration are shifted upwards.
fn biased(world: &str, off_m: f64, shifted: impl Fn(&ObjectPose) -> bool) -> Recording {
    let noise = Sensing { pose_noise_m: 3e-4, pose_noise_deg: 0.3, ..Sensing::default() };
    let shown = named(world).expect("a world").record(8, Seed::new(90310));
    let mut recording = noise.apply_recording(&shown, Seed::new(90310));
    for demo in recording.demos.iter_mut().skip(1).step_by(2) {
        for object in demo.snapshots.iter_mut().flat_map(|s| &mut s.objects) {
            if shifted(object) {
                object.pose.position[2] += off_m;
            }
        }
    }
    recording
}

fn places(domain: &RelationalDomain) -> usize {
    domain.states.iter().map(|state| state.places.len()).sum()
}

#[test]
fn one_relation_that_two_cameras_show_millimetres_apart_is_one_relation() {
    let is_jig = |object: &ObjectPose| &*object.kind == "jig";
    let is_high = |object: &ObjectPose| &*object.kind == "nut" && object.pose.position[2] > 0.03;
    let said = |learned: &Learned| -> Vec<(Option<String>, Option<String>, usize)> {
        let remarks = learned.remarks.iter().filter_map(|remark| match remark {
            Remark::DemonstrationsDiffer { kind, reference, demos, off_m } => {
                assert!((off_m - 0.01).abs() < 1e-3, "{off_m}");
                Some((kind.clone(), reference.clone(), demos.len()))
            }
            _ => None,
        });
        remarks.collect()
    };
    let (jig, nut) = (Some("jig".to_owned()), Some("nut".to_owned()));
    let straight = learned(&biased("nuts_jig_anywhere", 0.0, is_jig));
    assert_eq!((straight.domain.states.len(), places(&straight.domain)), (5, 5));
    assert_eq!(said(&straight), []);
    let by_jig = learned(&biased("nuts_jig_anywhere", 0.01, is_jig));
    assert_eq!((by_jig.domain.states.len(), places(&by_jig.domain)), (5, 5));
    assert_eq!(said(&by_jig), [(None, jig.clone(), 4)]);
    let by_nut = learned(&biased("nuts_jig_anywhere", 0.01, is_high));
    assert_eq!((by_nut.domain.states.len(), places(&by_nut.domain)), (5, 5));
    assert_eq!(said(&by_nut), [(nut, jig, 4)]);
    // Two places that are 30 mm apart are two.
    let two = learned(&biased("nuts_jig_anywhere", 0.03, is_jig));
    assert_eq!(said(&two), []);
    assert!(places(&two.domain) > 5);
}

fn object(id: &str, position: [f64; 3]) -> ObjectPose {
    let kind = id.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_');
    ObjectPose { id: id.into(), kind: kind.into(), pose: Pose::at(position) }
}

fn snapshot(event: Event, touched: Option<&str>, objects: Vec<ObjectPose>) -> Snapshot {
    let object = touched.and_then(|id| objects.iter().position(|o| &*o.id == id));
    Snapshot { event: Some(event), object, objects, ..Snapshot::default() }
}

fn numbered(demos: impl Iterator<Item = Vec<Snapshot>>) -> Recording {
    let demo = |(number, mut snapshots): (usize, Vec<Snapshot>)| {
        snapshots.iter_mut().zip(0..).for_each(|(s, number)| s.number = number);
        Demonstration { number: number as u64, snapshots }
    };
    Recording { demos: demos.enumerate().map(demo).collect() }
}

/// Numbers that look drawn, between 0 and 1.
fn drawn(demo: usize, index: usize) -> f64 {
    (0.618_034 * (1 + 7 * demo + 3 * index) as f64).fract()
}

/// A peg and a cap go onto a stand, one after the other. A person moves the bin after the first.
fn with_bin(bins: bool) -> Recording {
    numbered((0..6).map(|d| {
        let bin = |k: usize| bins.then(|| object("bin_0", [drawn(d, k), drawn(d, k + 1), 0.05]));
        let found = |k: usize| [0.2 + 0.3 * drawn(d, k), -0.4 + 0.3 * drawn(d, k + 1), 0.01];
        let (peg, cap) = (object("peg_0", found(0)), object("cap_0", found(2)));
        let (stands, lies) = (object("peg_0", [0.5, 0.4, 0.05]), object("cap_0", [0.5, 0.4, 0.09]));
        let with = |bin: Option<ObjectPose>, objects: [&ObjectPose; 2]| -> Vec<ObjectPose> {
            bin.into_iter().chain(objects.into_iter().cloned()).collect()
        };
        vec![
            snapshot(Event::Start, None, with(bin(4), [&peg, &cap])),
            snapshot(Event::Contact, Some("peg_0"), with(bin(4), [&peg, &cap])),
            snapshot(Event::Release, Some("peg_0"), with(bin(4), [&stands, &cap])),
            snapshot(Event::Contact, Some("cap_0"), with(bin(6), [&stands, &cap])),
            snapshot(Event::Release, Some("cap_0"), with(bin(6), [&stands, &lies])),
            snapshot(Event::End, None, with(bin(8), [&stands, &lies])),
        ]
    }))
}

#[test]
fn a_bin_that_a_person_moves_is_no_state_and_no_goal() {
    let (plain, moved) = (learned(&with_bin(false)), learned(&with_bin(true)));
    assert_eq!(moved.domain.states, plain.domain.states);
    assert_eq!(moved.domain.goals, plain.domain.goals);
    assert!(!plain.domain.goals.is_empty());
    let remark = Remark::MovedByOthers { kind: "bin".into() };
    assert!(moved.remarks.contains(&remark) && !plain.remarks.contains(&remark));
    // What a weight on a button lifts is part of the task, although nobody handles it.
    let gate = learned(&named("gate").expect("a world").record(5, Seed::new(90310)));
    assert!(gate.domain.states.iter().any(|state| state.kind == "gate"));
}

/// A tray with a cup on it goes to a shelf. Nobody says what was handled.
fn tray(named: bool) -> Recording {
    numbered((0..5).map(|d| {
        let [x, y] = [0.1 + 0.4 * drawn(d, 0), -0.4 + 0.5 * drawn(d, 1)];
        let [dx, dy] = [0.02, -0.01].map(|v| v * (1.0 + drawn(d, 2)));
        let at = |[x, y, z]: [f64; 3]| {
            vec![object("cup_0", [x + dx, y + dy, z + 0.06]), object("tray_0", [x, y, z])]
        };
        let touched = named.then_some("tray_0");
        vec![
            snapshot(Event::Start, None, at([x, y, 0.01])),
            snapshot(Event::Contact, touched, at([x, y, 0.01])),
            snapshot(Event::Release, touched, at([0.6, 0.3, 0.01])),
            snapshot(Event::End, None, at([0.6, 0.3, 0.01])),
        ]
    }))
}

#[test]
fn what_rides_on_a_tray_is_not_what_was_carried() {
    let (named, unnamed) = (learned(&tray(true)), learned(&tray(false)));
    assert_eq!(unnamed.domain.operators, named.domain.operators);
    assert_eq!(unnamed.domain.states, named.domain.states);
    let carried = |learned: &Learned| -> Vec<String> {
        let own = learned.domain.operators.iter();
        own.map(|o| learned.domain.states[o.to].kind.clone()).collect()
    };
    assert_eq!(carried(&unnamed), ["tray"]);
}

/// A block or a disc goes onto its pad, in turn.
#[test]
fn no_goal_is_said_with_its_reason() {
    let recording = numbered((0..6).map(|d| {
        let found = |k: usize| [0.2 + 0.3 * drawn(d, k), -0.4 + 0.2 * drawn(d, k + 1), 0.01];
        let (block, disc) = (object("block_0", found(0)), object("disc_0", found(2)));
        let (id, put) = match d % 2 {
            0 => ("block_0", [object("block_0", [0.2, 0.3, 0.05]), disc.clone()]),
            _ => ("disc_0", [block.clone(), object("disc_0", [0.6, 0.3, 0.09])]),
        };
        vec![
            snapshot(Event::Start, None, vec![block.clone(), disc.clone()]),
            snapshot(Event::Contact, Some(id), vec![block, disc]),
            snapshot(Event::Release, Some(id), put.to_vec()),
            snapshot(Event::End, None, put.to_vec()),
        ]
    }));
    let learned = learned(&recording);
    assert_eq!(learned.domain.goals, []);
    let reason = learned.remarks.iter().find_map(|remark| match remark {
        Remark::NoGoal(NoGoal::EndsDiffer { ends, of }) => Some((ends.clone(), *of)),
        _ => None,
    });
    let (ends, of) = reason.expect("a reason");
    let held: Vec<usize> = ends.iter().map(|(_, held)| *held).collect();
    assert_eq!((held, of), (vec![3, 3], 6), "{ends:?}");
    let said = learned.remarks.last().map(ToString::to_string).unwrap_or_default();
    assert!(learned.remarks.iter().any(|r| r.to_string().contains("end differently")), "{said}");
}
