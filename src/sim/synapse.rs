//! Edge filters: none, or a first-order low-pass with the input held over a tick.

use super::node::Real;
use super::time::SimDuration;

/// What an edge does to what flows along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Synapse {
    /// Nothing; the edge costs no tick.
    #[default]
    None,
    /// `y[k+1] = a y[k] + (1 - a) u[k]` with `a = exp(-dt / tau)` and `y[0] = 0`: the exact
    /// response of a first-order exponential synapse to an input held over each tick. The edge
    /// costs one tick.
    Lowpass {
        /// The time constant.
        tau: SimDuration,
    },
}

impl Synapse {
    /// A low-pass with time constant `tau` (zero is refused by `build`).
    pub const fn lowpass(tau: SimDuration) -> Self {
        Self::Lowpass { tau }
    }

    /// A low-pass with a time constant in whole milliseconds.
    pub const fn lowpass_ms(millis: u64) -> Self {
        Self::Lowpass { tau: SimDuration::from_millis(millis) }
    }

    /// The decay per tick of `dt_s` seconds, `None` without a filter.
    pub(crate) fn decay(self, dt_s: f64) -> Option<Real> {
        match self {
            Self::None => None,
            Self::Lowpass { tau } => Some((-dt_s / tau.as_secs_f64()).exp() as Real),
        }
    }
}

/// One step of the filter over a slice: `held = a held + (1 - a) input`.
#[inline]
pub(crate) fn latch(decay: Real, input: &[Real], held: &mut [Real]) {
    let gain = 1.0 - decay;
    for (y, u) in held.iter_mut().zip(input) {
        *y = decay * *y + gain * u;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_input_gives_the_closed_form() {
        let decay = Synapse::lowpass_ms(5).decay(0.001).unwrap_or_default();
        let mut held = [0.0f32];
        let mut worst = 0.0f64;
        for k in 1..=60 {
            latch(decay, &[2.0], &mut held);
            let exact = 2.0 * (1.0 - (-(k as f64) / 5.0).exp());
            worst = worst.max((f64::from(held[0]) - exact).abs());
        }
        assert!(held[0] > 1.9, "the filter moved");
        assert!(worst < 1e-6, "{worst}");
    }

    #[test]
    fn an_euler_step_would_be_caught() {
        // The wrong variant: a = 1 - dt/tau misses the closed form by far more than the tolerance.
        let mut held = [0.0f32];
        latch(1.0 - 1.0 / 5.0, &[2.0], &mut held);
        let exact = 2.0 * (1.0 - (-1.0f64 / 5.0).exp());
        assert!((f64::from(held[0]) - exact).abs() > 1e-2);
    }
}
