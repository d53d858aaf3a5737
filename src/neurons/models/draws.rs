//! Random numbers of stochastic neurons: functions of the run seed, the path, the tick and the neuron.

use crate::sim::Real;

/// The random numbers of a block of neurons in one tick.
///
/// A number depends on the run seed, the path of the layer, the tick, the index of the neuron in its layer and the
/// index of the number alone. So it does not depend on threads, ranks, snapshots, or how blocks are cut. Each costs two
/// rounds of a 32-bit mixer (Mulvey and Wellons, "Prospecting for hash functions", 2018), without branches.
#[derive(Debug, Clone, Copy, Default)]
pub struct Draws {
    key: [u32; 2],
    first: u32,
}

impl Draws {
    /// The numbers of a tick, whose key is a hash of seed, path and tick. `first` is the index of the block's first
    /// neuron.
    #[inline(always)]
    pub(in crate::neurons) fn new(key: u64, first: usize) -> Self {
        Self { key: [key as u32, (key >> 32) as u32], first: first as u32 }
    }

    /// Returns a number for a neuron of the block that is uniform in [0, 1), a multiple of 2^-24. A neuron has any
    /// number of them, told apart by `index`.
    #[inline(always)]
    pub fn uniform(&self, neuron: usize, index: u32) -> Real {
        let neuron = self.first.wrapping_add(neuron as u32);
        let index = index.wrapping_mul(0x9E37_79B9);
        let word = mix(mix(neuron ^ self.key[0]).wrapping_add(self.key[1] ^ index));
        // Below 2^24, so the signed conversion, which is one wide instruction, is exact.
        (word >> 8).cast_signed() as Real * (1.0 / 16_777_216.0)
    }
}

/// A bijection of 32-bit words in which every input bit affects every output bit.
#[inline(always)]
fn mix(mut word: u32) -> u32 {
    word ^= word >> 16;
    word = word.wrapping_mul(0x7FEB_352D);
    word ^= word >> 15;
    word = word.wrapping_mul(0x846C_A68B);
    word ^ word >> 16
}
