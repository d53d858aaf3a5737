//! Binding and unbinding of two changing pointers.
//!
//! Two changing pointers are bound by a linear map of each, a layer of products, and a linear map of the products.
//! Holographic reduced representations need 2 D - 2 products for even D and 2 D - 1 for odd D (Plate 1995, in the half
//! spectrum). The delay of the module is the synapse of the layer.

use std::sync::Arc;

use super::FEED_FORWARD;
use super::bilinear::Bilinear;
use super::linear::Linear;
use super::maps::Inverse;
use crate::neurons::BilinearPorts;
use crate::sim::{
    In, InputSpec, Module, Out, OutputSpec, Pointer, Scope, Space, Synapse, VocabTag,
};
use crate::spa::algebra::Algebra;
use crate::spa::vocabulary::Vocabulary;

/// Binds two changing pointers: `out = a (*) b`, one synapse (5 ms) later.
///
/// In neurons, a layer of products computes the binding. [`Hrr`](crate::spa::Hrr) with an even number D of dimensions
/// needs 2 D - 2 products. To bind or unbind a fixed pointer, [`Linear::unbind`] and
/// [expressions](crate::spa::flow) need none.
pub struct Bind<V: VocabTag> {
    space: Space<V>,
    algebra: Arc<dyn Algebra>,
    synapse: Synapse,
}

impl<V: VocabTag> Bind<V> {
    /// Makes a module that binds in the space of `vocabulary`, by its algebra.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        Self::in_space(vocabulary.space(), vocabulary.algebra())
    }

    pub(crate) fn in_space(space: &Space<V>, algebra: &Arc<dyn Algebra>) -> Self {
        Self { space: space.clone(), algebra: algebra.clone(), synapse: FEED_FORWARD }
    }

    /// Replaces the synapse on the output of the products (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl<V: VocabTag> Module for Bind<V> {
    type Ports = BilinearPorts<Pointer<V>>;

    fn expand(self, scope: &mut Scope<'_>) -> BilinearPorts<Pointer<V>> {
        let (a, b) = (InputSpec::pointer(&self.space), InputSpec::pointer(&self.space));
        let output = OutputSpec::pointer(&self.space);
        let form = self.algebra.product_form(self.space.width());
        Bilinear { a, b, output, form, synapse: self.synapse }.expand(scope)
    }
}

/// Unbinds a changing role from a changing pointer: `out = bound (*) inverse(role)`, one synapse (5 ms) later.
///
/// Costs as much as [`Bind`]. The inverse is a linear map and costs no tick.
pub struct Unbind<V: VocabTag> {
    bind: Bind<V>,
}

/// Ports of an [`Unbind`].
pub struct UnbindPorts<V: VocabTag> {
    /// Bound pointer; takes one connection.
    pub bound: In<Pointer<V>>,
    /// Role to unbind; takes one connection.
    pub role: In<Pointer<V>>,
    /// Pointer that was bound to the role, with noise unless the inverse is exact.
    pub output: Out<Pointer<V>>,
}

impl<V: VocabTag> Unbind<V> {
    /// Makes a module that unbinds in the space of `vocabulary`, by its algebra.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        Self { bind: Bind::new(vocabulary) }
    }

    /// Replaces the synapse on the output of the products (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.bind.synapse = synapse;
        self
    }
}

impl<V: VocabTag> Module for Unbind<V> {
    type Ports = UnbindPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> UnbindPorts<V> {
        let space = self.bind.space.clone();
        let map = Inverse { algebra: self.bind.algebra.clone(), dim: space.width() };
        let inverse = scope.add(
            "inverse",
            Linear::new(InputSpec::pointer(&space), OutputSpec::pointer(&space), Box::new(map)),
        );
        let bind = scope.add("bind", self.bind);
        scope.connect(&inverse.output, &bind.b, Synapse::None);
        UnbindPorts {
            bound: scope.input("bound", bind.a),
            role: scope.input("role", inverse.input),
            output: scope.output("output", bind.output),
        }
    }
}
