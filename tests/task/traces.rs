//! The trace of a run: read as it was written, in its older format, and in part if it is too long.

#![allow(clippy::expect_used)]
#![cfg(feature = "physics")]

use symbolt::report::trace::{Tracer, read};
use symbolt::robot::{Pose, SkillOutcome, SkillReport};
use symbolt::task::event::{
    Decided, Displaced, Ended, EpisodeReport, Event, Observer, Recovery, RecoveryKind, Touched,
    Undecided,
};

/// Two episodes in the older format, with skills on lines of their own.
const OLD: &str = r#"{"episode":0,"decision":{"asked_s":0.0,"took_ms":3.0,"holds":["A"],"action":"PUT","begun":false}}
{"episode":0,"decision":{"asked_s":1.0,"took_ms":3.0,"holds":["A"],"action":"PUT","begun":true}}
{"episode":0,"decision":{"asked_s":2.0,"took_ms":3.0,"holds":["A"],"action":"PUT","begun":true}}
{"episode":0,"skill":{"part":1,"outcome":"dropped","picked":true,"slip_m":0.001}}
{"episode":0,"skill":{"part":0,"outcome":"placed","picked":true,"slip_m":0.0}}
{"episode":1,"decision":{"asked_s":1.0,"took_ms":3.0,"holds":["A"],"action":"PUT","begun":true}}
{"episode":1,"skill":{"part":7,"outcome":"timed out","picked":false,"slip_m":0.0}}
"#;

#[test]
fn skills_of_an_older_trace_are_moved_into_their_decisions() {
    let (lines, problem) = read(OLD.as_bytes());
    assert_eq!(problem, None);
    let outcomes: Vec<Option<SkillOutcome>> =
        lines.iter().map(|l| l.decision.as_ref().and_then(Decided::outcome)).collect();
    let [dropped, placed, late] =
        [SkillOutcome::Dropped, SkillOutcome::Placed, SkillOutcome::TimedOut].map(Some);
    assert_eq!(outcomes, [None, dropped, placed, late]);
}

#[test]
fn a_trace_of_a_million_lines_is_read_in_part_and_in_time() {
    // Each skill of an older trace belongs to the first open decision. A search from the first line would never end.
    let decision = r#"{"episode":0,"decision":{"asked_s":0,"took_ms":3,"holds":[],"action":"PUT","begun":true}}"#;
    let skill =
        r#"{"episode":0,"skill":{"part":1,"outcome":"dropped","picked":true,"slip_m":0.001}}"#;
    let half = |line: &str| format!("{line}\n").repeat(200_000 / 2);
    let (lines, problem) = read((half(decision) + &half(skill)).as_bytes());
    assert_eq!((lines.len(), problem), (200_000 / 2, None));
    assert!(lines.iter().all(|l| l.decision.as_ref().is_some_and(|d| d.skill.is_some())));
    let touch = r#"{"episode":0,"touch":{"t":0,"part":0,"contact":true}}"#;
    let (lines, problem) = read(format!("{touch}\n").repeat(1_000_000 / 2).as_bytes());
    assert_eq!(lines.len(), 200_000);
    assert_eq!(problem.as_deref(), Some("only the first 200000 lines are shown"));
    let holding = |count: usize| {
        let names = vec!["\"A\""; count].join(",");
        decision.replace("\"holds\":[]", &format!("\"holds\":[{names}]"))
    };
    let (lines, problem) = read(format!("{}\n", holding(250_000)).repeat(20).as_bytes());
    assert_eq!((lines.len(), problem.as_deref()), (9, Some("only the first 9 lines are shown")));
    let (lines, problem) = read(format!("{decision}\n{}", holding(300_000)).as_bytes());
    assert_eq!(lines.len(), 1);
    let problem = problem.expect("the line is too long");
    assert!(problem.contains("line 2 is damaged (it has 1200"), "{problem}");
}

#[test]
fn a_written_trace_reads_back_as_it_was_observed() {
    let skill =
        SkillReport { part: 1, outcome: SkillOutcome::Placed, picked: true, slip_m: 0.5e-3 };
    let recovery = || {
        Some(Recovery {
            name: String::new(),
            kind: RecoveryKind::Clear,
            object: "block_0".into(),
            why: "it lies where block_1 is to be put".into(),
            attempt: 2,
        })
    };
    let decided = |begun, skill| Decided {
        words: None,
        in_no_state: Vec::new(),
        asked_s: 1.0,
        took_ms: 12.0,
        holds: vec!["A".into()],
        action: Some("PUT".into()),
        begun,
        skill,
        chosen: None,
        unmet: vec!["B".into()],
        needs: vec!["A".into()],
        undecided: vec![Undecided { fact: "A".into(), held: 4, of: 5 }],
        gives: vec!["B".into()],
        landed: None,
        recovery: recovery(),
    };
    let touch = Touched { t: 1.5, part: 1, contact: true };
    let decisions = [decided(false, None), decided(true, Some(skill)), decided(true, None)];
    let report = EpisodeReport {
        ended_words: String::new(),
        ended: Ended::GaveUp,
        solved: false,
        decisions: decisions.to_vec(),
        touches: vec![touch],
        in_no_state: 0,
        unexplained: 0,
        lost: vec!["block_3".into()],
        displaced: vec![Displaced::new(1.7, "block_2", "block 2", Pose::at([0.1, 0.2, 0.3]), None)],
        steps: 10,
        simulated_s: 2.0,
    };
    let mut tracer = Tracer::new(3);
    // Lines are written when the episode has ended: where a part landed is known after its skill.
    tracer.observe(&Event::Decided(&decisions[0]));
    assert_eq!(tracer.text(), "");
    tracer.observe(&Event::EpisodeEnded(&report));
    let (lines, problem) = read(tracer.text().as_bytes());
    assert_eq!((lines.len(), problem), (6, None));
    assert!(lines.iter().all(|l| l.episode == 3 && l.skill.is_none()));
    let read: Vec<Decided> = lines.iter().filter_map(|l| l.decision.clone()).collect();
    assert_eq!(read, decisions);
    assert_eq!(lines[3].touch, Some(touch));
    assert_eq!(lines[4].displaced.as_ref(), Some(&report.displaced[0]));
    let end = lines[5].end.as_ref().map(|e| (e.simulated_s, e.lost.len()));
    assert_eq!(end, Some((2.0, 1)));
}

#[test]
fn a_jig_that_another_hand_turned_is_said_to_be_turned() {
    let turned = |degrees: f64| {
        let half = degrees.to_radians() / 2.0;
        Pose { orientation: [0.0, 0.0, half.sin(), half.cos()], ..Pose::at([0.2, 0.1, 0.0]) }
    };
    let from = Pose::at([0.1, 0.1, 0.0]);
    let said = |to| Displaced::new(1.0, "jig", "the jig", from, Some(to)).words;
    let moved = "another hand, not the robot, moved the jig from (100, 100, 0) to (200, 100, 0) mm";
    assert_eq!(said(turned(-35.0)), format!("{moved} and turned it by 35 degrees"));
    assert_eq!(said(turned(0.3)), moved);
}
