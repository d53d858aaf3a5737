//! Seeds. Each node's seed derives from its path, so adding a node does not change the seeds of other nodes.

use std::fmt;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde::{Deserialize, Serialize};

/// A 64-bit seed of random choices. Other seeds derive from it by name.
///
/// The derivation depends on names only, never on the order of construction. It is fixed: 64-bit FNV-1a, started from
/// the mixed parent seed, hashes path, the byte 0xFF and role. The SplitMix64 mixer (Steele, Lea and Flood 2014) then
/// mixes the hash.
///
/// ```
/// use symbolt::sim::Seed;
/// let root = Seed::new(1);
/// assert_eq!(root.derive("planner/goal", "noise"), root.derive("planner/goal", "noise"));
/// assert_ne!(root.derive("planner/goal", "noise"), root.derive("planner/goa", "lnoise"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Seed(u64);

/// The output function of SplitMix64: a bijection of 64-bit words in which every input bit affects every output bit.
pub(crate) const fn mix64(word: u64) -> u64 {
    let mut z = word.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The start value of 64-bit FNV-1a.
pub(crate) const FNV_START: u64 = 0xCBF2_9CE4_8422_2325;

/// Continues the 64-bit FNV-1a hash `hash` over `bytes`.
pub(crate) fn fnv1a(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |hash, byte| fnv1a_word(hash, u64::from(*byte)))
}

/// One step of 64-bit FNV-1a, over a byte or a wider word.
pub(crate) fn fnv1a_word(hash: u64, word: u64) -> u64 {
    (hash ^ word).wrapping_mul(0x0000_0100_0000_01B3)
}

impl Seed {
    /// Creates a seed from its 64 bits.
    pub const fn new(value: u64) -> Self {
        Self(value)
    }

    /// Returns the 64 bits.
    pub const fn value(self) -> u64 {
        self.0
    }

    /// Returns the seed for `role` at `path`. It depends only on this seed, `path` and `role`.
    pub fn derive(self, path: &str, role: &str) -> Self {
        let mut hash = mix64(self.0) ^ FNV_START;
        hash = fnv1a(hash, path.as_bytes());
        hash = fnv1a(hash, &[0xFF]);
        hash = fnv1a(hash, role.as_bytes());
        Self(mix64(hash))
    }

    /// Returns seed number `index` of `role`, such as the seed of a trial or an ensemble.
    pub fn derive_index(self, role: &str, index: u64) -> Self {
        Self(mix64(self.derive("", role).0 ^ mix64(index)))
    }

    /// Returns a random number generator with this seed: ChaCha with 8 rounds, whose output is the same on every
    /// platform. Does not allocate.
    pub fn rng(self) -> ChaCha8Rng {
        let mut key = [0u8; 32];
        let mut word = self.0;
        for chunk in key.chunks_exact_mut(8) {
            word = mix64(word);
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        ChaCha8Rng::from_seed(key)
    }
}

impl fmt::Display for Seed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}
