//! `docs/files.md` against the files and the JSON that the program writes: every key is listed, and none is that is not there.

#![cfg(feature = "cli")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

/// Standard output of a command in a folder. The exit code may be 0 or 1.
fn output(folder: &Path, command: &str) -> String {
    let mut program = Command::cargo_bin("symbolt").expect("the program was built");
    let output = program.current_dir(folder).args(command.split(' ')).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(0 | 1)), "{command}: {said}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// The JSON values of a text: one, or one a line.
fn values(text: &str) -> Vec<Value> {
    let all = serde_json::Deserializer::from_str(text).into_iter();
    let all: Vec<Value> = all.collect::<Result<_, _>>().expect("JSON");
    assert!(!all.is_empty());
    all
}

/// The part of a page below a heading, up to the next heading.
fn part<'p>(page: &'p str, heading: &str) -> &'p str {
    let (_, part) = page.split_once(&format!("\n{heading}\n")).expect(heading);
    part.split("\n#").next().expect("a part")
}

/// The keys in the first column of a table, each with whether its row says that it need not be there.
fn listed(part: &str) -> Vec<(&str, bool)> {
    let rows = part.lines().filter(|line| line.starts_with("| `"));
    let mut keys = Vec::new();
    for row in rows {
        let mut cells = row.trim_matches('|').splitn(2, " | ");
        let names = cells.next().expect("names");
        let text = cells.next().expect(names);
        let optional = text.contains("optional") || text.contains("only with");
        keys.extend(names.split('`').skip(1).step_by(2).map(|key| (key, optional)));
    }
    assert!(keys.len() > 3);
    keys
}

/// Notes the keys of a value that are listed, and those that are not.
fn look(value: &Value, path: &str, keys: &[(&str, bool)], seen: &mut BTreeSet<String>) {
    let open = format!("{path}{{}}");
    let known = keys.iter().find(|(key, _)| *key == path || *key == open);
    let below = |key: &str| key.strip_prefix(path).is_some_and(|rest| rest.starts_with(['.', '[']));
    match value {
        _ if known.is_some() => {
            seen.extend(known.map(|(key, _)| (*key).to_owned()));
        }
        Value::Object(map) => map.iter().for_each(|(name, value)| {
            let dot = if path.is_empty() { "" } else { "." };
            look(value, &format!("{path}{dot}{name}"), keys, seen);
        }),
        Value::Array(list) => {
            assert!(list.is_empty() || !path.is_empty());
            list.iter().for_each(|value| look(value, &format!("{path}[]"), keys, seen));
        }
        Value::Null if keys.iter().any(|(key, _)| below(key)) => {}
        _ => {
            seen.insert(format!("NOT LISTED {path}"));
        }
    }
}

/// Returns what is wrong in a table: keys that it lacks, and keys that no value has.
fn faults(part: &str, values: &[Value]) -> Vec<String> {
    let keys = listed(part);
    let mut seen = BTreeSet::new();
    values.iter().for_each(|value| look(value, "", &keys, &mut seen));
    let unlisted = seen.iter().filter(|key| key.starts_with("NOT LISTED")).cloned();
    let gone = keys.iter().filter(|(key, optional)| !optional && !seen.contains(*key));
    unlisted.chain(gone.map(|(key, _)| format!("never there: {key}"))).collect()
}

#[test]
fn every_key_of_files_and_json_is_listed_and_no_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("docs/files.md")).expect("the page");
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let file = |name: &str| fs::read_to_string(folder.join(name)).expect(name);
    let run = |command: &str| values(&output(folder, command));
    let recorded = run("record --kinematic --demos 5 --out demos.jsonl --json --quiet");
    let recording = file("demos.jsonl");
    fs::write(folder.join("scene.json"), recording.lines().next().expect("a line"))
        .expect("written");
    let learn = run("learn demos.jsonl --out domain.json --json --quiet");
    let noisy = "record --kinematic --demos 6 --pose-noise 1,1 --out noisy.jsonl --json --quiet";
    assert_eq!(run(noisy).len(), 1);
    run("learn noisy.jsonl --out level.json --json --quiet");
    let domains = values(&[file("domain.json"), file("level.json")].concat());
    assert!(!domains[1]["level"].is_null(), "fixtures stand level");
    let both = |command: &str| {
        let mut all = run(command);
        all.extend(run(&format!("{command} --planner chain")));
        all
    };
    let examples = root.join("examples");
    let [kitchen, tea] =
        ["kitchen.pddl", "tea.pddl"].map(|f| examples.join(f).display().to_string());
    let bench =
        "bench bind --neurons-scale 0.1 --dimensions 64 --sim-seconds 0.3 --runs 1 --json --quiet";
    let ran = run("run --demos 1 --out out --json --quiet");
    let mut wrong = Vec::new();
    for (heading, values) in [
        ("## Recordings and scenes", values(&recording)),
        ("## Domains", domains),
        ("### `symbolt learn`", learn),
        ("### `symbolt classify`", run("classify domain.json scene.json --json --quiet")),
        ("### `symbolt actions`", run("actions domain.json --scene scene.json --json --quiet")),
        (
            "### `symbolt plan` in a scene",
            both("plan domain.json --scene scene.json --json --quiet"),
        ),
        ("### `symbolt plan` of PDDL", run(&format!("plan {kitchen} {tea} --json --quiet"))),
        ("### `symbolt run`", ran),
        ("### `symbolt bench`", run(bench)),
    ] {
        let found = faults(part(&page, heading), &values);
        wrong.extend(found.into_iter().map(|fault| format!("{heading}: {fault}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let others = part(&page, "### Other commands");
    for (command, values) in [
        ("record", recorded),
        ("record", run("record --demos 1 --out one.jsonl --json --quiet")),
        ("check", run("check demos.jsonl --json --quiet")),
        ("check", run("check domain.json --json --quiet")),
        ("check", run("check scene.json --json --quiet")),
        ("pddl", run("pddl domain.json --scene scene.json --out pddl --json --quiet")),
        ("rename", run("rename domain.json NUT_AT_START=LYING --json --quiet")),
        ("report", run("report out --json --quiet")),
    ] {
        let row = others.lines().find(|line| line.starts_with(&format!("| `symbolt {command}` |")));
        let row = row.expect(command);
        let [value] = &values[..] else { panic!("{command}") };
        let keys: Vec<&String> = value.as_object().expect("an object").keys().collect();
        assert!(!keys.is_empty());
        for key in keys {
            assert!(row.contains(&format!("`{key}`")), "{command}: {key}");
        }
    }
}

#[test]
fn a_key_that_is_missing_or_too_many_is_found() {
    let table =
        "| key | content |\n|---|---|\n| `a`, `b[].c` | - |\n| `d{}` | - |\n| `e` | optional |\n";
    let sound = values(r#"{"a": null, "b": [{"c": {"any": 1}}], "d": {"own": 1}}"#);
    assert_eq!(faults(table, &sound), Vec::<String>::new());
    let more = values(r#"{"a": 1, "b": [{"c": 1, "f": 2}], "d": {}, "e": 1}"#);
    assert_eq!(faults(table, &more), ["NOT LISTED b[].f"]);
    let less = values(r#"{"a": 1, "b": null, "d": {}}"#);
    assert_eq!(faults(table, &less), ["never there: b[].c"]);
}
