//! Random spikes with the least variance, at the rates of any model.

use std::sync::Arc;

use super::{Block, Firing, NeuronModel, Start, Variable};
use crate::neurons::tuning::TuningError;
use crate::sim::Fingerprint;

/// Neurons that fire at random, at the rates of a model. A tick has the whole part of rate times dt as spikes, and one more with the
/// probability of the fractional part f: the variance in a tick is `f (1 - f)`. Negative rates give negative spikes.
///
/// State: `spikes of the tick`.
#[derive(Debug, Clone)]
pub struct StochasticSpiking(Arc<dyn NeuronModel>);

impl StochasticSpiking {
    /// Makes neurons that fire at the rates of `model`, its [`rates`](NeuronModel::rates). Its state has no part in it.
    pub fn new(model: impl NeuronModel) -> Self {
        Self(Arc::new(model))
    }
}

impl NeuronModel for StochasticSpiking {
    fn name(&self) -> &'static str {
        "stochastic spiking"
    }

    tuned_as!(this => this.0);

    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        self.0.check(dt_s)
    }

    fn firing(&self) -> Firing {
        Firing::Spikes { trace: 0, above: 0.0 }
    }

    fn state(&self) -> Vec<Variable> {
        vec![Variable { name: "spikes of the tick", start: Start::At(0.0) }]
    }

    #[inline(always)]
    fn step(&self, block: Block<'_>) {
        let Block { dt_s, currents, state: fired, activity, draws, .. } = block;
        activity.copy_from_slice(currents);
        self.0.rates_single(activity);
        for (neuron, (fired, activity)) in fired.iter_mut().zip(activity).enumerate() {
            let due = activity.abs() * dt_s;
            let whole = due.floor();
            let more = if draws.uniform(neuron, 0) < due - whole { 1.0 } else { 0.0 };
            *fired = whole + more;
            *activity = fired.copysign(*activity);
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.0.fingerprint(hash.text(self.name()));
    }
}
