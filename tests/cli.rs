//! The command line, as a user and a script meet it.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "cli")]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;
use symbolt::task::DomainBuilder;

fn symbolt(folder: &Path, args: &[&str]) -> Output {
    Command::cargo_bin("symbolt")
        .expect("the program was built")
        .current_dir(folder)
        .args(args)
        .output()
        .expect("it starts")
}

struct Ran {
    code: i32,
    out: String,
    err: String,
}

fn run(folder: &Path, args: &[&str]) -> Ran {
    let output = symbolt(folder, args);
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

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("a folder")
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .collect();
    names.sort();
    names
}

#[test]
fn a_scene_that_cannot_be_is_refused_before_anything_is_done() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    ok(here, &["config", "--out", "cell.json"]);
    let cell = std::fs::read_to_string(here.join("cell.json")).expect("written");
    let wide = cell.replace("\"shaft_radius_m\": 0.008", "\"shaft_radius_m\": 0.02");
    assert_ne!(wide, cell);
    std::fs::write(here.join("wide.json"), wide).expect("written");
    let cases: [(&[&str], &str); 6] = [
        (&["run", "--config", "wide.json"], "wide.json, field `part.nut_hole_m`"),
        (&["record", "--config", "nowhere.json"], "cannot read nowhere.json"),
        (&["run", "--config", "cell.json", "--nuts", "100"], "`nuts` is 100; expected 1 to 4"),
        (&["run", "--nuts", "0"], "`nuts` is 0; expected 1 to 4"),
        (&["run", "--demo-bolts", "9"], "`bolts` is 9; expected 1 to 4"),
        (&["run", "--drop-rate", "2"], "`drop_rate` is 2; expected 0 to 1"),
    ];
    for (args, message) in cases {
        let ran = run(here, args);
        assert_eq!(ran.code, 2, "{args:?}: {}", ran.err);
        assert!(ran.err.contains(message), "{args:?}: {}", ran.err);
    }
    assert_eq!(files(here), ["cell.json", "wide.json"]);
    let scene = ok(here, &["record", "--scene", "--config", "cell.json"]);
    assert_eq!(scene, ok(here, &["record", "--scene"]));
}

/// A folder with a recording, a learned domain and a scene.
fn prepared() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    ok(
        folder.path(),
        &["record", "--kinematic", "--demos", "3", "--out", "demos.jsonl", "--quiet"],
    );
    ok(
        folder.path(),
        &["record", "--kinematic", "--scene", "--seed", "9", "--out", "scene.json", "--quiet"],
    );
    ok(folder.path(), &["learn", "demos.jsonl", "--out", "domain.json", "--quiet"]);
    folder
}

#[test]
fn without_a_command_the_main_job_runs_and_can_be_repeated() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = ok(folder.path(), &["--demos", "2"]);
    for part in ["5 states:", "3 actions:", "goal met", "1 of 1", "Wrote out/recording.jsonl"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let left = [
        "arrays.npz",
        "domain.json",
        "recording.jsonl",
        "report.html",
        "run.json",
        "scene.json",
        "trace.jsonl",
    ];
    assert_eq!(files(&folder.path().join("out")), left);
    let bytes = |name: &str| std::fs::read(folder.path().join("out").join(name)).expect("there");
    let before = left.map(bytes);
    // A folder that was named is not written over unasked.
    let refused = run(folder.path(), &["run", "--out", "out"]);
    assert_eq!(refused.code, 2);
    assert!(refused.err.contains("exists already"), "{}", refused.err);
    let found = json(folder.path(), &["--demos", "2", "--quiet", "--json", "--threads", "1"]);
    assert_eq!(left.map(bytes), before, "the same seed gives the same files in another process");
    for key in ["interval95", "minimum_steps", "false_goals", "drops", "replans", "failures"] {
        assert!(!found[key].is_null(), "{key} in {found}");
    }
    assert_eq!((&found["episodes"], &found["assembled"]), (&1.into(), &1.into()));
    for key in ["real_time_factor", "physics_real_time_factor"] {
        assert!(found[key].as_f64().is_some_and(|f| f > 0.0), "{key} in {found}");
    }
    for key in ["median", "p95"] {
        assert!(found["decision_ms"][key].as_f64().is_some_and(|ms| ms > 0.0), "{found}");
    }
    let mut kinds = BTreeSet::new();
    for line in String::from_utf8(bytes("trace.jsonl")).expect("text").lines() {
        let line: Value = serde_json::from_str(line).expect("JSON");
        kinds.extend(line.as_object().expect("an object").keys().cloned());
        if let Some(decision) = line.get("decision").filter(|d| d["begun"] == true) {
            assert_eq!(decision["skill"]["outcome"], "placed", "a decision owns its skill");
        }
    }
    let expected = ["decision", "end", "episode", "touch"].map(String::from);
    assert_eq!(kinds, BTreeSet::from(expected));
}

#[test]
fn learn_gives_the_promised_keys() {
    let folder = prepared();
    let found = json(folder.path(), &["learn", "demos.jsonl", "--json"]);
    let states = found["states"].as_array().expect("states");
    assert_eq!(states.len(), 5);
    for state in states {
        assert!(state["name"].is_string() && state["kind"].is_string() && state["count"].is_u64());
        assert_eq!(state["position"].as_array().map(Vec::len), Some(3));
        assert_eq!(state["spread"].as_array().map(Vec::len), Some(3));
    }
    let next = found["next_merge_m"]["bolt"].as_f64().expect("metres");
    assert!((0.0010..0.0016).contains(&next), "{next}");
    let operators = found["operators"].as_array().expect("operators");
    assert_eq!(operators.len(), 3);
    for key in ["name", "preconditions", "effects", "absent"] {
        assert!(operators.iter().all(|o| !o[key].is_null()), "{key}");
    }
    // Given a threshold, as in the paper; from standard input.
    let text = std::fs::read(folder.path().join("demos.jsonl")).expect("there");
    let output = Command::cargo_bin("symbolt")
        .expect("built")
        .args(["learn", "-", "--threshold", "0.001", "--json", "--quiet"])
        .write_stdin(text)
        .output()
        .expect("starts");
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(found["threshold_m"]["nut"], 0.001);
}

#[test]
fn classify_gives_a_line_for_every_object_of_a_recording_or_a_scene() {
    let folder = prepared();
    let text = ok(folder.path(), &["classify", "domain.json", "demos.jsonl", "--json"]);
    let lines: Vec<Value> = text.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert_eq!(lines.len(), 3 * 8 * 4);
    assert_eq!(lines[0]["demo"], 0);
    assert_eq!(lines[0]["snapshot"], 0);
    assert!(lines.iter().filter(|l| l["kind"] == "nut").all(|l| l["state"].is_string()));
    assert!(
        lines
            .iter()
            .filter(|l| l["kind"] == "bolt_hole")
            .all(|l| l["state"].is_null() && l["distance"].is_null())
    );
    let scene = ok(folder.path(), &["classify", "domain.json", "scene.json"]);
    assert!(scene.contains("NUT_AT_START") && scene.contains("none"), "{scene}");
}

#[test]
fn plan_says_what_to_do_and_when_it_knew() {
    let folder = prepared();
    let plan = json(folder.path(), &["plan", "domain.json", "--scene", "scene.json", "--json"]);
    assert_eq!(plan["status"], "act");
    assert_eq!(plan["plan"].as_array().map(Vec::len), Some(3));
    assert_eq!(plan["plan"][0], plan["action"]);
    assert_eq!(plan["plan"][2], "PUT_BOLT_AT_NUT_POCKET");
    assert!(plan["reason"].is_null());
    let milestones = plan["milestones_ms"].as_object().expect("milestones");
    assert!(milestones.len() >= 10);
    assert!(milestones.contains_key("01 preconditions BOLT_AT_NUT_POCKET"));
    let times: Vec<f64> = milestones.values().filter_map(Value::as_f64).collect();
    assert!(times.windows(2).all(|w| w[0] <= w[1]), "{times:?}");

    let args = ["plan", "domain.json", "--scene", "scene.json", "--goal", "NUT_AT_START", "--json"];
    assert_eq!(json(folder.path(), &args)["status"], "met");
    assert_eq!(plan["choices"], serde_json::json!([]));

    // With a second way of doing it, the choice is told.
    let text = std::fs::read_to_string(folder.path().join("domain.json")).expect("there");
    let mut domain: Value = serde_json::from_str(&text).expect("JSON");
    let mut other = domain["operators"][0].clone();
    let (state, first) = (other["to"].clone(), other["name"].clone());
    other["name"] = "ANOTHER_WAY".into();
    domain["operators"].as_array_mut().expect("operators").push(other);
    std::fs::write(folder.path().join("two_ways.json"), domain.to_string()).expect("writes");
    let args = ["plan", "two_ways.json", "--scene", "scene.json", "--json"];
    let choices = &json(folder.path(), &args)["choices"];
    assert_eq!(choices[0]["state"], state);
    assert_eq!((&choices[0]["action"], &choices[0]["among"]), (&first, &Value::from(2)));
    assert!(choices[0]["why"].as_str().is_some_and(|why| why.contains("preferred")));
    assert!(ok(folder.path(), &args[..4]).contains("Choices among several causes:"));

    // Without its bolt the scene is stuck: said in one sentence, and 1 returned.
    let text = std::fs::read_to_string(folder.path().join("scene.json")).expect("there");
    let mut scene: Value = serde_json::from_str(&text).expect("JSON");
    scene["objects"].as_array_mut().expect("objects").retain(|o| o["kind"] != "bolt");
    std::fs::write(folder.path().join("poor.json"), scene.to_string()).expect("writes");
    let stuck =
        run(folder.path(), &["plan", "domain.json", "--scene", "poor.json", "--json", "--quiet"]);
    assert_eq!(stuck.code, 1);
    let plan: Value = serde_json::from_str(&stuck.out).expect("JSON");
    assert_eq!(plan["status"], "stuck");
    assert_eq!(
        stuck.err.trim_end(),
        "symbolt: stuck: BOLT_AT_START does not hold and no action brings it about"
    );
}

#[test]
fn a_plan_made_by_spiking_neurons_says_that_its_mode_is_lif() {
    let folder = prepared();
    let args = ["plan", "domain.json", "--scene", "scene.json", "--json", "--mode"];
    for mode in ["direct", "rate", "lif"] {
        let plan = json(folder.path(), &[&args[..], &[mode]].concat());
        assert_eq!((plan["mode"].as_str(), plan["status"].as_str()), (Some(mode), Some("act")));
    }
}

#[test]
fn rename_and_check_serve_a_person() {
    let folder = prepared();
    let text = ok(
        folder.path(),
        &["rename", "domain.json", "NUT_AT_START=NUT_ON_TABLE", "--out", "named.json"],
    );
    assert!(text.contains("NUT_ON_TABLE"));
    assert!(ok(folder.path(), &["check", "named.json"]).contains("a valid domain"));
    assert!(ok(folder.path(), &["check", "demos.jsonl"]).contains("a valid recording"));
    assert!(ok(folder.path(), &["check", "scene.json"]).contains("a valid scene"));
    // In place.
    ok(folder.path(), &["rename", "named.json", "NUT_ON_TABLE=NUT_FREE", "--quiet"]);
    let named = std::fs::read_to_string(folder.path().join("named.json")).expect("there");
    assert!(named.contains("NUT_FREE") && !named.contains("NUT_ON_TABLE"));
    let refused = run(folder.path(), &["rename", "named.json", "NUT_FREE"]);
    assert_eq!(refused.code, 2);
    assert!(refused.err.contains("expected OLD=NEW"));
}

#[test]
fn of_a_domain_written_in_code_only_what_it_has_is_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = DomainBuilder::new().action("BREW", ["WATER"], ["TEA"]).build().expect("valid");
    let text = domain.to_json().expect("plain data");
    std::fs::write(folder.path().join("tea.json"), text).expect("writes");
    let args = ["rename", "tea.json", "TEA=COFFEE", "--out", "coffee.json"];
    let printed = ok(folder.path(), &args);
    let expected = "2 states:\n\n\
                    | state  | kind   |\n\
                    |--------|--------|\n\
                    | WATER  | object |\n\
                    | COFFEE | object |\n\n\
                    1 action:\n\n\
                    | action | needs | brings about |\n\
                    |--------|-------|--------------|\n\
                    | BREW   | WATER | COFFEE       |\n\n";
    assert_eq!(printed, expected);
}

#[test]
fn bad_usage_and_bad_input_return_2_and_leave_nothing_behind() {
    let folder = prepared();
    let path = folder.path();
    let before = files(path);
    let write = |name: &str, text: &[u8]| std::fs::write(path.join(name), text).expect("writes");
    let good = std::fs::read(path.join("demos.jsonl")).expect("there");
    write("cut.jsonl", &good[..good.len() - 40]);
    write("bytes.jsonl", &[0xFF, 0xFE, 0x00]);
    write(
        "old.json",
        &std::fs::read_to_string(path.join("domain.json"))
            .expect("there")
            .replace("\"version\": 2", "\"version\": 7")
            .into_bytes(),
    );
    let cases: [(&[&str], &str); 25] = [
        (&["learn", "missing.jsonl", "--out", "x.json"], "missing.jsonl"),
        (&["learn", "cut.jsonl", "--out", "x.json"], "cut.jsonl, line 24"),
        (&["learn", "bytes.jsonl", "--out", "x.json"], "not UTF-8"),
        (&["learn", "scene.json", "--out", "x.json"], "field `demo`"),
        (&["learn", "demos.jsonl", "--p", "0", "--out", "x.json"], "`p` is 0"),
        (&["learn", "demos.jsonl", "--threshold=-1", "--out", "x.json"], "`threshold` is -1"),
        (&["learn", "demos.jsonl", "--out", "domain.json"], "exists already"),
        (&["plan", "old.json", "--scene", "scene.json"], "it is 7"),
        (&["plan", "domain.json", "--scene", "demos.jsonl"], "more than one snapshot"),
        (
            &["plan", "domain.json", "--scene", "scene.json", "--goal", "NUT"],
            "it has: BOLT_AT_START",
        ),
        (&["plan", "domain.json", "--scene", "scene.json", "--dimensions", "0"], "0 dimensions"),
        (
            &["plan", "domain.json", "--scene", "scene.json", "--dimensions", "4"],
            "use more dimensions",
        ),
        (
            &["plan", "domain.json", "--scene", "scene.json", "--mode", "liff"],
            "the modes are: direct",
        ),
        (&["run", "--demos", "0", "--out", "new"], "--demos is 0"),
        (
            &["run", "--film", "2", "--out", "new"],
            "--record-episode is 2; 1 to 1 (--episodes) exist",
        ),
        (&["run", "--nuts", "100", "--out", "new"], "`nuts` is 100"),
        (&["run", "--drop-rate", "2", "--out", "new"], "`drop_rate` is 2"),
        (&["classify", "domain.json", "demos.jsonl", "--limit", "0"], "`limit` is 0"),
        (&["experiment", "table-5"], "there is no experiment `table-5`"),
        (&["experiment", "table-4", "--shard", "3/2"], "`shard` is 3/2"),
        (&["experiment", "table-4", "--trials", "0"], "`trials` is 0"),
        (&["bench", "bind", "--load", "domain.json"], "symbolt-solved"),
        (&["bench", "bind", "--mode", "direct", "--save", "new"], "no populations"),
        (&["bench", "select", "--save", "domain.json"], "exists already"),
        (&["bench", "bind", "--unbinding", "guess"], "products, fixed"),
    ];
    for (args, part) in cases {
        let ran = run(path, args);
        assert_eq!(ran.code, 2, "{args:?}: {} {}", ran.out, ran.err);
        assert!(ran.err.contains(part), "{args:?}: {part} in {}", ran.err);
    }
    let mut after = files(path);
    after.retain(|f| !["cut.jsonl", "bytes.jsonl", "old.json"].contains(&f.as_str()));
    assert_eq!(after, before);
}

#[test]
fn an_output_that_cannot_be_written_fails_with_1_and_leaves_nothing() {
    let folder = prepared();
    let ran =
        run(folder.path(), &["learn", "demos.jsonl", "--out", "no/such/folder/x.json", "--quiet"]);
    assert_eq!(ran.code, 1, "{}", ran.err);
    assert!(ran.err.contains("cannot write no/such/folder/x.json"), "{}", ran.err);
    assert!(!folder.path().join("no").exists());
}

#[test]
fn progress_goes_to_standard_error_and_can_be_turned_off() {
    let folder = prepared();
    let loud = run(folder.path(), &["learn", "demos.jsonl", "--json"]);
    assert!(loud.err.contains("clustering") && !loud.out.contains("clustering"));
    let quiet =
        run(folder.path(), &["learn", "demos.jsonl", "--json", "--quiet", "--threads", "1"]);
    assert_eq!(quiet.err, "");
    assert_eq!(quiet.out, loud.out, "threads change nothing");
}

#[test]
fn help_version_and_completions_are_there() {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(ok(folder.path(), &["--version"]).starts_with("symbolt "));
    assert!(ok(folder.path(), &["--help"]).contains("classify"));
    assert!(ok(folder.path(), &["completions", "bash"]).contains("_symbolt"));
    assert!(files(folder.path()).is_empty());
}
