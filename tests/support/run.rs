//! Folders of runs and experiments. All test binaries share them, because a run takes seconds.

// Each test binary uses only some of these functions.
#![allow(dead_code)]

use std::fs::{File, Metadata};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::UNIX_EPOCH;

use ndarray::{Array1, Array2, Array3};
use serde_json::{Value, json};
use symbolt::files::npz::NpzWriter;

const PROGRAM: &str = env!("CARGO_BIN_EXE_symbolt");

/// Runs the program, expects success, and returns the JSON that it prints.
pub fn symbolt(args: &[&str]) -> Value {
    let output =
        Command::new(PROGRAM).args(args).args(["--quiet", "--json"]).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{args:?}: {said}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Returns the folder `name`. If this build of the program has not made the folder yet, removes the one of an earlier
/// build and calls `make` with the folder's path.
fn once(name: &str, make: impl FnOnce(&Path)) -> PathBuf {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("made");
    std::fs::create_dir_all(&place).expect("a folder");
    let lock = File::create(place.join(format!("{name}.lock"))).expect("a file");
    lock.lock().expect("no other test holds the lock");
    let of = |meta: Metadata| (meta.len(), meta.modified().expect("a time"));
    let (size, time) = of(std::fs::metadata(PROGRAM).expect("the program was built"));
    let time = time.duration_since(UNIX_EPOCH).expect("after 1970").as_nanos();
    let (folder, build) = (place.join(name), format!("{size} {time}"));
    let mark = place.join(format!("{name}.build"));
    if std::fs::read_to_string(&mark).is_ok_and(|made| made == build) {
        return folder;
    }
    if folder.exists() {
        std::fs::remove_dir_all(&folder).expect("removed");
    }
    make(&folder);
    std::fs::write(&mark, build).expect("written");
    folder
}

/// Returns the folder of a run with one episode. Tests must not change it.
pub fn made() -> &'static Path {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        once("one-episode", |out| {
            let found = symbolt(&["run", "--demos", "2", "--out", out.to_str().expect("UTF-8")]);
            assert_eq!(found["assembled"], 1);
        })
    })
}

/// Returns the folder of a run with two episodes; the second is recorded. Tests must not change it.
pub fn made_of_two() -> &'static Path {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        once("two-episodes", |out| {
            let to = out.to_str().expect("UTF-8");
            symbolt(&["run", "--demos", "2", "--episodes", "2", "--film", "2", "--out", to]);
        })
    })
}

/// Returns a folder that holds the folders of two experiments. Tests must not change it.
pub fn made_experiments() -> &'static Path {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        once("experiments", |place| {
            for (name, trials) in [("figure-1a", "20"), ("timing", "2")] {
                let out = place.join(name);
                let out = out.to_str().expect("UTF-8");
                symbolt(&["experiment", name, "--trials", trials, "--out", out]);
            }
        })
    })
}

/// Returns the folder of a run of ten minutes with eight parts. Its frames and activity are made up. Tests must not
/// change it.
pub fn made_of_ten_minutes() -> &'static Path {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        once("ten-minutes", |folder| {
            copy_all(made(), folder);
            lengthen(folder);
        })
    })
}

/// Stretches the run in `folder` to ten minutes.
fn lengthen(folder: &Path) {
    let (minutes, per_s) = (10.0, 25.0);
    let frames = (60.0 * minutes * per_s) as usize;
    let mut facts = facts(folder);
    (facts["scene"]["nuts"], facts["scene"]["bolts"]) = (json!(4), json!(4));
    std::fs::write(folder.join("run.json"), facts.to_string()).expect("written");
    let trace = folder.join("trace.jsonl");
    let text = std::fs::read_to_string(&trace).expect("there");
    let ends = text.lines().map(|line| {
        let mut line: Value = serde_json::from_str(line).expect("JSON");
        if line["end"].is_object() {
            line["end"]["simulated_s"] = json!(60.0 * minutes);
        }
        line.to_string() + "\n"
    });
    std::fs::write(&trace, ends.collect::<String>()).expect("written");
    // Constant motion hardly compresses, so the page reaches its greatest size.
    let wave = |frame: usize, number: usize| {
        (0.37 * frame as f64 + 1.7 * number as f64).sin() as f32 * 0.3
    };
    let mut npz = NpzWriter::new();
    let seconds = Array1::from_shape_fn(frames, |f| f as f64 / per_s);
    npz.add("frames_t", &seconds).expect("written");
    npz.add("frames_angles", &Array2::from_shape_fn((frames, 7), |(f, i)| wave(f, i)))
        .expect("written");
    npz.add("frames_fingers", &Array2::from_elem((frames, 2), 0.03f32)).expect("written");
    let parts = Array3::from_shape_fn((frames, 8, 7), |(f, p, i)| wave(f, 7 * p + i));
    npz.add("frames_parts", &parts).expect("written");
    let samples = frames + 100 * 150;
    let moments = Array1::from_shape_fn(samples, |s| 60.0 * minutes * s as f64 / samples as f64);
    npz.add("modules_t", &moments).expect("written");
    for module in facts["modules"].as_array().expect("modules") {
        let columns = module["names"].as_array().expect("names").len();
        let values = Array2::from_shape_fn((samples, columns), |(s, c)| wave(s, c));
        let name = format!("module_{}", module["name"].as_str().expect("a name"));
        npz.add(&name, &values).expect("written");
    }
    npz.add("spikes_t", &Array1::<f64>::zeros(0)).expect("written");
    npz.add("spikes_row", &Array1::<u32>::zeros(0)).expect("written");
    let bytes = npz.finish().expect("finished");
    std::fs::write(folder.join("arrays.npz"), bytes).expect("written");
}

fn copy_all(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let copy = to.join(path.file_name().expect("a name"));
        match path.is_dir() {
            true => copy_all(&path, &copy),
            false => drop(std::fs::copy(&path, &copy).expect("copied")),
        }
    }
}

/// Returns a copy of a folder, which a test may change.
pub fn copy_of(folder: &Path) -> tempfile::TempDir {
    let copy = tempfile::tempdir().expect("a folder");
    copy_all(folder, copy.path());
    copy
}

/// Returns a copy of [`made`], which a test may change.
pub fn copied() -> tempfile::TempDir {
    copy_of(made())
}

/// Runs `symbolt report` on a folder. Returns the JSON that it prints, and the page.
pub fn report(folder: &Path) -> (Value, String) {
    let found = symbolt(&["report", folder.to_str().expect("UTF-8")]);
    let page = std::fs::read_to_string(folder.join("report.html")).expect("a page");
    assert_eq!(found["bytes"], page.len());
    (found, page)
}

/// Returns the sentences about missing and damaged files.
pub fn missing(found: &Value) -> Vec<&str> {
    found["missing"].as_array().expect("a list").iter().filter_map(Value::as_str).collect()
}

/// Returns the content of a text file in a folder.
pub fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).expect("a file")
}

/// Returns `run.json` of a folder.
pub fn facts(folder: &Path) -> Value {
    serde_json::from_str(&text(folder, "run.json")).expect("JSON")
}

/// Returns the numbers in a JSON array.
pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("numbers").iter().filter_map(Value::as_f64).collect()
}
