//! Finds the factors of a bound pointer: colour, shape and place of an object, of 8,000 combinations.
//!
//! `cargo run --example factors`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::spa::{Resonator, ResonatorNetwork};

struct Objects;
impl VocabTag for Objects {
    const NAME: &'static str = "objects";
}

/// Factors `COLOUR7 * SHAPE3 * PLACE16` outside a graph and in one. Returns the names that each finds.
pub fn run(seed: Seed) -> Result<[Vec<String>; 2], Box<dyn Error>> {
    // A bound pointer can be factored if the factors are unitary.
    let books = ["COLOUR", "SHAPE", "PLACE"]
        .map(|kind| (0..20).map(|i| format!("{kind}{i}")).collect::<Vec<_>>());
    let mut objects = VocabularyBuilder::<Objects>::new(512, seed).any_similarity();
    for name in books.iter().flatten() {
        objects = objects.unitary(name);
    }
    let objects = objects.build()?;
    let seen = objects.parse("COLOUR7 * SHAPE3 * PLACE16")?;

    // As an algorithm, which starts again until the factors fit.
    let mut codebooks = Vec::new();
    for book in &books {
        let mut rows = Vec::new();
        for name in book {
            rows.extend_from_slice(&objects.get(name)?);
        }
        codebooks.push(rows);
    }
    let codebooks: Vec<&[f32]> = codebooks.iter().map(Vec::as_slice).collect();
    let factors = Resonator::new(objects.dim(), &codebooks)?.factor(&seen);
    let found = books.iter().zip(&factors.items).map(|(book, item)| book[*item].clone()).collect();

    // As a module of a graph, which can run in neurons, too.
    let mut graph = GraphBuilder::new();
    let names = books.iter().map(|book| book.iter().map(String::as_str));
    let network = graph.add("network", ResonatorNetwork::new(&objects, names)?);
    graph.route(seen >> &network.input);
    let sim =
        graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(1_000))?;
    let nearest = |output| {
        let estimate = sim.value(output);
        let near = |name: &&String| objects.get(name).map_or(-1.0, |own| cosine(&estimate, &own));
        objects.names().iter().max_by(|a, b| near(a).total_cmp(&near(b))).cloned()
    };
    Ok([found, network.outputs.iter().filter_map(nearest).collect()])
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let [algorithm, network] = run(Seed::new(1))?;
    println!("Resonator: {}", algorithm.join(", "));
    println!("ResonatorNetwork: {}", network.join(", "));
    Ok(())
}
