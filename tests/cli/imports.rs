//! `symbolt import`: its report, mappings, pages, and what it refuses.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

fn run(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let mut program = Command::cargo_bin("symbolt").expect("the program was built");
    let output = program.current_dir(folder).args(args).output().expect("it starts");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
}

/// A log in which a cup is carried between 4 and 6 s.
fn log(id: &str) -> String {
    let mut text = "time,body,x_mm,y_mm,z_mm,grasped\n".to_owned();
    for tick in 0..200 {
        let t = f64::from(tick) * 0.05;
        let u = ((t - 4.0) / 2.0).clamp(0.0, 1.0);
        let held = u8::from((4.0..=6.0).contains(&t));
        text +=
            &format!("{t:.2},{id},{:.2},100,{:.2},{held}\n", 500.0 + 300.0 * u, 20.0 + 100.0 * u);
    }
    text
}

#[test]
fn an_import_writes_a_recording_that_check_takes_and_a_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("a.csv"), log("cup_1")).expect("written");
    std::fs::write(at.join("b.csv"), log("cup_1")).expect("written");
    let (code, out, err) =
        run(at, &["import", "*.csv", "--out", "r.jsonl", "--page", "p.html", "--json", "--quiet"]);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&out).expect("one JSON object");
    assert_eq!((&found["demonstrations"], &found["snapshots"]), (&2.into(), &8.into()));
    let events: Vec<&str> = (found["events"].as_array().expect("a list").iter())
        .map(|event| event["event"].as_str().expect("a name"))
        .collect();
    assert_eq!(events, ["contact", "release", "contact", "release"]);
    for key in ["sessions", "objects", "guesses", "left_out", "unused", "mapping"] {
        assert!(!found[key].is_null(), "{key}");
    }
    assert_eq!(run(at, &["check", "r.jsonl"]).0, 0);
    let page = std::fs::read_to_string(at.join("p.html")).expect("a page");
    assert!(page.contains("cup_1") && !page.contains("{{"));
    // What exists is kept.
    let (code, _, err) = run(at, &["import", "a.csv", "--out", "r.jsonl"]);
    assert!(code == 2 && err.contains("--force"), "{err}");
}

#[test]
fn a_dry_run_prints_a_mapping_that_reads_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("a.csv"), log("cup_1")).expect("written");
    let (code, out, _) = run(at, &["import", "a.csv", "--dry-run", "--kind", "cup*=mug"]);
    assert_eq!(code, 0);
    let (_, said, _) = run(at, &["import", "a.csv", "--dry-run", "--page", "dry.html"]);
    assert!(said.contains("symbolt-import") && at.join("dry.html").exists(), "{said}");
    let (_, said, _) = run(at, &["import", "a.csv"]);
    assert!(said.contains("No recording was written; `--out FILE` writes one."), "{said}");
    let mapping = &out[out.find("\n{\n").expect("a mapping")..];
    std::fs::write(at.join("m.json"), mapping).expect("written");
    let (_, one, err) = run(at, &["import", "a.csv", "--map", "m.json", "--out", "-"]);
    let (_, other, _) = run(at, &["import", "a.csv", "--kind", "cup*=mug", "--out", "-"]);
    assert!(!one.is_empty() && one.contains("\"kind\":\"mug\""), "{one} {err}");
    assert_eq!(one, other);
    // Three columns of a rotation that may be either, and tables whose clocks have units of their own.
    let (mut turned, mut objects) = ("time,id,x,y,z,rx,ry,rz\n".to_owned(), String::new());
    let mut robot = "time,gripper_width\n".to_owned();
    for row in log("cup_1").lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let t: f64 = cells[0].parse().expect("a time");
        turned += &format!("{},1.2,1.3,0.4\n", cells[..5].join(","));
        objects += &format!("{:.0},{}\n", t * 1e3, cells[1..5].join(","));
        robot += &format!("{t:.2},{}\n", if cells[5] == "1" { 30 } else { 80 });
    }
    std::fs::write(at.join("turned.csv"), turned).expect("written");
    std::fs::write(at.join("t_robot.csv"), robot).expect("written");
    std::fs::write(at.join("t_objects.csv"), "time_ms,id,x,y,z\n".to_owned() + &objects)
        .expect("written");
    for files in [&["turned.csv"][..], &["t_objects.csv", "t_robot.csv"]] {
        let import = |more: &[&str]| run(at, &[&["import"], files, more].concat());
        let (_, out, err) = import(&["--dry-run"]);
        let mapping = &out[out.find("\n{\n").expect(&err)..];
        std::fs::write(at.join("m.json"), mapping).expect("written");
        let (_, one, err) = import(&["--map", "m.json", "--out", "-"]);
        let (_, other, _) = import(&["--out", "-"]);
        assert_eq!(one.lines().count(), 4, "{one} {err}");
        assert_eq!(one, other, "{mapping}");
    }
}

#[test]
fn a_name_with_escape_codes_is_refused_and_does_not_reach_the_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.csv"), log("cup\u{1b}[31m_1")).expect("written");
    let (code, out, err) = run(folder.path(), &["import", "a.csv"]);
    assert_eq!((code, &*out), (2, ""), "{err}");
    assert!(err.contains("`cup\\u{1b}[31m_1` has a control character"), "{err:?}");
}

#[test]
fn what_cannot_be_read_is_refused_with_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("a.csv"), log("cup_1").replacen("500.00", "five", 1)).expect("written");
    std::fs::write(
        at.join("m.json"),
        "{\"format\": \"symbolt-import\", \"version\": 1, \"unit\": \"mm\"}",
    )
    .expect("written");
    for (args, said) in [
        (
            &["import", "a.csv"][..],
            "a.csv, line 2, field `x_mm`: it is `five`; expected a number, or an empty cell",
        ),
        (&["import", "no.csv"], "cannot read no.csv"),
        (&["import", "*.log"], "no file fits"),
        (&["import", "a.csv", "--map", "m.json"], "m.json, line 1: unknown field `unit`"),
        (&["import", "a.csv", "--length", "km"], "expected one of m, mm, cm, inch"),
        (
            &["import", "a.csv", "--id", "nobody"],
            "field `nobody`: there is no such column; expected one of: time, body",
        ),
        (&["import", "a.csv", "--kind", "cup"], "--kind cup: must be ID=KIND"),
        (&["import", "a.csv", "--page", "-"], "--page -: must be a file"),
        (&["import", "a.csv", "--gap", "-1"], "--gap -1: must be more than 0 seconds"),
    ] {
        let (code, _, err) = run(at, args);
        assert_eq!(code, 2, "{args:?}: {err}");
        assert!(err.contains(said), "{args:?} says {err}");
    }
}

#[cfg(not(feature = "mcap"))]
#[test]
fn a_build_without_the_feature_says_how_to_read_mcap() {
    let folder = tempfile::tempdir().expect("a folder");
    // Told by its first bytes, not by its name.
    std::fs::write(folder.path().join("bag.csv"), b"\x89MCAP0\r\nrest").expect("written");
    let (code, _, err) = run(folder.path(), &["import", "bag.csv"]);
    assert_eq!(code, 2);
    assert_eq!(
        err.trim(),
        "symbolt: bag.csv: it is an MCAP log, which this build does not read; expected a CSV log, or a build with `--features mcap`"
    );
}

#[cfg(feature = "mcap")]
#[test]
fn a_folder_with_a_bag_is_imported_and_its_mapping_reads_the_same() {
    use crate::bags::{Packing, bag, bag_in, pose_stamped, transforms};

    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let mut messages = Vec::new();
    for tick in 0..200u64 {
        let t = 1_000_000_000 + tick * 50_000_000;
        let u = ((tick as f64 * 0.05 - 4.0) / 2.0).clamp(0.0, 1.0);
        let cup = [0.5 + 0.3 * u, 0.1, 0.02 + 0.1 * u, 0.0, 0.0, 0.0, 1.0];
        let data = transforms(
            t,
            &[("map", "cup_1", cup), ("map", "shelf", [0.9, 0.4, 0.3, 0.0, 0.0, 0.0, 1.0])],
        );
        messages.push(("/tf".to_owned(), "tf2_msgs/msg/TFMessage", t, data));
        let note = pose_stamped(t, "map", &cup);
        messages.push(("/cup\u{1b}[31m/pose".to_owned(), "geometry_msgs/msg/PoseStamped", t, note));
    }
    std::fs::create_dir(at.join("bag")).expect("a folder");
    std::fs::write(at.join("bag/metadata.yaml"), "rosbag2_bagfile_information:\n")
        .expect("written");
    std::fs::write(at.join("bag/bag_0.mcap"), bag(Packing::Zstd, &messages)).expect("written");
    let (code, out, err) = run(at, &["import", "bag", "--dry-run", "--ignore", "/cup*"]);
    assert_eq!(code, 0, "{err}");
    assert!(
        !out.contains('\u{1b}') && out.contains("guessed reference: map, because it is the root"),
        "{out}"
    );
    let mapping = &out[out.find("\n{\n").expect("a mapping")..];
    std::fs::write(at.join("m.json"), mapping).expect("written");
    let (code, one, err) = run(at, &["import", "bag", "--map", "m.json", "--out", "-"]);
    assert_eq!(code, 0, "{err}");
    let (_, other, _) = run(at, &["import", "bag", "--ignore", "/cup*", "--out", "-"]);
    assert!(one.contains("cup_1") && one == other, "{one}");
    // A name of the log reaches no terminal.
    let idl = bag_in("ros2idl", "cdr", Packing::Plain, &messages[1..2]);
    std::fs::write(at.join("idl.mcap"), idl).expect("written");
    let (code, _, err) = run(at, &["import", "idl.mcap"]);
    assert!(code == 2 && err.contains("`ros2idl`") && !err.contains('\u{1b}'), "{err:?}");
}
