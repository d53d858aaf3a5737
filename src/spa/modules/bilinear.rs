//! Bilinear functions of two changing values: a linear map of each, a layer of products, and a linear map of these.
//!
//! Only the products need neurons. The delay is the synapse behind them.

use super::linear::Linear;
use super::maps::{Rows, Spread};
use super::{FEED_FORWARD, refuse_none};
use crate::neurons::{BilinearPorts, Layers, Product};
use crate::sim::{
    In, InputSpec, Kind, Module, Out, OutputSpec, Pointer, Real, Scalar, Scope, Space, Synapse,
    Vector, VocabTag,
};
use crate::spa::algebra::ProductForm;
use crate::spa::vocabulary::Vocabulary;

/// Components of a random unit pointer lie within this many standard deviations. Factors of products are scaled so
/// that this range fills the range of the neurons.
const WITHIN: Real = 3.5;

/// A bilinear function of two values.
pub(crate) struct Bilinear<A: Kind, B: Kind, C: Kind> {
    pub a: InputSpec<A>,
    pub b: InputSpec<B>,
    pub output: OutputSpec<C>,
    pub form: ProductForm,
    pub synapse: Synapse,
}

impl<A: Kind, B: Kind, C: Kind> Module for Bilinear<A, B, C> {
    type Ports = BilinearPorts<A, B, C>;

    fn expand(self, scope: &mut Scope<'_>) -> BilinearPorts<A, B, C> {
        let ProductForm { pairs, magnitude, left, right, back } = self.form;
        let left = scope.add("left", Linear::new(self.a, OutputSpec::vector(pairs), left));
        let right = scope.add("right", Linear::new(self.b, OutputSpec::vector(pairs), right));
        let products = scope.product("products", Product::new(pairs).radius(magnitude));
        let back = scope.add("back", Linear::new(InputSpec::vector(pairs), self.output, back));
        scope.connect(&left.output, &products.a, Synapse::None);
        scope.connect(&right.output, &products.b, Synapse::None);
        scope.connect(&products.output, &back.input, self.synapse);
        BilinearPorts {
            a: scope.input("a", left.input),
            b: scope.input("b", right.input),
            output: scope.output("output", back.output),
        }
    }
}

/// Returns the factor that makes the components of a unit pointer fill the range of the neurons.
fn filling(dim: usize) -> Real {
    (dim as Real).sqrt() / WITHIN
}

/// The scalar product of two changing pointers, one synapse (5 ms) later.
///
/// In neurons, one product per dimension. A component beyond 3.5 standard deviations of a random unit pointer
/// saturates.
pub struct Compare<V: VocabTag> {
    space: Space<V>,
    synapse: Synapse,
}

impl<V: VocabTag> Compare<V> {
    /// Makes a module that compares pointers of `vocabulary` with a norm of about 1.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        Self::in_space(vocabulary.space())
    }

    pub(crate) fn in_space(space: &Space<V>) -> Self {
        Self { space: space.clone(), synapse: FEED_FORWARD }
    }

    /// Replaces the synapse on the output of the products (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl<V: VocabTag> Module for Compare<V> {
    type Ports = BilinearPorts<Pointer<V>, Pointer<V>, Scalar>;

    fn expand(self, scope: &mut Scope<'_>) -> Self::Ports {
        let dim = self.space.width();
        let factor = filling(dim);
        let form = ProductForm {
            pairs: dim,
            magnitude: 1.0,
            left: Box::new(Spread { from: dim, to: dim, factor }),
            right: Box::new(Spread { from: dim, to: dim, factor }),
            back: Box::new(Rows::one(vec![factor.powi(-2); dim])),
        };
        let (a, b) = (InputSpec::pointer(&self.space), InputSpec::pointer(&self.space));
        let output = OutputSpec::scalar();
        Bilinear { a, b, output, form, synapse: self.synapse }.expand(scope)
    }
}

/// The product of two changing numbers, one synapse (5 ms) later.
pub struct Multiply {
    radius: Real,
    synapse: Synapse,
}

impl Default for Multiply {
    fn default() -> Self {
        Self::new()
    }
}

impl Multiply {
    /// Makes a module for factors between -1 and 1.
    pub fn new() -> Self {
        Self { radius: 1.0, synapse: FEED_FORWARD }
    }

    /// Sets the greatest magnitude of a factor that neurons represent (default 1). Anything but a finite number above 0
    /// is a fault when the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// Replaces the synapse on the output of the product (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl Module for Multiply {
    type Ports = BilinearPorts<Scalar>;

    fn expand(self, scope: &mut Scope<'_>) -> BilinearPorts<Scalar> {
        let same = || Box::new(Spread { from: 1, to: 1, factor: 1.0 });
        let form = ProductForm {
            pairs: 1,
            magnitude: self.radius,
            left: same(),
            right: same(),
            back: same(),
        };
        let (a, b, output) = (InputSpec::scalar(), InputSpec::scalar(), OutputSpec::scalar());
        Bilinear { a, b, output, form, synapse: self.synapse }.expand(scope)
    }
}

/// The product of a changing number and a changing pointer or vector, one synapse (5 ms) later.
pub struct Weigh<K: Kind> {
    specs: (InputSpec<K>, OutputSpec<K>),
    width: usize,
    factor: Real,
    synapse: Synapse,
}

/// Ports of a [`Weigh`].
pub struct WeighPorts<K: Kind> {
    /// Weight, -1 to 1; takes one connection.
    pub weight: In<Scalar>,
    /// Value to weigh; takes one connection.
    pub value: In<K>,
    /// Value times weight.
    pub output: Out<K>,
}

impl<V: VocabTag> Weigh<Pointer<V>> {
    /// Makes a module for pointers of `vocabulary` with a norm of about 1.
    pub fn pointer(vocabulary: &Vocabulary<V>) -> Self {
        Self::in_space(vocabulary.space())
    }

    pub(crate) fn in_space(space: &Space<V>) -> Self {
        let specs = (InputSpec::pointer(space), OutputSpec::pointer(space));
        let width = space.width();
        Self { specs, width, factor: filling(width), synapse: FEED_FORWARD }
    }
}

impl Weigh<Vector> {
    /// Makes a module for vectors of `width` components between -1 and 1.
    pub fn vector(width: usize) -> Self {
        let specs = (InputSpec::vector(width), OutputSpec::vector(width));
        Self { specs, width, factor: 1.0, synapse: FEED_FORWARD }
    }
}

impl<K: Kind> Weigh<K> {
    /// Replaces the synapse on the output of the products (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl<K: Kind> Module for Weigh<K> {
    type Ports = WeighPorts<K>;

    fn expand(self, scope: &mut Scope<'_>) -> WeighPorts<K> {
        let Self { specs: (value, output), width, factor, synapse } = self;
        refuse_none(scope, "components", width);
        let form = ProductForm {
            pairs: width,
            magnitude: 1.0,
            left: Box::new(Spread { from: 1, to: width, factor: 1.0 }),
            right: Box::new(Spread { from: width, to: width, factor }),
            back: Box::new(Spread { from: width, to: width, factor: factor.recip() }),
        };
        let ports =
            Bilinear { a: InputSpec::scalar(), b: value, output, form, synapse }.expand(scope);
        WeighPorts { weight: ports.a, value: ports.b, output: ports.output }
    }
}
