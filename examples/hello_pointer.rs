//! Unbinds one of two bound pairs, cleans the result up, and shows when the answer arrives.
//!
//! `cargo run --example hello_pointer`

use std::error::Error;
use std::sync::Arc;

use symbolt::prelude::*;

struct Parts;
impl VocabTag for Parts {
    const NAME: &'static str = "parts";
}

/// Asks "what is in the jig?". Returns the simulated ms at which the answer's dot product with NUT exceeds 0.8, and its
/// final value.
pub fn run() -> Result<(f64, f32), Box<dyn Error>> {
    let parts = VocabularyBuilder::<Parts>::new(256, Seed::new(1))
        .pointers(["NUT", "BOLT", "JIG", "TABLE"])
        .define("SCENE", "JIG * NUT + TABLE * BOLT")
        .build()?;

    let mut graph = GraphBuilder::new();
    let scene = graph.add("scene", Constant::pointer(parts.space(), &parts.get("SCENE")?));
    let place = graph.add("place", Constant::pointer(parts.space(), &parts.get("JIG")?));
    let unbind = graph.add("unbind", Unbind::new(&parts));
    let winner = SelectRule::WinnerTakeAll { level: 0.3 };
    let cleanup = graph.add("cleanup", CleanupMemory::new(&parts, ["NUT", "BOLT"], winner)?);
    graph.connect(&scene, &unbind.bound, Synapse::None);
    graph.connect(&place, &unbind.role, Synapse::None);
    graph.connect(&unbind.output, &cleanup.input, Synapse::None);
    let answer = graph.probe(&cleanup.output, ProbeSpec::default());

    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default())?;
    sim.run_for(SimDuration::from_millis(100))?;

    let nut = parts.get("NUT")?;
    let shown = || sim.samples(&answer).iter().map(|(t, p)| (t, dot(&p, &nut)));
    let at = shown().find(|(_, c)| *c > 0.8).ok_or("no answer in 100 ms")?.0;
    Ok((1e3 * at, shown().last().ok_or("nothing recorded")?.1))
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let (ms, similarity) = run()?;
    println!("In the jig: NUT, after {ms:.0} simulated ms, at similarity {similarity:.3}.");
    Ok(())
}
