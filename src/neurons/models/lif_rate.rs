//! Leaky integrate-and-fire neurons whose activity is their firing rate.

use serde::{Deserialize, Serialize};

use super::{Block, Firing, Lif, NeuronModel, Variable};
use crate::neurons::tuning::TuningError;
use crate::sim::Fingerprint;

/// The rates of [`Lif`] neurons: they have the tuning and decoding error of spiking neurons, but no spikes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct LifRate(pub Lif);

impl NeuronModel for LifRate {
    fn name(&self) -> &'static str {
        "rate"
    }

    fn check(&self, dt_s: f64) -> Result<(), TuningError> {
        self.0.check(dt_s)
    }

    fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
        self.0.gain_bias(max_rate, intercept)
    }

    fn onset(&self) -> f64 {
        1.0
    }

    fn rates(&self, currents: &mut [f64]) {
        self.0.rates(currents);
    }

    fn rates_single(&self, currents: &mut [f32]) {
        self.0.rates_single(currents);
    }

    fn state(&self) -> Vec<Variable> {
        Vec::new()
    }

    fires_its_rates!();

    fn rest_below(&self) -> f64 {
        1.0
    }

    /// The logarithm counts as one.
    fn operations(&self) -> u32 {
        7
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.0.add_to(hash.real(1.0));
    }
}
