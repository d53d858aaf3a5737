//! Inputs that are made to exhaust time or memory: each is refused with a reason, and at once.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "physics")]

use symbolt::neurons::SolvedModel;
use symbolt::plan::strips::{self, Bodies, Trajectory};
use symbolt::report::report;
use symbolt::sim::Seed;
use symbolt::study::experiment::Origin;
use symbolt::task::domain::RelationalDomain;
use symbolt::task::tasks::file::DataTask;
use symbolt::task::tasks::nuts_and_bolts::{NutsAndBolts, SyntheticDemonstrations};
use symbolt::task::{Recording, TaskError};

const TOWER: &str = include_str!("../../src/task/tasks/files/tower.json");
const DOMAIN: &str = include_str!("../fixtures/domain_v1.json");

/// Returns the message of an error, which is short whatever the input.
fn said<T, E: std::fmt::Display>(read: Result<T, E>) -> String {
    let said = read.err().expect("it is refused").to_string();
    assert!(said.len() < 20_000, "{} bytes", said.len());
    said
}

#[test]
fn a_line_or_a_recording_without_end_is_refused() {
    let object = |id: usize| {
        format!(r#"{{"id":"{id}","kind":"k","position":[0,0,0],"orientation":[0,0,0,1]}}"#)
    };
    let objects: Vec<String> = (0..130_000).map(object).collect();
    let line = format!(r#"{{"demo":0,"snapshot":0,"objects":[{}]}}"#, objects.join(","));
    let message = said(Recording::parse(line.as_bytes(), "x"));
    assert!(message.contains("expected at most 8388608 bytes"), "{message}");
    let line = |number: usize| format!("{{\"demo\":0,\"snapshot\":{number},\"objects\":[]}}\n");
    let lines: String = (0..=1_000_000).map(line).collect();
    let message = said(Recording::parse(lines.as_bytes(), "x"));
    assert!(
        message.contains("line 1000001") && message.contains("at most 1000000 snapshots"),
        "{message}"
    );
}

#[test]
fn messages_quote_only_the_beginning_of_a_text_of_megabytes() {
    let long = "x".repeat(1_000_000);
    let touched =
        format!(r#"{{"demo":0,"snapshot":0,"object":"{long}","event":"contact","objects":[]}}"#);
    assert!(said(Recording::parse(touched.as_bytes(), "x")).contains("no object is called"));
    // The nearest name is not looked for: the number of steps would be the product of the lengths.
    let goal = DOMAIN.replacen("\"goal\": \"", &format!("\"goal\": \"{long}"), 1);
    assert!(said(RelationalDomain::parse(goal.as_bytes(), "x")).contains("is not a state"));
    let name = TOWER.replacen("\"name\": \"", &format!("\"name\": \"{long}"), 1);
    assert!(said(DataTask::parse(name.as_bytes(), "x")).contains("at most 190"));
}

#[test]
fn domains_of_too_many_states_or_actions_are_refused() {
    let file: serde_json::Value = serde_json::from_str(DOMAIN).expect("JSON");
    let repeated = |list: &str, count: usize| {
        let mut file = file.clone();
        let first = file[list][0].clone();
        let entry = |i: usize| {
            let mut entry = first.clone();
            entry["name"] = format!("X{i}").into();
            entry
        };
        file[list] = (0..count).map(entry).collect();
        said(RelationalDomain::parse(file.to_string().as_bytes(), "x"))
    };
    let message = repeated("states", 3000);
    assert!(message.contains("it has 3000 states; expected at most 2000"), "{message}");
    let message = repeated("operators", 3000);
    assert!(message.contains("it has 3000 actions"), "{message}");
}

#[test]
fn task_files_with_too_many_parts_corners_or_grasps_are_refused() {
    let broken = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut file: serde_json::Value = serde_json::from_str(TOWER).expect("JSON");
        change(&mut file);
        said(DataTask::parse(file.to_string().as_bytes(), "x"))
    };
    let repeat = |list: &mut serde_json::Value, times: usize| {
        let first = list[0].clone();
        *list = vec![first; times].into();
    };
    let parts = broken(&|file| repeat(&mut file["parts"][0]["starts"], 1000));
    assert!(parts.contains("parts[].starts") && parts.contains("at most 128"), "{parts}");
    let huge = broken(&|file| file["parts"][0]["starts"][0]["count"] = u64::MAX.into());
    assert!(huge.contains("parts[].starts"), "{huge}");
    let grasps = broken(&|file| repeat(&mut file["parts"][0]["grasps"], 100_000));
    assert!(grasps.contains("parts[0].grasps"), "{grasps}");
    let pieces = broken(&|file| repeat(&mut file["parts"][0]["shape"], 100_000));
    assert!(pieces.contains("parts[0].shape"), "{pieces}");
    let hull = broken(&|file| {
        let points = vec![serde_json::json!([0.0, 0.01, 0.02]); 100_000];
        file["parts"][0]["shape"] = serde_json::json!([{"hull": {"points": points}}]);
    });
    assert!(hull.contains("hull.points"), "{hull}");
}

#[test]
fn a_layout_without_room_is_given_up_in_time_however_many_parts_it_has() {
    let mut file: serde_json::Value = serde_json::from_str(TOWER).expect("JSON");
    // All parts in one place, and each with as many corners as a file may give it.
    let point = |i: usize| {
        [0.001 * (i % 16) as f64, 0.001 * (i / 16) as f64, 0.0001 * (i * i) as f64 % 0.02]
    };
    let points: Vec<[f64; 3]> = (0..256).map(point).collect();
    let pieces = vec![serde_json::json!({"hull": {"points": points}}); 64];
    file["parts"][0]["shape"] = pieces.into();
    file["parts"][0]["starts"][0]["count"] = 64.into();
    let message = said(DataTask::parse(file.to_string().as_bytes(), "x"));
    assert!(message.contains("starts") || message.contains("shape"), "{message}");
}

#[test]
fn pddl_that_multiplies_itself_is_refused() {
    let domain = |sections: &str| format!("(define (domain d) {sections})");
    let parse =
        |sections: &str| strips::Domain::parse(domain(sections).as_bytes(), "x", Bodies::Skip);
    let many =
        |count: usize, word: &str| (0..count).map(|i| format!("{word}{i} ")).collect::<String>();
    // Each name would get its own copy of all types.
    let either =
        format!("(:types t) (:constants {} - (either {}))", many(1000, "c"), "t ".repeat(1000));
    let message = said(parse(&either));
    assert!(message.contains("(either TYPE ...) with 1 to 64 types"), "{message}");
    let types = said(parse(&format!("(:types {})", many(2000, "t"))));
    assert!(types.contains("at most 1024"), "{types}");
    let parameters = many(1000, "?p");
    let predicates: String = (0..1000).map(|i| format!("(p{i} {parameters})")).collect();
    let message = said(parse(&format!("(:predicates {predicates})")));
    assert!(message.contains("too many parameters"), "{message}");
    // A word of two bytes takes seventy in memory.
    let words = "a ".repeat(4_000_000);
    let message = said(strips::Domain::parse(words.as_bytes(), "x", Bodies::Skip));
    assert!(message.contains("at most 3000000, or several files"), "{message}");
    let blocks = include_bytes!("../fixtures/strips/blocks.pddl");
    let blocks = strips::Domain::parse(blocks, "x", Bodies::Read).expect("sound");
    let objects = format!(
        "(:trajectory (:objects {} - (either {})))",
        many(20_000, "o"),
        "block ".repeat(50)
    );
    let message = said(Trajectory::parse(objects.as_bytes(), "x", &blocks));
    assert!(message.contains("at most 500000 types"), "{message}");
    assert!(
        said(strips::Domain::parse("(".repeat(1_000_000).as_bytes(), "x", Bodies::Skip))
            .contains("64 deep")
    );
}

#[test]
fn what_pddl_says_once_and_means_in_many_places_is_refused() {
    let refused = |sections: &str| {
        let text = format!("(define (domain d) (:predicates (p ?x)) (:functions (f)) {sections})");
        said(strips::Domain::parse(text.as_bytes(), "x", Bodies::Instant))
    };
    let compared = "(> (f) 1)".repeat(1000);
    let effects = "(forall (?x) (p ?x))".repeat(300);
    let message = refused(&format!("(:action a :effect (when (and {compared}) (and {effects})))"));
    assert!(message.contains("the conditional effects are too large"), "{message}");
    let sum = format!("(+ {})", format!("(+ {})", "1 ".repeat(30)).repeat(30));
    let effects = "(at end (increase (f) ?duration))".repeat(300);
    let message = refused(&format!(
        "(:durative-action a :parameters () :duration (= ?duration {sum}) :effect (and {effects}))"
    ));
    assert!(message.contains("the durations are too large"), "{message}");
}

#[test]
fn pddl_of_very_many_parts_is_read_or_refused_at_once() {
    let parse = |sections: &str| {
        let text =
            format!("(define (domain d) (:predicates (p ?x)) (:functions (f) (g)) {sections})");
        strips::Domain::parse(text.as_bytes(), "x", Bodies::Instant)
    };
    let began = std::time::Instant::now();
    let rules = |count: usize| {
        (0..count).map(|i| format!("(:derived (d{i}) (d{}))", i + 1)).collect::<String>()
    };
    // The last predicate is no derived one.
    assert!(said(parse(&rules(1000))).contains("expected one of: d100, "));
    let chain = parse(&(rules(1000) + "(:derived (d1000) (forall (?x) (p ?x)))")).expect("sound");
    assert_eq!(chain.derived[0].predicate, "d1000");
    assert_eq!(chain.derived[1000].predicate, "d0");
    assert!(said(parse(&rules(1100))).contains("too many predicates; expected at most 1024"));
    let (compared, changed) = ("(> (g) 1)".repeat(20_000), "(increase (f) 1)".repeat(20_000));
    parse(&format!("(:action a :precondition (and {compared}) :effect (and {changed}))"))
        .expect("sound");
    let constants: String = (0..20_000).map(|i| format!("c{i} ")).collect();
    let facts: String = constants.split_whitespace().map(|c| format!("(p {c})")).collect();
    let durative = format!(
        "(:constants {constants}) (:durative-action a :parameters () :duration (= ?duration 1)
         :condition (and (at start (and {facts})) (over all (and {facts})))
         :effect (and (at start (and {facts})) (at end (and {facts}))))"
    );
    assert_eq!(parse(&durative).expect("sound").actions[0].preconditions.len(), 20_000);
    let variables: String = (0..2000).map(|i| format!("?v{i} ")).collect();
    let quantified = format!("(:action a :precondition (forall ({variables}) (p ?v0)))");
    assert!(said(parse(&quantified)).contains("too many variables; expected at most 1024"));
    assert!(began.elapsed().as_secs() < 5, "{:?}", began.elapsed());
}

#[test]
fn json_nested_a_million_deep_is_refused_by_every_reader() {
    let deep = "[".repeat(1_000_000);
    let object = "{\"objects\":".repeat(1_000_000);
    for text in [deep.as_bytes(), object.as_bytes()] {
        said(Recording::parse(text, "x"));
        said(RelationalDomain::parse(text, "x"));
        said(DataTask::parse(text, "x"));
        said(NutsAndBolts::parse(text, "x"));
    }
}

#[test]
fn a_kind_with_a_name_that_recordings_refuse_is_refused_in_the_settings() {
    for kind in ["nut_kind", "bolt_kind"] {
        let settings = format!(r#"{{"{kind}": "{}"}}"#, "n".repeat(300));
        let message = said(NutsAndBolts::parse(settings.as_bytes(), "cell.json"));
        assert!(message.contains("1 to 190 characters"), "{message}");
        let settings = format!(r#"{{"{kind}": "{}"}}"#, "n".repeat(190));
        let longest = NutsAndBolts::parse(settings.as_bytes(), "cell.json").expect("it fits");
        // Each name of a recording is at most 10 characters longer than a kind.
        assert!(longest.places().iter().all(|place| place.chars().count() <= 200));
    }
}

#[test]
fn synthetic_recordings_too_large_to_be_read_again_are_refused_before_they_are_made() {
    let huge = SyntheticDemonstrations {
        demos: 10_000,
        nuts: 50,
        bolts: 50,
        fail_rate: 0.9,
        ..SyntheticDemonstrations::default()
    };
    let message = said(huge.record(Seed::new(1)));
    assert!(message.contains("`demos` is 10000; expected fewer demonstrations"), "{message}");
    let usual = SyntheticDemonstrations { demos: 10_000, ..SyntheticDemonstrations::default() };
    let made = usual.record(Seed::new(1)).expect("as large as allowed");
    assert_eq!(made.recording.demos.len(), 10_000);
}

/// Returns what the report on a folder with these files does not show.
fn missing(files: &[(&str, &[u8])]) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, content) in files {
        std::fs::write(folder.path().join(name), content).expect("written");
    }
    report(folder.path()).expect("a folder of a run").missing
}

#[test]
fn a_report_on_hostile_files_names_each_of_them() {
    let nested = format!("{{\"format\":\"symbolt-run\",\"scene\":{}", "[".repeat(3_000_000));
    let trace = "{\"episode\":0,\"touch\":{\"t\":0,\"part\":0,\"contact\":true}}\n".repeat(500_000);
    let zip = b"PK\x05\x06\0\0\0\0\x01\0\x01\0\0\0\0\0\0\0\0\0\0\0".repeat(100_000);
    let files: [(&str, &[u8]); 4] = [
        ("run.json", nested.as_bytes()),
        ("trace.jsonl", trace.as_bytes()),
        ("arrays.npz", &zip),
        ("domain.json", &[b'['; 1_000_000]),
    ];
    let said = missing(&files);
    let begins = |name: &str| said.iter().any(|why| why.starts_with(name) && why.len() < 1200);
    for name in [
        "run.json",
        "trace.jsonl: only the first 200000 lines",
        "arrays.npz: ",
        "domain.json",
        "recording",
    ] {
        assert!(begins(name), "{name}: {said:?}");
    }
    let large = vec![b' '; 33 << 20];
    let said = missing(&[("trace.jsonl", &large), ("run.json", &large)]);
    assert!(said.iter().any(|why| why.contains("expected at most 32 MiB for a trace")), "{said:?}");
    assert!(said.iter().any(|why| why.contains("expected at most 2 MiB for a table")), "{said:?}");
}

#[test]
fn a_run_with_more_modules_than_a_planner_has_is_refused() {
    let mut facts = serde_json::json!({
        "format": "symbolt-run", "version": 1, "symbolt": "", "command": "", "seed": 1, "goal": "", "mode": "direct",
        "planner": {}, "scene": {}, "summary": {}, "modules": [], "populations": [],
    });
    facts["modules"] =
        vec![serde_json::json!({"name": "m", "names": [], "shows": ""}); 50_000].into();
    let said = missing(&[("run.json", facts.to_string().as_bytes())]);
    assert!(
        said.iter().any(|why| why.contains("`modules` has 50000 entries; expected at most 4096")),
        "{said:?}"
    );
}

#[test]
fn a_model_or_journal_with_a_first_line_of_megabytes_is_refused() {
    let layers: Vec<String> = (0..500_000).map(|i| format!("\"{i}\":[]")).collect();
    let layers = layers.join(",");
    let model = format!(
        "{{\"format\":\"symbolt-solved\",\"version\":1,\"layers\":{{{layers}}},\"checksum\":0}}\n"
    );
    let message = said(SolvedModel::decode(model.as_bytes()));
    assert!(message.contains("expected at most 4194304"), "{message}");
    let folder = tempfile::tempdir().expect("a folder");
    let cells = "{},".repeat(1_000_000);
    let journal = format!("{{\"format\":\"symbolt-trials\",\"cells\":[{cells}{{}}]}}\n");
    std::fs::write(folder.path().join("trials.bin"), journal).expect("written");
    let message = said(Origin::read(folder.path()));
    assert!(message.contains("expected at most 2097152"), "{message}");
}

#[test]
fn a_full_task_error_is_short() {
    let reason = TaskError::from(symbolt::task::InputFault {
        file: "x".into(),
        line: Some(1),
        field: String::new(),
        problem: "é".repeat(100_000),
        expected: "y".repeat(100_000),
    });
    let said = reason.to_string();
    assert!(said.chars().count() < 9_000 && said.contains("...; expected y"), "{}", said.len());
}

#[cfg(all(feature = "cli", unix))]
mod commands {
    use std::path::Path;
    use std::process::{Command, Output, Stdio};

    const PROGRAM: &str = env!("CARGO_BIN_EXE_symbolt");

    fn run(folder: &Path, args: &[&str], stdin: Stdio) -> (Option<i32>, String) {
        let command = Command::new(PROGRAM).current_dir(folder).args(args).stdin(stdin).output();
        let Output { status, stderr, .. } = command.expect("it starts");
        (status.code(), String::from_utf8_lossy(&stderr).into_owned())
    }

    /// A folder with a recording, a domain and a scene.
    fn prepared() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        let steps: [&[&str]; 3] = [
            &["record", "--kinematic", "--demos", "3", "--out", "demos.jsonl", "--quiet"],
            &["record", "--kinematic", "--scene", "--out", "scene.json", "--quiet"],
            &["learn", "demos.jsonl", "--out", "domain.json", "--quiet"],
        ];
        for args in steps {
            let (code, said) = run(folder.path(), args, Stdio::null());
            assert_eq!(code, Some(0), "{args:?}: {said}");
        }
        folder
    }

    #[test]
    fn a_device_without_end_is_refused_by_every_command_that_reads() {
        let folder = prepared();
        std::os::unix::fs::symlink("/dev/zero", folder.path().join("zero")).expect("linked");
        let commands: [&[&str]; 14] = [
            &["check", "zero"],
            &["learn", "zero", "--out", "x"],
            &["classify", "zero", "demos.jsonl"],
            &["classify", "domain.json", "zero"],
            &["plan", "zero", "--scene", "scene.json"],
            &["plan", "domain.json", "--scene", "zero"],
            &["actions", "domain.json", "--scene", "zero"],
            &["run", "--config", "zero", "--out", "x"],
            &["run", "--task-file", "zero", "--out", "x"],
            &["record", "--config", "zero"],
            &["config", "--task-file", "zero"],
            &["rename", "zero", "A=B"],
            &["learn-model", "zero", "demos.jsonl"],
            &["bench", "bind", "--load", "zero"],
        ];
        for args in commands {
            let (code, said) = run(folder.path(), args, Stdio::null());
            assert_eq!(code, Some(2), "{args:?}: {said}");
            assert!(said.contains("it is not a regular file"), "{args:?}: {said}");
        }
    }

    #[test]
    fn standard_input_without_end_is_read_up_to_the_limit() {
        let folder = tempfile::tempdir().expect("a folder");
        let zero = || Stdio::from(std::fs::File::open("/dev/zero").expect("a device"));
        for path in ["-", "/dev/stdin"] {
            let (code, said) = run(folder.path(), &["plan", path, "--scene", "x"], zero());
            assert_eq!(code, Some(2), "{said}");
            assert!(
                said.contains("has more than 4 MiB; expected at most 4 MiB for a domain"),
                "{said}"
            );
        }
    }

    #[test]
    fn pipes_are_read_and_a_pipe_that_nobody_writes_to_is_refused() {
        let folder = prepared();
        let shell = |script: &str| {
            let mut command = Command::new("bash");
            command.args(["-c", script, PROGRAM]).current_dir(folder.path());
            let output = command.output().expect("a shell");
            (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
        };
        for script in [
            "cat demos.jsonl | $0 check -",
            "cat demos.jsonl | $0 check /dev/stdin",
            "$0 check <(cat demos.jsonl)",
            "$0 check <(sleep 0.3; cat demos.jsonl)",
            "mkfifo p; (sleep 0.3; cat demos.jsonl > p) & $0 check p",
        ] {
            let (code, said) = shell(script);
            assert_eq!(code, Some(0), "{script}: {said}");
            assert!(said.contains("a valid recording: 3 demonstrations"), "{script}: {said}");
        }
        let made = Command::new("mkfifo").arg(folder.path().join("nobody")).status();
        assert!(made.expect("mkfifo").success());
        let (code, said) = run(folder.path(), &["check", "nobody"], Stdio::null());
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains("it is a pipe, and nothing writes to it"), "{said}");
    }

    #[test]
    fn a_report_on_a_folder_with_pipes_and_devices_ends() {
        let folder = tempfile::tempdir().expect("a folder");
        let made = Command::new("mkfifo").arg(folder.path().join("trace.jsonl")).status();
        assert!(made.expect("mkfifo").success());
        std::os::unix::fs::symlink("/dev/zero", folder.path().join("run.json")).expect("linked");
        std::os::unix::fs::symlink("/dev/zero", folder.path().join("arrays.npz")).expect("linked");
        let said = symbolt::report::report(folder.path()).expect("a folder of a run").missing;
        for name in ["run.json", "trace.jsonl", "arrays.npz"] {
            let expected = format!("{name}: it is not a regular file");
            assert!(said.contains(&expected), "{expected} in {said:?}");
        }
    }

    #[test]
    fn demonstrations_without_number_are_refused_before_any_work() {
        let folder = tempfile::tempdir().expect("a folder");
        let huge = ["record", "--demos", "18446744073709551615", "--out", "x"];
        let (code, said) = run(folder.path(), &huge, Stdio::null());
        assert_eq!(code, Some(2));
        assert!(said.contains("--demos 18446744073709551615: must be 1 to 1000"), "{said}");
        let (code, said) = run(
            folder.path(),
            &[
                "record",
                "--kinematic",
                "--demos",
                "10000",
                "--demo-nuts",
                "50",
                "--demo-bolts",
                "50",
                "--fail-rate",
                "0.9",
            ],
            Stdio::null(),
        );
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains("fewer demonstrations, parts or failures"), "{said}");
    }
}
