//! Weighted sums. They need no neurons and cost no tick.

use crate::sim::{
    EmitIo, Fingerprint, In, InputSpec, Kind, Module, Node, Out, OutputSpec, Pointer, PortDecl,
    Real, Scope, Space, StepCx, VocabTag,
};
use crate::spa::vocabulary::Vocabulary;

/// A weighted sum of values of one kind, such as pointers of one vocabulary. Needs no neurons and no tick of delay.
/// Computing it takes O(weights x dimensions) per tick.
///
/// [`State`](super::State) represents a sum in neurons.
pub struct Superpose<K: Kind> {
    pub(crate) specs: (InputSpec<K>, OutputSpec<K>),
    pub(crate) weights: Vec<Real>,
    /// Added to the sum.
    pub(crate) constant: Vec<Real>,
}

/// Ports of a [`Superpose`].
pub struct SuperposePorts<K: Kind> {
    /// Inputs, one per weight; each takes one connection.
    pub inputs: Vec<In<K>>,
    /// Weighted sum of the inputs.
    pub output: Out<K>,
}

impl<V: VocabTag> Superpose<Pointer<V>> {
    /// Makes a module that adds pointers of `vocabulary`, one per weight.
    ///
    /// A weight that is not finite is a fault when the graph is built.
    pub fn new(vocabulary: &Vocabulary<V>, weights: &[Real]) -> Self {
        Self::in_space(vocabulary.space(), weights)
    }

    pub(super) fn in_space(space: &Space<V>, weights: &[Real]) -> Self {
        let specs = (InputSpec::pointer(space), OutputSpec::pointer(space));
        Self { specs, weights: weights.to_vec(), constant: vec![0.0; space.width()] }
    }
}

fn check_finite(weights: &[Real], constant: &[Real], ports: &mut PortDecl) {
    if let Some(wrong) = weights.iter().chain(constant).find(|value| !value.is_finite()) {
        ports.fault(format!("the sum has the number {wrong}; expected finite numbers"));
    }
}

impl<K: Kind> Node for Superpose<K> {
    fn declare(&self, ports: &mut PortDecl) {
        check_finite(&self.weights, &self.constant, ports);
        for index in 0..self.weights.len() {
            ports.input(&format!("in{index}"), self.specs.0.clone());
        }
        ports.output("out", self.specs.1.clone());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&self.weights).reals(&self.constant);
    }

    fn weight(&self, input: usize) -> Option<Real> {
        self.weights.get(input).copied()
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

impl<K: Kind> Module for Superpose<K> {
    type Ports = SuperposePorts<K>;

    fn expand(self, scope: &mut Scope<'_>) -> SuperposePorts<K> {
        let count = self.weights.len();
        let node = scope.leaf(self);
        SuperposePorts {
            inputs: (0..count)
                .map(|i| scope.input(&format!("inputs[{i}]"), node.input(&format!("in{i}"))))
                .collect(),
            output: scope.output("output", node.output("out")),
        }
    }
}
