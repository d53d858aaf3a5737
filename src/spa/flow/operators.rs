//! The operators of expressions, for every module with one output, and the traits behind them.

use std::ops::{Add, Mul, Neg, Not, Shr, Sub};

use super::lower::{Lowerer, Sum};
use super::{Flow, FlowKind, Level, Lower, Route, Source};
use crate::neurons::EnsemblePorts;
use crate::sim::{
    AddPorts, ApplyPorts, In, NoisePorts, Out, Pointer, PointerRef, Real, Scalar, Vector, VocabTag,
};
use crate::spa::modules::{
    BindPorts, ComparePorts, GatePorts, GoalBufferPorts, LinearPorts, MemoryPorts, MultiplyPorts,
    StatePorts, SuperposePorts, UnbindPorts, WeighPorts,
};
use crate::spa::pointer::PointerValue;
use crate::spa::vocabulary::Name;

/// An operand of an expression.
pub trait IntoFlow {
    /// Kind of its value.
    type Kind: FlowKind;

    /// Returns the operand as an expression.
    fn into_flow(self) -> Flow<Self::Kind>;
}

/// Something with one input: a target of `>>`.
pub trait Sink {
    /// Kind of the input.
    type Kind: FlowKind;

    /// Returns the input.
    fn sink(&self) -> In<Self::Kind>;
}

impl<K: FlowKind> Sink for &In<K> {
    type Kind = K;

    fn sink(&self) -> In<K> {
        (*self).clone()
    }
}

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
    let leaves = [left.leaves, right.leaves].concat();
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

impl<V: VocabTag> Times<Pointer<V>> for Scalar {
    type Product = Pointer<V>;

    fn times(left: Flow<Scalar>, right: Flow<Pointer<V>>) -> Flow<Pointer<V>> {
        let sources = right.sources.clone();
        product(left, right, sources, |cx, space, number, pointer| {
            let (number, pointer) = (number(cx, &()), pointer(cx, space));
            cx.weigh(space, number, pointer)
        })
    }
}

impl<V: VocabTag> Times<Scalar> for Pointer<V> {
    type Product = Self;

    fn times(left: Flow<Self>, right: Flow<Scalar>) -> Flow<Self> {
        Scalar::times(right, left)
    }
}

impl Times<Vector> for Scalar {
    type Product = Vector;

    fn times(left: Flow<Scalar>, right: Flow<Vector>) -> Flow<Vector> {
        let sources = right.sources.clone();
        product(left, right, sources, |cx, width, number, vector| {
            let (number, vector) = (number(cx, &()), vector(cx, width));
            cx.weigh(width, number, vector)
        })
    }
}

impl Times<Scalar> for Vector {
    type Product = Self;

    fn times(left: Flow<Self>, right: Flow<Scalar>) -> Flow<Self> {
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

impl<K: FlowKind> IntoFlow for Flow<K> {
    type Kind = K;

    fn into_flow(self) -> Self {
        self
    }
}

impl IntoFlow for Real {
    type Kind = Scalar;

    fn into_flow(self) -> Flow<Scalar> {
        Flow::number(self)
    }
}

/// Writes the operators for one type of operand.
macro_rules! operators {
    ($([$($generics:tt)*] $operand:ty => $kind:ty;)*) => {$(
        impl<$($generics)* R: IntoFlow> Mul<R> for $operand
        where
            $kind: Times<R::Kind>,
        {
            type Output = Flow<<$kind as Times<R::Kind>>::Product>;

            fn mul(self, right: R) -> Self::Output {
                <$kind>::times(self.into_flow(), right.into_flow())
            }
        }

        impl<$($generics)* R: IntoFlow<Kind = $kind>> Add<R> for $operand {
            type Output = Flow<$kind>;

            fn add(self, right: R) -> Self::Output {
                self.into_flow().plus(right.into_flow(), false)
            }
        }

        impl<$($generics)* R: IntoFlow<Kind = $kind>> Sub<R> for $operand {
            type Output = Flow<$kind>;

            fn sub(self, right: R) -> Self::Output {
                self.into_flow().plus(right.into_flow(), true)
            }
        }

        impl<$($generics)*> Neg for $operand {
            type Output = Flow<$kind>;

            fn neg(self) -> Self::Output {
                self.into_flow().times_number(-1.0)
            }
        }

        impl<$($generics)*> Mul<$operand> for Real {
            type Output = Flow<$kind>;

            fn mul(self, right: $operand) -> Self::Output {
                right.into_flow().times_number(self)
            }
        }

        impl<$($generics)* S: Sink<Kind = $kind>> Shr<S> for $operand {
            type Output = Route;

            fn shr(self, to: S) -> Route {
                self.into_flow().into_input(to.sink())
            }
        }
    )*};
}

/// Writes the approximate inverse for one type of operand.
macro_rules! inverses {
    ($([$($generics:tt)*] $operand:ty;)*) => {$(
        impl<$($generics)* V: VocabTag> Not for $operand {
            type Output = Flow<Pointer<V>>;

            fn not(self) -> Self::Output {
                let inner = self.into_flow();
                let text = format!("!{}", inner.within(Level::Atom));
                let (lower, from) = (inner.lower, (inner.sources, inner.leaves));
                Flow::new(text, Level::Atom, from, move |cx, space| {
                    let sum = lower(cx, space);
                    cx.inverse(space, sum)
                })
            }
        }
    )*};
}

operators! {
    [K: FlowKind,] Flow<K> => K;
    ['o, K: FlowKind,] &'o Out<K> => K;
    ['o, V: VocabTag,] PointerRef<'o, V> => Pointer<V>;
    ['o, V: VocabTag,] &'o PointerValue<V> => Pointer<V>;
    [V: VocabTag,] PointerValue<V> => Pointer<V>;
    [V: VocabTag,] Name<V> => Pointer<V>;
    ['o, V: VocabTag,] &'o StatePorts<V> => Pointer<V>;
    ['o, V: VocabTag,] &'o BindPorts<V> => Pointer<V>;
    ['o, V: VocabTag,] &'o UnbindPorts<V> => Pointer<V>;
    ['o, V: VocabTag,] &'o GatePorts<V> => Pointer<V>;
    ['o, V: VocabTag,] &'o GoalBufferPorts<V> => Pointer<V>;
    ['o, V: VocabTag,] &'o SuperposePorts<V> => Pointer<V>;
    ['o, A: VocabTag, V: VocabTag,] &'o MemoryPorts<A, V> => Pointer<V>;
    ['o, V: VocabTag,] &'o ComparePorts<V> => Scalar;
    ['o,] &'o MultiplyPorts => Scalar;
    ['o, K: FlowKind,] &'o WeighPorts<K> => K;
    ['o, A: FlowKind, K: FlowKind,] &'o LinearPorts<A, K> => K;
    ['o, A: FlowKind, K: FlowKind,] &'o ApplyPorts<A, K> => K;
    ['o, K: FlowKind,] &'o AddPorts<K> => K;
    ['o, K: FlowKind,] &'o NoisePorts<K> => K;
}

inverses! {
    [] Flow<Pointer<V>>;
    ['o,] &'o Out<Pointer<V>>;
    ['o,] PointerRef<'o, V>;
    ['o,] &'o PointerValue<V>;
    [] PointerValue<V>;
    [] Name<V>;
    ['o,] &'o StatePorts<V>;
    ['o,] &'o BindPorts<V>;
    ['o,] &'o UnbindPorts<V>;
    ['o,] &'o GatePorts<V>;
    ['o,] &'o GoalBufferPorts<V>;
    ['o,] &'o SuperposePorts<V>;
    ['o, A: VocabTag,] &'o MemoryPorts<A, V>;
    ['o,] &'o WeighPorts<Pointer<V>>;
    ['o, A: FlowKind,] &'o LinearPorts<A, Pointer<V>>;
    ['o, A: FlowKind,] &'o ApplyPorts<A, Pointer<V>>;
    ['o,] &'o AddPorts<Pointer<V>>;
    ['o,] &'o NoisePorts<Pointer<V>>;
}

impl<K: FlowKind> IntoFlow for &Out<K> {
    type Kind = K;

    fn into_flow(self) -> Flow<K> {
        Flow::output(self)
    }
}

impl<const N: usize> IntoFlow for [Real; N] {
    type Kind = Vector;

    fn into_flow(self) -> Flow<Vector> {
        Flow::vector(&self)
    }
}

impl<V: VocabTag> IntoFlow for PointerRef<'_, V> {
    type Kind = Pointer<V>;

    fn into_flow(self) -> Flow<Pointer<V>> {
        Flow::constant(&self, "pointer")
    }
}

impl<V: VocabTag> IntoFlow for &PointerValue<V> {
    type Kind = Pointer<V>;

    fn into_flow(self) -> Flow<Pointer<V>> {
        Flow::constant(self, &format!("({})", self.expression()))
    }
}

impl<V: VocabTag> IntoFlow for PointerValue<V> {
    type Kind = Pointer<V>;

    fn into_flow(self) -> Flow<Pointer<V>> {
        (&self).into_flow()
    }
}

impl<V: VocabTag> IntoFlow for &PointerRef<'_, V> {
    type Kind = Pointer<V>;

    fn into_flow(self) -> Flow<Pointer<V>> {
        (*self).into_flow()
    }
}

impl<V: VocabTag> IntoFlow for Name<V> {
    type Kind = Pointer<V>;

    fn into_flow(self) -> Flow<Pointer<V>> {
        let name = self.as_str();
        let none = (Vec::new(), Vec::new());
        Flow::new(name, Level::Atom, none, move |cx, space| cx.named(space, name))
    }
}

/// Writes sums of a number and a scalar operand.
macro_rules! number_sums {
    ($([$($generics:tt)*] $operand:ty;)*) => {$(
        impl<$($generics)*> Add<$operand> for Real {
            type Output = Flow<Scalar>;

            fn add(self, right: $operand) -> Self::Output {
                Flow::number(self).plus(right.into_flow(), false)
            }
        }

        impl<$($generics)*> Sub<$operand> for Real {
            type Output = Flow<Scalar>;

            fn sub(self, right: $operand) -> Self::Output {
                Flow::number(self).plus(right.into_flow(), true)
            }
        }
    )*};
}

number_sums! {
    [] Flow<Scalar>;
    ['o] &'o Out<Scalar>;
    ['o, V: VocabTag] &'o ComparePorts<V>;
    ['o] &'o MultiplyPorts;
    ['o, A: FlowKind] &'o LinearPorts<A, Scalar>;
    ['o, A: FlowKind] &'o ApplyPorts<A, Scalar>;
    ['o] &'o AddPorts<Scalar>;
    ['o] &'o NoisePorts<Scalar>;
}

impl Shr<&In<Scalar>> for Real {
    type Output = Route;

    fn shr(self, to: &In<Scalar>) -> Route {
        Flow::number(self) >> to
    }
}

/// Makes the output of a port struct an operand.
macro_rules! sources {
    ($([$($generics:tt)*] $ports:ty => $kind:ty;)*) => {$(
        impl<$($generics)*> IntoFlow for &$ports {
            type Kind = $kind;

            fn into_flow(self) -> Flow<$kind> {
                Flow::output(&self.output)
            }
        }
    )*};
}

sources! {
    [V: VocabTag] StatePorts<V> => Pointer<V>;
    [V: VocabTag] BindPorts<V> => Pointer<V>;
    [V: VocabTag] UnbindPorts<V> => Pointer<V>;
    [V: VocabTag] GatePorts<V> => Pointer<V>;
    [V: VocabTag] GoalBufferPorts<V> => Pointer<V>;
    [V: VocabTag] SuperposePorts<V> => Pointer<V>;
    [A: VocabTag, V: VocabTag] MemoryPorts<A, V> => Pointer<V>;
    [V: VocabTag] ComparePorts<V> => Scalar;
    [] MultiplyPorts => Scalar;
    [K: FlowKind] WeighPorts<K> => K;
    [A: FlowKind, K: FlowKind] LinearPorts<A, K> => K;
    [A: FlowKind, K: FlowKind] ApplyPorts<A, K> => K;
    [K: FlowKind] AddPorts<K> => K;
    [K: FlowKind] NoisePorts<K> => K;
}

/// Makes the input of a port struct a target of `>>`.
macro_rules! sinks {
    ($([$($generics:tt)*] $ports:ty => $kind:ty;)*) => {$(
        impl<$($generics)*> Sink for &$ports {
            type Kind = $kind;

            fn sink(&self) -> In<$kind> {
                self.input.clone()
            }
        }
    )*};
}

sinks! {
    [V: VocabTag] StatePorts<V> => Pointer<V>;
    [V: VocabTag] GatePorts<V> => Pointer<V>;
    [V: VocabTag] GoalBufferPorts<V> => Pointer<V>;
    [A: VocabTag, V: VocabTag] MemoryPorts<A, V> => Pointer<A>;
    [A: FlowKind, K: FlowKind] LinearPorts<A, K> => A;
    [A: FlowKind, K: FlowKind] ApplyPorts<A, K> => A;
    [K: FlowKind] AddPorts<K> => K;
    [K: FlowKind] NoisePorts<K> => K;
}

impl Sink for &EnsemblePorts {
    type Kind = Vector;

    fn sink(&self) -> In<Vector> {
        self.input.clone()
    }
}

/// Makes a port struct of your own an operand and a target of [expressions](crate::spa::flow).
///
/// The struct, without generic parameters, has a field `output` of the first kind. With a second kind, it also has a
/// field `input` and can stand on the right of `>>`.
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
    ($ports:ty, output: $kind:ty $(, input: $takes:ty)?) => {
        $(
            impl $crate::spa::flow::Sink for &$ports {
                type Kind = $takes;

                fn sink(&self) -> $crate::sim::In<$takes> {
                    self.input.clone()
                }
            }
        )?

        impl $crate::spa::flow::IntoFlow for &$ports {
            type Kind = $kind;

            fn into_flow(self) -> $crate::spa::flow::Flow<$kind> {
                $crate::spa::flow::Flow::output(&self.output)
            }
        }

        impl<R: $crate::spa::flow::IntoFlow> ::std::ops::Mul<R> for &$ports
        where
            $kind: $crate::spa::flow::Times<R::Kind>,
        {
            type Output =
                $crate::spa::flow::Flow<<$kind as $crate::spa::flow::Times<R::Kind>>::Product>;

            fn mul(self, right: R) -> Self::Output {
                $crate::spa::flow::IntoFlow::into_flow(self) * right
            }
        }

        impl<R: $crate::spa::flow::IntoFlow<Kind = $kind>> ::std::ops::Add<R> for &$ports {
            type Output = $crate::spa::flow::Flow<$kind>;

            fn add(self, right: R) -> Self::Output {
                $crate::spa::flow::IntoFlow::into_flow(self) + right
            }
        }

        impl<R: $crate::spa::flow::IntoFlow<Kind = $kind>> ::std::ops::Sub<R> for &$ports {
            type Output = $crate::spa::flow::Flow<$kind>;

            fn sub(self, right: R) -> Self::Output {
                $crate::spa::flow::IntoFlow::into_flow(self) - right
            }
        }

        impl ::std::ops::Neg for &$ports {
            type Output = $crate::spa::flow::Flow<$kind>;

            fn neg(self) -> Self::Output {
                -$crate::spa::flow::IntoFlow::into_flow(self)
            }
        }

        impl ::std::ops::Mul<&$ports> for $crate::sim::Real {
            type Output = $crate::spa::flow::Flow<$kind>;

            fn mul(self, right: &$ports) -> Self::Output {
                self * $crate::spa::flow::IntoFlow::into_flow(right)
            }
        }

        impl<S: $crate::spa::flow::Sink<Kind = $kind>> ::std::ops::Shr<S> for &$ports {
            type Output = $crate::spa::flow::Route;

            fn shr(self, to: S) -> Self::Output {
                $crate::spa::flow::IntoFlow::into_flow(self) >> to
            }
        }
    };
}
