//! Sweeps on a cluster: shards numbered by a launcher, killed and run again, their status, and their merge.

#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Variables of launchers. A test that runs inside a job must not see the job's own.
const LAUNCHERS: [&str; 5] =
    ["HQ_TASK_ID", "SLURM_ARRAY_TASK_ID", "OMPI_COMM_WORLD_RANK", "SLURM_PROCID", "SLURM_JOB_ID"];
const COUNTS: [&str; 2] = ["SLURM_STEP_NUM_TASKS", "OMPI_COMM_WORLD_SIZE"];

fn command(folder: &Path, args: &[&str], variables: &[(&str, String)]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_symbolt"));
    for name in LAUNCHERS.into_iter().chain(COUNTS) {
        command.env_remove(name);
    }
    command.args(args).current_dir(folder).envs(variables.iter().map(|(n, v)| (n, v)));
    command
}

fn symbolt(folder: &Path, args: &[&str], variables: &[(&str, String)]) -> Output {
    command(folder, args, variables).output().expect("it runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Runs and expects success.
fn good(folder: &Path, args: &[&str], variables: &[(&str, String)]) -> String {
    let output = symbolt(folder, args, variables);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", said(&output));
    printed(&output)
}

/// The variables of a task of a Slurm array.
fn array(id: u64, [min, max, count]: [u64; 3]) -> Vec<(&'static str, String)> {
    let pairs = [
        ("SLURM_ARRAY_TASK_ID", id),
        ("SLURM_ARRAY_TASK_MIN", min),
        ("SLURM_ARRAY_TASK_MAX", max),
        ("SLURM_ARRAY_TASK_COUNT", count),
        ("SLURM_ARRAY_TASK_STEP", 1),
    ];
    pairs.map(|(name, value)| (name, value.to_string())).into()
}

/// Splits a journal into its first line and the cells and trials of its complete records.
fn records(journal: &Path) -> (Value, BTreeSet<(u64, u64)>) {
    let bytes = std::fs::read(journal).expect("a journal");
    let end = bytes.iter().position(|b| *b == b'\n').expect("a first line");
    let header: Value = serde_json::from_slice(&bytes[..end]).expect("JSON");
    let length = 16 + 8 * header["width"].as_u64().expect("a width") as usize;
    let number = |bytes: &[u8]| bytes.iter().rev().fold(0, |sum, b| (sum << 8) | u64::from(*b));
    let records = bytes[end + 1..].chunks_exact(length);
    let done = records.map(|record| (number(&record[..4]), number(&record[4..12]))).collect();
    (header, done)
}

/// What a shard still lacks, computed from its journal: cell and trial.
fn lacking(journal: &Path) -> BTreeSet<(u64, u64)> {
    let (header, done) = records(journal);
    let shard = [0, 1].map(|at: usize| header["shard"][at].as_u64().expect("a number"));
    let cells = header["settings"]["cells"].as_array().expect("cells");
    let all = cells.iter().zip(0..).flat_map(|(cell, index)| {
        let trials = cell["trials"].as_u64().expect("a number");
        (shard[0]..trials).step_by(shard[1] as usize).map(move |trial| (index, trial))
    });
    all.filter(|trial| !done.contains(trial)).collect()
}

/// The missing trials of a shard or of all cells in the output of `merge --status --json`.
fn listed(cells: &Value, missing: &Value, key: &str) -> BTreeSet<(u64, u64)> {
    let cells = cells.as_array().expect("cells");
    let index =
        |settings: &Value| cells.iter().position(|c| c["cell"] == *settings).unwrap() as u64;
    let of_cell = |entry: &Value| {
        let cell = index(&entry["cell"]);
        let trials = entry[key].as_array().expect("trials").clone();
        trials.into_iter().map(move |trial| (cell, trial.as_u64().unwrap()))
    };
    missing.as_array().expect("entries").iter().flat_map(of_cell).collect()
}

fn status(folder: &Path, args: &[&str]) -> (Option<i32>, Value) {
    let all = [&["merge"], args, &["--status", "--json"]].concat();
    let output = symbolt(folder, &all, &[]);
    let table = serde_json::from_slice(&output.stdout);
    (output.status.code(), table.unwrap_or_else(|_| panic!("{}", said(&output))))
}

const TRIALS: &str = "320";

/// Kills a running shard with signal 9 as soon as its journal holds some trials.
fn kill_midway(child: &mut Child, journal: &Path) {
    let begun = Instant::now();
    loop {
        if journal.exists() && records(journal).1.len() >= 3 {
            break;
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "{} stays empty", journal.display());
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("killed");
    child.wait().expect("gone");
}

#[test]
#[cfg(unix)]
fn three_of_eight_shards_are_killed_named_rerun_and_merged_to_the_same_bytes() {
    let place = tempfile::tempdir().expect("a folder");
    let here = place.path();
    let base = ["experiment", "table-4", "--trials", TRIALS, "--threads", "1", "--quiet"];
    let whole = good(here, &[&base[..], &["--json", "--out", "whole"]].concat(), &[]);
    let names: Vec<String> = (1..=8).map(|i| format!("experiments/table-4-{i}-of-8")).collect();
    let folders: Vec<&str> = names.iter().map(String::as_str).collect();
    let journal = |shard: u64| here.join(&names[shard as usize - 1]).join("trials.bin");

    // Eight tasks of `sbatch --array=1-8`. Three are killed, and one of their journals ends in half a record.
    let killed = [2, 5, 7];
    let mut children: Vec<(u64, Child)> = (1..=8)
        .map(|id| {
            let args = [&base[..], &["--shard", "auto"]].concat();
            let mut task = command(here, &args, &array(id, [1, 8, 8]));
            (id, task.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts"))
        })
        .collect();
    let args: Vec<&str> = ["table-4"].into_iter().chain(folders).collect();
    for (id, child) in children.iter_mut().filter(|(id, _)| killed.contains(id)) {
        kill_midway(child, &journal(*id));
    }
    // The others are still writing, or have not begun.
    let (code, table) = status(here, &args);
    assert_eq!((code, &table["complete"]), (Some(1), &json!(false)));
    for (id, child) in children.iter_mut().filter(|(id, _)| !killed.contains(id)) {
        assert!(child.wait().expect("it ends").success(), "shard {id}");
    }
    let half = std::fs::read(journal(5)).expect("a journal");
    let cut = half.len() - 5;
    std::fs::write(journal(5), &half[..cut]).expect("written");

    let expected: Vec<(u64, BTreeSet<(u64, u64)>)> =
        killed.iter().map(|id| (*id, lacking(&journal(*id)))).collect();
    let (code, table) = status(here, &args);
    assert_eq!(
        (code, &table["complete"], &table["rerun"]),
        (Some(1), &json!(false), &json!(killed))
    );
    let shards = table["shards"].as_array().expect("shards");
    assert_eq!(shards.len(), 8);
    for (shard, id) in shards.iter().zip(1..) {
        assert_eq!((&shard["shard"], &shard["folder"]), (&json!([id, 8]), &json!(names[id - 1])));
        let missing = listed(&table["cells"], &shard["missing"], "trials");
        match expected.iter().find(|(killed, _)| *killed == id as u64) {
            Some((_, lacking)) => {
                let done = shard["done"].as_u64().expect("a number");
                assert!(done > 0 && !lacking.is_empty(), "{id} was not killed midway");
                assert_eq!((&missing, &shard["state"]), (lacking, &json!("unfinished")));
            }
            None => assert_eq!((missing.len(), &shard["state"]), (0, &json!("complete"))),
        }
        assert_eq!(shard["torn_bytes"].as_u64().unwrap() > 0, id == 5, "{shard}");
    }
    let all: BTreeSet<(u64, u64)> =
        expected.iter().flat_map(|(_, lacking)| lacking.clone()).collect();
    assert_eq!(listed(&table["cells"], &table["cells"], "missing"), all);
    let text = symbolt(here, &[&["merge", "--status"], &args[..]].concat(), &[]);
    assert!(printed(&text).ends_with("\nRerun: 2,5,7\n"), "{}", printed(&text));
    let sentence = format!("{} of {} trials are missing", all.len(), table["trials"]);
    assert!(said(&text).contains(&sentence), "{}", said(&text));
    let merge = [&["merge"], &args[..], &["--quiet", "--json", "--out", "merged"]].concat();
    assert_eq!(symbolt(here, &merge, &[]).status.code(), Some(2));

    // `sbatch --array=2,5,7` has gaps: its tasks keep their numbers.
    for id in killed {
        let gaps = array(id, [2, 7, 3]);
        let refused = symbolt(here, &[&base[..], &["--shard", "auto"]].concat(), &gaps);
        assert_eq!(refused.status.code(), Some(2));
        good(here, &[&base[..], &["--shard", "auto/8"]].concat(), &gaps);
    }
    let (code, table) = status(here, &args);
    assert_eq!((code, &table["complete"], &table["rerun"]), (Some(0), &json!(true), &json!([])));
    assert_eq!(good(here, &merge, &[]), whole);
    for name in ["results.json", "results.csv", "figure.svg"] {
        let read = |folder: &str| std::fs::read(here.join(folder).join(name)).expect("a file");
        assert!(read("merged") == read("whole"), "{name}");
    }
}

const FEW: [&str; 4] = ["experiment", "figure-1a", "--trials", "6"];

#[test]
fn the_chosen_shard_is_said_and_faults_of_the_environment_are_bad_usage() {
    let place = tempfile::tempdir().expect("a folder");
    let here = place.path();
    let auto = [&FEW[..], &["--shard", "auto", "--json"]].concat();
    let rank = [("OMPI_COMM_WORLD_RANK", "1".into()), ("OMPI_COMM_WORLD_SIZE", "3".into())];
    let output = symbolt(here, &auto, &rank);
    assert_eq!(said(&output), "shard 2/3, because OMPI_COMM_WORLD_RANK is 1\n");
    let table: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(table["shard"], json!([2, 3]));
    assert!(here.join("experiments/figure-1a-2-of-3/trials.bin").exists());
    let output = symbolt(here, &[&auto[..], &["--quiet"]].concat(), &rank);
    assert_eq!((output.status.code(), said(&output)), (Some(0), String::new()));
    // A fixed shard does not look at the environment.
    good(here, &[&FEW[..], &["--shard", "1/3", "--quiet"]].concat(), &[("HQ_TASK_ID", "x".into())]);
    let hq = |choice: &str, id: &str| {
        let args = [&FEW[..], &["--shard", choice]].concat();
        symbolt(here, &args, &[("HQ_TASK_ID", id.into())])
    };
    assert_eq!(said(&hq("auto/3", "3")), "shard 3/3, because HQ_TASK_ID is 3\n");
    let refused = [
        (symbolt(here, &auto, &[]), "none of the variables HQ_TASK_ID, SLURM_ARRAY_TASK_ID"),
        (hq("auto", "3"), "expected --shard auto/N with `hq submit --array 1-N`"),
        (hq("auto/3", "0"), "HQ_TASK_ID is 0; expected 1 to 3"),
        (hq("auto/3", "three"), "HQ_TASK_ID is `three`; expected a whole number"),
        (hq("auto/0", "1"), "--shard auto/0: must be I/N"),
    ];
    for (output, named) in refused {
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains(named), "{named}: {}", said(&output));
        assert_eq!(said(&output).lines().count(), 1, "{}", said(&output));
    }
}

#[test]
fn the_status_tells_absent_damaged_unreadable_and_foreign_folders_apart() {
    let place = tempfile::tempdir().expect("a folder");
    let here = place.path();
    let quiet = |more: &[&str]| good(here, &[&FEW[..], &["--quiet"], more].concat(), &[]);
    // Nothing has begun: the number of shards comes from the names, the cells from the experiment.
    let folders = [1, 2, 3].map(|i| format!("experiments/figure-1a-{i}-of-3"));
    let args = ["figure-1a", &folders[0], &folders[1], &folders[2]];
    let (code, table) = status(here, &[&args[..], &["--trials", "6"]].concat());
    assert_eq!((code, &table["done"], &table["rerun"]), (Some(1), &json!(0), &json!([1, 2, 3])));
    let states = |table: &Value| -> Vec<String> {
        let shards = table["shards"].as_array().expect("shards").iter();
        shards.map(|shard| shard["state"].as_str().expect("a name").to_owned()).collect()
    };
    assert_eq!(states(&table), ["absent"; 3]);

    quiet(&["--shard", "1/3"]);
    quiet(&["--shard", "3/3"]);
    let (code, table) = status(here, &args);
    assert_eq!(
        (code, states(&table)),
        (Some(1), ["complete", "absent", "complete"].map(String::from).into())
    );
    assert_eq!(table["rerun"], json!([2]));
    let cells = table["cells"].as_array().expect("cells");
    assert!(
        cells.len() > 1 && cells.iter().all(|cell| cell["missing"] == json!([1, 4])),
        "{table}"
    );
    // A shard that was not given at all is named as well.
    let (code, table) = status(here, &[args[0], args[1], args[3]]);
    assert_eq!(
        (code, &table["rerun"], &table["shards"][1]["folder"]),
        (Some(1), &json!([2]), &Value::Null)
    );

    quiet(&["--shard", "2/3"]);
    assert_eq!(status(here, &args).0, Some(0));
    let journal = here.join(&folders[1]).join("trials.bin");
    let sound = std::fs::read(&journal).expect("a journal");
    let mut damaged = sound.clone();
    *damaged.last_mut().expect("bytes") ^= 1;
    std::fs::write(&journal, &damaged).expect("written");
    let (code, table) = status(here, &args);
    assert_eq!((code, &table["rerun"]), (Some(1), &json!([2])));
    assert_eq!(states(&table), ["complete", "damaged", "complete"]);
    let text = printed(&symbolt(here, &[&["merge", "--status"], &args[..]].concat(), &[]));
    assert!(text.contains("--salvage") && text.contains("Rerun: 2\n"), "{text}");
    std::fs::write(&journal, "nothing of ours\n").expect("written");
    let (code, table) = status(here, &args);
    assert_eq!((code, &table["rerun"]), (Some(1), &json!([2])));
    assert_eq!(states(&table), ["complete", "unreadable", "complete"]);
    std::fs::write(&journal, &sound).expect("written");

    // Bad usage: another experiment, another seed, another number of trials.
    quiet(&["--seed", "9", "--shard", "2/3", "--out", "other"]);
    let refused = |more: &[&str], named: &str| {
        let output = symbolt(here, &[&["merge", "--status"], more].concat(), &[]);
        assert_eq!(output.status.code(), Some(2), "{more:?}: {}", said(&output));
        assert!(said(&output).contains(named), "{named}: {}", said(&output));
    };
    refused(
        &["figure-1a", &folders[0], "other"],
        "seed is 1 in experiments/figure-1a-1-of-3 and 9 in other",
    );
    refused(&["table-4", &folders[0]], "its experiment is `figure-1a`; expected `table-4`");
    refused(&["figure-1a", &folders[0], "--seed", "2"], "--seed 2: must be 1, as in the folders");
    refused(
        &["figure-1a", &folders[0], "--trials", "7"],
        "--trials 7: must be 6, as in the folders",
    );
    refused(&["figure-1a"], "no folder is given");
    refused(&["figure-1a", &folders[0], "--out", "x"], "--out");
    let nothing: PathBuf = here.join("x");
    assert!(!nothing.exists(), "a status writes nothing");
}
