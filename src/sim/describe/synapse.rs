//! Synapses: the filters of connections.

use crate::sim::real::Real;
use crate::sim::time::SimDuration;

/// The filter of a connection: none, or a first-order low-pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Synapse {
    /// No filter. The value arrives in the same tick.
    #[default]
    None,
    /// A first-order low-pass filter, which also delays the value by one tick.
    ///
    /// With input `u`, output `y` and tick `dt` it computes `y[k+1] = a y[k] + (1 - a) u[k]`, where
    /// `a = exp(-dt / tau)` and `y[0] = 0`. This is the exact response of an exponential synapse to an input that is
    /// constant during each tick.
    Lowpass {
        /// Time constant, more than zero.
        tau: SimDuration,
    },
}

impl Synapse {
    /// Creates a low-pass with time constant `tau`. `build` reports a time constant of zero.
    pub const fn lowpass(tau: SimDuration) -> Self {
        Self::Lowpass { tau }
    }

    /// Creates a low-pass with a time constant of `millis` milliseconds. `build` reports a time constant of zero.
    pub const fn lowpass_ms(millis: u64) -> Self {
        Self::Lowpass { tau: SimDuration::from_millis(millis) }
    }

    /// Returns the decay factor for a tick of `dt_s` seconds, or `None` without a filter.
    pub(crate) fn decay(self, dt_s: f64) -> Option<Real> {
        match self {
            Self::None => None,
            Self::Lowpass { tau } => Some(lowpass_decay(tau, dt_s)),
        }
    }
}

/// Returns the decay factor of a low-pass with time constant `tau` for a tick of `dt_s` seconds.
pub(crate) fn lowpass_decay(tau: SimDuration, dt_s: f64) -> Real {
    (-dt_s / tau.as_secs_f64()).exp() as Real
}

/// Filters set magnitudes below this bound to zero. It is 2^-63, the square root of the smallest normal number.
///
/// Without the bound, a filter without input would decay to a subnormal number and stay there, because rounding undoes
/// the last steps. Computing with subnormal numbers is much slower on many processors. Above the bound, even the
/// product of two filtered values is a normal number. The bound is 12 orders of magnitude below the rounding error of
/// a signal of order 1.
const NEGLIGIBLE: Real = 1.0 / (1u64 << 63) as Real;

/// Returns the next value of a first-order low-pass, `a y + (1 - a) u`, or zero if its magnitude is below 2^-63 (about
/// 1.1e-19). Infinite values and values that are not a number pass through.
#[inline]
pub(crate) fn decayed(decay: Real, y: Real, u: Real) -> Real {
    let next = decay * y + (1.0 - decay) * u;
    if next.abs() < NEGLIGIBLE { 0.0 } else { next }
}

/// Advances the low-pass filters in `held` by one step.
#[inline]
pub(crate) fn latch(decay: Real, input: &[Real], held: &mut [Real]) {
    for (y, u) in held.iter_mut().zip(input) {
        *y = decayed(decay, *y, *u);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_input_gives_the_closed_form() {
        let decay = lowpass_decay(SimDuration::from_millis(5), 0.001);
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
    fn a_filter_without_input_reaches_zero_and_is_never_subnormal() {
        for millis in [1, 5, 100, 1000] {
            let decay = lowpass_decay(SimDuration::from_millis(millis), 0.001);
            // The last input is subnormal and would keep its filter subnormal.
            let mut held = [1.0f32, -1.0, 1e-3, Real::MAX, 1e-40];
            let input = [0.0, 0.0, 0.0, 0.0, 1e-40];
            // ln(3.4e38 / 1.1e-19) = 132 time constants.
            let mut ticks = 0;
            while held.iter().any(|v| *v != 0.0) && ticks < 135 * millis {
                latch(decay, &input, &mut held);
                let small = held.iter().any(|v| v.is_subnormal() || (v * v).is_subnormal());
                assert!(!small, "{held:?} in tick {ticks}");
                ticks += 1;
            }
            assert_eq!(held, [0.0; 5], "{millis} ms");
        }
    }

    #[test]
    fn values_that_are_not_finite_are_not_hidden() {
        let mut held = [0.0, 0.0];
        latch(0.5, &[Real::NAN, Real::INFINITY], &mut held);
        assert!(held[0].is_nan() && held[1] == Real::INFINITY);
    }

    #[test]
    fn an_euler_step_would_be_caught() {
        // With a = 1 - dt/tau the error is far above the tolerance.
        let mut held = [0.0f32];
        latch(1.0 - 1.0 / 5.0, &[2.0], &mut held);
        let exact = 2.0 * (1.0 - (-1.0f64 / 5.0).exp());
        assert!((f64::from(held[0]) - exact).abs() > 1e-2);
    }
}
