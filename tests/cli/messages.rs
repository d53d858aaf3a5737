//! What the program says: about files of another kind, names that do not exist, options without an effect, and five
//! hundred mutations of each kind of file. No message is longer than ten lines or 1,000 characters.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use symbolt::plan::strips;
use symbolt::task::domain::RelationalDomain;
use symbolt::task::import::{Mapping, Streams};
use symbolt::task::tasks::Task;
use symbolt::task::tasks::file::DataTask;
use symbolt::task::tasks::nuts_and_bolts::NutsAndBolts;
use symbolt::task::{Recording, Snapshot};

use crate::mutate::Mutator;

struct Said {
    code: Option<i32>,
    out: String,
    err: String,
}

fn say(folder: &Path, args: &[&str], columns: Option<&str>) -> Said {
    let mut command = Command::new(env!("CARGO_BIN_EXE_symbolt"));
    command.env_remove("COLUMNS").envs(columns.map(|columns| ("COLUMNS", columns)));
    let output = command.args(args).current_dir(folder).stdin(Stdio::null()).output();
    let output = output.expect("it starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    Said { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

/// Returns what is wrong with the form of a message.
fn ill_formed(message: &str) -> Option<String> {
    let obeyed = |c: char| c.is_control() && c != '\n' || ('\u{202a}'..='\u{202e}').contains(&c);
    if message.lines().count() > 10 {
        return Some(format!("{} lines", message.lines().count()));
    }
    if message.chars().count() > 1_001 {
        return Some(format!("{} characters", message.chars().count()));
    }
    message.contains(obeyed).then(|| "a control character".into())
}

/// A folder with a file of each kind.
fn prepared() -> tempfile::TempDir {
    let place = tempfile::tempdir().expect("a folder");
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    let copied = [
        ("learned/table.json", "domain.json"),
        ("learned/table_scene.json", "scene.json"),
        ("learned/tower.jsonl", "demos.jsonl"),
        ("pddl/move.pddl", "d.pddl"),
        ("pddl/move_one.pddl", "p.pddl"),
    ];
    for (from, to) in copied {
        std::fs::copy(fixtures.join(from), place.path().join(to)).expect("copied");
    }
    let write =
        |name: &str, bytes: &[u8]| std::fs::write(place.path().join(name), bytes).expect("written");
    let scene = std::fs::read_to_string(place.path().join("scene.json")).expect("a scene");
    let mut metres: serde_json::Value = serde_json::from_str(&scene).expect("JSON");
    for object in metres["objects"].as_array_mut().expect("objects") {
        for value in object["position"].as_array_mut().expect("a position") {
            *value = (1e3 * value.as_f64().expect("a number")).into();
        }
    }
    write("mm.json", metres.to_string().as_bytes());
    let mut strewn: serde_json::Value = serde_json::from_str(&scene).expect("JSON");
    for (i, object) in strewn["objects"].as_array_mut().expect("objects").iter_mut().enumerate() {
        object["position"][2] = (0.3 + 0.1 * i as f64).into();
    }
    write("strewn.json", strewn.to_string().as_bytes());
    let whole = std::fs::read(place.path().join("domain.json")).expect("a domain");
    write("cut.json", &whole[..whole.len() / 2]);
    write("empty.json", b"");
    write("log.csv", b"t,a.x,a.y,a.z\n0,1,2,3\n1,1,2,3\n");
    write("packed.gz", b"\x1f\x8b\x08\0\0\0\0\0");
    write("foreign.json", br#"{"objects": [{"id": "a", "kind": "teapot", "position": [0, 0, 0], "orientation": [0, 0, 0, 1]}]}"#);
    write("escape.json", b"{\"objects\": [{\"id\": \"a\\u001b[31m\", \"kind\": \"cup\", \"position\": [0, 0, 0], \"orientation\": [0, 0, 0, 1]}]}");
    write("turned.json", "{\"objects\": [{\"id\": \"a\u{202e}b\", \"kind\": \"cup\", \"position\": [0, 0, 0], \"orientation\": [0, 0, 0, 1]}]}".as_bytes());
    let said = say(place.path(), &["config", "--task", "cup", "--out", "task.json"], None);
    assert_eq!(said.code, Some(0), "{}", said.err);
    place
}

#[test]
fn every_message_says_what_a_file_is_and_what_was_meant() {
    let place = prepared();
    let cases = [
        // Files of another kind.
        ("plan domain.json scene.json", 2, "`symbolt plan domain.json --scene scene.json`"),
        ("plan scene.json domain.json", 2, "`symbolt plan domain.json --scene scene.json`"),
        (
            "plan scene.json --scene domain.json",
            2,
            "is a scene and the second, domain.json, a learned domain; swap them",
        ),
        ("plan domain.json", 2, "domain.json is a learned domain; name its scene"),
        (
            "plan d.pddl --scene p.pddl",
            2,
            "d.pddl is a domain in PDDL; expected a learned domain; `symbolt plan d.pddl PROBLEM`",
        ),
        (
            "plan p.pddl d.pddl",
            2,
            "the first file, p.pddl, is a problem and the second, d.pddl, a domain; swap them",
        ),
        ("plan cut.json --scene scene.json", 2, ": a learned domain that is cut off here"),
        (
            "plan domain.json --scene demos.jsonl",
            2,
            "demos.jsonl is a recording; expected a scene; `symbolt learn demos.jsonl`",
        ),
        ("plan d.pddl log.csv", 2, "log.csv is a table (CSV); expected a problem in PDDL"),
        (
            "learn domain.json --quiet",
            2,
            "domain.json is a learned domain; expected a recording; `symbolt plan domain.json",
        ),
        ("learn scene.json --quiet", 2, "scene.json is a scene; expected a recording"),
        (
            "learn task.json --quiet",
            2,
            "task.json is a task file; expected a recording; `symbolt run --task-file task.json`",
        ),
        ("learn empty.json --quiet", 2, "empty.json is empty; expected a recording"),
        ("learn packed.gz --quiet", 2, "packed.gz is an archive (gzip); unpack it first"),
        (
            "learn log.csv --quiet",
            2,
            "log.csv is a table (CSV); expected a recording; `symbolt import log.csv`",
        ),
        (
            "classify demos.jsonl domain.json",
            2,
            "the first file, demos.jsonl, is a recording and the second, domain.json, a learned domain; swap them",
        ),
        (
            "classify domain.json d.pddl",
            2,
            "d.pddl is a domain in PDDL; expected a recording or a scene",
        ),
        ("rename demos.jsonl A=B", 2, "demos.jsonl is a recording; expected a learned domain"),
        ("run --task-file domain.json", 2, "domain.json is a learned domain; expected a task file"),
        ("run --config scene.json", 2, "scene.json is a scene; expected the settings of a task"),
        (
            "learn-model p.pddl demos.jsonl --quiet",
            2,
            "p.pddl is a problem in PDDL; expected a domain in PDDL",
        ),
        (
            "import log.csv --map domain.json",
            2,
            "domain.json is a learned domain; expected a mapping",
        ),
        ("import domain.json", 2, "domain.json is a learned domain; expected a log of poses"),
        (
            "bench bind --load domain.json --quiet",
            2,
            "domain.json is a learned domain; expected a model of solved populations",
        ),
        ("check d.pddl", 2, "d.pddl is a domain in PDDL; expected a recording, a scene, "),
        ("report domain.json", 2, "domain.json is a learned domain; expected the folder of a run"),
        // Names that do not exist.
        ("rn", 2, "(did you mean `run`?)"),
        ("run --task towr", 2, "there is no task `towr` (did you mean `tower`?); the tasks are: "),
        (
            "plan domain.json --scene scene.json --goal CUP_AT_PLAET",
            2,
            "(did you mean `CUP_AT_PLATE`?)",
        ),
        ("bench bnid", 2, "(did you mean `bind`?)"),
        (
            "bench bind --mode lfi",
            2,
            "`lfi` (did you mean `lif`?); the modes are: direct, rate, lif",
        ),
        ("run --mode spiking", 2, "there is no mode `spiking` (did you mean `lif`?); the modes"),
        ("run --mode exact", 2, "(did you mean `direct`?)"),
        // Names of files that do not exist.
        ("plan domian.json --scene scene.json", 2, "(os error 2) (did you mean `domain.json`?)"),
        ("plan domain.json --scene secne.json", 2, "(did you mean `scene.json`?)"),
        ("plan ./domian.json --scene scene.json", 2, "(did you mean `./domain.json`?)"),
        ("actions domian.json --scene scene.json", 2, "(did you mean `domain.json`?)"),
        ("learn demso.jsonl --quiet", 2, "(did you mean `demos.jsonl`?)"),
        ("classify domain.json demos.json", 2, "(did you mean `demos.jsonl`?)"),
        ("check domian.json", 2, "(did you mean `domain.json`?)"),
        ("rename domian.json A=B", 2, "(did you mean `domain.json`?)"),
        ("import logg.csv", 2, "(did you mean `log.csv`?)"),
        ("run --task-file taks.json", 2, "(did you mean `task.json`?)"),
        ("run --config taks.json", 2, "(did you mean `task.json`?)"),
        ("bench bind --load domian.json --quiet", 2, "(did you mean `domain.json`?)"),
        // Numbers out of their range.
        ("run --episodes -1", 2, "symbolt: --episodes -1: must be 1 to 1000\n"),
        ("run --record-episode -1", 2, "symbolt: --record-episode -1: must be 1 to 1000\n"),
        ("run --seed -3", 2, "symbolt: --seed -3: must be 0 to 18446744073709551615\n"),
        ("run --threads 1e9", 2, "symbolt: --threads 1e9: must be a whole number, 0 to 1024\n"),
        ("run --drop-rate often", 2, "symbolt: --drop-rate often: must be a number\n"),
        ("experiment tabel-4", 2, "(did you mean `table-4`?)"),
        // Options without an effect.
        ("plan d.pddl p.pddl --limit 5", 2, "--limit is for a scene; leave it out"),
        ("plan d.pddl p.pddl --grounding gated", 2, "--grounding is for a scene; leave it out"),
        (
            "classify domain.json scene.json --grounding nearest --limit 3",
            2,
            "--limit has an effect with --grounding gated only",
        ),
        ("bench bind --choice winner", 2, "--choice has an effect with the network `memory` only"),
        (
            "bench memory --unbinding fixed",
            2,
            "--unbinding has an effect with the network `planner` only",
        ),
        ("record --fail-rate 0.1", 2, "--kinematic"),
        ("record --kinematic --scene --fail-rate 0.1", 2, "'--scene'"),
        ("check domain.json --seed 3", 2, "unexpected argument '--seed' found"),
        (
            "bench large --neurons-scale 1000 --quiet",
            2,
            "the graph has 44 faults: - `achieved/gate/population`: `neurons` is 800000",
        ),
        // Scenes that do not fit.
        (
            "plan domain.json --scene foreign.json",
            2,
            "the domain knows no object of this scene: teapot; it has states of: ",
        ),
        (
            "classify domain.json foreign.json",
            2,
            "the domain knows no object of this scene: teapot",
        ),
        ("plan domain.json --scene mm.json --quiet", 2, "symbolt: the scene is "),
        ("plan domain.json --scene mm.json --quiet", 2, "the lengths are probably mm"),
        ("actions domain.json --scene mm.json", 2, "the lengths are probably mm"),
        ("plan domain.json --scene strewn.json --quiet", 1, "stuck: "),
        ("check escape.json", 2, "`a\\u{1b}[31m` has a control character"),
        ("classify domain.json turned.json", 2, "`a\\u{202e}b` has a control character"),
        ("plan domain.json --scene .", 2, ". is a folder; a scene in it is ./scene.json"),
    ];
    for (command, code, part) in cases {
        let args: Vec<&str> = command.split(' ').collect();
        let said = say(place.path(), &args, None);
        assert_eq!(said.code, Some(code), "{command}: {}{}", said.out, said.err);
        assert!(said.err.contains(part), "{command}: {part} in {}", said.err);
        assert!(
            said.err.lines().all(|line| line.starts_with("symbolt: ")),
            "{command}: {}",
            said.err
        );
        assert_eq!(ill_formed(&said.err), None, "{command}: {}", said.err);
    }
    // Nothing at all is printed where nothing is possible.
    let strewn = ["actions", "domain.json", "--scene", "strewn.json", "--json"];
    let said = say(place.path(), &strewn, None);
    assert_eq!((said.code, &*said.out), (Some(0), ""), "{}", said.err);
    // Nothing is asked where no file has a name like that.
    let said = say(place.path(), &["check", "nowhere.json"], None);
    assert!(!said.err.contains("did you mean"), "{}", said.err);
}

#[test]
fn a_message_is_never_longer_than_ten_lines_and_a_thousand_characters() {
    // The check finds what it is to find.
    for wrong in ["a\n".repeat(11), "x".repeat(1_100), "a\u{1b}[31m".into(), "a\u{202e}".into()] {
        assert!(ill_formed(&wrong).is_some(), "{wrong:?}");
    }
    let place = prepared();
    let long = "x".repeat(5_000);
    let lines = "y\n".repeat(50);
    for wrong in [&*long, &lines, "\u{1b}[31m\u{9b}2J\u{202e}"] {
        for args in [
            &["plan", wrong, "--scene", "scene.json"][..],
            &["plan", "domain.json", "--scene", "scene.json", "--goal", wrong],
            &["run", "--task", wrong],
            &["bench", wrong],
            &[wrong],
            &["rename", "domain.json", wrong],
        ] {
            let said = say(place.path(), args, None);
            assert_eq!(said.code, Some(2), "{}", said.err);
            assert_eq!(ill_formed(&said.err), None, "{args:?}: {}", said.err);
        }
    }
}

#[test]
fn tables_are_as_wide_as_the_terminal() {
    let place = prepared();
    let args = ["classify", "domain.json", "scene.json"];
    let widest = |columns: Option<&str>| {
        let said = say(place.path(), &args, columns);
        assert_eq!(said.code, Some(0), "{}", said.err);
        said.out.lines().map(|line| line.chars().count()).max().unwrap_or(0)
    };
    for (columns, most) in [("60", 60), ("80", 80), ("120", 120), ("200", 200)] {
        assert!(widest(Some(columns)) <= most, "{columns}");
    }
    assert!(widest(None) <= 80);
    let list = ["experiment"];
    let lines = |columns| say(place.path(), &list, Some(columns)).out.lines().count();
    assert!(lines("120") < lines("80") && lines("80") < lines("60"));
}

/// A kind of file, a valid file of it, and what its reader says.
type Reader = fn(&[u8]) -> Option<String>;

fn message<T, E: std::fmt::Display>(read: Result<T, E>) -> Option<String> {
    read.err().map(|error| error.to_string())
}

#[test]
fn five_hundred_mutations_of_each_kind_of_file_are_refused_in_short_sentences() {
    let place = prepared();
    let file = |name: &str| std::fs::read(place.path().join(name)).expect("a file");
    let settings = NutsAndBolts::default().settings().to_string();
    let mapping = Mapping::unknown().to_json().expect("JSON");
    let readers: [(&str, Vec<u8>, Reader); 9] = [
        ("domain", file("domain.json"), |b| message(RelationalDomain::parse(b, "x"))),
        ("scene", file("scene.json"), |b| message(Snapshot::parse(b, "x"))),
        ("recording", first_lines(&file("demos.jsonl"), 6), |b| message(Recording::parse(b, "x"))),
        ("task", file("task.json"), |b| message(DataTask::parse(b, "x"))),
        ("settings", settings.into_bytes(), |b| message(NutsAndBolts::parse(b, "x"))),
        ("mapping", mapping.into_bytes(), |b| message(Mapping::parse(b, "x"))),
        ("log", file("log.csv"), |b| message(Streams::new(Mapping::unknown()).add("x", b))),
        ("pddl", file("d.pddl"), |b| message(strips::Domain::parse(b, "x", strips::Bodies::Read))),
        ("problem", file("p.pddl"), |b| {
            let domain = include_bytes!("../fixtures/pddl/move.pddl");
            let domain = strips::Domain::parse(domain, "x", strips::Bodies::Read).expect("sound");
            message(strips::Problem::parse(b, "x", &domain))
        }),
    ];
    for (kind, seed, read) in &readers {
        assert_eq!(read(seed), None, "{kind}");
        let mut refused = 0;
        for number in 0..500 {
            let mut mutator = Mutator::new(number);
            let other = &readers[mutator.below(readers.len())].1;
            let bytes = mutator.mutate(seed, other);
            let Some(said) = read(&bytes) else { continue };
            refused += 1;
            let long = said.lines().count() > 10 || said.chars().count() > 1_000;
            assert!(!long, "{kind} {number}: {said}");
        }
        assert!(refused >= 100, "{kind}: {refused} refused");
    }
}

fn first_lines(bytes: &[u8], count: usize) -> Vec<u8> {
    bytes.split_inclusive(|b| *b == b'\n').take(count).flatten().copied().collect()
}

#[test]
fn mutated_files_never_end_the_program_with_a_panic_or_a_raw_control_character() {
    let place = prepared();
    let commands: [(&str, &str); 7] = [
        ("domain.json", "plan FILE --scene scene.json"),
        ("scene.json", "classify domain.json FILE"),
        ("scene.json", "plan domain.json --scene FILE"),
        ("demos.jsonl", "check FILE"),
        ("task.json", "config --task-file FILE"),
        ("d.pddl", "plan FILE p.pddl --time 0.1"),
        ("p.pddl", "plan d.pddl FILE --time 0.1"),
    ];
    let mut refused = 0;
    for (index, (file, command)) in commands.into_iter().enumerate() {
        let seed = std::fs::read(place.path().join(file)).expect("a file");
        for number in 0..12 {
            let mut mutator = Mutator::new(1_000 * index as u64 + number);
            let bytes = mutator.mutate(&seed, b"\x1b[31m\xc2\x9b\xe2\x80\xae");
            let mutated: PathBuf = place.path().join("FILE");
            std::fs::write(&mutated, bytes).expect("written");
            let args: Vec<&str> = command.split(' ').collect();
            let said = say(place.path(), &args, None);
            let code = said.code.unwrap_or(101);
            assert!((0..=2).contains(&code), "{command} {number}: {code} {}", said.err);
            refused += usize::from(code == 2);
            // Progress is no message, but obeys nobody either.
            assert_eq!(ill_formed(&said.err), None, "{command} {number}: {}", said.err);
            let raw = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
            assert!(!said.out.contains(raw), "{command} {number}: {:?}", said.out);
        }
    }
    assert!(refused > 20, "{refused}");
}
