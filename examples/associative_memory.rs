//! Recalls what follows a word: an associative memory.
//!
//! `cargo run --example associative_memory`

use std::error::Error;

use symbolt::prelude::*;

symbolt::vocabulary!(Words = "words": ONE, TWO, THREE, NOISE);

/// Returns what the memory says after 100 ms, in words.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<String, Box<dyn Error>> {
    let words = Words::vocabulary(64, seed)?;
    let mut graph = GraphBuilder::new();
    let next = [("ONE", "TWO"), ("TWO", "THREE"), ("THREE", "ONE")];
    let rule = SelectRule::WinnerTakeAll { level: 0.3 };
    let memory = graph.add("memory", AssociativeMemory::new(&words, &words, next, rule)?);
    graph.route(0.8 * Words::ONE + 0.3 * Words::NOISE >> &memory);
    let sim = graph.run(plan, seed, SimDuration::from_millis(100))?;
    Ok(words.describe(&sim.value(&memory.output), 0.4))
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    println!("After ONE comes {}.", run(&PopulationPlan::direct(), Seed::new(1))?);
    Ok(())
}
