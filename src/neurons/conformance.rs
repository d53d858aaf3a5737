//! Compares spikes and outputs with those that Nengo computes from the same parameters and inputs.
//!
//! `tests/conformance/fixtures.py` wrote the fixtures with Nengo 4.1. Each fixture runs two ensembles in a row, joined
//! by a synapse, for one second. In double precision every spike falls in the same tick as in Nengo. The hot loop uses
//! single precision, with series for logarithm and exponential. There at most one spike in ten thousand falls one tick
//! earlier or later.

use std::path::Path;
use std::sync::Arc;

use ndarray::{Array2, Ix1, Ix2};

use super::bank::{Bank, LaidOut, Shape, Solved};
use super::draw::Neurons;
use super::models::Lif;
use crate::files::npz::NpzReader;
use crate::sim::{Real, SimDuration, lowpass_decay};

const DT_S: f64 = 0.001;
const TICKS: usize = 1_000;

/// Parameters of an ensemble, its decoders (one row per neuron) and its spikes (one row per tick).
struct Population {
    neurons: Neurons,
    decoders: Vec<f64>,
    outputs: usize,
    spikes: Array2<u8>,
}

struct Fixture {
    populations: [Population; 2],
    input: Array2<f64>,
    /// Input of the second ensemble: the output of the first, filtered by the synapse.
    middle: Array2<f64>,
    output: Array2<f64>,
}

fn fixture(name: &str) -> Fixture {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/conformance");
    let bytes = std::fs::read(folder.join(format!("{name}.npz"))).expect("a fixture");
    let mut npz = NpzReader::new(&bytes).expect("arrays");
    let mut matrix = |key: &str| npz.read::<f64, Ix2>(key).expect("a matrix of doubles");
    let (input, middle, output) = (matrix("input"), matrix("middle"), matrix("output"));
    let populations = ["first", "second"].map(|place| {
        let encoders = npz.read::<f64, Ix2>(&format!("{place}_encoders")).expect("");
        let decoders = npz.read::<f64, Ix2>(&format!("{place}_decoders")).expect("");
        let mut vector = |key: &str| -> Vec<f64> {
            npz.read::<f64, Ix1>(&format!("{place}_{key}")).expect("a vector").to_vec()
        };
        let neurons = Neurons {
            dims: encoders.ncols(),
            encoders: encoders.iter().copied().collect(),
            gains: vector("gains"),
            biases: vector("biases"),
        };
        Population {
            neurons,
            outputs: decoders.nrows(),
            decoders: decoders.t().iter().copied().collect(),
            spikes: npz.read::<u8, Ix2>(&format!("{place}_spikes")).expect("spikes"),
        }
    });
    Fixture { populations, input, middle, output }
}

/// One ensemble, stepped in double precision.
struct Exact<'a> {
    population: &'a Population,
    voltages: Vec<f64>,
    refractory: Vec<f64>,
}

impl<'a> Exact<'a> {
    fn new(population: &'a Population) -> Self {
        let count = population.neurons.count();
        Self { population, voltages: vec![0.0; count], refractory: vec![0.0; count] }
    }

    /// Steps by one tick. Returns which neurons fired and the decoded value.
    fn step(&mut self, value: &[f64]) -> (Vec<bool>, Vec<f64>) {
        let Population { neurons, decoders, outputs, .. } = self.population;
        let (lif, mut out) = (Lif::default(), vec![0.0; *outputs]);
        let mut fired = Vec::new();
        for neuron in 0..neurons.count() {
            let encoder = &neurons.encoders[neuron * neurons.dims..][..neurons.dims];
            let along: f64 = encoder.iter().zip(value).map(|(e, v)| e * v).sum();
            let current = neurons.gains[neuron] * along + neurons.biases[neuron];
            let (v, r) = (&mut self.voltages[neuron], &mut self.refractory[neuron]);
            fired.push(lif.step_exactly(DT_S, current, v, r));
            if fired[neuron] {
                let row = &decoders[neuron * outputs..][..*outputs];
                out.iter_mut().zip(row).for_each(|(out, d)| *out += d / DT_S);
            }
        }
        (fired, out)
    }
}

/// The same ensemble as a bank.
fn bank(population: &Population, lif: Lif) -> Bank {
    let Population { neurons, decoders, outputs, .. } = population;
    let (count, dims) = (neurons.count(), neurons.dims);
    let shape = Shape { ensembles: 1, neurons: count, dims, outputs: *outputs, hadamard: false };
    let ensemble = LaidOut::lay_out((neurons, 1.0), decoders, (&lif, DT_S), shape);
    Bank::new(Arc::new(Solved::assemble(shape, &[ensemble])), Arc::new(lif), DT_S)
}

const FIXTURES: [&str; 3] = ["scalar", "square", "pointer_part"];

#[test]
fn in_double_precision_every_spike_is_nengos() {
    let decay = (-DT_S / 0.005f64).exp();
    for name in FIXTURES {
        let Fixture { populations, input, middle, output } = fixture(name);
        let mut both = populations.each_ref().map(Exact::new);
        let mut held = vec![0.0; middle.ncols()];
        let (mut spikes, mut worst) = (0, 0.0f64);
        for tick in 0..TICKS {
            let given = input.row(tick).to_vec();
            let (first, said) = both[0].step(&given);
            for (held, nengo) in held.iter().zip(middle.row(tick)) {
                worst = worst.max((held - nengo).abs());
            }
            let (second, out) = both[1].step(&held);
            for (out, nengo) in out.iter().zip(output.row(tick)) {
                worst = worst.max((out - nengo).abs());
            }
            for (place, fired) in [first, second].iter().enumerate() {
                for (neuron, fired) in fired.iter().enumerate() {
                    let nengo = populations[place].spikes[(tick, neuron)] == 1;
                    assert_eq!(*fired, nengo, "{name}: tick {tick}, {place}, neuron {neuron}");
                    spikes += usize::from(nengo);
                }
            }
            for (held, said) in held.iter_mut().zip(said) {
                *held = decay * *held + (1.0 - decay) * said;
            }
        }
        assert!(spikes > 20_000, "{name}: {spikes}");
        assert!(worst < 1e-9, "{name}: {worst}");
    }
}

/// Ticks in which each neuron fires.
fn times(fired: &Array2<u8>) -> Vec<Vec<usize>> {
    let train = |column: ndarray::ArrayView1<'_, u8>| -> Vec<usize> {
        (0..TICKS).filter(|tick| column[*tick] == 1).collect()
    };
    fired.columns().into_iter().map(train).collect()
}

/// Spikes that fall one tick earlier or later, as (neuron, our tick, Nengo's tick). Panics at any larger difference.
fn shifts(ours: &Array2<u8>, theirs: &Array2<u8>) -> Vec<(usize, usize, usize)> {
    let mut all = Vec::new();
    for (neuron, (a, b)) in times(ours).iter().zip(times(theirs)).enumerate() {
        // A spike due in the last tick can fall past the end.
        assert!(a.len().abs_diff(b.len()) <= 1, "neuron {neuron}: {} and {}", a.len(), b.len());
        for (a, b) in a.iter().zip(b) {
            assert!(a.abs_diff(b) <= 1, "neuron {neuron}: tick {a} instead of {b}");
            if *a != b {
                all.push((neuron, *a, b));
            }
        }
    }
    all
}

/// Runs a fixture in banks of neurons.
fn in_banks(fixture: &Fixture, lif: Lif) -> ([Array2<u8>; 2], [Array2<f64>; 2]) {
    let decay = lowpass_decay(SimDuration::from_millis(5), DT_S);
    let banks = fixture.populations.each_ref().map(|population| bank(population, lif));
    let mut states = banks.each_ref().map(|bank| vec![0.0 as Real; bank.state_of(1)]);
    let mut held = vec![0.0 as Real; fixture.middle.ncols()];
    let mut said = held.clone();
    let mut out = vec![0.0; fixture.output.ncols()];
    let mut spikes = fixture.populations.each_ref().map(|p| Array2::zeros(p.spikes.dim()));
    let mut values = [Array2::zeros(fixture.middle.dim()), Array2::zeros(fixture.output.dim())];
    for tick in 0..TICKS {
        let given: Vec<Real> = fixture.input.row(tick).iter().map(|v| *v as Real).collect();
        banks[0].step(0, (&given, 1.0), &mut states[0], &mut said);
        banks[1].step(0, (&held, 1.0), &mut states[1], &mut out);
        for (values, now) in values.iter_mut().zip([&held, &out]) {
            for (value, now) in values.row_mut(tick).iter_mut().zip(now) {
                *value = f64::from(*now);
            }
        }
        for ((spikes, bank), state) in spikes.iter_mut().zip(&banks).zip(&states) {
            for (neuron, fired) in spikes.row_mut(tick).iter_mut().enumerate() {
                *fired = u8::from(bank.spiked(state, neuron));
            }
        }
        for (held, said) in held.iter_mut().zip(&said) {
            *held = decay * *held + (1.0 - decay) * said;
        }
    }
    (spikes, values)
}

#[test]
fn in_the_hot_loop_at_most_one_spike_in_ten_thousand_shifts() {
    let (mut all, mut moved) = (0, 0);
    for name in FIXTURES {
        let fixture = fixture(name);
        let (spikes, values) = in_banks(&fixture, Lif::default());
        let mut first_shift = TICKS;
        for (place, spikes) in spikes.iter().enumerate() {
            let theirs = &fixture.populations[place].spikes;
            all += theirs.iter().filter(|s| **s == 1).count();
            for (neuron, here, there) in shifts(spikes, theirs) {
                println!(
                    "{name}, {place}: neuron {neuron} fires in tick {here} instead of {there}"
                );
                first_shift = first_shift.min(here.min(there));
                moved += 1;
            }
        }
        for (ours, theirs) in values.iter().zip([&fixture.middle, &fixture.output]) {
            let (mut off, mut size) = (0.0, 0.0);
            for ((tick, at), ours) in ours.indexed_iter() {
                let theirs = theirs[(tick, at)];
                if tick < first_shift {
                    let scale = theirs.abs().max(1.0);
                    assert!((ours - theirs).abs() < 1e-5 * scale, "{name}: {ours} {theirs}");
                } else {
                    off += (ours - theirs).powi(2);
                    size += theirs * theirs;
                }
            }
            assert!(off <= 1e-4 * size, "{name}: {off} {size}");
        }
    }
    println!("{moved} of {all} spikes moved");
    assert!(all > 60_000 && moved * 10_000 <= all, "{moved} of {all}");
}

#[test]
fn a_refractory_period_a_tenth_too_long_would_be_caught() {
    // The wrong variant: so many spikes are late that the spike trains no longer match one to one.
    let fixture = fixture("scalar");
    let (spikes, _) = in_banks(&fixture, Lif { tau_ref_s: 0.0022, ..Lif::default() });
    let count = |spikes: &Array2<u8>| spikes.iter().filter(|s| **s == 1).count();
    let (ours, theirs) = (count(&spikes[0]), count(&fixture.populations[0].spikes));
    assert!(ours + 100 < theirs, "{ours} {theirs}");
}
