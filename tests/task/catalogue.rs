//! Experiments of the catalogue, with few trials.

#![allow(clippy::expect_used)]

use symbolt::sim::Seed;
use symbolt::study::catalogue::{Options, find};
use symbolt::study::worlds;

/// Returns the rate of accepted decisions of a variant.
fn accepted(change: &str, to: &str) -> f64 {
    let experiment = find("ablation", &Options::default()).expect("an experiment");
    let cells = experiment.cells();
    let cell = cells.iter().find(|cell| cell.is("change", change) && cell.is("to", to));
    let cell = cell.expect("a variant");
    let (mut right, mut of) = (0.0, 0.0);
    for trial in 0..6 {
        let seed = Seed::new(1).derive_index("trial", trial);
        let [own, all, ..] = experiment.trial(cell, seed).expect("runs");
        right += own;
        of += all;
    }
    right / of
}

#[test]
fn the_whole_planner_is_always_right_and_without_its_gate_it_acts_too_soon() {
    assert_eq!(accepted("without", "nothing (direct)"), 1.0);
    assert!(accepted("without", "gate (direct)") < 0.8);
    assert_eq!(accepted("unbinding", "products (direct)"), 1.0);
}

#[test]
fn every_plain_world_is_solved_by_either_planner_from_five_demonstrations() {
    let experiment = find("worlds", &Options::default()).expect("an experiment");
    let cells = experiment.cells();
    // Eleven settings of each world, and one of the world of bins.
    assert_eq!(cells.len(), (worlds::all().len() - 1) * 11 + 1);
    let plain = worlds::plain();
    let names: Vec<(&str, ())> = plain.iter().map(|world| (world.name(), ())).collect();
    let few = cells.iter().filter(|cell| {
        cell.number("demonstrations").ok() == Some(5.0)
            && cell.choice("world", &names).is_ok()
            && cell.choice("noise", &[("none", ())]).is_ok()
    });
    let mut solved = 0;
    for cell in few {
        let done = experiment.trial(cell, Seed::new(1)).expect("a trial");
        solved += done[0] as usize;
        assert!(done[2] > 30.0 && done[1] / done[2] > 0.9, "{cell}: {done:?}");
        assert_eq!(done[3], done[4], "{cell}: a required condition is wrong");
    }
    assert!(solved >= 2 * 19 - 1, "{solved}");
}
