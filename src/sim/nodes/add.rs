//! The sum of any number of connections.

use crate::sim::describe::builder::{Module, Scope};
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::describe::handle::Ports;
use crate::sim::describe::io::{EmitIo, StepCx};
use crate::sim::describe::kind::{Kind, Pointer, Scalar, Space, Vector, VocabTag};
use crate::sim::describe::node::Node;
use crate::sim::describe::port::{InputSpec, OutputSpec, PortDecl};

/// Adds the values of any number of connections, without delay.
pub struct Add<K: Kind> {
    input: InputSpec<K>,
    output: OutputSpec<K>,
}

impl Add<Scalar> {
    /// Creates a sum of numbers.
    pub fn scalar() -> Self {
        Self { input: InputSpec::scalar().sum(), output: OutputSpec::scalar() }
    }
}

impl Add<Vector> {
    /// Creates a sum of vectors with `width` components.
    pub fn vector(width: usize) -> Self {
        Self { input: InputSpec::vector(width).sum(), output: OutputSpec::vector(width) }
    }
}

impl<V: VocabTag> Add<Pointer<V>> {
    /// Creates a sum of pointers of `space`.
    pub fn pointer(space: &Space<V>) -> Self {
        Self { input: InputSpec::pointer(space).sum(), output: OutputSpec::pointer(space) }
    }
}

impl<K: Kind> Add<K> {
    /// Creates a sum of values like those of a port of any kind.
    pub fn of(input: InputSpec<K>, output: OutputSpec<K>) -> Self {
        Self { input: input.sum(), output }
    }
}

impl<K: Kind> Node for Add<K> {
    fn declare(&self, ports: &mut PortDecl) {
        ports.input("in", self.input.clone()).output("out", self.output.clone());
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        io.outputs.get_mut(0).copy_from_slice(io.inputs.get(0));
    }
}

impl<K: Kind> Module for Add<K> {
    type Ports = Ports<K>;

    fn expand(self, scope: &mut Scope<'_>) -> Ports<K> {
        let node = scope.leaf(self);
        scope.ports(Ports::of(&node))
    }
}
