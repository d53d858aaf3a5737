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
            Self::Lowpass { tau } => Some(lowpass_decay(tau, dt_s)),
        }
    }
}

/// The decay per tick of `dt_s` seconds of a low-pass with time constant `tau`.
pub(crate) fn lowpass_decay(tau: SimDuration, dt_s: f64) -> Real {
    (-dt_s / tau.as_secs_f64()).exp() as Real
}

/// Magnitudes below this are set to zero in filters: the square root of the least normal number, 2^-63.
///
/// A filter without input would decay to a subnormal number and stay there, since rounding undoes the last
/// steps, and many processors compute with subnormal numbers many times more slowly. Above this bound the product of
/// any two filtered values is a normal number too. It lies 12 orders of magnitude below the rounding of a
/// signal of order 1.
const NEGLIGIBLE: Real = 1.0 / (1u64 << 63) as Real;

/// One step of a first-order low-pass: `a y + (1 - a) u`, and exactly zero once that is below 1e-19.
/// Values that are not finite pass through.
#[inline]
pub(crate) fn decayed(decay: Real, y: Real, u: Real) -> Real {
    let next = decay * y + (1.0 - decay) * u;
    if next.abs() < NEGLIGIBLE { 0.0 } else { next }
}

/// One step of the filter over a slice.
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
            // The last is a subnormal input, which would be held as one.
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
        // The wrong variant: a = 1 - dt/tau misses the closed form by far more than the tolerance.
        let mut held = [0.0f32];
        latch(1.0 - 1.0 / 5.0, &[2.0], &mut held);
        let exact = 2.0 * (1.0 - (-1.0f64 / 5.0).exp());
        assert!((f64::from(held[0]) - exact).abs() > 1e-2);
    }
}
