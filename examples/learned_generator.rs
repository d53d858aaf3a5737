//! A generator trained by recursive least squares: neurons that wander chaotically on their own learn to repeat a wave
//! (Sussillo and Abbott, "Generating coherent patterns of activity from chaotic neural networks", 2009).
//!
//! `cargo run --release --example learned_generator`

use std::error::Error;
use std::f64::consts::TAU;

use rand::RngExt;
use rand_distr::StandardNormal;
use symbolt::prelude::*;
use symbolt::sim::Signal;

const NEURONS: usize = 300;

fn wave(t: f64) -> f64 {
    0.5 * (TAU * t).sin() + 0.25 * (2.0 * TAU * t).sin() + 0.15 * (3.0 * TAU * t).sin()
}

/// Trains for so many seconds, then returns the root mean square error of two seconds without training.
pub fn run(plan: &PopulationPlan, seed: Seed, training_s: u64) -> Result<f64, Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let cells = graph.add("cells", Ensemble::new(1).neurons(NEURONS).expose_neurons());
    // Each neuron reaches all others, with random weights that keep the activity going.
    let (mut rng, scale) = (seed.derive("cells", "weights").rng(), 0.009 / (NEURONS as f32).sqrt());
    let mut row = || [(); NEURONS].map(|()| scale * rng.sample::<f32, _>(StandardNormal));
    let weights: Vec<_> = (0..NEURONS).map(|_| row()).collect();
    graph.route(
        (cells.neurons().transform(weights) >> &cells.encoded()).via(Synapse::lowpass_ms(100)),
    );
    let rule = Rls::new(1.0).pre_synapse(Synapse::None).toward_target();
    let learned = graph.add("out", Learned::new(&cells.neurons(), 1).rule(rule).switched());
    graph.route(2.0 * &learned >> &cells);
    let target = graph.add("target", Signal::vector(1, |t, out| out[0] = wave(t) as f32));
    graph.route(&target >> &learned.target());
    let end = SimDuration::from_secs(training_s);
    let training = graph.add("training", Stimulus::scalar(1.0).from(end, &[0.0]));
    graph.route(&training >> &learned.learning());
    let probe = graph.probe(&learned.output, ProbeSpec::default());

    let sim = graph.run(plan, seed, SimDuration::from_secs(training_s + 2))?;
    let after = sim.samples(&probe).iter().skip(1000 * training_s as usize);
    let squares = after.map(|(t, out)| (f64::from(out[0]) - wave(t - 0.001)).powi(2));
    Ok((squares.sum::<f64>() / 2000.0).sqrt())
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let rates = PopulationPlan::rate();
    let error = run(&rates, Seed::new(1), 8)?;
    println!(
        "After eight seconds of training the generator is off by {error:.3} (the wave: 0.41)."
    );
    Ok(())
}
