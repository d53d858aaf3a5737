//! The examples run, and print what the README says that they print.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../examples/custom_node.rs"]
mod custom_node;
#[path = "../examples/hello_pointer.rs"]
mod hello_pointer;
#[path = "../examples/learn_recording.rs"]
mod learn_recording;
#[path = "../examples/noise_sweep.rs"]
mod noise_sweep;
#[path = "../examples/two_step_plan.rs"]
mod two_step_plan;

#[test]
fn hello_pointer_finds_the_nut() {
    let (ms, similarity) = hello_pointer::run().expect("runs");
    assert_eq!(ms, 12.0);
    assert!((similarity - 1.0).abs() < 1e-3, "{similarity}");
}

#[test]
fn two_step_plan_brews_tea() {
    let plan = two_step_plan::run().expect("runs");
    let expected = [("BOIL_WATER", 324.0), ("FILL_POT", 224.0), ("BREW_TEA", 74.0)];
    assert_eq!(plan, expected.map(|(action, ms)| (action.to_owned(), ms)));
}

#[test]
fn custom_node_heats_the_water() {
    let celsius = custom_node::run().expect("runs");
    assert!((celsius - 80.0).abs() < 0.01, "{celsius}");
}

#[test]
fn noise_sweep_shows_recall_falling() {
    let rows = noise_sweep::run().expect("runs");
    assert_eq!(rows.len(), 8);
    for of_size in rows.chunks(4) {
        assert_eq!(of_size[0].2, 1.0, "without noise nothing is lost");
        assert!(of_size.windows(2).all(|pair| pair[1].2 <= pair[0].2), "{of_size:?}");
    }
    // The same noise is worse among more items.
    assert!(rows[2].2 > rows[6].2 + 0.2, "{rows:?}");
}

#[test]
fn learn_recording_learns_the_assembly() {
    let (learned, seen) = learn_recording::run().expect("runs");
    assert_eq!((learned.report.failed(), learned.report.tries.len()), (6, 29));
    assert_eq!((learned.domain.states().len(), learned.domain.operators().len()), (5, 3));
    let states: Vec<Option<&str>> = seen.iter().map(|(_, state)| state.as_deref()).collect();
    let (nut, bolt) = (Some("NUT_AT_START"), Some("BOLT_AT_START"));
    assert_eq!(states, [nut, nut, nut, bolt, bolt, bolt, None, None]);
}
