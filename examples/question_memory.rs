//! Answers questions about two statements that are no longer shown.
//!
//! `cargo run --example question_memory`

use std::error::Error;

use symbolt::prelude::*;

symbolt::vocabulary!(Things = "things": RED, BLUE, CIRCLE, SQUARE);

/// Returns the similarities of the answer with all names over 900 ms: two statements of 250 ms each, then four questions
/// of 100 ms each.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<TimeSeries, Box<dyn Error>> {
    let things = Things::vocabulary(256, seed)?;
    let mut graph = GraphBuilder::new();
    let statements = [(0, "RED * CIRCLE"), (250, "BLUE * SQUARE"), (500, "0")];
    let statement = graph.add("statement", things.stimulus(statements)?);
    let questions = [(500, "RED"), (600, "CIRCLE"), (700, "BLUE"), (800, "SQUARE")];
    let question = graph.add("question", things.stimulus(questions)?);
    let memory = graph.add("memory", State::new(&things).recurrent(Synapse::lowpass_ms(250)));
    let answer = graph.add("answer", State::new(&things));
    graph.route(&statement >> &memory);
    graph.route(&memory * !&question >> &answer);
    let probe = graph.probe(&answer.output, ProbeSpec::default());
    let sim = graph.run(plan, seed, SimDuration::from_millis(900))?;
    Ok(things.similarities(sim.samples(&probe), Things::NAMES)?)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    println!("{}", run(&PopulationPlan::direct(), Seed::new(1))?);
    Ok(())
}
