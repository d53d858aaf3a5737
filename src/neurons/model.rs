//! The leaky integrate-and-fire neuron: its rate, its gain and bias, and one exact step.
//!
//! The resting voltage is 0 and the threshold is 1. Currents are in the same unit, so a neuron fires at currents
//! above 1 (Eliasmith and Anderson, "Neural Engineering", 2003, chapter 4). Spike times are corrected within a
//! step (Shelley and Tao, "Efficient and accurate time-stepping schemes for integrate-and-fire neuronal networks",
//! 2001).

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// An invalid description of a population.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TuningError {
    /// A setting outside its range.
    #[error("`{name}` is {value}; expected {expected}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The value that was given.
        value: String,
        /// The values that are allowed.
        expected: String,
    },
    /// A decoder solve that failed.
    #[error("cannot solve for the decoders of {neurons} neurons; use a larger `regularisation`")]
    Unsolvable {
        /// Number of neurons in the ensemble.
        neurons: usize,
    },
}

pub(crate) fn refuse(
    name: &'static str,
    value: impl ToString,
    expected: impl ToString,
) -> TuningError {
    TuningError::Setting { name, value: value.to_string(), expected: expected.to_string() }
}

/// A leaky integrate-and-fire neuron with a refractory period (Eliasmith and Anderson, "Neural Engineering", 2003,
/// chapter 4).
///
/// The resting voltage is 0 and the threshold is 1; currents are in the same unit. By default the membrane time
/// constant is 20 ms and the refractory period 2 ms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lif {
    /// Membrane time constant, in seconds (above 0).
    pub tau_rc_s: f64,
    /// Refractory period, in seconds (at least 0).
    pub tau_ref_s: f64,
}

impl Default for Lif {
    fn default() -> Self {
        Self { tau_rc_s: 0.02, tau_ref_s: 0.002 }
    }
}

impl Lif {
    /// Checks the time constants.
    ///
    /// # Errors
    /// [`TuningError::Setting`] if a time constant is not finite or outside its range.
    pub fn check(&self) -> Result<(), TuningError> {
        if !(self.tau_rc_s.is_finite() && self.tau_rc_s > 0.0) {
            return Err(refuse("tau_rc_s", self.tau_rc_s, "a finite number of seconds above 0"));
        }
        if !(self.tau_ref_s.is_finite() && self.tau_ref_s >= 0.0) {
            return Err(refuse(
                "tau_ref_s",
                self.tau_ref_s,
                "a finite number of seconds, at least 0",
            ));
        }
        Ok(())
    }

    /// Returns the firing rate at the constant current J, in Hz. It is `1 / (tau_ref + tau_rc ln(1 + 1 / (J - 1)))`
    /// for J above 1, and otherwise 0.
    pub fn rate(&self, current: f64) -> f64 {
        if current > 1.0 {
            1.0 / (self.tau_ref_s + self.tau_rc_s * (1.0 / (current - 1.0)).ln_1p())
        } else {
            0.0
        }
    }

    /// Returns the gain and bias of a neuron with the given maximum rate (Hz) and intercept.
    ///
    /// Let x be the represented value along the encoder of the neuron, in units of the radius. The neuron begins to
    /// fire at x = `intercept` and fires at `max_rate` at x = 1. The current is `gain x + bias`.
    ///
    /// # Errors
    /// [`TuningError::Setting`] if `intercept` is outside [-1, 1), or if `max_rate` is outside 0 to `1 / tau_ref`,
    /// both limits excluded.
    pub fn gain_bias(&self, max_rate: f64, intercept: f64) -> Result<(f64, f64), TuningError> {
        if !(-1.0..1.0).contains(&intercept) {
            return Err(refuse("intercept", intercept, "at least -1 and below 1"));
        }
        let limit = if self.tau_ref_s > 0.0 { 1.0 / self.tau_ref_s } else { f64::INFINITY };
        if !(max_rate > 0.0 && max_rate < limit) {
            let expected = format!("above 0 and below the refractory limit of {limit} Hz");
            return Err(refuse("max_rate", max_rate, expected));
        }
        let most = 1.0 / -((self.tau_ref_s - 1.0 / max_rate) / self.tau_rc_s).exp_m1();
        let gain = (most - 1.0) / (1.0 - intercept);
        Ok((gain, 1.0 - gain * intercept))
    }

    /// Steps the neuron by `dt_s` seconds at a constant current, in double precision. Returns whether the neuron
    /// fires.
    ///
    /// `voltage` and `refractory_s` are the state of the neuron; start both at 0. `refractory_s` is the rest of the
    /// refractory period, in seconds. The refractory period begins at the moment of the spike within the step.
    pub fn step(&self, dt_s: f64, current: f64, voltage: &mut f64, refractory_s: &mut f64) -> bool {
        *refractory_s -= dt_s;
        let free_s = (dt_s - *refractory_s).clamp(0.0, dt_s);
        *voltage -= (current - *voltage) * (-free_s / self.tau_rc_s).exp_m1();
        if *voltage > 1.0 {
            let since = self.tau_rc_s * (-(*voltage - 1.0) / (current - 1.0)).ln_1p();
            *refractory_s = self.tau_ref_s + dt_s + since;
            *voltage = 0.0;
            return true;
        }
        *voltage = voltage.max(0.0);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gain_and_bias_give_the_rate_and_the_intercept_asked_for() {
        let lif = Lif::default();
        for (rate, intercept) in [(200.0, -1.0), (400.0, 0.9), (317.0, 0.0), (480.0, -0.3)] {
            let (gain, bias) = lif.gain_bias(rate, intercept).expect("possible");
            assert!((lif.rate(gain + bias) - rate).abs() < 1e-6 * rate);
            assert!((gain * intercept + bias - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn spikes_come_at_the_closed_forms_rate() {
        let lif = Lif::default();
        for current in [1.05, 1.5, 3.0, 10.0, 40.0] {
            for dt_s in [0.001, 0.0005, 0.0001] {
                let (mut voltage, mut refractory) = (0.0, 0.0);
                let steps = (4.0 / dt_s) as usize;
                let spikes = (0..steps)
                    .filter(|_| lif.step(dt_s, current, &mut voltage, &mut refractory))
                    .count();
                let expected = 4.0 * lif.rate(current);
                assert!(expected > 50.0);
                assert!(
                    (spikes as f64 - expected).abs() <= 1.5,
                    "{current} {dt_s}: {spikes} {expected}"
                );
            }
        }
    }

    #[test]
    fn without_the_moment_of_the_spike_the_rate_would_be_wrong() {
        // The wrong variant: the refractory period begins at the end of the step.
        let (lif, dt_s) = (Lif::default(), 0.001);
        let (mut voltage, mut refractory, mut spikes) = (0.0f64, 0.0, 0);
        for _ in 0..4_000 {
            let before = refractory;
            if lif.step(dt_s, 10.0, &mut voltage, &mut refractory) {
                spikes += 1;
                refractory = lif.tau_ref_s + dt_s;
            }
            let _ = before;
        }
        let expected = 4.0 * lif.rate(10.0);
        assert!((f64::from(spikes) - expected).abs() > 20.0, "{spikes} {expected}");
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let lif = Lif::default();
        for (rate, intercept) in [(500.0, 0.0), (0.0, 0.0), (-3.0, 0.0), (f64::NAN, 0.0)] {
            let error = lif.gain_bias(rate, intercept).expect_err("impossible").to_string();
            assert!(error.contains("`max_rate`") && error.contains("500 Hz"), "{error}");
        }
        for intercept in [1.0, -1.5, f64::NAN] {
            let error = lif.gain_bias(300.0, intercept).expect_err("impossible").to_string();
            assert!(error.contains("`intercept`"), "{error}");
        }
        assert!(Lif { tau_rc_s: -0.02, tau_ref_s: 0.002 }.check().is_err());
        assert!(Lif { tau_rc_s: 0.02, tau_ref_s: f64::NAN }.check().is_err());
    }
}
