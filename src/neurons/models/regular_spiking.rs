//! Spikes at regular intervals, at the rates of any model.

use super::{Block, Firing, NeuronModel, SPIKES, VOLTAGES, Variable};
use crate::neurons::tuning::TuningError;
use crate::sim::Fingerprint;

spikes_from_rates! {
    /// Neurons that fire at regular intervals, at the rates of a model (Voelker et al., "A spike in performance:
    /// training hybrid-spiking neural networks with quantized activation functions", 2020).
    ///
    /// Each counts its rate times dt up, and fires at each whole number: of N ticks at the rate r it fires in
    /// `floor(v0 + N r dt)`. It may fire several times in a tick; negative rates give negative spikes.
    ///
    /// State: `voltages` (0 to 1 at the start) and `spikes of the tick`.
    RegularSpiking, "regular spiking", [VOLTAGES, SPIKES], spikes
}

/// Turns rates into spikes.
#[inline(always)]
fn spikes(block: Block<'_>) {
    let Block { dt_s, state, activity, .. } = block;
    let (v, fired) = state.split_at_mut(activity.len());
    for ((v, fired), activity) in v.iter_mut().zip(fired).zip(activity) {
        let due = *v + *activity * dt_s;
        let spikes = due.floor();
        *v = due - spikes;
        (*fired, *activity) = (spikes.abs(), spikes);
    }
}
