//! Says whether two pictures are the same: a comparison, and two rules.
//!
//! `cargo run --example same_or_different`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::spa::Compare;

symbolt::vocabulary!(Things = "things": RED, BLUE, SAME, DIFFERENT);

/// Returns the similarities of the answer with SAME and DIFFERENT. The right picture changes after 200 ms.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<TimeSeries, Box<dyn Error>> {
    let things = Things::vocabulary(128, seed)?;
    let mut graph = GraphBuilder::new();
    let left = graph.add("left", things.stimulus([(0, "RED")])?);
    let right = graph.add("right", things.stimulus([(0, "RED"), (200, "BLUE")])?);
    let compare = graph.add("compare", Compare::new(&things));
    let answer = graph.add("answer", State::new(&things));
    graph.route(&left >> &compare.a);
    graph.route(&right >> &compare.b);
    let rules = Rules::new().rule("same", &compare, [Things::SAME >> &answer]).otherwise(
        "different",
        0.5,
        [Things::DIFFERENT >> &answer],
    );
    graph.add("rules", rules);
    let probe = graph.probe(&answer.output, ProbeSpec::every(SimDuration::from_millis(50)));
    let sim = graph.run(plan, seed, SimDuration::from_millis(400))?;
    Ok(things.similarities(sim.samples(&probe), ["SAME", "DIFFERENT"])?)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    println!("{}", run(&PopulationPlan::direct(), Seed::new(1))?);
    Ok(())
}
