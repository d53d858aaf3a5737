//! How much noise a cleanup memory bears, by the number of its items.
//!
//! `cargo run --release --example noise_sweep`

use std::error::Error;
use std::sync::Arc;

use symbolt::neurons::SelectRule;
use symbolt::prelude::*;
use symbolt::sim::VocabTag;
use symbolt::spa::{CleanupMemory, VocabularyBuilder, cosine};

struct Items;
impl VocabTag for Items {
    const NAME: &'static str = "items";
}

const TRIALS: u64 = 50;

/// Of [`TRIALS`] runs, how many recalled the right one of `items` from a cue with noise of norm `sigma`.
fn recalled(items: usize, sigma: f32) -> Result<u64, Box<dyn Error>> {
    let names: Vec<String> = (0..items).map(|i| format!("ITEM_{i}")).collect();
    let names = names.iter().map(String::as_str);
    let vocabulary = VocabularyBuilder::<Items>::new(128, Seed::new(1));
    let vocabulary = vocabulary.any_similarity().pointers(names.clone()).build()?;
    let (space, right) = (vocabulary.space(), vocabulary.get("ITEM_0")?);

    let mut graph = GraphBuilder::new();
    let cue = graph.add("cue", Constant::pointer(space, &right));
    let noise = graph.add("noise", Noise::pointer(space, sigma));
    let winner = SelectRule::WinnerTakeAll { level: 0.0 };
    let cleanup = graph.add("cleanup", CleanupMemory::new(&vocabulary, names, winner)?);
    graph.connect(&cue, &noise.input, Synapse::None);
    graph.connect(&noise.output, &cleanup.input, Synapse::None);
    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
    let graph = Arc::new(graph);

    // The run's seed changes the noise alone: every cell of the sweep meets the same draws.
    (0..TRIALS).try_fold(0, |sum, trial| {
        let mut sim = Simulator::new(graph.clone(), RunConfig::seeded(Seed::new(trial)))?;
        sim.run_for(SimDuration::from_millis(50))?;
        Ok(sum + u64::from(cosine(sim.value(&cleanup.output), &right) > 0.5))
    })
}

/// Items, noise, and the share of trials with the right item, row by row.
pub fn run() -> Result<Vec<(usize, f32, f64)>, Box<dyn Error>> {
    let cells = [10, 100].into_iter().flat_map(|i| [0.0, 2.0, 8.0, 32.0].map(|sigma| (i, sigma)));
    cells.map(|(i, sigma)| Ok((i, sigma, recalled(i, sigma)? as f64 / TRIALS as f64))).collect()
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    println!("items  sigma  recalled");
    for (items, sigma, share) in run()? {
        println!("{items:>5}  {sigma:>5}  {:>7.0}%", 100.0 * share);
    }
    Ok(())
}
