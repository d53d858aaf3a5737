//! Mistakes of modellers: those that the builder finds, and the page that lists all of them.
//!
//! `compile_fail.rs` has those that the compiler finds.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use symbolt::neurons::PathPattern;
use symbolt::prelude::*;
use symbolt::sim::PointerRef;

symbolt::vocabulary!(Parts = "parts": NUT, BOLT);

fn parts(dimensions: usize, seed: u64) -> Vocabulary<Parts> {
    let builder = VocabularyBuilder::new(dimensions, Seed::new(seed)).any_similarity();
    builder.pointer("NUT").build().expect("sound")
}

#[test]
fn the_builder_finds_all_mistakes_at_once_and_names_the_choices() {
    let (own, other) = (parts(64, 1), parts(64, 2));
    let mut graph = GraphBuilder::new();
    let seen = graph.add("seen", State::new(&own));
    let bind = graph.add("bind", Bind::new(&own));
    // Fed by nothing.
    graph.add("lonely", State::new(&own));
    // Two sources for a factor.
    graph.connect(&seen.output, &bind.a, Synapse::None);
    graph.connect(&seen.output, &bind.a, Synapse::lowpass_ms(5));
    graph.connect(&seen.output, &bind.b, Synapse::None);
    // A vocabulary of the same type with other pointers.
    let stranger = graph.add("stranger", State::new(&other));
    graph.connect(&seen.output, &stranger.input, Synapse::None);
    // A name that the vocabulary was built without, and a pointer of fewer dimensions.
    graph.route(Parts::BOLT >> &seen);
    graph.route(&bind * parts(32, 1).get("NUT").unwrap() >> &seen);
    // A scalar product of constants.
    let level = graph.add("level", Add::scalar());
    graph.route(Parts::NUT.dot(Parts::NUT) >> &level);
    // A loop in which nothing takes time.
    graph.route((&level >> &level).named("around"));
    // An output of another graph.
    let mut elsewhere = GraphBuilder::new();
    let foreign = elsewhere.add("foreign", Constant::scalar(1.0));
    graph.connect(&foreign, &level.input, Synapse::None);
    // Widths that differ.
    let pair = graph.add("pair", Constant::vector(&[1.0, 2.0]));
    let three = graph.add("three", Add::vector(3));
    graph.connect(&pair, &three.input, Synapse::None);
    // Names: reserved characters, and one that is taken.
    graph.add("my state", Constant::scalar(1.0));
    graph.add("pair", Constant::scalar(1.0));
    // A probe between ticks, a radius of 0, a constant that is not finite.
    graph.probe(&seen.output, ProbeSpec::every(SimDuration::from_micros(1_500)));
    graph.add("flat", State::new(&own).radius(0.0));
    graph.add("nan", Constant::pointer(own.space(), &PointerRef::from_raw(&[f32::NAN; 64])));
    // An ablation of something that is not there.
    let pattern: PathPattern = "sean/**".parse().unwrap();
    let plan = PopulationPlan::direct().with(pattern, Population::Rate(LifSpec::default()));

    let faults = graph.start(&plan, Seed::new(1)).map(|_| ()).expect_err("many faults");
    let faults = format!("{faults:#}");
    println!("{faults}");
    let page = include_str!("../../docs/mistakes.md");
    let (_, shown) = page.split_once("```text\n").expect("a block");
    let (shown, _) = shown.split_once("```").expect("an end");
    let lines = |text: &str| -> Vec<String> {
        let here = |line: &str| {
            line.split("tests/documents/mistakes.rs").next().unwrap_or_default().to_owned()
        };
        text.lines().map(here).collect()
    };
    assert_eq!(lines(&faults), lines(shown));
}

/// The texts between `r#"` and `"#`.
fn raw(source: &str) -> Vec<&str> {
    source.split("r#\"").skip(1).filter_map(|rest| rest.split("\"#").next()).collect()
}

#[test]
fn the_page_shows_every_mistake_that_the_compiler_finds() {
    let (source, page) = (include_str!("compile_fail.rs"), include_str!("../../docs/mistakes.md"));
    let (program, table) = source.split_once("\nmistakes! {").expect("a table");
    let [before] = raw(program)[..] else { panic!("one program") };
    let shown = before.replace("#[deny(unused_must_use)]\n", "");
    assert!(page.contains(shown.trim()), "{shown}");
    let texts = raw(table);
    let fences = table.matches("\"compile_fail").count();
    assert_eq!(texts.len(), 2 * fences);
    assert!(fences >= 27, "{fences}");
    for pair in texts.chunks_exact(2) {
        let lines = [0, 1].map(|at| pair[at].lines().map(str::trim).collect::<Vec<_>>());
        assert_ne!(lines[0], lines[1]);
        for (own, twin) in [(&lines[0], &lines[1]), (&lines[1], &lines[0])] {
            for line in own.iter().filter(|line| !twin.contains(line)) {
                let cell = format!("`{}`", line.trim_end_matches(';'));
                assert!(page.contains(&cell), "{cell}");
            }
        }
    }
}
