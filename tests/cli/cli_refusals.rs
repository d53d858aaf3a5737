//! Every option of every command that cannot be used is refused before any work: one sentence, nothing written.

#![cfg(all(unix, feature = "cli"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::Path;
use std::process::{Command, Stdio};

struct Ran {
    code: Option<i32>,
    out: String,
    err: String,
}

fn run(folder: &Path, args: &[&str]) -> Ran {
    let mut command = Command::new(env!("CARGO_BIN_EXE_symbolt"));
    let output = command.args(args).current_dir(folder).stdin(Stdio::null()).output();
    let output = output.expect("it starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ran { code: output.status.code(), out: text(&output.stdout), err: text(&output.stderr) }
}

/// Returns every path below a folder with the length of its file, hidden ones too.
fn tree(folder: &Path) -> Vec<(String, u64)> {
    let mut all = Vec::new();
    for entry in folder.read_dir().expect("a folder").flatten() {
        let (path, found) = (entry.path(), entry.metadata().expect("there"));
        all.push((path.display().to_string(), found.len()));
        if found.is_dir() {
            all.extend(tree(&path));
        }
    }
    all.sort();
    all
}

/// A folder with a recording, a scene, domains of both learners, settings and a shard.
fn prepared() -> tempfile::TempDir {
    let place = tempfile::tempdir().expect("a folder");
    let made: [&[&str]; 6] = [
        &["record", "--kinematic", "--demos", "3", "--quiet", "--out", "demos.jsonl"],
        &["record", "--kinematic", "--scene", "--quiet", "--out", "scene.json"],
        &["learn", "demos.jsonl", "--quiet", "--out", "domain.json"],
        &["learn", "demos.jsonl", "--method", "paper", "--quiet", "--out", "paper.json"],
        &["config", "--out", "cell.json"],
        &["experiment", "figure-1a", "--trials", "2", "--shard", "1/2", "--quiet", "--out", "part"],
    ];
    for args in made {
        let ran = run(place.path(), args);
        assert_eq!(ran.code, Some(0), "{args:?}: {}", ran.err);
    }
    std::fs::create_dir(place.path().join("folder")).expect("makes");
    std::os::unix::fs::symlink("nowhere", place.path().join("link")).expect("links");
    place
}

/// Checks that a command is refused with this code and this sentence, and that it did no work. Without `--quiet` every
/// piece of work begins with a line of progress, so a single line on standard error means that none was begun.
fn refused(here: &Path, args: &[&str], code: i32, part: &str) {
    let before = tree(here);
    let ran = run(here, args);
    assert_eq!(ran.code, Some(code), "{args:?}: {}{}", ran.out, ran.err);
    assert!(ran.err.contains(part), "{args:?}: {part} in {}", ran.err);
    assert_eq!(ran.out, "", "{args:?}");
    let sentence = ran.err.starts_with("symbolt: ") && ran.err.lines().count() == 1;
    assert!(sentence, "{args:?}: {}", ran.err);
    assert_eq!(tree(here), before, "{args:?}");
}

#[test]
fn an_output_file_that_cannot_be_written_is_refused_before_any_work() {
    let place = prepared();
    let commands: [&[&str]; 10] = [
        &["record", "--out"],
        &["record", "--kinematic", "--out"],
        &["learn", "demos.jsonl", "--out"],
        &["learn-model", "d.pddl", "steps", "--out"],
        &["classify", "domain.json", "demos.jsonl", "--out"],
        &["plan", "domain.json", "--scene", "scene.json", "--out"],
        &["actions", "domain.json", "--scene", "scene.json", "--out"],
        &["report", "part", "--out"],
        &["config", "--out"],
        &["bench", "bind", "--save"],
    ];
    let long = "x".repeat(300);
    let places = [
        ("demos.jsonl", 2, "demos.jsonl exists already; choose another name or add --force"),
        ("link", 2, "link exists already"),
        ("no/such", 1, "cannot write no/such: No such file"),
        ("folder", 2, "cannot write folder: it is a folder; expected a file"),
        ("new/", 2, "cannot write new/: the name is that of a folder"),
        ("demos.jsonl/x", 2, "cannot write demos.jsonl/x: Not a directory"),
        ("/dev/full", 2, "cannot write /dev/full: it is not a regular file"),
        ("/proc/x", 1, "cannot write /proc/x: "),
        (&long, 1, "File name too long"),
        ("", 2, "a value is required for"),
    ];
    for args in commands {
        for (out, code, part) in places {
            refused(place.path(), &[args, &[out][..]].concat(), code, part);
            if !part.contains("exists already") {
                let forced = [args, &[out, "--force"][..]].concat();
                refused(place.path(), &forced, code, part);
            }
        }
    }
    let rename = ["rename", "domain.json", "NUT_AT_START=NUT", "--out"];
    for (out, code, part) in places {
        refused(place.path(), &[&rename[..], &[out]].concat(), code, part);
    }
}

#[test]
fn an_output_folder_that_cannot_be_written_is_refused_before_any_work() {
    let place = prepared();
    let commands: [&[&str]; 3] = [
        &["run", "--out"],
        &["experiment", "figure-4", "--out"],
        &["merge", "figure-1a", "part", "--out"],
    ];
    let long = format!("new/{}", "x".repeat(300));
    for args in commands {
        let places = [
            ("demos.jsonl", 2, "cannot write to demos.jsonl: it is a file; expected a folder"),
            ("demos.jsonl/x", 2, "cannot make demos.jsonl/x: Not a directory"),
            ("/proc/x/y", 1, "cannot make /proc/x/y: No such file"),
            ("/proc", 1, "cannot write to /proc: "),
            ("link/x", 1, "cannot make link/x: "),
            (&long, 1, "File name too long"),
            ("-", 2, "--out -: must be a folder"),
            ("", 2, "a value is required for"),
        ];
        for (out, code, part) in places {
            refused(place.path(), &[args, &[out][..]].concat(), code, part);
        }
    }
    // A folder made for a merge that fails is not left behind.
    let half = ["merge", "figure-1a", "part", "--out", "deep/whole"];
    refused(place.path(), &half, 2, "7 of 14 trials are in none of the folders");
}

#[test]
fn a_bad_option_of_any_command_is_refused_before_any_work() {
    let place = prepared();
    let record = "record --demos 1";
    let kinematic = "record --kinematic --demos 1";
    let plan = "plan domain.json --scene scene.json";
    let paper = "plan paper.json --scene scene.json";
    let classify = "classify domain.json demos.jsonl";
    let cases = [
        // The planner.
        (
            "run",
            "--mode spiking",
            "--mode: there is no mode `spiking` (did you mean `lif`?); the modes are: direct, rate, lif",
        ),
        (plan, "--mode foo", "--mode: there is no mode `foo`; the modes are: direct, rate, lif"),
        ("bench bind", "--mode foo", "--mode: there is no mode `foo`; the modes are: direct"),
        ("run", "--planner chain --dimensions 0", "--dimensions 0: must be "),
        (plan, "--goal NOWHERE", "NOWHERE"),
        (paper, "--goal NOWHERE", "NOWHERE"),
        // Episodes and demonstrations.
        ("run", "--demos 0", "--demos 0: must be 1 to 1000"),
        ("run", "--demos 1001", "--demos 1001: must be 1 to 1000"),
        ("record", "--demos 1001 --out new", "--demos 1001: must be 1 to 1000"),
        ("record --kinematic", "--demos 10001 --out new", "--demos 10001: must be 1 to 10000"),
        ("record", "--scene --demos 3 --out new", "cannot be used with"),
        ("run", "--demos x", "--demos x: must be a whole number"),
        ("run", "--episodes 0", "--episodes 0: must be 1 to 1000"),
        ("run", "--episodes -1", "--episodes -1: must be 1 to 1000"),
        ("run", "--record-episode 2", "--record-episode 2: must be 1, the number of --episodes"),
        ("run", "--nuts 9", "--nuts 9: must be 1 to 4"),
        ("run", "--bolts 0", "--bolts 0: must be 1 to 4"),
        ("run", "--demo-nuts 9", "--demo-nuts 9: must be 1 to 4"),
        ("run", "--demo-bolts 9", "--demo-bolts 9: must be 1 to 4"),
        ("run", "--drop-rate 1.5", "--drop-rate 1.5: must be 0 to 1"),
        ("run", "--drop-rate nan", "--drop-rate NaN: must be 0 to 1"),
        ("run", "--method guess", "invalid value 'guess' for '--method <METHOD>'"),
        ("run", "--task teapot", "there is no task `teapot`; the tasks are: "),
        ("run", "--task drawer --nuts 2", "--nuts belongs to the task nuts-and-bolts"),
        ("run", "--task-file missing.json", "cannot read missing.json"),
        ("run", "--task-file demos.jsonl", "demos.jsonl"),
        ("run", "--config missing.json", "cannot read missing.json"),
        ("run", "--config demos.jsonl", "demos.jsonl"),
        ("run", "--config folder", "cannot read folder"),
        ("run", "--pose-noise 1", "--pose-noise 1: must be MM,DEG"),
        ("run", "--outliers 2", "--outliers 2: must be 0 to 1"),
        ("run", "--missing nan", "--missing NaN: must be 0 to 1"),
        ("run", "--swaps -0.1", "--swaps -0.1: must be 0 to 1"),
        ("run", "--threads 1025", "--threads 1025: must be 0 to 1024"),
        ("run", "--seed -1", "--seed -1: must be 0 to 18446744073709551615"),
        (record, "--demo-nuts 9", "--demo-nuts 9: must be 1 to 4"),
        (record, "--task teapot", "there is no task `teapot`"),
        (record, "--config missing.json", "cannot read missing.json"),
        (record, "--labels", "--labels needs --kinematic"),
        (record, "--pose-noise 1,x", "--pose-noise 1,x: must be MM,DEG"),
        (record, "--swaps 2", "--swaps 2: must be 0 to 1"),
        (record, "--fail-rate 0.1", "--kinematic"),
        (record, "--threads 9999", "--threads 9999: must be 0 to 1024"),
        ("record", "--demos 0", "--demos 0: must be "),
        (kinematic, "--config cell.json", "--config needs the scene in physics"),
        (kinematic, "--task drawer", "--kinematic generates only nuts and bolts"),
        (kinematic, "--fail-rate 1", "--fail-rate 1: must be 0 to 0.9"),
        (kinematic, "--loss-rate 2", "--loss-rate 2: must be 0 to 1"),
        (kinematic, "--knock-rate -1", "--knock-rate -1: must be 0 to 1"),
        (kinematic, "--demo-nuts 60", "--demo-nuts 60: must be 1 to 50"),
        (kinematic, "--order first", "invalid value 'first' for '--order"),
        // Learning and reading.
        ("learn demos.jsonl", "--method guess", "invalid value 'guess'"),
        ("learn demos.jsonl", "--threshold 0", "--threshold 0: must be a length above 0"),
        (
            "learn demos.jsonl",
            "--threshold 1mm --method relational",
            "--threshold needs --method paper",
        ),
        ("learn demos.jsonl", "--p 0", "--p 0: must be a finite number"),
        ("learn demos.jsonl", "--p nan --method paper", "--p NaN: must be a finite number"),
        ("learn demos.jsonl", "--threads 1025", "--threads 1025: must be 0 to 1024"),
        ("learn-model d.pddl", "missing", "cannot read d.pddl"),
        ("learn-model - -", "", "can come from standard input (-)"),
        (classify, "--limit 0", "--limit 0: must be a finite number above 0"),
        ("classify missing.json demos.jsonl", "", "cannot read missing.json"),
        ("classify domain.json missing.jsonl", "", "cannot read missing.jsonl"),
        (plan, "--limit nan", "--limit NaN: must be a finite number above 0"),
        ("plan domain.json --scene missing.json", "", "cannot read missing.json"),
        ("actions domain.json --scene scene.json", "--limit -1", "--limit -1: must be "),
        ("actions domain.json --scene missing.json", "", "cannot read missing.json"),
        ("rename domain.json", "NUT_AT_START", "`NUT_AT_START` is not of the form OLD=NEW"),
        ("rename missing.json A=B", "", "cannot read missing.json"),
        ("check missing.json", "", "cannot read missing.json"),
        ("report missing", "", "cannot read missing"),
        ("report folder", "", "folder"),
        ("config", "--task teapot", "there is no task `teapot`"),
        // Experiments.
        ("experiment table-5", "", "there is no experiment `table-5`; the experiments are: "),
        ("experiment ../x", "", "there is no experiment `../x`"),
        ("experiment figure-4", "--shard 3/2", "--shard 3/2: must be I/N"),
        ("experiment figure-4", "--trials 0", "--trials 0: must be 1 to 100000"),
        ("experiment figure-4", "--trials 100001", "--trials 100001: must be 1 to 100000"),
        ("experiment figure-4", "--threads 1025", "--threads 1025: must be 0 to 1024"),
        ("experiment figure-4", "--force --salvage", "cannot be used with"),
        ("experiment threshold", "--recording missing.jsonl", "cannot read missing.jsonl"),
        ("experiment threshold", "--recording scene.json", "scene.json"),
        (
            "experiment kitchen",
            "--problems folder",
            "--problems folder: must be absent; only the experiment `ipc` takes a folder of problems",
        ),
        (
            "experiment kitchen",
            "--recording missing.jsonl",
            "--recording missing.jsonl: must be absent; only the experiment `threshold` takes a recording",
        ),
        ("experiment ipc", "--problems -", "--problems -: must be a folder; for a folder of this"),
        ("experiment ipc", "--problems missing", "cannot read missing"),
        ("merge figure-1a --out new", "", "no folder is given"),
        ("merge figure-1a folder --out new", "", "cannot read folder/trials.bin"),
        ("merge table-5 part --out new", "", "there is no experiment `table-5`"),
        ("merge figure-1a part --out new", "--trials 0", "--trials 0: must be 1 to 100000"),
        // Networks.
        ("bench teapot", "", "teapot"),
        ("bench bind", "--sim-seconds nan", "--sim-seconds NaN: must be 0.3 to 3600"),
        ("bench bind", "--runs 1001", "--runs 1001: must be 1 to 1000"),
        ("bench bind", "--neurons-scale 0", "--neurons-scale 0: must be more than 0"),
        (
            "bench bind",
            "--neurons-scale 1e-9 --quiet",
            "--neurons-scale 0.000000001: the graph has 1 fault: - `bind/products`: `neurons` is 0",
        ),
        ("bench bind", "--neurons-scale 500 --quiet", "--neurons-scale 500: the graph has 1 fault"),
        ("bench bind", "--dimensions 0 --quiet", "--dimensions 0: must be 2 to 1048576"),
        (
            "bench planner",
            "--dimensions 3 --quiet",
            "or no ceiling (`any_similarity`) (--dimensions)",
        ),
        ("bench bind", "--unbinding guess", "--unbinding guess: must be one of products, fixed"),
        ("bench bind", "--choice guess", "--choice guess: must be one of winner, "),
        ("bench bind", "--load missing --quiet", "cannot read missing"),
        ("bench bind", "--load demos.jsonl --save new", "cannot be used with"),
        ("bench bind", "--mode direct --save new", "direct mode has no neurons"),
        ("completions teapot", "", "invalid value 'teapot'"),
        ("man lern", "", "unrecognized command 'lern' (did you mean `learn`?); the commands are: "),
    ];
    assert_eq!(cases.len(), 104);
    for (command, options, part) in cases {
        let args: Vec<&str> = command.split(' ').chain(options.split_whitespace()).collect();
        refused(place.path(), &args, 2, part);
    }
}
