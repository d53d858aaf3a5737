//! `symbolt view`: the main job is stopped, disturbed and taken back by hand, and its log repeats it.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

use crate::window::{Window, parts};

#[test]
fn a_motor_that_is_silenced_in_a_window_gives_no_decision_and_its_log_repeats_it() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (mut program, mut said, mut window) = started(here);
    let hello = &window.hello["scene"]["parts"];
    assert_eq!(hello.as_array().map(Vec::len), Some(2));
    let what = json!({ "reading": { "name": "goal set" } });
    window.send(&json!({ "plot": { "key": 1, "what": what } }));
    window.answer("plotted");
    window.goes(&json!({ "step": { "ticks": 30 } }), 30);
    window.goes(&json!({ "back": { "ticks": 20 } }), 10);
    window.send(&json!({ "do": { "silence": { "at": "planner/motor" } } }));
    window.send(&json!({ "run": {} }));
    let over = loop {
        let (frame, _) = window.frame();
        if frame.mode == 2 {
            break frame;
        }
    };
    assert_eq!(over.logged, 1);
    // From the end it goes back, and comes to the same end.
    let end = over.tick as u64;
    window.goes(&json!({ "back": { "ticks": 40 } }), end - 40);
    window.goes(&json!({ "run": {} }), end);
    window.send(&json!({ "end": {} }));
    let mut rest = String::new();
    said.read_to_string(&mut rest).unwrap();
    assert!(program.wait().unwrap().success());
    assert!(rest.starts_with("Ended after 1 decision: "), "{rest}");
    assert!(rest.ends_with("1 intervention in the log.\n"), "{rest}");
    let log = std::fs::read_to_string(here.join("log.jsonl")).unwrap();
    assert_eq!(log, "{\"tick\":10,\"do\":{\"silence\":{\"at\":\"planner/motor\"}}}\n");
    let args = ["run", "--demos", "2", "--quiet", "--interventions", "log.jsonl"];
    let again = Command::new(env!("CARGO_BIN_EXE_symbolt")).current_dir(here).args(args).output();
    assert_eq!(again.unwrap().status.code(), Some(1));
    let trace = std::fs::read_to_string(here.join("out/trace.jsonl")).unwrap();
    let rows = trace.lines().map(|row| serde_json::from_str::<serde_json::Value>(row).unwrap());
    let rows: Vec<_> = rows.collect();
    let decisions: Vec<_> = rows.iter().filter_map(|row| row.get("decision")).collect();
    assert_eq!(decisions.len(), 1);
    let took =
        decisions[0]["took_ms"].as_f64().unwrap() + 1e3 * decisions[0]["asked_s"].as_f64().unwrap();
    assert!((end as f64 - took).abs() < 50.0, "the same end: {end} and {took}");
}

/// Starts a run in `here`. Returns it with what it says and a window.
fn started(here: &Path) -> (Child, BufReader<ChildStdout>, Window) {
    started_with(here, &[])
}

fn started_with(here: &Path, more: &[&str]) -> (Child, BufReader<ChildStdout>, Window) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_symbolt"))
        .current_dir(here)
        .args(["view", "--demos", "2", "--quiet", "--log", "log.jsonl"])
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(program.stdout.take().unwrap());
    let mut line = String::new();
    said.read_line(&mut line).unwrap();
    let (port, token) = parts(line.trim().strip_prefix("Open ").unwrap());
    (program, said, Window::opened(port, &token))
}

#[test]
fn a_run_that_a_window_ends_early_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let (mut program, mut said, mut window) = started(folder.path());
    window.goes(&json!({ "step": { "ticks": 30 } }), 30);
    window.send(&json!({ "end": {} }));
    let mut rest = String::new();
    said.read_to_string(&mut rest).unwrap();
    assert!(program.wait().unwrap().success());
    assert_eq!(rest, "Ended after 0 decisions: ended by a window. 0 interventions in the log.\n");
}

#[test]
fn the_log_of_a_killed_session_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (mut program, _said, mut window) = started(folder.path());
    window.goes(&json!({ "step": { "ticks": 30 } }), 30);
    window.send(&json!({ "do": { "silence": { "at": "planner/motor" } } }));
    window.goes(&json!({ "step": { "ticks": 5 } }), 35);
    program.kill().unwrap();
    program.wait().unwrap();
    let log = std::fs::read_to_string(folder.path().join("log.jsonl")).unwrap();
    assert_eq!(log, "{\"tick\":30,\"do\":{\"silence\":{\"at\":\"planner/motor\"}}}\n");
}

#[test]
fn the_log_of_a_run_that_failed_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (mut program, _said, mut window) = started(folder.path());
    let nodes = window.hello["graph"]["nodes"].as_array().unwrap();
    let within = |node: &&Value| node["path"].as_str().unwrap().starts_with("planner/motor");
    let mut outputs =
        nodes.iter().filter(within).flat_map(|node| node["outputs"].as_array().unwrap());
    let wide = outputs.find(|output| output["width"].as_u64() > Some(0)).unwrap();
    let values = vec![3e38; wide["width"].as_u64().unwrap() as usize];
    let clamp = json!({ "clamp": { "output": wide["name"], "values": values } });
    window.goes(&json!({ "step": { "ticks": 5 } }), 5);
    window.send(&json!({ "do": clamp }));
    window.send(&json!({ "step": { "ticks": 50 } }));
    while window.answer("standing")["halted"].is_null() {}
    window.send(&json!({ "end": {} }));
    assert!(!program.wait().unwrap().success());
    let log = std::fs::read_to_string(folder.path().join("log.jsonl")).unwrap();
    assert_eq!(log.lines().count(), 1);
    assert!(log.starts_with("{\"tick\":5,\"do\":{\"clamp\""), "{log:.100}");
}

/// The files of a folder that end with `.npy`, by their names.
fn arrays(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    let arrays = files.filter(|file| file.extension().is_some_and(|end| end == "npy"));
    let name = |file: &Path| file.file_name().unwrap().to_str().unwrap().to_owned();
    arrays.map(|file| (name(&file), std::fs::read(&file).unwrap())).collect()
}

#[test]
fn a_part_taken_away_by_hand_is_planned_anew_and_streamed_and_repeated_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (mut program, mut said, mut window) =
        started_with(here, &["--bolts", "2", "--stream", "live"]);
    // The first plan is under way; what is recorded on the way back and on again counts once.
    window.goes(&json!({ "step": { "ticks": 250 } }), 250);
    window.goes(&json!({ "back": { "ticks": 90 } }), 160);
    window.goes(&json!({ "step": { "ticks": 40 } }), 200);
    window.send(&json!({ "do": { "world": { "remove": { "object": "bolt_0" } } } }));
    window.send(&json!({ "run": {} }));
    while window.frame().0.mode != 2 {}
    let told = window.last("events").unwrap();
    assert_eq!(told.as_array().map(Vec::len), Some(4), "{told}");
    assert!(told[0].as_str().unwrap().ends_with(" s: put bolt 1 in the bolt hole"), "{told}");
    window.send(&json!({ "end": {} }));
    let mut rest = String::new();
    said.read_to_string(&mut rest).unwrap();
    assert!(program.wait().unwrap().success());
    assert_eq!(rest, "Ended after 4 decisions: the goal is met. 1 intervention in the log.\n");
    let run = |more: &[&str]| {
        let args = ["run", "--demos", "2", "--quiet", "--bolts", "2"];
        let mut program = Command::new(env!("CARGO_BIN_EXE_symbolt"));
        program.current_dir(here).args(args).args(more).output().unwrap()
    };
    let again = run(&["--interventions", "log.jsonl", "--stream", "again", "--out", "again-out"]);
    assert!(again.status.success(), "{again:?}");
    let [live, again] = ["live", "again"].map(|name| arrays(&here.join(name)));
    assert!(live.len() >= 8, "{:?}", live.keys());
    assert!(live == again);
    let columns = std::fs::read_to_string(here.join("live/columns.json")).unwrap();
    let columns: Value = serde_json::from_str(&columns).unwrap();
    assert_eq!(2 * columns.as_object().unwrap().len(), live.len());
    let trace = std::fs::read_to_string(here.join("again-out/trace.jsonl")).unwrap();
    assert!(trace.contains("took bolt 0 away from (") && !trace.contains("put bolt 0 in the nut"));
    let facts = std::fs::read_to_string(here.join("again-out/run.json")).unwrap();
    let facts: Value = serde_json::from_str(&facts).unwrap();
    assert_eq!(facts["summary"]["interventions"], 1);
    let wrong = run(&["--interventions", "again-out/scene.json", "--out", "none"]);
    let said = String::from_utf8_lossy(&wrong.stderr).into_owned();
    let expected = "again-out/scene.json is a scene; expected a log of interventions";
    assert_eq!(said, format!("symbolt: --interventions: {expected}\n"));
    // Without the hand it is another plan, with other numbers; a folder with files is not written to.
    let usual = run(&["--stream", "usual", "--out", "usual-out"]);
    assert!(usual.status.success() && arrays(&here.join("usual")) != live, "{usual:?}");
    let refused = run(&["--stream", "usual", "--out", "none"]);
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(said, "symbolt: --stream usual: has files already; name a new folder\n");
}
