//! `symbolt plan` of problems in PDDL: warnings, costs, refusals, and one JSON object whatever happens.

use serde_json::Value;

/// Runs `symbolt plan` in the folder of the fixtures. Returns the exit code, the outputs, and the JSON object.
fn plan(args: &[&str]) -> (Option<i32>, String, Value) {
    let mut command = assert_cmd::Command::cargo_bin("symbolt").expect("the program was built");
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/pddl");
    let output = command.current_dir(folder).args(["plan", "--quiet"]).args(args).output();
    let output = output.expect("it starts");
    let [out, err] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    let json = serde_json::from_str(&out).unwrap_or(Value::String(out));
    (output.status.code(), err, json)
}

#[test]
fn a_refused_file_is_one_json_object_and_one_sentence() {
    let swapped = "the first file, move_one.pddl, is a problem and the second, move.pddl, a domain; swap them";
    let cases: [(&[&str], &str); 7] = [
        (&["move_one.pddl", "move.pddl"], swapped),
        (
            &["move.pddl"],
            "move.pddl is a domain; name a problem in PDDL, or a scene with --scene FILE",
        ),
        (&["move_one.pddl"], "move_one.pddl is a problem in PDDL; name its domain before it"),
        (&["../domain_v1.json", "move_one.pddl"], "is a learned domain; expected a domain in PDDL"),
        (&["move.pddl", "nowhere.pddl"], "cannot read nowhere.pddl"),
        (&["move.pddl", "move_one.pddl", "--limit", "3"], "--limit is for a scene; leave it out"),
        (&["move.pddl", "move_one.pddl", "--goal", "X"], "--goal is for a scene"),
    ];
    for (args, sentence) in cases {
        let (code, err, json) = plan(&[args, &["--json"]].concat());
        assert_eq!(code, Some(2), "{err}");
        assert!(err.starts_with("symbolt: ") && err.contains(sentence), "{err}");
        assert_eq!(err.lines().count(), 1, "{err}");
        assert!(json["fault"].as_str().unwrap().contains(sentence), "{json}");
        assert_eq!((&json["valid"], &json["plan"]), (&false.into(), &Value::Array(vec![])));
        let (code, _, text) = plan(args);
        assert_eq!((code, text), (Some(2), Value::String(String::new())));
    }
}

#[test]
fn a_domain_and_its_problem_in_one_file_are_planned_with_their_cost() {
    for args in [&["pushing.pddl"][..], &["pushing.pddl", "pushing.pddl"]] {
        let (code, err, json) = plan(&[args, &["--json"]].concat());
        let warning = "the cost (total-cost) of the plan is counted, but not minimised";
        assert_eq!((code, err.as_str()), (Some(0), &*format!("symbolt: warning: {warning}\n")));
        assert_eq!(json["cost"], 1.0);
        assert_eq!(json["warnings"], serde_json::json!([warning]));
        assert_eq!(json["plan"].as_array().unwrap().len(), 2);
    }
    let (_, _, table) = plan(&["pushing.pddl"]);
    assert!(table.as_str().unwrap().ends_with("\nCost:    1\n"), "{table}");
}

#[test]
fn a_problem_beside_the_domain_is_not_left_out_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| {
        let path = format!("{}/tests/fixtures/pddl/{name}", env!("CARGO_MANIFEST_DIR"));
        std::fs::read_to_string(path).unwrap()
    };
    let both = folder.path().join("both.pddl");
    std::fs::write(&both, text("move.pddl") + &text("move_one.pddl")).unwrap();
    let both = both.display().to_string();
    let (code, err, json) = plan(&[&both, "move_one.pddl", "--json"]);
    let warning = format!("the problem in {both} is left out: that in move_one.pddl is planned");
    assert_eq!((code, err), (Some(0), format!("symbolt: warning: {warning}\n")));
    assert_eq!(json["warnings"], serde_json::json!([warning]));
    let (code, err, json) = plan(&[&both, "--json"]);
    assert_eq!((code, err.as_str(), &json["warnings"]), (Some(0), "", &serde_json::json!([])));
}

#[test]
fn options_that_cannot_be_read_or_have_no_effect_are_refused_as_json_too() {
    let files = ["move.pddl", "move_one.pddl"];
    let cases: [(&[&str], &str); 5] = [
        (&["--seed", "x"], "--seed"),
        (&["--threads", "-3"], "--threads"),
        (&["--foo"], "unexpected argument '--foo'"),
        (&["--slots", "1"], "a planner needs at least 2 slots"),
        (&["--force"], "--force replaces the file of --out, which is not given"),
    ];
    for (options, sentence) in cases {
        let (code, err, json) = plan(&[&files[..], options, &["--json"]].concat());
        assert_eq!((code, err.lines().count()), (Some(2), 1), "{err}");
        assert!(err.contains(sentence), "{err}");
        let said = json["fault"].as_str().unwrap_or_else(|| panic!("{options:?}: {json}"));
        assert!(err.contains(said), "{err} {said}");
        assert_eq!((&json["valid"], &json["operators"]), (&false.into(), &Value::Null));
        let (_, _, text) = plan(&[&files[..], options].concat());
        assert_eq!(text, Value::String(String::new()), "{options:?}");
    }
    // The slots are refused before anything is read.
    let (_, err, _) = plan(&["nowhere.pddl", "--slots", "1"]);
    assert!(err.contains("a planner needs at least 2 slots"), "{err}");
}

#[test]
fn durative_actions_warn_once_unless_they_are_meant_as_instant() {
    let lost = "durative actions are read as instant ones";
    let (code, err, json) = plan(&["patrol_durative.pddl", "--json"]);
    assert_eq!((code, err.matches(lost).count()), (Some(0), 1), "{err}");
    assert_eq!(json["plan"].as_array().unwrap().len(), 5);
    let (code, err, _) = plan(&["patrol_durative.pddl", "--as-instant"]);
    assert_eq!((code, err.matches(lost).count()), (Some(0), 0), "{err}");
}

#[test]
fn a_goal_with_alternatives_is_planned_without_a_hidden_action() {
    let (code, _, json) = plan(&["forks.pddl", "--json"]);
    assert_eq!(code, Some(0));
    let names = json["actions"].as_array().unwrap().iter().map(|a| a["action"].as_str().unwrap());
    assert!(names.into_iter().all(|name| name.starts_with("(grab ")), "{json}");
}

#[test]
fn standard_input_for_both_files_is_refused_without_waiting_for_it() {
    use std::process::{Command, Stdio};
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("symbolt"))
        .args(["plan", "-", "-"])
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    // It is not closed before the program ends.
    let input = child.stdin.take();
    let output = child.wait_with_output().expect("it ends");
    drop(input);
    let err = String::from_utf8_lossy(&output.stderr);
    assert!(err.contains("cannot both come from standard input"), "{err}");
}

#[test]
fn a_list_that_is_not_closed_is_told_with_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("broken.pddl");
    std::fs::write(&file, "(define (domain d)\n(define (problem p))").expect("written");
    let (code, err, _) = plan(&[file.to_str().expect("a name")]);
    assert_eq!(code, Some(2));
    assert!(err.contains("line 1, column 1: this list is not closed"), "{err}");
}

#[test]
fn a_planner_that_runs_out_of_time_says_how_far_it_got_and_what_to_try() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/");
    let [domain, problem] = ["kitchen", "tea"].map(|name| format!("{folder}{name}.pddl"));
    for (time, words) in [
        (
            "0.2",
            ["(boiled) of the goal does not hold; searched ", " dead ends; try a longer `--time`"],
        ),
        (
            "0.7",
            [
                "of the goal does not hold; a plan was found after ",
                " began in time; try a longer `--time`",
            ],
        ),
    ] {
        let (code, said, _) = plan(&[&domain, &problem, "--time", time]);
        assert_eq!(code, Some(1), "{said}");
        assert!(words.iter().all(|word| said.contains(word)), "{time}: {said}");
        let (_, _, json) = plan(&[&domain, &problem, "--time", time, "--json"]);
        let fault = json["fault"].as_str().unwrap();
        assert!(words.iter().all(|word| fault.contains(word)), "{time}: {fault}");
    }
}

#[test]
fn a_goal_that_no_state_has_is_told_from_one_that_was_not_found() {
    let proved = "the goal cannot be reached: a program looked at all states";
    let (code, err, json) = plan(&["three_pots.pddl", "--time", "1", "--json"]);
    assert_eq!(code, Some(1), "{err}");
    assert!(json["fault"].as_str().unwrap().starts_with(proved), "{json}");
    assert_eq!(json["valid"], false);
    // A plan exists; there is no time for it.
    let (code, err, json) = plan(&["pushing.pddl", "--time", "0.05", "--json"]);
    assert_eq!(code, Some(1), "{err}");
    assert!(!json["fault"].as_str().unwrap().contains("cannot be reached"), "{json}");
}

/// A match burns for five seconds, and a fuse is mended by its light.
const MATCH: &str = "(define (domain match) (:requirements :durative-actions) (:predicates (light) (mended) (unused))
 (:durative-action strike :parameters () :duration (= ?duration 5) :condition (at start (unused))
  :effect (and (at start (light)) (at start (not (unused))) (at end (not (light)))))
 (:durative-action mend :parameters () :duration (= ?duration 2) :condition (over all (light)) :effect (at end (mended))))
(define (problem fuse) (:domain match) (:init (unused)) (:goal (mended)))";

#[test]
fn a_goal_out_of_reach_of_instant_actions_is_not_said_to_be_out_of_reach_of_durative_ones() {
    let own = "; this holds for instant actions: what goes on at the same time was lost in reading durative ones";
    let pots = include_str!("../fixtures/pddl/three_pots.pddl");
    let lasting = pots
        .replace("(:action mix", "(:durative-action mix")
        .replace(
            ":precondition (empty ?p)",
            ":duration (= ?duration 1) :condition (at start (empty ?p))",
        )
        .replace(
            ":effect (and (made ?c) (not (empty ?p)))",
            ":effect (at end (and (made ?c) (not (empty ?p))))",
        );
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("both.pddl");
    // Before the search, after one in vain, and of actions that are written as instant.
    for (text, qualified) in [(MATCH, true), (&lasting, true), (pots, false)] {
        std::fs::write(&file, text).expect("written");
        let args = [file.to_str().expect("a name"), "--as-instant", "--time", "1", "--json"];
        let (code, err, json) = plan(&args);
        let fault = json["fault"].as_str().unwrap();
        assert!(code == Some(1) && fault.contains("cannot be reached"), "{err}");
        assert_eq!(fault.ends_with(own), qualified, "{fault}");
        assert_eq!(err, format!("symbolt: {fault}\n"));
    }
}

#[test]
fn spikes_and_goal_sets_are_counted_where_a_goal_is_proved_to_be_out_of_reach() {
    let args = ["three_pots.pddl", "--time", "0.5", "--mode", "lif", "--spikes"];
    let (code, _, json) = plan(&[&args[..], &["--json"]].concat());
    assert_eq!(code, Some(1));
    let [spikes, sets] = ["spikes", "goal_sets"].map(|key| json[key].as_u64().unwrap());
    assert!(spikes > 1_000 && sets > 0 && json["dead_ends"].is_u64(), "{json}");
    // No action began: all is one decision.
    assert_eq!(json["decision_spikes"], spikes);
    let (code, err, table) = plan(&args);
    let table = table.as_str().unwrap();
    assert_eq!(code, Some(1));
    assert!(
        err.contains(&format!("after a search in vain ({sets} goal sets and states, ")),
        "{err}"
    );
    let first = format!("Spikes:  {spikes}, {spikes} of the first decision, ");
    assert!(table.contains(&first) && table.contains("Synaptic events: "), "{table}");
    assert!(!table.contains("for each action"), "{table}");
}

#[test]
fn spikes_of_the_first_decision_are_some_of_all() {
    let args = ["pushing.pddl", "--mode", "lif", "--spikes", "--json"];
    let (code, err, json) = plan(&args);
    assert_eq!(code, Some(0), "{err}");
    for kind in ["spikes", "synaptic_events"] {
        let [all, first] =
            [kind, &format!("decision_{kind}")].map(|key| json[key].as_u64().unwrap());
        assert!(first > 1_000 && all > first, "{kind}: {first} of {all}");
    }
}

#[test]
fn spikes_are_not_counted_where_no_unit_spikes() {
    for mode in ["direct", "rate"] {
        let (code, err, json) = plan(&["move.pddl", "move_one.pddl", "--spikes", "--mode", mode]);
        let sentence = format!("--spikes has nothing to count in mode {mode}; use --mode lif");
        assert!(code == Some(2) && err.contains(&sentence), "{err}{json}");
    }
}

/// A switch, which is on at first. Nothing breaks.
const SWITCH: &str = "(define (domain switch) (:predicates (on) (off) (broken))
 (:action flip :precondition (on) :effect (and (not (on)) (off)))
 (:action flip-back :precondition (off) :effect (and (on) (not (off)))))
(define (problem p) (:domain switch) (:init (on)) (:goal GOAL))";

#[test]
fn an_answer_without_search_has_all_keys() {
    let keys =
        |json: &Value| -> Vec<String> { json.as_object().unwrap().keys().cloned().collect() };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("switch.pddl");
    let counts = ["goal_sets", "dead_ends", "starts", "time_ms"];
    let spikes = ["spikes", "synaptic_events", "decision_spikes", "decision_synaptic_events"];
    let mut all = Vec::new();
    // Met, met where no operator is in a plan, proved by pairs, proved by reach, refused; each with whether it was grounded.
    for (goal, code, grounded) in [
        ("(on)", 0, true),
        ("(not (broken))", 0, true),
        ("(and (on) (off))", 1, true),
        ("(broken)", 1, false),
        ("(torn)", 2, false),
    ] {
        std::fs::write(&file, SWITCH.replace("GOAL", goal)).expect("written");
        let args = ["--mode", "lif", "--json", file.to_str().expect("a name")];
        let (found, err, json) = plan(&args);
        assert_eq!(found, Some(code), "{err}");
        assert_eq!(json["valid"], code == 0, "{json}");
        assert_eq!((&json["planned_ms"], &json["cost"]), (&Value::Null, &Value::Null));
        assert!(counts.iter().all(|key| json[key] == 0), "{goal}: {json}");
        assert!(spikes.iter().all(|key| json[key].is_null()), "{goal}: {json}");
        assert_eq!(json["fluents"].is_u64(), grounded, "{goal}: {json}");
        all.push(keys(&json));
        let (_, _, json) = plan(&[&args[..], &["--spikes"]].concat());
        assert!(spikes.iter().all(|key| json[key] == 0), "{goal}: {json}");
    }
    std::fs::write(&file, SWITCH.replace("GOAL", "(off)")).expect("written");
    let (code, _, json) = plan(&["--json", file.to_str().expect("a name")]);
    assert!(code == Some(0) && json["starts"] == 1, "{json}");
    assert!(all.iter().all(|of| *of == keys(&json)), "{all:?}");
}
