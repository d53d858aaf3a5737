//! The page of a live run in headless Chromium, driven as a person does: opens, plots, silences, goes back.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use libtest_mimic::Trial;
use serde_json::json;
use symbolt::prelude::*;

use crate::chromium::browser;
use crate::devtools::Devtools;
use crate::model::model;
use crate::needs::{named, only_if};
use crate::page::AUDIT;
use crate::window::{Served, served};

pub fn trials() -> Vec<Trial> {
    only_if(
        browser().is_some(),
        "needs Chromium",
        named![
            a_person_plots_silences_goes_back_and_finds_what_the_memory_is_for,
            a_part_is_dragged_in_the_picture_and_taken_away_by_hand,
            the_page_of_a_live_run_fits_a_phone_in_the_dark_and_is_used_by_keys_alone,
            a_live_run_is_readable_by_everyone_on_every_width,
            the_network_is_searched_dragged_zoomed_and_folded_and_every_plot_is_exported,
            a_refusal_goes_with_the_next_command_and_a_failed_run_is_taken_back_by_hand,
            an_address_without_its_token_says_what_to_open,
        ],
    )
}

fn opened(served: &Served, width: u32, height: u32) -> Devtools {
    let address = format!("http://127.0.0.1:{}/#{}", served.port, served.token);
    let mut page = Devtools::open(&address, width, height);
    page.until(
        "document.documentElement.dataset.ready === 'yes' && window.symbolt.page.frame !== null",
    );
    page
}

fn spiking() -> Simulator {
    model(&PopulationPlan::lif(), 64).unwrap()
}

fn tick(page: &mut Devtools) -> u64 {
    page.value("window.symbolt.page.frame.tick").as_u64().unwrap()
}

/// What the page's plot number `index` shows last.
fn last(page: &mut Devtools, index: usize) -> Vec<f64> {
    let rows = page.value(&format!("window.symbolt.page.plots.all[{index}].rows.at(-1)"));
    rows.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
}

fn a_person_plots_silences_goes_back_and_finds_what_the_memory_is_for() {
    let served = served(spiking());
    let mut page = opened(&served, 1366, 1000);
    let opened_ms = page.value("performance.now()").as_f64().unwrap();
    assert!(opened_ms < 10_000.0, "{opened_ms}");
    // The choice, and what the memory holds.
    for (module, button) in [("rules", "#values"), ("memory", "#similar")] {
        page.click(&format!("#network [data-path=\"{module}\"]"));
        page.until(&format!("document.getElementById('chosen').textContent === '{module}'"));
        if module == "rules" {
            page.value("document.getElementById('output').value = 'rules.chosen'");
        }
        page.click(button);
    }
    page.until("window.symbolt.page.plots.all.length === 2 && window.symbolt.page.plots.all.every((p) => p.rows.length > 0)");
    page.value("window.first = document.querySelector('.plot canvas').toDataURL()");
    for _ in 0..4 {
        let before = tick(&mut page);
        page.click("[data-step=\"100\"]");
        page.until(&format!("window.symbolt.page.frame.tick === {}", before + 100));
    }
    let nut = last(&mut page, 0);
    assert!(nut[0] > nut[1], "TAKE_NUT is chosen: {nut:?}");
    // Curves are drawn, as soon as the browser draws.
    page.until("document.querySelector('.plot canvas').toDataURL() !== window.first");
    // Back by 300 ticks; the memory is silenced; on.
    for _ in 0..3 {
        let before = tick(&mut page);
        page.click("[data-back=\"100\"]");
        page.until(&format!("window.symbolt.page.frame.tick === {}", before - 100));
    }
    page.until("window.symbolt.page.plots.all.every((p) => p.ticks.every((tick) => tick <= 100))");
    for to in [40, 100] {
        page.value(&format!(
            "{{ const to = document.getElementById('tick'); to.value = '{to}'; to.dispatchEvent(new Event('change')); }}"
        ));
        page.until(&format!("window.symbolt.page.frame.tick === {to}"));
    }
    page.click("#silence");
    page.until("document.querySelectorAll('#log tbody tr').length === 1");
    assert_eq!(
        page.value("document.querySelector('#log tbody tr').textContent"),
        "100silence memory"
    );
    assert_eq!(
        page.value("document.querySelector('#log tbody td:last-child').title"),
        "{\"silence\":{\"at\":\"memory\"}}"
    );
    page.until(
        "document.querySelector('#network [data-path=\"memory\"]').classList.contains('held')",
    );
    page.value("document.querySelector('#speed').value = ''");
    page.click("#play");
    page.until("window.symbolt.page.frame.tick > 400");
    page.click("#play");
    page.until("window.symbolt.page.frame.mode === 0");
    let bolt = last(&mut page, 0);
    assert!(bolt[1] > bolt[0], "TAKE_BOLT is chosen: {bolt:?}");
    // What the run had done before is a branch: beside the present, with the first tick where they differ.
    page.until("document.querySelectorAll('#branches li').length === 1");
    assert_eq!(page.value("document.getElementById('branches').hidden"), false);
    page.until(
        "window.symbolt.page.plots.all.every((plot) => plot.branches.get(1)?.ticks.length > 2)",
    );
    page.until("window.symbolt.page.plots.all[0].compared.textContent.startsWith('Branch 1 (dashed) differs from ')");
    let csv = page.value("window.symbolt.page.plots.all[0].csv()");
    let csv = csv.as_str().unwrap();
    assert!(csv.starts_with("run,time_s,") && csv.contains("\nbranch 1,0.4"), "{csv:.300}");
    let svg = page.value("window.symbolt.page.plots.all[0].svg()");
    assert!(svg.as_str().unwrap().contains("stroke-dasharray=\"7 4\""));
    // Back to it: the first choice stands again, and what was silenced is the branch now.
    page.click("#branches button");
    page.until("window.symbolt.page.frame.tick === 400");
    page.until("window.symbolt.page.plots.turns === 1");
    let nut = last(&mut page, 0);
    assert!(nut[0] > nut[1], "TAKE_NUT is chosen: {nut:?}");
    page.click("#branches button");
    page.until("window.symbolt.page.plots.turns === 2 && window.symbolt.page.frame.tick > 400");
    // What is not possible is said, and every plot is exported.
    page.click("#expression");
    page.types("SCREW");
    page.click("#similar");
    page.until("document.getElementById('refusal').textContent.includes('SCREW')");
    assert_eq!(page.value("window.symbolt.page.plots.all.length"), 2);
    let csv = page.value("window.symbolt.page.plots.all[1].csv()");
    let csv = csv.as_str().unwrap();
    assert!(csv.starts_with("run,time_s,NUT,BOLT\n") && csv.lines().count() > 10, "{csv:.200}");
    let svg = page.value("window.symbolt.page.plots.all[1].svg()");
    assert!(svg.as_str().unwrap().contains("<polyline points="));
    if let Some(folder) = std::env::var_os("SYMBOLT_PICTURES") {
        page.value("scrollTo(0, 0)");
        page.picture(&std::path::Path::new(&folder).join("view.png"));
    }
    drop(page);
    let live = served.ended();
    assert_eq!(live.made().len(), 1);
}

/// Brings the scene into view, and returns where the bolt is in the window.
fn part(page: &mut Devtools) -> [f64; 2] {
    let place = page.value(
        "(() => { const { replay } = window.symbolt.page.scene; replay.canvas.scrollIntoView({ block: 'center' }); const box = replay.canvas.getBoundingClientRect(); \
         const [x, y] = replay.project(replay.bodies.parts[1].position); return [box.left + x, box.top + y]; })()",
    );
    [0, 1].map(|axis| place[axis].as_f64().unwrap())
}

fn a_part_is_dragged_in_the_picture_and_taken_away_by_hand() {
    let folder = tempfile::tempdir().unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_symbolt"))
        .current_dir(folder.path())
        .args(["view", "--demos", "2", "--quiet", "--log", "log.jsonl"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(program.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let mut page = Devtools::open(line.trim().strip_prefix("Open ").unwrap(), 1366, 1000);
    page.until("Boolean(window.symbolt?.page.scene?.replay)");
    page.click("[data-step=\"10\"]");
    page.until("window.symbolt.page.frame.tick === 10");
    let rows = |page: &mut Devtools| {
        page.value("document.querySelectorAll('#log tbody tr').length").as_u64().unwrap()
    };
    let mouse = |page: &mut Devtools, kind: &str, [x, y]: [f64; 2]| {
        let buttons = u8::from(kind != "mouseReleased");
        let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
        page.page("Input.dispatchMouseEvent", event);
    };
    // Without the button, dragging turns the picture.
    let drag = |page: &mut Devtools| {
        let [x, y] = part(page);
        mouse(page, "mousePressed", [x, y]);
        mouse(page, "mouseMoved", [x - 20.0, y + 5.0]);
        mouse(page, "mouseMoved", [x - 45.0, y + 10.0]);
        mouse(page, "mouseReleased", [x - 45.0, y + 10.0]);
    };
    drag(&mut page);
    page.click("[data-step=\"10\"]");
    page.until("window.symbolt.page.frame.tick === 20");
    assert_eq!(rows(&mut page), 0);
    assert_eq!(page.value("document.querySelectorAll('#events li').length"), 0);
    page.click("#grab");
    let before = page.value("[...window.symbolt.page.scene.frames.poses.slice(7, 9)]");
    drag(&mut page);
    page.until("document.querySelectorAll('#log tbody tr').length === 1");
    page.until(&format!(
        "Math.hypot(...window.symbolt.page.scene.frames.poses.slice(7, 9).map((v, i) => v - {before}[i])) > 0.02"
    ));
    if let Some(folder) = std::env::var_os("SYMBOLT_PICTURES") {
        page.picture(&std::path::Path::new(&folder).join("hand.png"));
    }
    // What has no room is refused, as well where it is typed.
    let nut = page.value("[...window.symbolt.page.scene.frames.poses.slice(0, 2)].map((m) => (1000 * m).toFixed(1)).join(', ')");
    page.value("{ const select = document.getElementById('part'); select.value = select.options[1].value; }");
    page.value(&format!("document.getElementById('place').value = {nut}"));
    page.click("#move");
    page.until("document.getElementById('refusal').textContent.includes('there is no room for')");
    page.click("#remove");
    page.until("document.querySelectorAll('#log tbody tr').length === 2");
    let changes = page.value("document.querySelector('#log tbody').textContent");
    let changes = changes.as_str().unwrap();
    assert!(
        changes.contains("take bolt 0 away") && changes.contains("move bolt 0 to "),
        "{changes}"
    );
    page.until("window.symbolt.page.scene.frames.poses[9] < -0.2");
    let log = std::fs::read_to_string(folder.path().join("log.jsonl")).unwrap();
    assert_eq!(log.lines().count(), 2, "{log}");
    // The one decision that is left: nothing can be done.
    page.click("#until");
    page.until("document.querySelectorAll('#events li').length === 1");
    page.until(
        "document.querySelector('#events li').textContent.match(/^0\\.\\d{3} s: /) !== null",
    );
    assert!(
        log.ends_with("{\"tick\":20,\"do\":{\"world\":{\"remove\":{\"object\":\"bolt_0\"}}}}\n"),
        "{log}"
    );
    page.value("window.symbolt.page.session.send('end')");
    assert!(program.wait().unwrap().success());
}

fn the_page_of_a_live_run_fits_a_phone_in_the_dark_and_is_used_by_keys_alone() {
    let served = served(spiking());
    let mut page = opened(&served, 390, 844);
    page.page(
        "Emulation.setEmulatedMedia",
        json!({ "features": [{ "name": "prefers-color-scheme", "value": "dark" }] }),
    );
    page.until("document.documentElement.dataset.theme === 'dark'");
    assert_eq!(page.value("document.documentElement.scrollWidth <= innerWidth"), true);
    page.value("document.querySelector('[data-step=\"1\"]').focus()");
    page.press("ArrowRight", "");
    page.until("window.symbolt.page.frame.tick === 1");
    page.press("ArrowLeft", "");
    page.until("window.symbolt.page.frame.tick === 0");
    page.press("/", "/");
    page.until("document.activeElement.id === 'search'");
    page.types("memory.output");
    page.press("Enter", "\r");
    page.until("document.getElementById('chosen').textContent.startsWith('memory')");
    page.value("document.getElementById('values').focus()");
    page.press("Enter", "\r");
    page.until("window.symbolt.page.plots.all.length === 1");
    if let Some(folder) = std::env::var_os("SYMBOLT_PICTURES") {
        page.value("scrollTo(0, 0)");
        page.picture(&std::path::Path::new(&folder).join("phone.png"));
    }
    drop(page);
    served.ended();
}

fn a_live_run_is_readable_by_everyone_on_every_width() {
    let served = served(spiking());
    for (width, dark) in [(1366, false), (1366, true), (390, false), (390, true), (320, true)] {
        let mut page = opened(&served, width, 844);
        let scheme = if dark { "dark" } else { "light" };
        let media = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        page.page("Emulation.setEmulatedMedia", media);
        page.until(&format!("document.documentElement.dataset.theme === '{scheme}'"));
        page.click_until(
            "#network [data-path=\"memory\"]",
            "document.getElementById('chosen').textContent.startsWith('memory')",
        );
        for button in ["#similar", "#spikes", "#energy"] {
            page.click(button);
        }
        page.until("window.symbolt.page.plots.all.length === 4");
        page.click("#silence");
        page.until("document.querySelectorAll('#log tbody tr').length > 0");
        let audit = format!(
            "(() => {{ const found = {{}}; const page = window.symbolt.page; {AUDIT} return found; }})()"
        );
        let found = page.value(&audit);
        let at = format!("{width} px, {scheme}: {found}");
        assert!(
            found["texts"].as_u64() > Some(40) && found["controls"].as_u64() > Some(30),
            "{at}"
        );
        for fault in ["faint", "nameless", "unreached"] {
            assert_eq!(found[fault], json!([]), "{fault}, {at}");
        }
        assert!(found["wide"].as_f64() <= Some(0.0), "scrolls sideways, {at}");
        if let Some(folder) = std::env::var_os("SYMBOLT_PICTURES") {
            page.click("[data-step=\"100\"]");
            page.value("window.scrollTo(0, 0)");
            let name = format!("live-{width}-{scheme}.png");
            page.whole(&std::path::Path::new(&folder).join(name));
        }
    }
    served.ended();
}

fn the_network_is_searched_dragged_zoomed_and_folded_and_every_plot_is_exported() {
    let served = served(spiking());
    let mut page = opened(&served, 1366, 1000);
    let boxes = |page: &mut Devtools| {
        page.value("document.querySelectorAll('#network .box').length").as_u64().unwrap()
    };
    let view = |page: &mut Devtools| {
        page.value("document.querySelector('#network svg').getAttribute('viewBox')")
    };
    let folded = boxes(&mut page);
    // A second click opens a module, and the search finds what is folded.
    page.click("#network [data-path=\"memory\"]");
    page.click("#network [data-path=\"memory\"]");
    page.until(&format!("document.querySelectorAll('#network .box').length > {folded}"));
    page.click("#fold");
    assert_eq!(boxes(&mut page), folded);
    page.click("#search");
    page.types("rules.chosen");
    page.press("Enter", "\r");
    page.until("document.getElementById('output').value === 'rules.chosen'");
    assert!(boxes(&mut page) > folded);
    page.click("#fold");
    let before = view(&mut page);
    page.click("#nearer");
    let nearer = view(&mut page);
    assert_ne!(before, nearer);
    let place = page.value(
        "(() => { const r = document.querySelector('#network svg').getBoundingClientRect(); return [r.x + 12, r.y + 12]; })()",
    );
    let [x, y] = [0, 1].map(|axis| place[axis].as_f64().unwrap());
    for (kind, x) in [("mousePressed", x), ("mouseMoved", x + 60.0), ("mouseReleased", x + 60.0)] {
        let buttons = u8::from(kind != "mouseReleased");
        let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
        page.page("Input.dispatchMouseEvent", event);
    }
    assert_ne!(view(&mut page), nearer);
    // Values, an expression that is typed in, chosen neurons, energy: a plot of each, while the run goes on.
    page.click("#play");
    page.click("#network [data-path=\"memory\"]");
    page.value("document.getElementById('output').value = 'memory.output'");
    page.click("#values");
    page.click("#expression");
    page.types("NUT + 0.5 * ~BOLT, NUT * BOLT");
    page.click("#similar");
    page.value("{ document.getElementById('from').value = 7; document.getElementById('count').value = 9; }");
    page.click("#spikes");
    page.click("#energy");
    page.until("window.symbolt.page.plots.all.length === 5");
    page.until("window.symbolt.page.plots.all.every((plot) => plot.rows.length > 3)");
    page.until("window.symbolt.page.frame.tick > 60");
    page.click("#play");
    page.until("window.symbolt.page.frame.mode === 0");
    page.value(
        "{ window.saved = []; URL.createObjectURL = (blob) => { blob.text().then((text) => saved.push([blob.type, text])); return 'data:,'; }; }",
    );
    page.value("HTMLAnchorElement.prototype.click = function () {}");
    page.value("document.querySelectorAll('.plot button').forEach((button) => { if (button.textContent !== 'Remove') button.click(); })");
    page.until("window.saved.length === 10");
    let saved = page.value("saved");
    let of = |kind: &str| -> Vec<String> {
        let all = saved.as_array().unwrap().iter().filter(|one| one[0] == kind);
        all.map(|one| one[1].as_str().unwrap().to_owned()).collect()
    };
    let (tables, drawings) = (of("text/csv"), of("image/svg+xml"));
    assert!(drawings.len() == 5 && drawings.iter().all(|svg| svg.starts_with("<svg xmlns=")));
    let mut heads: Vec<&str> = tables.iter().map(|csv| csv.split(',').nth(1).unwrap()).collect();
    heads.sort_unstable();
    heads.iter_mut().for_each(|head| *head = head.split('\n').next().unwrap());
    let energy = ["spikes a second", "synaptic events a second"];
    assert_eq!(heads, ["0", "NUT + 0.5 * ~BOLT", "neuron", energy[0], energy[1]]);
    let neurons = tables.iter().find(|csv| csv.starts_with("time_s,neuron")).unwrap();
    let neurons = neurons.lines().skip(1).map(|row| row.split(',').nth(1).unwrap().parse::<u32>());
    let neurons: Vec<u32> = neurons.map(Result::unwrap).collect();
    assert!(!neurons.is_empty() && neurons.iter().all(|neuron| (7..16).contains(neuron)));
    drop(page);
    served.ended();
}

fn a_refusal_goes_with_the_next_command_and_a_failed_run_is_taken_back_by_hand() {
    let served = served(spiking());
    let mut page = opened(&served, 1366, 1000);
    let refused = |page: &mut Devtools, why: &str| {
        page.until(&format!("document.getElementById('refusal').textContent.includes('{why}')"));
    };
    page.click("#search");
    page.types("nowhere");
    page.press("Enter", "\r");
    refused(&mut page, "nothing has this name");
    page.click("#network [data-path=\"memory\"]");
    page.value("document.getElementById('noise').value = ''");
    page.click("#noisy");
    refused(&mut page, "needs a number");
    page.value(
        "window.symbolt.page.plots.add('wrong', { values: { output: 'memory.output', count: 1.5 } })",
    );
    refused(&mut page, "count is 1.5; expected a whole number from 1 to 64");
    page.until("window.symbolt.page.plots.all.length === 0");
    // A plot that is removed before its answer is removed from the run as well.
    page.value("{ const { plots } = window.symbolt.page; plots.add('early', { values: { output: 'memory.output', count: 1 } }); plots.remove(plots.all[0]); }");
    page.click("[data-step=\"1\"]");
    page.until(
        "window.symbolt.page.frame.tick === 1 && window.symbolt.page.frame.plots.length === 0",
    );
    assert_eq!(page.value("document.getElementById('refusal').textContent"), "");
    page.until("document.querySelector('[data-back=\"1\"]').disabled === false");
    page.click("[data-back=\"1\"]");
    page.until("window.symbolt.page.frame.tick === 0");
    page.value("window.symbolt.page.session.send('do', { clamp: { output: 'memory.output', values: Array(64).fill(3e38) } })");
    page.click("[data-step=\"100\"]");
    page.until("Boolean(window.symbolt.page.halted)");
    page.until("document.querySelector('[data-back=\"100\"]').disabled === false");
    page.click("[data-back=\"100\"]");
    page.until("!window.symbolt.page.halted && window.symbolt.page.frame.tick === 0");
    drop(page);
    served.ended();
}

fn an_address_without_its_token_says_what_to_open() {
    let served = served(spiking());
    let mut page = Devtools::open(&format!("http://127.0.0.1:{}/", served.port), 800, 600);
    page.until(
        "document.getElementById('refusal')?.textContent.includes('Open the whole address')",
    );
    drop(page);
    served.ended();
}
