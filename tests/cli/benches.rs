//! `symbolt bench`: its figures, and comparisons with earlier results and other programs.

#![cfg(all(unix, feature = "cli"))]

use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};

const SELECT: [&str; 8] =
    ["bench", "select", "--sim-seconds", "0.3", "--neurons-scale", "0.2", "--quiet", "--json"];

/// Runs the program. Returns its exit code, its output and what it says.
fn run(folder: &Path, args: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_symbolt"));
    let output = command.args(args).current_dir(folder).stdin(Stdio::null()).output();
    let output = output.expect("it starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// The figures of a small network, measured four times.
fn measured(folder: &Path) -> Value {
    let (code, out, err) = run(folder, &[&SELECT[..], &["--runs", "4"]].concat());
    assert_eq!(code, Some(0), "{err}");
    serde_json::from_str(&out).expect("JSON")
}

#[test]
fn figures_have_the_work_of_a_neuron_and_the_share_of_the_limit() {
    let place = tempfile::tempdir().expect("a folder");
    let figures = measured(place.path());
    let number = |key: &str| figures.pointer(key).and_then(Value::as_f64).expect("a number");
    let runs = figures["wall_per_sim_s_of_runs"].as_array().expect("a list").len();
    assert_eq!((runs, number("/neurons_scale")), (4, 0.2));
    let share = number("/visited_share");
    assert!(share > 0.2 && share <= 1.0, "{share}");
    // Scalar ensembles: 16 bytes are read and 8 written and read of each neuron at most, but for padding and values.
    let bytes = number("/bytes_per_neuron_step");
    assert!(bytes > 8.0 && bytes < 60.0, "{bytes}");
    let operations = number("/operations_per_neuron_step");
    assert!(operations > 38.0 * share && operations < 100.0 * share, "{operations}");
    for key in ["gb_per_s", "gop_per_s", "ns_per_neuron_step", "share"] {
        let value = number(&format!("/limit/{key}"));
        assert!(value.is_finite() && value > 0.0, "{key}: {value}");
    }
    assert!(["memory", "arithmetic"].map(Value::from).contains(&figures["limit"]["by"]));
    assert_eq!(figures["bits"].as_str().map(str::len), Some(16));
    // Without neurons there is no such work.
    let (_, out, _) = run(place.path(), &[&SELECT[..], &["--mode", "direct"]].concat());
    let direct: Value = serde_json::from_str(&out).expect("JSON");
    assert!(direct["limit"].is_null() && direct["bytes_per_neuron_step"].is_null(), "{direct}");
}

#[test]
fn a_result_is_compared_in_speed_and_results() {
    let place = tempfile::tempdir().expect("a folder");
    let figures = measured(place.path());
    let against = |change: &dyn Fn(&mut Value)| {
        let mut earlier = figures.clone();
        change(&mut earlier);
        std::fs::write(place.path().join("earlier.json"), earlier.to_string()).expect("writes");
        let args = [&SELECT[..], &["--runs", "4", "--compare", "earlier.json"]].concat();
        let (code, out, err) = run(place.path(), &args);
        let sentence = serde_json::from_str(&out).map_or_else(
            |_| err.clone(),
            |out: Value| out["sentence"].as_str().unwrap_or_default().to_owned(),
        );
        (code, sentence)
    };
    let runs =
        |time: f64| move |value: &mut Value| value["wall_per_sim_s_of_runs"] = json!(vec![time; 4]);
    let (code, said) = against(&runs(1e-9));
    assert!(said.starts_with("run: slower by ") && said.ends_with("the same bits"), "{said}");
    assert_eq!(code, Some(1));
    let (code, said) = against(&runs(1e9));
    assert_eq!((code, &*said), (Some(0), "run: faster by 100%; results: the same bits"));
    let (code, said) = against(&|value| {
        runs(1e9)(value);
        value["quality"]["settled_ms"] = json!(7.0);
        value["bits"] = json!("0");
    });
    assert_eq!((code, &*said), (Some(1), "run: faster by 100%; results: other settled_ms"));
    let (code, said) = against(&|value| {
        runs(1e9)(value);
        value["bits"] = json!("0");
    });
    let expected = "run: faster by 100%; results: other bits, the same figures";
    assert_eq!((code, &*said), (Some(1), expected));
    // Names that only the result has may be anything: they are counted.
    let (code, said) = against(&|value| {
        runs(1e9)(value);
        value["quality"]["\u{1b}[31m\u{202e}"] = json!(7.0);
    });
    let expected = "run: faster by 100%; results: other 1 unknown figure";
    assert_eq!((code, &*said), (Some(1), expected));
    let mut earlier = figures.clone();
    earlier["limit"]["gop_per_s"] = json!(1e6);
    std::fs::write(place.path().join("fast.json"), earlier.to_string()).expect("writes");
    let args = [&SELECT[..], &["--runs", "4", "--compare", "fast.json"]].concat();
    let (_, _, err) = run(place.path(), &args);
    assert!(err.contains("operations/s now and did 1000000.0 then"), "{err}");
    // What cannot be compared: each with one sentence.
    for (key, value, expected) in [
        ("machine", json!("a laptop"), "its `machine` is \"a laptop\", here it is \""),
        ("model", json!("bind"), "its `model` is \"bind\", here it is \"select\""),
        ("neurons_scale", json!(1.0), "its `neurons_scale` is 1.0, here it is 0.2"),
        ("seed", json!(3), "its `seed` is 3, here it is 1"),
        ("machine", Value::Null, "an earlier symbolt, which does not tell `machine`"),
        ("wall_per_sim_s_of_runs", json!([1.0]), "has the times of 1 runs, and --runs is 4"),
        ("machine", json!("x".repeat(12_000)), "xxx..., here it is \""),
        ("wall_per_sim_s_of_runs", json!([1.0, 1.0, 0.0, 1.0]), "it has a time of 0e0 s"),
        ("wall_per_sim_s_of_runs", json!([1.0, 1.0, -1.0, 1.0]), "it has a time of -1e0 s"),
        ("wall_per_sim_s_of_runs", json!(vec![1.0; 1_001]), "the times of 1001 runs"),
        ("build_s", json!(0.0), "it has a time of 0e0 s"),
        ("quality", json!(1.0), "is no whole result of `bench --json`"),
        ("quality", json!({"chosen": "x"}), "something other than numbers"),
    ] {
        let (code, said) = against(&|earlier| earlier[key] = value.clone());
        assert!(code == Some(2) && said.contains(expected), "{key}: {said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    }
}

#[test]
fn programs_are_compared_in_turn() {
    let place = tempfile::tempdir().expect("a folder");
    let with = |program: &str, runs: &str| {
        let args = [&SELECT[..], &["--runs", runs, "--compare", program]].concat();
        run(place.path(), &args)
    };
    // Which of two equal programs is faster is for chance to say.
    let (code, out, err) = with(env!("CARGO_BIN_EXE_symbolt"), "6");
    assert!(matches!(code, Some(0 | 1)), "{err}");
    let said: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((&said["same_bits"], &said["quality_differs"]), (&json!(true), &json!([])));
    for key in ["run", "build"] {
        let interval = [0, 1].map(|end| said[key]["interval95"][end].as_f64().expect("finite"));
        assert!(interval[0] > 0.0 && interval[0] <= interval[1], "{said}");
    }
    let (code, _, err) = with(env!("CARGO_BIN_EXE_symbolt"), "5");
    assert!(code == Some(2) && err.contains("--runs 5: must be 6 to 1000"), "{err}");
    let script = |name: &str, text: &str| {
        let path = place.path().join(name);
        std::fs::write(&path, text).expect("writes");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("sets");
    };
    script("hello", "#!/bin/sh\necho hello\n");
    let (code, _, err) = with("hello", "6");
    assert!(code == Some(2) && err.contains("hello is a program, but not symbolt"), "{err}");
    script("future", "#!/bin/sh\n[ $1 = --version ] && echo symbolt 9 || echo '{}'\n");
    let (code, _, err) = with("future", "6");
    assert!(code == Some(2) && err.contains("its `bench --json` prints other figures"), "{err}");
    script(
        "failing",
        "#!/bin/sh\n[ $1 = --version ] && echo symbolt 9 && exit\necho no room >&2\nexit 1\n",
    );
    let (code, _, err) = with("failing", "6");
    assert!(code == Some(2) && err.contains("could not measure the network: no room"), "{err}");
    script("lost", "#!/nowhere\n");
    let (code, _, err) = with("lost", "6");
    assert!(code == Some(2) && err.contains("cannot start ") && err.contains("lost: No"), "{err}");
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let place = tempfile::tempdir().expect("a folder");
    std::fs::write(place.path().join("d.pddl"), "(define (domain d))").expect("writes");
    for (args, expected) in [
        (&["bench", "bind", "--compare", "d.pddl"][..], "expected what `bench --json` prints"),
        (&["bench", "bind", "--compare", "nowhere"], "cannot read nowhere"),
        (&["bench", "bind", "--compare", "a", "--save", "b"], "cannot be used with"),
        (&["bench"], "<MODEL>"),
        (&["bench", "bind", "--account"], "cannot be used with"),
        (&["bench", "--account", "--json"], "cannot be used with"),
        (&["bench", "--account", "--force"], "cannot be used with"),
        (&["bench", "--account", "--neurons-scale", "1000"], "--neurons-scale 1000: the graph has"),
    ] {
        let (code, _, err) = run(place.path(), args);
        assert!(code == Some(2) && err.contains(expected), "{args:?}: {err}");
    }
}
