//! Binding and unbinding of two changing pointers, or of a changing pointer with a fixed role.
//!
//! Two changing pointers are bound by a linear map of each, a layer of products, and a linear map of the products.
//! Holographic reduced representations need 2 D + 4 products (Plate 1995, in the half spectrum). The delay of the
//! module is the synapse of the layer. Binding with a fixed vector is linear and costs no tick.

use std::sync::Arc;

use super::FEED_FORWARD;
use super::bilinear::Bilinear;
use super::linear::{Linear, LinearPorts};
use crate::sim::{
    Fingerprint, In, InputSpec, Module, Out, OutputSpec, Pointer, Real, Scope, Scratch,
    ScratchSpec, Space, Synapse, VocabTag,
};
use crate::spa::algebra::{Algebra, LinearMap};
use crate::spa::error::VocabError;
use crate::spa::vocabulary::Vocabulary;

/// Binds two changing pointers: `out = a (*) b`, one synapse (5 ms) later.
///
/// In neurons, a layer of products computes the binding. [`Hrr`](crate::spa::Hrr) with an even number D of dimensions
/// needs 2 D + 4 products.
pub struct Bind<V: VocabTag> {
    space: Space<V>,
    algebra: Arc<dyn Algebra>,
    synapse: Synapse,
}

/// Ports of a [`Bind`].
pub struct BindPorts<V: VocabTag> {
    /// First pointer; takes one connection.
    pub a: In<Pointer<V>>,
    /// Second pointer; takes one connection.
    pub b: In<Pointer<V>>,
    /// Binding of the two pointers.
    pub output: Out<Pointer<V>>,
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
    type Ports = BindPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> BindPorts<V> {
        let (a, b) = (InputSpec::pointer(&self.space), InputSpec::pointer(&self.space));
        let output = OutputSpec::pointer(&self.space);
        let form = self.algebra.product_form(self.space.width());
        let ports = Bilinear { a, b, output, form, synapse: self.synapse }.expand(scope);
        BindPorts { a: ports.a, b: ports.b, output: ports.output }
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

/// The algebra's inverse as a linear map.
pub(crate) struct Inverse {
    pub algebra: Arc<dyn Algebra>,
    pub dim: usize,
}

impl LinearMap for Inverse {
    fn input_width(&self) -> usize {
        self.dim
    }

    fn output_width(&self) -> usize {
        self.dim
    }

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec::default()
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("inverse").text(self.algebra.name());
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], _scratch: &mut Scratch<'_>) {
        self.algebra.inverse_into(input, out);
    }
}

impl<V: VocabTag> Module for Unbind<V> {
    type Ports = UnbindPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> UnbindPorts<V> {
        let space = self.bind.space.clone();
        let map = Inverse { algebra: self.bind.algebra.clone(), dim: space.width() };
        let inverse: LinearPorts<Pointer<V>, Pointer<V>> = scope.add(
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

/// Unbinds a fixed role from a changing pointer: `out = bound (*) inverse(role)`.
///
/// This is a linear map: it needs no neurons and costs no tick of delay.
pub struct UnbindFixed<V: VocabTag> {
    space: Space<V>,
    map: Box<dyn LinearMap>,
}

/// Ports of an [`UnbindFixed`].
pub type UnbindFixedPorts<V> = LinearPorts<Pointer<V>, Pointer<V>>;

impl<V: VocabTag> UnbindFixed<V> {
    /// Makes a module that unbinds `role`, an expression over `vocabulary`.
    ///
    /// # Errors
    /// As for [`Vocabulary::parse`]: an invalid expression, or a name that the vocabulary does not have.
    pub fn new(vocabulary: &Vocabulary<V>, role: &str) -> Result<Self, VocabError> {
        let role = vocabulary.parse(role)?;
        let mut inverse = vec![0.0; vocabulary.dim()];
        vocabulary.algebra().inverse_into(&role, &mut inverse);
        Ok(Self {
            space: vocabulary.space().clone(),
            map: vocabulary.algebra().bind_with(&inverse),
        })
    }
}

impl<V: VocabTag> Module for UnbindFixed<V> {
    type Ports = UnbindFixedPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> UnbindFixedPorts<V> {
        Linear::new(InputSpec::pointer(&self.space), OutputSpec::pointer(&self.space), self.map)
            .expand(scope)
    }
}
