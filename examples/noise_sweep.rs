//! How much noise a cleanup memory bears, by the number of its items.
//!
//! `cargo run --release --example noise_sweep`

use std::error::Error;
use std::sync::Arc;

use symbolt::neurons::SelectRule;
use symbolt::prelude::*;
use symbolt::sim::{Graph, Out, Pointer, VocabTag};
use symbolt::spa::{CleanupMemory, Vocabulary, VocabularyBuilder, cosine};

struct Items;
impl VocabTag for Items {
    const NAME: &'static str = "items";
}

const TRIALS: u64 = 50;

/// One cell of the sweep: of [`TRIALS`] runs, how many recalled the right item of `items`.
fn recalled(items: usize, sigma: f32) -> Result<u64, Box<dyn Error>> {
    let names: Vec<String> = (0..items).map(|i| format!("ITEM_{i}")).collect();
    let vocabulary = VocabularyBuilder::<Items>::new(128, Seed::new(1))
        .any_similarity()
        .pointers(names.iter().map(String::as_str))
        .build()?;
    let (graph, seen) = describe(&vocabulary, sigma)?;
    let graph = Arc::new(graph);
    let mut right = 0;
    for trial in 0..TRIALS {
        // The run seed changes the noise alone: every cell meets the same draws.
        let mut sim = Simulator::new(graph.clone(), RunConfig::seeded(Seed::new(trial)))?;
        sim.run_for(SimDuration::from_millis(50))?;
        right += u64::from(cosine(sim.value(&seen), &vocabulary.get("ITEM_0")?) > 0.5);
    }
    Ok(right)
}

type Seen = Out<Pointer<Items>>;

fn describe(items: &Vocabulary<Items>, sigma: f32) -> Result<(Graph, Seen), Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let cue = graph.add("cue", Constant::pointer(items.space(), &items.get("ITEM_0")?));
    let noise = graph.add("noise", Noise::pointer(items.space(), sigma));
    let winner = SelectRule::WinnerTakeAll { level: 0.0 };
    let cleanup = graph.add(
        "cleanup",
        CleanupMemory::new(items, items.names().iter().map(String::as_str), winner)?,
    );
    graph.connect(&cue, &noise.input, Synapse::None);
    graph.connect(&noise.output, &cleanup.input, Synapse::None);
    let output = cleanup.output;
    Ok((graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?, output))
}

/// Items, noise, share recalled.
pub type Row = (usize, f32, f64);

/// The sweep, row by row.
pub fn run() -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = Vec::new();
    for items in [10, 100] {
        for sigma in [0.0, 2.0, 8.0, 32.0] {
            rows.push((items, sigma, recalled(items, sigma)? as f64 / TRIALS as f64));
        }
    }
    Ok(rows)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    println!("items  sigma  recalled");
    for (items, sigma, share) in run()? {
        println!("{items:>5}  {sigma:>5}  {:>7.0}%", 100.0 * share);
    }
    Ok(())
}
