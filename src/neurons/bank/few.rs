//! The loop over ensembles of 1 to 4 neurons: eight ensembles at a time.

use multiversion::multiversion;

use super::loops::{Work, at_rest, update};
use super::{FEW, NARROW};
use crate::sim::Real;

/// Steps ensembles of few spiking neurons for one tick.
///
/// Most ensembles of a large memory rest. Eight resting ensembles cost a look at their inputs and states.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
pub(super) fn few(work: &Work<'_>, v: &mut [Real], r: &mut [Real], out: &mut [Real]) {
    let per = work.shape.neurons;
    let block = NARROW * per;
    let (mut currents, mut fired) = ([0.0; NARROW * FEW], [0u32; NARROW * FEW]);
    let states = v.chunks_mut(block).zip(r.chunks_mut(block));
    let inputs = work.values.chunks(NARROW).zip(work.rests.chunks(NARROW));
    let numbers = work.biases.chunks(block).zip(work.encoders.chunks(block));
    let numbers = numbers.zip(work.decoders.chunks(block));
    let blocks = states.zip(inputs).zip(numbers).zip(out.chunks_mut(NARROW));
    for ((((v, r), (values, rests)), ((biases, encoders), decoders)), out) in blocks {
        let below = values.iter().zip(rests).fold(true, |all, (value, rest)| all & (value < rest));
        if work.shift <= 0.0 && below && at_rest(v, r) {
            out.fill(0.0);
            continue;
        }
        let (currents, fired) = (&mut currents[..v.len()], &mut fired[..v.len()]);
        let neurons = currents.iter_mut().zip(biases).zip(encoders).enumerate();
        for (neuron, ((current, bias), encoder)) in neurons {
            *current = bias + work.shift + encoder * values[neuron / per];
        }
        update(work.consts, v, r, currents, fired);
        let ensembles = fired.chunks_exact(per).zip(decoders.chunks_exact(per));
        for (out, (fired, decoders)) in out.iter_mut().zip(ensembles) {
            let masked = fired.iter().zip(decoders);
            *out = masked.map(|(fired, d)| Real::from_bits(d.to_bits() & fired)).sum();
        }
    }
}
