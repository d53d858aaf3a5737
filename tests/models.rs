//! The classical models of the guide to expressions are right in exact maths, in firing rates and in spikes.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../examples/associative_memory.rs"]
mod associative_memory;
#[path = "../examples/cycle.rs"]
mod cycle;
#[path = "../examples/parser.rs"]
mod parser;
#[path = "../examples/question_answering.rs"]
mod question_answering;
#[path = "../examples/question_memory.rs"]
mod question_memory;

use symbolt::neurons::{LifSpec, Population, PopulationPlan};
use symbolt::sim::Seed;
use symbolt::spa::Similarities;

/// Runs a check in every mode with each seed, and returns the faults.
fn faults(seeds: u64, check: impl Fn(&PopulationPlan, Seed) -> Result<(), String>) -> Vec<String> {
    let lif = LifSpec::default();
    let plans = [
        ("direct", PopulationPlan::direct()),
        ("rate", PopulationPlan::all(Population::Rate(lif))),
        ("spiking", PopulationPlan::all(Population::Lif(lif))),
    ];
    let mut faults = Vec::new();
    for (mode, plan) in &plans {
        for seed in 1..=seeds {
            if let Err(fault) = check(plan, Seed::new(seed)) {
                faults.push(format!("{mode}, seed {seed}: {fault}"));
            }
        }
    }
    faults
}

/// Checks which expression is the most similar at each time (in ms).
fn answers(found: &Similarities, expected: &[(u64, &str)]) -> Result<(), String> {
    for (ms, name) in expected {
        let best = found.best(*ms as f64 / 1e3).ok_or("no sample")?;
        if best.0 != *name || best.1 < 0.15 {
            return Err(format!("{best:?} at {ms} ms; expected {name}"));
        }
    }
    Ok(())
}

fn recalls(plan: &PopulationPlan, seed: Seed) -> Result<(), String> {
    let recalled = associative_memory::run(plan, seed).map_err(|e| e.to_string())?;
    let right = recalled.ends_with(" TWO") && !recalled.contains('+') && !recalled.contains(" - ");
    if right { Ok(()) } else { Err(recalled) }
}

fn answers_what_is_shown(plan: &PopulationPlan, seed: Seed) -> Result<(), String> {
    let found = question_answering::run(plan, seed).map_err(|e| e.to_string())?;
    answers(&found, &[(125, "CIRCLE"), (250, "RED"), (375, "SQUARE"), (500, "BLUE")])
}

fn answers_from_memory(plan: &PopulationPlan, seed: Seed) -> Result<(), String> {
    let found = question_memory::run(plan, seed).map_err(|e| e.to_string())?;
    answers(&found, &[(600, "CIRCLE"), (700, "RED"), (800, "SQUARE"), (900, "BLUE")])
}

fn cycles(plan: &PopulationPlan, seed: Seed) -> Result<(), String> {
    let found = cycle::run(plan, seed).map_err(|e| e.to_string())?;
    let switches = found.switches(0.3);
    let order: String = switches.iter().map(|(_, name)| *name).collect();
    if order.len() < 13 || !"ABCDEABCDEABCDEABCDEABCDE".starts_with(&order) {
        return Err(order);
    }
    // The first state is shown for longer.
    let times: Vec<f64> = switches.iter().skip(1).map(|(time, _)| 1e3 * time).collect();
    let steps: Vec<f64> = times.windows(2).map(|pair| (pair[1] - pair[0]).round()).collect();
    match steps.iter().all(|step| (28.0..=37.0).contains(step)) {
        true => Ok(()),
        false => Err(format!("{steps:.0?} ms")),
    }
}

fn executes(plan: &PopulationPlan, seed: Seed) -> Result<(), String> {
    let found = parser::run(plan, seed).map_err(|e| e.to_string())?;
    answers(&found, &[(450, "ONE"), (900, "THREE")])?;
    for ms in [150, 300, 600, 750, 1050, 1200, 1350] {
        let (name, similarity) = found.best(f64::from(ms) / 1e3).ok_or("no sample")?;
        if similarity > 0.15 {
            return Err(format!("the hand writes {name} ({similarity:.2}) at {ms} ms"));
        }
    }
    Ok(())
}

/// How many seeds the quick tests and the long ones try.
const QUICK: u64 = 2;
const LONG: u64 = 20;

macro_rules! models {
    ($($check:ident: $quick:ident, $long:ident;)*) => {$(
        #[test]
        fn $quick() {
            assert_eq!(faults(QUICK, $check), Vec::<String>::new());
        }

        #[test]
        #[ignore = "long statistics"]
        fn $long() {
            assert_eq!(faults(LONG, $check), Vec::<String>::new());
        }
    )*};
}

models! {
    recalls: an_associative_memory_recalls, an_associative_memory_recalls_with_every_seed;
    answers_what_is_shown: questions_are_answered, questions_are_answered_with_every_seed;
    answers_from_memory: statements_are_remembered, statements_are_remembered_with_every_seed;
    cycles: five_states_follow_each_other, five_states_follow_each_other_with_every_seed;
    executes: written_commands_are_executed, written_commands_are_executed_with_every_seed;
}
