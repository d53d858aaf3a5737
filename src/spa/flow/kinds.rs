//! The kinds of values that expressions compute with: scalars, vectors, and pointers of a vocabulary.

use crate::neurons::GatePorts;
use crate::sim::{
    In, InputSpec, Kind, Out, OutputSpec, Pointer, Real, Scalar, Scope, Space, Synapse, Vector,
    VocabTag,
};
use crate::spa::modules::{Gate, Multiply, Weigh};

/// Settings of the gates of pointers.
#[doc(hidden)]
#[derive(Clone, Copy)]
pub struct Gates {
    pub(super) radius: Real,
    pub(super) synapse: Synapse,
    pub(super) inhibition: Real,
}

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

    /// Adds a module that lets a value pass while `open` is 1.
    #[doc(hidden)]
    fn gate(scope: &mut Scope<'_>, shape: &Self::Shape, gates: Gates) -> GatePorts<Self>;

    /// Activity of a chosen rule, over the activity at which the gate is fully open.
    #[doc(hidden)]
    const DRIVE: Real = 1.0;
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

    fn gate(scope: &mut Scope<'_>, (): &(), _: Gates) -> GatePorts<Self> {
        let name = scope.free_name("multiply");
        let product = scope.add(&name, Multiply::new());
        GatePorts { input: product.b, open: product.a, output: product.output }
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

    fn gate(scope: &mut Scope<'_>, width: &usize, _: Gates) -> GatePorts<Self> {
        let name = scope.free_name("weigh");
        let weigh = scope.add(&name, Weigh::vector(*width));
        GatePorts { input: weigh.value, open: weigh.weight, output: weigh.output }
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

    fn gate(scope: &mut Scope<'_>, space: &Space<V>, gates: Gates) -> GatePorts<Self> {
        let Gates { radius, synapse, inhibition } = gates;
        let name = scope.free_name("gate");
        let gate = Gate::in_space(space).radius(radius).synapse(synapse).inhibition(inhibition);
        scope.add(&name, gate)
    }

    /// In neurons a chosen rule may have an activity of 0.9, by which the gate would weaken the pointer.
    const DRIVE: Real = 2.0;
}
