//! Answers "what is red?" about a red circle, and "what is square?" about a blue square.
//!
//! `cargo run --example question_answering`

use std::error::Error;

use symbolt::prelude::*;

symbolt::vocabulary!(Things = "things": RED, BLUE, CIRCLE, SQUARE);

/// Returns the similarities of the answer with all names over 500 ms. The questions change every 125 ms.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<TimeSeries, Box<dyn Error>> {
    let things = Things::vocabulary(128, seed)?;
    let mut graph = GraphBuilder::new();
    let colour = graph.add("colour", things.stimulus([(0, "RED"), (250, "BLUE")])?);
    let shape = graph.add("shape", things.stimulus([(0, "CIRCLE"), (250, "SQUARE")])?);
    let questions = [(0, "RED"), (125, "CIRCLE"), (250, "BLUE"), (375, "SQUARE")];
    let question = graph.add("question", things.stimulus(questions)?);
    let answer = graph.add("answer", State::new(&things));
    graph.route(&colour * &shape * !&question >> &answer);
    let probe = graph.probe(&answer.output, ProbeSpec::default());
    let sim = graph.run(plan, seed, SimDuration::from_millis(500))?;
    Ok(things.similarities(sim.samples(&probe), Things::NAMES)?)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    println!("{}", run(&PopulationPlan::direct(), Seed::new(1))?);
    Ok(())
}
