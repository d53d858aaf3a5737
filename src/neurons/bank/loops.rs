//! The loop over a bank's neurons: currents, activity and decoding.

use multiversion::multiversion;

use super::few::few;
use super::shape::{BLOCK, NARROW, Shape, WIDE};
use super::work::{Work, at_rest, first};
use crate::neurons::models::{Block, NeuronModel};
use crate::sim::Real;

impl Work<'_> {
    /// Steps the ensembles by one tick.
    pub(in crate::neurons) fn step<M: NeuronModel + ?Sized>(
        &self,
        model: &M,
        state: &mut [Real],
        out: &mut [Real],
    ) {
        if self.shape.is_few() {
            few(model, self, state, out);
        } else {
            many(model, self, state, out);
        }
    }
}

/// Steps neurons for one tick: the hot loop.
///
/// Compilers turn every pass without branches into wide instructions. Only the last pass of ensembles with several
/// outputs visits the active neurons alone.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2",
    "x86_64+sse4.1"
))]
fn many<M: NeuronModel + ?Sized>(
    model: &M,
    work: &Work<'_>,
    mut state: &mut [Real],
    out: &mut [Real],
) {
    let Shape { dims, outputs, .. } = work.shape;
    let padded = work.shape.padded();
    let (mut currents, mut activity) = ([0.0; BLOCK], [0.0; BLOCK]);
    let (out, mut told) = work.split(out);
    let rows = work.values.chunks_exact(dims).zip(out.chunks_exact_mut(outputs));
    for (index, (value, out)) in rows.enumerate() {
        let mut own = first(&mut state, work.variables * padded);
        let neurons = work.shape.neurons;
        let mut injected = work.injected.get(index * neurons..(index + 1) * neurons).unwrap_or(&[]);
        let own_told = told.len().min(neurons);
        let mut told = first(&mut told, own_told);
        let biases = &work.biases[index * padded..(index + 1) * padded];
        let encoders = &work.encoders[index * padded * dims..(index + 1) * padded * dims];
        let decoders = &work.decoders[index * padded * outputs..(index + 1) * padded * outputs];
        out.fill(0.0);
        // An ensemble at rest stays at rest while its currents are low. Skipping it gives the same bits as the passes
        // below and reads far less memory.
        let resting = work.shift <= 0.0 && value[0] < work.rests[index];
        let silenced = value.iter().map(|x| x * x).sum::<Real>() <= work.quiet;
        if (resting || silenced) && injected.is_empty() && at_rest(own) {
            told.fill(0.0);
            continue;
        }
        let mut lanes = [0.0; NARROW];
        let blocks = biases.chunks(BLOCK).zip(encoders.chunks(BLOCK * dims));
        let blocks = blocks.zip(decoders.chunks(BLOCK * outputs)).enumerate();
        for (block, ((biases, encoders), decoders)) in blocks {
            let len = biases.len();
            let (currents, activity) = (&mut currents[..len], &mut activity[..len]);
            encode(encoders, biases, work.shift, value, currents);
            Work::inject(&mut injected, currents);
            let state = first(&mut own, work.variables * len);
            let draws = work.draws(index * padded + block * BLOCK);
            model.step(Block { dt_s: work.dt_s, currents, state, activity, draws });
            work.tell(&mut told, activity);
            if outputs == 1 && work.spikes {
                let eights = activity.chunks_exact(NARROW).zip(decoders.chunks_exact(NARROW));
                for (activity, decoders) in eights {
                    for i in 0..NARROW {
                        lanes[i] += activity[i] * decoders[i];
                    }
                }
            } else {
                add_rows(activity, decoders, out);
            }
        }
        if outputs == 1 && work.spikes {
            out[0] = lanes.iter().sum();
        }
    }
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

/// Adds the decoders (one row per neuron) of the neurons that are active, times their activity.
///
/// The active ones are collected first, without branches. Their rows are then read without waiting for one another: a
/// branch for each would be guessed wrong, and no read can overtake it.
#[inline(always)]
fn add_rows(activity: &[Real], decoders: &[Real], out: &mut [Real]) {
    const { assert!(BLOCK <= 256, "a neuron of a block is numbered by a byte") };
    let outputs = out.len();
    let (mut active, mut count) = ([0u8; BLOCK], 0);
    for (neuron, activity) in activity.iter().enumerate() {
        active[count % BLOCK] = neuron as u8;
        count += usize::from(*activity != 0.0);
    }
    for neuron in active[..count].iter().map(|neuron| usize::from(*neuron)) {
        let row = &decoders[neuron * outputs..(neuron + 1) * outputs];
        for (sum, decoder) in out.iter_mut().zip(row) {
            *sum += activity[neuron] * decoder;
        }
    }
}
