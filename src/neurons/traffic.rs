//! What the neurons of a run read, write and compute in a tick, counted from their layout and their state.

use super::bank::Bank;
use super::layers::Populated;
use super::models::Firing;
use crate::sim::{Real, Simulator};

/// Bytes and operations of one tick of all neurons of this process.
///
/// An ensemble at rest is passed over: of it only the state is read. Of any other ensemble a tick reads encoders, biases,
/// state and the values that it represents, and writes state and decoded values. Decoders are read of all its neurons if
/// it spikes and decodes one value, otherwise of those that are active. Padding counts, since it is read. Of neurons whose activity is
/// a rate all count as visited and active, since their state does not tell.
///
/// Operations are additions, multiplications and divisions in single precision. Comparisons are not counted.
///
/// What lies between layers (filters, transforms, sums) is in neither number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Traffic {
    /// Neurons whose ensembles are not passed over.
    pub visited: f64,
    /// Bytes that are only read.
    pub read: f64,
    /// Bytes of the state, which are read and then written, and of the decoded values.
    pub written: f64,
    /// Operations.
    pub operations: f64,
}

impl Traffic {
    /// Counts the last tick of a run. Costs about as much as some ticks.
    pub fn of(sim: &Simulator) -> Self {
        let mut all = Self::default();
        sim.look_at_parts(|view| {
            let Some(layer) = view.node.downcast_ref::<Populated>() else { return };
            let mut state = view.state;
            for population in layer.populations() {
                let (own, rest) = state.split_at(population.spec(view.part).state);
                all.add(&population.bank, population.ensembles(view.part).len(), own);
                state = rest;
            }
        });
        all
    }

    /// Returns all bytes: those that are written are also read.
    pub fn bytes(&self) -> f64 {
        self.read + 2.0 * self.written
    }

    /// Returns the sum of two counts.
    pub fn plus(self, other: Self) -> Self {
        Self {
            visited: self.visited + other.visited,
            read: self.read + other.read,
            written: self.written + other.written,
            operations: self.operations + other.operations,
        }
    }

    /// Returns the count divided by `by`.
    pub fn over(self, by: f64) -> Self {
        Self {
            visited: self.visited / by,
            read: self.read / by,
            written: self.written / by,
            operations: self.operations / by,
        }
    }

    /// Counts some ensembles of a bank.
    fn add(&mut self, bank: &Bank, ensembles: usize, state: &[Real]) {
        let (shape, each) = (bank.shape(), bank.state_of(1));
        let (group, padded) = (shape.group(), shape.padded());
        let of = |values: usize| (values * size_of::<Real>()) as f64;
        // Ensembles of a group are passed over together.
        for first in (0..ensembles).step_by(group) {
            let group = first..(first + group).min(ensembles);
            let own = &state[each * group.start..each * group.end];
            let count = group.len();
            if each > 0 && bank.falls_silent() && own.iter().all(|x| *x == 0.0) {
                self.read += of(count * (each + shape.dims));
                continue;
            }
            let neurons = group.start * shape.neurons..group.end * shape.neurons;
            let all = bank.model.firing() == Firing::Rates || shape.outputs == 1;
            let decoded = match all {
                true => count * padded,
                false => neurons.clone().filter(|neuron| bank.spiked(state, *neuron)).count(),
            };
            let stepped = count * padded;
            self.visited += neurons.len() as f64;
            self.read +=
                of(stepped * (1 + shape.columns()) + decoded * shape.outputs + count * shape.dims);
            self.written += of(count * (each + shape.outputs));
            let each_neuron = 1 + shape.encoding() + bank.model.operations() as usize;
            self.operations += (stepped * each_neuron + 2 * decoded * shape.outputs) as f64;
        }
    }
}
