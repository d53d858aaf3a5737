//! Synapses: the filters of connections and probes, as a graph describes them.

use std::fmt;

use super::fingerprint::Fingerprint;
use crate::sim::time::SimDuration;

/// Greatest order of a [`Synapse::Linear`].
pub(crate) const MAX_ORDER: usize = 8;

/// The filter of a connection or of a probe.
///
/// A filter is the exact response to an input that is constant during each tick (zero-order hold). It starts at zero, and
/// its output in a tick includes the input of that tick. A connection hands the output on in the next tick: every synapse
/// but [`None`](Self::None) delays the value by this one tick. A probe ([`ProbeSpec`](crate::sim::ProbeSpec)) and a
/// [`Filter`](crate::sim::Filter) show the output in its own tick. In a [`Delay`](Self::Delay) the tick of the connection
/// counts.
///
/// | synapse | transfer function | unit gain | cost per component and tick |
/// |---|---|---|---|
/// | `Lowpass` | `1 / (tau s + 1)` | yes | 0.1 ns |
/// | `Alpha` | `1 / (tau s + 1)^2` | yes | a few ns |
/// | `DoubleExponential` | `1 / ((rise s + 1) (decay s + 1))` | yes | a few ns |
/// | `Triangle` | a finite ramp | yes | one product per tick of its length |
/// | `Delay` | `exp(-length s)` | yes | two copies |
/// | `Linear` | any proper rational function | as given | order^2 products |
///
/// All but the low-pass compute in double precision; their outputs are right to single precision, whatever the time
/// constants. The low-pass computes in single precision: its error grows with the ticks of a time constant, from about 1e-7 of the
/// signal for 5 to 4e-6 for 1,000 and 5e-4 for 100,000.
/// Where that matters, `Synapse::linear(&[1.0], &[tau, 1.0])` is the same filter in double precision. Outputs below 2^-63
/// are set to zero.
///
/// `build` reports times of zero and all that [`SynapseError`](crate::sim::SynapseError) names.
///
/// ```
/// use symbolt::prelude::*;
/// let mut graph = GraphBuilder::new();
/// let one = graph.add("one", Constant::scalar(1.0));
/// let slow = graph.add("slow", Add::scalar());
/// graph.route((&one >> &slow).via(Synapse::alpha_ms(5)));
/// let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
/// sim.run_for(SimDuration::from_millis(11))?;
/// // 1 - (1 + k dt / tau) exp(-k dt / tau) for k = 10, one tick late.
/// assert!((sim.value(&slow.output)[0] - 0.593994).abs() < 1e-6);
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Synapse {
    /// No filter. The value arrives in the same tick.
    #[default]
    None,
    /// A first-order low-pass filter.
    ///
    /// With input `u`, output `y` and tick `dt` it computes `y[k+1] = a y[k] + (1 - a) u[k]`, where
    /// `a = exp(-dt / tau)` and `y[0] = 0`. This is the exact response of an exponential synapse to an input that is
    /// constant during each tick.
    Lowpass {
        /// Time constant, more than zero.
        tau: SimDuration,
    },
    /// Two equal low-passes in series, with impulse response `t exp(-t / tau) / tau^2` (Mainen and Sejnowski 1995).
    ///
    /// It is not two synapses of this type in series: each of these is made discrete by itself and costs a tick.
    Alpha {
        /// Time constant, more than zero. The response is greatest at this time.
        tau: SimDuration,
    },
    /// Two low-passes in series, with impulse response `(exp(-t / decay) - exp(-t / rise)) / (decay - rise)`.
    DoubleExponential {
        /// Time constant of the rise, more than zero.
        rise: SimDuration,
        /// Time constant of the decay, more than zero.
        decay: SimDuration,
    },
    /// A finite impulse response that falls linearly to zero: of `n = round(length / dt) + 1` ticks the one `j` ticks ago
    /// weighs `2 (n - j) / (n (n + 1))`. The mean delay is `(n - 1) / 3` ticks.
    Triangle {
        /// Length of the response, more than zero and at most 1,000,000 ticks.
        length: SimDuration,
    },
    /// A pure delay: the value arrives `length` later, on a connection too, whose tick is part of it.
    Delay {
        /// Delay, a whole number of ticks from 1 to 1,000,000.
        length: SimDuration,
    },
    /// Any proper rational transfer function ([`Synapse::linear`]).
    Linear(LinearFilter),
}

/// A rational transfer function of order at most 8. [`Synapse::linear`] makes one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinearFilter {
    pub(crate) numerator: Polynomial,
    pub(crate) denominator: Polynomial,
}

/// A polynomial in `s`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Polynomial {
    /// Lowest power first. The rest is zero.
    coefficients: [f64; MAX_ORDER + 1],
    /// Number of coefficients that were given, without zeros in front; more than fit if the order is too high.
    pub len: usize,
}

impl Polynomial {
    /// Takes coefficients, highest power first.
    fn new(given: &[f64]) -> Self {
        let leading = given.iter().position(|c| *c != 0.0).unwrap_or(given.len());
        let mut coefficients = [0.0; MAX_ORDER + 1];
        for (own, c) in coefficients.iter_mut().zip(given[leading..].iter().rev()) {
            *own = *c;
        }
        Self { coefficients, len: given.len() - leading }
    }

    /// Returns the coefficients, lowest power first.
    pub fn ascending(&self) -> &[f64] {
        &self.coefficients[..self.len.min(MAX_ORDER + 1)]
    }
}

impl PartialEq for Polynomial {
    fn eq(&self, other: &Self) -> bool {
        (self.len, self.coefficients.map(f64::to_bits))
            == (other.len, other.coefficients.map(f64::to_bits))
    }
}

impl Eq for Polynomial {}

impl Synapse {
    /// Creates a low-pass with time constant `tau`. `build` reports a time constant of zero.
    pub const fn lowpass(tau: SimDuration) -> Self {
        Self::Lowpass { tau }
    }

    /// Creates a low-pass with a time constant of `millis` milliseconds. `build` reports a time constant of zero.
    pub const fn lowpass_ms(millis: u64) -> Self {
        Self::Lowpass { tau: SimDuration::from_millis(millis) }
    }

    /// Creates an [`Alpha`](Self::Alpha) with a time constant of `millis` milliseconds.
    pub const fn alpha_ms(millis: u64) -> Self {
        Self::Alpha { tau: SimDuration::from_millis(millis) }
    }

    /// Creates a [`Triangle`](Self::Triangle) of `millis` milliseconds.
    pub const fn triangle_ms(millis: u64) -> Self {
        Self::Triangle { length: SimDuration::from_millis(millis) }
    }

    /// Creates a [`Delay`](Self::Delay) of `millis` milliseconds.
    pub const fn delay_ms(millis: u64) -> Self {
        Self::Delay { length: SimDuration::from_millis(millis) }
    }

    /// Creates a filter with the transfer function `numerator / denominator`. Coefficients belong to powers of `s` in 1/s
    /// and start with the highest power: `linear(&[1.0], &[0.005, 1.0])` is a low-pass of 5 ms, and
    /// `linear(&[1.0], &[1.0, 0.0])` an integrator.
    ///
    /// Without a direct term (numerator of lower order) the output of a tick includes the input of that tick. With one,
    /// it is `C x + D u` with the state `x` before the tick.
    ///
    /// The filter may be unstable; a value that becomes infinite ends the run with an error. `build` reports an order
    /// above 8, a numerator of higher order than the denominator, a numerator or denominator of zeros, and coefficients
    /// that are not finite.
    pub fn linear(numerator: &[f64], denominator: &[f64]) -> Self {
        let (numerator, denominator) = (Polynomial::new(numerator), Polynomial::new(denominator));
        Self::Linear(LinearFilter { numerator, denominator })
    }

    /// Adds the parameters to the fingerprint of a node that has this synapse inside.
    pub fn fingerprint(self, hash: &mut Fingerprint) {
        match self {
            Self::None => hash.number(0),
            Self::Lowpass { tau } => hash.number(1).number(tau.as_micros()),
            // Coefficients are written with all their digits.
            other => hash.text(&format!("{other:?}")),
        };
    }

    /// An order of synapses that does not depend on when they were added to a graph.
    pub(crate) fn order(self) -> (u8, u64) {
        match self {
            Self::None => (0, 0),
            Self::Lowpass { tau } => (1, tau.as_micros()),
            other => {
                let mut hash = Fingerprint::default();
                other.fingerprint(&mut hash);
                (2, hash.value())
            }
        }
    }
}

/// A low-pass is written as its time constant, as most synapses are low-passes.
impl fmt::Display for Synapse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Lowpass { tau } => write!(f, "{tau}"),
            Self::Alpha { tau } => write!(f, "alpha {tau}"),
            Self::DoubleExponential { rise, decay } => write!(f, "rise {rise}, decay {decay}"),
            Self::Triangle { length } => write!(f, "triangle {length}"),
            Self::Delay { length } => write!(f, "delay {length}"),
            Self::Linear(LinearFilter { denominator, .. }) => {
                write!(f, "linear of order {}", denominator.len.saturating_sub(1))
            }
        }
    }
}
