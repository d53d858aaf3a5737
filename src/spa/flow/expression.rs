//! Expressions: what operands and operators make, before `>>` gives it a target.

use std::sync::Arc;

use super::kinds::FlowKind;
use super::lower::{Lowerer, Sum};
use crate::sim::{
    AsPointer, BuildError, GraphBuilder, Out, Pointer, PortRef, Real, Scalar, Scope, Vector,
    VocabTag,
};
use crate::spa::error::VocabError;
use crate::spa::pointer::PointerValue;
use crate::spa::vocabulary::Vocabulary;

/// An operand of an expression.
pub trait IntoFlow {
    /// Kind of its value.
    type Kind: FlowKind;

    /// Returns the operand as an expression.
    fn into_flow(self) -> Flow<Self::Kind>;
}

impl<K: FlowKind> IntoFlow for Flow<K> {
    type Kind = K;

    fn into_flow(self) -> Self {
        self
    }
}

pub(super) type Lower<K> = dyn Fn(&mut Lowerer<'_, '_>, &<K as FlowKind>::Shape) -> Sum<K>;

/// An expression of kind `K` over the outputs of modules and constants.
///
/// It is a description: [`Routes::route`](super::Routes::route) adds it to a graph, once `>>` has given it a target. The [module's
/// docs](super) list the operators.
#[must_use = "an expression does nothing until `>>` and `route` add it to a graph"]
pub struct Flow<K: FlowKind> {
    pub(super) text: Arc<str>,
    level: Level,
    /// What determines the width and the space of the expression.
    pub(super) sources: Vec<Source<K>>,
    pub(super) leaves: Leaves,
    pub(super) lower: Arc<Lower<K>>,
}

/// What determines the width and the space of an expression.
pub(super) enum Source<K: FlowKind> {
    /// An output of the same kind.
    Output(Out<K>),
    /// A linear map of something else.
    Shape(K::Shape),
}

impl<K: FlowKind> Clone for Source<K> {
    fn clone(&self) -> Self {
        match self {
            Self::Output(out) => Self::Output(out.clone()),
            Self::Shape(shape) => Self::Shape(shape.clone()),
        }
    }
}

/// All outputs in an expression, of every kind.
#[derive(Clone, Default)]
pub(super) struct Leaves {
    pub ports: Vec<PortRef>,
    /// Whether values that change are multiplied with each other: the expression is then not linear.
    pub multiplied: bool,
}

impl Leaves {
    /// Returns the leaves of a sum.
    pub fn and(&self, other: &Self) -> Self {
        let ports = [&*self.ports, &*other.ports].concat();
        Self { ports, multiplied: self.multiplied || other.multiplied }
    }

    /// Returns the leaves of a product.
    pub fn times(&self, other: &Self) -> Self {
        let both = !self.ports.is_empty() && !other.ports.is_empty();
        let Self { ports, multiplied } = self.and(other);
        Self { ports, multiplied: multiplied || both }
    }
}

/// How tightly the outermost operator of an expression binds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    Sum,
    Product,
    Atom,
}

impl<K: FlowKind> Clone for Flow<K> {
    fn clone(&self) -> Self {
        let Self { text, level, sources, leaves, lower } = self;
        let (sources, leaves) = (sources.clone(), leaves.clone());
        Self { text: text.clone(), level: *level, sources, leaves, lower: lower.clone() }
    }
}

impl<K: FlowKind> std::fmt::Debug for Flow<K> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.text)
    }
}

impl<K: FlowKind> std::fmt::Display for Flow<K> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

impl<K: FlowKind> Flow<K> {
    pub(super) fn new(
        text: impl Into<Arc<str>>,
        level: Level,
        (sources, leaves): (Vec<Source<K>>, Leaves),
        lower: impl Fn(&mut Lowerer<'_, '_>, &K::Shape) -> Sum<K> + 'static,
    ) -> Self {
        Self { text: text.into(), level, sources, leaves, lower: Arc::new(lower) }
    }

    /// Makes an expression of an output alone.
    pub fn output(out: &Out<K>) -> Self {
        let name = out.port.name();
        let own = out.clone();
        let text = name.strip_suffix(".output").unwrap_or(&name).to_owned();
        let leaves = Leaves { ports: vec![out.port.clone()], multiplied: false };
        let from = (vec![Source::Output(out.clone())], leaves);
        Self::new(text, Level::Atom, from, move |_, _| Sum::output(&own))
    }

    /// Makes an expression of constant numbers. `text` names it in messages.
    fn fixed(values: Vec<Real>, text: impl Into<Arc<str>>) -> Self {
        let lower = move |_: &mut Lowerer<'_, '_>, _: &K::Shape| Sum::constant(values.clone());
        Self::new(text, Level::Atom, (Vec::new(), Leaves::default()), lower)
    }

    /// Returns the text of the expression where its context binds at least as tightly as `level`.
    pub(super) fn within(&self, level: Level) -> String {
        if self.level < level { format!("({})", self.text) } else { self.text.to_string() }
    }

    /// Adds another expression, or subtracts it.
    #[doc(hidden)]
    pub fn plus(self, other: impl IntoFlow<Kind = K>, minus: bool) -> Self {
        let other = other.into_flow();
        let text = match minus {
            true => format!("{} - {}", self.text, other.within(Level::Product)),
            false => format!("{} + {}", self.text, other.text),
        };
        let sources = [self.sources, other.sources].concat();
        let leaves = self.leaves.and(&other.leaves);
        let (a, b) = (self.lower, other.lower);
        Self::new(text, Level::Sum, (sources, leaves), move |cx, with| {
            let sign = if minus { -1.0 } else { 1.0 };
            let (a, b) = (a(cx, with), b(cx, with));
            cx.add_sums(with, a, b.scaled(sign))
        })
    }

    #[doc(hidden)]
    pub fn times_number(self, factor: Real) -> Self {
        let text = match factor == -1.0 {
            true => format!("-{}", self.within(Level::Product)),
            false => format!("{factor} * {}", self.within(Level::Product)),
        };
        let lower = self.lower;
        Self::new(text, Level::Product, (self.sources, self.leaves), move |cx, with| {
            lower(cx, with).scaled(factor)
        })
    }

    /// Returns the shape of the expression; `None` if only its target determines it.
    pub(super) fn shape(&self, scope: &Scope<'_>) -> Option<K::Shape> {
        let known = self.sources.iter().find_map(|source| match source {
            Source::Output(out) => K::shape_of(scope, out),
            Source::Shape(shape) => Some(shape.clone()),
        });
        known.or_else(K::only_shape)
    }
}

impl<V: VocabTag> Flow<Pointer<V>> {
    /// Makes an expression of a constant pointer. `text` names it in messages.
    pub(super) fn constant(value: &impl AsPointer<V>, text: &str) -> Self {
        Self::fixed(value.as_pointer().to_vec(), text)
    }
}

impl Flow<Scalar> {
    /// Makes a vector of one component of the number, with the same outputs.
    pub(super) fn into_vector(self) -> Flow<Vector> {
        let Self { text, level, leaves, lower, .. } = self;
        Flow::new(text, level, (vec![Source::Shape(1)], leaves), move |cx, _| {
            let Sum { constant, terms } = lower(cx, &());
            let terms = terms.into_iter().map(|(out, weight)| (Out::new(out.port), weight));
            Sum { constant, terms: terms.collect() }
        })
    }

    /// Makes an expression of a constant number.
    pub fn number(value: Real) -> Self {
        Self::fixed(vec![value], value.to_string())
    }
}

impl Flow<Vector> {
    /// Makes an expression of a constant vector.
    pub fn vector(values: &[Real]) -> Self {
        Self::fixed(values.to_vec(), format!("{values:?}"))
    }
}

impl<V: VocabTag> Vocabulary<V> {
    /// Computes an expression of constants, with the operators of graphs.
    ///
    /// ```
    /// use symbolt::prelude::*;
    /// symbolt::vocabulary!(Parts = "parts": NUT, BOLT, ROLE);
    /// let parts = Parts::vocabulary(256, Seed::new(1))?;
    /// let bound = parts.value(Parts::NUT * Parts::ROLE + 0.5 * Parts::BOLT)?;
    /// let filler = parts.value(&bound * !Parts::ROLE)?;
    /// assert!(cosine(&filler, &parts.get("NUT")?) > 0.5);
    /// # Ok::<(), symbolt::spa::VocabError>(())
    /// ```
    ///
    /// # Errors
    /// [`VocabError::BadVector`] if the expression contains an output of a graph, a name that the vocabulary does not
    /// have, or a pointer of other dimensions, or if its value is not finite.
    pub fn value(
        &self,
        expression: impl IntoFlow<Kind = Pointer<V>>,
    ) -> Result<PointerValue<V>, VocabError> {
        let flow = expression.into_flow();
        let bad = |reason| VocabError::BadVector { name: flow.text.to_string(), reason };
        if !flow.leaves.ports.is_empty() {
            return Err(bad("it has an output of a graph; expected constants".into()));
        }
        let mut graph = GraphBuilder::new();
        let mut root = graph.root();
        let sum = (flow.lower)(&mut Lowerer::new(&mut root, &flow.text), self.space());
        match graph.first_fault() {
            Some(BuildError::Refused { reason, .. }) => {
                let quoted = format!("`{}`: ", flow.text);
                return Err(bad(reason.strip_prefix(&quoted).unwrap_or(reason).into()));
            }
            Some(fault) => return Err(bad(fault.to_string())),
            None => {}
        }
        match sum.fixed(self.dim()) {
            Some(values) if values.iter().any(|value| !value.is_finite()) => {
                Err(bad("its value is not finite; use smaller factors".into()))
            }
            Some(values) if values.len() == self.dim() => {
                Ok(PointerValue::new(values, flow.text.to_string()))
            }
            _ => Err(bad(format!("its constants do not have {} dimensions", self.dim()))),
        }
    }
}
