//! The report: the files of a run's folder, and the page as text. `tests/needs/browser.rs` opens it in a browser.

#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::Path;
use std::process::Command;

use ndarray::{Array1, Array2, Array3};
use serde_json::{Value, json};
use symbolt::files::npz::{NpzReader, NpzWriter};

use crate::run::{
    copied, copy_of, facts, made, made_experiments, made_of_ten_minutes, made_of_two, missing,
    numbers, report, symbolt, text,
};

#[test]
fn the_page_of_a_complete_folder_can_be_written_again_from_its_files() {
    let copy = copied();
    let written = std::fs::read_to_string(made().join("report.html")).expect("a page");
    let (found, page) = report(copy.path());
    assert!(missing(&found).is_empty(), "{found}");
    assert_eq!(page, written, "the page depends on the files alone");
    assert!(page.len() < 5_000_000, "{}", page.len());
    assert!(!page.contains("http-equiv=\"refresh\"") && !page.contains("src=\"http"));
}

#[test]
fn the_page_tells_frames_and_conditions_with_their_reasons() {
    let page = text(made(), "report.html");
    let begin = page.find("id=\"data\">").expect("data") + "id=\"data\">".len();
    let end = begin + page[begin..].find("</script>").expect("an end");
    let data: Value = serde_json::from_str(&page[begin..end]).expect("JSON");
    let domain = &data["domain"];
    let states = domain["states"].as_array().expect("states");
    let framed = states.iter().find(|s| s["frame"] != "world").expect("a state in a frame");
    assert!(framed["places"][0]["position"].as_str().is_some_and(|p| p.matches(", ").count() == 2));
    assert!(framed["orientation"].is_string() && framed["count"].is_u64(), "{framed}");
    let operators = domain["operators"].as_array().expect("operators");
    let conditions: Vec<&str> = operators
        .iter()
        .flat_map(|o| o["conditions"].as_array().expect("a list"))
        .filter_map(Value::as_str)
        .collect();
    assert!(
        conditions.iter().any(|c| c.contains(": required, always held (2 of 2)")),
        "{conditions:?}"
    );
    for drawn in domain["drawn"].as_array().expect("places") {
        assert_eq!(drawn["mean"]["position"].as_array().map(Vec::len), Some(3));
        let reach = drawn["reach"].as_array().expect("how far a place reaches");
        assert!(reach.len() == 3 && reach.iter().all(|r| r.as_f64() > Some(5e-4)), "{drawn}");
    }
}

#[test]
fn the_page_of_a_damaged_or_unfinished_folder_says_what_is_missing() {
    for name in ["run.json", "domain.json", "recording.jsonl", "trace.jsonl", "arrays.npz"] {
        let whole = std::fs::read(made().join(name)).expect("a file");
        let half = whole[..whole.len() / 2].to_vec();
        let mut flipped = whole.clone();
        flipped[whole.len() / 3..whole.len() / 3 + 8].fill(0xff);
        for (how, content) in [
            ("gone", None),
            ("empty", Some(Vec::new())),
            ("half", Some(half)),
            ("flipped", Some(flipped)),
            ("something else", Some(b"{\"a\": [1, 2]}\n".to_vec())),
        ] {
            let copy = copied();
            let path = copy.path().join(name);
            match content {
                None => std::fs::remove_file(&path).expect("removed"),
                Some(content) => std::fs::write(&path, content).expect("written"),
            }
            let (found, page) = report(copy.path());
            let missing = missing(&found);
            assert_eq!(missing.len(), 1, "{name}, {how}: {missing:?}");
            assert!(missing.iter().all(|said| said.starts_with(name)), "{missing:?}");
            assert!(page.ends_with("</html>\n"));
        }
    }
}

#[test]
fn files_that_do_not_belong_together_are_reported() {
    let said = |change: &dyn Fn(&Path)| {
        let copy = copied();
        change(copy.path());
        let (found, _) = report(copy.path());
        missing(&found).join("; ")
    };
    let facts = |folder: &Path, change: &dyn Fn(&mut Value)| {
        let path = folder.join("run.json");
        let mut facts: Value =
            serde_json::from_slice(&std::fs::read(&path).expect("there")).expect("JSON");
        change(&mut facts);
        std::fs::write(&path, facts.to_string()).expect("written");
    };
    // The trace ends after a whole line, as after a kill.
    let cut = said(&|folder| {
        let path = folder.join("trace.jsonl");
        let text = std::fs::read_to_string(&path).expect("there");
        let lines: Vec<&str> = text.lines().take(3).collect();
        std::fs::write(&path, lines.join("\n") + "\n").expect("written");
    });
    assert_eq!(cut, "trace.jsonl: the end of 1 of 1 episodes is missing");
    let odd = said(&|folder| {
        let path = folder.join("trace.jsonl");
        let text = std::fs::read_to_string(&path).expect("there");
        std::fs::write(&path, text.replacen("\"asked_s\":", "\"asked_s\":1e300,\"x\":", 1))
            .expect("written");
    });
    assert!(odd.starts_with("trace.jsonl: line 1 is damaged"), "{odd}");
    for (change, expected) in [
        ("nuts", "the frames have 2 parts, but the scene of run.json has 3"),
        ("names", "the module goal_set has other columns than run.json lists"),
        ("module", "the module other is missing"),
        ("summary", "run.json: "),
        (
            "version",
            "run.json: the file is a symbolt-run of version 2; expected symbolt-run of version 1",
        ),
    ] {
        let told = said(&|folder| {
            facts(folder, &|facts| match change {
                "nuts" => facts["scene"]["nuts"] = json!(2),
                "names" => facts["modules"][1]["names"] = json!(["A"]),
                "version" => facts["version"] = json!(2),
                "module" => facts["modules"][1]["name"] = json!("other"),
                _ => facts["summary"] = Value::Null,
            });
        });
        assert!(told.contains(expected), "{change}: {told}");
    }
}

#[test]
fn a_folder_with_nothing_to_report_is_refused_and_so_is_writing_over_a_file() {
    let empty = tempfile::tempdir().expect("a folder");
    for folder in [empty.path(), &empty.path().join("nowhere")] {
        let output = Command::new(env!("CARGO_BIN_EXE_symbolt"))
            .args(["report", folder.to_str().expect("UTF-8")])
            .output()
            .expect("it runs");
        assert_eq!(output.status.code(), Some(2), "{output:?}");
    }
    let other = empty.path().join("page.html");
    std::fs::write(&other, "mine").expect("written");
    let folder = made().to_str().expect("UTF-8");
    let args = ["report", folder, "--out", other.to_str().expect("UTF-8")];
    let refused = Command::new(env!("CARGO_BIN_EXE_symbolt")).args(args).output().expect("it runs");
    assert_eq!(refused.status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(&other).expect("there"), "mine");
    let forced = [&args[..], &["--force"]].concat();
    assert!(symbolt(&forced)["bytes"].as_u64().is_some_and(|bytes| bytes > 100_000));
}

#[test]
fn a_run_without_a_task_name_is_shown_and_an_unknown_task_is_reported() {
    let copy = copied();
    let path = copy.path().join("run.json");
    let mut facts: Value =
        serde_json::from_slice(&std::fs::read(&path).expect("there")).expect("JSON");
    let own = facts.as_object_mut().expect("an object");
    assert!(own.remove("task").is_some() && own.remove("scene_seed").is_some());
    std::fs::write(&path, facts.to_string()).expect("written");
    assert!(missing(&report(copy.path()).0).is_empty());
    facts["task"] = json!("juggling");
    std::fs::write(&path, facts.to_string()).expect("written");
    let said = missing(&report(copy.path()).0).join("; ");
    let start = "run.json: there is no task `juggling`; the tasks are: nuts-and-bolts, movable-jig";
    assert!(said.starts_with(start), "{said}");
}

#[test]
fn a_damaged_array_is_left_out_alone() {
    type Modules = Vec<(String, Array2<f64>)>;
    let said = |change: &dyn Fn(&mut Modules)| {
        let copy = copied();
        let path = copy.path().join("arrays.npz");
        let bytes = std::fs::read(&path).expect("there");
        let mut npz = NpzReader::new(&bytes).expect("arrays");
        let times: Array1<f64> = npz.read("frames_t").expect("times");
        let angles: Array2<f32> = npz.read("frames_angles").expect("angles");
        let fingers: Array2<f32> = npz.read("frames_fingers").expect("fingers");
        let parts: Array3<f32> = npz.read("frames_parts").expect("parts");
        let samples: Array1<f64> = npz.read("modules_t").expect("times");
        let names: Vec<String> = npz.names();
        let names = names.into_iter().filter(|name| name.starts_with("module_"));
        let mut modules: Modules = names
            .map(|name| {
                let values: Array2<f32> = npz.read(&name).expect("a module");
                (name, values.mapv(f64::from))
            })
            .collect();
        change(&mut modules);
        let mut npz = NpzWriter::new();
        npz.add("frames_t", &times).expect("written");
        npz.add("frames_angles", &angles).expect("written");
        npz.add("frames_fingers", &fingers).expect("written");
        npz.add("frames_parts", &parts).expect("written");
        npz.add("modules_t", &samples).expect("written");
        for (name, values) in &modules {
            npz.add(name, values).expect("written");
        }
        std::fs::write(&path, npz.finish().expect("finished")).expect("written");
        let (found, _) = report(copy.path());
        missing(&found).iter().map(|said| (*said).to_owned()).collect::<Vec<_>>()
    };
    // Double precision is accepted. Only the spikes, which are not written here, are missing.
    let whole = said(&|_| {});
    assert!(whole.len() == 1 && whole[0].contains("spikes_t cannot be read"), "{whole:?}");
    let short = said(&|modules| modules[0].1 = Array2::zeros((3, modules[0].1.ncols())));
    assert!(short.len() == 2 && short[0].contains("has 3 rows"), "{short:?}");
    let odd = said(&|modules| modules[0].1[[5, 0]] = f64::NAN);
    assert!(odd.len() == 2 && odd[1].contains("not finite"), "{odd:?}");
    let gone = said(&|modules| drop(modules.remove(0)));
    assert!(gone.len() == 2 && gone[1].contains(" is missing"), "{gone:?}");
}

#[test]
fn numbers_out_of_range_are_reported_as_damage() {
    let path_of = |copy: &tempfile::TempDir| copy.path().join("run.json");
    for (section, number) in [("nuts", json!(u64::MAX)), ("rows", json!(1u64 << 63))] {
        let copy = copied();
        let bytes = std::fs::read(path_of(&copy)).expect("there");
        let mut facts: Value = serde_json::from_slice(&bytes).expect("JSON");
        if section == "nuts" {
            facts["scene"]["nuts"] = number;
        } else {
            let one = json!({"path": "a/b", "rows": number, "neurons": 3});
            facts["populations"] = json!([one.clone(), one]);
        }
        std::fs::write(path_of(&copy), facts.to_string()).expect("written");
        assert!(!missing(&report(copy.path()).0).is_empty(), "{section}");
    }
    let copy = copied();
    let trace = copy.path().join("trace.jsonl");
    let mut text = std::fs::read_to_string(&trace).expect("there");
    text += "{\"episode\":18446744073709551615}\n";
    std::fs::write(&trace, text).expect("written");
    assert!(missing(&report(copy.path()).0)[0].contains("is damaged"));
}

#[test]
fn another_episode_than_the_first_can_be_recorded() {
    let out = made_of_two();
    let facts = facts(out);
    assert_eq!((&facts["filmed"], facts["summary"]["episodes"].as_u64()), (&json!(1), Some(2)));
    assert!(
        facts["command"].as_str().is_some_and(|c| c.contains("--episodes 2 --record-episode 2"))
    );
    // Files of two episodes in one folder are told apart by their length.
    let swapped = tempfile::tempdir().expect("a folder");
    for name in ["run.json", "domain.json", "recording.jsonl", "trace.jsonl", "scene.json"] {
        std::fs::copy(out.join(name), swapped.path().join(name)).expect("copied");
    }
    std::fs::copy(made().join("arrays.npz"), swapped.path().join("arrays.npz")).expect("copied");
    let (found, _) = report(swapped.path());
    let said = missing(&found).join("; ");
    assert!(said.contains("its frames end after") && said.contains("its modules end"), "{said}");
    let path = swapped.path().join("run.json");
    let mut other = facts.clone();
    other["filmed"] = json!(2);
    std::fs::write(&path, other.to_string()).expect("written");
    let said = missing(&report(swapped.path()).0).join("; ");
    assert!(said.contains("run.json: `filmed` is 2; expected an episode number below 2"), "{said}");
    // The frames begin as `scene.json` says and end when the second episode ends.
    let scene: Value = serde_json::from_str(&text(out, "scene.json")).expect("JSON");
    let bytes = std::fs::read(out.join("arrays.npz")).expect("there");
    let mut npz = NpzReader::new(&bytes).expect("arrays");
    let parts: Array3<f32> = npz.read("frames_parts").expect("parts");
    let times: Array1<f64> = npz.read("frames_t").expect("times");
    let seen = numbers(&scene["objects"][0]["position"]);
    assert!(
        (0..2).any(|part| (0..2).all(|i| (seen[i] - f64::from(parts[[0, part, i]])).abs() < 2e-3))
    );
    let lines: Vec<Value> = text(out, "trace.jsonl")
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let end = |episode: u64| {
        let line = lines.iter().find(|line| line["episode"] == episode && line["end"].is_object());
        line.and_then(|line| line["end"]["simulated_s"].as_f64()).expect("an end")
    };
    let last = times.last().copied().expect("frames");
    assert!((last - end(1)).abs() < 0.1 && (last - end(0)).abs() > 0.1, "{last} {}", end(0));
}

#[test]
fn ten_simulated_minutes_stay_below_five_megabytes() {
    let copy = copy_of(made_of_ten_minutes());
    let (found, page) = report(copy.path());
    assert!(missing(&found).is_empty(), "{found}");
    assert!(page.len() < 5_000_000, "{}", page.len());
}

#[test]
fn experiments_get_a_page_of_their_own() {
    let place = copy_of(made_experiments());
    let (found, _) = report(&place.path().join("timing"));
    assert!(missing(&found).is_empty());
    let (found, _) = report(place.path());
    assert!(missing(&found).is_empty());
    // A third experiment was killed. The page names it.
    std::fs::create_dir(place.path().join("killed")).expect("made");
    std::fs::copy(place.path().join("timing/trials.bin"), place.path().join("killed/trials.bin"))
        .expect("copied");
    let (found, _) = report(place.path());
    let said = missing(&found).join("");
    assert!(said.starts_with("killed/results.json: the file is missing"), "{said}");
}
