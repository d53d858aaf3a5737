//! Folders and files that the commands write: locks, leftovers, links, odd names, signals and full disks.

#![cfg(all(unix, feature = "cli"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::ffi::{OsStr, OsString};
use std::io::{BufRead, BufReader};
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::symlink;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

struct Ran {
    code: Option<i32>,
    out: Vec<u8>,
    err: String,
}

fn command<S: AsRef<OsStr>>(folder: &Path, args: &[S]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_symbolt"));
    command.args(args).current_dir(folder).stdin(Stdio::null());
    command
}

fn run<S: AsRef<OsStr>>(folder: &Path, args: &[S]) -> Ran {
    let output = command(folder, args).output().expect("it starts");
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    Ran { code: output.status.code(), out: output.stdout, err }
}

fn good<S: AsRef<OsStr>>(folder: &Path, args: &[S]) -> Vec<u8> {
    let ran = run(folder, args);
    let args: Vec<&OsStr> = args.iter().map(AsRef::as_ref).collect();
    assert_eq!(ran.code, Some(0), "{args:?}: {}", ran.err);
    ran.out
}

fn place() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

fn names(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().expect("a folder").flatten();
    let mut names: Vec<String> =
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).expect(name)
}

/// Starts a command and waits until it has begun to work, which its first line of progress says.
fn begun(folder: &Path, args: &[&str]) -> Child {
    let mut command = command(folder, args);
    let mut child =
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut lines = BufReader::new(child.stderr.as_mut().expect("piped")).lines();
    lines.next().expect("a line").expect("text");
    child
}

/// A run that takes minutes.
const LONG: [&str; 7] = ["run", "--demos", "1000", "--threads", "1", "--out", "one"];

#[test]
fn a_second_run_into_one_folder_is_refused_at_once() {
    let place = place();
    let here = place.path();
    let shard = ["--trials", "2", "--shard", "1/2", "--quiet", "--out", "part"];
    good(here, &[&["experiment", "figure-1a"], &shard[..]].concat());
    let mut first = begun(here, &LONG);
    let second: [&[&str]; 7] = [
        &["run", "--demos", "1", "--out", "one"],
        &["run", "--demos", "1", "--out", "one", "--force"],
        &["experiment", "figure-1a", "--trials", "2", "--out", "one"],
        &["experiment", "figure-1a", "--trials", "2", "--out", "one", "--force"],
        &["merge", "figure-1a", "part", "--out", "one"],
        &["merge", "figure-1a", "part", "--out", "one", "--force"],
        &["report", "one"],
    ];
    for args in second {
        let ran = run(here, args);
        assert_eq!((ran.code, ran.out.len()), (Some(1), 0), "{args:?}: {}", ran.err);
        let said = "symbolt: another run is writing to one; choose another folder, or wait until it ends\n";
        assert_eq!(ran.err, said, "{args:?}");
    }
    assert_eq!(names(&here.join("one")), [".symbolt-lock"]);
    first.kill().expect("killed");
    first.wait().expect("gone");
    // The lock is gone with its process; nothing else has to be removed by hand.
    good(here, &["experiment", "figure-1a", "--trials", "2", "--quiet", "--out", "one"]);
    assert_eq!(
        names(&here.join("one")),
        ["figure.svg", "results.csv", "results.json", "trials.bin"]
    );
}

#[test]
fn of_runs_that_start_together_in_a_new_folder_one_works_and_the_others_are_refused() {
    let place = place();
    let args =
        ["experiment", "figure-1a", "--trials", "400", "--threads", "1", "--quiet", "--out", "a/b"];
    let start = || {
        let mut command = command(place.path(), &args);
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts")
    };
    let all: Vec<Child> = (0..6).map(|_| start()).collect();
    let (mut done, mut refused) = (0, 0);
    for child in all {
        let output = child.wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        match output.status.code() {
            Some(0) => done += 1,
            Some(1) if said.starts_with("symbolt: another run is writing to a/b;") => refused += 1,
            other => panic!("{other:?}: {said}"),
        }
    }
    assert!(done >= 1 && done + refused == 6, "{done} {refused}");
}

#[test]
fn temporary_files_of_killed_runs_are_removed_and_files_of_others_are_kept() {
    let place = place();
    let here = place.path();
    let stale = ".symbolt-0123456789abcdEF.tmp";
    let others = [".symbolt-config", ".symbolt-notes.tmp", "symbolt.tmp"];
    let args = ["experiment", "figure-1a", "--trials", "2", "--quiet", "--out", "one"];
    good(here, &args);
    for name in others.iter().chain([&stale]) {
        std::fs::write(here.join("one").join(name), "mine").expect("writes");
        std::fs::write(here.join(name), "mine").expect("writes");
    }
    good(here, &args);
    good(here, &["config", "--out", "settings.json"]);
    for folder in [here.to_path_buf(), here.join("one")] {
        let left = names(&folder);
        assert!(!left.contains(&stale.to_owned()), "{left:?}");
        assert!(others.iter().all(|name| left.contains(&(*name).to_owned())), "{left:?}");
    }
}

#[test]
fn names_that_are_no_text_are_written_and_printed() {
    let place = place();
    let here = place.path();
    let odd = |suffix: &str| {
        let mut bytes = vec![b'o', 0xFF, 0xFE];
        bytes.extend(suffix.bytes());
        OsString::from_vec(bytes)
    };
    let words = |words: &str| words.split(' ').map(OsString::from).collect::<Vec<_>>();
    let with = |first: &str, names: &[(&str, &str)]| {
        let mut args = words(first);
        for (option, suffix) in names {
            args.extend((!option.is_empty()).then(|| OsString::from(*option)));
            args.push(odd(suffix));
        }
        args
    };
    let shard = |part: &str| format!("experiment figure-1c --trials 2 --shard {part} --json");
    let cases = [
        with(&shard("1/2"), &[("--out", "1")]),
        with(&shard("2/2"), &[("--out", "2")]),
        with("merge figure-1c --json", &[("--out", "m"), ("", "1"), ("", "2")]),
        with("report --json", &[("", "m")]),
        with("config", &[("--out", "c.json")]),
        with("record --kinematic --json", &[("--out", "r.jsonl")]),
        with("record --kinematic --scene --json", &[("--out", "s.json")]),
        with("learn --json", &[("", "r.jsonl"), ("--out", "d.json")]),
        with("classify --json", &[("", "d.json"), ("", "r.jsonl"), ("--out", "k.jsonl")]),
        with("plan --json", &[("", "d.json"), ("--scene", "s.json"), ("--out", "p.json")]),
        with("actions --json", &[("", "d.json"), ("--scene", "s.json"), ("--out", "a.json")]),
        with("check --json", &[("", "d.json")]),
        with("record --demos 1 --json", &[("--config", "c.json"), ("--out", "f.jsonl")]),
        with(
            "bench bind --sim-seconds 0.3 --runs 1 --neurons-scale 0.2 --json",
            &[("--save", "b")],
        ),
    ];
    for args in &cases {
        let ran = run(here, args);
        assert_eq!(ran.code, Some(0), "{args:?}: {}", ran.err);
    }
    let printed = good(here, &with(&shard("1/2"), &[("--out", "1")]));
    let printed: serde_json::Value = serde_json::from_slice(&printed).expect("JSON");
    assert_eq!(printed["folder"], "o\u{FFFD}\u{FFFD}1");
}

/// A folder with a recording, a scene, a domain, a run's folder and a model in PDDL.
fn prepared() -> tempfile::TempDir {
    let place = place();
    let here = place.path();
    good(here, &["record", "--kinematic", "--demos", "3", "--quiet", "--out", "demos.jsonl"]);
    good(here, &["record", "--kinematic", "--scene", "--quiet", "--out", "scene.json"]);
    good(here, &["learn", "demos.jsonl", "--quiet", "--out", "domain.json"]);
    good(here, &["experiment", "figure-1a", "--trials", "2", "--quiet", "--out", "done"]);
    let pddl = "(define (domain d) (:requirements :strips :typing) (:types thing) (:predicates (on ?a - thing)) \
                (:action switch :parameters (?a - thing) :precondition () :effect (on ?a)))";
    std::fs::write(here.join("d.pddl"), pddl).expect("writes");
    let steps = "(:trajectory (:objects a b - thing) (:state) (:action (switch a)) (:state (on a)) \
                 (:action (switch b)) (:state (on a) (on b)))";
    std::fs::write(here.join("steps"), steps).expect("writes");
    place
}

#[test]
fn a_minus_as_output_file_is_standard_output_for_every_command() {
    let place = prepared();
    let here = place.path();
    let commands: [&[&str]; 10] = [
        &["config"],
        &["config", "--task"],
        &["record", "--kinematic", "--json"],
        &["learn", "demos.jsonl", "--json"],
        &["learn-model", "d.pddl", "steps", "--json"],
        &["classify", "domain.json", "demos.jsonl", "--json"],
        &["plan", "domain.json", "--scene", "scene.json"],
        &["actions", "domain.json", "--scene", "scene.json"],
        &["rename", "domain.json", "NUT_AT_START=NUT_FREE"],
        &["report", "done"],
    ];
    for (number, args) in commands.iter().enumerate() {
        let file = format!("file{number}");
        let printed = good(here, &[args, &["--out", "-"][..]].concat());
        good(here, &[args, &["--out", &file][..]].concat());
        let written = text(here, &file);
        assert!(written.len() > 20, "{args:?}: {written}");
        let printed = String::from_utf8(printed).expect("text");
        assert_eq!(printed.trim_end(), written.trim_end(), "{args:?}");
        assert!(!here.join("-").exists(), "{args:?}");
    }
    // Folders and binary files have no standard output.
    let folders: [&[&str]; 4] = [
        &["run", "--out", "-"],
        &["experiment", "figure-1a", "--out", "-"],
        &["merge", "figure-1a", "done", "--out", "-"],
        &["bench", "bind", "--save", "-"],
    ];
    for args in folders {
        let ran = run(here, args);
        assert_eq!(ran.code, Some(2), "{args:?}: {}", ran.err);
        assert!(ran.err.contains(" -: must be a "), "{args:?}: {}", ran.err);
    }
    assert!(!here.join("-").exists());
}

#[test]
fn a_link_is_followed_and_never_replaced_by_force() {
    let place = place();
    let here = place.path();
    symlink("real.json", here.join("link")).expect("links");
    let refused = run(here, &["config", "--out", "link"]);
    assert_eq!(refused.code, Some(2));
    assert!(refused.err.contains("link exists already; choose another name or add --force"));
    for _ in 0..2 {
        good(here, &["config", "--out", "link", "--force"]);
        assert!(here.join("link").symlink_metadata().expect("there").is_symlink());
        assert!(text(here, "real.json").contains("step_ms"));
    }
    assert_eq!(names(here), ["link", "real.json"]);
}

#[test]
fn default_folders_are_ignored_by_git_and_named_folders_are_not() {
    let place = place();
    let here = place.path();
    let run = ["experiment", "figure-1a", "--trials", "2", "--quiet"];
    good(here, &run);
    good(here, &[&run[..], &["--out", "named/one"]].concat());
    assert!(text(here, "experiments/.gitignore").lines().any(|line| line == "*"));
    assert_eq!(names(&here.join("named")), ["one"]);
    assert!(!names(&here.join("named/one")).contains(&".gitignore".to_owned()));
    // A folder that somebody else made is left as it is.
    std::fs::remove_file(here.join("experiments/.gitignore")).expect("removes");
    good(here, &run);
    assert_eq!(names(&here.join("experiments")), ["figure-1a"]);
    let git = |args: &[&str]| Command::new("git").args(args).current_dir(here).output().ok();
    if git(&["init"]).is_some_and(|output| output.status.success()) {
        std::fs::remove_dir_all(here.join("experiments")).expect("removes");
        good(here, &run);
        let status = git(&["status", "--short"]).expect("it runs").stdout;
        assert_eq!(String::from_utf8_lossy(&status), "?? named/\n");
    }
}

#[test]
fn a_page_that_somebody_else_wrote_is_replaced_only_by_force() {
    let place = prepared();
    let here = place.path();
    let page = here.join("done/report.html");
    std::fs::write(&page, "<title>My notes</title>").expect("writes");
    let refused = run(here, &["report", "done"]);
    assert_eq!((refused.code, refused.out.len()), (Some(2), 0), "{}", refused.err);
    let said = "symbolt: done/report.html was not written by symbolt; choose another file with --out, or add \
                --force to replace it\n";
    assert_eq!(refused.err, said);
    assert_eq!(text(here, "done/report.html"), "<title>My notes</title>");
    good(here, &["report", "done", "--force"]);
    let ours = text(here, "done/report.html");
    assert!(ours.contains("<title>symbolt</title>"));
    // Our own page is made again.
    good(here, &["report", "done"]);
    assert_eq!(text(here, "done/report.html"), ours);
    assert!(!names(&here.join("done")).iter().any(|name| name.starts_with(".symbolt")));
}

#[test]
fn results_that_another_program_wrote_are_replaced_only_by_force() {
    let place = place();
    let here = place.path();
    let part = ["experiment", "figure-1a", "--trials", "2", "--quiet", "--shard", "1/1"];
    good(here, &[&part[..], &["--out", "part"]].concat());
    let commands: [&[&str]; 2] = [
        &["experiment", "figure-1a", "--trials", "2", "--quiet", "--out", "."],
        &["merge", "figure-1a", "part", "--quiet", "--out", "."],
    ];
    for args in commands {
        for name in ["results.json", "results.csv", "figure.svg"] {
            std::fs::write(here.join(name), "mine").expect("writes");
            let refused = run(here, args);
            assert_eq!(refused.code, Some(2), "{args:?} {name}: {}", refused.err);
            let advice = format!("{name} exists already; choose another name or add --force");
            assert!(refused.err.contains(&advice), "{args:?}: {}", refused.err);
            assert_eq!((text(here, name).as_str(), names(here).len()), ("mine", 2), "{args:?}");
            std::fs::remove_file(here.join(name)).expect("removes");
        }
        std::fs::write(here.join("results.csv"), "mine").expect("writes");
        good(here, &[args, &["--force"][..]].concat());
        assert!(text(here, "results.csv").contains("low95"), "{args:?}");
        for name in ["trials.bin", "results.json", "results.csv", "figure.svg"] {
            std::fs::remove_file(here.join(name)).expect("removes");
        }
    }
}

/// Whether this process, and so its children, ignores a signal: a shell does so for jobs in the background.
fn ignored(signal: u32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask >> (signal - 1) & 1 == 1)
}

#[test]
fn a_signal_ends_a_command_and_leaves_nothing_half_written() {
    let place = place();
    let here = place.path();
    let commands: [(&[&str], &[&str]); 3] = [
        (&LONG, &["one"]),
        (&["record", "--demos", "1000", "--threads", "1", "--out", "demos.jsonl"], &["one"]),
        (&["experiment", "figure-3", "--threads", "1", "--out", "two"], &["one", "two"]),
    ];
    for (name, number) in [("TERM", 15), ("INT", 2)] {
        for (args, left) in commands {
            if ignored(number) {
                continue;
            }
            // An experiment has no progress for ten seconds.
            let mut child = if args[0] == "experiment" {
                let mut command = command(here, args);
                let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
                while !here.join("two/trials.bin").exists() {
                    std::thread::sleep(std::time::Duration::from_millis(5));
                }
                child.expect("it starts")
            } else {
                begun(here, args)
            };
            let id = child.id().to_string();
            let sent = Command::new("kill").args([&format!("-{name}"), &id]).status();
            assert!(sent.expect("kill runs").success());
            let status = child.wait().expect("it ends");
            // A shell shows 128 + the number.
            assert_eq!(status.signal(), Some(number as i32), "{args:?} {status}");
            assert_eq!(names(here), left, "{args:?}");
            assert_eq!(names(&here.join("one")), [".symbolt-lock"], "{args:?}");
        }
        let _ = std::fs::remove_dir_all(here.join("two"));
    }
    // A run in the same folder needs no --force.
    let args = ["run", "--demos", "1", "--quiet", "--json", "--out", "one"];
    good(here, &args);
    assert!(names(&here.join("one")).iter().all(|name| !name.starts_with('.')));
}

#[test]
fn a_reader_that_goes_away_ends_the_command_quietly() {
    let place = prepared();
    let commands: [&[&str]; 5] = [
        &["config"],
        &["completions", "bash"],
        &["man"],
        &["learn", "demos.jsonl"],
        &["report", "done", "--out", "-"],
    ];
    for args in commands {
        let mut command = command(place.path(), &[args, &["--quiet"][..]].concat());
        if ["config", "completions", "man"].contains(&args[0]) {
            command = self::command(place.path(), args);
        }
        let spawned = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = spawned.expect("it starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), said.as_str()), (Some(0), ""), "{args:?}");
    }
}

#[test]
fn a_full_disk_is_one_sentence_and_leaves_nothing_half_written() {
    let place = prepared();
    let here = place.path();
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").expect("a device");
    let commands: [&[&str]; 3] =
        [&["config"], &["learn", "demos.jsonl", "--quiet"], &["record", "--kinematic", "--quiet"]];
    for args in commands {
        let output = command(here, args).stdout(full()).output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{args:?}: {said}");
        assert!(
            said.starts_with("symbolt: cannot write to standard output: No space left"),
            "{said}"
        );
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    // The limit is one block of 512 bytes, or of 1024 in some shells.
    let before = names(here);
    for words in
        ["record --kinematic --demos 9 --quiet --out new", "learn demos.jsonl --quiet --out new"]
    {
        let program = env!("CARGO_BIN_EXE_symbolt");
        let script = format!("trap '' XFSZ; ulimit -f 1; exec '{program}' {words}");
        let output = Command::new("sh").args(["-c", &script]).current_dir(here).output();
        let output = output.expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{words}: {said}");
        assert_eq!(said, "symbolt: cannot write new: File too large (os error 27)\n", "{words}");
        assert_eq!((names(here), said.lines().count()), (before.clone(), 1), "{words}: {said}");
    }
}

#[test]
fn the_advice_about_a_damaged_shard_names_the_command_that_mends_it() {
    let place = place();
    let here = place.path();
    let shard = |part: &str, more: &[&str]| {
        let out = format!("part{}", &part[..1]);
        let args =
            ["experiment", "figure-1a", "--trials", "4", "--quiet", "--shard", part, "--out", &out];
        good(here, &[&args[..], more].concat());
    };
    shard("1/2", &[]);
    shard("2/2", &[]);
    let merge = ["merge", "figure-1a", "part1", "part2", "--quiet", "--json", "--out", "whole"];
    let journal = here.join("part2/trials.bin");
    let sound = std::fs::read(&journal).expect("a journal");
    let mut damaged = sound.clone();
    *damaged.last_mut().expect("bytes") ^= 1;
    let cases: [(&[u8], &str); 2] = [(&damaged, "--salvage"), (b"nothing of ours\n", "--force")];
    for (bytes, option) in cases {
        std::fs::write(&journal, bytes).expect("writes");
        let refused = run(here, &merge);
        assert_eq!(refused.code, Some(2), "{}", refused.err);
        let advice = format!("rerun this shard with `symbolt experiment --shard I/N {option}`");
        assert!(refused.err.contains(&advice), "{}", refused.err);
        assert!(!here.join("whole").exists(), "a folder made for nothing is removed");
        shard("2/2", &[option]);
        assert_eq!(std::fs::read(&journal).expect("a journal").len(), sound.len());
    }
    good(here, &merge);
}
