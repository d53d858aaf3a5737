//! Invalid input: every fault gives a clear error and never a panic.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use proptest::prelude::*;
use serde_json::{Value, json};
use symbolt::sim::Seed;
use symbolt::task::learn::{Settings, learn};
use symbolt::task::tasks::nuts_and_bolts::SyntheticDemonstrations;
use symbolt::task::{
    Classifier, Domain, DomainBuilder, Grounding, Pose, Recording, Snapshot, TaskError,
};

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
        match learn(&recording, &Settings::default()) {
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

fn domain() -> Domain {
    let recording =
        SyntheticDemonstrations::default().record(Seed::new(1)).expect("sound").recording;
    learn(&recording, &Settings::default()).expect("learns").domain
}

#[test]
fn a_domain_is_read_back_as_it_was_written() {
    let domain = domain();
    assert_eq!(
        Domain::parse(domain.to_json().expect("plain data").as_bytes(), "d").expect("sound"),
        domain
    );
}

#[test]
fn domains_that_are_not_sound_say_what_is_wrong() {
    let text = domain().to_json().expect("plain data");
    let broken = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        let changed = text.replacen(from, to, 1);
        Domain::parse(changed.as_bytes(), "d.json").expect_err("not sound").to_string()
    };
    let cases = [
        ("\"version\": 2", "\"version\": 3", "field `version`: it is 3"),
        ("\"symbolt-domain\"", "\"pddl\"", "it is `pddl`"),
        ("\"goal\": \"BOLT_AT_NUT_POCKET\"", "\"goal\": \"HAPPINESS\"", "is not a state"),
        ("\"name\": \"NUT_AT_START\"", "\"name\": \"BOLT_AT_START\"", "is used twice"),
        ("\"name\": \"NUT_AT_START\"", "\"name\": \"nut\"", "cannot be a name"),
        ("\"name\": \"NUT_AT_START\"", "\"name\": \"NOTHING\"", "cannot be a name"),
        ("\"name\": \"NUT_AT_START\"", "\"name\": \"ELSEWHERE\"", "is not a state"),
        (
            "\"to\": \"BOLT_AT_BOLT_HOLE\"",
            "\"to\": \"BOLT_AT_BOLT_HOLD\"",
            "field `operators[0].to`",
        ),
        ("\"parameters\": [", "\"parameters\": [],\n\"x\": [", "unknown field"),
        ("\"count\"", "\"colour\": 1, \"count\"", "unknown field"),
        ("\"instances\": 5", "\"instances\": \"five\"", "field `operators[0]`: invalid type"),
    ];
    for (from, to, part) in cases {
        let message = broken(from, to);
        assert!(message.contains(part) && message.contains("d.json"), "{from}: {message}");
    }
    assert!(Domain::parse(b"{", "d").expect_err("cut").to_string().contains("line 1"));
    assert!(Domain::parse(b"", "d").is_err());
    assert!(Domain::parse(b"{}", "d").expect_err("empty").to_string().contains("format"));
    let cut = &text.as_bytes()[..text.len() / 2];
    assert!(Domain::parse(cut, "d").is_err());
}

/// Replaces the value at the JSON pointer `at` and returns the error message.
fn exchanged(text: &str, at: &str, value: Value) -> String {
    let mut file: Value = serde_json::from_str(text).expect("JSON");
    *file.pointer_mut(at).expect(at) = value;
    let refused = Domain::parse(file.to_string().as_bytes(), "d.json").expect_err(at).to_string();
    assert!(!refused.contains("struct") && !refused.contains("Entry"), "{at}: {refused}");
    refused
}

#[test]
fn what_has_to_be_an_object_is_nothing_else() {
    let text = domain().to_json().expect("plain data");
    let cases = [
        ("", "/provenance", "provenance"),
        ("", "/provenance/clusters/1", "provenance.clusters[1]"),
        ("", "/states/0", "states[0]"),
        ("", "/states/1/learned", "states[1].learned"),
        ("", "/states/1/learned/mean", "states[1].learned.mean"),
        ("", "/operators/2", "operators[2]"),
        ("", "/operators/2/parameters/0", "operators[2].parameters[0]"),
        ("", "/operators/2/evidence", "operators[2].evidence"),
        (VERSION_1, "/provenance", "provenance"),
        (VERSION_1, "/states/4", "states[4]"),
        (VERSION_1, "/states/4/mean", "states[4].mean"),
        (VERSION_1, "/operators/1", "operators[1]"),
        (VERSION_1, "/operators/1/evidence", "operators[1].evidence"),
    ];
    for (old, at, field) in cases {
        let text = if old.is_empty() { &text } else { old };
        let mut whole: Value = serde_json::from_str(text).expect("JSON");
        // Serde would accept the field values in order instead of the object.
        let object = whole.pointer_mut(at).expect(at).take();
        let values: Vec<Value> = object.as_object().expect("an object").values().cloned().collect();
        for bad in [json!(values), json!(7), json!("seven")] {
            let refused = exchanged(text, at, bad);
            let start = format!("d.json, field `{field}`: it is ");
            assert!(refused.starts_with(&start), "{refused}");
            assert!(refused.ends_with("expected an object"), "{refused}");
        }
    }
    let origin = exchanged(&text, "/states/0/learned/origin", json!({"found": null}));
    assert!(origin.contains("`states[0].learned.origin`: it is an object"), "{origin}");
    for list in ["[]", r#"["symbolt-domain", 2, null, null, [], []]"#] {
        let refused = Domain::parse(list.as_bytes(), "d.json").expect_err("a list").to_string();
        assert!(refused.starts_with("d.json: it is a list; expected an object"), "{refused}");
    }
}

#[test]
fn values_of_a_wrong_type_are_named_by_their_field() {
    let text = domain().to_json().expect("plain data");
    let cases = [
        ("", "/states", "states"),
        ("", "/states/3/kind", "states[3]"),
        ("", "/operators", "operators"),
        ("", "/operators/1/to", "operators[1]"),
        ("", "/goal", "goal"),
        ("", "/provenance/seed", "provenance"),
        (VERSION_1, "/states/3/count", "states[3]"),
        (VERSION_1, "/operators/1/kind", "operators[1]"),
    ];
    for (old, at, field) in cases {
        let text = if old.is_empty() { &text } else { old };
        let refused = exchanged(text, at, json!(-7.5));
        assert!(refused.contains(&format!("line 1, field `{field}`: invalid type")), "{refused}");
    }
    assert!(exchanged(&text, "/format", json!(1)).contains("field `format`: it is 1"));
    assert!(exchanged(&text, "/version", json!("2")).contains("field `version`: it is `2`"));
    // A duplicate field is an error, not silently dropped.
    let twice = text.replacen("\"goal\":", "\"goal\": null, \"goal\":", 1);
    let refused = Domain::parse(twice.as_bytes(), "d.json").expect_err("twice").to_string();
    assert!(refused.contains("duplicate field `goal`"), "{refused}");
}

#[test]
fn domains_that_contradict_themselves_are_refused() {
    let text = domain().to_json().expect("plain data");
    let object = json!({"name": "object", "kind": "nut"});
    let effect = {
        let file: Value = serde_json::from_str(&text).expect("JSON");
        file["operators"][0]["to"].clone()
    };
    let cases = [
        ("/operators/0/parameters", json!([]), "has no parameters"),
        ("/operators/0/parameters", json!([object, object]), "two parameters called `object`"),
        ("/operators/0/parameters/0/name", json!(""), "no name for parameter 1"),
        ("/operators/0/parameters/0/kind", json!("teapot"), "`teapot`, which has no state"),
        ("/operators/0/parameters/0/kind", json!(""), "which has no state"),
        (
            "/operators/0/removes",
            json!([effect]),
            "`BOLT_AT_BOLT_HOLE` in both `effects` and `removes`",
        ),
        ("/states/0/learned/covariance/0/0", json!(1e13), "1e13 in its covariance"),
        ("/states/0/learned/covariance/2/1", json!(-1e300), "-1e300 in its covariance"),
    ];
    for (at, value, part) in cases {
        let refused = exchanged(&text, at, value);
        assert!(refused.contains(part), "{at}: {refused}");
    }
}

/// A domain file written by version 0.1.0, learned from five demonstrations.
const VERSION_1: &str = include_str!("../fixtures/domain_v1.json");

#[test]
fn a_domain_of_version_1_is_read_and_written_as_version_2() {
    let old = Domain::parse(VERSION_1.as_bytes(), "old.json").expect("it is read");
    let state = &old[old.state("NUT_AT_NUT_POCKET").expect("there")];
    let raw: serde_json::Value = serde_json::from_str(VERSION_1).expect("JSON");
    let raw_state = raw["states"].as_array().expect("a list");
    let raw_state = raw_state.iter().find(|s| s["name"] == state.name).expect("there");
    let learned = state.learned.as_ref().expect("it was learned");
    assert_eq!(serde_json::json!(learned.mean), raw_state["mean"]);
    assert_eq!(serde_json::json!(learned.covariance), raw_state["covariance"]);
    assert_eq!(serde_json::json!(learned.distinct), raw_state["distinct"]);
    assert_eq!((old.states().len(), old.operators().len()), (5, 3));
    assert_eq!(old.goal_name(), raw["goal"].as_str());
    for (operator, raw) in old.operators().iter().zip(raw["operators"].as_array().expect("a list"))
    {
        assert_eq!(operator.name, raw["name"]);
        assert_eq!(operator.kind(), raw["kind"]);
        let lists = [
            ("preconditions", &operator.preconditions),
            ("effects", &operator.effects),
            ("absent", &operator.absent),
            ("removes", &operator.removes),
        ];
        for (key, list) in lists {
            assert_eq!(serde_json::json!(old.names(list)), raw[key], "{key}");
        }
        assert_eq!(serde_json::json!(operator.evidence), raw["evidence"]);
    }
    let new = old.to_json().expect("plain data");
    assert!(new.contains("\"version\": 2"));
    assert_eq!(Domain::parse(new.as_bytes(), "new.json").expect("it is read"), old);
    // Errors refer to the old layout.
    let broken = VERSION_1.replacen("\"distinct\"", "\"different\"", 1);
    let refused = Domain::parse(broken.as_bytes(), "old.json").expect_err("unknown field");
    assert!(refused.to_string().contains("unknown field `different`"), "{refused}");
}

#[test]
fn a_domain_written_in_code_has_no_geometry_and_grounds_nothing() {
    let domain = DomainBuilder::of_the_paper().build().expect("valid");
    let text = domain.to_json().expect("plain data");
    for fake in ["mean", "covariance", "evidence", "provenance", "count"] {
        assert!(!text.contains(fake), "{fake}");
    }
    assert_eq!(Domain::parse(text.as_bytes(), "d.json").expect("it is read"), domain);
    for rule in [Grounding::default(), Grounding::paper()] {
        let classifier = Classifier::new(&domain, rule).expect("valid");
        let grounded = classifier.classify(DomainBuilder::KIND, &Pose::at([0.0; 3]));
        assert_eq!((grounded.state, grounded.distance), (None, None));
    }
}

#[test]
fn a_person_can_rename_states_and_actions_and_nothing_else() {
    let domain = domain();
    let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    let renamed = domain
        .rename(&[
            pair("NUT_AT_START", "NUT_ON_TABLE"),
            pair("PUT_NUT_AT_NUT_POCKET", "PUT_NUT_IN_JIG"),
        ])
        .expect("renames");
    let nut = renamed.operators().iter().find(|o| o.name == "PUT_NUT_IN_JIG").expect("there");
    assert!(renamed.names(&nut.preconditions).contains(&"NUT_ON_TABLE"));
    assert!(!renamed.to_json().expect("plain data").contains("NUT_AT_START"));
    let refuse =
        |pairs: &[(String, String)]| domain.rename(pairs).expect_err("refused").to_string();
    assert!(refuse(&[pair("NUT_AT_STRAT", "X")]).contains("did you mean `NUT_AT_START`?"));
    assert!(refuse(&[pair("NUT_AT_START", "BOLT_AT_START")]).contains("is used twice"));
    assert!(refuse(&[pair("NUT_AT_START", "no good")]).contains("cannot be a name"));
    // Two names can be swapped.
    let swapped = domain
        .rename(&[pair("NUT_AT_START", "BOLT_AT_START"), pair("BOLT_AT_START", "NUT_AT_START")])
        .expect("swaps");
    assert_eq!(swapped.states().len(), domain.states().len());
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
        let _ = Domain::parse(&bytes, "x");
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
            let _ = learn(&recording, &Settings::default());
        }
        let mut text = domain().to_json().expect("plain data").into_bytes();
        for (index, value) in &changes {
            let at = index.index(text.len());
            text[at] = *value;
        }
        if let Ok(domain) = Domain::parse(&text, "x") {
            prop_assert!(!domain.states().is_empty());
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
            let _ = learn(&recording, &Settings::default());
        }
    }
}
