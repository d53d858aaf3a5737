//! Lowers expressions to modules, linear nodes and connections.

use std::sync::Arc;

use super::kinds::FlowKind;
use crate::sim::{
    Constant, In, InputSpec, Kind, Module, Out, OutputSpec, Pointer, PortRef, Real, Scalar, Scope,
    Space, Synapse, Vector, VocabTag, nearest_first,
};
use crate::spa::algebra::{Algebra, LinearMap};
use crate::spa::modules::{
    Bind, Compare, FEED_FORWARD, Inverse, Linear, Multiply, Rows, Superpose, Weigh, WeightedRows,
};
use crate::spa::vocabulary::Content;

/// A weighted sum of outputs plus a constant.
#[doc(hidden)]
pub struct Sum<K: Kind> {
    pub(super) constant: Option<Vec<Real>>,
    pub(super) terms: Vec<(Out<K>, Real)>,
}

impl<K: Kind> Sum<K> {
    pub(super) fn zero() -> Self {
        Self { constant: None, terms: Vec::new() }
    }

    pub(super) fn constant(values: Vec<Real>) -> Self {
        Self { constant: Some(values), terms: Vec::new() }
    }

    pub(super) fn output(out: &Out<K>) -> Self {
        Self { constant: None, terms: vec![(out.clone(), 1.0)] }
    }

    pub(super) fn scaled(mut self, factor: Real) -> Self {
        self.constant.iter_mut().flatten().for_each(|value| *value *= factor);
        self.terms.iter_mut().for_each(|(_, weight)| *weight *= factor);
        self
    }

    /// Returns the values of a constant; `None` if the sum changes.
    pub(super) fn fixed(&self, width: usize) -> Option<Vec<Real>> {
        let zeros = || vec![0.0; width];
        self.terms.is_empty().then(|| self.constant.clone().unwrap_or_else(zeros))
    }

    pub(super) fn is_zero(&self) -> bool {
        self.terms.is_empty() && self.constant.iter().flatten().all(|value| *value == 0.0)
    }
}

/// The scope into which one route is lowered.
#[doc(hidden)]
pub struct Lowerer<'s, 'b> {
    pub(super) scope: &'s mut Scope<'b>,
    text: String,
    /// Synapse on the outputs of bare layers.
    pub(super) bare: Synapse,
    /// Other outputs that get the synapse of bare layers.
    pub(super) beside: Vec<PortRef>,
}

impl<'s, 'b> Lowerer<'s, 'b> {
    pub(super) fn new(scope: &'s mut Scope<'b>, text: &str) -> Self {
        Self { scope, text: text.into(), bare: FEED_FORWARD, beside: Vec::new() }
    }

    pub(super) fn refuse(&mut self, reason: &str) {
        let reason = format!("`{}`: {reason}", self.text);
        self.scope.refuse(reason);
    }

    /// Returns whether an output gets the synapse of bare layers.
    pub(super) fn takes_synapse(&self, port: &PortRef) -> bool {
        self.scope.needs_synapse(port) || self.beside.contains(port)
    }

    /// Connects an output inside an expression. Bare layers need a synapse.
    pub(super) fn connect<K: Kind>(&mut self, from: &Out<K>, to: &In<K>) {
        let via = if self.takes_synapse(&from.port) { self.bare } else { Synapse::None };
        self.scope.connect(from, to, via);
    }

    /// Adds a linear node called `name`.
    pub(super) fn linear<A: Kind, B: Kind>(
        &mut self,
        name: &str,
        from: &Out<A>,
        (input, output): (InputSpec<A>, OutputSpec<B>),
        map: Box<dyn LinearMap>,
    ) -> Out<B> {
        let node = self.add(name, Linear::new(input, output, map));
        self.connect(from, &node.input);
        node.output
    }

    /// Adds a module called `name`, or `name-2` and so on.
    fn add<M: Module>(&mut self, name: &str, module: M) -> M::Ports {
        let name = self.scope.free_name(name);
        self.scope.add(&name, module)
    }

    /// Returns one output that carries the sum.
    pub(super) fn one<K: FlowKind>(&mut self, shape: &K::Shape, sum: Sum<K>) -> Out<K> {
        let width = K::width(shape);
        if let Some(values) = sum.fixed(width) {
            return self.add("constant", Constant::of(K::specs(shape).1, &values));
        }
        let constant = sum.constant.filter(|values| values.iter().any(|value| *value != 0.0));
        if let ([(out, 1.0)], None) = (&*sum.terms, &constant) {
            return out.clone();
        }
        let weights = sum.terms.iter().map(|(_, weight)| *weight).collect();
        let constant = constant.unwrap_or_else(|| vec![0.0; width]);
        let node = self.add("sum", Superpose { specs: K::specs(shape), weights, constant });
        for ((from, _), input) in sum.terms.iter().zip(&node.inputs) {
            self.connect(from, input);
        }
        node.output
    }

    /// Adds two sums of one shape.
    pub(super) fn add_sums<K: FlowKind>(
        &mut self,
        shape: &K::Shape,
        a: Sum<K>,
        b: Sum<K>,
    ) -> Sum<K> {
        let constant = match (a.constant, b.constant) {
            (Some(mut a), Some(b)) => {
                if !self.fits::<K>(shape, &a) || !self.fits::<K>(shape, &b) {
                    return Sum::zero();
                }
                a.iter_mut().zip(&b).for_each(|(a, b)| *a += b);
                Some(a)
            }
            (a, b) => a.or(b),
        };
        Sum { constant, terms: [a.terms, b.terms].concat() }
    }

    fn algebra<V: VocabTag>(&mut self, space: &Space<V>) -> Option<Arc<dyn Algebra>> {
        let algebra = space.attached::<Arc<Content>>().map(|content| content.algebra.clone());
        if algebra.is_none() {
            self.refuse("the space of its pointers has no algebra; expected a vocabulary's space");
        }
        algebra
    }

    /// Returns the pointer called `name` in the vocabulary of the space.
    pub(super) fn named<V: VocabTag>(&mut self, space: &Space<V>, name: &str) -> Sum<Pointer<V>> {
        let content = space.attached::<Arc<Content>>();
        if let Some(values) = content.and_then(|content| content.find(name)) {
            return Sum::constant(values.to_vec());
        }
        let names = content.map_or_else(String::new, |content| {
            nearest_first(name, content.names().iter().map(AsRef::as_ref))
        });
        self.refuse(&format!("{space} has no `{name}`; it has: {names}"));
        Sum::zero()
    }

    /// Checks that a constant has the width of the shape and is finite.
    pub(super) fn fits<K: FlowKind>(&mut self, shape: &K::Shape, constant: &[Real]) -> bool {
        if let Some(wrong) = constant.iter().find(|value| !value.is_finite()) {
            self.refuse(&format!("a constant has the number {wrong}; expected finite numbers"));
            return false;
        }
        let fits = constant.len() == K::width(shape);
        if !fits {
            let (found, expected) = (constant.len(), K::width(shape));
            self.refuse(&format!(
                "a constant has {found} dimensions; expected {expected}, those of {}",
                K::describe(shape)
            ));
        }
        fits
    }

    /// Returns the values of a constant sum that fit the shape: `Err` if they do not fit, `Ok(None)` if the sum changes.
    fn fixed<K: FlowKind>(
        &mut self,
        shape: &K::Shape,
        sum: &Sum<K>,
    ) -> Result<Option<Vec<Real>>, Misfit> {
        match sum.fixed(K::width(shape)) {
            Some(values) if !self.fits::<K>(shape, &values) => Err(Misfit),
            values => Ok(values),
        }
    }

    pub(super) fn bind<V: VocabTag>(
        &mut self,
        space: &Space<V>,
        a: Sum<Pointer<V>>,
        b: Sum<Pointer<V>>,
    ) -> Sum<Pointer<V>> {
        let Some(algebra) = self.algebra(space) else { return Sum::zero() };
        let specs = (InputSpec::pointer(space), OutputSpec::pointer(space));
        let (left, right) = match (self.fixed(space, &a), self.fixed(space, &b)) {
            (Ok(left), Ok(right)) => (left, right),
            _ => return Sum::zero(),
        };
        let (map, changing) = match (left, right) {
            (Some(left), Some(right)) => {
                let mut bound = vec![0.0; space.width()];
                algebra.bind_into(&left, &right, &mut bound, &mut algebra.scratch(space.width()));
                return Sum::constant(bound);
            }
            (Some(left), None) => (algebra.bind_onto(&left), b),
            (None, Some(right)) => (algebra.bind_with(&right), a),
            (None, None) => {
                let (a, b) = (self.one(space, a), self.one(space, b));
                let bind = self.add("bind", Bind::in_space(space, &algebra));
                self.connect(&a, &bind.a);
                self.connect(&b, &bind.b);
                return Sum::output(&bind.output);
            }
        };
        let from = self.one(space, changing);
        Sum::output(&self.linear("bind", &from, specs, map))
    }

    pub(super) fn inverse<V: VocabTag>(
        &mut self,
        space: &Space<V>,
        sum: Sum<Pointer<V>>,
    ) -> Sum<Pointer<V>> {
        let Some(algebra) = self.algebra(space) else { return Sum::zero() };
        let dim = space.width();
        match self.fixed(space, &sum) {
            Err(Misfit) => Sum::zero(),
            Ok(Some(values)) => {
                let mut inverse = vec![0.0; dim];
                algebra.inverse_into(&values, &mut inverse);
                Sum::constant(inverse)
            }
            Ok(None) => {
                let from = self.one(space, sum);
                let specs = (InputSpec::pointer(space), OutputSpec::pointer(space));
                let map = Box::new(Inverse { algebra, dim });
                Sum::output(&self.linear("inverse", &from, specs, map))
            }
        }
    }

    pub(super) fn dot<V: VocabTag>(
        &mut self,
        space: &Space<V>,
        a: Sum<Pointer<V>>,
        b: Sum<Pointer<V>>,
    ) -> Sum<Scalar> {
        let (fixed, changing) = match (self.fixed(space, &a), self.fixed(space, &b)) {
            (Ok(Some(fixed)), Ok(_)) => (fixed, b),
            (Ok(None), Ok(Some(fixed))) => (fixed, a),
            (Ok(None), Ok(None)) => {
                let (a, b) = (self.one(space, a), self.one(space, b));
                let dot = self.add("dot", Compare::in_space(space));
                self.connect(&a, &dot.a);
                self.connect(&b, &dot.b);
                return Sum::output(&dot.output);
            }
            _ => return Sum::zero(),
        };
        let from = self.one(space, changing);
        let specs = (InputSpec::pointer(space), OutputSpec::scalar());
        Sum::output(&self.linear("dot", &from, specs, Box::new(Rows::one(fixed))))
    }

    /// Multiplies a value by a changing number, or by a constant.
    pub(super) fn weigh<K: Weighable>(
        &mut self,
        shape: &K::Shape,
        number: Sum<Scalar>,
        value: Sum<K>,
    ) -> Sum<K> {
        if let Some(factor) = number.fixed(1) {
            return value.scaled(factor.iter().sum());
        }
        let number = self.one(&(), number);
        match self.fixed(shape, &value) {
            Err(Misfit) => Sum::zero(),
            Ok(Some(values)) => {
                let specs = (InputSpec::scalar(), K::specs(shape).1);
                let map = Box::new(WeightedRows::one(values));
                Sum::output(&self.linear("weigh", &number, specs, map))
            }
            Ok(None) => {
                let value = self.one(shape, value);
                let weigh = self.add("weigh", K::weigh(shape));
                self.connect(&number, &weigh.weight);
                self.connect(&value, &weigh.value);
                Sum::output(&weigh.output)
            }
        }
    }

    pub(super) fn multiply(&mut self, a: Sum<Scalar>, b: Sum<Scalar>) -> Sum<Scalar> {
        match (a.fixed(1), b.fixed(1)) {
            (Some(factor), _) => return b.scaled(factor.iter().sum()),
            (_, Some(factor)) => return a.scaled(factor.iter().sum()),
            _ => {}
        }
        let (a, b) = (self.one(&(), a), self.one(&(), b));
        let product = self.add("multiply", Multiply::new());
        self.connect(&a, &product.a);
        self.connect(&b, &product.b);
        Sum::output(&product.output)
    }
}

/// A constant that does not fit its space. The fault is already reported.
struct Misfit;

/// Kinds of values that a changing number can weigh in one layer of products.
pub(super) trait Weighable: FlowKind {
    fn weigh(shape: &Self::Shape) -> Weigh<Self>;
}

impl<V: VocabTag> Weighable for Pointer<V> {
    fn weigh(space: &Space<V>) -> Weigh<Self> {
        Weigh::in_space(space)
    }
}

impl Weighable for Vector {
    fn weigh(width: &usize) -> Weigh<Self> {
        Weigh::vector(*width)
    }
}
