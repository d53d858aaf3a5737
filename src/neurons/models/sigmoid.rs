//! Neurons whose rate is a sigmoid of their current.

use serde::{Deserialize, Serialize};

use super::series::{exp, replace};
use super::{Block, Firing, NeuronModel, below_limit, check_seconds, line};
use crate::neurons::tuning::TuningError;
use crate::sim::Fingerprint;

/// A neuron whose rate is a sigmoid of its current: `(1 / tau_ref) / (1 + exp(-J))`. It keeps no state and never falls
/// silent, so it cannot stand behind a gate.
///
/// Its intercept is the value of the inflection, where the rate is half of the greatest. A maximum rate of half of the
/// greatest gives the gain 0, and one below a negative gain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sigmoid {
    /// Inverse of the greatest rate, in seconds (above 0). Maximum rates lie below `1 / tau_ref`. Default: 0.0025.
    pub tau_ref_s: f64,
}

impl Default for Sigmoid {
    fn default() -> Self {
        Self { tau_ref_s: 0.0025 }
    }
}

/// Returns the rate as a function of the current, with a relative error of about 1e-6.
#[inline(always)]
fn rate(tau_ref_s: f64) -> impl Fn(f32) -> f32 {
    let most = (1.0 / tau_ref_s) as f32;
    move |current| most / (1.0 + exp(-current))
}

impl NeuronModel for Sigmoid {
    fn name(&self) -> &'static str {
        "sigmoid"
    }

    fn check(&self, _dt_s: f64) -> Result<(), TuningError> {
        check_seconds("tau_ref_s", self.tau_ref_s)
    }

    fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
        below_limit(max_rate, 1.0 / self.tau_ref_s)?;
        let most = -(1.0 / (self.tau_ref_s * max_rate) - 1.0).ln();
        line(most, 0.0, intercept)
    }

    fn onset(&self) -> f64 {
        0.0
    }

    fn rates(&self, currents: &mut [f64]) {
        let most = 1.0 / self.tau_ref_s;
        currents.iter_mut().for_each(|current| *current = most / (1.0 + (-*current).exp()));
    }

    fn rates_single(&self, currents: &mut [f32]) {
        replace(currents, rate(self.tau_ref_s));
    }

    fires_its_rates!();

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name()).real(self.tau_ref_s);
    }
}
