//! The kinds of values that expressions compute with: scalars, vectors, and pointers of a vocabulary.

use super::lower::{Lowerer, Sum};
use super::{Gates, Opening};
use crate::sim::{
    In, InputSpec, Kind, Out, OutputSpec, Pointer, Scalar, Scope, Space, Synapse, Vector, VocabTag,
};
use crate::spa::modules::{Gate, WeightedRows};

/// A kind of value that expressions compute with: [`Scalar`], [`Vector`] and [`Pointer`].
pub trait FlowKind: Kind + Sized {
    /// What determines the ports of this kind: nothing, a width, or a space.
    #[doc(hidden)]
    type Shape: Clone;

    #[doc(hidden)]
    fn width(shape: &Self::Shape) -> usize;

    #[doc(hidden)]
    fn specs(shape: &Self::Shape) -> (InputSpec<Self>, OutputSpec<Self>);

    /// Names the values of a shape in messages.
    #[doc(hidden)]
    fn describe(shape: &Self::Shape) -> String;

    /// The shape if all values of this kind have the same.
    #[doc(hidden)]
    fn only_shape() -> Option<Self::Shape> {
        None
    }

    #[doc(hidden)]
    fn shape_of(scope: &Scope<'_>, output: &Out<Self>) -> Option<Self::Shape>;

    #[doc(hidden)]
    fn shape_of_input(scope: &Scope<'_>, input: &In<Self>) -> Option<Self::Shape>;

    /// Lets a sum pass while `open` is 1.
    #[doc(hidden)]
    fn gated(cx: &mut Gating<'_, '_, '_>, shape: &Self::Shape, sum: Sum<Self>) -> Sum<Self>;
}

/// Where a gate is added, and the scalar that opens it.
#[doc(hidden)]
pub struct Gating<'g, 's, 'b> {
    pub(super) cx: &'g mut Lowerer<'s, 'b>,
    pub(super) open: &'g Opening,
}

impl Gating<'_, '_, '_> {
    /// Returns the constant of `sum` times `open`; `None` if the sum changes.
    fn constant<K: FlowKind>(&mut self, shape: &K::Shape, sum: &Sum<K>) -> Option<Sum<K>> {
        let values = sum.fixed(K::width(shape))?;
        let specs = (InputSpec::scalar(), K::specs(shape).1);
        let map = Box::new(WeightedRows::one(values));
        Some(Sum::output(&self.cx.linear("constant", &self.open.by, specs, map)))
    }
}

impl FlowKind for Scalar {
    type Shape = ();

    fn width((): &()) -> usize {
        1
    }

    fn specs((): &()) -> (InputSpec<Self>, OutputSpec<Self>) {
        (InputSpec::scalar(), OutputSpec::scalar())
    }

    fn describe((): &()) -> String {
        "a number".into()
    }

    fn only_shape() -> Option<()> {
        Some(())
    }

    fn shape_of(_: &Scope<'_>, _: &Out<Self>) -> Option<()> {
        Some(())
    }

    fn shape_of_input(_: &Scope<'_>, _: &In<Self>) -> Option<()> {
        Some(())
    }

    fn gated(cx: &mut Gating<'_, '_, '_>, (): &(), sum: Sum<Self>) -> Sum<Self> {
        cx.cx.multiply(Sum::output(&cx.open.by), sum)
    }
}

impl FlowKind for Vector {
    type Shape = usize;

    fn width(width: &usize) -> usize {
        *width
    }

    fn specs(width: &usize) -> (InputSpec<Self>, OutputSpec<Self>) {
        (InputSpec::vector(*width), OutputSpec::vector(*width))
    }

    fn describe(width: &usize) -> String {
        format!("a vector of {width}")
    }

    fn shape_of(scope: &Scope<'_>, output: &Out<Self>) -> Option<usize> {
        scope.width_of(output)
    }

    fn shape_of_input(scope: &Scope<'_>, input: &In<Self>) -> Option<usize> {
        scope.width_of_input(input)
    }

    fn gated(cx: &mut Gating<'_, '_, '_>, width: &usize, sum: Sum<Self>) -> Sum<Self> {
        match cx.constant(width, &sum) {
            Some(constant) => constant,
            None => cx.cx.weigh(width, Sum::output(&cx.open.by), sum),
        }
    }
}

impl<V: VocabTag> FlowKind for Pointer<V> {
    type Shape = Space<V>;

    fn width(space: &Space<V>) -> usize {
        space.width()
    }

    fn specs(space: &Space<V>) -> (InputSpec<Self>, OutputSpec<Self>) {
        (InputSpec::pointer(space), OutputSpec::pointer(space))
    }

    fn describe(space: &Space<V>) -> String {
        space.to_string()
    }

    fn shape_of(scope: &Scope<'_>, output: &Out<Self>) -> Option<Space<V>> {
        scope.space_of(output)
    }

    fn shape_of_input(scope: &Scope<'_>, input: &In<Self>) -> Option<Space<V>> {
        scope.space_of_input(input)
    }

    fn gated(cx: &mut Gating<'_, '_, '_>, space: &Space<V>, sum: Sum<Self>) -> Sum<Self> {
        if let Some(constant) = cx.constant(space, &sum) {
            return constant;
        }
        let Gating { cx, open } = cx;
        let out = cx.one(space, sum);
        let name = cx.scope.free_name("gate");
        let Gates { radius, synapse, inhibition } = open.gates;
        let gate = Gate::in_space(space).radius(radius).synapse(synapse).inhibition(inhibition);
        let gate = cx.scope.add(&name, gate);
        cx.connect(&out, &gate.input);
        // In neurons a chosen rule may have an activity of 0.9, which leaves a gate half closed.
        let open = cx.one(&(), Sum::output(&open.by).scaled(2.0));
        cx.scope.connect(&open, &gate.open, Synapse::None);
        Sum::output(&gate.output)
    }
}
