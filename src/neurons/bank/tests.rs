//! Compares banks with the closed form, and with themselves when no ensemble is skipped.

use rand::RngExt;

use super::*;
use crate::neurons::draw::on_sphere;
use crate::neurons::models::{Lif, LifRate, PoissonSpiking};

/// Three ensembles of 50 neurons.
fn bank(dims: usize) -> Bank {
    bank_of(50, dims)
}

/// Three ensembles: in one dimension all neurons fire only above 0.1, in two dimensions their encoders are random directions.
fn bank_of(count: usize, dims: usize) -> Bank {
    let lif = Lif::default();
    let shape = Shape { ensembles: 3, neurons: count, dims, outputs: dims, hadamard: false };
    let draft = |_, seed: Seed| {
        let mut rng = seed.rng();
        let encoder = |rng: &mut rand_chacha::ChaCha8Rng, out: &mut [f64]| {
            if dims == 1 { out.fill(1.0) } else { on_sphere(rng, out) }
        };
        let low = if dims == 1 { 0.1 } else { -0.9 };
        let intercept = |rng: &mut rand_chacha::ChaCha8Rng| low + 0.8 * rng.random::<f64>();
        let neurons =
            Neurons::draw(&lif, (count, dims), 200.0..=400.0, &mut rng, encoder, intercept)?;
        let values: Vec<f64> = (0..200 * dims).map(|_| rng.random::<f64>() - 0.5).collect();
        let points = Points { wanted: values.clone(), values, outputs: dims };
        Ok(Draft { neurons, radius: 1.0, points })
    };
    built(shape, draft)
}

fn built(shape: Shape, draft: impl Fn(usize, Seed) -> Result<Draft, TuningError> + Sync) -> Bank {
    let solved = Recipe::of(&Lif::default(), 0.001, shape).solve(draft);
    let solved = solved.unwrap_or_else(|error| panic!("{error}"));
    Bank::new(Arc::new(solved), Arc::new(Lif::default()), 0.001)
}

/// Outputs and states of a bank over 300 ticks: driven, silenced, driven again.
fn trace(bank: &Bank) -> Vec<u32> {
    trace_and_tell(bank, 0)
}

/// As [`trace`], while the activity of so many neurons is asked for.
fn trace_and_tell(bank: &Bank, told: usize) -> Vec<u32> {
    let dims = bank.shape().dims;
    let (mut state, mut out) = (vec![0.0; bank.state_of(3)], vec![0.0; 3 * dims + told]);
    let mut all = Vec::new();
    for tick in 0..300 {
        let open = if (100..200).contains(&tick) { 0.0 } else { 1.0 };
        let at = |i: usize| (0.05 * tick as Real + i as Real).sin() * 0.7;
        let values: Vec<Real> = (0..3 * dims).map(at).collect();
        bank.step(0, (&values, open), &mut state, &mut out);
        all.extend(out[..3 * dims].iter().chain(&state).map(|v| v.to_bits()));
    }
    all
}

#[test]
fn ensembles_whose_activity_is_asked_for_have_the_bits_of_those_of_the_plain_loop() {
    let models: [Arc<dyn NeuronModel>; 3] = [
        Arc::new(Lif::default()),
        Arc::new(LifRate::default()),
        Arc::new(PoissonSpiking::new(Lif::default())),
    ];
    // Less than one block of neurons, one and a half, and three.
    let each = |neurons: usize| models.iter().map(move |model| (neurons, model));
    for (neurons, model) in [50, 200, 384].into_iter().flat_map(each) {
        let bank = Bank::new(bank_of(neurons, 1).solved, Arc::clone(model), 0.001);
        let plain = trace(&bank);
        assert!(plain == trace_and_tell(&bank, 3 * neurons), "{neurons} neurons, {model:?}");
        assert!(
            plain.iter().filter(|bits| **bits != 0).count() > 200,
            "{neurons} neurons, {model:?}"
        );
        // The wrong variant: the last neurons of an ensemble have other decoders.
        let mut wrong = bank;
        let decoders = &mut Arc::make_mut(&mut wrong.solved).decoders;
        decoders[neurons - 40..neurons].iter_mut().for_each(|decoder| *decoder += 1e-3);
        assert!(plain != trace_and_tell(&wrong, 3 * neurons), "{neurons} neurons, {model:?}");
    }
}

#[test]
fn an_ensemble_passed_over_at_rest_has_the_bits_of_one_that_is_stepped() {
    for dims in [1, 2] {
        let quick = bank(dims);
        let passed_over = quick.rests.iter().filter(|x| x.is_finite()).count();
        assert_eq!(passed_over, if dims == 1 { 3 } else { 0 });
        let slow = Bank { quiet: -1.0, rests: vec![Real::NEG_INFINITY; 3], ..quick.clone() };
        let (quick, slow) = (trace(&quick), trace(&slow));
        assert!(quick == slow, "{dims} dimensions");
        assert!(quick.iter().any(|bits| *bits != 0));
    }
}

#[test]
fn an_ensemble_passed_over_though_it_fires_would_be_caught() {
    // The wrong variant: the resting level is too high.
    let right = bank(1);
    let wrong = Bank { rests: vec![0.5; 3], ..right.clone() };
    assert!(trace(&right) != trace(&wrong));
}

#[test]
fn spikes_come_at_the_rate_of_the_closed_form() {
    let bank = bank(1);
    let lif = Lif::default();
    let (mut state, mut out) = (vec![0.0; bank.state_of(3)], vec![0.0; 3]);
    let mut spikes = vec![0u32; 150];
    let (ticks, value) = (4_000, 0.6);
    for _ in 0..ticks {
        bank.step(0, (&[value; 3], 1.0), &mut state, &mut out);
        for (neuron, count) in spikes.iter_mut().enumerate() {
            *count += u32::from(bank.spiked(&state, neuron));
        }
    }
    let mut firing = 0;
    for (n, count) in spikes.iter().enumerate() {
        let at = n / 50 * bank.shape().padded() + n % 50;
        let current = bank.solved.encoders[at] * value + bank.solved.biases[at];
        let expected = lif.rate(f64::from(current)) * ticks as f64 * 1e-3;
        assert!((f64::from(*count) - expected).abs() <= 1.5, "{n}: {count} {expected}");
        firing += usize::from(*count > 20);
    }
    assert!(firing > 50, "{firing}");
}

/// Twenty-one ensembles of a few neurons that fire above 0.3: two whole groups and a part of one.
fn few_per_ensemble(neurons: usize) -> Bank {
    let lif = Lif::default();
    let shape = Shape { ensembles: 21, neurons, dims: 1, outputs: 1, hadamard: false };
    let draft = |_, seed: Seed| {
        let mut rng = seed.rng();
        let up = |_: &mut rand_chacha::ChaCha8Rng, out: &mut [f64]| out.fill(1.0);
        let drawn = Neurons::draw(&lif, (neurons, 1), 200.0..=400.0, &mut rng, up, |_| 0.3)?;
        let values: Vec<f64> = (0..100).map(|i| 0.3 + 0.007 * f64::from(i)).collect();
        let points = Points { wanted: vec![1.0; 100], values, outputs: 1 };
        Ok(Draft { neurons: drawn, radius: 1.0, points })
    };
    built(shape, draft)
}

/// Returns how often each neuron of the bank fires in 2 s, and the mean output of each ensemble.
fn fired(bank: &Bank) -> (Vec<u32>, Vec<Real>) {
    let count = bank.shape().neurons * 21;
    let (mut state, mut out) = (vec![0.0; bank.state_of(21)], vec![0.0; 21]);
    let (mut spikes, mut means) = (vec![0u32; count], vec![0.0; 21]);
    let values: Vec<Real> = (0..21).map(|i| 0.05 * i as Real + 0.02).collect();
    for _ in 0..2_000 {
        bank.step(0, (&values, 1.0), &mut state, &mut out);
        for (neuron, spikes) in spikes.iter_mut().enumerate() {
            *spikes += u32::from(bank.spiked(&state, neuron));
        }
        means.iter_mut().zip(&out).for_each(|(mean, out)| *mean += out / 2e3);
    }
    (spikes, means)
}

#[test]
fn few_neurons_fire_at_the_rate_of_the_closed_form_and_are_decoded_as_one() {
    let lif = Lif::default();
    for neurons in [1, 2, 4] {
        let bank = few_per_ensemble(neurons);
        assert_eq!(bank.state_of(21), 2 * 21 * neurons);
        let (spikes, means) = fired(&bank);
        for (neuron, spikes) in spikes.iter().enumerate() {
            let value = 0.05 * (neuron / neurons) as Real + 0.02;
            let current = bank.solved.encoders[neuron] * value + bank.solved.biases[neuron];
            let expected = 2.0 * lif.rate(f64::from(current));
            assert!((f64::from(*spikes) - expected).abs() <= 1.5, "{neuron}: {spikes} {expected}");
        }
        assert!(means[..6].iter().all(|mean| *mean == 0.0), "{means:?}");
        assert!(means[12..].iter().all(|mean| (mean - 1.0).abs() < 0.45), "{means:?}");
        // The wrong variant: neurons read the input of their neighbour.
        let mut wrong = bank.clone();
        let numbers = Arc::make_mut(&mut wrong.solved);
        numbers.encoders.rotate_left(1);
        numbers.biases[0] = 1.1;
        assert!(fired(&wrong).0 != spikes);
        // What rests is passed over without a change of bits.
        let slow = Bank { rests: vec![Real::NEG_INFINITY; 21], ..bank.clone() };
        assert_eq!(fired(&slow), (spikes, means));
    }
}
