//! Simulated time: durations in whole microseconds, and the clock that counts ticks.

use std::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A duration or a clock that cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A duration that is not a whole number of ticks.
    #[error("{span} is not a whole number of ticks of {tick}; use a multiple of {tick}")]
    Indivisible {
        /// The duration given.
        span: SimDuration,
        /// The length of a tick.
        tick: SimDuration,
    },
    /// A tick of zero length, or longer than a second.
    #[error("a tick of {tick} is not usable; choose more than 0 and at most 1 s")]
    BadTick {
        /// The tick given.
        tick: SimDuration,
    },
    /// A number of seconds that is negative, too large or not finite.
    #[error("{seconds} s is not a duration; expected a finite number from 0 to 1e12")]
    NotADuration {
        /// The number given.
        seconds: f64,
    },
}

/// A duration of simulated time, in whole microseconds.
///
/// The engine counts time in whole ticks, so time does not drift. It converts to and from floating-point seconds only
/// where values leave or enter the engine ([`SimDuration::as_secs_f64`], [`SimDuration::from_secs_f64`]).
///
/// ```
/// use symbolt::sim::SimDuration;
/// assert_eq!(SimDuration::from_millis(5).to_string(), "5 ms");
/// assert_eq!(SimDuration::from_secs_f64(0.0015)?.as_micros(), 1500);
/// # Ok::<(), symbolt::sim::ConfigError>(())
/// ```
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct SimDuration {
    micros: u64,
}

impl SimDuration {
    /// A duration of zero.
    pub const ZERO: Self = Self { micros: 0 };

    /// Creates a duration of `micros` microseconds.
    pub const fn from_micros(micros: u64) -> Self {
        Self { micros }
    }

    /// Creates a duration of `millis` milliseconds. Saturates at about 584,000 years.
    pub const fn from_millis(millis: u64) -> Self {
        Self { micros: millis.saturating_mul(1_000) }
    }

    /// Creates a duration of `secs` seconds. Saturates at about 584,000 years.
    pub const fn from_secs(secs: u64) -> Self {
        Self { micros: secs.saturating_mul(1_000_000) }
    }

    /// Creates a duration of `secs` seconds, rounded to the nearest microsecond.
    ///
    /// # Errors
    /// [`ConfigError::NotADuration`] if `secs` is negative, not finite, or above 10^12 s.
    pub fn from_secs_f64(secs: f64) -> Result<Self, ConfigError> {
        if !secs.is_finite() || !(0.0..=1e12).contains(&secs) {
            return Err(ConfigError::NotADuration { seconds: secs });
        }
        Ok(Self { micros: (secs * 1e6).round() as u64 })
    }

    /// Returns the duration in microseconds.
    pub const fn as_micros(self) -> u64 {
        self.micros
    }

    /// Returns the duration in seconds.
    pub fn as_secs_f64(self) -> f64 {
        self.micros as f64 * 1e-6
    }

    /// Returns the duration in milliseconds.
    pub fn as_millis_f64(self) -> f64 {
        self.micros as f64 * 1e-3
    }

    /// Returns whether the duration is zero.
    pub(crate) const fn is_zero(self) -> bool {
        self.micros == 0
    }
}

impl fmt::Display for SimDuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.micros.is_multiple_of(1_000) {
            write!(f, "{} ms", self.micros / 1_000)
        } else {
            write!(f, "{} us", self.micros)
        }
    }
}

/// The clock of a graph: the length of a tick, 1 ms by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Timebase {
    tick: SimDuration,
}

impl Default for Timebase {
    fn default() -> Self {
        Self { tick: SimDuration::from_millis(1) }
    }
}

impl Timebase {
    /// Creates a clock with ticks of length `tick`.
    ///
    /// # Errors
    /// [`ConfigError::BadTick`] if `tick` is zero or longer than one second.
    pub fn new(tick: SimDuration) -> Result<Self, ConfigError> {
        if tick.is_zero() || tick > SimDuration::from_secs(1) {
            return Err(ConfigError::BadTick { tick });
        }
        Ok(Self { tick })
    }

    /// Returns the length of a tick.
    pub const fn tick(&self) -> SimDuration {
        self.tick
    }

    /// Returns the length of a tick in seconds.
    pub fn dt_s(&self) -> f64 {
        self.tick.as_secs_f64()
    }

    /// Returns the number of ticks in `span`. Never rounds.
    ///
    /// # Errors
    /// [`ConfigError::Indivisible`] if `span` is not a whole number of ticks.
    pub fn ticks(&self, span: SimDuration) -> Result<u64, ConfigError> {
        if !span.micros.is_multiple_of(self.tick.micros) {
            return Err(ConfigError::Indivisible { span, tick: self.tick });
        }
        Ok(span.micros / self.tick.micros)
    }

    /// Returns the simulated time of `ticks` ticks. Saturates at about 584,000 years.
    pub(crate) fn span(&self, ticks: u64) -> SimDuration {
        SimDuration::from_micros(ticks.saturating_mul(self.tick.micros))
    }
}
