//! Compares populations with theory: the drift of a memory, and the error of spiking decoding for growing ensembles.

use std::sync::Arc;

use super::bank::{Bank, Draft, Recipe, Shape};
use super::draw::{Neurons, either_way};
use super::models::{Lif, LifRate, NeuronModel};
use super::solve::{self, Points};
use crate::sim::{Real, Seed};
use rand::RngExt;

const DT_S: f64 = 0.001;

fn neurons(count: usize, seed: Seed) -> Neurons {
    let intercept = |rng: &mut rand_chacha::ChaCha8Rng| -1.0 + 1.9 * rng.random::<f64>();
    let (lif, rates) = (Lif::default(), 200.0..=400.0);
    Neurons::draw(&lif, (count, 1), rates, &mut seed.rng(), either_way, intercept)
        .expect("possible")
}

fn points() -> Points {
    let values: Vec<f64> = (0..300).map(|i| 2.0 * (f64::from(i) + 0.5) / 300.0 - 1.0).collect();
    Points { wanted: values.clone(), values, outputs: 1 }
}

/// One ensemble of one dimension that decodes the identity.
fn bank(count: usize, seed: Seed, model: impl NeuronModel) -> Bank {
    let shape = Shape { ensembles: 1, neurons: count, dims: 1, outputs: 1, hadamard: false };
    let draft =
        |_, seed| Ok(Draft { neurons: neurons(count, seed), radius: 1.0, points: points() });
    let recipe = Recipe { seed, ..Recipe::of(&model, DT_S, shape) };
    Bank::new(Arc::new(recipe.solve(draft).expect("solvable")), Arc::new(model), DT_S)
}

/// The mean decoded value of the ensemble of [`bank`] at a constant input, from the closed form of the rates.
fn said(count: usize, seed: Seed) -> impl Fn(f64) -> f64 {
    let neurons = neurons(count, seed.derive_index("ensemble", 0));
    let lif = Lif::default();
    let decoders = solve::solve(&lif, &neurons, &points(), 0.1).expect("solvable");
    move |x| {
        (0..count)
            .map(|n| {
                let current = neurons.gains[n] * neurons.encoders[n] * x + neurons.biases[n];
                lif.rate(current) * decoders[n]
            })
            .sum()
    }
}

/// The value that a recurrent synapse of 100 ms holds after one second.
fn held(bank: &Bank, start: f64) -> f64 {
    let decay = (-DT_S / 0.1f64).exp() as Real;
    let (mut state, mut value, mut out) =
        (vec![0.0; bank.state_of(1)], start as Real, [0.0 as Real]);
    // The neurons settle for 100 ms before the recurrent synapse takes over.
    for tick in 0..1_100 {
        bank.step(0, (&[value], 1.0), &mut state, &mut out);
        if tick >= 100 {
            value = decay * value + (1.0 - decay) * out[0];
        }
    }
    f64::from(value)
}

/// A memory drifts by the error of its decoding: `dx/dt = (f(x) - x) / tau`, where `f(x)` is the value decoded at `x`
/// (Eliasmith and Anderson 2003, section 8.2).
#[test]
fn a_memory_drifts_by_the_error_of_its_decoding() {
    let starts = [-0.7, -0.3, 0.1, 0.45, 0.8];
    let (mut moved, mut of_large) = (0.0f64, 0.0f64);
    for seed in (0..5).map(Seed::new) {
        let (rates, spikes) = (bank(50, seed, LifRate::default()), bank(50, seed, Lif::default()));
        let large = bank(400, seed, LifRate::default());
        let f = said(50, seed);
        for start in starts {
            let mut x = start;
            for _ in 0..10_000 {
                x += 0.0001 / 0.1 * (f(x) - x);
            }
            let by_rates = held(&rates, start);
            assert!((by_rates - x).abs() < 2e-3, "{seed} {start}: {by_rates} instead of {x}");
            // Spikes add jitter but no further drift.
            let by_spikes = held(&spikes, start);
            assert!((by_spikes - x).abs() < 0.08, "{seed} {start}: {by_spikes} instead of {x}");
            moved += (by_rates - start).abs();
            of_large += (held(&large, start) - start).abs();
        }
    }
    assert!(moved / 25.0 > 0.01, "{moved}");
    assert!(of_large < 0.5 * moved, "more neurons drift less: {of_large} {moved}");
}

/// Mean square error of a constant that is decoded from spikes and filtered by a synapse of 10 ms.
fn spiking_error(count: usize, seed: Seed) -> f64 {
    let bank = bank(count, seed, Lif::default());
    let decay = (-DT_S / 0.01f64).exp() as Real;
    let mut square = 0.0;
    for value in [-0.8, -0.35, 0.2, 0.55] {
        let (mut state, mut out, mut filtered) = (vec![0.0; bank.state_of(1)], [0.0], 0.0 as Real);
        for tick in 0..400 {
            bank.step(0, (&[value], 1.0), &mut state, &mut out);
            filtered = decay * filtered + (1.0 - decay) * out[0];
            if tick >= 100 {
                square += f64::from(filtered - value).powi(2);
            }
        }
    }
    square / 1_200.0
}

/// The error of spiking decoding falls with a power of the number of neurons. The power lies between 2 (static
/// distortion) and 1 (independent spikes; Eliasmith and Anderson 2003, sections 2.3 and 4.4). Measured slope: about
/// -1.3.
#[test]
fn the_error_of_spiking_decoding_falls_with_the_neurons() {
    let median = |count: usize| {
        let mut all: Vec<f64> = (0..9).map(|seed| spiking_error(count, Seed::new(seed))).collect();
        all.sort_by(f64::total_cmp);
        all[4]
    };
    let (few, many) = (median(25), median(400));
    let slope = (many / few).ln() / 16f64.ln();
    println!("mean square error {few:.2e} of 25 neurons, {many:.2e} of 400: slope {slope:.2}");
    assert!((-2.2..=-0.8).contains(&slope), "{slope}");
}
