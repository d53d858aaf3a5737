//! The loop over ensembles of 1 to 4 neurons: eight ensembles at a time.

use multiversion::multiversion;

use super::NARROW;
use super::shape::FEW;
use super::work::{Work, at_rest, first};
use crate::neurons::models::{Block, NeuronModel};
use crate::sim::Real;

/// Steps ensembles of few neurons for one tick.
///
/// Most ensembles of a large memory rest. Eight resting ensembles cost a look at their inputs and states.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
pub(super) fn few<M: NeuronModel + ?Sized>(
    model: &M,
    work: &Work<'_>,
    mut state: &mut [Real],
    out: &mut [Real],
) {
    let per = work.shape.neurons;
    let block = NARROW * per;
    let (mut currents, mut activity) = ([0.0; NARROW * FEW], [0.0; NARROW * FEW]);
    let (out, mut told) = work.split(out);
    let mut injected = work.injected;
    let inputs = work.values.chunks(NARROW).zip(work.rests.chunks(NARROW));
    let numbers = work.biases.chunks(block).zip(work.encoders.chunks(block));
    let numbers = numbers.zip(work.decoders.chunks(block));
    let blocks = inputs.zip(numbers).zip(out.chunks_mut(NARROW));
    for (index, (((values, rests), ((biases, encoders), decoders)), out)) in blocks.enumerate() {
        let own = first(&mut state, work.variables * biases.len());
        let below = values.iter().zip(rests).fold(true, |all, (value, rest)| all & (value < rest));
        if work.shift <= 0.0 && below && injected.is_empty() && at_rest(own) {
            out.fill(0.0);
            let count = told.len().min(biases.len());
            first(&mut told, count).fill(0.0);
            continue;
        }
        let (currents, activity) = (&mut currents[..biases.len()], &mut activity[..biases.len()]);
        let neurons = currents.iter_mut().zip(biases).zip(encoders).enumerate();
        for (neuron, ((current, bias), encoder)) in neurons {
            *current = bias + work.shift + encoder * values[neuron / per];
        }
        Work::inject(&mut injected, currents);
        let draws = work.draws(index * block);
        model.step(Block { dt_s: work.dt_s, currents, state: own, activity, draws });
        work.tell(&mut told, activity);
        let ensembles = activity.chunks_exact(per).zip(decoders.chunks_exact(per));
        for (out, (activity, decoders)) in out.iter_mut().zip(ensembles) {
            *out = activity.iter().zip(decoders).fold(0.0, |sum, (a, d)| sum + a * d);
        }
    }
}
