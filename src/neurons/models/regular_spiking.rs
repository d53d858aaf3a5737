//! Spikes at regular intervals, at the rates of any model.

use std::sync::Arc;

use super::{Block, Firing, NeuronModel, Start, Variable};
use crate::neurons::tuning::TuningError;
use crate::sim::Fingerprint;

/// Neurons that fire at regular intervals, at the rates of a model (Voelker et al., "A spike in performance: training
/// hybrid-spiking neural networks with quantized activation functions", 2020).
///
/// Each counts its rate times dt up, and fires at each whole number: of N ticks at the rate r it fires in
/// `floor(v0 + N r dt)`. It may fire several times in a tick; negative rates give negative spikes.
///
/// State: `voltages` (0 to 1 at the start) and `spikes of the tick`.
#[derive(Debug, Clone)]
pub struct RegularSpiking(Arc<dyn NeuronModel>);

impl RegularSpiking {
    /// Makes neurons that fire at the rates of `model`, its [`rates`](NeuronModel::rates). Its state has no part in it.
    pub fn new(model: impl NeuronModel) -> Self {
        Self(Arc::new(model))
    }
}

impl NeuronModel for RegularSpiking {
    fn name(&self) -> &'static str {
        "regular spiking"
    }

    tuned_as!(this => this.0);

    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        self.0.check(dt_s)
    }

    fn firing(&self) -> Firing {
        Firing::Spikes { trace: 1, above: 0.0 }
    }

    fn state(&self) -> Vec<Variable> {
        let voltages = Variable { name: "voltages", start: Start::Between(0.0, 1.0) };
        vec![voltages, Variable { name: "spikes of the tick", start: Start::At(0.0) }]
    }

    #[inline(always)]
    fn step(&self, block: Block<'_>) {
        let Block { dt_s, currents, state, activity, .. } = block;
        activity.copy_from_slice(currents);
        self.0.rates_single(activity);
        let (v, fired) = state.split_at_mut(currents.len());
        for ((v, fired), activity) in v.iter_mut().zip(fired).zip(activity) {
            let due = *v + *activity * dt_s;
            let spikes = due.floor();
            *v = due - spikes;
            (*fired, *activity) = (spikes.abs(), spikes);
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.0.fingerprint(hash.text(self.name()));
    }
}
