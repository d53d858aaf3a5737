//! Lowers expressions to modules, linear nodes and connections.

use std::sync::Arc;

use super::kinds::{FlowKind, Gating};
use super::nodes::WeightedSum;
use super::{Destination, Flow, Source};
use crate::sim::{
    Constant, In, InputSpec, Kind, Module, Out, OutputSpec, Pointer, PortRef, Real, Scalar, Scope,
    Space, Synapse, Vector, VocabTag,
};
use crate::spa::algebra::{Algebra, LinearMap};
use crate::spa::modules::{
    Bind, Compare, FEED_FORWARD, Inverse, Linear, LinearPorts, Multiply, Rows, Weigh, WeighPorts,
    WeightedRows,
};
use crate::spa::vocabulary::Content;

/// A weighted sum of outputs plus a constant.
#[doc(hidden)]
pub struct Sum<K: Kind> {
    constant: Option<Vec<Real>>,
    parts: Vec<(Out<K>, Real)>,
}

impl<K: Kind> Sum<K> {
    pub(super) fn zero() -> Self {
        Self { constant: None, parts: Vec::new() }
    }

    pub(super) fn constant(values: Vec<Real>) -> Self {
        Self { constant: Some(values), parts: Vec::new() }
    }

    pub(super) fn output(out: &Out<K>) -> Self {
        Self { constant: None, parts: vec![(out.clone(), 1.0)] }
    }

    pub(super) fn scaled(mut self, factor: Real) -> Self {
        self.constant.iter_mut().flatten().for_each(|value| *value *= factor);
        self.parts.iter_mut().for_each(|(_, weight)| *weight *= factor);
        self
    }

    /// Returns the values of a constant; `None` if the sum changes.
    pub(super) fn fixed(&self, width: usize) -> Option<Vec<Real>> {
        let zeros = || vec![0.0; width];
        self.parts.is_empty().then(|| self.constant.clone().unwrap_or_else(zeros))
    }

    fn is_zero(&self) -> bool {
        self.parts.is_empty() && self.constant.iter().flatten().all(|value| *value == 0.0)
    }
}

/// The scope into which one route is lowered.
#[doc(hidden)]
pub struct Lowerer<'s, 'b> {
    pub(super) scope: &'s mut Scope<'b>,
    text: String,
    /// Synapse on the outputs of bare layers.
    bare: Synapse,
}

impl<'s, 'b> Lowerer<'s, 'b> {
    pub(super) fn new(scope: &'s mut Scope<'b>, text: &str) -> Self {
        Self { scope, text: text.into(), bare: FEED_FORWARD }
    }

    pub(super) fn refuse(&mut self, reason: &str) {
        let reason = format!("`{}`: {reason}", self.text);
        self.scope.refuse(reason);
    }

    /// Connects an output inside an expression. Bare layers need a synapse.
    pub(super) fn connect<K: Kind>(&mut self, from: &Out<K>, to: &In<K>) {
        let via = if self.scope.needs_synapse(&from.port) { self.bare } else { Synapse::None };
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
        let node: LinearPorts<A, B> = self.add(name, Linear::new(input, output, map));
        self.connect(from, &node.input);
        node.output
    }

    /// Adds a module called `name`, or `name-2` and so on.
    fn add<M: Module>(&mut self, name: &str, module: M) -> M::Ports {
        let name = self.scope.free_name(name);
        self.scope.add(&name, module)
    }

    /// Returns the shape of an expression; `None` if only its target determines it.
    pub(super) fn shape<K: FlowKind>(&self, flow: &Flow<K>) -> Option<K::Shape> {
        let known = flow.sources.iter().find_map(|source| match source {
            Source::Output(out) => K::shape_of(self.scope, out),
            Source::Shape(shape) => Some(shape.clone()),
        });
        known.or_else(K::only_shape)
    }

    /// Returns one output that carries the sum.
    pub(super) fn one<K: FlowKind>(&mut self, shape: &K::Shape, sum: Sum<K>) -> Out<K> {
        let width = K::width(shape);
        if let Some(values) = sum.fixed(width) {
            return self.add("constant", Constant::of(K::specs(shape).1, &values));
        }
        let constant = sum.constant.filter(|values| values.iter().any(|value| *value != 0.0));
        if let ([(out, 1.0)], None) = (&*sum.parts, &constant) {
            return out.clone();
        }
        let (input, output) = K::specs(shape);
        let weights = sum.parts.iter().map(|(_, weight)| *weight).collect();
        let constant = constant.unwrap_or_else(|| vec![0.0; width]);
        let name = self.scope.free_name("sum");
        let node = self.scope.node(&name, WeightedSum { input, output, weights, constant });
        for (index, (from, _)) in sum.parts.iter().enumerate() {
            self.connect(from, &node.input(&format!("in{index}")));
        }
        node.output("out")
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
        Sum { constant, parts: [a.parts, b.parts].concat() }
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
        let names = content.map_or_else(String::new, |content| content.names().join(", "));
        self.refuse(&format!("{space} has no `{name}`; it has: {names}"));
        Sum::zero()
    }

    /// Checks that a constant has the width of the shape and is finite.
    fn fits<K: FlowKind>(&mut self, shape: &K::Shape, constant: &[Real]) -> bool {
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
        a: &Flow<Pointer<V>>,
        b: &Flow<Pointer<V>>,
    ) -> Sum<Scalar> {
        let Some(space) = self.shape(a).or_else(|| self.shape(b)) else {
            self.refuse("the scalar product of two constants; expected an output on one side");
            return Sum::zero();
        };
        let (a, b) = ((a.lower)(self, &space), (b.lower)(self, &space));
        let (fixed, changing) = match (self.fixed(&space, &a), self.fixed(&space, &b)) {
            (Ok(Some(fixed)), Ok(_)) => (fixed, b),
            (Ok(None), Ok(Some(fixed))) => (fixed, a),
            (Ok(None), Ok(None)) => {
                let (a, b) = (self.one(&space, a), self.one(&space, b));
                let dot = self.add("dot", Compare::in_space(&space));
                self.connect(&a, &dot.a);
                self.connect(&b, &dot.b);
                return Sum::output(&dot.output);
            }
            _ => return Sum::zero(),
        };
        let from = self.one(&space, changing);
        let specs = (InputSpec::pointer(&space), OutputSpec::scalar());
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
                let weigh = K::weigh(shape);
                let weigh: WeighPorts<K> = self.add("weigh", weigh);
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

    /// Lowers an expression, and connects it to its destination.
    pub(super) fn finish<K: FlowKind>(&mut self, flow: &Flow<K>, to: &Destination<'_, K>) {
        let shape = self.shape(flow).or_else(|| K::shape_of_input(self.scope, to.input));
        // A faulty handle is reported when it is connected.
        let Some(shape) = shape else {
            if let Some(Source::Output(out)) = flow.sources.first() {
                self.scope.connect(out, to.input, to.via);
            }
            return;
        };
        let bare = |port: &PortRef| self.scope.needs_synapse(port);
        let (mut via, all_bare) = (to.via, !flow.leaves.is_empty() && flow.leaves.iter().all(bare));
        if all_bare && to.open.is_none() {
            self.bare = if via == Synapse::None { FEED_FORWARD } else { via };
            via = Synapse::None;
        }
        let mut sum = (flow.lower)(self, &shape);
        if sum.constant.as_ref().is_some_and(|values| !self.fits::<K>(&shape, values)) {
            return;
        }
        if let Some(open) = to.open {
            if sum.parts.is_empty() {
                via = to.after_gate(open);
            }
            sum = K::gated(&mut Gating { cx: self, open }, &shape, sum);
        }
        if self.scope.adds(to.input) {
            let before = sum.parts.len();
            sum.parts.retain(|(out, weight)| {
                let plain = *weight == 1.0;
                if plain {
                    let bare = self.scope.needs_synapse(&out.port) && via == Synapse::None;
                    self.scope.connect(out, to.input, if bare { self.bare } else { via });
                }
                !plain
            });
            if sum.parts.len() < before && sum.is_zero() {
                return;
            }
        }
        let out = self.one(&shape, sum);
        let bare = self.scope.needs_synapse(&out.port) && via == Synapse::None;
        self.scope.connect(&out, to.input, if bare { self.bare } else { via });
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

/// Picks one component of a vector as a number.
pub(super) fn pick(
    cx: &mut Lowerer<'_, '_>,
    from: &Out<Vector>,
    index: usize,
    of: usize,
) -> Out<Scalar> {
    let mut row = vec![0.0; of];
    row[index] = 1.0;
    cx.linear(
        "chosen",
        from,
        (InputSpec::vector(of), OutputSpec::scalar()),
        Box::new(Rows::one(row)),
    )
}

/// Adds a number to one component of a vector.
pub(super) fn place(
    cx: &mut Lowerer<'_, '_>,
    sum: Sum<Scalar>,
    index: usize,
    to: (&In<Vector>, usize),
) {
    let mut column = vec![0.0; to.1];
    column[index] = 1.0;
    let from = cx.one(&(), sum);
    let specs = (InputSpec::scalar(), OutputSpec::vector(to.1));
    let out = cx.linear("utility", &from, specs, Box::new(WeightedRows::one(column)));
    cx.scope.connect(&out, to.0, Synapse::None);
}
