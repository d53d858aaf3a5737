//! The page of a live run in headless Chromium, driven as a person does: opens, plots, silences, goes back.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use libtest_mimic::Trial;
use symbolt::prelude::*;

use crate::chromium::browser;
use crate::devtools::Devtools;
use crate::model::model;
use crate::needs::{named, only_if};
use crate::window::{Served, served};

pub fn trials() -> Vec<Trial> {
    only_if(
        browser().is_some(),
        "needs Chromium",
        named![
            a_person_plots_silences_goes_back_and_finds_what_the_memory_is_for,
            the_page_of_a_live_run_fits_a_phone_in_the_dark_and_is_used_by_keys_alone,
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
    model(&PopulationPlan::all(Population::Lif(LifSpec::default())), 64).unwrap()
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
    page.click("#silence");
    page.until("document.querySelectorAll('#log tbody tr').length === 1");
    assert_eq!(
        page.value("document.querySelector('#log tbody tr').textContent"),
        "100{\"silence\":{\"at\":\"memory\"}}"
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
    // What is not possible is said, and every plot is exported.
    page.click("#expression");
    page.types("SCREW");
    page.click("#similar");
    page.until("document.getElementById('refusal').textContent.includes('SCREW')");
    assert_eq!(page.value("window.symbolt.page.plots.all.length"), 2);
    let csv = page.value("window.symbolt.page.plots.all[1].csv()");
    let csv = csv.as_str().unwrap();
    assert!(csv.starts_with("time_s,NUT,BOLT\n") && csv.lines().count() > 10, "{csv:.200}");
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

fn the_page_of_a_live_run_fits_a_phone_in_the_dark_and_is_used_by_keys_alone() {
    let served = served(spiking());
    let mut page = opened(&served, 390, 844);
    page.page(
        "Emulation.setEmulatedMedia",
        serde_json::json!({ "features": [{ "name": "prefers-color-scheme", "value": "dark" }] }),
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
        "document.getElementById('refusal')?.textContent.includes('open the whole address')",
    );
    drop(page);
    served.ended();
}
