//! Linear nodes that only expressions need.

use crate::sim::{
    EmitIo, Fingerprint, InputSpec, Kind, Node, OutputSpec, PortDecl, Real, Scratch, ScratchSpec,
    StepCx,
};
use crate::spa::algebra::LinearMap;

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

/// Scales a vector, or spreads one number over a vector.
pub(super) struct Spread {
    pub from: usize,
    pub to: usize,
    pub factor: Real,
}

impl LinearMap for Spread {
    fn input_width(&self) -> usize {
        self.from
    }

    fn output_width(&self) -> usize {
        self.to
    }

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec::default()
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("spread").number(self.from as u64).number(self.to as u64).reals(&[self.factor]);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        match input {
            [one] => out.fill(self.factor * one),
            _ => out.iter_mut().zip(input).for_each(|(to, from)| *to = self.factor * from),
        }
    }
}
