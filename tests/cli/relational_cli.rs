//! The command line on domains whose states lie in the frames of objects.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "cli")]

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;
use symbolt::robot::Pose;
use symbolt::sim::Seed;
use symbolt::study::worlds;
use symbolt::task::{Attribute, Attributes, Recording, Snapshot};

use crate::beside;

/// Kinds of the world `sorting` that become one kind with an attribute.
const SORTED: [&str; 2] = ["screw", "washer"];

struct Ran {
    code: i32,
    out: String,
    err: String,
}

fn run(folder: &Path, args: &[&str]) -> Ran {
    let output = Command::cargo_bin("symbolt")
        .expect("the program was built")
        .current_dir(folder)
        .args(args)
        .output()
        .expect("it starts");
    Ran {
        code: output.status.code().unwrap_or(-1),
        out: String::from_utf8_lossy(&output.stdout).into(),
        err: String::from_utf8_lossy(&output.stderr).into(),
    }
}

fn ok(folder: &Path, args: &[&str]) -> String {
    let ran = run(folder, args);
    assert_eq!(ran.code, 0, "{args:?}: {}", ran.err);
    ran.out
}

fn json(folder: &Path, args: &[&str]) -> Value {
    serde_json::from_str(&ok(folder, args)).expect("one JSON object")
}

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

/// A scene that was not demonstrated: the first snapshot of another demonstration.
fn scene() -> Snapshot {
    let mut others: Recording = beside::recording(9, 2);
    let mut scene = others.demos.remove(8).snapshots.remove(0);
    (scene.event, scene.time_s) = (None, None);
    scene
}

fn write(folder: &Path, name: &str, scene: &Snapshot) {
    std::fs::write(folder.join(name), scene.to_json().expect("plain data")).expect("writes");
}

/// A folder with demonstrations of cups beside plates, the learned domain and a scene.
fn prepared() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let text = beside::recording(6, 2).to_jsonl(None).expect("plain data");
    std::fs::write(path.join("cups.jsonl"), text).expect("writes");
    write(path, "scene.json", &scene());
    ok(path, &["learn", "cups.jsonl", "--out", "domain.json", "--quiet"]);
    folder
}

#[test]
fn learn_tells_frames_places_parameters_conditions_and_goals() {
    let folder = prepared();
    let found = json(folder.path(), &["learn", "cups.jsonl", "--json", "--quiet"]);
    let states = found["states"].as_array().expect("states");
    let beside = states.iter().find(|s| s["frame"] == "plate").expect("a state beside a plate");
    assert_eq!(
        (beside["kind"].as_str(), beside["name"].as_str()),
        (Some("cup"), Some("CUP_AT_PLATE"))
    );
    for (axis, expected) in beside::BESIDE.iter().enumerate() {
        for value in [&beside["position"][axis], &beside["places"][0]["position"][axis]] {
            assert!((value.as_f64().expect("metres") - expected).abs() < 1e-6, "{beside}");
        }
        assert!(beside["spread"][axis].as_f64().expect("metres") < 1e-6, "{beside}");
    }
    assert_eq!(beside["places"][0]["orientation"].as_array().map(Vec::len), Some(4));
    assert_eq!(beside["count"], 12);
    assert!(states.iter().any(|s| s["frame"] == "world" && s["name"] == "CUP_AT_START"));
    assert!(states.iter().all(|s| ["free", "axis", "full"].contains(&s["turn"].as_str().unwrap())));

    let operators = found["operators"].as_array().expect("operators");
    assert_eq!(operators.len(), 1);
    let put = &operators[0];
    assert_eq!(put["name"], "PUT_CUP_AT_PLATE");
    assert_eq!((&put["from"], &put["to"]), (&"CUP_AT_START".into(), &beside["name"]));
    assert_eq!(put["preconditions"], serde_json::json!(["CUP_AT_START"]));
    assert_eq!(put["effects"], serde_json::json!(["CUP_AT_PLATE"]));
    let parameters = serde_json::json!([
        {"name": "object", "kind": "cup"}, {"name": "target", "kind": "plate"},
    ]);
    assert_eq!(put["parameters"], parameters);
    for key in ["absent", "undecided", "never_seen", "needs", "side_effects"] {
        assert!(put[key].is_array(), "{key} in {put}");
    }
    assert!(put["needs_count"].is_object(), "{put}");
    for need in put["needs"].as_array().expect("needs") {
        assert!(need["reason"].as_str().is_some_and(|r| r.contains(" of 12)")), "{need}");
    }
    let goals = found["goals"].as_array().expect("goals");
    assert_eq!(goals.len(), 1);
    assert_eq!((&goals[0]["state"], &goals[0]["each"]), (&beside["name"], &"plate".into()));
    assert_eq!(goals[0]["at_least"], 1);
    assert_eq!(found["goal"], beside["name"]);
    // The clustering of the paper is still told.
    assert!(found["next_merge_m"].is_object() && found["threshold_m"].is_object());

    let text = ok(folder.path(), &["learn", "cups.jsonl", "--quiet"]);
    for part in ["| plate |", "a cup is beside a plate", "a cup is beside each plate", "6 of 6"] {
        assert!(text.replace('\n', " ").contains(part), "{part} in {text}");
    }
    // The learner of the paper knows one frame only.
    let paper = run(folder.path(), &["learn", "cups.jsonl", "--quiet", "--method", "paper"]);
    assert_eq!(paper.code, 1, "{}", paper.out);
    assert!(paper.err.contains("no action was learned"), "{}", paper.err);
}

#[test]
fn classify_tells_the_reference_and_keeps_states_along_a_demonstration() {
    let folder = prepared();
    let all = lines(&ok(folder.path(), &["classify", "domain.json", "cups.jsonl", "--json"]));
    assert_eq!(all.len(), 6 * 6 * 4);
    let last = |id: &str| {
        let mut own = all.iter().filter(|l| l["demo"] == 2 && l["id"] == id);
        own.next_back().expect("lines").clone()
    };
    for cup in 0..2 {
        let line = last(&format!("cup_{cup}"));
        assert_eq!(line["state"], "CUP_AT_PLATE");
        assert_eq!(line["reference"], format!("plate_{cup}").as_str());
        assert_eq!((&line["place"], &line["ambiguous"]), (&0.into(), &false.into()));
    }
    let plate = last("plate_0");
    assert!(
        plate["state"].is_null() && plate["distance"].is_null() && plate["reference"].is_null()
    );
    let table = ok(folder.path(), &["classify", "domain.json", "scene.json"]);
    assert!(table.contains("cup 0 is in its start area"), "{table}");
}

#[test]
fn plan_says_which_object_onto_what_and_the_target_pose() {
    let folder = prepared();
    let plan = json(folder.path(), &["plan", "domain.json", "--scene", "scene.json", "--json"]);
    assert_eq!((&plan["status"], &plan["action"]), (&"act".into(), &"PUT_CUP_AT_PLATE".into()));
    assert_eq!(plan["plan"], serde_json::json!(["PUT_CUP_AT_PLATE", "PUT_CUP_AT_PLATE"]));
    assert_eq!((&plan["plan_end"], &plan["planner"]), (&"met".into(), &"goal-sets".into()));
    assert!(plan["reason"].is_null());
    let milestones = plan["milestones_ms"].as_object().expect("milestones");
    assert!(milestones.len() >= 5 && milestones.contains_key("01 costs all goals"), "{plan}");
    // Operators are named, not the longer ground actions.
    let sets: Vec<_> = milestones.keys().filter_map(|key| key.split_once("goal set ")).collect();
    assert!(sets.len() >= 2 && sets.iter().all(|(_, of)| *of == "PUT_CUP_AT_PLATE"), "{plan}");
    let onto = plan["onto"].as_str().expect("a plate");
    let scene = scene();
    let plate = scene.objects.iter().find(|o| &*o.id == onto).expect("of the scene");
    let target: Pose = beside::beside(&plate.pose);
    for axis in 0..3 {
        let at = plan["target"]["position"][axis].as_f64().expect("metres");
        assert!((at - target.position[axis]).abs() < 1e-3, "{plan} instead of {target:?}");
    }
    assert_eq!(plan["target"]["orientation"].as_array().map(Vec::len), Some(4));
    assert!(scene.objects.iter().any(|o| plan["object"] == *o.id && &*o.kind == "cup"));
    let onto: Vec<&Value> = plan["steps"].as_array().unwrap().iter().map(|s| &s["onto"]).collect();
    assert_ne!(onto[0], onto[1], "a cup beside each plate");

    let text = ok(folder.path(), &["plan", "domain.json", "--scene", "scene.json"]);
    for part in ["put cup ", " beside plate ", "Whole plan, until the goal is met"] {
        assert!(text.replace("\n       ", " ").contains(part), "{part} in {text}");
    }
    // One plate is enough for a goal that the user names.
    let one = ["plan", "domain.json", "--scene", "scene.json", "--goal", "CUP_AT_PLATE", "--json"];
    assert_eq!(json(folder.path(), &one)["plan"].as_array().map(Vec::len), Some(1));
    // What holds is met, even if no action achieves it.
    let met = ["plan", "domain.json", "--scene", "scene.json", "--goal", "CUP_AT_START", "--json"];
    assert_eq!(json(folder.path(), &met)["status"], "met");
}

#[test]
fn actions_lists_every_move_that_is_possible() {
    let folder = prepared();
    let all =
        lines(&ok(folder.path(), &["actions", "domain.json", "--scene", "scene.json", "--json"]));
    assert_eq!(all.len(), 4, "two cups to two plates");
    for line in &all {
        assert_eq!(line["action"], "PUT_CUP_AT_PLATE");
        assert!(line["object"].as_str().unwrap().starts_with("cup_"));
        assert!(line["onto"].as_str().unwrap().starts_with("plate_"));
        assert_eq!(line["target"]["position"].as_array().map(Vec::len), Some(3));
        assert!(line["decided"].is_boolean());
    }
    let table = ok(folder.path(), &["actions", "domain.json", "--scene", "scene.json"]);
    assert!(table.contains("beside plate 1") && table.contains("target"), "{table}");
    // A file of an old version is converted.
    std::fs::write(folder.path().join("old.json"), include_str!("../fixtures/domain_v1.json"))
        .unwrap();
    ok(folder.path(), &["record", "--kinematic", "--scene", "--out", "nuts.json", "--quiet"]);
    let old = lines(&ok(folder.path(), &["actions", "old.json", "--scene", "nuts.json", "--json"]));
    assert!(old.iter().any(|line| line["action"] == "PUT_NUT_AT_NUT_POCKET"), "{old:?}");
    assert!(old.iter().all(|line| line["onto"].is_null()), "{old:?}");
}

#[test]
fn scenes_that_do_not_fit_get_one_clear_sentence() {
    let folder = prepared();
    let path = folder.path();
    let stuck = |name: &str, scene: &Snapshot, args: &[&str], sentence: &str| {
        write(path, name, scene);
        let plan = ["plan", "domain.json", "--scene", name, "--quiet", "--json"];
        let ran = run(path, &[&plan[..], args].concat());
        assert_eq!(ran.code, 1, "{name}: {} {}", ran.out, ran.err);
        let plan: Value = serde_json::from_str(&ran.out).expect("JSON");
        assert_eq!(plan["status"], "stuck", "{plan}");
        assert!(ran.err.starts_with("symbolt: stuck: "), "{}", ran.err);
        assert!(ran.err.contains(sentence), "{sentence} in {}", ran.err);
        assert_eq!(ran.err.lines().count(), 1, "{}", ran.err);
    };
    let without = |kind: &str, kept: usize| {
        let mut scene = scene();
        let mut seen = 0;
        scene.objects.retain(|o| {
            seen += usize::from(&*o.kind == kind);
            &*o.kind != kind || seen <= kept
        });
        scene
    };
    stuck("no_plates.json", &without("plate", 0), &[], "relative to a `plate`");
    stuck("no_cups.json", &without("cup", 0), &[], "2 of CUP_AT_PLATE");
    stuck("one_cup.json", &without("cup", 1), &[], "2 of CUP_AT_PLATE");
    let mut away = scene();
    for object in away.objects.iter_mut().filter(|o| &*o.kind == "cup") {
        object.pose.position[2] = 2.0;
    }
    write(path, "away.json", &away);
    let ran = run(path, &["plan", "domain.json", "--scene", "away.json", "--quiet"]);
    assert_eq!(ran.code, 1);
    let said = ran.out.split_whitespace().collect::<Vec<_>>().join(" ");
    for cup in ["cup 0", "cup 1"] {
        let sentence = format!("{cup} (nearest: {cup} is in its start area, 1970.0 mm too high)");
        assert!(said.contains("In no state: ") && said.contains(&sentence), "{}", ran.out);
    }
    let goal = ["--goal", "CUP_AT_START"];
    stuck(
        "away.json",
        &away,
        &goal,
        "no action achieves CUP_AT_START; the actions achieve: CUP_AT_PLATE",
    );

    // Two plates face each other with a cup in the middle.
    let mut between = scene();
    let plate = between.objects.iter().position(|o| &*o.id == "plate_0").unwrap();
    let other = between.objects.iter().position(|o| &*o.id == "plate_1").unwrap();
    let cup = between.objects.iter().position(|o| &*o.id == "cup_0").unwrap();
    let at = |x: f64, y: f64, orientation: [f64; 4]| Pose { position: [x, y, 0.01], orientation };
    between.objects[plate].pose = at(0.2, 0.3, [0.0, 0.0, 0.0, 1.0]);
    between.objects[cup].pose = beside::beside(&between.objects[plate].pose);
    let [x, y, _] = beside::BESIDE;
    between.objects[other].pose = at(0.2 + 2.0 * x, 0.3 + 2.0 * y, [0.0, 0.0, 1.0, 0.0]);
    write(path, "between.json", &between);
    let ran = run(path, &["plan", "domain.json", "--scene", "between.json", "--quiet"]);
    assert!(
        ran.err.contains(
            "cup 0 is beside plate 0, or at plate 1, which is equally near; plate 0 is taken"
        ),
        "{}",
        ran.err
    );
    let found = lines(&ok(path, &["classify", "domain.json", "between.json", "--json"]));
    assert_eq!(found[cup]["ambiguous"], true, "{found:?}");
}

#[test]
fn every_task_has_settings_a_scene_and_a_check() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let listed = lines(&ok(path, &["run", "--task", "--json"]));
    assert!(listed.len() >= 3, "{listed:?}");
    assert_eq!(listed[0]["name"], "nuts-and-bolts");
    for task in &listed {
        let name = task["name"].as_str().expect("a name");
        assert!(task["description"].as_str().is_some_and(|d| d.len() > 10));
        let file = format!("{name}.json");
        ok(path, &["config", "--task", name, "--out", &file]);
        let checked = ok(path, &["check", &file]);
        assert!(checked.contains("a valid "), "{checked}");
        let own = ["record", "--scene", "--task", name, "--config", &file];
        assert_eq!(ok(path, &own), ok(path, &["record", "--scene", "--task", name]), "{name}");
    }
    let table = ok(path, &["record", "--task"]);
    assert!(table.contains("| task ") && table.contains("| nuts-and-bolts"), "{table}");
}

#[test]
fn sensing_errors_are_added_to_recordings_and_repeatable() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let plain = ["record", "--kinematic", "--demos", "2", "--quiet"];
    let noisy =
        [&plain[..], &["--pose-noise", "2,3", "--missing", "0.2", "--swaps", "0.1"]].concat();
    let exact = ok(path, &plain);
    let first = ok(path, &noisy);
    assert_ne!(first, exact);
    assert_eq!(ok(path, &noisy), first);
    let count = |text: &str| text.matches("\"id\"").count();
    let (all, seen) = (count(&exact), count(&first));
    assert!(seen < all && seen > all / 2, "{seen} of {all} objects are seen");
    assert_eq!(ok(path, &[&plain[..], &["--pose-noise", "0,0"]].concat()), exact);
    let scene = ok(path, &["record", "--scene", "--kinematic", "--outliers", "1"]);
    assert_ne!(scene, ok(path, &["record", "--scene", "--kinematic"]));
}

#[test]
fn a_recording_in_millimetres_is_doubted_and_still_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let mut recording = worlds::named("tower").expect("a world").record(5, Seed::new(1));
    let write = |recording: &Recording| {
        let text = recording.to_jsonl(None).expect("text");
        std::fs::write(path.join("demos.jsonl"), text).expect("a file");
    };
    write(&recording);
    let sound: Value =
        serde_json::from_str(&ok(path, &["check", "demos.jsonl", "--json"])).unwrap();
    assert_eq!(sound["warnings"], Value::Array(Vec::new()));
    for object in
        recording.demos.iter_mut().flat_map(|d| &mut d.snapshots).flat_map(|s| &mut s.objects)
    {
        object.pose.position = object.pose.position.map(|metres| 1e3 * metres);
    }
    write(&recording);
    for args in [&["check", "demos.jsonl", "--json"][..], &["learn", "demos.jsonl", "--json"]] {
        let ran = run(path, args);
        assert_eq!(ran.code, 0, "{}", ran.err);
        let found: Value = serde_json::from_str(&ran.out).expect("JSON");
        let warning = &found["warnings"][0];
        assert_eq!(warning["kind"], "length_unit");
        for key in ["place", "seen", "reading", "ask"] {
            assert!(warning[key].is_string(), "{warning}");
        }
        assert!(ran.err.contains("warning: the scene is") && ran.err.contains("mm"), "{}", ran.err);
    }
    // The counts stay as they were.
    let text = run(path, &["check", "demos.jsonl"]).out;
    assert!(
        text.contains("a valid recording: 5 demonstrations") && !text.contains("warnings"),
        "{text}"
    );
}

#[test]
fn escape_codes_in_ids_do_not_reach_the_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let mut recording = worlds::named("tower").expect("a world").record(5, Seed::new(1));
    for object in recording.demos.iter_mut().flat_map(|d| &mut d.snapshots[0].objects) {
        object.pose = Pose::at([0.0; 3]);
    }
    for snapshot in recording.demos.iter_mut().flat_map(|d| &mut d.snapshots) {
        for object in &mut snapshot.objects {
            object.id = format!("{}\u{1b}[2J", object.id).into();
            object.kind = format!("{}\u{1b}[2J", object.kind).into();
        }
    }
    std::fs::write(path.join("demos.jsonl"), recording.to_jsonl(None).expect("text"))
        .expect("a file");
    for command in ["check", "learn"] {
        let ran = run(path, &[command, "demos.jsonl"]);
        assert_eq!(ran.code, 2, "{command}");
        assert!(ran.err.contains("\\u{1b}[2J` has a control character"), "{command}: {}", ran.err);
        assert!(!(ran.err + &ran.out).contains('\u{1b}'), "{command}");
    }
}

#[test]
fn objects_of_one_kind_are_sorted_by_an_attribute() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let world = worlds::named("sorting").expect("a world");
    let mixed = |seed: u64, demos: usize| {
        let mut recording = world.record(demos, Seed::new(seed));
        let mut attributes = Attributes::default();
        for (d, demo) in recording.demos.iter_mut().enumerate() {
            for object in demo.snapshots.iter_mut().flat_map(|s| &mut s.objects) {
                if SORTED.contains(&&*object.kind) {
                    let colour = Attribute::Word(object.kind.to_string());
                    attributes.set(d, &object.id, "colour", colour);
                    object.kind = "part".into();
                }
            }
        }
        recording.to_jsonl_attributed(None, &attributes).expect("text")
    };
    std::fs::write(path.join("demos.jsonl"), mixed(1, 5)).expect("a file");
    let said = ok(path, &["learn", "demos.jsonl", "--out", "domain.json"]);
    assert!(said.contains("Kinds divided by an attribute") && said.contains("colour"), "{said}");
    // One part of the second demonstration has no colour. That is said, and said once.
    let without = |line: &str| {
        let mut line: Value = serde_json::from_str(line).expect("JSON");
        let second = line["demo"] == 1;
        let objects = line["objects"].as_array_mut().expect("objects").iter_mut();
        if let Some(part) =
            objects.filter(|o| second && o["kind"] == "part").min_by_key(|o| o["id"].to_string())
        {
            part.as_object_mut().expect("an object").remove("attributes");
        }
        line.to_string()
    };
    let lacking: Vec<String> = mixed(1, 5).lines().map(without).collect();
    std::fs::write(path.join("lacking.jsonl"), lacking.join("\n")).expect("a file");
    let ran = run(path, &["learn", "lacking.jsonl"]);
    let said = format!("{}{}", ran.out, ran.err).split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(said.matches("`colour` would divide `part`").count(), 1, "{said}");
    let found: Value =
        serde_json::from_str(&ok(path, &["learn", "lacking.jsonl", "--json"])).expect("JSON");
    let remarks = found["remarks"].as_array().expect("remarks");
    let would = remarks.iter().find(|remark| remark["kind"] == "would_divide").expect("a remark");
    assert!(would["text"].as_str().expect("a text").contains("lacks it"), "{would}");
    let scene = mixed(9, 1).lines().next().expect("a line").to_owned();
    std::fs::write(path.join("scene.json"), &scene).expect("a file");
    let states = ok(path, &["classify", "domain.json", "scene.json", "--json"]);
    let parts = states.lines().filter(|line| line.contains("\"kind\":\"part_"));
    assert!(parts.count() >= 4, "{states}");
    let plan = ok(path, &["plan", "domain.json", "--scene", "scene.json", "--json"]);
    let plan: Value = serde_json::from_str(&plan).expect("JSON");
    assert_eq!(plan["status"], "act", "{plan}");
    let unseen = scene.replacen(&format!("\"{}\"", SORTED[0]), "\"green\"", 1);
    std::fs::write(path.join("scene.json"), unseen).expect("a file");
    let ran = run(path, &["actions", "domain.json", "--scene", "scene.json"]);
    assert!(ran.err.contains("is divided by `colour`"), "{}", ran.err);
    let ran = run(path, &["classify", "domain.json", "scene.json"]);
    assert!(ran.err.contains("is divided by `colour`"), "{}", ran.err);
}
