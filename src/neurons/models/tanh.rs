//! Neurons whose rate is the hyperbolic tangent of their current.

use serde::{Deserialize, Serialize};

use super::series::{exp, replace};
use super::{Block, Firing, NeuronModel, below_limit, check_seconds, line};
use crate::neurons::tuning::TuningError;
use crate::sim::Fingerprint;

/// A neuron whose rate is the hyperbolic tangent of its current: `(1 / tau_ref) tanh(J)`. The rate is negative for
/// currents below 0. The neuron keeps no state and never falls silent, so it cannot stand behind a gate.
///
/// Its intercept is the value at which the rate is 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tanh {
    /// Inverse of the greatest rate, in seconds (above 0). Maximum rates lie below `1 / tau_ref`. Default: 0.0025.
    pub tau_ref_s: f64,
}

impl Default for Tanh {
    fn default() -> Self {
        Self { tau_ref_s: 0.0025 }
    }
}

/// Returns the rate as a function of the current, with a relative error of about 1e-6.
#[inline(always)]
fn rate(tau_ref_s: f64) -> impl Fn(f32) -> f32 {
    let most = (1.0 / tau_ref_s) as f32;
    move |current| {
        let power = exp(-2.0 * current.abs());
        // Near 0 the quotient loses digits that the series keeps.
        let square = current * current;
        let small = current.abs() * (1.0 - square * (1.0 / 3.0 - square * (2.0 / 15.0)));
        let large = (1.0 - power) / (1.0 + power);
        (most * if square < 0.01 { small } else { large }).copysign(current)
    }
}

impl NeuronModel for Tanh {
    fn name(&self) -> &'static str {
        "tanh"
    }

    fn check(&self, _dt_s: f64) -> Result<(), TuningError> {
        check_seconds("tau_ref_s", self.tau_ref_s)
    }

    fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
        below_limit(max_rate, 1.0 / self.tau_ref_s)?;
        let most = (max_rate * self.tau_ref_s).atanh();
        line(most, 0.0, intercept)
    }

    fn onset(&self) -> f64 {
        0.0
    }

    fn rates(&self, currents: &mut [f64]) {
        let most = 1.0 / self.tau_ref_s;
        currents.iter_mut().for_each(|current| *current = most * current.tanh());
    }

    fn rates_single(&self, currents: &mut [f32]) {
        replace(currents, rate(self.tau_ref_s));
    }

    fires_its_rates!();

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name()).real(self.tau_ref_s);
    }
}
