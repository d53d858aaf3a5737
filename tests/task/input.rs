//! Invalid input: every fault gives a clear error and never a panic.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use proptest::prelude::*;
use symbolt::sim::Seed;
use symbolt::task::learn::{Settings, learn};
use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
use symbolt::task::{Recording, Snapshot, TaskError};

fn object(id: &str, position: &str, orientation: &str) -> String {
    format!(
        r#"{{"id": "{id}", "kind": "nut", "position": {position}, "orientation": {orientation}}}"#
    )
}

fn line(demo: u64, snapshot: u64, objects: &str) -> String {
    format!(r#"{{"demo": {demo}, "snapshot": {snapshot}, "objects": [{objects}]}}"#)
}

const GOOD: &str = "[0.1, 0.2, 0.3]";
const UNIT: &str = "[0, 0, 0, 1]";

fn fault(text: &str) -> String {
    Recording::parse(text.as_bytes(), "demos.jsonl").expect_err("it is not sound").to_string()
}

#[test]
fn sound_lines_are_read() {
    let text = format!(
        "{}\n\n{}\r\n",
        line(0, 0, &object("a", GOOD, UNIT)),
        line(0, 1, &object("a", GOOD, "[0, 0, 0.6, 0.8]"))
    );
    let (recording, labels) = Recording::parse(text.as_bytes(), "x").expect("sound");
    assert_eq!(recording.demos.len(), 1);
    assert_eq!(recording.demos[0].snapshots.len(), 2);
    assert_eq!(labels, [[None, None]]);
    let marked = format!("\u{feff}{text}");
    assert_eq!(Recording::parse(marked.as_bytes(), "x").expect("sound"), (recording, labels));
}

#[test]
fn every_fault_names_file_line_field_and_what_was_expected() {
    let good = line(0, 0, &object("a", GOOD, UNIT));
    let second = |bad: &str| format!("{good}\n{bad}");
    let with = |id: &str, p: &str, q: &str| second(&line(0, 1, &object(id, p, q)));
    let cases: Vec<(&str, String, &[&str])> =
        vec![
            ("empty", String::new(), &["demos.jsonl", "no snapshot"]),
            ("truncated", second(&good[..good.len() / 2]), &["line 2", "complete JSON object"]),
            ("no JSON", second("hello"), &["line 2", "a JSON object"]),
            ("NaN", with("a", "[NaN, 0, 0]", UNIT), &["line 2"]),
            ("infinite", with("a", "[1e999, 0, 0]", UNIT), &["line 2", "out of range"]),
            ("too far", with("a", "[1e7, 0, 0]", UNIT), &["objects[0].position[0]", "metres"]),
            ("two coordinates", with("a", "[0, 0]", UNIT), &["line 2", "`position` [3]"]),
            (
                "zero quaternion",
                with("a", GOOD, "[0, 0, 0, 0]"),
                &["objects[0].orientation", "norm is 0", "unit"],
            ),
            ("no unit quaternion", with("a", GOOD, "[0, 0, 0, 1.1]"), &["norm is 1.1", "unit"]),
            ("empty id", with("", GOOD, UNIT), &["objects[0].id", "0 characters"]),
            (
                "repeated id",
                second(&line(0, 1, &[object("a", GOOD, UNIT), object("a", GOOD, UNIT)].join(","))),
                &["objects[1].id", "`a` is used twice"],
            ),
            (
                "out of order",
                second(&line(0, 2, &object("a", GOOD, UNIT))),
                &["snapshot", "2 follows snapshot 0"],
            ),
            ("repeated", second(&good), &["snapshot 0 follows snapshot 0"]),
            (
                "a demonstration torn apart",
                [
                    good.clone(),
                    line(1, 0, &object("a", GOOD, UNIT)),
                    line(0, 1, &object("a", GOOD, UNIT)),
                ]
                .join("\n"),
                &["line 3", "continues after another"],
            ),
            (
                "unknown field",
                second(&good.replace("\"demo\"", "\"color\": 1, \"demo\"")),
                &["unknown field `color`"],
            ),
            (
                "no demo",
                second(&good.replace("\"demo\": 0, ", "")),
                &["line 2", "field `demo`", "missing"],
            ),
            ("no snapshot", second(&good.replace("\"snapshot\": 0, ", "")), &["field `snapshot`"]),
            ("negative demo", second(&good.replace("\"demo\": 0", "\"demo\": -1")), &["line 2"]),
            (
                "a kind that changes",
                second(&line(0, 1, &object("a", GOOD, UNIT).replace("nut", "bolt"))),
                &["`a` has the kind `bolt`, but had the kind `nut` before"],
            ),
            (
                "unknown event",
                second(&line(0, 1, "").replace("\"objects\"", "\"event\": \"grab\", \"objects\"")),
                &["grab"],
            ),
            (
                "contact with nobody",
                second(&line(0, 1, "").replace(
                    "\"objects\"",
                    "\"event\": \"contact\", \"object\": \"z\", \"objects\"",
                )),
                &["no object is called `z`"],
            ),
        ];
    assert_eq!(cases.len(), 21);
    for (what, text, parts) in cases {
        let message = fault(&text);
        for part in parts.iter().chain(&["demos.jsonl"]) {
            assert!(message.contains(part), "{what}: {part} in {message}");
        }
    }
}

#[test]
fn times_that_run_backwards() {
    let at = |snapshot: u64, t: f64| {
        line(0, snapshot, &object("a", GOOD, UNIT))
            .replace("\"objects\"", &format!("\"t\": {t}, \"objects\""))
    };
    assert!(fault(&[at(0, 2.0), at(1, 1.0)].join("\n")).contains("1 s follows 2 s"));
}

#[test]
fn bytes_that_are_no_text() {
    let mut bytes = line(0, 0, &object("a", GOOD, UNIT)).into_bytes();
    bytes.extend([b'\n', 0xC3, 0x28]);
    let message = Recording::parse(&bytes, "x").expect_err("not UTF-8").to_string();
    assert!(message.contains("line 2") && message.contains("not UTF-8"), "{message}");
}

#[test]
fn scenes_are_exactly_one_snapshot_in_any_layout() {
    let scene = format!("{{\n  \"objects\": [\n    {}\n  ]\n}}\n", object("a", GOOD, UNIT));
    assert_eq!(Snapshot::parse(scene.as_bytes(), "s").map(|s| s.objects.len()), Ok(1));
    let two = format!("{scene}{scene}");
    let message = Snapshot::parse(two.as_bytes(), "s").expect_err("two").to_string();
    assert!(message.contains("more than one"), "{message}");
    assert!(Snapshot::parse(b"", "s").is_err());
    assert!(Snapshot::parse(b"[]", "s").is_err());
}

#[test]
fn recordings_with_nothing_to_learn_say_why() {
    let why = |text: String| {
        let (recording, _) = Recording::parse(text.as_bytes(), "x").expect("sound");
        match learn(&recording, &Settings::paper()) {
            Err(TaskError::NothingToLearn { reason }) => reason,
            other => panic!("{other:?}"),
        }
    };
    assert!(why(line(0, 0, &object("a", GOOD, UNIT))).contains("two snapshots"));
    let still = [line(0, 0, &object("a", GOOD, UNIT)), line(0, 1, &object("a", GOOD, UNIT))];
    assert!(why(still.join("\n")).contains("moved"));
    assert!(why([line(0, 0, ""), line(0, 1, "")].join("\n")).contains("moved"));
    let (recording, _) = Recording::parse(still.join("\n").as_bytes(), "x").expect("sound");
    for (p, threshold_m) in
        [(0.0, None), (f64::NAN, None), (-2.0, Some(0.0)), (-2.0, Some(f64::INFINITY))]
    {
        let settings = Settings { p, threshold_m, ..Settings::default() };
        assert!(matches!(learn(&recording, &settings), Err(TaskError::Setting { .. })));
    }
}

fn a_recording() -> Vec<u8> {
    let spec = SyntheticDemonstrations {
        demos: 2,
        nuts: 2,
        fail_rate: 0.3,
        ..SyntheticDemonstrations::default()
    };
    let made = spec.record(Seed::new(3)).expect("sound");
    made.recording.to_jsonl(Some(&made.labels)).expect("plain data").into_bytes()
}

#[test]
fn a_recording_is_read_back_as_it_was_written() {
    let spec = SyntheticDemonstrations {
        demos: 2,
        nuts: 2,
        fail_rate: 0.3,
        ..SyntheticDemonstrations::default()
    };
    let made = spec.record(Seed::new(3)).expect("sound");
    let (recording, labels) = Recording::parse(&a_recording(), "x").expect("sound");
    assert_eq!(labels, made.labels);
    let (a, b) = (&recording.demos[1], &made.recording.demos[1]);
    assert_eq!(a.snapshots.len(), b.snapshots.len());
    for (x, y) in a.snapshots.iter().zip(&b.snapshots) {
        assert_eq!((x.event, x.object, x.time_s), (y.event, y.object, y.time_s));
        for (p, q) in x.objects.iter().zip(&y.objects) {
            assert_eq!(p.pose.position, q.pose.position);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn random_bytes_never_panic_a_reader(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = Recording::parse(&bytes, "x");
        let _ = Snapshot::parse(&bytes, "x");
    }

    #[test]
    fn mutated_files_are_read_and_learned_from_or_refused(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
        shorten in any::<bool>(),
    ) {
        let mut bytes = a_recording();
        for (index, value) in &changes {
            let at = index.index(bytes.len());
            bytes[at] = *value;
        }
        if shorten {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok((recording, _)) = Recording::parse(&bytes, "x") {
            let _ = learn(&recording, &Settings::paper());
        }
    }

    #[test]
    fn swapped_digits_are_learned_from_without_a_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0u8..10), 1..30),
    ) {
        // Changing only digits keeps the file readable, but makes its numbers meaningless.
        let mut bytes = a_recording();
        let digits: Vec<usize> = (0..bytes.len()).filter(|i| bytes[*i].is_ascii_digit()).collect();
        for (index, value) in &changes {
            bytes[digits[index.index(digits.len())]] = b'0' + value;
        }
        if let Ok((recording, _)) = Recording::parse(&bytes, "x") {
            let _ = learn(&recording, &Settings::paper());
        }
    }
}
