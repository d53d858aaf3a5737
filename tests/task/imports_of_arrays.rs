//! Logs of arrays in HDF5: the same recording as from tables, the layouts that are guessed, and what is refused.

use std::time::{Duration, Instant};

use hdf5_pure::{FileBuilder, MaxExtent};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use symbolt::task::Recording;
use symbolt::task::import::Mapping;

use crate::imports::{import, import_by, text};

fn refused(mapping: &str, bytes: &[u8]) -> String {
    import(mapping, &[("a.hdf5", bytes)]).expect_err("it is refused").to_string()
}

const ROWS: usize = 240;
const RATE: f64 = 20.0;

/// The poses of a cube and of a hand, and the places of two fingers.
type Row = ([f64; 7], [f64; 7], [f64; 2]);

/// A demonstration at 20 Hz: a cube is lifted onto a shelf between 4 and 6 s. For each row the poses of the cube and of the
/// hand, and the places of the two fingers.
fn scene(demo: usize) -> Vec<Row> {
    let mut random = ChaCha8Rng::seed_from_u64(demo as u64);
    let mut noise = move || random.random_range(-1e-4..1e-4);
    let row = |tick: usize| {
        let t = tick as f64 / RATE;
        let u = ((t - 4.0) / 2.0).clamp(0.0, 1.0);
        let away = (4.0 - t).max(t - 6.4).max(0.0) * 0.05;
        let (x, z) = (0.4 + 0.03 * demo as f64, 0.02 + 0.15 * u);
        let cube = [x + 0.25 * u + noise(), 0.1 + noise(), z + noise(), 0.0, 0.0, 0.6, 0.8];
        let hand = [x + 0.25 * u, 0.1, z + 0.05 + away, 1.0, 0.0, 0.0, 0.0];
        let closed = ((t - 3.6) / 0.4).clamp(0.0, 1.0) - ((t - 6.0) / 0.4).clamp(0.0, 1.0);
        let finger = 0.04 - 0.02 * closed;
        (cube, hand, [finger, -finger])
    };
    (0..ROWS).map(row).collect()
}

/// Writes demonstrations as robomimic does.
fn robomimic(demos: usize, packed: bool) -> Vec<u8> {
    let mut file = FileBuilder::new();
    let mut data = file.create_group("data");
    for demo in 0..demos {
        let rows = scene(demo);
        let mut own = data.create_group(&format!("demo_{demo}"));
        let mut obs = own.create_group("obs");
        let mut put = |name: &str, width: u64, values: Vec<f64>| {
            let set =
                obs.create_dataset(name).with_f64_data(&values).with_shape(&[ROWS as u64, width]);
            if packed {
                set.with_chunks(&[64, width]).with_shuffle().with_deflate(4);
            }
        };
        put("cube_pos", 3, rows.iter().flat_map(|r| r.0[..3].to_vec()).collect());
        put("cube_quat", 4, rows.iter().flat_map(|r| r.0[3..].to_vec()).collect());
        put("robot0_eef_pos", 3, rows.iter().flat_map(|r| r.1[..3].to_vec()).collect());
        put("robot0_eef_quat", 4, rows.iter().flat_map(|r| r.1[3..].to_vec()).collect());
        put("robot0_gripper_qpos", 2, rows.iter().flat_map(|r| r.2).collect());
        put("robot0_joint_pos", 7, vec![0.5; ROWS * 7]);
        own.add_group(obs.finish());
        own.create_dataset("actions")
            .with_f64_data(&vec![0.1; ROWS * 7])
            .with_shape(&[ROWS as u64, 7]);
        data.add_group(own.finish());
    }
    file.add_group(data.finish());
    file.finish().expect("a file")
}

fn tables(demos: usize) -> Vec<(String, String)> {
    let row = |(tick, (cube, hand, fingers)): (usize, &Row)| {
        let all = |pose: &[f64; 7]| pose.map(|v| v.to_string()).join(",");
        let width = fingers[0].abs() + fingers[1].abs();
        format!("{},{},{},{width}\n", tick as f64 / RATE, all(cube), all(hand))
    };
    let columns = |id: &str| {
        ["x", "y", "z", "qx", "qy", "qz", "qw"].map(|axis| format!("{id}.{axis}")).join(",")
    };
    let header = format!("time,{},{},gripper_width\n", columns("cube"), columns("robot0_eef"));
    let table = |demo: usize| {
        let rows = scene(demo);
        let text: String = rows.iter().enumerate().map(row).collect();
        (format!("demo_{demo}.csv"), header.clone() + &text)
    };
    (0..demos).map(table).collect()
}

#[test]
fn demonstrations_of_robomimic_give_the_same_recording_as_tables() {
    let tables = tables(12);
    let files: Vec<(&str, &[u8])> =
        tables.iter().map(|(n, t)| (n.as_str(), t.as_bytes())).collect();
    let by_table = import("", &files).expect("imported");
    assert_eq!(by_table.moments.len(), 24);
    for packed in [false, true] {
        let bytes = robomimic(12, packed);
        let found = import(r#", "rate_hz": 20"#, &[("a.hdf5", &bytes)]).expect("imported");
        let names: Vec<&str> = found.sessions.iter().map(|s| &*s.name).collect();
        assert_eq!((names[2], names[10], names[11]), ("demo_2", "demo_10", "demo_11"));
        assert_eq!(text(&found), text(&by_table));
        assert!(
            found.unused[0].1.contains(&"data/demo_*/obs/robot0_joint_pos".to_owned()),
            "{:?}",
            found.unused
        );
        // What was guessed reads the same when it is said.
        let mapping = found.mapping.to_json().expect("a mapping");
        assert!(mapping.contains(r#""group": "data/demo_*""#), "{mapping}");
        let mapping = Mapping::parse(mapping.as_bytes(), "m.json").expect("a mapping");
        let again = import_by(mapping.clone(), &[("a.hdf5", &bytes)]).expect("imported");
        assert_eq!((text(&again), again.mapping), (text(&found), mapping));
    }
}

/// A file without sessions: times in nanoseconds, two blocks in one dataset, and a hand as matrices.
fn lab(rows: usize) -> Vec<u8> {
    let mut file = FileBuilder::new();
    let own = scene(0);
    let n = rows as u64;
    let times: Vec<i64> = (0..ROWS as i64).map(|tick| 1_000_000_000 + tick * 50_000_000).collect();
    file.create_dataset("clock").with_i64_data(&times);
    let blocks = own[..rows].iter().flat_map(|(cube, ..)| {
        [cube[0], cube[1], cube[2], 0.9, 0.4, 0.3].map(|v| (v * 1e3) as f32)
    });
    let blocks: Vec<f32> = blocks.collect();
    file.create_dataset("blocks").with_f32_data(&blocks).with_shape(&[n, 2, 3]);
    let turns = vec![0.8, 0.0, 0.0, 0.6];
    let turns: Vec<f64> = turns.into_iter().cycle().take(rows * 8).collect();
    file.create_dataset("turns").with_f64_data(&turns).with_shape(&[n, 2, 4]);
    let hand = own[..rows].iter().flat_map(|(_, hand, _)| {
        let [x, y, z] = [hand[0], hand[1], hand[2]].map(|v| v * 1e3);
        [1.0, 0.0, 0.0, x, 0.0, -1.0, 0.0, y, 0.0, 0.0, -1.0, z, 0.0, 0.0, 0.0, 1.0]
    });
    let hand: Vec<f64> = hand.collect();
    file.create_dataset("tool").with_f64_data(&hand).with_shape(&[n, 4, 4]);
    let shut: Vec<u8> = (0..rows).map(|tick| u8::from((80..=120).contains(&tick))).collect();
    file.create_dataset("shut").with_u8_data(&shut);
    file.finish().expect("a file")
}

const LAB: &str = r#", "quaternion": "wxyz", "length": "mm", "datasets": [{"time": "clock", "grasp": "shut",
    "objects": {"block_*": {"position": "blocks", "rotation": "turns"}, "tool": {"position": "tool"}}}]"#;

#[test]
fn datasets_that_the_mapping_names_are_read_in_its_units() {
    let bytes = lab(ROWS);
    let found = import(LAB, &[("take_7.h5", &bytes)]).expect("imported");
    let session = &found.sessions[0];
    assert_eq!(
        (&*session.name, &found.seen[0].id[..], &found.seen[1].id[..]),
        ("take_7", "block_0", "block_1")
    );
    let first = &session.parts[0].tracks[0].samples[0];
    assert!((first.t - 1.0).abs() < 1e-9 && (first.position[0] - 0.4).abs() < 1e-3, "{first:?}");
    let [x, y, z, w] = first.orientation;
    assert!(
        (z - 0.6).abs() < 1e-12 && (w - 0.8).abs() < 1e-12 && x == 0.0 && y == 0.0,
        "{first:?}"
    );
    let hand = session.parts[0].hand.as_ref().expect("a hand").samples[0];
    assert_eq!(hand.orientation.map(f64::abs), [1.0, 0.0, 0.0, 0.0]);
    let moments: Vec<(&str, f64)> =
        found.moments.iter().map(|m| (&*m.object, m.t.round())).collect();
    assert_eq!(moments, [("block_0", 5.0), ("block_0", 7.0)]);
    // The other order is another rotation.
    let other = import(&LAB.replace("wxyz", "xyzw"), &[("take_7.h5", &bytes)]).expect("imported");
    assert_ne!(text(&found), text(&other));
}

#[test]
fn groups_of_the_same_name_in_several_files_are_several_sessions() {
    let bytes = robomimic(2, false);
    let rate = r#", "rate_hz": 20"#;
    let names = |mapping: &str, files: &[(&str, &[u8])]| {
        let found = import(mapping, files).expect("imported");
        assert_eq!(found.moments.len(), 2 * found.sessions.len());
        found.sessions.iter().map(|session| session.name.clone()).collect::<Vec<_>>()
    };
    let both: [(&str, &[u8]); 2] = [("runs/a.hdf5", &bytes), ("runs/b.hdf5", &bytes)];
    let expected = ["a/demo_0", "a/demo_1", "b/demo_0", "b/demo_1"];
    assert_eq!(names(rate, &both), expected);
    let pattern = format!(r#"{rate}, "sessions": "{{session}}.hdf5""#);
    assert_eq!(names(&pattern, &both), expected);
    assert_eq!(names(rate, &both[..1]), ["demo_0", "demo_1"]);
    // A column of the session is one of tables.
    let asked = format!(r#"{rate}, "session": "trial""#);
    let refused = refused(&asked, &bytes);
    assert!(
        refused.contains("field `trial`: no table has such a column")
            && refused.ends_with("of bags and arrays, files and groups are sessions"),
        "{refused}"
    );
}

/// Positions of a cube in a dataset of this name, with times.
fn cube_in(name: &str, demo: usize) -> Vec<u8> {
    let mut file = FileBuilder::new();
    let times: Vec<f64> = (0..ROWS).map(|tick| tick as f64 / RATE).collect();
    file.create_dataset("time").with_f64_data(&times);
    let places: Vec<f64> = scene(demo).iter().flat_map(|row| row.0[..3].to_vec()).collect();
    file.create_dataset(name).with_f64_data(&places).with_shape(&[ROWS as u64, 3]);
    file.finish().expect("a file")
}

#[test]
fn a_mapping_of_several_files_with_other_datasets_reads_them_back() {
    let [one, two, three, four] = [0, 1, 2, 3]
        .map(|demo| cube_in(if demo % 2 == 0 { "cube_pos" } else { "cube_position" }, demo));
    // Names whose ends tell the files apart, and names whose ends do not.
    for (names, patterns) in [
        (["1_a.h5", "1_b.h5", "2_a.h5", "2_b.h5"], &["*_a.h5", "*_b.h5"][..]),
        (["1.h5", "2.h5", "3.h5", "4.h5"], &["1.h5", "3.h5", "2.h5", "4.h5"]),
    ] {
        let bytes = [&one, &two, &three, &four];
        let files: Vec<(&str, &Vec<u8>)> = names.into_iter().zip(bytes).collect();
        let found = import("", &files).expect("imported");
        assert_eq!((found.sessions.len(), found.moments.len()), (4, 8));
        let own: Vec<&str> = found.mapping.datasets.iter().map(|map| &*map.files).collect();
        assert_eq!(own, patterns);
        let again = import_by(found.mapping.clone(), &files).expect("imported");
        assert_eq!((text(&again), again.mapping), (text(&found), found.mapping));
    }
    // The datasets of a file that no pattern fits are guessed.
    let mapping = r#", "datasets": [{"files": "x.h5", "objects": {"cube": {"position": "none"}}}]"#;
    assert!(import(mapping, &[("a.h5", &one)]).is_ok());
    assert!(import(mapping, &[("x.h5", &one)]).is_err());
}

#[test]
fn three_numbers_of_arrays_are_a_rotation_vector_beside_tables_too() {
    // The cube turned about z, and a table whose columns are called angles.
    let rows = scene(0);
    let n = ROWS as u64;
    let mut file = FileBuilder::new();
    let times: Vec<f64> = (0..ROWS).map(|tick| tick as f64 / RATE).collect();
    file.create_dataset("time").with_f64_data(&times);
    let places: Vec<f64> = rows.iter().flat_map(|row| row.0[..3].to_vec()).collect();
    file.create_dataset("cube_pos").with_f64_data(&places).with_shape(&[n, 3]);
    let turns = [0.5, 0.6, 0.7].into_iter().cycle().take(3 * ROWS);
    file.create_dataset("cube_rot").with_f64_data(&turns.collect::<Vec<f64>>()).with_shape(&[n, 3]);
    let arrays = file.finish().expect("a file");
    let table: String = times.iter().map(|t| format!("{t},0.9,0.4,0.3,0.1,0.2,0.3\n")).collect();
    let table =
        "time,shelf.x,shelf.y,shelf.z,shelf.roll,shelf.pitch,shelf.yaw\n".to_owned() + &table;
    let files: [(&str, &[u8]); 2] =
        [("take/objects.h5", &arrays), ("take/parts.csv", table.as_bytes())];
    let found = import("", &files).expect("imported");
    assert_eq!((found.sessions.len(), &*found.sessions[0].name), (1, "take"));
    let turn = found.sessions[0].parts[0].tracks.iter().find(|track| &*track.id == "cube");
    let [x, y, z, w] = turn.expect("a cube").samples[0].orientation;
    let angle = (0.25f64 + 0.36 + 0.49).sqrt();
    let s = (angle / 2.0).sin() / angle;
    for (one, other) in [(x, 0.5 * s), (y, 0.6 * s), (z, 0.7 * s), (w, (angle / 2.0).cos())] {
        assert!((one - other).abs() < 1e-9, "{one} {other}");
    }
    let again = import_by(found.mapping.clone(), &files).expect("imported");
    assert_eq!(text(&again), text(&found));
}

/// Positions and rotations of three numbers in two sessions, and of none in a third.
fn turned(greatest: [f64; 3]) -> Vec<u8> {
    let mut file = FileBuilder::new();
    for (demo, greatest) in greatest.into_iter().enumerate() {
        let mut group = file.create_group(&format!("demo_{demo}"));
        let places: Vec<f64> = scene(demo).iter().flat_map(|row| row.0[..3].to_vec()).collect();
        let n = ROWS as u64;
        group.create_dataset("cube_pos").with_f64_data(&places).with_shape(&[n, 3]);
        let turns: Vec<f64> = [0.0, 0.0, greatest].into_iter().cycle().take(3 * ROWS).collect();
        group.create_dataset("cube_rot").with_f64_data(&turns).with_shape(&[n, 3]);
        file.add_group(group.finish());
    }
    file.finish().expect("a file")
}

#[test]
fn the_unit_of_three_numbers_of_arrays_is_guessed_and_said() {
    let rate = r#", "rate_hz": 20"#;
    let found = import(rate, &[("a.hdf5", &turned([90.0, 0.0, 60.0]))]).expect("imported");
    let said = |what: &str| found.guesses.iter().find(|g| g.what == what).map(|g| &*g.value);
    assert_eq!((said("angle"), said("rotation")), (Some("deg"), Some("vector")));
    let turn = found.sessions[0].parts[0].tracks[0].samples[0].orientation;
    assert!((turn[2] - 0.5f64.sqrt()).abs() < 1e-9, "{turn:?}");
    let problem = refused(rate, &turned([90.0, 0.0, 3.0]));
    assert!(
        problem.contains("field `demo_2/cube_rot`: its greatest angle is 3.0, so that it seems to be in rad, and `demo_0/cube_rot` in deg; expected `angle`"),
        "{problem}"
    );
    let given = format!(r#"{rate}, "angle": "deg""#);
    assert!(import(&given, &[("a.hdf5", &turned([90.0, 0.0, 3.0]))]).is_ok());
}

#[test]
fn faults_of_arrays_name_the_dataset_and_the_row() {
    let bytes = robomimic(2, false);
    let rate = r#", "rate_hz": 20"#;
    assert_eq!(
        refused("", &bytes),
        "a.hdf5: it has no dataset of times; expected `time` or `rate_hz` in the mapping, or --rate HZ"
    );
    for (mapping, expected) in [
        (r#", "rate_hz": 0"#, "map.json, field `rate_hz`: it is 0; expected more than 0 Hz"),
        (
            r#", "rate_hz": 20, "datasets": [{"group": "data/x_*"}]"#,
            "field `data/x_*`: no group fits; expected a pattern of groups, such as data/demo_0",
        ),
        (
            r#", "rate_hz": 20, "datasets": [{"group": "data/demo_*", "objects": {"a": {"position": "obs/a_pos"}}}]"#,
            "field `data/demo_0/obs/a_pos`: there is no such dataset; expected one of: data/demo_0/obs/cube_pos",
        ),
        (
            r#", "rate_hz": 20, "datasets": [{"group": "data/demo_*", "objects": {"a": {"position": "obs/cube_quat"}}}]"#,
            "field `data/demo_0/obs/cube_quat`: its shape is [240, 4]; expected times × 3",
        ),
        (
            r#", "datasets": [{"group": "data/demo_*", "time": "actions", "objects": {}}]"#,
            "field `data/demo_0/actions`: its shape is [240, 7]; expected one time",
        ),
        (
            r#", "rate_hz": 20, "datasets": [{"group": "data/demo_*", "objects": {"a": {"position": "obs/robot0_joint_pos"}}}]"#,
            "row 0: the quaternion has the norm 1.000",
        ),
    ] {
        let problem = import(mapping, &[("a.hdf5", &bytes)])
            .map_or_else(|e| e.to_string(), |_| "taken".into());
        if expected.starts_with("row 0") {
            // Seven numbers are a pose, and these make a rotation.
            assert_eq!(problem, "taken");
        } else {
            assert!(problem.contains(expected), "{problem}");
        }
    }
    let mut file = FileBuilder::new();
    let transposed =
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.2, 0.1, 0.5, 1.0];
    let n = ROWS as u64;
    let values: Vec<f64> = transposed.into_iter().cycle().take(16 * ROWS).collect();
    file.create_dataset("cup_pose").with_f64_data(&values).with_shape(&[n, 4, 4]);
    let problem = refused(rate, &file.finish().expect("a file"));
    assert!(
        problem.contains("field `cup_pose`: row 0: the last row of the matrix is [0.2, 0.1, 0.5, 1.0], so that it looks transposed"),
        "{problem}"
    );
    let short = lab(100);
    let problem = refused(LAB, &short);
    assert!(
        problem.contains("field `blocks`: it has 100 rows, and `clock` has 240")
            || problem.contains("field `turns`"),
        "{problem}"
    );
    let wrong = LAB.replace("wxyz", "xyzw").replace(r#""turns""#, r#""blocks""#);
    let problem =
        refused(&wrong.replace(r#""position": "blocks""#, r#""position": "tool""#), &lab(ROWS));
    assert!(
        problem.contains(
            "field `blocks`: its shape is [240, 2, 3], and that of `tool` is [240, 4, 4]"
        ),
        "{problem}"
    );
    let mut file = FileBuilder::new();
    file.create_dataset("cup_pos")
        .with_u8_data(&[1; 3 * 64])
        .with_shape(&[64, 3])
        .with_maxshape(&[MaxExtent::Unlimited, MaxExtent::Fixed(3)])
        .with_chunks(&[1 << 20, 3])
        .with_deflate(4);
    let large = refused(rate, &file.finish().expect("a file"));
    assert!(large.contains("field `cup_pos`: its chunks have the shape [1048576, 3]"), "{large}");
    let mut file = FileBuilder::new();
    file.create_dataset("a").with_f64_data(&[1.0, 2.0]);
    let nothing = file.finish().expect("a file");
    assert!(refused(rate, &nothing).contains("no positions are recognised among a [2]"));
    for end in [9, 100, bytes.len() / 2] {
        let problem = refused(rate, &bytes[..end]);
        assert!(problem.starts_with("a.hdf5"), "{problem}");
    }
}

#[test]
fn no_bytes_in_arrays_make_the_import_panic_or_wait() {
    let files = [robomimic(2, true), robomimic(2, false), lab(ROWS)];
    let mappings = [r#", "rate_hz": 20"#, r#", "rate_hz": 20"#, LAB];
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let (mut taken, mut slowest) = (0, Duration::ZERO);
    for case in 0..2_000 {
        let mut bytes = files[case % 3].clone();
        // Half of the changes where the structure stands.
        let structure: Vec<usize> =
            (0..bytes.len()).filter(|at| bytes[*at].is_ascii_lowercase()).collect();
        for _ in 0..random.random_range(1..8) {
            let at = match random.random_range(0..2) {
                0 => random.random_range(0..bytes.len()),
                _ => {
                    let near = structure[random.random_range(0..structure.len())];
                    (near + random.random_range(0..64)).min(bytes.len() - 1)
                }
            };
            bytes[at] = [0, 0xff, random.random()][random.random_range(0..3)];
        }
        let began = Instant::now();
        if let Ok(found) = import(mappings[case % 3], &[("a.hdf5", &bytes)]) {
            taken += 1;
            let text = text(&found);
            if found.recording.snapshot_count() > 0 {
                assert!(Recording::parse(text.as_bytes(), "a.jsonl").is_ok());
            }
        }
        slowest = slowest.max(began.elapsed());
    }
    assert!((50..1_990).contains(&taken), "{taken} were taken");
    assert!(slowest < Duration::from_secs(2), "{slowest:?}");
}
