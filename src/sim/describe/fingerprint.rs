//! Fingerprints of graphs, used to match checkpoints with their graphs.

use crate::sim::real::Real;
use crate::sim::seed::{FNV_START, fnv1a, fnv1a_word};

/// A 64-bit hash of a graph. Nodes add their parameters to it.
///
/// Texts and lists are hashed with their length, so moving a value from one list to the next changes the hash. The hash
/// tells graphs apart; it does not protect against forgery.
///
/// ```
/// use symbolt::sim::Fingerprint;
/// let of = |values: &[f32]| {
///     let mut hash = Fingerprint::default();
///     hash.reals(values);
///     hash.value()
/// };
/// assert_eq!(of(&[1.0, 2.0]), of(&[1.0, 2.0]));
/// assert_ne!(of(&[1.0, 2.0]), of(&[2.0, 1.0]));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fingerprint(u64);

impl Default for Fingerprint {
    fn default() -> Self {
        Self(FNV_START)
    }
}

impl Fingerprint {
    /// Continues another hash.
    pub(crate) fn continued(hash: u64) -> Self {
        Self(hash)
    }

    /// Adds a text.
    pub fn text(&mut self, text: &str) -> &mut Self {
        self.number(text.len() as u64);
        self.0 = fnv1a(self.0, text.as_bytes());
        self
    }

    /// Adds an integer.
    pub fn number(&mut self, number: u64) -> &mut Self {
        self.0 = fnv1a(self.0, &number.to_le_bytes());
        self
    }

    /// Adds the bits of a number.
    pub fn real(&mut self, value: f64) -> &mut Self {
        self.number(value.to_bits())
    }

    /// Adds the bits of several numbers. Costs one multiplication per number.
    pub fn reals(&mut self, values: &[Real]) -> &mut Self {
        self.number(values.len() as u64);
        for value in values {
            self.0 = fnv1a_word(self.0, u64::from(value.to_bits()));
        }
        self
    }

    /// Returns the hash.
    pub fn value(self) -> u64 {
        self.0
    }
}
