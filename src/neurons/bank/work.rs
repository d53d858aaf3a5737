//! What the loops over neurons get in one tick.

use super::shape::Shape;
use crate::neurons::models::Draws;
use crate::sim::Real;

/// Ensembles and their values in one tick: what
/// [`NeuronModel::step_ensembles`](crate::neurons::NeuronModel::step_ensembles) gets.
#[derive(Debug)]
pub struct Work<'a> {
    /// Length of the tick, in seconds.
    pub(super) dt_s: Real,
    pub(super) shape: Shape,
    /// Number of variables of a neuron's state.
    pub(super) variables: usize,
    /// The rate in Hz that one unit of activity stands for.
    pub(super) unit_hz: Real,
    /// Current added to every neuron: 0 while the gate is fully open, below 0 otherwise.
    pub(super) shift: Real,
    /// Squared norm of the input up to which `shift` keeps every neuron at rest; below 0 if it does not.
    pub(super) quiet: Real,
    /// For each ensemble, the input below which no neuron leaves its rest.
    pub(super) rests: &'a [Real],
    pub(super) encoders: &'a [Real],
    pub(super) biases: &'a [Real],
    pub(super) decoders: &'a [Real],
    pub(super) values: &'a [Real],
    /// Currents added to the neurons, a row per ensemble without padding; empty for none.
    pub(super) injected: &'a [Real],
    /// Key of the random numbers of the tick, and the index of the first ensemble in its layer.
    pub(super) draws: (u64, usize),
}

/// Takes the first `count` numbers off a slice.
#[inline(always)]
pub(super) fn first<'a>(rest: &mut &'a mut [Real], count: usize) -> &'a mut [Real] {
    let (own, after) = std::mem::take(rest).split_at_mut(count);
    *rest = after;
    own
}

impl<'a> Work<'a> {
    /// Splits what the loops write: a row of decoded values per ensemble, and, if it is asked for, the activity of all
    /// neurons without padding.
    #[inline(always)]
    pub(super) fn split<'o>(&self, out: &'o mut [Real]) -> (&'o mut [Real], &'o mut [Real]) {
        out.split_at_mut(self.decoded())
    }

    /// Number of decoded values.
    #[inline(always)]
    pub(super) fn decoded(&self) -> usize {
        self.values.len() / self.shape.dims * self.shape.outputs
    }

    /// Returns the random numbers of a block, which begins with a neuron of these ensembles.
    #[inline(always)]
    pub(super) fn draws(&self, neuron: usize) -> Draws {
        Draws::new(self.draws.0, self.draws.1 * self.shape.padded() + neuron)
    }

    /// Adds injected currents to those of the first neurons that have not got theirs.
    #[inline(always)]
    pub(super) fn inject(injected: &mut &'a [Real], currents: &mut [Real]) {
        let (own, after) = injected.split_at(injected.len().min(currents.len()));
        currents.iter_mut().zip(own).for_each(|(current, more)| *current += more);
        *injected = after;
    }

    /// Writes the activity of the next neurons, in Hz.
    #[inline(always)]
    pub(super) fn tell(&self, told: &mut &mut [Real], activity: &[Real]) {
        let count = told.len().min(activity.len());
        first(told, count).iter_mut().zip(activity).for_each(|(hz, a)| *hz = a * self.unit_hz);
    }
}

/// Returns whether all numbers of a state are zero.
#[inline(always)]
pub(super) fn at_rest(state: &[Real]) -> bool {
    state.iter().fold(0, |bits, x| bits | x.to_bits()) == 0
}
