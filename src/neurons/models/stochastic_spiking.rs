//! Random spikes with the least variance, at the rates of any model.

use super::{Block, Firing, NeuronModel, SPIKES, Variable};
use crate::neurons::tuning::TuningError;
use crate::sim::Fingerprint;

spikes_from_rates! {
    /// Neurons that fire at random, at the rates of a model. A tick has the whole part of rate times dt as spikes, and
    /// one more with the probability of the fractional part f: the variance in a tick is `f (1 - f)`. Negative rates
    /// give negative spikes.
    ///
    /// State: `spikes of the tick`.
    StochasticSpiking, "stochastic spiking", [SPIKES], spikes
}

/// Turns rates into spikes.
#[inline(always)]
fn spikes(block: Block<'_>) {
    let Block { dt_s, state: fired, activity, draws, .. } = block;
    for (neuron, (fired, activity)) in fired.iter_mut().zip(activity).enumerate() {
        let due = activity.abs() * dt_s;
        let whole = due.floor();
        let more = if draws.uniform(neuron, 0) < due - whole { 1.0 } else { 0.0 };
        *fired = whole + more;
        *activity = fired.copysign(*activity);
    }
}
