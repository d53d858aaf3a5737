//! Measures how much noise a cleanup memory tolerates, by its number of items.
//!
//! `cargo run --release --example noise_sweep`

use std::error::Error;
use std::sync::Arc;

use symbolt::prelude::*;

struct Items;
impl VocabTag for Items {
    const NAME: &'static str = "items";
}

/// Norms of the noise.
pub const SIGMAS: [f32; 4] = [0.0, 2.0, 8.0, 32.0];

/// Returns the share of 50 trials that recall the right item among `items` items, for each of [`SIGMAS`].
pub fn run(items: usize) -> Result<Vec<f64>, Box<dyn Error>> {
    let vocabulary = VocabularyBuilder::<Items>::new(128, Seed::new(1)).any_similarity();
    let vocabulary = vocabulary.pointers((0..items).map(|i| format!("ITEM_{i}"))).build()?;
    let names = vocabulary.names().iter().map(String::as_str);
    let (space, right) = (vocabulary.space(), vocabulary.get("ITEM_0")?);

    let mut graph = GraphBuilder::new();
    let cue = graph.add("cue", Constant::pointer(space, &right));
    let noise = graph.add("noise", Noise::pointer(space, 1.0));
    let winner = SelectRule::WinnerTakeAll { level: 0.0 };
    let cleanup = graph.add("cleanup", CleanupMemory::new(&vocabulary, names, winner)?);
    graph.connect(&cue, &noise.input, Synapse::None);
    graph.connect(&noise.output, &cleanup.input, Synapse::None);
    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
    let graph = Arc::new(graph);

    let share = |sigma| {
        let mut recalled = 0.0;
        for trial in 0..50 {
            // The seed and the noise scale of a run change only the noise. Trials with the same seed have the same
            // draws for every sigma.
            let config = RunConfig::seeded(Seed::new(trial)).with_noise(sigma);
            let mut sim = Simulator::new(graph.clone(), config)?;
            sim.run_for(SimDuration::from_millis(50))?;
            recalled += f64::from(cosine(&sim.value(&cleanup.output), &right) > 0.5);
        }
        Ok(recalled / 50.0)
    };
    SIGMAS.into_iter().map(share).collect()
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    for items in [10, 100] {
        let percent = run(items)?.iter().map(|share| 100.0 * share).collect::<Vec<_>>();
        println!("{items} items, noise {SIGMAS:?}: recalled in {percent:.0?} % of trials");
    }
    Ok(())
}
