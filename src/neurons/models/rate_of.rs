//! Rates of any neuron model in place of its spikes.

use std::sync::Arc;

use super::{Block, Firing, NeuronModel};
use crate::neurons::tuning::TuningError;
use crate::sim::Fingerprint;

/// Neurons whose activity is the rate that a model has at their current: its [`rates`](NeuronModel::rates), in single
/// precision. They have the tuning and decoding error of the model, without its spikes and without its state.
///
/// A model without a formula of its rate, such as [`Izhikevich`](super::Izhikevich), simulates a second of every neuron in
/// each tick: over a thousand times as long as LIF.
///
/// ```
/// use symbolt::neurons::{Izhikevich, Population, RateOf, SpikingRectifiedLinear};
/// let mode = Population::neurons(RateOf::new(SpikingRectifiedLinear));
/// # let _ = mode;
/// ```
#[derive(Debug, Clone)]
pub struct RateOf(Arc<dyn NeuronModel>);

impl RateOf {
    /// Makes neurons with the rates of `model`.
    pub fn new(model: impl NeuronModel) -> Self {
        Self(Arc::new(model))
    }

    /// Returns the model that stands for `model` in rate mode.
    pub(in crate::neurons) fn form(model: &Arc<dyn NeuronModel>) -> Arc<dyn NeuronModel> {
        if model.firing() == Firing::Rates {
            return model.clone();
        }
        model.rate_form().unwrap_or_else(|| Arc::new(Self(model.clone())))
    }
}

impl NeuronModel for RateOf {
    fn name(&self) -> &'static str {
        "rate of"
    }

    tuned_as!(this => this.0);

    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        self.0.check(dt_s)
    }

    fires_its_rates!();

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.0.fingerprint(hash.text(self.name()));
    }
}
