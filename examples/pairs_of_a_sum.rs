//! Reads a table of 12 rows and 100 possible entries out of a single pointer, and predicts how well that works.
//!
//! `cargo run --example pairs_of_a_sum`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::spa::{Capacity, DecodePairs, PairDecoder};

struct Table;
impl VocabTag for Table {
    const NAME: &'static str = "table";
}

const ROWS: usize = 12;
const ENTRIES: usize = 100;
const DIMENSIONS: usize = 128;

/// Returns the number of right entries if each row is read alone, if all are read together, and in a graph.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<[usize; 3], Box<dyn Error>> {
    let rows: Vec<String> = (0..ROWS).map(|i| format!("ROW{i}")).collect();
    let entries: Vec<String> = (0..ENTRIES).map(|i| format!("ENTRY{i}")).collect();
    let table = VocabularyBuilder::<Table>::new(DIMENSIONS, seed)
        .any_similarity()
        .pointers(rows.iter().chain(&entries).cloned())
        .build()?;
    let stored: Vec<usize> = (0..ROWS).map(|row| 37 * row % ENTRIES).collect();
    let pairs = stored.iter().enumerate().map(|(row, entry)| format!("ROW{row} * ENTRY{entry}"));
    let sum = table.parse(&pairs.collect::<Vec<_>>().join(" + "))?;
    let count = |found: &[usize]| found.iter().zip(&stored).filter(|(a, b)| a == b).count();

    // Outside a graph: alone, and together, which subtracts the estimates of the other pairs.
    let vectors = |names: &[String]| -> Result<Vec<f32>, Box<dyn Error>> {
        let mut all = Vec::new();
        for name in names {
            all.extend_from_slice(&table.get(name)?);
        }
        Ok(all)
    };
    let mut decoder = PairDecoder::new(DIMENSIONS, &vectors(&rows)?, &vectors(&entries)?)?;
    let together: Vec<usize> = decoder.read(&sum).iter().map(|filler| filler.item).collect();
    let mut alone = Vec::new();
    for row in &rows {
        let read = table.parse(&format!("({}) * ~{row}", sum.expression()))?;
        let near = |entry: &usize| table.get(&entries[*entry]).map_or(-1.0, |own| dot(&read, &own));
        alone.extend((0..ENTRIES).max_by(|a, b| near(a).total_cmp(&near(b))));
    }

    // In a graph, also in neurons.
    let mut graph = GraphBuilder::new();
    let names = (rows.iter().map(String::as_str), entries.iter().map(String::as_str));
    // The sum has a norm of about the square root of its number of pairs; populations hold norms of about 1.
    let scale = (ROWS as f32).sqrt().recip();
    let decode = graph.add("decode", DecodePairs::new(&table, names.0, names.1)?.scale(scale));
    graph.route(scale * &sum >> &decode.input);
    let sim = graph.run(plan, seed, SimDuration::from_millis(400))?;
    let mut found = Vec::new();
    for weights in &decode.weights {
        let weights = sim.value(weights);
        found.extend((0..ENTRIES).max_by(|a, b| weights[*a].total_cmp(&weights[*b])));
    }
    Ok([count(&alone), count(&together), count(&found)])
}

/// The prediction for one row that is read alone.
pub fn predicted() -> Capacity {
    Capacity { dimensions: DIMENSIONS, pairs: ROWS, items: ENTRIES, ..Capacity::default() }
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let [alone, together, graph] = run(&PopulationPlan::direct(), Seed::new(1))?;
    println!("right of {ROWS}: {alone} alone, {together} together, {graph} in a graph");
    let predicted = predicted();
    let share = 100.0 * predicted.reliability();
    println!("predicted for a row alone: {share:.0}%");
    if let Some(dimensions) = predicted.dimensions_for(0.99) {
        println!("for 99% alone: {dimensions} dimensions");
        let wide = Capacity { dimensions: dimensions + 64, ..predicted };
        let neurons = wide.neurons_for(0.99);
        println!("or {} with {neurons:?} neurons per dimension", wide.dimensions);
    }
    Ok(())
}
