//! Recalls a list item by item: a sequence of positions reads it out of one pointer.
//!
//! `cargo run --example serial_recall`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::sim::Signal;
use symbolt::spa::Sequence;

symbolt::vocabulary!(Words = "words": RED, GREEN, BLUE, FIRST, SECOND, THIRD);

/// Returns the similarities of what is recalled with the colours. Each position lasts 200 ms.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<TimeSeries, Box<dyn Error>> {
    let words = Words::vocabulary(256, seed)?;
    let mut graph = GraphBuilder::new();
    let list = graph.add("list", State::new(&words));
    let clock = graph.add("clock", Signal::scalar(|t| f32::from(u8::from(t % 0.2 >= 0.1))));
    let position = Sequence::new(&words, ["FIRST", "SECOND", "THIRD"])?;
    let position = graph.add("position", position);
    let rule = SelectRule::WinnerTakeAll { level: 0.2 };
    let recalled = CleanupMemory::new(&words, ["RED", "GREEN", "BLUE"], rule)?;
    let recalled = graph.add("recalled", recalled);
    let shown =
        Words::FIRST * Words::GREEN + Words::SECOND * Words::RED + Words::THIRD * Words::BLUE;
    graph.route(0.6 * shown >> &list);
    graph.route(&clock >> &position.next);
    graph.route(&list * !&position.output >> &recalled);
    let probe = graph.probe(&recalled.output, ProbeSpec::default());
    let sim = graph.run(plan, seed, SimDuration::from_millis(600))?;
    Ok(words.similarities(sim.samples(&probe), ["RED", "GREEN", "BLUE"])?)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let recalled = run(&PopulationPlan::direct(), Seed::new(1))?;
    for ms in [95, 295, 495] {
        println!("{ms} ms: {:?}", recalled.best(f64::from(ms) / 1e3));
    }
    Ok(())
}
