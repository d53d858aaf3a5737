//! Lowers expressions to modules, layers, linear nodes and connections.

use std::sync::Arc;

use super::nodes::{Spread, WeightedSum};
use super::{Destination, Flow, FlowKind};
use crate::neurons::{Layers, Product};
use crate::sim::{
    Constant, In, InputSpec, Kind, Out, OutputSpec, Pointer, Real, Scalar, Scope, Space, Synapse,
    Vector, VocabTag,
};
use crate::spa::algebra::{Algebra, LinearMap};
use crate::spa::modules::{
    Bind, FEED_FORWARD, Gate, Inverse, Linear, LinearPorts, Reinterpret, Rows, WeightedRows,
};
use crate::spa::vocabulary::Content;

/// A weighted sum of pointers plus a constant.
#[doc(hidden)]
pub struct PointerSum<V: VocabTag> {
    pub(super) constant: Option<Vec<Real>>,
    pub(super) parts: Vec<(Out<Pointer<V>>, Real)>,
}

/// A weighted sum of numbers plus a constant.
#[doc(hidden)]
pub struct ScalarSum {
    pub(super) constant: Real,
    pub(super) parts: Vec<(Out<Scalar>, Real)>,
}

/// Components of a random unit pointer lie within this many standard deviations. Factors of products are scaled so
/// that this range fills the range of the neurons.
const WITHIN: Real = 3.5;

/// The scope into which one route is lowered.
#[doc(hidden)]
pub struct Lowerer<'s, 'b> {
    pub(super) scope: &'s mut Scope<'b>,
    text: String,
}

impl<'s, 'b> Lowerer<'s, 'b> {
    pub(super) fn new(scope: &'s mut Scope<'b>, text: &str) -> Self {
        Self { scope, text: text.into() }
    }

    fn refuse(&mut self, reason: &str) {
        let reason = format!("`{}`: {reason}", self.text);
        self.scope.refuse(reason);
    }

    /// Adds a linear node called `name`.
    fn linear<A: Kind, B: Kind>(
        &mut self,
        name: &str,
        from: &Out<A>,
        (input, output): (InputSpec<A>, OutputSpec<B>),
        map: Box<dyn LinearMap>,
    ) -> Out<B> {
        let name = self.scope.free_name(name);
        let node: LinearPorts<A, B> = self.scope.add(&name, Linear::new(input, output, map));
        self.scope.connect(from, &node.input, Synapse::None);
        node.output
    }

    fn weighted<K: Kind>(
        &mut self,
        parts: &[(Out<K>, Real)],
        constant: Vec<Real>,
        (input, output): (InputSpec<K>, OutputSpec<K>),
    ) -> Out<K> {
        let weights = parts.iter().map(|(_, weight)| *weight).collect();
        let name = self.scope.free_name("sum");
        let node = self.scope.node(&name, WeightedSum { input, output, weights, constant });
        for (index, (from, _)) in parts.iter().enumerate() {
            self.scope.connect(from, &node.input(&format!("in{index}")), Synapse::None);
        }
        node.output("out")
    }

    fn constant<V: VocabTag>(&mut self, space: &Space<V>, values: &[Real]) -> Out<Pointer<V>> {
        let value = crate::sim::PointerRef::from_raw(values);
        let name = self.scope.free_name("constant");
        self.scope.add(&name, Constant::pointer(space, &value))
    }

    /// Returns one output that carries the sum.
    pub(super) fn pointer<V: VocabTag>(
        &mut self,
        space: &Space<V>,
        sum: PointerSum<V>,
    ) -> Out<Pointer<V>> {
        match (&*sum.parts, sum.constant) {
            ([(out, 1.0)], None) => out.clone(),
            ([], constant) => {
                let values = constant.unwrap_or_else(|| vec![0.0; space.width()]);
                self.constant(space, &values)
            }
            (parts, constant) => {
                let constant = constant.unwrap_or_else(|| vec![0.0; space.width()]);
                let specs = (InputSpec::pointer(space), OutputSpec::pointer(space));
                self.weighted(parts, constant, specs)
            }
        }
    }

    /// Returns one output that carries the sum.
    pub(super) fn scalar(&mut self, sum: ScalarSum) -> Out<Scalar> {
        match (&*sum.parts, sum.constant) {
            ([(out, 1.0)], 0.0) => out.clone(),
            ([], constant) => {
                let name = self.scope.free_name("constant");
                self.scope.add(&name, Constant::scalar(constant))
            }
            (parts, constant) => {
                let specs = (InputSpec::scalar(), OutputSpec::scalar());
                self.weighted(parts, vec![constant], specs)
            }
        }
    }

    fn algebra<V: VocabTag>(&mut self, space: &Space<V>) -> Option<Arc<dyn Algebra>> {
        let algebra = space.attached::<Arc<Content>>().map(|content| content.algebra.clone());
        if algebra.is_none() {
            self.refuse("the space of its pointers has no algebra; expected a vocabulary's space");
        }
        algebra
    }

    /// Returns the pointer called `name` in the vocabulary of the space.
    pub(super) fn named<V: VocabTag>(&mut self, space: &Space<V>, name: &str) -> PointerSum<V> {
        let content = space.attached::<Arc<Content>>();
        let constant = content.and_then(|content| content.find(name)).map(<[Real]>::to_vec);
        if constant.is_none() {
            let names = content.map_or_else(String::new, |content| content.names().join(", "));
            self.refuse(&format!("{space} has no `{name}`; it has: {names}"));
        }
        PointerSum { constant, parts: Vec::new() }
    }

    /// Checks that a constant has the dimensions of the space.
    fn fits<V: VocabTag>(&mut self, space: &Space<V>, constant: &[Real]) -> bool {
        let fits = constant.len() == space.width();
        if !fits {
            let (found, expected) = (constant.len(), space.width());
            self.refuse(&format!(
                "a constant has {found} dimensions; expected {expected}, those of {space}"
            ));
        }
        fits
    }

    pub(super) fn bind<V: VocabTag>(
        &mut self,
        space: &Space<V>,
        a: PointerSum<V>,
        b: PointerSum<V>,
    ) -> PointerSum<V> {
        let zero = PointerSum { constant: None, parts: Vec::new() };
        let Some(algebra) = self.algebra(space) else { return zero };
        if !a.parts.is_empty() && !b.parts.is_empty() {
            let (a, b) = (self.pointer(space, a), self.pointer(space, b));
            let name = self.scope.free_name("bind");
            let bind = self.scope.add(&name, Bind::in_space(space, &algebra));
            self.scope.connect(&a, &bind.a, Synapse::None);
            self.scope.connect(&b, &bind.b, Synapse::None);
            return FlowKind::source(&bind.output);
        }
        let fixed_left = a.parts.is_empty();
        let (fixed, changing) = if fixed_left { (a, b) } else { (b, a) };
        let Some(fixed) = fixed.constant.filter(|values| self.fits(space, values)) else {
            return zero;
        };
        if changing.parts.is_empty() {
            let Some(right) = changing.constant.filter(|values| self.fits(space, values)) else {
                return zero;
            };
            let mut bound = vec![0.0; space.width()];
            let mut work = algebra.scratch(space.width());
            algebra.bind_into(&fixed, &right, &mut bound, &mut work);
            return PointerSum { constant: Some(bound), parts: Vec::new() };
        }
        let from = self.pointer(space, changing);
        let specs = (InputSpec::pointer(space), OutputSpec::pointer(space));
        let map = match fixed_left {
            true => algebra.bind_onto(&fixed),
            false => algebra.bind_with(&fixed),
        };
        FlowKind::source(&self.linear("bind", &from, specs, map))
    }

    pub(super) fn inverse<V: VocabTag>(
        &mut self,
        space: &Space<V>,
        sum: PointerSum<V>,
    ) -> PointerSum<V> {
        let zero = PointerSum { constant: None, parts: Vec::new() };
        let Some(algebra) = self.algebra(space) else { return zero };
        if sum.parts.is_empty() {
            let Some(values) = sum.constant else { return zero };
            if !self.fits(space, &values) {
                return zero;
            }
            let mut inverse = vec![0.0; space.width()];
            algebra.inverse_into(&values, &mut inverse);
            return PointerSum { constant: Some(inverse), parts: Vec::new() };
        }
        let from = self.pointer(space, sum);
        let specs = (InputSpec::pointer(space), OutputSpec::pointer(space));
        let map = Inverse { algebra, dim: space.width() };
        FlowKind::source(&self.linear("inverse", &from, specs, Box::new(map)))
    }

    pub(super) fn dot<V: VocabTag>(
        &mut self,
        a: &Flow<Pointer<V>>,
        b: &Flow<Pointer<V>>,
    ) -> ScalarSum {
        let zero = ScalarSum { constant: 0.0, parts: Vec::new() };
        let Some(space) = self.space(a).or_else(|| self.space(b)) else {
            self.refuse("the scalar product of two constants; expected an output on one side");
            return zero;
        };
        let (a, b) = ((a.lower)(self, &space), (b.lower)(self, &space));
        let (fixed, changing) = match (a.parts.is_empty(), b.parts.is_empty()) {
            (false, false) => return self.dot_of_two(&space, a, b),
            (true, _) => (a, b),
            (_, true) => (b, a),
        };
        let Some(fixed) = fixed.constant.filter(|fixed| self.fits(&space, fixed)) else {
            return zero;
        };
        let from = self.pointer(&space, changing);
        let specs = (InputSpec::pointer(&space), OutputSpec::scalar());
        FlowKind::source(&self.linear("dot", &from, specs, Box::new(Rows::one(fixed))))
    }

    fn dot_of_two<V: VocabTag>(
        &mut self,
        space: &Space<V>,
        a: PointerSum<V>,
        b: PointerSum<V>,
    ) -> ScalarSum {
        let (a, b) = (self.pointer(space, a), self.pointer(space, b));
        let factor = (space.width() as Real).sqrt() / WITHIN;
        let (a, b) = (self.spread(space, &a, factor), self.spread(space, &b, factor));
        let products = self.products("dot", space.width(), &a, &b);
        let row = Rows::one(vec![factor.powi(-2); space.width()]);
        let specs = (InputSpec::vector(space.width()), OutputSpec::scalar());
        FlowKind::source(&self.linear("dot-sum", &products, specs, Box::new(row)))
    }

    fn spread<V: VocabTag>(
        &mut self,
        space: &Space<V>,
        from: &Out<Pointer<V>>,
        factor: Real,
    ) -> Out<Vector> {
        let dim = space.width();
        let specs = (InputSpec::pointer(space), OutputSpec::vector(dim));
        self.linear("factors", from, specs, Box::new(Spread { from: dim, to: dim, factor }))
    }

    /// Adds a layer of products, and its synapse.
    fn products(
        &mut self,
        name: &str,
        pairs: usize,
        a: &Out<Vector>,
        b: &Out<Vector>,
    ) -> Out<Vector> {
        let name = self.scope.free_name(name);
        let layer = self.scope.product(&name, Product::new(pairs));
        self.scope.connect(a, &layer.a, Synapse::None);
        self.scope.connect(b, &layer.b, Synapse::None);
        let name = self.scope.free_name("products");
        let sum = self.scope.add(&name, crate::sim::Add::vector(pairs));
        self.scope.connect(&layer.output, &sum.input, FEED_FORWARD);
        sum.output
    }

    /// Multiplies a pointer by a changing number, or by a constant.
    pub(super) fn weigh<V: VocabTag>(
        &mut self,
        space: &Space<V>,
        number: ScalarSum,
        pointer: PointerSum<V>,
    ) -> PointerSum<V> {
        if number.parts.is_empty() {
            return <Pointer<V> as FlowKind>::scale(pointer, number.constant);
        }
        let dim = space.width();
        let number = self.scalar(number);
        if pointer.parts.is_empty() {
            let Some(values) = pointer.constant.filter(|values| self.fits(space, values)) else {
                return PointerSum { constant: None, parts: Vec::new() };
            };
            let specs = (InputSpec::scalar(), OutputSpec::pointer(space));
            return FlowKind::source(&self.linear(
                "weigh",
                &number,
                specs,
                Box::new(WeightedRows::one(values)),
            ));
        }
        let factor = (dim as Real).sqrt() / WITHIN;
        let pointer = self.pointer(space, pointer);
        let pointer = self.spread(space, &pointer, factor);
        let specs = (InputSpec::scalar(), OutputSpec::vector(dim));
        let number = self.linear(
            "factors",
            &number,
            specs,
            Box::new(Spread { from: 1, to: dim, factor: 1.0 }),
        );
        let products = self.products("weigh", dim, &number, &pointer);
        let specs = (InputSpec::vector(dim), OutputSpec::pointer(space));
        let back = Spread { from: dim, to: dim, factor: factor.recip() };
        FlowKind::source(&self.linear("weighed", &products, specs, Box::new(back)))
    }

    pub(super) fn multiply(&mut self, a: ScalarSum, b: ScalarSum) -> ScalarSum {
        match (a.parts.is_empty(), b.parts.is_empty()) {
            (true, _) => return <Scalar as FlowKind>::scale(b, a.constant),
            (_, true) => return <Scalar as FlowKind>::scale(a, b.constant),
            _ => {}
        }
        let one = |cx: &mut Self, sum| {
            let from = cx.scalar(sum);
            let name = cx.scope.free_name("factors");
            let kinds = Reinterpret::new(InputSpec::scalar(), OutputSpec::vector(1));
            let node = cx.scope.add(&name, kinds);
            cx.scope.connect(&from, &node.input, Synapse::None);
            node.output
        };
        let (a, b) = (one(self, a), one(self, b));
        let product = self.products("multiply", 1, &a, &b);
        let specs = (InputSpec::vector(1), OutputSpec::scalar());
        FlowKind::source(&self.linear(
            "multiplied",
            &product,
            specs,
            Box::new(Rows::one(vec![1.0])),
        ))
    }

    /// Returns the space of an expression's outputs; `None` if it has only constants.
    fn space<V: VocabTag>(&self, flow: &Flow<Pointer<V>>) -> Option<Space<V>> {
        flow.sources.iter().find_map(|out| self.scope.space_of(out))
    }

    /// Connects outputs to an input that adds its connections.
    fn connect_each<K: Kind>(&mut self, parts: &mut Vec<(Out<K>, Real)>, to: &Destination<'_, K>) {
        parts.retain(|(out, weight)| {
            let plain = *weight == 1.0;
            if plain {
                self.scope.connect(out, to.input, to.via);
            }
            !plain
        });
    }
}

impl<V: VocabTag> FlowKind for Pointer<V> {
    type Sum = PointerSum<V>;
    type Context = Space<V>;

    fn source(out: &Out<Self>) -> PointerSum<V> {
        PointerSum { constant: None, parts: vec![(out.clone(), 1.0)] }
    }

    fn add(a: PointerSum<V>, b: PointerSum<V>) -> PointerSum<V> {
        let constant = match (a.constant, b.constant) {
            (Some(mut a), Some(b)) => {
                a.iter_mut().zip(&b).for_each(|(a, b)| *a += b);
                Some(a)
            }
            (a, b) => a.or(b),
        };
        PointerSum { constant, parts: [a.parts, b.parts].concat() }
    }

    fn scale(mut a: PointerSum<V>, factor: Real) -> PointerSum<V> {
        a.constant.iter_mut().flatten().for_each(|value| *value *= factor);
        a.parts.iter_mut().for_each(|(_, weight)| *weight *= factor);
        a
    }

    fn finish(cx: &mut Lowerer<'_, '_>, flow: &Flow<Self>, to: &Destination<'_, Self>) {
        let space = cx.space(flow).or_else(|| cx.scope.space_of_input(to.input));
        // A faulty handle is reported when it is connected.
        let Some(space) = space else {
            if let [out, ..] = &*flow.sources {
                cx.scope.connect(out, to.input, to.via);
            }
            return;
        };
        let mut sum = (flow.lower)(cx, &space);
        if sum.constant.as_ref().is_some_and(|values| !cx.fits(&space, values)) {
            return;
        }
        let Some(open) = to.open else {
            if cx.scope.adds(to.input) {
                cx.connect_each(&mut sum.parts, to);
                if sum.parts.is_empty() && sum.constant.is_none() {
                    return;
                }
            }
            let out = cx.pointer(&space, sum);
            cx.scope.connect(&out, to.input, to.via);
            return;
        };
        let passed = match (sum.parts.is_empty(), sum.constant.take()) {
            (true, Some(values)) => {
                let specs = (InputSpec::scalar(), OutputSpec::pointer(&space));
                let out = cx.linear("constant", open, specs, Box::new(WeightedRows::one(values)));
                cx.scope.connect(&out, to.input, to.after_gate());
                return;
            }
            (_, constant) => {
                let out = cx.pointer(&space, PointerSum { constant, ..sum });
                let name = cx.scope.free_name("gate");
                let gate = cx.scope.add(&name, Gate::in_space(&space));
                cx.scope.connect(&out, &gate.input, Synapse::None);
                // In neurons a chosen rule may have an activity of 0.9, which leaves a gate half closed.
                let open = ScalarSum { constant: 0.0, parts: vec![(open.clone(), 2.0)] };
                let open = cx.scalar(open);
                cx.scope.connect(&open, &gate.open, Synapse::None);
                gate.output
            }
        };
        cx.scope.connect(&passed, to.input, to.via);
    }
}

impl FlowKind for Scalar {
    type Sum = ScalarSum;
    type Context = ();

    fn source(out: &Out<Self>) -> ScalarSum {
        ScalarSum { constant: 0.0, parts: vec![(out.clone(), 1.0)] }
    }

    fn add(a: ScalarSum, b: ScalarSum) -> ScalarSum {
        ScalarSum { constant: a.constant + b.constant, parts: [a.parts, b.parts].concat() }
    }

    fn scale(mut a: ScalarSum, factor: Real) -> ScalarSum {
        a.constant *= factor;
        a.parts.iter_mut().for_each(|(_, weight)| *weight *= factor);
        a
    }

    fn finish(cx: &mut Lowerer<'_, '_>, flow: &Flow<Self>, to: &Destination<'_, Self>) {
        let mut sum = (flow.lower)(cx, &());
        let mut via = to.via;
        if let Some(open) = to.open {
            if sum.parts.is_empty() {
                via = to.after_gate();
            }
            sum = cx.multiply(FlowKind::source(open), sum);
        }
        let to = &Destination { via, ..*to };
        if cx.scope.adds(to.input) {
            cx.connect_each(&mut sum.parts, to);
            if sum.parts.is_empty() && sum.constant == 0.0 {
                return;
            }
        }
        let out = cx.scalar(sum);
        cx.scope.connect(&out, to.input, to.via);
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
    sum: ScalarSum,
    index: usize,
    to: (&In<Vector>, usize),
) {
    let mut column = vec![0.0; to.1];
    column[index] = 1.0;
    let from = cx.scalar(sum);
    let specs = (InputSpec::scalar(), OutputSpec::vector(to.1));
    let out = cx.linear("utility", &from, specs, Box::new(WeightedRows::one(column)));
    cx.scope.connect(&out, to.0, Synapse::None);
}
