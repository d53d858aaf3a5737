//! The shape of a bank: how many ensembles of what size, and how their neurons lie in blocks.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// The number of ensembles in a bank, and the size of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Shape {
    pub ensembles: usize,
    /// Number of neurons in one ensemble.
    pub neurons: usize,
    /// Number of dimensions of the value that one ensemble represents.
    pub dims: usize,
    /// Number of values decoded from one ensemble.
    pub outputs: usize,
    /// Whether encoders are rows of Hadamard matrices: see the module `hadamard`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub hadamard: bool,
}

/// Neurons encoded together in ensembles of one dimension: the width of the widest registers in use.
pub(super) const NARROW: usize = 8;
/// Neurons encoded together in ensembles of several dimensions.
pub(super) const WIDE: usize = 32;
/// Greatest number of neurons in ensembles that share a block.
pub(super) const FEW: usize = 4;
/// Neurons in one block, which are stepped together.
pub(super) const BLOCK: usize = 128;
/// Neurons that are encoded and decoded together: their currents stay in the first-level cache between passes.
pub(super) const SPAN: usize = 7 * BLOCK;

impl Shape {
    /// Number of neurons in one group of encoders.
    pub(super) fn lanes(&self) -> usize {
        match self.dims {
            1 if self.is_few() => 1,
            1 => NARROW,
            // Decoders are read in groups of `NARROW`.
            _ if self.hadamard => self.order().max(NARROW),
            _ => WIDE,
        }
    }

    /// Number of neurons in a block of Hadamard encoders.
    pub(super) fn order(&self) -> usize {
        self.dims.next_power_of_two()
    }

    /// Number of numbers that make a neuron's encoder.
    pub fn columns(&self) -> usize {
        if self.hadamard { 1 } else { self.dims }
    }

    /// Number of operations that encode a value for one neuron: a product and a sum for each dimension, or a neuron's part of a fast
    /// transform, a sign and a gain.
    pub fn encoding(&self) -> usize {
        if self.hadamard { self.order().ilog2() as usize + 2 } else { 2 * self.dims }
    }

    /// Returns whether several ensembles share a block.
    pub(super) fn is_few(&self) -> bool {
        self.neurons <= FEW && self.dims == 1 && self.outputs == 1
    }

    /// Number of neurons in one ensemble, including those that pad its last group.
    pub fn padded(&self) -> usize {
        self.neurons.next_multiple_of(self.lanes())
    }

    /// Index of a neuron's encoder for a dimension, within its ensemble's encoders, unless they are Hadamard encoders.
    pub(super) fn encoder_at(&self, neuron: usize, dimension: usize) -> usize {
        let lanes = self.lanes();
        (neuron / lanes * self.dims + dimension) * lanes + neuron % lanes
    }

    /// Returns the block of a neuron among so many ensembles, as a range of neurons with their padding.
    pub(super) fn block(&self, ensembles: usize, neuron: usize) -> Range<usize> {
        let per = self.padded();
        // Neurons that are cut into blocks together, and the length of a block.
        let (row, block) =
            if self.is_few() { (ensembles * per, NARROW * per) } else { (per, BLOCK) };
        let start = neuron - neuron % row % block;
        start..(start + block).min(neuron / row * row + row)
    }

    /// Returns the blocks of so many ensembles.
    pub(super) fn blocks(self, ensembles: usize) -> impl Iterator<Item = Range<usize>> {
        let all = ensembles * self.padded();
        let from = move |start: usize| (start < all).then(|| self.block(ensembles, start));
        std::iter::successors(from(0), move |before| from(before.end))
    }

    /// Number of ensembles that must not be parted.
    pub(crate) fn group(&self) -> usize {
        if self.is_few() { NARROW } else { 1 }
    }
}
