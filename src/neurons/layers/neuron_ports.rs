//! The circuit of an ensemble whose neurons have ports: currents in, activities and state out.

use std::ops::Range;

use super::{Circuit, Ensemble, Items};
use crate::sim::{Outputs, PartIo, Real};

/// The circuit of an ensemble whose neurons have ports.
pub(super) struct NeuronPorts {
    pub ensemble: Ensemble,
    /// Gain over radius of every neuron.
    pub gains: Vec<Real>,
    /// Number of neurons in a copy.
    pub neurons: usize,
    pub outputs: usize,
    /// Variables of the neurons' state that are outputs.
    pub states: Vec<usize>,
}

impl Circuit for NeuronPorts {
    fn advance(&self, items: &Items<'_>, io: &mut PartIo<'_>) {
        let copies = items.range();
        let own = copies.start * self.neurons..copies.end * self.neurons;
        let currents = &mut io.scratch.reals[..own.len()];
        let [given, encoded] = [1, 2].map(|input| &io.inputs.get(input)[own.clone()]);
        let each = given.iter().zip(encoded).zip(&self.gains[own]);
        for (current, ((given, encoded), gain)) in currents.iter_mut().zip(each) {
            *current = given + gain * encoded;
        }
        let stepped = copies.len() * self.outputs + currents.len();
        let (out, states) = io.results.split_at_mut(stepped);
        items.step_neurons(&io.inputs.get(0)[items.rows()], currents, io.state, out);
        for (index, out) in self.states.iter().zip(states.chunks_exact_mut(currents.len())) {
            items.show(*index, io.state, out);
        }
    }

    fn collect(&self, copies: Range<usize>, results: &[Real], outputs: &mut Outputs<'_>) {
        let (decoded, shown) = results.split_at(copies.len() * self.outputs);
        let own = copies.start * self.neurons..copies.end * self.neurons;
        for (index, shown) in shown.chunks_exact(own.len()).enumerate() {
            let output = outputs.get_mut(self.ensemble.functions.len() + index);
            output[own.clone()].copy_from_slice(shown);
        }
        self.ensemble.distribute(copies, decoded, outputs);
    }
}
