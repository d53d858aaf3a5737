//! `run --interventions`: the planner is disturbed while the robot acts, again with the same bits; and logs that are refused.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

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
