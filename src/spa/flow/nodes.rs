//! The sum of an expression: a weighted sum of outputs plus a constant.

use crate::sim::{EmitIo, Fingerprint, InputSpec, Kind, Node, OutputSpec, PortDecl, Real, StepCx};

/// A weighted sum of inputs plus a constant. Costs no tick.
pub(super) struct WeightedSum<K: Kind> {
    pub input: InputSpec<K>,
    pub output: OutputSpec<K>,
    pub weights: Vec<Real>,
    pub constant: Vec<Real>,
}

impl<K: Kind> Node for WeightedSum<K> {
    fn declare(&self, ports: &mut PortDecl) {
        let mut numbers = self.weights.iter().chain(&self.constant);
        if let Some(wrong) = numbers.find(|value| !value.is_finite()) {
            ports.fault(format!("the sum has the number {wrong}; expected finite numbers"));
        }
        for index in 0..self.weights.len() {
            ports.input(&format!("in{index}"), self.input.clone());
        }
        ports.output("out", self.output.clone());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&self.weights).reals(&self.constant);
    }

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let output = io.outputs.get_mut(0);
        output.copy_from_slice(&self.constant);
        for (index, weight) in self.weights.iter().enumerate() {
            for (sum, value) in output.iter_mut().zip(io.inputs.get(index)) {
                *sum += weight * value;
            }
        }
    }
}
