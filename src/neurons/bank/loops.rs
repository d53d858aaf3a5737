//! The loops over a bank's neurons: currents, voltages, spikes and decoding.

use multiversion::multiversion;

use super::{BLOCK, Consts, NARROW, Shape, WIDE};
use crate::sim::Real;

/// The input of the loops: a bank's constants and the values of one tick.
pub(super) struct Work<'a> {
    pub(super) consts: Consts,
    pub(super) shape: Shape,
    /// Current added to every neuron: 0 while the gate is fully open, below 0 otherwise.
    pub(super) shift: Real,
    /// Squared norm of the input up to which `shift` keeps every neuron from firing; below 0 if it does not.
    pub(super) quiet: Real,
    /// For each ensemble, the input below which no neuron gets a current above 0.
    pub(super) rests: &'a [Real],
    pub(super) encoders: &'a [Real],
    pub(super) biases: &'a [Real],
    pub(super) decoders: &'a [Real],
    pub(super) values: &'a [Real],
}

/// Steps spiking neurons for one tick: the hot loop.
///
/// Compilers turn every pass without branches into wide instructions. Only the last pass of ensembles with several
/// outputs branches: it visits only the neurons that fired.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
pub(super) fn spikes(work: &Work<'_>, v: &mut [Real], r: &mut [Real], out: &mut [Real]) {
    let Shape { dims, outputs, .. } = work.shape;
    let padded = work.shape.padded();
    let (mut currents, mut fired) = ([0.0; BLOCK], [0u32; BLOCK]);
    let ensembles = v.chunks_exact_mut(padded).zip(r.chunks_exact_mut(padded));
    for (index, (v, r)) in ensembles.enumerate() {
        let value = &work.values[index * dims..(index + 1) * dims];
        let out = &mut out[index * outputs..(index + 1) * outputs];
        let biases = &work.biases[index * padded..(index + 1) * padded];
        let encoders = &work.encoders[index * padded * dims..(index + 1) * padded * dims];
        let decoders = &work.decoders[index * padded * outputs..(index + 1) * padded * outputs];
        out.fill(0.0);
        // An ensemble at rest stays at rest while its currents are below 0. Skipping it gives the same bits as
        // the passes below and reads far less memory.
        let resting = work.shift <= 0.0 && value[0] < work.rests[index];
        let silenced = value.iter().map(|x| x * x).sum::<Real>() <= work.quiet;
        if (resting || silenced) && at_rest(v, r) {
            continue;
        }
        let mut lanes = [0.0; NARROW];
        let blocks = v.chunks_mut(BLOCK).zip(r.chunks_mut(BLOCK)).zip(biases.chunks(BLOCK));
        let blocks =
            blocks.zip(encoders.chunks(BLOCK * dims)).zip(decoders.chunks(BLOCK * outputs));
        for ((((v, r), biases), encoders), decoders) in blocks {
            let len = v.len();
            let (currents, fired) = (&mut currents[..len], &mut fired[..len]);
            encode(encoders, biases, work.shift, value, currents);
            update(work.consts, v, r, currents, fired);
            if outputs == 1 {
                // A mask, because compilers turn a conditional sum into a conditional store.
                let eights = fired.chunks_exact(NARROW).zip(decoders.chunks_exact(NARROW));
                for (fired, decoders) in eights {
                    for i in 0..NARROW {
                        lanes[i] += Real::from_bits(decoders[i].to_bits() & fired[i]);
                    }
                }
            } else {
                add_rows(fired, decoders, out);
            }
        }
        if outputs == 1 {
            out[0] = lanes.iter().sum();
        }
    }
}

/// Computes voltages, refractory times, and the mask of the neurons that fire.
#[inline(always)]
pub(super) fn update(
    consts: Consts,
    v: &mut [Real],
    r: &mut [Real],
    currents: &[Real],
    fired: &mut [u32],
) {
    let Consts { dt, per_tau, tau_rc, tau_ref } = consts;
    for (((v, r), c), fired) in v.iter_mut().zip(r.iter_mut()).zip(currents).zip(fired.iter_mut()) {
        let left = *r - dt;
        let free = dt - left;
        let free = if free < dt { free } else { dt };
        let z = if free > 0.0 { free } else { 0.0 } * per_tau;
        // The series of 1 - exp(-z); z is at most MAX_TICK.
        let decay =
            z * (1.0 - z * 0.5 * (1.0 - z * (1.0 / 3.0) * (1.0 - z * 0.25 * (1.0 - z * 0.2))));
        let next = *v + (c - *v) * decay;
        // The time since the spike is -tau_rc ln(1 - (v - 1) / (J - 1)); `log` is the series without tau_rc.
        let over = (next - 1.0) / (c - 1.0);
        let tail = 1.0 / 4.0 + over * (1.0 / 5.0 + over * (1.0 / 6.0 + over * (1.0 / 7.0)));
        let log = over * (1.0 + over * (1.0 / 2.0 + over * (1.0 / 3.0 + over * tail)));
        let spike = next > 1.0;
        let resting = if left > 0.0 { left } else { 0.0 };
        *r = if spike { tau_ref + dt - tau_rc * log } else { resting };
        let silent = if next > 0.0 { next } else { 0.0 };
        *v = if spike { 0.0 } else { silent };
        *fired = u32::from(spike).wrapping_neg();
    }
}

/// Returns whether all voltages and refractory times are zero.
#[inline(always)]
pub(super) fn at_rest(v: &[Real], r: &[Real]) -> bool {
    let bits = |all: &[Real]| all.iter().fold(0, |bits, x| bits | x.to_bits());
    bits(v) | bits(r) == 0
}

/// Computes the currents: bias plus shift plus encoder times value.
#[inline(always)]
pub(super) fn encode(
    encoders: &[Real],
    biases: &[Real],
    shift: Real,
    value: &[Real],
    currents: &mut [Real],
) {
    if let [x] = value {
        for ((current, bias), encoder) in currents.iter_mut().zip(biases).zip(encoders) {
            *current = bias + shift + encoder * x;
        }
        return;
    }
    let (currents, _) = currents.as_chunks_mut::<WIDE>();
    let (biases, _) = biases.as_chunks::<WIDE>();
    let (rows, _) = encoders.as_chunks::<WIDE>();
    let groups = currents.iter_mut().zip(biases).zip(rows.chunks_exact(value.len()));
    for ((current, bias), rows) in groups {
        let mut sums = [0.0; WIDE];
        for i in 0..WIDE {
            sums[i] = bias[i] + shift;
        }
        for (row, x) in rows.iter().zip(value) {
            for i in 0..WIDE {
                sums[i] += row[i] * x;
            }
        }
        *current = sums;
    }
}

/// Adds the decoders (one row per neuron) of the neurons that fired.
#[inline(always)]
pub(super) fn add_rows(fired: &[u32], decoders: &[Real], out: &mut [Real]) {
    let outputs = out.len();
    for (eight, fired) in fired.chunks_exact(NARROW).enumerate() {
        let mut bytes = [0u8; NARROW];
        for (byte, fired) in bytes.iter_mut().zip(fired) {
            *byte = *fired as u8;
        }
        let mut mask = u64::from_le_bytes(bytes) & 0x0101_0101_0101_0101;
        while mask != 0 {
            let neuron = eight * NARROW + (mask.trailing_zeros() / 8) as usize;
            mask &= mask - 1;
            let row = &decoders[neuron * outputs..(neuron + 1) * outputs];
            for (sum, decoder) in out.iter_mut().zip(row) {
                *sum += decoder;
            }
        }
    }
}

/// Computes the outputs of rate neurons: each neuron contributes its firing rate times its decoders.
pub(super) fn rates(work: &Work<'_>, out: &mut [Real]) {
    let Consts { tau_rc, tau_ref, .. } = work.consts;
    let Shape { dims, outputs, .. } = work.shape;
    let padded = work.shape.padded();
    for (index, out) in out.chunks_exact_mut(outputs).enumerate() {
        let value = &work.values[index * dims..(index + 1) * dims];
        let encoders = &work.encoders[index * padded * dims..(index + 1) * padded * dims];
        out.fill(0.0);
        for neuron in 0..padded {
            let mut current = work.biases[index * padded + neuron] + work.shift;
            for (k, x) in value.iter().enumerate() {
                current += encoders[work.shape.encoder_at(neuron, k)] * x;
            }
            if current > 1.0 {
                let rate = 1.0 / (tau_ref + tau_rc * (1.0 / (current - 1.0)).ln_1p());
                let from = (index * padded + neuron) * outputs;
                for (sum, decoder) in out.iter_mut().zip(&work.decoders[from..from + outputs]) {
                    *sum += rate * decoder;
                }
            }
        }
    }
}
