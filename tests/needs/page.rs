//! The report page in headless Chromium: what is seen at each moment, keys, modules, values, widths and colours.
//!
//! Without Chromium these tests are ignored.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use libtest_mimic::Trial;
use serde_json::Value;

use crate::chromium::{Window, browser, opened_in};
use crate::needs::{named, only_if};
use crate::run::made;

pub fn trials() -> Vec<Trial> {
    only_if(
        browser().is_some(),
        "needs Chromium",
        named![
            gripper_and_held_part_are_seen_at_ten_moments_and_nothing_hangs_out,
            keys_alone_play_move_and_open_a_decision,
            two_modules_stand_under_one_time_axis_and_values_are_read_by_pointer_and_by_key,
            the_reader_s_choice_of_colours_counts_more_than_the_system_s,
            spikes_are_counted_by_population_and_no_name_is_cut,
        ],
    )
}

/// Returns the page of a run.
fn page() -> String {
    std::fs::read_to_string(made().join("report.html")).expect("a page")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number instead of {value}"))
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("text instead of {value}"))
}

/// Left, top, right and bottom of a rectangle in the picture.
fn sides(rectangle: &Value) -> [f64; 4] {
    ["left", "top", "right", "bottom"].map(|side| number(&rectangle[side]))
}

fn overlap(a: &Value, b: &Value) -> bool {
    let ([l, t, r, b], [left, top, right, bottom]) = (sides(a), sides(b));
    l < right && left < r && t < bottom && top < b
}

fn gripper_and_held_part_are_seen_at_ten_moments_and_nothing_hangs_out() {
    // Elements in boxes that scroll by themselves may be wider than the page.
    let script = "\
        found.moments = Array.from({ length: 10 }, (_, i) => {\n\
            page.seek(((i + 0.5) / 10) * page.duration); return page.replay.picture(); });\n\
        found.theme = document.documentElement.dataset.theme;\n\
        found.ground = getComputedStyle(document.body).backgroundColor;\n\
        found.inner = innerWidth; found.wide = document.documentElement.scrollWidth;\n\
        found.out = [...document.querySelectorAll('body *')].filter((element) => {\n\
            if (element.closest('.scroll, pre, .labels svg, .lane i')) return false;\n\
            const { left, right, width } = element.getBoundingClientRect();\n\
            return width > 0 && (left < -0.5 || right > innerWidth + 0.5);\n\
        }).map((element) => element.outerHTML.slice(0, 80));\n\
        const view = byId('replay').querySelector('canvas').getBoundingClientRect();\n\
        found.small = view.width < 200 || view.height < 200;";
    for (width, dark) in [(1366, false), (1366, true), (390, false), (390, true)] {
        let found = opened_in(&Window { width, dark }, &page(), script);
        let at = format!("{width} px, dark {dark}");
        assert_eq!(found["theme"], if dark { "dark" } else { "light" }, "{at}");
        assert_eq!(found["ground"] == "rgb(255, 255, 255)", !dark, "{at}");
        assert!(number(&found["inner"]) <= f64::from(width), "{at}");
        assert!(number(&found["wide"]) <= number(&found["inner"]), "{at} scrolls sideways");
        assert_eq!(found["out"].as_array().map(Vec::len), Some(0), "{at}: {}", found["out"]);
        assert_eq!(found["small"], false, "{at}");
        let moments = found["moments"].as_array().expect("moments");
        let mut held = 0;
        for (i, picture) in moments.iter().enumerate() {
            let [wide, high] = ["width", "height"].map(|side| number(&picture[side]));
            let labels = picture["labels"].as_array().expect("labels");
            assert!(!labels.is_empty(), "{at}, moment {i} has no labels");
            let inside = |rectangle: &Value| {
                let [left, top, right, bottom] = sides(rectangle);
                left >= 0.0 && top >= 0.0 && right <= wide && bottom <= high
            };
            assert!(labels.iter().all(inside), "{at}, moment {i}: {labels:?}");
            for (k, label) in labels.iter().enumerate() {
                let other = labels[k + 1..].iter().find(|other| overlap(label, other));
                assert!(other.is_none(), "{at}, moment {i}: {label} over {other:?}");
            }
            for body in [&picture["gripper"], &picture["held"]] {
                if body.is_null() {
                    continue;
                }
                assert!(inside(body), "{at}, moment {i}: {body}");
                assert!(number(&body["visible"]) > 0.1, "{at}, moment {i} is hidden: {body}");
                let over = labels.iter().find(|label| overlap(label, body));
                assert!(over.is_none(), "{at}, moment {i}: {over:?} covers {body}");
            }
            held += usize::from(!picture["held"].is_null());
        }
        assert!(held >= 3, "{at}: a part is held at {held} of 10 moments");
    }
}

fn keys_alone_play_move_and_open_a_decision() {
    // Frames are called by hand, 50 ms apart.
    let script = "\
        let next = null;\n\
        window.requestAnimationFrame = (act) => { next = act; return 1; };\n\
        window.cancelAnimationFrame = () => { next = null; };\n\
        page.seek(1); press(' '); found.playing = page.playing;\n\
        const begun = performance.now();\n\
        for (let i = 1; i <= 10 && next; i++) { const act = next; next = null; act(begun + 50 * i); }\n\
        found.played = page.time; press(' '); found.paused = !page.playing;\n\
        const scrub = byId('scrub'); found.step = Number(scrub.step); scrub.focus();\n\
        page.seek(2); press('ArrowRight'); found.right = page.time;\n\
        press('ArrowLeft', { shiftKey: true }); found.left = page.time;\n\
        press('PageDown'); found.far = page.time; press('End'); found.end = page.time === page.duration;\n\
        press('Home'); found.home = page.time; found.said = scrub.getAttribute('aria-valuetext');\n\
        scrub.blur(); page.seek(0); press('n'); press('n'); found.second = page.time;\n\
        found.asked = page.acts.map((act) => act.asked); found.view = page.timeline.view.slice();\n\
        found.took = page.acts.map((act) => act.took);\n\
        press('p'); found.first = page.time;\n\
        const row = page.decisionRows[2]; row.focus(); found.focused = document.activeElement === row;\n\
        press('Enter'); found.third = page.time; found.current = row.classList.contains('current');\n\
        press('3'); found.follow = page.replay.views.name; press('1');\n\
        press('l'); found.names = page.replay.picture().labels.length; press('l');\n\
        found.back = page.replay.picture().labels.length;\n\
        byId('speed').focus(); press(' '); found.own = page.playing;";
    let found = opened_in(&Window { width: 1366, dark: false }, &page(), script);
    assert_eq!((&found["playing"], &found["paused"]), (&true.into(), &true.into()), "{found}");
    assert!(number(&found["played"]) > 1.2, "{found}");
    assert!(number(&found["step"]) <= 0.001, "a decision lies between two steps");
    for (key, expected) in [("right", 2.01), ("left", 2.009), ("far", 3.009), ("home", 0.0)] {
        assert!((number(&found[key]) - expected).abs() < 1e-6, "{key}: {}", found[key]);
    }
    assert_eq!(found["end"], true);
    assert!(text(&found["said"]).starts_with("0.000 s"), "{}", found["said"]);
    let asked = found["asked"].as_array().expect("decisions");
    assert!(asked.len() >= 4, "{asked:?}");
    for (key, index) in [("first", 0), ("second", 1), ("third", 2)] {
        assert_eq!(found[key], asked[index], "{key}");
    }
    let view = [0, 1].map(|end| number(&found["view"][end]));
    let took = number(&found["took"][1]) / 1e3;
    assert!(view[0] <= number(&asked[1]) && view[1] >= number(&asked[1]) + took, "{view:?}");
    assert!(view[1] - view[0] < 1.0, "a decision is shown closely: {view:?}");
    assert_eq!((&found["focused"], &found["current"]), (&true.into(), &true.into()));
    assert_eq!((&found["follow"], &found["names"]), (&"follow".into(), &0.into()));
    assert!(number(&found["back"]) > 0.0);
    assert_eq!(found["own"], false, "a selector keeps its own keys");
}

fn two_modules_stand_under_one_time_axis_and_values_are_read_by_pointer_and_by_key() {
    let script = "\
        page.seek(0.1); page.timeline.look(0, 0.4);\n\
        const selects = () => [...document.querySelectorAll('#panels select')];\n\
        found.begun = selects().map((select) => select.selectedOptions[0].text);\n\
        const choose = (select, name) => {\n\
            select.value = [...select.options].find((option) => option.text === name).value;\n\
            select.dispatchEvent(new Event('change')); };\n\
        choose(selects()[0], 'goal_set'); choose(selects()[1], 'utility');\n\
        byId('more').click(); found.three = selects().length;\n\
        document.querySelectorAll('#panels button')[2].click(); found.two = selects().length;\n\
        found.shown = page.state().shown.map(({ module }) => module);\n\
        const [first, second] = page.timeline.panels;\n\
        const places = [first, second].map(({ canvas }) => canvas.getBoundingClientRect());\n\
        found.aligned = places[0].left === places[1].left && places[0].width === places[1].width;\n\
        found.stacked = places[0].bottom <= places[1].top && places.every(({ height }) => height > 80);\n\
        const time = 0.25;\n\
        const move = (canvas, y) => { const box = canvas.getBoundingClientRect();\n\
            canvas.dispatchEvent(new PointerEvent('pointermove', { bubbles: true, isPrimary: true,\n\
                clientX: box.left + page.timeline.x(time), clientY: box.top + y })); };\n\
        const tip = document.querySelector('.tip');\n\
        const legend = () => [...document.querySelectorAll('#panels .panel')].map((panel) =>\n\
            [...panel.querySelectorAll('output')].map((output) => output.textContent));\n\
        move(second.canvas, 20);\n\
        const at = page.timeline.asked; found.at = at; found.legend = legend();\n\
        found.expected = [first, second].map((panel) => panel.values(at).map((value) => value.toFixed(2)));\n\
        found.tip = [tip.hidden, tip.innerText]; found.names = second.module.names;\n\
        const seen = tip.getBoundingClientRect(); found.inside = seen.left >= 0 && seen.right <= innerWidth;\n\
        move(page.timeline.lanes.canvas, 5); found.decision = tip.innerText;\n\
        page.timeline.lanes.canvas.dispatchEvent(new PointerEvent('pointerleave', { isPrimary: true }));\n\
        found.left = tip.hidden;\n\
        first.canvas.focus(); press('ArrowRight'); found.keyed = [tip.hidden, tip.innerText];\n\
        found.moment = page.time; found.after = legend()[0];\n\
        found.then = first.values(page.time).map((value) => value.toFixed(2));\n\
        found.reading = byId('reading').textContent;";
    for width in [1366, 390] {
        let found = opened_in(&Window { width, dark: false }, &page(), script);
        assert_eq!(found["begun"].as_array().map(Vec::len), Some(2), "{found}");
        assert_eq!((&found["three"], &found["two"]), (&3.into(), &2.into()));
        assert_eq!(found["shown"], serde_json::json!(["goal_set", "utility"]));
        assert_eq!((&found["aligned"], &found["stacked"]), (&true.into(), &true.into()));
        assert!((number(&found["at"]) - 0.25).abs() < 0.005, "{}", found["at"]);
        assert_eq!(found["legend"], found["expected"]);
        let tip = text(&found["tip"][1]);
        assert_eq!(found["tip"][0], false);
        assert!(tip.contains("utility") && tip.starts_with("0.2"), "{tip}");
        for (name, value) in found["names"]
            .as_array()
            .expect("names")
            .iter()
            .zip(found["expected"][1].as_array().expect("values"))
        {
            assert!(tip.contains(&format!("{} {}", text(name), text(value))), "{tip}");
        }
        assert_eq!(found["inside"], true, "the values hang out at {width} px");
        let decision = text(&found["decision"]);
        assert!(decision.contains("decision 1: "), "{decision}");
        assert_eq!(found["left"], true);
        assert_eq!(found["keyed"][0], false);
        assert!((number(&found["moment"]) - 0.11).abs() < 1e-6);
        let keyed = text(&found["keyed"][1]);
        assert!(keyed.starts_with("0.110 s") && keyed.contains("goal_set"), "{keyed}");
        assert_eq!(found["after"], found["then"]);
        assert!(text(&found["reading"]).starts_with("Moment at 0.110 s"), "{}", found["reading"]);
    }
}

fn the_reader_s_choice_of_colours_counts_more_than_the_system_s() {
    let script = "\
        const pixel = () => { page.replay.render(); const gl = page.replay.renderer.getContext();\n\
            const rgba = new Uint8Array(4); gl.readPixels(2, gl.drawingBufferHeight - 3, 1, 1, gl.RGBA,\n\
                gl.UNSIGNED_BYTE, rgba); return rgba[0] + rgba[1] + rgba[2]; };\n\
        const look = () => [document.documentElement.dataset.theme,\n\
            getComputedStyle(document.body).backgroundColor, pixel(),\n\
            page.timeline.lanes.canvas.toDataURL().length > 500];\n\
        found.system = look();\n\
        byId('theme').value = 'light'; byId('theme').dispatchEvent(new Event('change'));\n\
        found.light = look();\n\
        byId('theme').value = 'dark'; byId('theme').dispatchEvent(new Event('change'));\n\
        found.dark = look();";
    let found = opened_in(&Window { width: 800, dark: true }, &page(), script);
    assert_eq!(found["system"], found["dark"]);
    assert_eq!((&found["light"][0], &found["dark"][0]), (&"light".into(), &"dark".into()));
    assert_ne!(found["light"][1], found["dark"][1]);
    assert!(number(&found["light"][2]) > number(&found["dark"][2]) + 200.0, "{found}");
}

fn spikes_are_counted_by_population_and_no_name_is_cut() {
    // A run in direct mode has no spikes: two populations are put into its data.
    let long = "graph/a_population/with_several/parts";
    let populations = format!(
        r#""populations":[{{"neurons":90,"path":"graph/first","rows":2}},{{"neurons":8,"path":"{long}","rows":3}}]"#
    );
    let packed = |numbers: &[f32]| {
        STANDARD.encode(numbers.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
    };
    let [times, rows] = [[0.1, 0.11, 0.12, 0.19], [0.0, 4.0, 1.0, 3.0]].map(|v| packed(&v));
    let spikes = format!(r#""spikes":{{"t":"{times}","row":"{rows}"}}"#);
    let page = page().replacen(r#""populations":[]"#, &populations, 1).replacen(
        r#""spikes":{"t":"","row":""}"#,
        &spikes,
        1,
    );
    let script = "\
        page.timeline.look(0, 0.4); page.seek(0.13);\n\
        const { raster } = page.timeline; const { canvas } = raster;\n\
        found.counts = byId('counts').textContent;\n\
        const box = canvas.getBoundingClientRect();\n\
        const band = raster.laid()[1];\n\
        canvas.dispatchEvent(new PointerEvent('pointermove', { bubbles: true, isPrimary: true,\n\
            clientX: box.left + page.timeline.x(0.2), clientY: box.top + band.top + band.height - 1 }));\n\
        found.tip = document.querySelector('.tip').innerText;\n\
        const room = page.timeline.namesAbove ? box.width : page.timeline.left;\n\
        found.fits = raster.nameWidth() <= room; found.above = page.timeline.namesAbove;";
    for (width, above) in [(1366, false), (390, true)] {
        let found = opened_in(&Window { width, dark: false }, &page, script);
        let name = long.trim_start_matches("graph/");
        let counts = text(&found["counts"]);
        assert!(counts.contains("first 2") && counts.contains(&format!("{name} 1")), "{counts}");
        let tip = text(&found["tip"]);
        assert!(tip.contains(name) && tip.contains("row 3 of 3, from 8 neurons"), "{tip}");
        assert!(tip.contains("spikes in the last 50 ms: 1"), "{tip}");
        assert_eq!((&found["fits"], &found["above"]), (&true.into(), &above.into()), "{width}");
    }
}
