//! The operators of expressions. All operands have all of them.

use super::expression::{Flow, Level, Lower, Source};
use super::kinds::FlowKind;
use super::lower::{Lowerer, Sum, Weighable};
use super::route::Route;
use crate::sim::{In, Pointer, Real, Scalar, VocabTag};

/// Multiplication of an expression of kind `Self` with one of kind `R`.
pub trait Times<R: FlowKind>: FlowKind {
    /// Kind of the product.
    type Product: FlowKind;

    #[doc(hidden)]
    fn times(left: Flow<Self>, right: Flow<R>) -> Flow<Self::Product>;
}

/// Makes the product of two expressions. `sources` are those of the expressions that have the product's kind.
fn product<A: FlowKind, B: FlowKind, C: FlowKind>(
    left: Flow<A>,
    right: Flow<B>,
    sources: Vec<Source<C>>,
    lower: impl Fn(&mut Lowerer<'_, '_>, &C::Shape, &Lower<A>, &Lower<B>) -> Sum<C> + 'static,
) -> Flow<C> {
    let text = format!("{} * {}", left.within(Level::Product), right.within(Level::Atom));
    let leaves = left.leaves.times(&right.leaves);
    let (a, b) = (left.lower, right.lower);
    Flow::new(text, Level::Product, (sources, leaves), move |cx, shape| lower(cx, shape, &*a, &*b))
}

impl<V: VocabTag> Times<Pointer<V>> for Pointer<V> {
    type Product = Self;

    fn times(left: Flow<Self>, right: Flow<Self>) -> Flow<Self> {
        let sources = [&*left.sources, &*right.sources].concat();
        product(left, right, sources, |cx, space, a, b| {
            let (a, b) = (a(cx, space), b(cx, space));
            cx.bind(space, a, b)
        })
    }
}

impl<K: Weighable> Times<K> for Scalar {
    type Product = K;

    fn times(left: Flow<Scalar>, right: Flow<K>) -> Flow<K> {
        let sources = right.sources.clone();
        product(left, right, sources, |cx, shape, number, value| {
            let (number, value) = (number(cx, &()), value(cx, shape));
            cx.weigh(shape, number, value)
        })
    }
}

impl<K: Weighable> Times<Scalar> for K {
    type Product = K;

    fn times(left: Flow<K>, right: Flow<Scalar>) -> Flow<K> {
        Scalar::times(right, left)
    }
}

impl Times<Scalar> for Scalar {
    type Product = Self;

    fn times(left: Flow<Self>, right: Flow<Self>) -> Flow<Self> {
        let sources = [&*left.sources, &*right.sources].concat();
        product(left, right, sources, |cx, with, a, b| {
            let (a, b) = (a(cx, with), b(cx, with));
            cx.multiply(a, b)
        })
    }
}

/// A kind of value that has an [inverse](crate::spa::Algebra::inverse_into) under binding: a pointer.
pub trait Invertible: FlowKind {
    #[doc(hidden)]
    fn inverse(inner: Flow<Self>) -> Flow<Self>;
}

impl<V: VocabTag> Invertible for Pointer<V> {
    fn inverse(inner: Flow<Self>) -> Flow<Self> {
        let text = format!("!{}", inner.within(Level::Atom));
        let (lower, from) = (inner.lower, (inner.sources, inner.leaves));
        Flow::new(text, Level::Atom, from, move |cx, space| {
            let sum = lower(cx, space);
            cx.inverse(space, sum)
        })
    }
}

/// Writes all operators for one type of operand. This is the one place where they stand.
#[doc(hidden)]
#[macro_export]
macro_rules! flow_operators {
    ([$($generics:tt)*] $operand:ty => $kind:ty) => {
        impl<$($generics)*> $crate::spa::flow::Chained for $operand {}

        $crate::spa::flow::flow_operators!(@plain [$($generics)*] $operand => $kind);
    };
    (@plain [$($generics:tt)*] $operand:ty => $kind:ty) => {
        impl<$($generics)* Right: $crate::spa::flow::IntoFlow> ::std::ops::Mul<Right> for $operand
        where
            $kind: $crate::spa::flow::Times<Right::Kind>,
        {
            type Output =
                $crate::spa::flow::Flow<<$kind as $crate::spa::flow::Times<Right::Kind>>::Product>;

            fn mul(self, right: Right) -> Self::Output {
                let left = $crate::spa::flow::IntoFlow::into_flow(self);
                <$kind as $crate::spa::flow::Times<Right::Kind>>::times(left, right.into_flow())
            }
        }

        impl<$($generics)* Right> ::std::ops::Add<Right> for $operand
        where
            Right: $crate::spa::flow::IntoFlow<Kind = $kind>,
        {
            type Output = $crate::spa::flow::Flow<$kind>;

            fn add(self, right: Right) -> Self::Output {
                $crate::spa::flow::IntoFlow::into_flow(self).plus(right, false)
            }
        }

        impl<$($generics)* Right> ::std::ops::Sub<Right> for $operand
        where
            Right: $crate::spa::flow::IntoFlow<Kind = $kind>,
        {
            type Output = $crate::spa::flow::Flow<$kind>;

            fn sub(self, right: Right) -> Self::Output {
                $crate::spa::flow::IntoFlow::into_flow(self).plus(right, true)
            }
        }

        impl<$($generics)* Value> ::std::ops::Add<$operand> for $crate::sim::Real
        where
            $operand: $crate::spa::flow::IntoFlow<Kind = Value>,
            $crate::sim::Real: $crate::spa::flow::IntoFlow<Kind = Value>,
            Value: $crate::spa::flow::FlowKind,
        {
            type Output = $crate::spa::flow::Flow<Value>;

            fn add(self, right: $operand) -> Self::Output {
                $crate::spa::flow::IntoFlow::into_flow(self).plus(right, false)
            }
        }

        impl<$($generics)* Value> ::std::ops::Sub<$operand> for $crate::sim::Real
        where
            $operand: $crate::spa::flow::IntoFlow<Kind = Value>,
            $crate::sim::Real: $crate::spa::flow::IntoFlow<Kind = Value>,
            Value: $crate::spa::flow::FlowKind,
        {
            type Output = $crate::spa::flow::Flow<Value>;

            fn sub(self, right: $operand) -> Self::Output {
                $crate::spa::flow::IntoFlow::into_flow(self).plus(right, true)
            }
        }

        impl<$($generics)*> ::std::ops::Mul<$operand> for $crate::sim::Real {
            type Output = $crate::spa::flow::Flow<$kind>;

            fn mul(self, right: $operand) -> Self::Output {
                $crate::spa::flow::IntoFlow::into_flow(right).times_number(self)
            }
        }

        impl<$($generics)*> ::std::ops::Neg for $operand {
            type Output = $crate::spa::flow::Flow<$kind>;

            fn neg(self) -> Self::Output {
                $crate::spa::flow::IntoFlow::into_flow(self).times_number(-1.0)
            }
        }

        impl<$($generics)* Value: $crate::spa::flow::Invertible> ::std::ops::Not for $operand
        where
            $operand: $crate::spa::flow::IntoFlow<Kind = Value>,
        {
            type Output = $crate::spa::flow::Flow<Value>;

            fn not(self) -> Self::Output {
                Value::inverse($crate::spa::flow::IntoFlow::into_flow(self))
            }
        }

        impl<$($generics)* Target> ::std::ops::Shr<Target> for $operand
        where
            Target: $crate::spa::flow::Sink,
            $kind: $crate::spa::flow::FlowsInto<Target::Kind>,
        {
            type Output = $crate::spa::flow::Route;

            fn shr(self, to: Target) -> Self::Output {
                let flow = $crate::spa::flow::IntoFlow::into_flow(self);
                let flow = <$kind as $crate::spa::flow::FlowsInto<Target::Kind>>::convert(flow);
                $crate::spa::flow::Route::new(flow, to.sink())
            }
        }
    };
}

impl std::ops::Shr<&In<Scalar>> for Real {
    type Output = Route;

    fn shr(self, to: &In<Scalar>) -> Route {
        Flow::number(self) >> to
    }
}

/// Makes a port struct of your own an operand and a target of [expressions](crate::spa::flow).
///
/// The struct has a field `output` of the first kind, and gets all operators. With a second kind, it also has a field
/// `input` and can stand on the right of `>>`. Generic parameters stand in front, in brackets:
/// `flow_ports!([V: VocabTag] MyPorts<V>, output: Pointer<V>)`.
///
/// A module with one input and one output has [`Ports`](crate::sim::Ports), which need no such line.
///
/// ```
/// use symbolt::prelude::*;
///
/// struct Doubled;
/// struct DoubledPorts {
///     input: In<Scalar>,
///     output: Out<Scalar>,
/// }
/// symbolt::flow_ports!(DoubledPorts, output: Scalar, input: Scalar);
///
/// impl Module for Doubled {
///     type Ports = DoubledPorts;
///
///     fn expand(self, scope: &mut Scope<'_>) -> DoubledPorts {
///         let sum = scope.add("sum", Add::scalar());
///         let twice = scope.add("twice", Add::scalar());
///         scope.route(2.0 * &sum >> &twice);
///         DoubledPorts {
///             input: scope.input("input", sum.input),
///             output: scope.output("output", twice.output),
///         }
///     }
/// }
///
/// let mut graph = GraphBuilder::new();
/// let one = graph.add("one", Constant::scalar(1.0));
/// let doubled = graph.add("doubled", Doubled);
/// let more = graph.add("more", Doubled);
/// graph.route(0.5 + &one >> &doubled);
/// graph.route(&doubled * &one - 1.0 >> &more);
/// let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
/// sim.run_for(SimDuration::from_millis(50))?;
/// assert!((sim.value(&more.output)[0] - 4.0).abs() < 1e-3);
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
#[macro_export]
macro_rules! flow_ports {
    (@output [$($generics:tt)*] $ports:ty, $kind:ty) => {
        impl<$($generics)*> $crate::spa::flow::IntoFlow for &$ports {
            type Kind = $kind;

            fn into_flow(self) -> $crate::spa::flow::Flow<$kind> {
                $crate::spa::flow::Flow::output(&self.output)
            }
        }

        $crate::spa::flow::flow_operators!(['operand, $($generics)*] &'operand $ports => $kind);
    };
    (@input [$($generics:tt)*] $ports:ty, $kind:ty) => {
        impl<$($generics)*> $crate::spa::flow::Sink for &$ports {
            type Kind = $kind;

            fn sink(&self) -> $crate::sim::In<$kind> {
                self.input.clone()
            }
        }
    };
    (@both $generics:tt $ports:ty, output: $kind:ty) => {
        $crate::spa::flow::flow_ports!(@output $generics $ports, $kind);
    };
    (@both $generics:tt $ports:ty, output: $kind:ty, input: $takes:ty) => {
        $crate::spa::flow::flow_ports!(@output $generics $ports, $kind);
        $crate::spa::flow::flow_ports!(@input $generics $ports, $takes);
    };
    ([$($generics:tt)+] $($ports:tt)+) => {
        $crate::spa::flow::flow_ports!(@both [$($generics)+,] $($ports)+);
    };
    ($($ports:tt)+) => {
        $crate::spa::flow::flow_ports!(@both [] $($ports)+);
    };
}

// The macros lie in the root of the crate. Here they have a path in this room.
#[doc(hidden)]
pub use {flow_operators, flow_ports};
