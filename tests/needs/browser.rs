//! The report's page in headless Chromium. Without Chromium these tests are ignored.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use libtest_mimic::Trial;
use ndarray::{Array1, Array2, Array3};
use serde_json::{Value, json};
use symbolt::files::npz::NpzReader;

use crate::chromium::{Window, browser, opened_in};
use crate::needs::{named, only_if};
use crate::run::{
    copied, copy_of, facts, made, made_experiments, made_of_ten_minutes, made_of_two, missing,
    numbers, report, text,
};

pub fn trials() -> Vec<Trial> {
    only_if(
        browser().is_some(),
        "needs Chromium",
        named![
            in_a_browser_scene_traces_and_decisions_follow_the_moment,
            strange_names_are_shown_as_text_and_never_run,
            half_a_folder_opens_in_a_browser_and_says_so,
            what_does_not_fit_is_left_out_and_the_rest_is_shown,
            another_recorded_episode_is_shown,
            ten_simulated_minutes_open,
            experiments_are_shown,
        ],
    )
}

fn opened(page: &str, script: &str) -> Value {
    opened_in(&Window { width: 1366, dark: false }, page, script)
}

fn in_a_browser_scene_traces_and_decisions_follow_the_moment() {
    let arrays = std::fs::read(made().join("arrays.npz")).expect("there");
    let mut npz = NpzReader::new(&arrays).expect("npz");
    let times: Array1<f64> = npz.read("frames_t").expect("times");
    let parts: Array3<f32> = npz.read("frames_parts").expect("parts");
    let thought: Array1<f64> = npz.read("modules_t").expect("times");
    let module: Array2<f32> = npz.read("module_goal_set").expect("a module");
    let lines = text(made(), "trace.jsonl");
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
         select.value = [...select.options].find((o) => o.text === 'goal set').value;\n\
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
    let page = text(made(), "report.html");
    let found = opened(&page, &script);
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
        assert_eq!(state["module"], "goal_set");
        let sample = thought.iter().filter(|t| **t as f32 <= *moment as f32).count() - 1;
        for (value, own) in numbers(&state["sample"]).into_iter().zip(module.row(sample)) {
            assert!((value - f64::from(*own)).abs() < 0.006, "{value} instead of {own}");
        }
        assert!(!numbers(&state["sample"]).is_empty());
    }
    let hand = |state: &Value| numbers(&state["places"]["hand"]);
    assert_ne!(hand(&states[0]), hand(&states[1]), "the arm moves");
    let now = |state: &Value| state["now"].as_str().expect("text").to_owned();
    assert!(now(&states[1]).contains("Doing: put the "), "{}", now(&states[1]));
    // A click on the second decision seeks to it and zooms in.
    let clicked = &found["clicked"];
    assert!((clicked["time"].as_f64().expect("a time") - asked[1]).abs() < 1e-6, "{clicked}");
    assert_eq!(clicked["decision"], 1);
    let view = numbers(&clicked["view"]);
    assert!(view[1] - view[0] < 1.0 && view[0] <= asked[1] && asked[1] <= view[1], "{view:?}");
    // One row for each place; one label for each state, as each frame has one object here.
    let domain: Value = serde_json::from_str(&text(made(), "domain.json")).expect("JSON");
    let states = domain["states"].as_array().expect("states");
    let places = |state: &Value| state["places"].as_array().map_or(0, Vec::len) as u64;
    let rows: u64 = states.iter().map(places).sum();
    let labels = states.len() as u64;
    assert!(rows >= 5 && labels >= 5, "{domain}");
    assert_eq!((found["labels"].as_u64(), found["rows"].as_u64()), (Some(labels), Some(rows)));
    assert!(found["drawn"].as_u64().is_some_and(|length| length > 5_000), "{}", found["drawn"]);
}

fn strange_names_are_shown_as_text_and_never_run() {
    let copy = copied();
    let evil = "<script>window.hacked = 1</script><img src=x onerror='window.hacked = 2'>";
    let path = copy.path().join("run.json");
    let mut facts = facts(copy.path());
    facts["goal"] = json!(format!("</script>{evil}"));
    facts["command"] = json!(evil);
    facts["modules"][1]["names"][0] = json!(evil);
    facts["summary"]["</script>"] = json!(evil);
    std::fs::write(&path, facts.to_string()).expect("written");
    let trace = text(copy.path(), "trace.jsonl");
    let trace = trace.replace("BOLT_AT_START", "<script>window.hacked = 3</script>");
    std::fs::write(copy.path().join("trace.jsonl"), trace).expect("written");
    let (_, page) = report(copy.path());
    let script = "page.chooseModule(0); page.seek(0.1);\n\
                  found.hacked = window.hacked ?? null;\n\
                  found.images = document.querySelectorAll('main img').length;\n\
                  found.text = document.body.innerText.includes(
                      '\\u003cscript>window.hacked = 3\\u003c/script>');\n\
                  found.title = document.title;";
    let found = opened(&page, script);
    assert!(found["hacked"].is_null(), "{found}");
    assert_eq!((&found["images"], &found["text"]), (&json!(0), &json!(true)));
    assert!(found["title"].as_str().is_some_and(|title| title.starts_with("nuts-and-bolts: Put ")));
}

fn half_a_folder_opens_in_a_browser_and_says_so() {
    for gone in [&["arrays.npz"][..], &["run.json"], &["run.json", "domain.json", "trace.jsonl"]] {
        let copy = copied();
        for name in gone {
            std::fs::remove_file(copy.path().join(name)).expect("removed");
        }
        let (_, page) = report(copy.path());
        let script = "page.seek(1); found.said = document.getElementById('missing').innerText;";
        let said = opened(&page, script)["said"].as_str().expect("text").to_owned();
        assert!(gone.iter().all(|name| said.contains(name)), "{said}");
    }
}

fn what_does_not_fit_is_left_out_and_the_rest_is_shown() {
    let copy = copied();
    let path = copy.path().join("run.json");
    let mut facts = facts(copy.path());
    let modules = facts["modules"].as_array().expect("modules").len();
    facts["modules"][1]["names"] = json!(["A"]);
    std::fs::write(&path, facts.to_string()).expect("written");
    let (told, page) = report(copy.path());
    assert_eq!(missing(&told).len(), 1, "{told}");
    let script = "page.seek(1); found.frames = page.frames.count; found.state = page.state();\n\
                  found.modules = page.timeline.content.modules.length;";
    let found = opened(&page, script);
    assert!(found["frames"].as_u64().is_some_and(|count| count > 100), "{found}");
    assert_eq!(found["state"]["places"]["parts"].as_array().map(Vec::len), Some(2));
    assert_eq!(found["modules"], modules - 1);
}

fn another_recorded_episode_is_shown() {
    let out = made_of_two();
    let script = "found.asked = page.acts.map((act) => act.asked);\n\
                  found.heading = document.getElementById('episode').textContent;\n\
                  page.decisionRows[1].click(); found.time = page.time;\n\
                  found.row = page.decisionRows[1].innerText;\n\
                  const listed = [...document.querySelectorAll('#episode-list tbody tr')];\n\
                  found.listed = listed.map((row) => row.innerText);\n\
                  const modules = page.timeline.content.modules.length;\n\
                  listed[0].querySelector('button').click();\n\
                  found.other = { heading: document.getElementById('episode').textContent,\n\
                      asked: page.acts.map((act) => act.asked), frames: page.frames.count,\n\
                      hand: page.state().places?.hand, pressed: listed[0].querySelector('button')\n\
                          .getAttribute('aria-pressed'), modules: page.timeline.content.modules.length };\n\
                  listed[1].querySelector('button').click();\n\
                  found.back = page.timeline.content.modules.length === modules && modules > 0;";
    let found = opened(&text(out, "report.html"), script);
    let lines: Vec<Value> = text(out, "trace.jsonl")
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let asked = |episode: u64| -> Vec<f64> {
        let of = lines.iter().filter(|line| line["episode"] == episode);
        of.filter_map(|line| line["decision"]["asked_s"].as_f64()).collect()
    };
    assert_ne!(asked(0), asked(1), "the episodes can be told apart");
    assert_eq!(numbers(&found["asked"]), asked(1));
    assert_eq!(found["time"].as_f64(), Some(asked(1)[1]));
    let row = found["row"].as_str().expect("text");
    assert!(row.contains(&format!("{:.2}", asked(1)[1])), "{row}");
    assert_eq!(found["heading"], "Episode 2 of 2");
    // The other episode has its decisions and pictures as well, but not the network's activity.
    let listed: Vec<&str> =
        found["listed"].as_array().expect("rows").iter().filter_map(Value::as_str).collect();
    assert!(listed.len() == 2 && listed.iter().all(|row| row.contains("solved")), "{listed:?}");
    let other = &found["other"];
    assert_eq!(other["heading"], "Episode 1 of 2");
    assert_eq!(numbers(&other["asked"]), asked(0));
    assert!(other["frames"].as_u64().is_some_and(|frames| frames > 50), "{other}");
    assert_eq!((&other["pressed"], &other["modules"]), (&json!("true"), &json!(0)));
    assert_eq!(numbers(&other["hand"]).len(), 3);
    assert_eq!(found["back"], true);
}

fn ten_simulated_minutes_open() {
    let copy = copy_of(made_of_ten_minutes());
    let (_, page) = report(copy.path());
    let script =
        "page.timeline.look(0, page.duration); page.seek(300); found.state = page.state();";
    let state = &opened(&page, script)["state"];
    assert_eq!(state["time"], 300);
    assert_eq!(state["places"]["parts"].as_array().map(Vec::len), Some(8));
}

fn experiments_are_shown() {
    let place = copy_of(made_experiments());
    let (_, page) = report(place.path());
    let script = "found.sections = document.querySelectorAll('main section').length;\n\
                  found.figures = [...document.querySelectorAll('img.figure')].length;\n\
                  found.rows = document.querySelectorAll('tbody tr').length;\n\
                  found.warned = [...document.querySelectorAll('main section')].map((s) =>\n\
                      s.textContent.includes('from fewer than 10 independent trials'));\n\
                  found.heads = [...document.querySelectorAll('th')].map((th) => th.textContent);";
    let shown = opened(&page, script);
    assert_eq!((&shown["sections"], &shown["figures"]), (&json!(2), &json!(2)));
    assert_eq!(shown["rows"], 14 + 10);
    // Of 20 trials and of 2.
    assert_eq!(shown["warned"], json!([false, true]));
    let heads = shown["heads"].to_string();
    assert!(heads.contains("tight") && !heads.contains("few_trials"), "{heads}");
}
