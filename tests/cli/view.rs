//! `symbolt view`: the main job is stopped, disturbed and taken back by hand, and its log repeats it.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use serde_json::json;

use crate::window::{Window, parts};

#[test]
fn a_motor_that_is_silenced_in_a_window_gives_no_decision_and_its_log_repeats_it() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let mut program = Command::new(env!("CARGO_BIN_EXE_symbolt"))
        .current_dir(here)
        .args(["view", "--demos", "2", "--quiet", "--log", "log.jsonl"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(program.stdout.take().unwrap());
    let mut line = String::new();
    said.read_line(&mut line).unwrap();
    let (port, token) = parts(line.trim().strip_prefix("Open ").unwrap());
    let mut window = Window::opened(port, &token);
    let hello = &window.hello["scene"]["parts"];
    assert_eq!(hello.as_array().map(Vec::len), Some(2));
    let what = json!({ "reading": { "name": "goal_set" } });
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
