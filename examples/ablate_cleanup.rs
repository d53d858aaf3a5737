//! Shows the contribution of a cleanup memory between two recalls: rates with and without it, on the same noise.
//!
//! `cargo run --release --example ablate_cleanup`

use std::{error::Error, sync::Arc};

use symbolt::prelude::*;
use symbolt::spa::ItemMemory;
use symbolt::study::statistics::Rate;

struct Things;
impl VocabTag for Things {
    const NAME: &'static str = "things";
}

/// Asks on which shelf the nut is. The nut is in a tray and the tray is on a shelf, so a second recall starts from the
/// result of the first recall plus noise of norm `sigma`. Returns the rates of right answers in 200 trials: with the
/// cleanup memory, and with only its synapse.
pub fn run(sigma: f32) -> Result<[Rate; 2], Box<dyn Error>> {
    let names = "NUT BOLT GEAR PIN RED BLUE GREY PINK LEFT RIGHT TOP LOW".split(' ');
    let things = VocabularyBuilder::<Things>::new(256, Seed::new(1)).pointers(names).build()?;
    let tray = things.parse("(NUT * RED + BOLT * BLUE + GEAR * GREY + PIN * PINK) * ~NUT")?;
    // Unbinding by this pointer leads from a tray to its shelf.
    let shelves = "~(~RED * LEFT + ~BLUE * RIGHT + ~GREY * TOP + ~PINK * LOW)";
    let (trays, best) = (["RED", "BLUE", "GREY", "PINK"], SelectRule::WinnerTakeAll { level: 0.0 });
    let mut graph = GraphBuilder::new();
    let tray = graph.add("tray", Constant::pointer(things.space(), &tray));
    let noise = graph.add("noise", Noise::pointer(things.space(), sigma));
    let cleanup = graph.add("cleanup", CleanupMemory::new(&things, trays, best)?);
    let with = graph.add("with", Linear::unbind(&things, shelves)?);
    let without = graph.add("without", Linear::unbind(&things, shelves)?);
    graph.connect(&tray, &noise.input, Synapse::None);
    graph.connect(&noise.output, &cleanup.input, Synapse::None);
    graph.connect(&cleanup.output, &with.input, Synapse::None);
    graph.connect(&noise.output, &without.input, Synapse::lowpass_ms(5));
    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
    let graph = Arc::new(graph);
    let known = ItemMemory::new(things.matrix().to_vec(), things.dim())?;
    let mut right = [0; 2];
    for trial in 0..200 {
        let mut sim = Simulator::new(graph.clone(), RunConfig::seeded(Seed::new(trial)))?;
        sim.run_for(SimDuration::from_millis(60))?;
        for (right, shelf) in right.iter_mut().zip([&with.output, &without.output]) {
            let best = known.best(&sim.value(shelf)).ok_or("nothing is known")?;
            *right += u64::from(things.names()[best.index] == "LEFT");
        }
    }
    Ok(right.map(|right| Rate::new(right, 200)))
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    for sigma in [0.0, 8.0, 12.0] {
        let [with, without] = run(sigma)?.map(|rate| (rate.successes, rate.interval95()));
        println!("noise {sigma:>2}: right with the cleanup {with:.2?}, without it {without:.2?}");
    }
    Ok(())
}
