//! The last pass over an ensemble: its activity becomes decoded values.

use multiversion::multiversion;

use super::shape::NARROW;
use crate::sim::Real;

/// Adds the decoders of a single output times the activity of all neurons, to running sums: one for each neuron of a
/// group.
#[inline(always)]
pub(super) fn add_all(activity: &[Real], decoders: &[Real], sums: &mut [Real; NARROW]) {
    let (activity, _) = activity.as_chunks::<NARROW>();
    let (decoders, _) = decoders.as_chunks::<NARROW>();
    for (activity, decoders) in activity.iter().zip(decoders) {
        for i in 0..NARROW {
            sums[i] += activity[i] * decoders[i];
        }
    }
}

/// Adds the decoders (one row per neuron) of the neurons that are active, times their activity.
///
/// It gets all neurons of an ensemble at once: their rows lie apart in memory, and many reads that do not wait for one
/// another take little longer than one.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2",
    "x86_64+sse4.1"
))]
pub(super) fn add_rows(activity: &[Real], decoders: &[Real], out: &mut [Real]) {
    // Sums of a known number stay in registers.
    match out.len() {
        2 => add_rows_of::<2>(activity, decoders, out),
        3 => add_rows_of::<3>(activity, decoders, out),
        4 => add_rows_of::<4>(activity, decoders, out),
        8 => add_rows_of::<8>(activity, decoders, out),
        16 => add_rows_of::<16>(activity, decoders, out),
        outputs => for_each_active(activity, |neuron, activity| {
            let row = &decoders[neuron * outputs..(neuron + 1) * outputs];
            for (sum, decoder) in out.iter_mut().zip(row) {
                *sum += activity * decoder;
            }
        }),
    }
}

#[inline(always)]
fn add_rows_of<const OUTPUTS: usize>(activity: &[Real], decoders: &[Real], out: &mut [Real]) {
    let (rows, _) = decoders.as_chunks::<OUTPUTS>();
    let Some(out) = out.first_chunk_mut::<OUTPUTS>() else { return };
    let mut sums = *out;
    for_each_active(activity, |neuron, activity| {
        let row = &rows[neuron];
        for i in 0..OUTPUTS {
            sums[i] += activity * row[i];
        }
    });
    *out = sums;
}

/// Calls `visit` with the index and activity of every active neuron, in rising order.
///
/// The active ones are first collected as bits, without branches: a branch for each would be guessed wrong. What is
/// called here is called at one place, so that compilers put it inside, in wide instructions.
#[inline(always)]
fn for_each_active(activity: &[Real], mut visit: impl FnMut(usize, Real)) {
    const WORD: usize = u64::BITS as usize;
    for (word, own) in activity.chunks(WORD).enumerate() {
        let mut bits = 0;
        if let Some(own) = own.first_chunk::<WORD>() {
            // A known number of neurons, for wide instructions.
            for (i, activity) in own.iter().enumerate() {
                bits |= u64::from(*activity != 0.0) << i;
            }
        } else {
            for (i, activity) in own.iter().enumerate() {
                bits |= u64::from(*activity != 0.0) << i;
            }
        }
        while bits != 0 {
            let neuron = word * WORD + bits.trailing_zeros() as usize;
            bits &= bits - 1;
            visit(neuron, activity[neuron]);
        }
    }
}
