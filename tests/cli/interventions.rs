//! `run --interventions`: the planner is disturbed while the robot acts, again with the same bits; and logs that are refused.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::{Value, json};

use crate::run::made;

/// Runs one episode with a log of interventions.
fn run(folder: &Path, log: &str, out: &str) -> Output {
    std::fs::write(folder.join("log.jsonl"), log).unwrap();
    let args = ["run", "--demos", "2", "--quiet", "--interventions", "log.jsonl", "--out", out];
    let mut program = Command::new(env!("CARGO_BIN_EXE_symbolt"));
    program.current_dir(folder).args(args).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The decisions and the end of an episode.
fn decided(trace: &str) -> (Vec<String>, String) {
    let rows: Vec<Value> = trace.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let decisions = rows.iter().filter_map(|row| row.get("decision"));
    let end = rows.iter().find_map(|row| row.get("end")).unwrap();
    (decisions.map(|d| d["action"].to_string()).collect(), end["ended"].to_string())
}

#[test]
fn a_motor_that_is_silenced_by_hand_gives_no_decision_and_again_from_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let log = "{\"tick\":10,\"do\":{\"silence\":{\"at\":\"planner/motor\"}}}\n\
               {\"tick\":300000,\"do\":{\"release\":{\"at\":\"planner/motor\"}}}\n";
    let [one, two] = ["one", "two"].map(|out| {
        let ran = run(here, log, out);
        assert_eq!(ran.status.code(), Some(1), "{}", said(&ran));
        let expected = "symbolt: warning: 1 intervention not made: the episode, or its first planner graph, ended before\n\
                        symbolt: 1 of 1 episode failed\n";
        assert_eq!(said(&ran), expected);
        std::fs::read_to_string(here.join(out).join("trace.jsonl")).unwrap()
    });
    assert!(one == two);
    assert_eq!(
        decided(&one),
        (vec!["null".into()], "{\"Stuck\":{\"NoPlan\":{\"state\":0}}}".into())
    );
    let usual = std::fs::read_to_string(made().join("trace.jsonl")).unwrap();
    assert_eq!((decided(&usual).0.len(), decided(&usual).1), (4, "\"GoalMet\"".into()));
    let facts = std::fs::read_to_string(here.join("one/run.json")).unwrap();
    assert!(facts.contains("symbolt run --seed 1 --demos 2 --interventions log.jsonl"), "{facts}");
}

/// The position of an object in the first scene.
fn position(scene: &Value, id: &str) -> [f64; 3] {
    let object = scene["objects"].as_array().unwrap().iter().find(|o| o["id"] == id).unwrap();
    serde_json::from_value(object["position"].clone()).unwrap()
}

#[test]
fn a_part_that_another_hand_moves_is_taken_where_it_lies_then_and_again_from_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let scene = std::fs::read_to_string(made().join("scene.json")).unwrap();
    let [x, y, z] = position(&serde_json::from_str(&scene).unwrap(), "nut_0");
    let to = [x - 0.05, y + 0.02, z];
    let wish = json!({ "move": { "object": "nut_0", "position": to } });
    let log = format!("{}\n", json!({ "tick": 3000, "do": { "world": wish } }));
    let [one, two] = ["one", "two"].map(|out| {
        let ran = run(here, &log, out);
        assert_eq!(ran.status.code(), Some(0), "{}", said(&ran));
        let told = String::from_utf8_lossy(&ran.stdout).replace("\n  ", " ");
        assert!(told.contains("another hand, not the robot, moved the nut from ("), "{told}");
        std::fs::read_to_string(here.join(out).join("trace.jsonl")).unwrap()
    });
    assert!(one == two);
    assert_eq!(decided(&one).1, "\"GoalMet\"");
    let rows = one.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let moved: Vec<Value> = rows.filter_map(|row| row.get("displaced").cloned()).collect();
    assert_eq!((moved.len(), &moved[0]["object"]), (1, &json!("nut_0")));
    let landed = |axis: usize| moved[0]["to"]["position"][axis].as_f64().unwrap();
    assert!((landed(0) - to[0]).abs() < 1e-9 && (landed(2) - z).abs() < 5e-3, "{moved:?}");
    let facts = std::fs::read_to_string(here.join("one/run.json")).unwrap();
    let facts: Value = serde_json::from_str(&facts).unwrap();
    assert_eq!(facts["summary"]["displaced"].as_array().map(Vec::len), Some(1), "{facts}");
}

#[test]
fn a_part_that_is_taken_away_ends_the_episode_and_what_has_no_room_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let world = |wish: Value| format!("{}\n", json!({ "tick": 200, "do": { "world": wish } }));
    let ran = run(here, &world(json!({ "remove": { "object": "nut_0" } })), "gone");
    assert_eq!(ran.status.code(), Some(1), "{}", said(&ran));
    let trace = std::fs::read_to_string(here.join("gone/trace.jsonl")).unwrap();
    assert!(trace.contains("took the nut away from ("), "{trace}");
    let scene = std::fs::read_to_string(made().join("scene.json")).unwrap();
    let nut = position(&serde_json::from_str(&scene).unwrap(), "nut_0");
    let cases = [
        (json!({ "remove": { "object": "nut_7" } }), "there is no `nut_7`; there are: "),
        (
            json!({ "move": { "object": "bolt_0", "position": nut } }),
            "there is no room for `bolt_0` there",
        ),
        (
            json!({ "move": { "object": "bolt_0", "position": [9.0, 0.0, 0.0] } }),
            "expected a position within 2 m",
        ),
        (
            json!({ "move": { "object": "nut_0", "position": [nut[0], nut[1], -0.3] } }),
            "expected a position within 2 m, not below the table",
        ),
        (json!({ "eat": { "object": "nut_0" } }), "unknown variant `eat`"),
    ];
    for (wish, expected) in cases {
        let ran = run(here, &world(wish), "out");
        let said = said(&ran);
        assert_eq!(ran.status.code(), Some(2), "{said}");
        let whole =
            format!("symbolt: --interventions log.jsonl: intervention 1, at tick 200: {expected}");
        assert!(said.starts_with(&whole), "{said}");
    }
    assert!(!here.join("out/run.json").exists());
}

#[test]
fn what_another_hand_changes_at_one_tick_counts_for_its_next_change() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let scene = std::fs::read_to_string(made().join("scene.json")).unwrap();
    let scene = serde_json::from_str(&scene).unwrap();
    let [nut, bolt] = ["nut_0", "bolt_0"].map(|id| position(&scene, id));
    let free = [nut[0] - 0.05, nut[1] + 0.02];
    let put = |object: &str, [x, y]: [f64; 2], z: f64| json!({ "move": { "object": object, "position": [x, y, z] } });
    let log = |wishes: [Value; 2]| {
        let line = |wish| format!("{}\n", json!({ "tick": 200, "do": { "world": wish } }));
        wishes.map(line).concat()
    };
    let gone = json!({ "remove": { "object": "nut_0" } });
    let nut_aside = put("nut_0", free, nut[2]);
    let cases = [
        ([nut_aside.clone(), put("bolt_0", free, bolt[2])], "there is no room for `bolt_0` there"),
        ([gone.clone(), gone], "`nut_0` is no longer on the table"),
    ];
    for (wishes, expected) in cases {
        let said = said(&run(here, &log(wishes), "out"));
        let whole =
            format!("symbolt: --interventions log.jsonl: intervention 2, at tick 200: {expected}");
        assert!(said.starts_with(&whole), "{said}");
    }
    // Where the nut was, there is room for the bolt at once.
    let ran = run(here, &log([nut_aside, put("bolt_0", [nut[0], nut[1]], bolt[2])]), "swapped");
    assert_ne!(ran.status.code(), Some(2), "{}", said(&ran));
}

#[test]
fn logs_that_cannot_be_read_or_followed_are_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let line = |tick: u64, at: &str| {
        format!("{{\"tick\":{tick},\"do\":{{\"silence\":{{\"at\":\"{at}\"}}}}}}\n")
    };
    let cases = [
        (
            "{\"tick\":1".into(),
            "log.jsonl: line 1 is cut: the last line of a log ends with a line break",
        ),
        (
            line(1, "planner/moter"),
            "log.jsonl: intervention 1, at tick 1: the graph has no output, node or module `planner/moter`; the most similar: `planner/motor`",
        ),
    ];
    for (log, expected) in cases {
        let ran = run(folder.path(), &log, "out");
        assert_eq!(ran.status.code(), Some(2), "{}", said(&ran));
        let said = said(&ran);
        assert!(said.starts_with(&format!("symbolt: --interventions {expected}")), "{said}");
        assert_eq!(said.lines().count(), 1);
    }
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 1, "only the log is there");
}
