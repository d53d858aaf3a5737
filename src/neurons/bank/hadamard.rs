//! Encoders that are rows of Hadamard matrices, and their currents by a fast Walsh-Hadamard transform.
//!
//! A block has as many neurons as the next power of two of the dimensions (the order). Their encoders are the rows of
//! the Hadamard matrix of that order, its columns multiplied by random signs, cut to the dimensions and scaled to unit
//! length. So the products of all encoders of a block with a value are the transform of the value with the signs
//! applied: `order log2(order)` additions in place of `order * dims` products, and one bit of memory a neuron.
//!
//! Up to 128 neurons are transformed together. Neuron `row * lanes + lane` of them has the given row in the block
//! `lane`, so every addition of the transform is between neighbours of one block and the same for all blocks. It is the
//! same on every processor, whatever the width of its registers.
//!
//! The hot loop reads one number a neuron: its gain, whose lowest bit is replaced by a sign. The bit of neuron
//! `row * lanes + lane` is the sign of the column `row` of the block `lane`.

use std::ops::RangeInclusive;

use multiversion::multiversion;
use rand::{Rng, RngExt};

use super::shape::{BLOCK, NARROW, Shape};
use crate::sim::Real;

/// Numbers of dimensions for which there are such encoders: a block of neurons is transformed as a whole.
pub(crate) const DIMS: RangeInclusive<usize> = 2..=BLOCK;

/// Gain of neurons without effect. Its product with a value above 1e-18 is a normal number, which costs no more than
/// others, and too small to change a current.
const NO_GAIN: Real = 1e-20;

/// Returns the row of a neuron in its block, and the neuron of the block's first row.
fn place(shape: &Shape, neuron: usize) -> (usize, usize) {
    let start = neuron / BLOCK * BLOCK;
    let lanes = (shape.padded() - start).min(BLOCK) / shape.order();
    ((neuron - start) / lanes, start + (neuron - start) % lanes)
}

/// Draws the encoders of an ensemble: a row of length 1 for each neuron.
pub(crate) fn directions<R: Rng>(rng: &mut R, shape: &Shape) -> Vec<f64> {
    let (dims, length) = (shape.dims, 1.0 / (shape.dims as f64).sqrt());
    // As many as there are blocks, but for those of neurons that are not first in a block.
    let signs: Vec<u128> = (0..shape.neurons).map(|_| rng.random()).collect();
    let mut rows = vec![0.0; shape.neurons * dims];
    for (neuron, encoder) in rows.chunks_exact_mut(dims).enumerate() {
        let (row, first) = place(shape, neuron);
        for (column, number) in encoder.iter_mut().enumerate() {
            let flipped = (signs[first] >> column & 1) as u32 + (row & column).count_ones();
            *number = if flipped.is_multiple_of(2) { length } else { -length };
        }
    }
    rows
}

/// Returns what the hot loop reads: the gain of each neuron along the sum of the signed components of a value, marked
/// with a sign. `gains` are those along the encoders, `encoders` come from [`directions`].
pub(super) fn lay_out(shape: &Shape, gains: &[f64], encoders: &[f64]) -> Vec<Real> {
    let (dims, length) = (shape.dims, 1.0 / (shape.dims as f64).sqrt());
    let marked = |neuron: usize| {
        let gain = gains.get(neuron).map_or(0.0, |gain| (gain * length) as Real);
        let gain = if gain.abs() < NO_GAIN { NO_GAIN } else { gain };
        let (column, first) = place(shape, neuron);
        // The first row of a Hadamard matrix is all 1, so that of the block has its signs.
        let of_column = encoders.get(first * dims + column).filter(|_| column < dims);
        let sign = of_column.is_some_and(|number| *number < 0.0);
        Real::from_bits(gain.to_bits() & !1 | u32::from(sign))
    };
    (0..shape.padded()).map(marked).collect()
}

/// Computes the currents of the neurons of an ensemble from a multiple of [`BLOCK`] on: bias plus shift plus gain times
/// the product of encoder and value.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2",
    "x86_64+sse4.1"
))]
pub(super) fn encode(
    gains: &[Real],
    biases: &[Real],
    shift: Real,
    value: &[Real],
    currents: &mut [Real],
) {
    let order = value.len().next_power_of_two();
    let (mut spread, mut spread_to) = ([0.0; BLOCK], 0);
    let numbers = gains.chunks(BLOCK).zip(biases.chunks(BLOCK));
    for (currents, (gains, biases)) in currents.chunks_mut(BLOCK).zip(numbers) {
        let lanes = currents.len() / order;
        if lanes != spread_to {
            spread_to = lanes;
            let components = value.iter().chain(std::iter::repeat(&0.0));
            for (column, x) in spread.chunks_exact_mut(lanes).zip(components) {
                for lane in column {
                    *lane = *x;
                }
            }
        }
        for ((current, x), gain) in currents.iter_mut().zip(&spread).zip(gains) {
            *current = Real::from_bits(x.to_bits() ^ gain.to_bits() << 31);
        }
        transform(currents, lanes);
        for ((current, bias), gain) in currents.iter_mut().zip(biases).zip(gains) {
            *current = bias + shift + gain * *current;
        }
    }
}

/// Transforms the blocks that lie side by side in so many lanes.
#[inline(always)]
fn transform(all: &mut [Real], lanes: usize) {
    if lanes == NARROW && all.len() == 16 * NARROW {
        let (rows, _) = all.as_chunks_mut();
        let (sixteen, _) = rows.as_chunks_mut();
        for rows in sixteen {
            transform_sixteen(rows);
        }
        return;
    }
    let mut run = lanes;
    while run < all.len() {
        for both in all.chunks_exact_mut(2 * run) {
            let (left, right) = both.split_at_mut(run);
            for (left, right) in left.iter_mut().zip(right) {
                (*left, *right) = (*left + *right, *left - *right);
            }
        }
        run *= 2;
    }
}

/// Transforms eight blocks of order 16. Written out, since compilers would turn loops into gathers; this way all
/// numbers stay in registers.
#[inline(always)]
fn transform_sixteen(rows: &mut [[Real; NARROW]; 16]) {
    const RUNS: [[[usize; 2]; 8]; 4] = [
        [[0, 1], [2, 3], [4, 5], [6, 7], [8, 9], [10, 11], [12, 13], [14, 15]],
        [[0, 2], [1, 3], [4, 6], [5, 7], [8, 10], [9, 11], [12, 14], [13, 15]],
        [[0, 4], [1, 5], [2, 6], [3, 7], [8, 12], [9, 13], [10, 14], [11, 15]],
        [[0, 8], [1, 9], [2, 10], [3, 11], [4, 12], [5, 13], [6, 14], [7, 15]],
    ];
    macro_rules! pairs {
        ($($run:literal: $($pair:literal)*;)*) => {$($({
            const PAIR: [usize; 2] = RUNS[$run][$pair];
            let (low, high) = rows.split_at_mut(PAIR[1]);
            let (left, right) = (&mut low[PAIR[0]], &mut high[0]);
            for i in 0..NARROW {
                (left[i], right[i]) = (left[i] + right[i], left[i] - right[i]);
            }
        })*)*};
    }
    pairs!(0: 0 1 2 3 4 5 6 7; 1: 0 1 2 3 4 5 6 7; 2: 0 1 2 3 4 5 6 7; 3: 0 1 2 3 4 5 6 7;);
}
