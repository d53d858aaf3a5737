//! Rates of any neuron model in place of its spikes.

use std::sync::Arc;

use super::{Block, Firing, NeuronModel};
use crate::neurons::tuning::TuningError;
use crate::sim::Fingerprint;

/// Neurons whose activity is the rate that a model has at their current: its [`rates`](NeuronModel::rates), in single
/// precision. They have the tuning and decoding error of the model, without its spikes and without its state.
///
/// In place of a model without a formula of its rate, such as [`Izhikevich`](super::Izhikevich), its
/// [`rate_form`](NeuronModel::rate_form) is stepped, if that has no state: a table of rates. Gains, biases and decoders
/// are those of the model. A model that has neither is simulated for its rates in each tick.
///
/// ```
/// use symbolt::neurons::{Izhikevich, Population, RateOf, SpikingRectifiedLinear};
/// let mode = Population::neurons(RateOf::new(SpikingRectifiedLinear));
/// # let _ = mode;
/// ```
#[derive(Debug, Clone)]
pub struct RateOf {
    model: Arc<dyn NeuronModel>,
    /// What is stepped in place of the model's rates.
    stepped: Option<Arc<dyn NeuronModel>>,
}

impl RateOf {
    /// Makes neurons with the rates of `model`.
    pub fn new(model: impl NeuronModel) -> Self {
        let stepped = model.rate_form().filter(|form| form.state().is_empty());
        Self { model: Arc::new(model), stepped }
    }

    /// Returns the model whose rates these are.
    pub(super) fn of(&self) -> &dyn NeuronModel {
        &*self.model
    }

    /// Returns the model that stands for `model` in rate mode.
    pub(in crate::neurons) fn form(model: &Arc<dyn NeuronModel>) -> Arc<dyn NeuronModel> {
        if model.firing() == Firing::Rates {
            return model.clone();
        }
        let rates = || Arc::new(Self { model: model.clone(), stepped: None });
        model.rate_form().unwrap_or_else(|| rates())
    }
}

impl NeuronModel for RateOf {
    fn name(&self) -> &'static str {
        "rate of"
    }

    tuned_as!(this => this.model);

    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        self.model.check(dt_s)
    }

    fn firing(&self) -> Firing {
        Firing::Rates
    }

    #[inline(always)]
    fn step(&self, block: Block<'_>) {
        match &self.stepped {
            Some(form) => form.step(block),
            None => {
                block.activity.copy_from_slice(block.currents);
                self.model.rates_single(block.activity);
            }
        }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.model.fingerprint(hash.text(self.name()));
    }
}
