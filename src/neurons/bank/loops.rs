//! The loop over a bank's neurons: currents, activity and decoding.

use multiversion::multiversion;

use super::few::few;
use super::shape::{BLOCK, NARROW, SPAN, Shape, WIDE};
use super::work::{Work, at_rest, first};
use super::{decode, hadamard};
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
        let plain = self.injected.is_empty() && out.len() == self.decoded();
        if self.shape.is_few() {
            few(model, self, state, out);
        } else if self.shape.dims == 1 && self.shape.outputs == 1 && plain {
            narrow(model, self, state, out);
        } else if self.shape.outputs == 1 {
            // All decoders are read, one after the other: what is not yet decoded stays nearer in the cache.
            many::<M, BLOCK>(model, self, state, out);
        } else {
            many::<M, SPAN>(model, self, state, out);
        }
    }
}

/// Steps ensembles of one dimension and one output for one tick, without injected currents and with nothing but decoded
/// values to tell: what most networks do most of the time.
///
/// It gives the same bits as [`many`], which takes a sixth longer, since it decides more for each ensemble.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2",
    "x86_64+sse4.1"
))]
fn narrow<M: NeuronModel + ?Sized>(
    model: &M,
    work: &Work<'_>,
    mut state: &mut [Real],
    out: &mut [Real],
) {
    let padded = work.shape.padded();
    let (mut currents, mut activity) = ([0.0; BLOCK], [0.0; BLOCK]);
    let numbers = work.biases.chunks_exact(padded).zip(work.encoders.chunks_exact(padded));
    let numbers = numbers.zip(work.decoders.chunks_exact(padded));
    let inputs = work.values.iter().zip(work.rests);
    for ((index, out), ((x, rest), numbers)) in out.iter_mut().enumerate().zip(inputs.zip(numbers))
    {
        let mut own = first(&mut state, work.variables * padded);
        let resting = (work.shift <= 0.0 && x < rest) || x * x <= work.quiet;
        if resting && at_rest(own) {
            *out = 0.0;
            continue;
        }
        let ((biases, encoders), decoders) = numbers;
        let mut sums = [0.0; NARROW];
        let blocks = biases.chunks(BLOCK).zip(encoders.chunks(BLOCK)).zip(decoders.chunks(BLOCK));
        for (block, ((biases, encoders), decoders)) in blocks.enumerate() {
            let (currents, activity) =
                (&mut currents[..biases.len()], &mut activity[..biases.len()]);
            encode_scalar(encoders, biases, work.shift, *x, currents);
            let state = first(&mut own, work.variables * biases.len());
            let draws = work.draws(index * padded + block * BLOCK);
            model.step(Block { dt_s: work.dt_s, currents, state, activity, draws });
            decode::add_all(activity, decoders, &mut sums);
        }
        *out = sums.iter().sum();
    }
}

/// Steps ensembles for one tick.
///
/// Compilers turn every pass without branches into wide instructions. Only the last pass of ensembles with several
/// outputs visits the active neurons alone. So many neurons (`AT_ONCE`) are encoded and decoded together: [`BLOCK`] of ensembles
/// with one output, whose decoders are all read, and otherwise [`SPAN`].
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2",
    "x86_64+sse4.1"
))]
fn many<M: NeuronModel + ?Sized, const AT_ONCE: usize>(
    model: &M,
    work: &Work<'_>,
    mut state: &mut [Real],
    out: &mut [Real],
) {
    let dense = AT_ONCE == BLOCK;
    let Shape { dims, hadamard, .. } = work.shape;
    let outputs = if dense { 1 } else { work.shape.outputs };
    let (padded, columns) = (work.shape.padded(), work.shape.columns());
    let (mut currents, mut activity) = ([0.0; AT_ONCE], [0.0; AT_ONCE]);
    let (out, mut told) = work.split(out);
    let rows = work.values.chunks_exact(dims).zip(out.chunks_exact_mut(outputs));
    for (index, (value, out)) in rows.enumerate() {
        let mut own = first(&mut state, work.variables * padded);
        let neurons = work.shape.neurons;
        let mut injected = work.injected.get(index * neurons..(index + 1) * neurons).unwrap_or(&[]);
        let own_told = told.len().min(neurons);
        let mut told = first(&mut told, own_told);
        let biases = &work.biases[index * padded..(index + 1) * padded];
        let encoders = &work.encoders[index * padded * columns..(index + 1) * padded * columns];
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
        let mut sums = [0.0; NARROW];
        for (at, biases) in biases.chunks(AT_ONCE).enumerate() {
            // Chunks of a size that is not known when this is compiled would cost a division each.
            let (from, len) = (at * AT_ONCE, biases.len());
            let encoders = &encoders[from * columns..(from + len) * columns];
            let decoders = &decoders[from * outputs..(from + len) * outputs];
            let (currents, activity) = (&mut currents[..len], &mut activity[..len]);
            match value {
                [x] => encode_scalar(encoders, biases, work.shift, *x, currents),
                _ if hadamard => hadamard::encode(encoders, biases, work.shift, value, currents),
                _ => encode(encoders, biases, work.shift, value, currents),
            }
            Work::inject(&mut injected, currents);
            if dense {
                let state = first(&mut own, work.variables * len);
                let draws = work.draws(index * padded + from);
                model.step(Block { dt_s: work.dt_s, currents, state, activity, draws });
                work.tell(&mut told, activity);
                decode::add_all(activity, decoders, &mut sums);
                continue;
            }
            let blocks = currents.chunks(BLOCK).zip(activity.chunks_mut(BLOCK)).enumerate();
            for (block, (currents, activity)) in blocks {
                let state = first(&mut own, work.variables * currents.len());
                let draws = work.draws(index * padded + from + block * BLOCK);
                model.step(Block { dt_s: work.dt_s, currents, state, activity, draws });
            }
            work.tell(&mut told, activity);
            decode::add_rows(activity, decoders, out);
        }
        if dense {
            out[0] = sums.iter().sum();
        }
    }
}

/// Computes the currents of neurons of one dimension: bias plus shift plus encoder times value.
#[inline(always)]
fn encode_scalar(
    encoders: &[Real],
    biases: &[Real],
    shift: Real,
    value: Real,
    currents: &mut [Real],
) {
    for ((current, bias), encoder) in currents.iter_mut().zip(biases).zip(encoders) {
        *current = bias + shift + encoder * value;
    }
}

/// Computes the currents of neurons of several dimensions.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2",
    "x86_64+sse4.1"
))]
fn encode(encoders: &[Real], biases: &[Real], shift: Real, value: &[Real], currents: &mut [Real]) {
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
