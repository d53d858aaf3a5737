//! Rectified linear neurons: rates, and spikes at these rates.

use serde::{Deserialize, Serialize};

use super::{Block, Firing, NeuronModel, SPIKES, VOLTAGES, Variable, below_limit, line};
use crate::neurons::tuning::TuningError;
use crate::sim::{Fingerprint, Real};

/// A neuron whose rate is its current, or 0 below 0, in Hz. It keeps no state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct RectifiedLinear;

/// A [`RectifiedLinear`] neuron that spikes: it counts `J dt` up and fires at each whole number (Voelker et al., "A
/// spike in performance: training hybrid-spiking neural networks with quantized activation functions", 2020). It may
/// fire several times in a tick.
///
/// State: `voltages` (0 to 1 at the start) and `spikes of the tick`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SpikingRectifiedLinear;

/// The current of the positive part of a number.
#[inline(always)]
fn rectified(current: f32) -> f32 {
    if current > 0.0 { current } else { 0.0 }
}

impl NeuronModel for RectifiedLinear {
    fn name(&self) -> &'static str {
        "rectified linear"
    }

    fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
        below_limit(max_rate, f64::INFINITY)?;
        line(max_rate, 0.0, intercept)
    }

    fn onset(&self) -> f64 {
        0.0
    }

    fn rates(&self, currents: &mut [f64]) {
        currents.iter_mut().for_each(|current| *current = current.max(0.0));
    }

    fn rates_single(&self, currents: &mut [f32]) {
        currents.iter_mut().for_each(|current| *current = rectified(*current));
    }

    fires_its_rates!();

    fn rest_below(&self) -> f64 {
        0.0
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name());
    }
}

impl NeuronModel for SpikingRectifiedLinear {
    fn name(&self) -> &'static str {
        "spiking rectified linear"
    }

    tuned_as!(_this => RectifiedLinear);

    fn firing(&self) -> Firing {
        Firing::Spikes { trace: 1, above: 0.0 }
    }

    fn state(&self) -> Vec<Variable> {
        vec![VOLTAGES, SPIKES]
    }

    #[inline(always)]
    fn step(&self, block: Block<'_>) {
        let Block { dt_s, currents, state, activity, .. } = block;
        let (v, fired) = state.split_at_mut(currents.len());
        let neurons = v.iter_mut().zip(fired).zip(currents.iter().zip(activity));
        for ((v, fired), (current, activity)) in neurons {
            let due: Real = *v + rectified(*current) * dt_s;
            let spikes = due.floor();
            *v = due - spikes;
            (*fired, *activity) = (spikes, spikes);
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name());
    }
}
