//! Pairs of pointers, learned one after another in spikes: Voja moves encoders toward keys, PES learns the values
//! (Voelker, Crawford and Eliasmith, "Learning large-scale heteroassociative memories in spiking neurons", 2014).
//!
//! `cargo run --release --example learned_pairs`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::sim::Signal;

struct Words;

impl VocabTag for Words {
    const NAME: &'static str = "words";
}

/// Dimensions of keys and values.
const DIM: usize = 64;
/// Cosine from which a neuron fires: two keys that share a neuron are rare.
const INTERCEPT: f64 = 0.3;
const LEARN_MS: u64 = 100;
const RECALL_MS: u64 = 50;

/// Learns so many pairs with a memory of so many neurons. Returns the share of values recalled, by age: that of the
/// first fifth of the pairs, of the second, and so on.
pub fn run(pairs: usize, neurons: usize, seed: Seed) -> Result<Vec<f64>, Box<dyn Error>> {
    let names = (0..2 * pairs).map(|name| format!("W{name}"));
    let words =
        VocabularyBuilder::<Words>::new(DIM, seed).any_similarity().pointers(names).build()?;
    let matrix = words.matrix().to_vec();
    let (keys, values) = matrix.split_at(pairs * DIM);
    // All pairs in turn, then all keys in turn.
    let learning_s = pairs as f64 * LEARN_MS as f64 / 1000.0;
    let shown = move |t: f64| match t < learning_s {
        true => (t * 1000.0 / LEARN_MS as f64 + 1e-6) as usize,
        false => ((t - learning_s) * 1000.0 / RECALL_MS as f64 + 1e-6) as usize,
    };
    let present = |rows: &[f32]| {
        let rows = rows.to_vec();
        Signal::vector(DIM, move |t, out| {
            let row = shown(t).min(pairs - 1);
            out.copy_from_slice(&rows[row * DIM..][..DIM]);
        })
    };

    let mut graph = GraphBuilder::new();
    let (key, value) = (graph.add("key", present(keys)), graph.add("value", present(values)));
    let learning = graph.add("learning", Signal::scalar(move |t| f32::from(t < learning_s)));
    let memory = graph.add("memory", Ensemble::new(1).neurons(neurons).expose_neurons());
    let encoders = Learned::encoders(DIM, &memory.neurons())
        .weights(Weights::directions(seed))
        .rule(Voja::new(0.05).post_synapse(Synapse::None))
        .switched();
    let encoders = graph.add("encoders", encoders);
    let recall = Learned::new(&memory.neurons(), DIM).rule(Pes::new(0.05)).switched();
    let recall = graph.add("recall", recall);
    graph.route((&key >> &encoders.input()).via(Synapse::lowpass_ms(5)));
    graph.route(&encoders >> &memory.encoded());
    graph.route(&recall - &value >> &recall.error());
    graph.route(&learning >> &encoders.learning());
    graph.route(&learning >> &recall.learning());
    let spec = ProbeSpec::every(SimDuration::from_millis(RECALL_MS));
    let probe = graph.probe(&recall.output, spec.filtered(Synapse::lowpass_ms(10)));

    let tuning = Tuning { intercepts: [INTERCEPT; 2], ..Tuning::default() };
    let plan = PopulationPlan::all(Population::Lif(LifSpec::tuned(tuning)));
    let all = SimDuration::from_millis(pairs as u64 * (LEARN_MS + RECALL_MS));
    let sim = graph.run(&plan, seed, all)?;
    let learnt = pairs as u64 * LEARN_MS / RECALL_MS;
    let recalled =
        sim.samples(&probe).iter().skip(learnt as usize).map(|(_, value)| nearest(values, value));
    let right: Vec<bool> = recalled.enumerate().map(|(pair, found)| pair == found).collect();
    let share =
        |pairs: &[bool]| pairs.iter().filter(|right| **right).count() as f64 / pairs.len() as f64;
    Ok(right.chunks(pairs.div_ceil(5)).map(share).collect())
}

/// Returns the row that is most like a vector.
fn nearest(rows: &[f32], vector: &[f32]) -> usize {
    let dot = |row: &[f32]| row.iter().zip(vector).map(|(a, b)| a * b).sum::<f32>();
    let all: Vec<f32> = rows.chunks_exact(DIM).map(dot).collect();
    (0..all.len()).max_by(|a, b| all[*a].total_cmp(&all[*b])).unwrap_or(0)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    // A full memory, and two that are too full.
    for (pairs, neurons) in [(100, 1200), (200, 500), (400, 500)] {
        let shares = run(pairs, neurons, Seed::new(1))?;
        let shares: Vec<String> = shares.iter().map(|s| format!("{:.0} %", 100.0 * s)).collect();
        println!(
            "{pairs} pairs in {neurons} neurons, recalled from the oldest fifth to the latest: {}",
            shares.join(", ")
        );
    }
    Ok(())
}
