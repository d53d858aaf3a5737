//! The report: a folder's files, the page, and the page in a browser.
//!
//! One file of over 500 lines, because all of its tests read one run that takes ten seconds to make.

#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use ndarray::{Array1, Array2, Array3};
use ndarray_npy::{NpzReader, NpzWriter};
use serde_json::{Value, json};

fn symbolt(args: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_symbolt"))
        .args(args)
        .args(["--quiet", "--json"])
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{args:?}: {said}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// A run's folder, made once for all tests, which copy it.
fn made() -> &'static Path {
    static MADE: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, out) = MADE.get_or_init(|| {
        let place = tempfile::tempdir().expect("a folder");
        let out = place.path().join("out");
        let found = symbolt(&["run", "--demos", "2", "--out", out.to_str().expect("UTF-8")]);
        assert_eq!(found["assembled"], 1);
        (place, out)
    });
    out
}

fn copied() -> tempfile::TempDir {
    let copy = tempfile::tempdir().expect("a folder");
    for entry in std::fs::read_dir(made()).expect("a folder") {
        let path = entry.expect("an entry").path();
        std::fs::copy(&path, copy.path().join(path.file_name().expect("a name"))).expect("copied");
    }
    copy
}

/// Makes the report anew and gives what the command says of it.
fn report(folder: &Path) -> (Value, String) {
    let found = symbolt(&["report", folder.to_str().expect("UTF-8")]);
    let page = std::fs::read_to_string(folder.join("report.html")).expect("a page");
    assert_eq!(found["bytes"], page.len());
    (found, page)
}

fn missing(found: &Value) -> Vec<&str> {
    found["missing"].as_array().expect("a list").iter().filter_map(Value::as_str).collect()
}

#[test]
fn a_sound_folder_has_everything_and_the_page_can_be_made_anew_from_it() {
    let copy = copied();
    let written = std::fs::read_to_string(made().join("report.html")).expect("a page");
    let (found, page) = report(copy.path());
    assert!(missing(&found).is_empty(), "{found}");
    assert_eq!(page, written, "the page is a function of the files");
    assert!(page.len() < 10_000_000, "{}", page.len());
    assert!(!page.contains("http-equiv=\"refresh\"") && !page.contains("src=\"http"));
}

#[test]
fn a_damaged_or_half_finished_folder_gives_a_page_that_says_what_is_missing() {
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
fn what_does_not_belong_together_is_said() {
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
    // A trace cut after a whole line: the run may have been killed there.
    let cut = said(&|folder| {
        let path = folder.join("trace.jsonl");
        let text = std::fs::read_to_string(&path).expect("there");
        let lines: Vec<&str> = text.lines().take(3).collect();
        std::fs::write(&path, lines.join("\n") + "\n").expect("written");
    });
    assert_eq!(cut, "trace.jsonl: 1 of 1 episodes have no end in it");
    let odd = said(&|folder| {
        let path = folder.join("trace.jsonl");
        let text = std::fs::read_to_string(&path).expect("there");
        std::fs::write(&path, text.replacen("\"asked_s\":", "\"asked_s\":1e300,\"x\":", 1))
            .expect("written");
    });
    assert!(odd.starts_with("trace.jsonl: line 1 is damaged"), "{odd}");
    for (change, expected) in [
        ("nuts", "it has 2 parts; run.json has 3"),
        ("names", "what it has of the module cause is not what run.json says"),
        ("module", "it has nothing of the module other"),
        ("summary", "run.json: "),
        (
            "version",
            "run.json: it is a symbolt-run of version 2; expected symbolt-run of version 1",
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
fn a_run_from_before_tasks_had_names_is_still_shown_and_an_unknown_task_is_said() {
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
    let start =
        "run.json: there is no task `juggling`; the tasks are: nuts-and-bolts (put a nut and";
    assert!(said.starts_with(start), "{said}");
}

/// A browser, if there is one.
fn browser() -> Option<PathBuf> {
    let named = std::env::var_os("CHROMIUM").map(PathBuf::from);
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let found = std::env::split_paths(&paths)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|path| path.is_file());
    let browser = named.or(found);
    if browser.is_none() {
        println!("there is no Chromium here: the page is not tested in a browser");
    }
    browser
}

/// Opens a page, runs `script` in it, and gives what that leaves in `found`.
fn opened(browser: &Path, page: &str, script: &str) -> Value {
    let place = tempfile::tempdir().expect("a folder");
    let driver = format!(
        "<script type=\"module\">\nconst page = window.symbolt?.page;\nconst found = {{}};\n\
         found.opened_ms = performance.now();\n\
         try {{ {script} }} catch (error) {{ found.error = String(error.stack ?? error); }}\n\
         const answer = document.createElement(\"pre\");\nanswer.id = \"found\";\n\
         answer.textContent = btoa(unescape(encodeURIComponent(JSON.stringify(found))));\n\
         document.body.append(answer);\n</script>\n</body>"
    );
    let path = place.path().join("page.html");
    std::fs::write(&path, page.replacen("</body>", &driver, 1)).expect("written");
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"])
        .args(["--enable-unsafe-swiftshader", "--window-size=1366,900", "--dump-dom"])
        .arg(format!("--user-data-dir={}", place.path().join("profile").display()))
        .arg("--virtual-time-budget=20000")
        .arg(format!("file://{}", path.display()))
        .output()
        .expect("the browser starts");
    let dom = String::from_utf8_lossy(&output.stdout);
    let answer =
        dom.split_once("<pre id=\"found\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    let said = String::from_utf8_lossy(&output.stderr);
    let (answer, _) = answer.unwrap_or_else(|| panic!("no answer from the page: {said}"));
    let found: Value =
        serde_json::from_slice(&STANDARD.decode(answer).expect("base64")).expect("JSON");
    assert!(found["error"].is_null(), "{}", found["error"]);
    println!("the page was open after {} ms", found["opened_ms"]);
    found
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("numbers").iter().filter_map(Value::as_f64).collect()
}

#[test]
fn in_a_browser_scene_traces_and_decisions_follow_the_moment() {
    let Some(browser) = browser() else { return };
    let mut npz =
        NpzReader::new(File::open(made().join("arrays.npz")).expect("there")).expect("npz");
    let times: Array1<f64> = npz.by_name("frames_t").expect("times");
    let parts: Array3<f32> = npz.by_name("frames_parts").expect("parts");
    let thought: Array1<f64> = npz.by_name("modules_t").expect("times");
    let module: Array2<f32> = npz.by_name("module_cause").expect("a module");
    let lines = std::fs::read_to_string(made().join("trace.jsonl")).expect("a trace");
    let asked: Vec<f64> = lines
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON"))
        .filter_map(|line| line["decision"]["asked_s"].as_f64())
        .collect();
    assert!(asked.len() >= 4, "{asked:?}");
    let chosen = [times.len() / 10, times.len() / 2, times.len() - 1];
    let moments: Vec<f64> = chosen.iter().map(|frame| times[*frame]).collect();
    let script = format!(
        "const select = document.getElementById('module');\n\
         select.value = [...select.options].find((o) => o.text === 'cause').value;\n\
         select.dispatchEvent(new Event('change'));\n\
         const scrub = document.getElementById('scrub');\n\
         found.states = {moments:?}.map((t) => {{ scrub.value = String(t);\n\
             scrub.dispatchEvent(new Event('input')); return page.state(); }});\n\
         const pixels = () => document.querySelector('#timeline canvas').toDataURL().length;\n\
         found.three = document.querySelector('#replay .view canvas') !== null;\n\
         document.querySelectorAll('#decisions tbody tr')[1].click();\n\
         found.clicked = page.state();\n\
         found.drawn = pixels();\n\
         const took = [];\n\
         for (let i = 0; i < 60; i++) {{ const begun = performance.now();\n\
             page.seek((i / 60) * page.duration); page.replay.renderer.getContext().finish();\n\
             took.push(performance.now() - begun); }}\n\
         found.frame_ms = took.sort((a, b) => a - b)[30];\n\
         found.labels = document.querySelectorAll('.labels span').length;\n\
         found.rows = document.querySelectorAll('#states tbody tr').length;"
    );
    let page = std::fs::read_to_string(made().join("report.html")).expect("a page");
    let found = opened(&browser, &page, &script);
    println!("a frame takes {} ms in software", found["frame_ms"]);
    let states = found["states"].as_array().expect("states");
    assert_eq!(states.len(), 3);
    for ((state, frame), moment) in states.iter().zip(chosen).zip(&moments) {
        assert!((state["time"].as_f64().expect("a time") - moment).abs() < 1e-6);
        let places = state["places"]["parts"].as_array().expect("parts");
        assert_eq!(places.len(), parts.dim().1);
        for (part, place) in places.iter().enumerate() {
            for (axis, value) in numbers(place).into_iter().enumerate() {
                let own = f64::from(parts[(frame, part, axis)]);
                assert!((value - own).abs() < 1e-5, "{moment}: {value} instead of {own}");
            }
        }
        let decision = asked.iter().filter(|asked| *asked <= moment).count() as i64 - 1;
        assert_eq!(state["decision"], decision, "{state}");
        assert_eq!(state["module"], "cause");
        let sample = thought.iter().filter(|t| **t as f32 <= *moment as f32).count() - 1;
        for (value, own) in numbers(&state["sample"]).into_iter().zip(module.row(sample)) {
            assert!((value - f64::from(*own)).abs() < 0.006, "{value} instead of {own}");
        }
        assert!(!numbers(&state["sample"]).is_empty());
    }
    let hand = |state: &Value| numbers(&state["places"]["hand"]);
    assert_ne!(hand(&states[0]), hand(&states[1]), "the arm moves");
    let now = |state: &Value| state["now"].as_str().expect("text").to_owned();
    assert!(now(&states[1]).contains("doing PUT_"), "{}", now(&states[1]));
    // A click on the second decision goes there and looks closely.
    let clicked = &found["clicked"];
    assert!((clicked["time"].as_f64().expect("a time") - asked[1]).abs() < 1e-6, "{clicked}");
    assert_eq!(clicked["decision"], 1);
    let view = numbers(&clicked["view"]);
    assert!(view[1] - view[0] < 1.0 && view[0] <= asked[1] && asked[1] <= view[1], "{view:?}");
    assert_eq!((found["labels"].as_u64(), found["rows"].as_u64()), (Some(5), Some(5)));
    assert!(found["drawn"].as_u64().is_some_and(|length| length > 5_000), "{}", found["drawn"]);
}

#[test]
fn strange_names_are_shown_as_text_and_never_run() {
    let Some(browser) = browser() else { return };
    let copy = copied();
    let evil = "<script>window.hacked = 1</script><img src=x onerror='window.hacked = 2'>";
    let path = copy.path().join("run.json");
    let mut facts: Value =
        serde_json::from_slice(&std::fs::read(&path).expect("there")).expect("JSON");
    facts["goal"] = json!(format!("</script>{evil}"));
    facts["command"] = json!(evil);
    facts["modules"][1]["names"][0] = json!(evil);
    facts["summary"]["</script>"] = json!(evil);
    std::fs::write(&path, facts.to_string()).expect("written");
    let trace = std::fs::read_to_string(copy.path().join("trace.jsonl")).expect("there");
    let trace = trace.replace("NUT_AT_START", "<script>window.hacked = 3</script>");
    std::fs::write(copy.path().join("trace.jsonl"), trace).expect("written");
    let (_, page) = report(copy.path());
    let script = "page.chooseModule(0); page.seek(0.1);\n\
                  found.hacked = window.hacked ?? null;\n\
                  found.images = document.querySelectorAll('main img').length;\n\
                  found.text = document.body.innerText.includes(
                      '\\u003cscript>window.hacked = 3\\u003c/script>');\n\
                  found.title = document.title;";
    let found = opened(&browser, &page, script);
    assert!(found["hacked"].is_null(), "{found}");
    assert_eq!((&found["images"], &found["text"]), (&json!(0), &json!(true)));
    assert!(found["title"].as_str().is_some_and(|title| title.contains("</script><script>")));
}

#[test]
fn half_a_folder_opens_in_a_browser_and_says_so() {
    let Some(browser) = browser() else { return };
    for gone in [&["arrays.npz"][..], &["run.json"], &["run.json", "domain.json", "trace.jsonl"]] {
        let copy = copied();
        for name in gone {
            std::fs::remove_file(copy.path().join(name)).expect("removed");
        }
        let (_, page) = report(copy.path());
        let script = "page.seek(1); found.said = document.getElementById('missing').innerText;";
        let said = opened(&browser, &page, script)["said"].as_str().expect("text").to_owned();
        assert!(gone.iter().all(|name| said.contains(name)), "{said}");
    }
}

#[test]
fn what_does_not_fit_is_left_out_and_the_rest_is_shown() {
    let Some(browser) = browser() else { return };
    let copy = copied();
    let path = copy.path().join("run.json");
    let mut facts: Value =
        serde_json::from_slice(&std::fs::read(&path).expect("there")).expect("JSON");
    let modules = facts["modules"].as_array().expect("modules").len();
    facts["modules"][1]["names"] = json!(["A"]);
    std::fs::write(&path, facts.to_string()).expect("written");
    let (told, page) = report(copy.path());
    assert_eq!(missing(&told).len(), 1, "{told}");
    let script = "page.seek(1); found.frames = page.frames.count; found.state = page.state();\n\
                  found.modules = page.timeline.content.modules.length;";
    let found = opened(&browser, &page, script);
    assert!(found["frames"].as_u64().is_some_and(|count| count > 100), "{found}");
    assert_eq!(found["state"]["places"]["parts"].as_array().map(Vec::len), Some(2));
    assert_eq!(found["modules"], modules - 1);
}

#[test]
fn arrays_are_left_out_by_themselves() {
    type Modules = Vec<(String, Array2<f64>)>;
    let said = |change: &dyn Fn(&mut Modules)| {
        let copy = copied();
        let path = copy.path().join("arrays.npz");
        let mut npz = NpzReader::new(File::open(&path).expect("there")).expect("arrays");
        let times: Array1<f64> = npz.by_name("frames_t").expect("times");
        let angles: Array2<f32> = npz.by_name("frames_angles").expect("angles");
        let fingers: Array2<f32> = npz.by_name("frames_fingers").expect("fingers");
        let parts: Array3<f32> = npz.by_name("frames_parts").expect("parts");
        let samples: Array1<f64> = npz.by_name("modules_t").expect("times");
        let names: Vec<String> = npz.names().expect("names");
        let names = names.into_iter().filter(|name| name.starts_with("module_"));
        let mut modules: Modules = names
            .map(|name| {
                let values: Array2<f32> = npz.by_name(&name).expect("a module");
                (name, values.mapv(f64::from))
            })
            .collect();
        change(&mut modules);
        let mut npz = NpzWriter::new(File::create(&path).expect("made"));
        npz.add_array("frames_t", &times).expect("written");
        npz.add_array("frames_angles", &angles).expect("written");
        npz.add_array("frames_fingers", &fingers).expect("written");
        npz.add_array("frames_parts", &parts).expect("written");
        npz.add_array("modules_t", &samples).expect("written");
        for (name, values) in &modules {
            npz.add_array(name.as_str(), values).expect("written");
        }
        npz.finish().expect("written");
        let (found, _) = report(copy.path());
        missing(&found).iter().map(|said| (*said).to_owned()).collect::<Vec<_>>()
    };
    // Doubles are as good; without its spikes only they are missing.
    let whole = said(&|_| {});
    assert!(whole.len() == 1 && whole[0].contains("spikes_t cannot be read"), "{whole:?}");
    let short = said(&|modules| modules[0].1 = Array2::zeros((3, modules[0].1.ncols())));
    assert!(short.len() == 2 && short[0].contains("has 3 rows"), "{short:?}");
    let odd = said(&|modules| modules[0].1[[5, 0]] = f64::NAN);
    assert!(odd.len() == 2 && odd[1].contains("is not what run.json says"), "{odd:?}");
    let gone = said(&|modules| drop(modules.remove(0)));
    assert!(gone.len() == 2 && gone[1].contains("it has nothing of the module"), "{gone:?}");
}

#[test]
fn numbers_beyond_all_bounds_are_damage_and_no_panic() {
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
    let place = tempfile::tempdir().expect("a folder");
    let out = place.path().join("out");
    let to = out.to_str().expect("UTF-8");
    symbolt(&["run", "--demos", "2", "--episodes", "2", "--film", "2", "--out", to]);
    let read = |name: &str| std::fs::read_to_string(out.join(name)).expect("a file");
    let facts: Value = serde_json::from_str(&read("run.json")).expect("JSON");
    assert_eq!((&facts["filmed"], facts["summary"]["episodes"].as_u64()), (&json!(1), Some(2)));
    assert!(
        facts["command"].as_str().is_some_and(|c| c.contains("--episodes 2 --record-episode 2"))
    );
    // Files of two episodes side by side are told apart by their length.
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
    assert!(said.contains("run.json: it has no episode 2 that could be recorded"), "{said}");
    // The frames begin with what `scene.json` has and end when the second episode does.
    let scene: Value = serde_json::from_str(&read("scene.json")).expect("JSON");
    let file = File::open(out.join("arrays.npz")).expect("there");
    let mut npz = ndarray_npy::NpzReader::new(file).expect("arrays");
    let parts: Array3<f32> = npz.by_name("frames_parts").expect("parts");
    let times: Array1<f64> = npz.by_name("frames_t").expect("times");
    let seen = numbers(&scene["objects"][0]["position"]);
    assert!(
        (0..2).any(|part| (0..2).all(|i| (seen[i] - f64::from(parts[[0, part, i]])).abs() < 2e-3))
    );
    let trace = read("trace.jsonl");
    let lines = trace.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let own: Vec<Value> = lines.collect();
    let end = |episode: u64| {
        let line = own.iter().find(|line| line["episode"] == episode && line["end"].is_object());
        line.and_then(|line| line["end"]["simulated_s"].as_f64()).expect("an end")
    };
    let last = times.last().copied().expect("frames");
    assert!((last - end(1)).abs() < 0.1 && (last - end(0)).abs() > 0.1, "{last} {}", end(0));
    let Some(browser) = browser() else { return };
    let script = "found.asked = page.acts.map((act) => act.asked);\n\
                  found.heading = document.getElementById('episode').textContent;\n\
                  page.decisionRows[1].click(); found.time = page.time;\n\
                  found.row = page.decisionRows[1].innerText;";
    let found = opened(&browser, &read("report.html"), script);
    let asked = |episode: u64| -> Vec<f64> {
        let of = own.iter().filter(|line| line["episode"] == episode);
        of.filter_map(|line| line["decision"]["asked_s"].as_f64()).collect()
    };
    assert_ne!(asked(0), asked(1), "the episodes can be told apart");
    assert_eq!(numbers(&found["asked"]), asked(1));
    assert_eq!(found["time"].as_f64(), Some(asked(1)[1]));
    let row = found["row"].as_str().expect("text");
    assert!(row.contains(&format!("{:.2}", asked(1)[1])), "{row}");
    assert_eq!(found["heading"], "Episode 2 of 2");
}

#[test]
fn ten_simulated_minutes_stay_below_ten_megabytes_and_open() {
    let copy = copied();
    let (minutes, per_s) = (10.0, 25.0);
    let frames = (60.0 * minutes * per_s) as usize;
    let path = copy.path().join("run.json");
    let mut facts: Value =
        serde_json::from_slice(&std::fs::read(&path).expect("there")).expect("JSON");
    (facts["scene"]["nuts"], facts["scene"]["bolts"]) = (json!(4), json!(4));
    std::fs::write(&path, facts.to_string()).expect("written");
    let trace = copy.path().join("trace.jsonl");
    let text = std::fs::read_to_string(&trace).expect("there");
    let ends = text.lines().map(|line| {
        let mut line: Value = serde_json::from_str(line).expect("JSON");
        if line["end"].is_object() {
            line["end"]["simulated_s"] = json!(60.0 * minutes);
        }
        line.to_string() + "\n"
    });
    std::fs::write(&trace, ends.collect::<String>()).expect("written");
    // Numbers that do not pack well: everything moves all the time.
    let wave = |frame: usize, number: usize| {
        (0.37 * frame as f64 + 1.7 * number as f64).sin() as f32 * 0.3
    };
    let file = File::create(copy.path().join("arrays.npz")).expect("made");
    let mut npz = NpzWriter::new_compressed(file);
    let seconds = Array1::from_shape_fn(frames, |f| f as f64 / per_s);
    npz.add_array("frames_t", &seconds).expect("written");
    npz.add_array("frames_angles", &Array2::from_shape_fn((frames, 7), |(f, i)| wave(f, i)))
        .expect("written");
    npz.add_array("frames_fingers", &Array2::from_elem((frames, 2), 0.03f32)).expect("written");
    let parts = Array3::from_shape_fn((frames, 8, 7), |(f, p, i)| wave(f, 7 * p + i));
    npz.add_array("frames_parts", &parts).expect("written");
    let samples = frames + 100 * 150;
    let moments = Array1::from_shape_fn(samples, |s| 60.0 * minutes * s as f64 / samples as f64);
    npz.add_array("modules_t", &moments).expect("written");
    for module in facts["modules"].as_array().expect("modules") {
        let columns = module["names"].as_array().expect("names").len();
        let values = Array2::from_shape_fn((samples, columns), |(s, c)| wave(s, c));
        let name = format!("module_{}", module["name"].as_str().expect("a name"));
        npz.add_array(name, &values).expect("written");
    }
    npz.add_array("spikes_t", &Array1::<f64>::zeros(0)).expect("written");
    npz.add_array("spikes_row", &Array1::<u32>::zeros(0)).expect("written");
    npz.finish().expect("written");
    let (found, page) = report(copy.path());
    assert!(missing(&found).is_empty(), "{found}");
    assert!(page.len() < 10_000_000, "{}", page.len());
    let Some(browser) = browser() else { return };
    let script =
        "page.timeline.look(0, page.duration); page.seek(300); found.state = page.state();";
    let state = &opened(&browser, &page, script)["state"];
    assert_eq!(state["time"], 300);
    assert_eq!(state["places"]["parts"].as_array().map(Vec::len), Some(8));
}

#[test]
fn experiments_get_a_page_of_their_own() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = |name: &str| place.path().join(name).display().to_string();
    for (name, trials) in [("figure-1a", "20"), ("timing", "2")] {
        symbolt(&["experiment", name, "--trials", trials, "--out", &folder(name)]);
    }
    let (found, _) = report(Path::new(&folder("timing")));
    assert!(missing(&found).is_empty());
    let (found, page) = report(place.path());
    assert!(missing(&found).is_empty());
    // A third was killed: it is named, not left out.
    std::fs::create_dir(folder("killed")).expect("made");
    std::fs::copy(place.path().join("timing/trials.bin"), place.path().join("killed/trials.bin"))
        .expect("copied");
    let (found, _) = report(place.path());
    assert!(missing(&found).join("").starts_with("killed/results.json: it is not there"));
    let Some(browser) = browser() else { return };
    let script = "found.sections = document.querySelectorAll('main section').length;\n\
                  found.figures = [...document.querySelectorAll('img.figure')].length;\n\
                  found.rows = document.querySelectorAll('tbody tr').length;";
    let shown = opened(&browser, &page, script);
    assert_eq!((&shown["sections"], &shown["figures"]), (&json!(2), &json!(2)));
    assert_eq!(shown["rows"], 14 + 10);
}
