//! The circuit of an ensemble whose neurons have ports: currents in, activities out.

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
        items.step_neurons(&io.inputs.get(0)[items.rows()], currents, io.state, io.results);
    }

    fn collect(&self, copies: Range<usize>, results: &[Real], outputs: &mut Outputs<'_>) {
        let (decoded, activity) = results.split_at(copies.len() * self.outputs);
        let own = copies.start * self.neurons..copies.end * self.neurons;
        outputs.get_mut(self.ensemble.functions.len())[own].copy_from_slice(activity);
        self.ensemble.distribute(copies, decoded, outputs);
    }
}
