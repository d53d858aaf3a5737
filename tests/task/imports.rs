//! Recordings from logs: events of noisy streams, what is learned from them, units and axes, and what is refused.

use proptest::prelude::*;
use symbolt::sim::Seed;
use symbolt::task::import::{Imported, Mapping, Streams};
use symbolt::task::learn::{Settings, learn};
use symbolt::task::tasks::nuts_and_bolts::{Order, SyntheticDemonstrations};
use symbolt::task::{InputFault, Recording, Sensing, SnapshotEvent};

use crate::streams::{Sampling, Shown, Truth, log};

/// Demonstrations of the nuts and bolts, as they were.
pub(crate) fn recording(demos: usize, seed: u64) -> Recording {
    recording_of(2, demos, seed)
}

/// The same with this many nuts and bolts.
fn recording_of(parts: usize, demos: usize, seed: u64) -> Recording {
    let demonstrations = SyntheticDemonstrations {
        demos,
        nuts: parts,
        bolts: parts,
        order: Order::Either,
        fail_rate: 0.0,
        loss_rate: 0.0,
        knock_rate: 0.0,
        events: true,
    };
    demonstrations.record(Seed::new(seed)).expect("it is recorded").recording
}

/// Imports logs as a mapping says.
pub(crate) fn import_by(
    mapping: Mapping,
    files: &[(&str, impl AsRef<[u8]>)],
) -> Result<Imported, InputFault> {
    let mut streams = Streams::new(mapping);
    for (name, bytes) in files {
        streams.add(name, bytes.as_ref())?;
    }
    Ok(streams.finish()?.import())
}

/// Imports logs with the keys of a mapping behind its version.
pub(crate) fn import(
    mapping: &str,
    files: &[(&str, impl AsRef<[u8]>)],
) -> Result<Imported, InputFault> {
    let text = format!(r#"{{"format": "symbolt-import", "version": 1{mapping}}}"#);
    import_by(Mapping::parse(text.as_bytes(), "map.json")?, files)
}

/// The recording as it is written.
#[cfg(any(feature = "mcap", feature = "hdf5"))]
pub(crate) fn text(found: &Imported) -> String {
    found.recording.to_jsonl(None).expect("it is written")
}

/// Counts the events that are found within 0.1 s, those that are not, and those that are found and are not there.
fn score(found: &Imported, truth: &[Truth]) -> [usize; 3] {
    let mut left: Vec<_> =
        (found.moments.iter()).map(|m| (m.session, m.event, m.object.to_string(), m.t)).collect();
    let mut hits = 0;
    for (demo, event, id, t) in truth {
        let same = |m: &(usize, SnapshotEvent, String, f64)| {
            (m.0, m.1, &m.2) == (*demo, *event, id) && (m.3 - t).abs() <= 0.1
        };
        if let Some(at) = left.iter().position(same) {
            left.remove(at);
            hits += 1;
        }
    }
    [hits, truth.len() - hits, left.len()]
}

#[test]
fn events_of_noisy_streams_are_found_within_a_tenth_of_a_second() {
    for shown in [Shown::Width, Shown::Flag, Shown::Hand, Shown::Nothing] {
        let mut sum = [0; 3];
        for (seed, (rate_hz, noise_m)) in
            [(20.0, 1e-3), (30.0, 3e-3), (90.0, 2e-3)].into_iter().enumerate()
        {
            let sampling = Sampling { rate_hz, noise_m, noise_deg: 1.0, lost: 0.03, shown };
            let (text, truth) = log(&recording(4, seed as u64), &sampling, seed as u64);
            assert_eq!(truth.len(), 24, "{shown:?}");
            let found = import("", &[("log.csv", &text)]).expect("it is imported");
            let own = score(&found, &truth);
            sum = [0, 1, 2].map(|i| sum[i] + own[i]);
        }
        let [hits, missed, extra] = sum;
        assert!(
            missed <= 2 && extra <= 2,
            "{shown:?}: {hits} found, {missed} missed, {extra} extra"
        );
    }
    // A wrong truth is not found.
    let sampling =
        Sampling { rate_hz: 30.0, noise_m: 1e-3, noise_deg: 1.0, lost: 0.0, shown: Shown::Flag };
    let (text, mut truth) = log(&recording(4, 1), &sampling, 1);
    truth.iter_mut().for_each(|event| event.3 += 0.2);
    let found = import("", &[("log.csv", &text)]).expect("it is imported");
    assert_eq!(score(&found, &truth)[0], 0);
}

/// The names of what is learned. Those of states say in which frames they are.
fn learned(recording: &Recording) -> [Vec<String>; 3] {
    let domain = learn(recording, &Settings::default()).expect("it is learned").domain;
    let mut states: Vec<String> = domain.states.iter().map(|s| s.name.clone()).collect();
    let mut operators: Vec<String> = domain.operators.iter().map(|o| o.name.clone()).collect();
    let mut goals: Vec<String> =
        domain.goals.iter().map(|g| domain.states[g.state].name.clone()).collect();
    for names in [&mut states, &mut operators, &mut goals] {
        names.sort();
    }
    [states, operators, goals]
}

#[test]
fn what_is_learned_from_a_stream_is_what_is_learned_from_the_recording() {
    // Which of two frames explains poses better, the learner decides by fractions of a millimetre; names follow frames.
    let learned = |recording: &Recording| {
        let domain = learn(recording, &Settings::default()).expect("it is learned").domain;
        let mut kinds: Vec<String> = domain.states.iter().map(|s| s.kind.to_string()).collect();
        kinds.sort();
        let mut moved: Vec<String> =
            domain.operators.iter().map(|o| domain.states[o.to].kind.to_string()).collect();
        moved.sort();
        (kinds, moved)
    };
    let exact = recording(4, 3);
    let sampling =
        Sampling { rate_hz: 60.0, noise_m: 1e-4, noise_deg: 0.05, lost: 0.02, shown: Shown::Width };
    let (text, _) = log(&exact, &sampling, 3);
    let found = import("", &[("log.csv", &text)]).expect("it is imported");
    assert_eq!(learned(&found.recording), learned(&exact));
}

#[test]
fn noise_does_not_decide_between_frames_that_explain_poses_alike() {
    let exact = recording_of(1, 6, 3);
    let expected = learned(&exact);
    let sensing = Sensing { pose_noise_m: 1e-3, pose_noise_deg: 1.0, ..Sensing::default() };
    let same = (0..10)
        .filter(|seed| learned(&sensing.apply_recording(&exact, Seed::new(*seed))) == expected);
    assert!(same.count() >= 9);
}

/// A cup that is carried 0.3 m along x and 0.1 m up, and a shelf, as rows of the long form: time, id, x, y, z.
fn cup(mut write: impl FnMut(f64, &str, [f64; 3]) -> String) -> String {
    let mut text = String::new();
    for tick in 0..200 {
        let t = f64::from(tick) * 0.05;
        let u = ((t - 4.0) / 2.0).clamp(0.0, 1.0);
        text += &write(t, "cup_1", [0.5 + 0.3 * u, 0.1, 0.02 + 0.1 * u]);
        text += &write(t, "shelf", [0.9, 0.4, 0.3]);
    }
    text
}

fn plain(t: f64, id: &str, [x, y, z]: [f64; 3]) -> String {
    format!("{t:.2},{id},{x:.4},{y:.4},{z:.4}\n")
}

/// The ends of the carry of the cup.
fn ends(found: &Imported) -> ([f64; 3], [f64; 3]) {
    let [one, other] = &found.moments[..] else { panic!("two events, not {:?}", found.moments) };
    assert!((one.t - 4.0).abs() < 0.1 && (other.t - 6.0).abs() < 0.1, "{one:?} {other:?}");
    (one.position, other.position)
}

fn near(found: ([f64; 3], [f64; 3]), expected: ([f64; 3], [f64; 3])) {
    let pairs = found.0.iter().chain(&found.1).zip(expected.0.iter().chain(&expected.1));
    assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-3), "{found:?} {expected:?}");
}

const CARRIED: ([f64; 3], [f64; 3]) = ([0.5, 0.1, 0.02], [0.8, 0.1, 0.12]);

#[test]
fn units_delimiters_axes_and_frames_are_applied() {
    let long = "time,id,x,y,z\n".to_owned() + &cup(plain);
    near(ends(&import("", &[("a.csv", &long)]).expect("imported")), CARRIED);
    let marked = format!("\u{feff}# a comment\n{long}");
    near(ends(&import("", &[("a.csv", &marked)]).expect("imported")), CARRIED);
    // Millimetres, milliseconds, semicolons and decimal commas.
    let comma = "time;id;x;y;z\n".to_owned()
        + &cup(|t, id, at| {
            let [x, y, z] = at.map(|v| format!("{:.2}", v * 1e3).replace('.', ","));
            format!("{:.0};{id};{x};{y};{z}\n", t * 1e3)
        });
    let found = import("", &[("a.csv", &comma)]).expect("imported");
    near(ends(&found), CARRIED);
    assert!(
        found.guesses.iter().any(|g| g.what == "length" && g.value == "mm"),
        "{:?}",
        found.guesses
    );
    // The y axis up, left-handed, in centimetres: x stays, z of the log is y.
    let turned = "time,id,x,y,z\n".to_owned()
        + &cup(|t, id, [x, y, z]| plain(t, id, [x * 100.0, z * 100.0, y * 100.0]));
    let mapping = r#", "length": "cm", "up": "y", "handed": "left""#;
    near(ends(&import(mapping, &[("a.csv", &turned)]).expect("imported")), CARRIED);
    // A camera at (1, 2, 3), turned by half a turn about z.
    let seen = "time,id,x,y,z\n".to_owned()
        + &cup(|t, id, [x, y, z]| plain(t, id, [1.0 - x, 2.0 - y, z - 3.0]));
    let mapping = r#", "frame": {"position": [1, 2, 3], "orientation": [0, 0, 1, 0]}"#;
    near(ends(&import(mapping, &[("a.csv", &seen)]).expect("imported")), CARRIED);
}

#[test]
fn a_wide_table_and_sessions_of_a_clock_that_starts_again_are_read() {
    let rows: Vec<String> = {
        let long = cup(plain);
        let lines: Vec<&str> = long.lines().collect();
        let numbers = |line: &str| line.split(',').skip(2).collect::<Vec<_>>().join(",");
        lines
            .chunks(2)
            .map(|two| {
                let t = two[0].split(',').next().unwrap_or_default();
                format!("{t},{},{}\n", numbers(two[0]), numbers(two[1]))
            })
            .collect()
    };
    let header =
        "stamp,cup_1.position.x,cup_1.position.y,cup_1.position.z,shelf.x,shelf.y,shelf.z\n";
    let wide = header.to_owned() + &rows.concat();
    near(ends(&import("", &[("a.csv", &wide)]).expect("imported")), CARRIED);
    let twice = header.to_owned() + &rows.concat() + &rows.concat();
    let found = import("", &[("a.csv", &twice)]).expect("imported");
    assert_eq!((found.recording.demos.len(), found.moments.len()), (2, 4));
    // Two rows of names, joined by a dot.
    let double = "body,cup_1,cup_1,cup_1\ntime,x,y,z\n".to_owned()
        + &rows
            .iter()
            .map(|row| row.split(',').take(4).collect::<Vec<_>>().join(",") + "\n")
            .collect::<String>();
    let mapping = r#", "tables": [{"header_rows": 2, "time": "body.time"}]"#;
    near(ends(&import(mapping, &[("a.csv", &double)]).expect("imported")), CARRIED);
}

#[test]
fn the_carried_part_is_the_one_that_moves_with_the_hand() {
    // A tray with a cup on it: both move; the hand is at the cup.
    let log = |hand: [f64; 3]| {
        let mut text = "time,id,x,y,z,qx,qy,qz,qw\n".to_owned();
        for tick in 0..200 {
            let t = f64::from(tick) * 0.05;
            let u = ((t - 4.0) / 2.0).clamp(0.0, 1.0) * 0.3;
            let away = (4.0 - t).max(t - 6.3).max(0.0) * 0.1;
            for (id, [x, y, z]) in [("tray", [0.4, 0.0, 0.0]), ("cup", [0.4, 0.1, 0.1])] {
                text += &format!("{t:.2},{id},{:.4},{y:.4},{z:.4},0,0,0,1\n", x + u);
            }
            text += &format!(
                "{t:.2},hand,{:.4},{:.4},{:.4},0,0,0,1\n",
                hand[0] + u,
                hand[1],
                hand[2] + away
            );
        }
        text
    };
    for (hand, object) in [([0.4, 0.1, 0.15], "cup"), ([0.4, -0.02, 0.02], "tray")] {
        let found = import("", &[("a.csv", &log(hand))]).expect("imported");
        let carried: Vec<&str> = found.moments.iter().map(|m| &*m.object).collect();
        assert_eq!(carried, [object, object]);
        assert_eq!(found.moments[0].with.len(), 1);
    }
}

#[test]
fn faults_name_the_file_the_line_and_the_column() {
    let good = "time,id,x,y,z\n".to_owned() + &cup(plain);
    let refused =
        |text: &str| import("", &[("a.csv", text)]).expect_err("it is refused").to_string();
    let cut = &good[..good.len() - 12];
    assert!(refused(cut).starts_with("a.csv, line 401: the row has"), "{}", refused(cut));
    // A quote without its end would take in the rows up to the next one, far behind the first rows or not.
    let mut long: Vec<String> = good.lines().map(str::to_owned).collect();
    long.extend(
        (0..2_000).map(|row| format!("{},cup_1,0.65,0.1,0.07", 10.05 + 0.05 * f64::from(row))),
    );
    for line in [2, 1_500] {
        let mut open = long.clone();
        open[line - 1] = open[line - 1].replace("cup_1", "\"cup_1");
        let problem = refused(&(open.join("\n") + "\n"));
        let expected = format!("a.csv, line {line}: a quoted cell goes on in the next line");
        assert!(problem.starts_with(&expected), "{problem}");
    }
    let word = good.replacen("0.5000", "half", 1);
    assert!(
        refused(&word).starts_with("a.csv, line 2, field `x`: it is `half`"),
        "{}",
        refused(&word)
    );
    let switched =
        good.replacen("5.00,cup_1,0.6500,0.1000,0.0700", "5.00,cup_1,650.0,100.0,70.0", 1);
    assert_ne!(switched, good);
    assert!(
        refused(&switched).contains("line 202, field `x`: the position of cup_1 is 1000 times"),
        "{}",
        refused(&switched)
    );
    assert!(refused("a,b\n1,2\n").contains("there is no column of time"));
    assert!(refused("time,b\n1,2\n").contains("no columns of a position are recognised"));
    assert!(refused("").contains("it has no rows"));
    let unit = "time,id,x,y,z\n".to_owned() + &cup(|t, id, at| plain(t, id, at.map(|v| v * 100.0)));
    assert!(
        refused(&unit).contains("tells no unit; expected --length m, mm, cm or inch"),
        "{}",
        refused(&unit)
    );
    let norm = "time,x,y,z,qx,qy,qz,qw\n0,1,1,1,1,1,0,0\n1,1,1,1,1,1,0,0\n";
    assert!(
        refused(norm).contains("line 2, field `qx`: the quaternion has the norm 1.414"),
        "{}",
        refused(norm)
    );
    let numbered: String = (0..2_001).map(|row| format!("{row},o{row},0.1,0.2,0.3\n")).collect();
    let numbered = refused(&("time,id,x,y,z\n".to_owned() + &numbered));
    assert!(numbered.contains("line 2002, field `id`: there are more than 2000 obj"), "{numbered}");
    let mixed = import(
        "",
        &[
            ("a.csv", &good),
            (
                "b.csv",
                &("time,id,x,y,z\n".to_owned()
                    + &cup(|t, id, at| plain(t, id, at.map(|v| v * 1e3)))),
            ),
        ],
    );
    let mixed = mixed.expect_err("it is refused").to_string();
    assert!(
        mixed.contains("b.csv: its greatest coordinate is 900, that of a.csv is 9.9")
            || mixed.contains("one unit in all files"),
        "{mixed}"
    );
}

#[test]
fn coordinates_that_overflow_in_a_frame_are_refused() {
    let far: String = (0..40).map(|tick| format!("{tick},a,1.7e308,1.7e308,1.7e308\n")).collect();
    let mapping = r#", "length": "m", "frame": {"position": [0, 0, 0], "orientation": [-0.5, -0.5, 0.5, 0.5]}"#;
    let refused = import(mapping, &[("a.csv", &("time,id,x,y,z\n".to_owned() + &far))]);
    let refused = refused.expect_err("it is refused").to_string();
    assert!(refused.contains("expected coordinates of at most 1e6 m"), "{refused}");
}

#[test]
fn signals_of_tables_with_clocks_of_their_own_have_the_times_of_their_tables() {
    let flag = |t: f64| u8::from((4.0..=6.0).contains(&t));
    // Milliseconds with contacts in one table, seconds with the width in the other, in both orders.
    let objects = "time_ms,id,x,y,z,contact\n".to_owned()
        + &cup(|t, id, [x, y, z]| {
            let touched = if id == "cup_1" { flag(t) } else { 0 };
            format!("{:.0},{id},{x:.4},{y:.4},{z:.4},{touched}\n", t * 1e3)
        });
    let ticks = || (0..200).map(|tick| f64::from(tick) * 0.05);
    let robot: String = "time_s,gripper_width\n".to_owned()
        + &ticks().map(|t| format!("{t:.2},{}\n", 80 - 50 * flag(t))).collect::<String>();
    for order in [[0, 1], [1, 0]] {
        let files = [("a_objects.csv", &*objects), ("a_robot.csv", &*robot)];
        let found = import("", &order.map(|at| files[at])).expect("imported");
        near(ends(&found), CARRIED);
        let width = &found.sessions[0].parts[0].width;
        assert!(width.last().is_some_and(|(t, _)| (t - 9.95).abs() < 1e-9), "{:?}", width.last());
    }
    // A flag in a table whose rows are numbers of other rows.
    let clock: String = "time,x,y,z\n".to_owned()
        + &ticks().map(|t| format!("{:.2},0,0,{:.2}\n", t + 100.0, t / 10.0)).collect::<String>();
    let mut row = 0;
    let labels = "row,grasped,x,y,z\n".to_owned()
        + &cup(|t, id, [x, y, z]| {
            if id != "cup_1" {
                return String::new();
            }
            row += 1;
            format!("{},{},{x:.4},{y:.4},{z:.4}\n", row - 1, flag(t))
        });
    let mapping = r#", "hand": "hand", "tables": [
        {"files": "*_objects.csv", "row_of": "*_robot.csv", "grasp": "grasped",
         "objects": {"cup_1": {"position": ["x", "y", "z"]}}},
        {"files": "*_robot.csv", "objects": {"hand": {"position": ["x", "y", "z"]}}}]"#;
    let files = [("a_objects.csv", &*labels), ("a_robot.csv", &*clock)];
    let found = import(mapping, &files).expect("imported");
    let grasp = &found.sessions[0].parts[0].grasp;
    let ends = grasp.first().zip(grasp.last()).map(|(a, b)| (a.0, b.0));
    assert_eq!((grasp.len(), ends), (200, Some((100.0, 109.95))));
}

#[test]
fn files_of_the_same_name_in_several_folders_are_several_sessions() {
    let long = "time,id,x,y,z\n".to_owned() + &cup(plain);
    let episode = "time,episode,id,x,y,z\n".to_owned()
        + &cup(|t, id, [x, y, z]| format!("{t:.2},0,{id},{x:.4},{y:.4},{z:.4}\n"));
    let twice = long.clone() + &cup(plain);
    let width: String = "time,gripper_width\n".to_owned()
        + &(0..200).map(|i| format!("{:.2},{}\n", f64::from(i) * 0.05, i % 2)).collect::<String>();
    let of = |files: &[(&str, &String)]| {
        let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (*name, &***text)).collect();
        let found = import("", &files).expect("imported");
        assert!(found.dropped.is_empty(), "{:?}", found.dropped);
        assert_eq!(found.moments.len(), 2 * found.sessions.len());
        found.sessions.iter().map(|session| session.name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(of(&[("r/d1/log.csv", &long), ("r/d2/log.csv", &long)]), ["d1/log", "d2/log"]);
    assert_eq!(of(&[("e1/objects.csv", &long), ("e2/objects.csv", &long)]), ["e1", "e2"]);
    assert_eq!(of(&[("e1/objects/a.csv", &long), ("e1/objects/b.csv", &long)]), ["a", "b"]);
    assert_eq!(of(&[("a.csv", &episode), ("b.csv", &episode)]), ["a/0", "b/0"]);
    let names = of(&[("take.csv", &twice), ("take-2.csv", &long)]);
    assert_eq!(names, ["take", "take/take-2", "take-2"]);
    // The poses of a session in one folder, the gripper in another.
    assert_eq!(of(&[("mocap/a.csv", &long), ("robot/a.csv", &width)]), ["a"]);
    assert_eq!(of(&[("grip/a.csv", &width), ("mocap/a.csv", &long)]), ["a"]);
}

#[test]
fn two_columns_of_one_time_are_not_added_up() {
    let of = |header: &str, times: &dyn Fn(f64) -> String| {
        let rows = cup(|t, id, [x, y, z]| format!("{},{id},{x:.4},{y:.4},{z:.4}\n", times(t)));
        import("", &[("a.csv", &format!("{header},id,x,y,z\n{rows}"))])
    };
    let nano = |t: f64| (t.fract() * 1e9).round();
    let both = |t: f64| format!("{t:.2},{:.0}", t * 1e9);
    near(ends(&of("time_s,timestamp_ns", &both).expect("imported")), CARRIED);
    let parts = |t: f64| format!("{:.0},{:.0}", t.floor(), nano(t));
    near(ends(&of("secs,nsecs", &parts).expect("imported")), CARRIED);
    near(ends(&of("header.stamp.sec,header.stamp.nanosec", &parts).expect("imported")), CARRIED);
    let turned = |t: f64| format!("{:.0},{:.0}", nano(t), t.floor());
    near(ends(&of("stamp_nsec,stamp_sec", &turned).expect("imported")), CARRIED);
    let refused = of("time,time_ns", &both).expect_err("it is refused").to_string();
    assert!(refused.contains("field `time_ns`: it is 1000000000, beside another"), "{refused}");
}

#[test]
fn a_session_column_need_not_stand_in_every_table() {
    // Two episodes one after the other, and a gripper whose table does not know of them.
    let two = |t: f64, id: &str, [x, y, z]: [f64; 3]| {
        let row = |t: f64, n: u8| format!("{t:.2},{n},{id},{x:.4},{y:.4},{z:.4}\n");
        [row(t, 0), row(t + 20.0, 1)]
    };
    let (mut first, mut second) = (String::new(), String::new());
    cup(|t, id, at| {
        let [one, other] = two(t, id, at);
        first += &one;
        second += &other;
        String::new()
    });
    let objects = format!("time,episode,id,x,y,z\n{first}{second}");
    let robot = |from: f64, to: f64| {
        let ticks = (0..800).map(|tick| f64::from(tick) * 0.05).filter(|t| (from..to).contains(t));
        let held = |t: f64| u8::from((4.0..=6.0).contains(&(t % 20.0)));
        let rows = ticks.map(|t| format!("{t:.2},{}\n", held(t)));
        "time,grasped\n".to_owned() + &rows.collect::<String>()
    };
    for names in [["a_objects.csv", "a_robot.csv"], ["z.csv", "a.csv"]] {
        for order in [[0, 1], [1, 0]] {
            let gripper = robot(0.0, 32.0);
            let files = [(names[0], &*objects), (names[1], &*gripper)];
            let found = import("", &order.map(|at| files[at])).expect("imported");
            let sessions: Vec<&str> = found.sessions.iter().map(|s| &*s.name).collect();
            assert_eq!(sessions, ["0", "1"]);
            assert_eq!(found.moments.len(), 4);
            assert!(found.moments.iter().all(|m| m.evidence.starts_with("grasp flag")));
            // Between and behind the episodes, 10 to 20 s and 30 to 32 s.
            let left: Vec<u64> = found.dropped.iter().map(|dropped| dropped.count).collect();
            assert_eq!(left, [240], "{:?}", found.dropped);
        }
    }
    // Nobody has the column.
    let mapping = r#", "session": "trial""#;
    let refused = import(mapping, &[("a.csv", &*robot(0.0, 9.0))]).expect_err("it is refused");
    assert!(refused.to_string().contains("field `trial`: no table has such a column"), "{refused}");
}

#[test]
fn signals_that_go_with_no_motion_do_not_hide_the_motion() {
    let rows = cup(|t, id, [x, y, z]| {
        format!("{t:.2},{id},{x:.4},{y:.4},{z:.4},{}\n", u8::from((0.5..2.0).contains(&t)))
    });
    let found = import("", &[("a.csv", &format!("time,id,x,y,z,grasped\n{rows}"))]);
    let found = found.expect("imported");
    near(ends(&found), CARRIED);
    let said = |text: &str| found.dropped.iter().any(|dropped| dropped.what.contains(text));
    assert!(said("no object moved") && said("motion alone tells"), "{:?}", found.dropped);
    // A column that the mapping names is no other column, whatever its name.
    let rows = cup(|t, id, [x, y, z]| {
        format!("{t:.2},{id},{},{x:.4},{y:.4},{z:.4}\n", u8::from((4.0..=6.0).contains(&t)))
    });
    let mapping = r#", "tables": [{"grasp": "finger_x"}]"#;
    let text = format!("time,id,finger_x,x,y,z\n{rows}");
    near(ends(&import(mapping, &[("a.csv", &text)]).expect("imported")), CARRIED);
}

#[test]
fn a_table_sorted_by_object_is_one_session() {
    let of = |ids: &[&str], times: &[usize]| {
        let mut text = "time,id,x,y,z\n".to_owned();
        for id in ids {
            for _ in times {
                text +=
                    &cup(|t, own, at| if own == *id { plain(t, own, at) } else { String::new() });
            }
        }
        import("", &[("a.csv", &text)]).expect("imported")
    };
    let found = of(&["cup_1", "shelf"], &[0]);
    near(ends(&found), CARRIED);
    assert_eq!((found.sessions.len(), found.sessions[0].parts[0].tracks.len()), (1, 2));
    // Each object has both of two sessions.
    let found = of(&["shelf", "cup_1"], &[0, 1]);
    assert_eq!((found.sessions.len(), found.moments.len()), (2, 4));
    assert!(found.sessions.iter().all(|session| session.parts[0].tracks.len() == 2));
    // A new object in the first row of the second session.
    let second = format!("0.00,bowl,0.1,0.2,0.3\n{}", cup(plain));
    let rows = format!("time,id,x,y,z\n{}{second}0.05,bowl,0.1,0.2,0.3\n", cup(plain));
    let found = import("", &[("a.csv", &rows)]).expect("imported");
    assert_eq!((found.sessions.len(), found.moments.len()), (2, 4));
}

#[test]
fn an_object_first_seen_after_its_contact_is_not_at_the_origin() {
    let rows =
        cup(|t, id, at| if id == "shelf" || t > 7.0 { plain(t, id, at) } else { String::new() });
    let flags = (0..200).map(|tick| f64::from(tick) * 0.05);
    let flags = flags.map(|t| format!("{t:.2},{}\n", u8::from((4.0..=6.0).contains(&t))));
    let contacts = "time,contact_cup_1\n".to_owned() + &flags.collect::<String>();
    let objects = "time,id,x,y,z\n".to_owned() + &rows;
    let found = import("", &[("a_objects.csv", &objects), ("a_contacts.csv", &contacts)]);
    let found = found.expect("imported");
    near(ends(&found), (CARRIED.1, CARRIED.1));
    assert_eq!(found.moments[0].samples, 0);
}

#[test]
fn a_number_of_the_row_named_id_is_no_object() {
    let mut row = 0;
    let rows = cup(|t, id, at| {
        row += 1;
        format!("{row},{}", plain(t, id, at))
    });
    let found = import("", &[("a.csv", &format!("id,time,object,x,y,z\n{rows}"))]);
    let found = found.expect("imported");
    near(ends(&found), CARRIED);
    assert_eq!(found.unused, [("a.csv".to_owned(), vec!["id".to_owned()])]);
    // Contacts by id in a table without poses.
    let flags = cup(|t, id, _| {
        format!("{t:.2},{id},{}\n", u8::from(id == "cup_1" && (4.0..=6.0).contains(&t)))
    });
    let objects = "time,id,x,y,z\n".to_owned() + &cup(plain);
    let contacts = format!("time,object,contact\n{flags}");
    let found = import("", &[("a_objects.csv", &objects), ("a_contacts.csv", &contacts)]);
    let found = found.expect("imported");
    near(ends(&found), CARRIED);
    assert!(found.moments[0].evidence.starts_with("contact with cup_1"), "{:?}", found.moments);
    // Of the kinds that fit, the longest pattern wins.
    let mapping = r#", "kinds": {"*": "thing", "cup_*": "cup", "cu*": "vessel"}"#;
    let found = import(mapping, &[("a.csv", &objects)]).expect("imported");
    let kinds: Vec<&str> = found.seen.iter().map(|seen| &*seen.kind).collect();
    assert_eq!(kinds, ["cup", "thing"]);
}

#[test]
fn names_in_a_comment_spaces_and_dates_are_told() {
    // As trajectory tools write it: the names in a comment, spaces between numbers.
    let spaced = |id: &str| {
        let rows = cup(|t, own, [x, y, z]| match own == id {
            true => format!(" {t:.2}  {x:.4} {y:.4}   {z:.4} 0 0 0 1\n"),
            false => String::new(),
        });
        format!("# made by a camera\n# timestamp tx ty tz qx qy qz qw\n{rows}")
    };
    let found = import("", &[("cup_1.txt", &spaced("cup_1"))]).expect("imported");
    near(ends(&found), CARRIED);
    assert_eq!(&*found.moments[0].object, "cup_1");
    let commented = format!("# time,id,x,y,z\n{}", cup(plain));
    near(ends(&import("", &[("a.csv", &commented)]).expect("imported")), CARRIED);
    // A comment with other fields gives no names.
    let other = format!("# made by a camera\n{}", cup(plain));
    let refused = import("", &[("a.csv", &other)]).expect_err("it is refused").to_string();
    assert!(refused.contains("it has no row of names"), "{refused}");
    let dates = "time,id,x,y,z\n".to_owned()
        + &cup(|t, id, [x, y, z]| format!("2024-05-01T12:00:{t:05.2}Z,{id},{x},{y},{z}\n"));
    let refused = import("", &[("a.csv", &dates)]).expect_err("it is refused").to_string();
    assert!(
        refused.contains("line 2, field `time`") && refused.contains("to_datetime"),
        "{refused}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn no_log_makes_the_import_panic(edits in prop::collection::vec((0usize..6000, any::<u8>()), 1..20), cut in 100usize..6000) {
        let text = "time,id,x,y,z,qx,qy,qz,qw,width,grasped\n".to_owned()
            + &cup(|t, id, [x, y, z]| format!("{t:.2},{id},{x:.4},{y:.4},{z:.4},0,0,0,1,{z},1\n"));
        let mut bytes = text.into_bytes();
        bytes.truncate(cut);
        for (at, byte) in edits {
            let length = bytes.len();
            bytes[at % length] = byte;
        }
        let mut streams = Streams::new(Mapping::unknown());
        if streams.add_csv("a.csv", &bytes).is_ok() && let Ok(log) = streams.finish() {
            let found = log.import();
            // What is imported can be read again.
            let text = found.recording.to_jsonl(None).expect("it is written");
            if found.recording.snapshot_count() > 0 {
                prop_assert!(Recording::parse(text.as_bytes(), "a.jsonl").is_ok());
            }
        }
    }
}
