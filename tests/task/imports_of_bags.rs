//! Logs of ROS 2 in MCAP: the same recording as from a table, frames that hang on one another, and what is refused.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use symbolt::task::Recording;
use symbolt::task::import::{Imported, Mapping, Streams};

use crate::bags::{
    Cdr, Message, Numbers, Packing, bag, bag_in, detections, joints, pose_stamped, transforms,
};
use crate::imports::{import, import_by, recording, text};
use crate::streams::{Sampling, Shown, log};

fn refused(mapping: &str, bytes: &[u8]) -> String {
    import(mapping, &[("a.mcap", bytes)]).expect_err("it is refused").to_string()
}

/// A row of a table: time in nanoseconds, id, pose, width.
#[derive(Clone)]
struct Row {
    t: u64,
    text: String,
    id: String,
    pose: Numbers,
    width: Option<f64>,
}

/// The rows of a demonstration, as its table has them.
fn rows(seed: u64, shown: Shown, rate_hz: f64) -> Vec<Row> {
    let sampling = Sampling { rate_hz, noise_m: 1e-3, noise_deg: 1.0, lost: 0.02, shown };
    let (text, _) = log(&recording(1, seed), &sampling, seed);
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |at: usize| cells[at].parse::<f64>().expect("a number");
        Row {
            t: (number(1) * 1e9).round() as u64,
            text: cells[1..11].join(","),
            id: cells[2].to_owned(),
            pose: [3, 4, 5, 6, 7, 8, 9].map(number),
            width: cells[10].parse().ok(),
        }
    };
    text.lines()
        .skip(1)
        .filter(|line| {
            !line.contains(",-0.") || line.split(',').nth(1).is_some_and(|t| !t.starts_with('-'))
        })
        .map(row)
        .collect()
}

fn table(rows: &[Row]) -> String {
    let lines = rows.iter().map(|row| row.text.clone() + "\n");
    "time,id,x,y,z,qx,qy,qz,qw,width\n".to_owned() + &lines.collect::<String>()
}

fn by_time(rows: &[Row]) -> Vec<&[Row]> {
    rows.chunk_by(|a, b| a.t == b.t).collect()
}

const TF: (&str, &str) = ("/tf", "tf2_msgs/msg/TFMessage");

fn message(topic: &str, kind: &'static str, t: u64, data: Vec<u8>) -> Message {
    // The log is a little later than the stamps.
    (topic.to_owned(), kind, t + 3_000_000, data)
}

/// The rows as transforms alone.
fn as_transforms(rows: &[Row]) -> Vec<Message> {
    let group = |group: &&[Row]| {
        let edges: Vec<_> = group.iter().map(|row| ("world", &*row.id, row.pose)).collect();
        message(TF.0, TF.1, group[0].t, transforms(group[0].t, &edges))
    };
    by_time(rows).iter().map(group).collect()
}

/// The rows as detections of objects, and poses of the hand.
fn as_detections(rows: &[Row]) -> Vec<Message> {
    let group = |group: &&[Row]| {
        let t = group[0].t;
        let (hand, objects): (Vec<&Row>, Vec<&Row>) =
            group.iter().partition(|row| row.id == "hand");
        let all: Vec<_> = objects
            .iter()
            .map(|row| {
                (
                    &*row.id,
                    row.id.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('_'),
                    row.pose,
                )
            })
            .collect();
        let seen = (!all.is_empty()).then(|| {
            message(
                "/objects/detections",
                "vision_msgs/msg/Detection3DArray",
                t,
                detections(t, "world", &all),
            )
        });
        let hand = hand.into_iter().map(move |row| {
            message(
                "/robot/hand/pose",
                "geometry_msgs/msg/PoseStamped",
                t,
                pose_stamped(t, "world", &row.pose),
            )
        });
        seen.into_iter().chain(hand).collect::<Vec<_>>()
    };
    by_time(rows).iter().flat_map(group).collect()
}

/// The rows as a topic for each object, with the joints of a gripper.
fn as_poses(rows: &[Row]) -> Vec<Message> {
    let one = |row: &Row| {
        let pose = pose_stamped(row.t, "world", &row.pose);
        let own =
            message(&format!("/{}/pose", row.id), "geometry_msgs/msg/PoseStamped", row.t, pose);
        let joint = row.width.map(|width| {
            let all = [
                ("arm_joint1", 0.7),
                ("finger_joint1", width / 2.0),
                ("finger_joint2", width / 2.0),
            ];
            message("/joint_states", "sensor_msgs/msg/JointState", row.t, joints(row.t, &all))
        });
        [Some(own), joint].into_iter().flatten().collect::<Vec<_>>()
    };
    rows.iter().flat_map(one).collect()
}

#[test]
fn a_bag_gives_the_same_recording_as_a_table() {
    let packings = [Packing::Zstd, Packing::Lz4, Packing::Chunks, Packing::Plain];
    for (seed, packing) in packings.into_iter().enumerate() {
        let held = rows(seed as u64, Shown::Hand, 40.0);
        // Objects at 20 Hz, the hand at each time.
        let times: Vec<u64> = by_time(&held).iter().map(|group| group[0].t).collect();
        let even = |t: u64| times.iter().position(|own| *own == t).is_some_and(|at| at % 2 == 0);
        let sparse: Vec<Row> =
            held.iter().filter(|row| row.id == "hand" || even(row.t)).cloned().collect();
        let wide = rows(seed as u64 + 10, Shown::Width, 30.0);
        type Write = fn(&[Row]) -> Vec<Message>;
        let cases: [(&str, &[Row], Write); 3] = [
            ("transforms", &held, as_transforms),
            ("detections", &sparse, as_detections),
            ("poses", &wide, as_poses),
        ];
        for (name, rows, write) in cases {
            let by_table = import("", &[("a.csv", table(rows).as_bytes())]).expect("imported");
            let bytes = bag(packing, &write(rows));
            let by_bag = import("", &[("a.mcap", &bytes)]).expect("imported");
            assert_eq!(by_table.moments.len(), by_bag.moments.len(), "{name} {packing:?}");
            assert!(by_bag.moments.len() >= 4, "{name}: {:?}", by_bag.moments);
            assert_eq!(text(&by_table), text(&by_bag), "{name} {packing:?}");
            // What was guessed reads the same when it is said.
            let mapping = by_bag.mapping.to_json().expect("a mapping");
            let mapping = Mapping::parse(mapping.as_bytes(), "m.json").expect("a mapping");
            assert!(!mapping.topics.is_empty(), "{mapping:?}");
            let again = import_by(mapping.clone(), &[("a.mcap", &bytes)]).expect("imported");
            assert_eq!((text(&again), again.mapping), (text(&by_bag), mapping), "{name}");
        }
    }
}

#[test]
fn ids_do_not_depend_on_which_of_two_topics_comes_first() {
    let pose = |topic: &str, tick: u64, x: f64| {
        let t = 1_000_000_000 + tick * 50_000_000;
        let pose = pose_stamped(t, "world", &[x, 0.1, 0.2, 0.0, 0.0, 0.0, 1.0]);
        message(topic, "geometry_msgs/msg/PoseStamped", t, pose)
    };
    let log = |order: [(&str, f64); 2]| {
        let messages = (0..100).flat_map(|tick| order.map(|(topic, x)| pose(topic, tick, x)));
        bag(Packing::Plain, &messages.collect::<Vec<_>>())
    };
    let topics = [("/left/cup/pose", 0.3), ("/right/cup/pose", 0.6)];
    for order in [topics, [topics[1], topics[0]]] {
        let found = import("", &[("a.mcap", &log(order))]).expect("imported");
        let tracks = found.sessions[0].parts[0].tracks.iter();
        let own: BTreeMap<&str, f64> =
            tracks.map(|track| (&*track.id, track.samples[0].position[0])).collect();
        assert_eq!(own, BTreeMap::from([("left/cup", 0.3), ("right/cup", 0.6)]));
        let again = import_by(found.mapping.clone(), &[("a.mcap", &log(order))]);
        assert_eq!(text(&again.expect("imported")), text(&found));
    }
}

#[test]
fn a_bag_with_another_pose_gives_another_recording() {
    let rows = rows(1, Shown::Hand, 30.0);
    let mut other = rows.clone();
    other.iter_mut().filter(|row| row.id != "hand").for_each(|row| row.pose[0] += 0.01);
    let own =
        import("", &[("a.mcap", &bag(Packing::Plain, &as_transforms(&rows)))]).expect("imported");
    let other =
        import("", &[("a.mcap", &bag(Packing::Plain, &as_transforms(&other)))]).expect("imported");
    assert_ne!(text(&own), text(&other));
}

#[test]
fn a_bag_and_a_table_in_other_units_are_one_session() {
    // The hand in the bag, in metres; the objects in the table, in millimetres that nobody names.
    let rows = rows(1, Shown::Hand, 30.0);
    let (hand, objects): (Vec<Row>, Vec<Row>) = rows.into_iter().partition(|row| row.id == "hand");
    let whole: Vec<Row> = hand.iter().chain(&objects).cloned().collect();
    let table: String = objects
        .iter()
        .map(|row| {
            let [x, y, z, rest @ ..] = row.pose;
            let rest = rest.map(|v| v.to_string()).join(",");
            let [x, y, z] = [x, y, z].map(|v| v * 1e3);
            format!("{},{},{x},{y},{z},{rest}\n", row.t as f64 / 1e9, row.id)
        })
        .collect();
    let table = "time,id,x,y,z,qx,qy,qz,qw\n".to_owned() + &table;
    let bytes = bag(Packing::Plain, &as_poses(&hand));
    let both: [(&str, &[u8]); 2] = [("a_robot.mcap", &bytes), ("a_objects.csv", table.as_bytes())];
    let found = import("", &both).expect("imported");
    assert_eq!((found.sessions.len(), &*found.sessions[0].name), (1, "a"));
    let alone = import("", &[("a.mcap", &bag(Packing::Plain, &as_poses(&whole)))]);
    let alone = alone.expect("imported");
    let events = |found: &Imported| -> Vec<(String, f64)> {
        found.moments.iter().map(|m| (m.object.to_string(), (m.t * 20.0).round())).collect()
    };
    assert!(!found.moments.is_empty());
    assert_eq!(events(&found), events(&alone));
    let again = import_by(found.mapping.clone(), &both).expect("imported");
    assert_eq!(text(&again), text(&found));
}

fn numbers(pose: &Isometry3<f64>) -> Numbers {
    let (at, q) = (pose.translation, pose.rotation);
    [at.x, at.y, at.z, q.i, q.j, q.k, q.w]
}

/// A cup that is carried in the world, seen by a camera on a base that drives, with an arm whose hand holds it. Returns the
/// log and the pose of the cup at each time.
fn driven() -> (Vec<Message>, BTreeMap<u64, Isometry3<f64>>) {
    let turn = |v: [f64; 3]| UnitQuaternion::from_scaled_axis(Vector3::from(v));
    let camera = Isometry3::from_parts(Translation3::new(0.1, 0.2, 1.2), turn([2.0, 0.3, -0.4]));
    let flange = Isometry3::from_parts(Translation3::new(0.0, 0.0, 0.1), turn([0.0, 0.0, 0.8]));
    let shelf = Isometry3::translation(0.9, 0.4, 0.3);
    let (mut messages, mut cups) = (Vec::new(), BTreeMap::new());
    let still = [
        ("base_link", "camera_link", numbers(&camera)),
        ("wrist_link", "panda_hand", numbers(&flange)),
        ("world", "shelf_1", numbers(&shelf)),
        ("panda_hand", "panda_leftfinger", numbers(&Isometry3::translation(0.0, 0.04, 0.0))),
    ];
    messages.push(message("/tf_static", TF.1, 1_000, transforms(0, &still)));
    for tick in 0..250u64 {
        let t = 1_000_000_000 + tick * 40_000_000;
        let s = tick as f64 * 0.04;
        let base = Isometry3::from_parts(
            Translation3::new(0.02 * s, -0.01 * s, 0.0),
            turn([0.0, 0.0, 0.05 * s]),
        );
        let u = ((s - 4.0) / 2.0).clamp(0.0, 1.0);
        let away = (4.0 - s).max(s - 6.3).max(0.0) * 0.05;
        let cup = Isometry3::from_parts(
            Translation3::new(0.5 + 0.3 * u, 0.1, 0.02 + 0.1 * u),
            turn([0.0, 0.0, 0.6]),
        );
        let hand = Isometry3::translation(0.5 + 0.3 * u, 0.1, 0.1 + 0.1 * u + away);
        let wrist = base.inverse() * hand * flange.inverse();
        let edges =
            [("world", "base_link", numbers(&base)), ("base_link", "wrist_link", numbers(&wrist))];
        messages.push(message(TF.0, TF.1, t, transforms(t, &edges)));
        let seen = (base * camera).inverse() * cup;
        let all = [("", "cup", numbers(&seen))];
        let kind = "vision_msgs/msg/Detection3DArray";
        messages.push(message("/detections", kind, t, detections(t, "camera_link", &all)));
        messages.push(message(
            "/camera/image",
            "sensor_msgs/msg/Image",
            t,
            Cdr::new().header(t, "camera_link").count(0).bytes(),
        ));
        cups.insert(t, cup);
    }
    (messages, cups)
}

#[test]
fn detections_of_a_camera_that_moves_are_in_the_frame_of_the_world() {
    let (messages, cups) = driven();
    let bytes = bag(Packing::Zstd, &messages);
    let mut streams = Streams::new(Mapping::unknown());
    streams.add("a.mcap", &bytes).expect("added");
    let found = streams.finish().expect("finished");
    let part = &found.sessions[0].parts[0];
    let ids: Vec<&str> = part.tracks.iter().map(|track| &*track.id).collect();
    assert_eq!(ids, ["cup_0", "shelf_1"], "{:?}", found.unused);
    assert_eq!(part.hand.as_ref().map(|hand| &*hand.id), Some("panda_hand"));
    let cup = &part.tracks[0];
    assert_eq!((&*cup.kind, cup.samples.len()), ("cup", cups.len()));
    for (sample, (t, truth)) in cup.samples.iter().zip(&cups) {
        assert_eq!(sample.t, *t as f64 / 1e9);
        let own = Isometry3::from_parts(
            Translation3::from(Vector3::from(sample.position)),
            UnitQuaternion::from_quaternion(Quaternion::from(sample.orientation)),
        );
        let off = truth.inverse() * own;
        assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-6, "{off}");
    }
    let said = |what: &str, value: &str| {
        found.guesses.iter().any(|g| g.what == what && g.value == value && !g.reason.is_empty())
    };
    assert!(said("id", "the class and the place in a message"), "{:?}", found.guesses);
    assert!(said("reference", "world") && said("length", "m"), "{:?}", found.guesses);
    let unused = found.unused[0].1.join("; ");
    for name in ["/camera/image (sensor_msgs/msg/Image)", "panda_leftfinger", "base_link"] {
        assert!(unused.contains(name), "{name}: {unused}");
    }
    let moments = found.import().moments;
    let carried: Vec<(&str, f64)> =
        moments.iter().map(|m| (&*m.object, (m.t - 1.0).round())).collect();
    assert_eq!(carried, [("cup_0", 4.0), ("cup_0", 6.0)]);
    // The same in another frame: the cup moves with the base the other way.
    let mapping = r#", "reference": "base_link""#;
    let text = format!(r#"{{"format": "symbolt-import", "version": 1{mapping}}}"#);
    let mut streams = Streams::new(Mapping::parse(text.as_bytes(), "m.json").expect("a mapping"));
    streams.add("a.mcap", &bytes).expect("added");
    let found = streams.finish().expect("finished");
    let shelf =
        found.sessions[0].parts[0].tracks.iter().find(|t| &*t.id == "shelf_1").expect("a shelf");
    let (first, last) = (shelf.samples[0], shelf.samples[shelf.samples.len() - 1]);
    let base = Isometry3::from_parts(
        Translation3::new(0.02 * 9.96, -0.01 * 9.96, 0.0),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.05 * 9.96)),
    );
    let truth = (base.inverse() * Isometry3::translation(0.9, 0.4, 0.3)).translation.vector;
    assert!((Vector3::from(last.position) - truth).norm() < 1e-9, "{last:?}");
    assert!((first.position[1] - last.position[1]).abs() > 0.1, "{first:?}");
    assert_eq!(shelf.samples.len(), cups.len());
    assert!(
        refused(r#", "reference": "moon""#, &bytes)
            .contains("no such frame is in the log; expected one of: ")
    );
}

#[test]
fn the_mapping_says_which_topics_are_taken_and_what_they_are() {
    let rows = rows(2, Shown::Width, 30.0);
    let mut messages = as_poses(&rows);
    let noise = as_transforms(&rows);
    messages.extend(noise);
    for (index, row) in rows.iter().enumerate().step_by(5) {
        let shut = Cdr::new().flag(index % 2 == 0).bytes();
        messages.push(message("/gripper/is_open", "std_msgs/msg/Bool", row.t, shut));
    }
    let bytes = bag(Packing::Lz4, &messages);
    let id = rows[0].id.clone();
    let mapping = format!(
        r#", "topics": [{{"topic": "/{id}/pose", "take": "poses", "object": "thing_7"}},
        {{"topic": "/joint_states", "take": "width", "joints": ["finger_joint*"]}}]"#
    );
    let found = import(&mapping, &[("a.mcap", &bytes)]).expect("imported");
    let ids: Vec<&str> = found.seen.iter().map(|seen| &*seen.id).collect();
    assert_eq!(ids, ["thing_7"]);
    assert!(found.unused[0].1.iter().any(|name| name.starts_with("/tf ")), "{:?}", found.unused);
    // Without it, an object is taken from one topic, and a flag that is open is turned round.
    let found = import("", &[("a.mcap", &bytes)]).expect("imported");
    assert!(
        found.dropped.iter().any(|d| d.what.contains("which another topic gives")),
        "{:?}",
        found.dropped
    );
    assert!(
        found
            .mapping
            .topics
            .iter()
            .any(|t| t.topic == "/gripper/is_open" && t.invert == Some(true))
    );
    for (mapping, expected) in [
        (
            r#", "topics": [{"topic": "/nothing"}]"#,
            "field `/nothing`: there is no such topic; expected one of: ",
        ),
        (
            r#", "topics": [{"topic": "/tf", "take": "width"}]"#,
            "field `/tf`: its type is `tf2_msgs/msg/TFMessage`; expected a number",
        ),
        (r#", "topics": [{"topic": ""}]"#, "map.json, field `topics[0].topic`: it is empty"),
    ] {
        let problem = refused(mapping, &bytes);
        assert!(problem.contains(expected), "{problem}");
    }
}

#[test]
fn a_topic_without_stamps_is_put_on_the_clock_of_the_others() {
    // The stamps are those of a simulation; the log has the time of day.
    let rows = rows(3, Shown::Width, 30.0);
    let day = 1_700_000_000_000_000_000;
    let (mut stamped, mut plain) = (as_poses(&rows), Vec::new());
    stamped.retain(|m| m.0 != "/joint_states");
    stamped.iter_mut().for_each(|m| m.2 += day);
    for row in &rows {
        let width = Cdr::new().float(row.width.expect("a width") as f32).bytes();
        plain.push((
            "/gripper/width".to_owned(),
            "std_msgs/msg/Float32",
            row.t + day + 3_000_000,
            width,
        ));
    }
    let by_table = import("", &[("a.csv", table(&rows).as_bytes())]).expect("imported");
    let bytes = bag(Packing::Zstd, &[stamped, plain].concat());
    let found = import("", &[("a.mcap", &bytes)]).expect("imported");
    assert!(found.guesses.iter().any(|g| g.what == "clock"), "{:?}", found.guesses);
    assert!(by_table.moments.len() >= 4);
    let times =
        |found: &Imported| found.moments.iter().map(|m| (m.t * 20.0).round()).collect::<Vec<_>>();
    assert_eq!(times(&found), times(&by_table));
}

/// Poses of a cup and a shelf at 20 Hz, stamped from `start` on and logged in 2023.
fn stamped_from(start: u64, ticks: u64) -> Vec<Message> {
    let pose = |topic: &str, x: f64, t: u64| -> Message {
        let data = pose_stamped(t, "world", &[x, 0.1, 0.05, 0.0, 0.0, 0.0, 1.0]);
        let at = 1_700_000_000_000_000_000 + t % 1_000_000_000_000;
        (topic.to_owned(), "geometry_msgs/msg/PoseStamped", at, data)
    };
    (0..ticks)
        .flat_map(|tick| {
            let t = start + tick * 50_000_000;
            let u = ((tick as f64 * 0.05 - 4.0) / 2.0).clamp(0.0, 1.0);
            [pose("/cup_1/pose", 0.5 + 0.3 * u, t), pose("/shelf/pose", 0.9, t)]
        })
        .collect()
}

fn span(bytes: &[u8]) -> (f64, f64) {
    let found = import("", &[("a.mcap", bytes)]).expect("imported");
    let tracks = found.sessions.iter().flat_map(|s| &s.parts).flat_map(|p| &p.tracks);
    let times = tracks.flat_map(|track| track.samples.iter().map(|sample| sample.t));
    times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)))
}

#[test]
fn a_stamp_of_zero_is_a_time_where_the_clock_begins_with_the_log() {
    let (first, last) = span(&bag(Packing::Plain, &stamped_from(0, 200)));
    assert!(last - first < 10.0, "{first} {last}");
    // Elsewhere it is none.
    let day = 1_700_000_000_000_000_000;
    let mut messages = stamped_from(day, 200);
    let data = pose_stamped(0, "world", &[0.9, 0.1, 0.05, 0.0, 0.0, 0.0, 1.0]);
    messages[1].3 = data;
    let (first, last) = span(&bag(Packing::Plain, &messages));
    assert!(last - first < 10.0, "{first} {last}");
}

#[test]
fn a_clock_that_starts_again_in_a_bag_is_refused() {
    let (first, again) = (stamped_from(100_000_000, 200), stamped_from(103_100_000, 200));
    let problem = refused("", &bag(Packing::Plain, &[&first[..], &again].concat()));
    assert_eq!(
        problem,
        "a.mcap, field `/cup_1/pose`: message 205 is stamped 0.303 s after one of 10.050 s: the clock starts again; expected the log of one run, cut where its clock starts again"
    );
    // Messages that are late are none.
    let late = [&first[..], &again[..8], &stamped_from(10_100_000_000, 20)].concat();
    assert!(import("", &[("a.mcap", &bag(Packing::Plain, &late))]).is_ok());
}

#[test]
fn a_number_named_a_width_is_taken_before_others_of_the_gripper() {
    let mut messages = stamped_from(0, 200);
    for (at, t) in (0..200u64).map(|tick| tick * 50_000_000).enumerate() {
        for (topic, value) in [("/gripper/temperature", 30.0), ("/gripper/width", 0.08)] {
            let data = Cdr::new().float(value - 1e-5 * at as f32).bytes();
            messages.push((topic.to_owned(), "std_msgs/msg/Float32", t, data));
        }
    }
    let found = import("", &[("a.mcap", &bag(Packing::Plain, &messages))]).expect("imported");
    let expected = "/gripper/temperature (std_msgs/msg/Float32): /gripper/width is taken instead";
    assert_eq!(found.unused[0].1, [expected]);
    let twice = r#", "topics": [{"topic": "/tf", "objects": ["a"]}, {"topic": "/tf"}]"#;
    assert_eq!(
        refused(twice, &[]),
        "map.json, field `topics[1].topic`: it is `/tf`, as in topics[0]; expected each topic once, with all its `objects`"
    );
}

#[test]
fn transforms_that_contradict_one_another_are_told() {
    let at = |x: f64| [x, 0.1, 0.2, 0.0, 0.0, 0.0, 1.0];
    let fixed = ("/tf_static", TF.1);
    let mut messages = Vec::new();
    for tick in 0..100u64 {
        let t = 100_000_000 + tick * 50_000_000;
        let mut edges = vec![("world", "cup_1", at(0.5)), ("world", "shelf", at(0.9))];
        edges.push(("world", "shelf", at(0.9)));
        if tick % 10 == 0 {
            edges.push(("world", "cup_1", at(0.6)));
        }
        if tick > 90 {
            edges.push(("table", "box_1", at(0.1)));
        } else {
            edges.push(("world", "box_1", at(1.1)));
        }
        messages.push(message(TF.0, TF.1, t, transforms(t, &edges)));
        if tick % 50 == 0 {
            let edges = [("world", "table", at(1.0 + tick as f64 / 100.0))];
            messages.push(message(fixed.0, fixed.1, t, transforms(t, &edges)));
        }
    }
    let found = import("", &[("a.mcap", &bag(Packing::Plain, &messages))]).expect("imported");
    let left: Vec<(&str, u64)> = found.dropped.iter().map(|d| (&*d.what, d.count)).collect();
    let expected = [
        ("transform of cup_1, which another of the same time replaces", 10),
        ("transform of table, which a later fixed one replaces at all times", 1),
    ];
    assert_eq!(left, expected);
    let parents: Vec<(&str, &str)> = (found.guesses.iter())
        .filter(|guess| guess.what.starts_with("parent"))
        .map(|guess| (&*guess.what, &*guess.value))
        .collect();
    assert_eq!(parents, [("parent of box_1", "world, table")]);
}

#[test]
fn messages_in_json_are_read() {
    let mut messages = Vec::new();
    for tick in 0..200u64 {
        let t = tick * 50_000_000;
        let u = ((tick as f64 * 0.05 - 4.0) / 2.0).clamp(0.0, 1.0);
        for (topic, x, z) in [("/cup_1", 0.5 + 0.3 * u, 0.02 + 0.1 * u), ("/shelf", 0.9, 0.3)] {
            let data = format!(
                r#"{{"timestamp":{{"sec":{},"nsec":{}}},"frame_id":"map","pose":{{"position":{{"x":{x},"y":0.1,"z":{z}}},"orientation":{{"x":0,"y":0,"z":0,"w":1}}}}}}"#,
                t / 1_000_000_000,
                t % 1_000_000_000
            );
            messages.push((topic.to_owned(), "foxglove.PoseInFrame", t, data.into_bytes()));
        }
    }
    let bytes = bag_in("jsonschema", "json", Packing::Zstd, &messages);
    let found = import("", &[("a.mcap", &bytes)]).expect("imported");
    let moments: Vec<(&str, f64)> =
        found.moments.iter().map(|m| (&*m.object, m.t.round())).collect();
    assert_eq!(moments, [("cup_1", 4.0), ("cup_1", 6.0)]);
    messages[100].3.truncate(30);
    let bytes = bag_in("jsonschema", "json", Packing::Zstd, &messages);
    assert!(
        refused("", &bytes).starts_with("a.mcap, field `/cup_1`: message 51 is no JSON"),
        "{}",
        refused("", &bytes)
    );
}

#[test]
fn faults_of_a_bag_name_the_topic_and_the_message() {
    let rows = rows(4, Shown::Hand, 20.0);
    let good = as_transforms(&rows);
    let cut = |bytes: &[u8], end: usize| refused("", &bytes[..end]);
    let bytes = bag(Packing::Zstd, &good);
    for end in [9, 100, bytes.len() / 2] {
        let problem = cut(&bytes, end);
        assert!(problem.starts_with("a.mcap: ") && problem.contains("mcap recover"), "{problem}");
    }
    let mut short = good.clone();
    short[2].3.truncate(60);
    let problem = refused("", &bag(Packing::Chunks, &short));
    assert!(
        problem.starts_with("a.mcap, field `/tf`: message 3 ends in `transforms[0]."),
        "{problem}"
    );
    let mut long = good.clone();
    long[0].3 = transforms(long[0].2, &[("world", "nut_1", [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0])]);
    let problem = refused("", &bag(Packing::Chunks, &long));
    assert!(
        problem.contains(
            "message 1 gives `nut_1` an orientation, and the quaternion has the norm 1.414"
        ),
        "{problem}"
    );
    let idl = bag_in("ros2idl", "cdr", Packing::Plain, &good);
    let problem = refused("", &idl);
    assert!(problem.contains("field `/tf`: its messages are written as `cdr` with a schema in `ros2idl`; expected cdr with ros2msg"), "{problem}");
    let protobuf = bag_in("protobuf", "protobuf", Packing::Plain, &good);
    assert!(refused("", &protobuf).contains("`protobuf`"));
    let image = Cdr::new().header(1, "").count(0).bytes();
    let images = bag(Packing::Zstd, &[message("/image", "sensor_msgs/msg/Image", 1, image)]);
    assert!(
        refused("", &images).contains("no topic is taken among /image (sensor_msgs/msg/Image)")
    );
    // Two frames that nothing connects.
    let pose = [0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0];
    let two = ["map", "camera"].map(|frame| {
        message(
            &format!("/{frame}/pose"),
            "geometry_msgs/msg/PoseStamped",
            5,
            pose_stamped(5, frame, &pose),
        )
    });
    assert!(
        refused("", &bag(Packing::Plain, &two))
            .contains("in the frames map and camera, which no transform connects")
    );
    // Two channels of one number, which stands before the topic.
    let mut twice = bag(Packing::Plain, &two);
    let number =
        |name: &[u8]| twice.windows(name.len()).position(|own| own == name).map(|at| at - 8);
    let [one, other] = [&b"/map/pose"[..], b"/camera/pose"].map(|n| number(n).expect("a channel"));
    twice.copy_within(one..one + 2, other);
    let problem = refused("", &twice);
    assert!(problem.contains("field `/camera/pose`: two channels have the number"), "{problem}");
    let both = [two.to_vec(), good.clone()].concat();
    assert!(
        refused("", &bag(Packing::Plain, &both)).contains("which no transform connects to `world`")
    );
    for (start, what) in
        [("#ROSBAG V2.0\n", "a bag of ROS 1"), ("SQLite format 3\0", "a bag in SQLite")]
    {
        assert!(refused("", start.as_bytes()).contains(what));
    }
    // A chunk whose bytes were changed.
    let mut changed = bag(Packing::Chunks, &good);
    let middle = changed.len() / 3;
    changed[middle] ^= 0x55;
    assert!(!refused("", &changed).is_empty());
}

#[test]
fn no_bytes_in_a_bag_make_the_import_panic_or_wait() {
    let rows = rows(5, Shown::Width, 20.0);
    let few: Vec<Row> = rows[..60].to_vec();
    let mut messages = as_poses(&few);
    messages.extend(as_transforms(&few));
    messages.extend(as_detections(&few));
    let packings = [Packing::Zstd, Packing::Lz4, Packing::Chunks, Packing::Plain];
    let bags = packings.map(|packing| bag(packing, &messages));
    for bytes in &bags {
        import("", &[("a.mcap", bytes)]).expect("a good one is imported");
    }
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let (mut taken, mut slowest) = (0, Duration::ZERO);
    for case in 0..2_000 {
        // Most changes in the two bags whose bytes reach the decoder.
        let mut bytes = bags[[0, 1, 2, 3, 3, 3, 2, 3][case % 8]].clone();
        for _ in 0..random.random_range(1..6) {
            let at = random.random_range(0..bytes.len());
            match random.random_range(0..4) {
                0 => bytes[at] = 0xff,
                1 => bytes[at] = 0,
                _ => bytes[at] = random.random(),
            }
        }
        if random.random_range(0..20) == 0 {
            bytes.truncate(random.random_range(0..bytes.len()));
        }
        let began = Instant::now();
        if let Ok(found) = import("", &[("a.mcap", &bytes)]) {
            taken += 1;
            let text = text(&found);
            if found.recording.snapshot_count() > 0 {
                assert!(Recording::parse(text.as_bytes(), "a.jsonl").is_ok());
            }
        }
        slowest = slowest.max(began.elapsed());
    }
    assert!((50..1_950).contains(&taken), "{taken} were taken");
    assert!(slowest < Duration::from_secs(2), "{slowest:?}");
}

#[test]
#[ignore = "long statistics"]
fn a_million_poses_are_read_in_ten_seconds() {
    // Ten objects at 100 Hz for a thousand seconds, as transforms.
    let names: Vec<String> = (0..10).map(|number| format!("part_{number}")).collect();
    let mut messages = Vec::new();
    for tick in 0..100_000u64 {
        let t = tick * 10_000_000;
        let u = (tick as f64 * 1e-3).sin() * 1e-4;
        let edges: Vec<_> = names
            .iter()
            .enumerate()
            .map(|(at, name)| {
                ("world", name.as_str(), [0.1 * at as f64 + u, u, 0.0, 0.0, 0.0, 0.0, 1.0])
            })
            .collect();
        messages.push(message(TF.0, TF.1, t, transforms(t, &edges)));
    }
    let began = Instant::now();
    let bytes = bag(Packing::Zstd, &messages);
    let packed = began.elapsed();
    drop(messages);
    let began = Instant::now();
    let mut streams = Streams::new(Mapping::unknown());
    streams.add("a.mcap", &bytes).expect("added");
    let read = began.elapsed();
    let found = streams.finish().expect("finished");
    assert_eq!(found.rows, 1_000_000);
    let memory = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = memory.lines().find(|line| line.starts_with("VmHWM")).unwrap_or_default().to_owned();
    println!("{} bytes packed in {packed:?} and read in {read:?}, {peak}", bytes.len());
    // Beside other programs both take longer. A reader slower than linear takes minutes.
    assert!(read < Duration::from_secs(10) + 20 * packed, "{read:?} {packed:?}");
}
