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
            a_part_under_the_pointer_is_named,
            keys_alone_play_move_and_open_a_decision,
            two_modules_stand_under_one_time_axis_and_values_are_read_by_pointer_and_by_key,
            the_reader_s_choice_of_colours_counts_more_than_the_system_s,
            spikes_are_counted_by_population_and_no_name_is_cut,
            decisions_have_their_preconditions_and_reasons,
            what_holds_is_that_of_the_moment_and_not_of_the_last_look,
            sentences_are_shown_where_the_run_has_them_and_symbols_elsewhere,
            places_in_the_frames_of_objects_are_drawn_where_they_are,
            a_failed_step_has_its_moment_its_number_and_a_picture,
            a_step_that_ends_off_its_place_and_another_hand_are_told,
            a_gap_stays_a_gap_and_after_the_last_sample_the_legend_is_empty,
            counts_agree_and_what_is_lacking_is_said_alike,
            settings_that_differ_from_the_default_come_first,
            two_places_of_a_kind_have_two_labels,
            nothing_is_cut_at_any_width,
            the_planner_is_shown_over_the_whole_episode_and_rasters_are_folded,
            the_page_is_readable_by_everyone_on_every_width,
            the_page_of_any_graph_has_one_moment_folded_modules_loops_and_exports,
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
    for (width, dark) in [(1366, false), (1366, true), (390, false), (390, true), (320, false)] {
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

fn a_part_under_the_pointer_is_named() {
    let script = "\
        page.seek(0.5 * page.duration);\n\
        const { replay, episode } = page; const { canvas, bodies, tip } = replay;\n\
        const box = canvas.getBoundingClientRect();\n\
        const point = ([x, y]) => { canvas.dispatchEvent(new PointerEvent('pointermove',\n\
            { clientX: box.left + x, clientY: box.top + y })); return tip.hidden ? null : tip.textContent; };\n\
        const centre = (body) => { const { left, right, top, bottom } = replay.around([body]);\n\
            return [(left + right) / 2, (top + bottom) / 2]; };\n\
        found.parts = bodies.parts.map((body, i) => ({ name: episode.part(i), visible: replay.visible([body]),\n\
            tip: point(centre(body)) }));\n\
        found.nowhere = point([3, 3]);\n\
        found.names = new Set(bodies.parts.map((_, i) => episode.part(i))).size;";
    for width in [1366, 390] {
        let found = opened_in(&Window { width, dark: false }, &page(), script);
        let parts = found["parts"].as_array().expect("parts");
        assert_eq!(
            number(&found["names"]) as usize,
            parts.len(),
            "each part has a name of its own"
        );
        // The middle of a nut is a hole, and a part may lie behind another.
        let named = parts.iter().filter(|part| part["tip"] == part["name"]).count();
        assert!(2 * named >= parts.len(), "at {width} px: {parts:?}");
        let wrong =
            parts.iter().filter(|part| !part["tip"].is_null() && number(&part["visible"]) > 0.9);
        let wrong: Vec<_> = wrong.filter(|part| part["tip"] != part["name"]).collect();
        assert!(wrong.is_empty(), "at {width} px: {wrong:?}");
        assert!(found["nowhere"].is_null(), "{}", found["nowhere"]);
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
        choose(selects()[0], 'goal set'); choose(selects()[1], 'utility');\n\
        byId('more').click(); found.three = selects().length;\n\
        [...document.querySelectorAll('#panels button')].filter((button) => button.textContent === 'Remove')[2].click(); found.two = selects().length;\n\
        found.shown = page.state().shown.map(({ module }) => module);\n\
        const [first, second] = page.timeline.panels;\n\
        const places = [first, second].map(({ canvas }) => canvas.getBoundingClientRect());\n\
        found.aligned = places[0].left === places[1].left && places[0].width === places[1].width;\n\
        found.stacked = places[0].bottom <= places[1].top && places.every(({ height }) => height > 80);\n\
        const time = 0.25;\n\
        const move = (canvas, y) => { const box = canvas.getBoundingClientRect();\n\
            canvas.dispatchEvent(new PointerEvent('pointermove', { bubbles: true, isPrimary: true,\n\
                clientX: box.left + page.timeline.x(time), clientY: box.top + y })); };\n\
        const tip = document.querySelector('#strips .tip');\n\
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
        let found = opened_in(&Window { width, dark: false }, &without_words(&page()), script);
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
        assert!(decision.contains("step 1: "), "{decision}");
        assert_eq!(found["left"], true);
        assert_eq!(found["keyed"][0], false);
        assert!((number(&found["moment"]) - 0.11).abs() < 1e-6);
        let keyed = text(&found["keyed"][1]);
        assert!(keyed.starts_with("0.110 s") && keyed.contains("goal set"), "{keyed}");
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
        found.tip = document.querySelector('#strips .tip').innerText;\n\
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

/// Returns the page as that of a run that has no sentences, such as an older one.
fn without_words(page: &str) -> String {
    let bare = [r#""words":"#, r#""planner_only":"#, r#""goal_words":"#]
        .iter()
        .fold(page.to_owned(), |page, key| page.replace(key, r#""unknown":"#));
    assert_ne!(bare, page);
    bare
}

fn decisions_have_their_preconditions_and_reasons() {
    let script = "\
        found.acts = page.acts.map(({ action, needs, unmet, gives, holds }) => ({ action, needs, unmet, gives, holds }));\n\
        found.rows = page.decisionRows.map((row) => row.innerText);\n\
        found.leads = page.acts.map((act, i) => page.episode.bringsAbout(i));";
    let found = opened_in(&Window { width: 1366, dark: false }, &without_words(&page()), script);
    let acts = found["acts"].as_array().expect("decisions");
    assert!(acts.len() >= 4);
    for (i, act) in acts.iter().enumerate().filter(|(_, act)| !act["action"].is_null()) {
        let row = text(&found["rows"][i]);
        let list = |key: &str| act[key].as_array().expect("a list").clone();
        assert!(!list("needs").is_empty() && !list("unmet").is_empty(), "{act}");
        for need in list("needs") {
            assert!(list("holds").contains(&need), "{need} did not hold: {act}");
            assert!(row.contains(&format!("{} ✓", text(&need))), "{row}");
        }
        assert!(row.contains("Not yet reached: ") && row.contains("It brings about: "), "{row}");
        assert!(!text(&found["leads"][i]).is_empty(), "{row}");
    }
    // The first step is no part of the goal; the last one is.
    let first = text(&found["leads"][0]);
    assert!(first.starts_with("BOLT_AT_BOLT_HOLE, which step 3 needs ("), "{first}");
    assert!(text(&found["leads"][2]).contains(", a part of the goal"), "{}", found["leads"]);
}

fn what_holds_is_that_of_the_moment_and_not_of_the_last_look() {
    let script = "\
        const { held } = page.episode.film;\n\
        const nut = held.objects.find(({ id }) => id === 'nut_0');\n\
        const [placed] = nut.changes.find(([, state]) => state === 'NUT_AT_NUT_POCKET');\n\
        const act = page.acts.find((act) => act.until > placed);\n\
        found.looked = act.asked < placed && act.holds.includes('NUT_0_AT_START');\n\
        page.seek(placed + 0.1); found.before_next = page.time < act.until;\n\
        found.now = byId('now').innerText;\n\
        page.seek(act.asked); found.then = byId('now').innerText;\n\
        page.seek(page.duration); found.end = byId('now').innerText;\n\
        byId('facts').open = true; page.showFacts(); found.facts = byId('facts').innerText;";
    let found = opened_in(&Window { width: 1366, dark: false }, &page(), script);
    assert_eq!((&found["looked"], &found["before_next"]), (&true.into(), &true.into()), "{found}");
    let now = text(&found["now"]);
    assert!(now.contains("The nut is in the nut pocket"), "{now}");
    assert!(now.contains("✓ a nut is in a nut pocket"), "{now}");
    assert!(now.contains("○ a bolt is in a nut that is in a nut pocket"), "{now}");
    let then = text(&found["then"]);
    assert!(then.contains("The nut is in its start area"), "{then}");
    assert!(!text(&found["end"]).contains('○'), "{}", found["end"]);
    let facts = text(&found["facts"]);
    assert!(facts.contains("the place for a bolt in the bolt hole is free"), "{facts}");
}

fn sentences_are_shown_where_the_run_has_them_and_symbols_elsewhere() {
    let script = "\
        found.row = page.decisionRows[0].innerText; found.other = page.decisionRows[1].innerText;\n\
        page.seek(page.duration); found.now = byId('now').innerText;\n\
        found.story = byId('story').innerText;\n\
        found.label = [...document.querySelectorAll('.labels span')].map((label) => label.title);";
    let open = |page: &str| opened_in(&Window { width: 1366, dark: false }, page, script);
    let (told, bare) = (open(&page()), open(&without_words(&page())));
    assert!(text(&told["row"]).contains("Put the bolt in the bolt hole."), "{}", told["row"]);
    assert!(text(&told["row"]).contains("a bolt is in its start area ✓"), "{}", told["row"]);
    assert!(!text(&told["row"]).contains("is free ✓"), "{}", told["row"]);
    assert!(text(&told["other"]).contains("Put the nut in the nut pocket."), "{}", told["other"]);
    assert!(text(&told["now"]).contains("The nut is in the nut pocket"), "{}", told["now"]);
    assert!(text(&told["story"]).contains("The goal: a nut is in a nut pocket, and"), "{told}");
    assert!(told["label"].to_string().contains("goal: a nut is in a nut pocket"), "{told}");
    for symbol in
        ["PUT_BOLT_AT_BOLT_HOLE_0.", "BOLT_AT_START ✓", "BOLT_AT_BOLT_HOLE_0_PLACE_FREE ✓"]
    {
        assert!(text(&bare["row"]).contains(symbol), "{}", bare["row"]);
    }
}

fn places_in_the_frames_of_objects_are_drawn_where_they_are() {
    let script = "\
        const at = (name) => page.replay.bodies.anchors.find((anchor) => anchor.name.endsWith(name)).at().toArray();\n\
        page.seek(0); found.early = at('goal: BOLT_AT_NUT'); found.pocket = at('goal: NUT_AT_NUT_POCKET');\n\
        page.seek(page.duration); page.replay.places(); found.late = at('goal: BOLT_AT_NUT');\n\
        found.parts = page.state().places.parts; found.still = at('goal: NUT_AT_NUT_POCKET');";
    let found = opened_in(&Window { width: 1366, dark: false }, &without_words(&page()), script);
    let apart = |a: &Value, b: &Value| {
        let [a, b] = [a, b].map(|v| v.as_array().expect("a place").clone());
        a.iter().zip(&b).map(|(a, b)| (number(a) - number(b)).powi(2)).sum::<f64>().sqrt()
    };
    // The nut ends in its pocket and the bolt in the nut, so each is at its goal's place, which went with the nut.
    assert!(apart(&found["parts"][0], &found["pocket"]) < 1e-3, "{found}");
    assert!(apart(&found["parts"][1], &found["late"]) < 1e-3, "{found}");
    assert!(apart(&found["early"], &found["late"]) > 0.1, "{found}");
    assert!(apart(&found["pocket"], &found["still"]) < 1e-9, "{found}");
}

fn a_failed_step_has_its_moment_its_number_and_a_picture() {
    // A run without failures: a step is said to have dropped its part.
    let [was, is] = [r#""outcome":"placed""#, r#""outcome":"dropped""#];
    let [came, comes] = [r#""came":"placed""#, r#""came":"dropped, but in place""#];
    assert!(page().contains(was) && page().contains(came));
    let dropped = page().replacen(was, is, 1).replacen(came, comes, 1);
    let script = "\
        const section = byId('failures'); found.hidden = section.hidden;\n\
        found.text = section.innerText; found.pictures = section.querySelectorAll('canvas').length;\n\
        const picture = section.querySelector('canvas');\n\
        if (picture) { page.replay.copyTo(picture, page.acts[0].until);\n\
            const { data } = picture.getContext('2d').getImageData(0, 0, picture.width, picture.height);\n\
            found.colours = new Set(data).size; section.querySelector('button').click(); }\n\
        found.time = page.time; found.until = page.acts[0].until; found.lost = page.episode.lostAt(page.acts[0]);\n\
        found.row = page.decisionRows[0].querySelector('.bad')?.innerText;";
    let well = opened_in(&Window { width: 1366, dark: false }, &page(), script);
    assert_eq!(well["hidden"], true);
    let found = opened_in(&Window { width: 1366, dark: false }, &dropped, script);
    assert_eq!((&found["hidden"], &found["pictures"]), (&false.into(), &1.into()));
    assert!(number(&found["colours"]) > 20.0, "the picture is blank: {}", found["colours"]);
    assert!(text(&found["text"]).contains("at its target all the same"), "{}", found["text"]);
    let lost = number(&found["lost"]);
    assert!((0.1..number(&found["until"])).contains(&lost), "{lost}");
    let title = format!(": dropped at {lost:.1} s, but in place");
    assert!(text(&found["text"]).contains(&title), "{title}: {}", found["text"]);
    // A second before it fell.
    assert!((number(&found["time"]) - (lost - 1.0)).abs() < 1e-9, "{found}");
    assert_eq!(found["row"], "dropped, but in place");
    // The same, had its target been ten metres off.
    let missed = dropped.replacen(r#""target":{"position":[0."#, r#""target":{"position":[10."#, 1);
    assert_ne!(missed, dropped);
    let found = opened_in(&Window { width: 1366, dark: false }, &missed, script);
    let said = text(&found["text"]);
    assert!(said.contains("is 10000 mm beside its target and at its height"), "{said}");
}

fn a_step_that_ends_off_its_place_and_another_hand_are_told() {
    let page = page();
    let landed = r#""landed":{"as_planned":true"#;
    let hand = r#""events":[{"episode":0,"displaced":{"t":20.0,"object":"bolt_0","words":"another hand, not the robot, moved the bolt","from":{"position":[0.0,0.0,0.0],"orientation":[0.0,0.0,0.0,1.0]},"to":null}},"#;
    let came = r#""came":"placed""#;
    let told = page.replacen(landed, r#""landed":{"as_planned":false"#, 1);
    let told = told.replacen(came, r#""came":"off its place""#, 1);
    let told = told.replacen(r#""events":["#, hand, 1);
    assert!(page.contains(landed) && page.contains(came) && told.len() > page.len() + 100);
    let script = "\
        found.story = byId('story').innerText; found.failures = byId('failures').innerText;\n\
        found.rows = [...document.querySelectorAll('#decisions tbody tr')].map((row) => row.innerText);\n\
        found.acts = page.decisionRows.map((row) => row.innerText.slice(0, 400));\n\
        page.seek(20.5); found.now = byId('now').innerText; page.seek(30); found.later = byId('now').innerText;\n\
        found.fill = page.acts.map(({ well, came }) => [well, came]);\n\
        const moved = (before, after) => { page.episode.places = (time) => [{ id: 'bolt_0', words: time < 20 ? before : after }];\n\
            page.showDecisions(); return [...document.querySelectorAll('#decisions tbody tr')].map((row) => row.innerText).find((text) => text.includes('Another hand')); };\n\
        found.elsewhere = moved('here', 'there'); found.same = moved('here', 'here');";
    let open = |page: &str| opened_in(&Window { width: 1366, dark: false }, page, script);
    let (well, found) = (open(&page), open(&told));
    assert_eq!(well["fill"][0], serde_json::json!([true, "done"]));
    assert!(!text(&well["story"]).contains("another hand"), "{}", well["story"]);
    assert_eq!(found["fill"][0], serde_json::json!([false, "off its place"]));
    let story = text(&found["story"]);
    assert!(
        story.contains("2 of 3 steps ended as planned") && story.contains("mm from its target"),
        "{story}"
    );
    assert!(story.contains("At 20.0 s another hand, not the robot, moved the bolt."), "{story}");
    assert!(text(&found["failures"]).contains("off its place"), "{}", found["failures"]);
    let rows = found["rows"].as_array().expect("rows");
    let at = rows
        .iter()
        .position(|row| text(row).contains("Another hand moved the bolt."))
        .expect("a row");
    // It is said once, and where the bolt was is said twice only if that has changed.
    assert!(at > 0 && !text(&rows[at]).contains("not the robot"), "{rows:?}");
    let elsewhere = text(&found["elsewhere"]);
    assert!(elsewhere.contains("Before: here\nAfterwards: there"), "{elsewhere}");
    let same = text(&found["same"]);
    assert!(same.contains("Before and afterwards: here"), "{same}");
    let acts = found["acts"].as_array().expect("rows");
    assert_eq!(acts.len() + 1, rows.len());
    assert!(text(&found["now"]).contains("Not the robot"), "{}", found["now"]);
    assert!(!text(&found["later"]).contains("Not the robot"), "{}", found["later"]);
}

fn a_gap_stays_a_gap_and_after_the_last_sample_the_legend_is_empty() {
    let script = "\
        const { content, panels } = page.timeline; const [panel] = panels; const times = panel.times;\n\
        content.gaps = new Set([5]); page.timeline.look(0, page.duration);\n\
        const strokes = []; const pen = { beginPath() {}, stroke() {}, setLineDash() {} };\n\
        pen.moveTo = (x) => strokes.push(['move', x]); pen.lineTo = (x) => strokes.push(['line', x]);\n\
        panel.drawLine(pen, panel.module, 0, (value) => value);\n\
        found.moves = strokes.filter(([kind]) => kind === 'move').length;\n\
        content.gaps = new Set(); strokes.length = 0; panel.drawLine(pen, panel.module, 0, (value) => value);\n\
        found.whole = strokes.filter(([kind]) => kind === 'move').length;\n\
        content.times = times.slice(0, 20); found.held = panel.values(times[19] + 0.05).length;\n\
        found.empty = panel.values(times[19] + 5).length; page.seek(times[19] + 5);\n\
        found.legend = [...document.querySelectorAll('#panels output')].map((output) => output.textContent);";
    let found = opened_in(&Window { width: 390, dark: false }, &page(), script);
    assert_eq!((&found["whole"], &found["moves"]), (&1.into(), &2.into()), "{found}");
    assert!(number(&found["held"]) > 0.0 && found["empty"] == 0, "{found}");
    let legend = found["legend"].as_array().expect("values");
    assert!(!legend.is_empty() && legend.iter().all(|value| text(value) == "–"), "{legend:?}");
}

fn counts_agree_and_what_is_lacking_is_said_alike() {
    let script = "\
        found.story = byId('story').innerText; found.row = [...byId('episode-list').querySelectorAll('tbody td')].map((td) => td.textContent);\n\
        const lacking = (...terms) => { page.episode.goalAt = () => terms.map(([term, lacking]) => ({ term, lacking }));\n\
            page.seek(1); return byId('now').innerText; };\n\
        found.goal = lacking(['a fork is beside each plate', 1], ['every cup is turned over', 1], ['a block is in a drawer', 1],\n\
            ['at least 2 cups are in a bin', 2], ['a knife is beside each plate', 0]);\n\
        page.acts.forEach((act) => { act.well = false; act.chosen = null; act.landed = null; });\n\
        page.acts[0].recovery = 'moves the nut out of the way: it lies on the bolt';\n\
        page.show(); found.failures = byId('failures').innerText;";
    let found = opened_in(&Window { width: 1366, dark: false }, &page(), script);
    let story = text(&found["story"]);
    let steps = text(&found["row"][2]);
    assert!(story.contains(&format!("{steps} steps, decided one at a time")), "{found}");
    assert!(story.contains(&format!("{steps} of {steps} steps ended as planned")), "{found}");
    let goal = text(&found["goal"]);
    for said in [
        "○ a fork is beside each plate (1 lacking)",
        "○ every cup is turned over (1 lacking)",
        "○ a block is in a drawer\n",
        "○ at least 2 cups are in a bin (2 lacking)",
        "✓ a knife is beside each plate\n",
    ] {
        assert!(goal.contains(said), "{said}: {goal}");
    }
    // A failure without a number says what was tried, or nothing.
    let failures = text(&found["failures"]);
    assert!(failures.contains("Moves the nut out of the way: it lies on the bolt"), "{failures}");
    assert!(!failures.contains("No number"), "{failures}");
}

fn settings_that_differ_from_the_default_come_first() {
    let script = "\
        found.changed = byId('changed').innerText; found.hidden = byId('changed').hidden;\n\
        found.made = byId('made').innerText; byId('others').open = true;\n\
        byId('others').dispatchEvent(new Event('toggle'));\n\
        found.others = [...byId('all').querySelectorAll('tbody tr')].map((row) => [...row.cells].map((cell) => cell.textContent));";
    let open = |page: &str| opened_in(&Window { width: 1366, dark: false }, page, script);
    let (usual, own) = (page(), r#""dimensions":256"#);
    assert_eq!(usual.matches(own).count(), 2, "of the run, and of the default");
    let other = open(&usual.replacen(own, r#""dimensions":512"#, 1));
    let said = text(&other["changed"]);
    assert!(said.contains("planner.dimensions") && said.contains("512\t256"), "{said}");
    assert!(!other["others"].to_string().contains("planner.dimensions"), "{other}");
    let usual = open(&usual);
    assert_eq!((&usual["hidden"], &other["hidden"]), (&true.into(), &false.into()));
    assert!(
        text(&usual["made"]).ends_with("The planner and the scene have their defaults."),
        "{usual}"
    );
    assert!(text(&other["made"]).ends_with("These settings differ from the default:"), "{other}");
    let others = usual["others"].to_string();
    assert!(others.contains(r#"["planner.dimensions","256"]"#), "{others}");
    assert!(others.contains(r#"["scene.part.nut_height_m","0.016"]"#), "{others}");
}

fn two_places_of_a_kind_have_two_labels() {
    let script = "\
        const { bodies } = page.replay; const two = { ...bodies.references.find(({ kind }) => kind === 'nut_pocket'), id: 'nut_pocket_1' };\n\
        const states = page.data.domain.drawn; bodies.references.push(two); bodies.addStates(states, new Map(), page.names);\n\
        found.names = bodies.anchors.map(({ name }) => name);";
    let found = opened_in(&Window { width: 1366, dark: false }, &page(), script);
    let mut names: Vec<&str> = found["names"].as_array().expect("names").iter().map(text).collect();
    names.sort_unstable();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count, "{names:?}");
    assert!(names.contains(&"goal: a nut is in nut_pocket_1"), "{names:?}");
}

fn nothing_is_cut_at_any_width() {
    let script = "\
        const cut = (element) => element.scrollHeight > element.clientHeight + 1 || element.scrollWidth > element.clientWidth + 1;\n\
        found.cut = []; let heights = new Set();\n\
        for (let i = 0; i <= 20; i++) { page.seek((i / 20) * page.duration); heights.add(byId('now').offsetHeight);\n\
            [byId('now'), ...document.querySelectorAll('#panels .names:not(.many)')].filter(cut).forEach((element) => found.cut.push(element.className || element.id)); }\n\
        found.heights = heights.size; found.shown = document.querySelectorAll('#panels .names').length;";
    for width in [320, 390, 768, 1024, 1366, 1920] {
        let found = opened_in(&Window { width, dark: width == 768 }, &page(), script);
        assert_eq!(found["cut"], serde_json::json!([]), "{width} px");
        assert_eq!(
            (&found["heights"], &found["shown"]),
            (&1.into(), &2.into()),
            "{width} px: nothing moves"
        );
    }
}

fn the_planner_is_shown_over_the_whole_episode_and_rasters_are_folded() {
    let of = |i: usize| format!(r#"{{"neurons":40,"path":"graph/module_{i}/layer","rows":12}}"#);
    let populations = (0..70).map(of).collect::<Vec<_>>().join(",");
    let packed = |numbers: Vec<f32>| {
        STANDARD.encode(numbers.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
    };
    let times = packed((0..840).map(|i| 0.1 + i as f32 * 1e-4).collect());
    let rows = packed((0..840).map(|i| i as f32).collect());
    let page = page()
        .replacen(r#""populations":[]"#, &format!(r#""populations":[{populations}]"#), 1)
        .replacen(
            r#""spikes":{"t":"","row":""}"#,
            &format!(r#""spikes":{{"t":"{times}","row":"{rows}"}}"#),
            1,
        );
    let script = "\
        found.view = page.timeline.view; found.duration = page.duration;\n\
        const { raster } = page.timeline;\n\
        found.folded = raster.laid().length; found.tall = raster.canvas.clientHeight;\n\
        raster.toggle(raster.laid()[0].top + 2); page.timeline.draw(); found.one = raster.canvas.clientHeight;\n\
        byId('fold').click(); found.unfolded = raster.laid().length; found.all = raster.canvas.clientHeight;\n\
        found.box = byId('raster').clientHeight; found.page = document.documentElement.scrollHeight;\n\
        byId('fold').click(); found.again = raster.laid().length;\n\
        found.phases = [...document.querySelector('.phases').querySelectorAll('dd')].every((dd) => dd.textContent.length > 10);\n\
        found.said = page.timeline.content.modules.find(({ name }) => name === 'phase').names.filter(\n\
            (name) => ![...document.querySelectorAll('.phases dt')].some((dt) => dt.textContent === name));\n\
        found.foreign = [...document.querySelectorAll('.phases dt')].map((dt) => dt.textContent).filter((name) => !page.timeline.content.modules\n\
            .find(({ name }) => name === 'phase').names.includes(name));";
    for width in [1366, 390] {
        let found = opened_in(&Window { width, dark: false }, &page, script);
        assert_eq!((&found["view"][0], &found["view"][1]), (&0.into(), &found["duration"]));
        assert_eq!(
            (&found["folded"], &found["unfolded"], &found["again"]),
            (&16.into(), &70.into(), &16.into())
        );
        assert!(
            number(&found["tall"]) < 600.0 && number(&found["one"]) > number(&found["tall"]),
            "{found}"
        );
        assert!(number(&found["all"]) > 1500.0 && number(&found["box"]) <= 520.0, "{found}");
        assert!(number(&found["page"]) < 8000.0, "{found}");
        assert_eq!((&found["phases"], &found["said"]), (&true.into(), &serde_json::json!([])));
        assert_eq!(
            found["foreign"],
            serde_json::json!([]),
            "phases that this planner does not have"
        );
    }
}

/// Finds texts of too little contrast (WCAG 2.1, 1.4.3), controls without a name, and what keys cannot reach.
pub(crate) const AUDIT: &str = "\
    const parse = (colour) => { const [r, g, b, a = 1] = colour.match(/[\\d.]+/g).map(Number); return { r, g, b, a }; };\n\
    const light = ({ r, g, b }) => { const part = (v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;\n\
        return 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b); };\n\
    const ground = (element) => { for (let e = element; e; e = e.parentElement) {\n\
        const colour = parse(getComputedStyle(e).backgroundColor); if (colour.a > 0) return colour; } return { r: 255, g: 255, b: 255 }; };\n\
    document.querySelectorAll('details').forEach((details) => { details.open = true; });\n\
    const seen = (element) => element.getClientRects().length > 0 && getComputedStyle(element).visibility === 'visible';\n\
    const own = [...document.querySelectorAll('body *')].filter((element) => seen(element) && !element.matches(':disabled, option, script')\n\
        && [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()));\n\
    found.texts = own.length;\n\
    found.faint = own.map((element) => { const style = getComputedStyle(element);\n\
        const [a, b] = [light(parse(style.color)), light(ground(element))].sort((x, y) => y - x);\n\
        const size = parseFloat(style.fontSize); const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);\n\
        return { text: element.textContent.trim().slice(0, 40), ratio: (a + 0.05) / (b + 0.05), least: large ? 3 : 4.5 };\n\
    }).filter(({ ratio, least }) => ratio < least);\n\
    const controls = [...document.querySelectorAll('button, input, select, textarea, summary, a, [tabindex]')].filter(seen);\n\
    const name = (control) => control.getAttribute('aria-label') || control.labels?.[0]?.innerText || control.innerText;\n\
    found.controls = controls.length;\n\
    found.nameless = controls.filter((control) => !name(control)?.trim()).map((control) => control.outerHTML.slice(0, 100));\n\
    const scrolls = [...document.querySelectorAll('body *')].filter((element) => seen(element)\n\
        && element.scrollHeight > element.clientHeight + 1 && ['auto', 'scroll'].includes(getComputedStyle(element).overflowY));\n\
    found.unreached = [...controls, ...scrolls].filter((control) => control.tabIndex < 0 && !control.matches(':disabled')\n\
        && !control.querySelector('button, input, [tabindex], a')).map((control) => control.outerHTML.slice(0, 100));\n\
    found.wide = document.documentElement.scrollWidth - innerWidth;\n\
    found.shifts = window.shifts;\n\
    found.ready = document.documentElement.dataset.ready;\n\
    found.pictured = !page?.replay || page.replay.renderer.info.render.frame > 0;";

fn the_page_is_readable_by_everyone_on_every_width() {
    let page = page();
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
    for (width, dark) in [(1366, false), (1366, true), (390, false), (390, true), (320, false)] {
        let found = opened_in(&Window { width, dark }, &page, AUDIT);
        let at = format!("{width} px, dark {dark}");
        assert!(
            number(&found["texts"]) > 60.0 && number(&found["controls"]) > 25.0,
            "{at}: {found}"
        );
        for fault in ["faint", "nameless", "unreached"] {
            assert_eq!(found[fault], serde_json::json!([]), "{at}: {fault}");
        }
        assert!(number(&found["wide"]) <= 0.0, "{at} scrolls sideways");
        assert!(number(&found["shifts"]) < 0.01, "{at}: {}", found["shifts"]);
        // The picture is drawn by the page's own script, before the page counts as loaded.
        assert_eq!((&found["ready"], &found["pictured"]), (&"yes".into(), &true.into()), "{at}");
    }
    // What would be wrong is found.
    let bad = page.replacen("--soft: #566272", "--soft: #b0b8c2", 1).replacen(
        "<header>",
        "<div style=\"width:3000px\">wide</div><header><button></button>",
        1,
    );
    let found = opened_in(&Window { width: 1366, dark: false }, &bad, AUDIT);
    assert!(found["faint"].as_array().is_some_and(|faint| faint.len() > 5), "{found}");
    assert_eq!(found["nameless"].as_array().map(Vec::len), Some(1));
    assert!(number(&found["wide"]) > 1000.0);
}

/// Returns the page of a run of a graph with a loop, a weight, neurons and a comparison.
fn page_of_a_graph() -> String {
    use symbolt::prelude::*;
    use symbolt::record::RunPage;

    symbolt::vocabulary!(Words = "words": ONE, TWO);
    let words = Words::vocabulary(64, Seed::new(1)).expect("words");
    let mut graph = GraphBuilder::new();
    let shown = graph.add("shown", words.stimulus([(0, "ONE"), (150, "TWO")]).expect("shown"));
    let memory = graph.add("memory", State::new(&words).recurrent(Synapse::lowpass_ms(100)));
    let seen = graph.add("seen", State::new(&words));
    graph.route(0.5 * &shown >> &memory);
    graph.route(&shown >> &seen);
    let ideal = graph.probe(&shown, ProbeSpec::default());
    let decoded = graph.probe(&seen.output, ProbeSpec::default());
    let held = graph.probe(&memory.output, ProbeSpec::default());
    graph.probe_spikes("memory");
    graph.probe_spikes("seen");
    let spiking = PopulationPlan::lif();
    let sim = graph.run(&spiking, Seed::new(1), SimDuration::from_millis(300)).expect("runs");
    let [ideal, decoded, held] = [ideal, decoded, held]
        .map(|probe| words.similarities(sim.samples(&probe), Words::NAMES).expect("similarities"));
    let page = RunPage::new("A memory and its <input>", &sim).against("seen", &decoded, &ideal);
    page.chart("memory", &held).html()
}

fn the_page_of_any_graph_has_one_moment_folded_modules_loops_and_exports() {
    let page = page_of_a_graph();
    assert!(page.len() < 5_000_000 && !page.contains("WebGLRenderer"), "{} bytes", page.len());
    let script = "\
        found.title = document.title;\n\
        const drawing = () => [...document.querySelectorAll('#drawing .module .name')].map((text) => text.textContent);\n\
        found.modules = drawing();\n\
        found.loops = document.querySelectorAll('#drawing .arrow.loop').length;\n\
        found.labels = [...document.querySelectorAll('#drawing .label')].map((text) => text.textContent);\n\
        const box = [...document.querySelectorAll('#drawing .folded')].find((box) => box.textContent.includes('memory'));\n\
        box.focus(); box.dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter', bubbles: true, cancelable: true }));\n\
        found.opened = drawing();\n\
        document.querySelector('#open-modules button').click(); found.folded = drawing();\n\
        const size = document.querySelector('#drawing svg').getAttribute('viewBox'); byId('larger').click();\n\
        found.zoomed = size !== document.querySelector('#drawing svg').getAttribute('viewBox'); byId('fit').click();\n\
        found.inside = [...document.querySelectorAll('#drawing .module rect')].every((rect) => {\n\
            const { left, right } = rect.getBoundingClientRect(); return left >= -0.5 && right <= innerWidth + 0.5; });\n\
        const { timeline } = page.plots; found.plots = page.plots.content.modules.map(({ title, shows }) => `${title}: ${shows}`);\n\
        found.panels = timeline.panels.length;\n\
        page.seek(0.25);\n\
        found.moments = timeline.strips.map((strip) => strip.moment.style.transform);\n\
        found.legend = [...document.querySelector('#panels .panel').querySelectorAll('output')].map((output) => output.textContent);\n\
        found.values = timeline.panels[0].values(0.25).map((value) => value.toFixed(2));\n\
        found.note = document.querySelector('#panels .note').textContent;\n\
        found.names = timeline.panels[0].module.names;\n\
        const { canvas } = timeline.panels[0]; const at = canvas.getBoundingClientRect();\n\
        canvas.dispatchEvent(new PointerEvent('pointermove', { bubbles: true, isPrimary: true,\n\
            clientX: at.left + timeline.x(0.1), clientY: at.top + 20 })); found.tip = document.querySelector('#strips .tip').innerText;\n\
        const saved = []; URL.createObjectURL = (blob) => { saved.push(blob.type); return 'data:,'; };\n\
        HTMLAnchorElement.prototype.click = function () { saved.push(this.download); };\n\
        [...document.querySelectorAll('#strips button')].filter(({ textContent }) => ['SVG', 'CSV'].includes(textContent))\n\
            .forEach((button) => button.click()); byId('save-drawing').click(); found.saved = saved;\n\
        found.csv = timeline.panels[0].csv().split('\\n').slice(0, 3); found.rows = timeline.panels[0].csv().split('\\n').length;\n\
        found.spikes = timeline.raster.csv().split('\\n').length; found.bands = timeline.raster.groups.map(({ name }) => name);";
    for (width, dark) in [(1366, false), (390, true)] {
        let found = opened_in(&Window { width, dark }, &page, script);
        assert_eq!(found["title"], "A memory and its <input>");
        let mut modules: Vec<&str> =
            found["modules"].as_array().expect("boxes").iter().map(text).collect();
        modules.sort_unstable();
        assert_eq!(modules, ["memory", "seen", "shown"], "routes are arrows");
        assert_eq!(found["loops"], 1, "the memory's own connection");
        let labels = found["labels"].to_string();
        assert!(labels.contains("× 0.5") && labels.contains("100 ms"), "{labels}");
        assert!(found["opened"].as_array().expect("boxes").len() > 3, "{}", found["opened"]);
        assert_eq!(found["folded"], found["modules"]);
        assert_eq!((&found["zoomed"], &found["inside"]), (&true.into(), &true.into()), "{width}");
        let plots = found["plots"].to_string();
        for plot in [
            "seen: similarity",
            "memory: similarity",
            "output seen: norm",
            "spikes per second of memory: ",
        ] {
            assert!(plots.contains(plot), "{plots}");
        }
        assert!(number(&found["panels"]) >= 3.0, "{found}");
        let moments = found["moments"].as_array().expect("moments");
        assert!(
            moments.len() >= 5 && moments.iter().all(|moment| *moment == moments[0]),
            "{moments:?}"
        );
        assert_eq!(found["legend"], found["values"]);
        assert_eq!(found["names"], serde_json::json!(["ONE", "TWO", "ONE, ideal", "TWO, ideal"]));
        assert!(
            text(&found["note"]).starts_with("Root mean square of decoded minus ideal: 0."),
            "{}",
            found["note"]
        );
        assert!(text(&found["tip"]).contains("ONE, ideal 1.00"), "{}", found["tip"]);
        let saved = found["saved"].to_string();
        for file in [
            "seen.svg",
            "seen.csv",
            "the-spikes.svg",
            "the-spikes.csv",
            "modules.svg",
            "image/svg+xml",
            "text/csv",
        ] {
            assert!(saved.contains(&format!("\"{file}\"")), "{file}: {saved}");
        }
        assert_eq!(found["csv"][0], "time_s,ONE,TWO,\"ONE, ideal\",\"TWO, ideal\"");
        assert_eq!(found["rows"], 1 + 300 + 1);
        assert!(number(&found["spikes"]) > 100.0);
        assert_eq!(found["bands"], serde_json::json!(["memory", "seen"]));
    }
    for (width, dark) in [(1366, false), (1366, true), (390, false), (320, true)] {
        let found = opened_in(&Window { width, dark }, &page, AUDIT);
        let at = format!("{width} px, dark {dark}");
        for fault in ["faint", "nameless", "unreached"] {
            assert_eq!(found[fault], serde_json::json!([]), "{at}: {fault}");
        }
        assert!(number(&found["wide"]) <= 0.0, "{at} scrolls sideways");
        assert!(number(&found["shifts"]) < 0.01, "{at}: {}", found["shifts"]);
        assert_eq!(found["ready"], "yes");
    }
}
