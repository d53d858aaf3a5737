//! Spikes of a Poisson process, at the rates of any model.

use super::series::exp;
use super::{Block, Draws, Firing, NeuronModel, SPIKES, Variable};
use crate::neurons::tuning::TuningError;
use crate::sim::{Fingerprint, Real};

spikes_from_rates! {
    /// Neurons that fire like a Poisson process, at the rates of a model: the number of spikes in a tick is Poisson
    /// distributed, and its mean and variance are rate times dt. Negative rates give negative spikes.
    ///
    /// State: `spikes of the tick`.
    PoissonSpiking, "poisson spiking", [SPIKES], spikes
}

/// Greatest mean that one draw covers.
const MOST: f64 = 16.0;
/// Mean from which the number is drawn from the normal distribution, to which that of Poisson has come near.
const MANY: f64 = 1e5;

/// Draws a Poisson number of any mean, in double precision.
#[cold]
fn drawn(mean: Real, neuron: usize, draws: &Draws) -> Real {
    let mean = f64::from(mean);
    if mean >= MANY {
        let [one, other] = [0, 1].map(|part| f64::from(draws.uniform(neuron, part)));
        let normal = (-2.0 * (1.0 - one).ln()).sqrt() * (std::f64::consts::TAU * other).cos();
        return (mean + mean.sqrt() * normal).round() as Real;
    }
    let parts = (mean / MOST).ceil().max(1.0);
    let mean = mean / parts;
    let mut count = 0.0;
    for part in 0..parts as u32 {
        let uniform = f64::from(draws.uniform(neuron, part));
        let (mut k, mut term) = (0.0, (-mean).exp());
        let mut below = term;
        while uniform >= below && k < 100.0 {
            k += 1.0;
            term *= mean / k;
            below += term;
        }
        count += k;
    }
    count as Real
}

/// Turns rates into spikes.
#[inline(always)]
fn spikes(block: Block<'_>) {
    let Block { dt_s, state: fired, activity, draws, .. } = block;
    // The inverse of the distribution function, up to 4 without branches. `exp` goes no further than 87, where that is all but 0.
    for (neuron, (fired, activity)) in fired.iter_mut().zip(activity.iter()).enumerate() {
        let (mean, uniform) = ((activity.abs() * dt_s).min(87.0), draws.uniform(neuron, 0));
        let mut term = exp(-mean);
        let (mut below, mut count) = (term, 0.0);
        for part in [1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0] {
            count += if uniform < below { 0.0 } else { 1.0 };
            term *= mean * part;
            below += term;
        }
        *fired = if uniform < below { count } else { 5.0 };
    }
    for (neuron, (fired, activity)) in fired.iter_mut().zip(activity).enumerate() {
        let mean = activity.abs() * dt_s;
        if *fired > 4.0 {
            *fired = drawn(mean, neuron, &draws);
        }
        *activity = fired.copysign(*activity);
    }
}
