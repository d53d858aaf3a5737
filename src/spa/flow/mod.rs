//! Expressions over modules: `vision * !role >> state` instead of modules and connections.
//!
//! Every module with one output is an operand, and so are [outputs](Out) of every kind, pointers of a vocabulary and
//! numbers. The operators build a [`Flow`]; `>>` routes it into an input, and [`Routes::route`] adds it to a graph.
//!
//! | expression | meaning | becomes |
//! |---|---|---|
//! | `&a * &b` | binding | [`Bind`](super::Bind); with a constant, a linear node |
//! | `&a + &b`, `&a - &b`, `-&a` | superposition | connections, or one linear node |
//! | `0.5 * &a` | scaling | a weight |
//! | `!&a` | approximate inverse, to unbind | a linear node |
//! | `a.dot(&b)` | scalar product | [`Compare`](super::Compare); with a constant, a linear node |
//! | `&s * &a` with a scalar `s` | weighting | [`Weigh`](super::Weigh) or [`Multiply`](super::Multiply) |
//! | `a.transform(matrix)` | a matrix times a vector or pointer | a linear node |
//! | `a.slice(0..2)`, `a.component(1)` | parts of a vector or pointer | a linear node |
//! | `a.reinterpret(&vocabulary)` | the same numbers as a pointer | a linear node |
//! | `a.translate(&vocabulary)` | the pointer of the same name in another vocabulary | a linear node |
//! | `flow >> &c` | routing into the input of `c` | a connection |
//!
//! `>>` binds more loosely than `+` and `*`, so expressions need no parentheses in front of it. Clippy's style lint
//! `precedence` asks for them all the same; `#![allow(clippy::precedence)]` silences it. Constant parts are computed when
//! the graph is described. Linear nodes cost no tick; each layer costs one synapse of 5 ms, as in the modules.
//!
//! The output of a bare [layer](crate::neurons::Layers) needs a synapse. If an expression has no other outputs, that of
//! the route ([`Route::via`]) is applied to them, 5 ms by default; otherwise they get 5 ms in any case.
//!
//! Pointers of two vocabularies have different types, so an expression that mixes them does not compile:
//!
//! ```
//! # use symbolt::prelude::*;
//! # struct Parts;
//! # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
//! # struct Verbs;
//! # impl VocabTag for Verbs { const NAME: &'static str = "verbs"; }
//! let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointers(["NUT", "ROLE"]).build()?;
//! let verbs = VocabularyBuilder::<Verbs>::new(64, Seed::new(1)).pointer("TAKE").build()?;
//! let mut graph = GraphBuilder::new();
//! let seen = graph.add("seen", State::new(&parts));
//! let filler = graph.add("filler", State::new(&parts));
//! graph.route(&seen * !parts.get("ROLE")? >> &filler);
//! # let _ = verbs;
//! # Ok::<(), symbolt::spa::VocabError>(())
//! ```
//!
//! ```compile_fail
//! # use symbolt::prelude::*;
//! # struct Parts;
//! # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
//! # struct Verbs;
//! # impl VocabTag for Verbs { const NAME: &'static str = "verbs"; }
//! let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointers(["NUT", "ROLE"]).build()?;
//! let verbs = VocabularyBuilder::<Verbs>::new(64, Seed::new(1)).pointer("TAKE").build()?;
//! let mut graph = GraphBuilder::new();
//! let seen = graph.add("seen", State::new(&parts));
//! let filler = graph.add("filler", State::new(&parts));
//! graph.route(&seen * !verbs.get("TAKE")? >> &filler);
//! # Ok::<(), symbolt::spa::VocabError>(())
//! ```
//!
//! # Paths
//!
//! The nodes of a route lie in a scope that is named after its target: `to.filler.input`, and `to.filler.input-2` for
//! the second route into the same input. [`Route::named`] gives another name. In the scope, nodes are called after
//! their operator: `bind`, `inverse`, `dot`, `weigh`, `sum`, `constant`; the second of a kind is `bind-2`, and so on.

mod kinds;
mod lower;
mod nodes;
mod operators;
mod rules;
mod transforms;

use std::sync::Arc;

pub use kinds::FlowKind;
pub use operators::{IntoFlow, Sink, Times};
pub use rules::{Rule, Rules, RulesPorts};
pub use transforms::FlowExt;

use super::error::VocabError;
use super::pointer::PointerValue;
use super::vocabulary::Vocabulary;
use crate::sim::{
    AsPointer, BuildError, GraphBuilder, In, Kind, Module, Out, Pointer, PortRef, Real, Scalar,
    Scope, Synapse, Vector, VocabTag,
};
use lower::{Lowerer, Sum};

/// Where a flow goes: an input, by way of a synapse, and what opens the way, if it is not always open.
struct Destination<'d, K: Kind> {
    input: &'d In<K>,
    via: Synapse,
    open: Option<&'d Opening>,
}

/// The scalar that opens a way, and the gates on it.
#[derive(Clone)]
struct Opening {
    by: Out<Scalar>,
    gates: Gates,
}

/// Settings of the gates of pointers.
#[derive(Clone, Copy)]
struct Gates {
    radius: Real,
    synapse: Synapse,
    inhibition: Real,
}

impl<K: Kind> Destination<'_, K> {
    /// Returns the synapse of a constant that a rule lets pass: that of a gate, unless the route has its own.
    fn after_gate(&self, open: &Opening) -> Synapse {
        if self.via == Synapse::None { open.gates.synapse } else { self.via }
    }
}

type Lower<K> = dyn Fn(&mut Lowerer<'_, '_>, &<K as FlowKind>::Shape) -> Sum<K>;

/// An expression of kind `K` over the outputs of modules and constants.
///
/// It is a description: [`Routes::route`] adds it to a graph, once `>>` has given it a target. The [module's
/// docs](self) list the operators.
#[must_use = "an expression does nothing until `>>` and `route` add it to a graph"]
pub struct Flow<K: FlowKind> {
    text: Arc<str>,
    level: Level,
    /// What determines the width and the space of the expression.
    sources: Vec<Source<K>>,
    /// All outputs in the expression, of every kind.
    leaves: Vec<PortRef>,
    lower: Arc<Lower<K>>,
}

/// What determines the width and the space of an expression.
enum Source<K: FlowKind> {
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

/// How tightly the outermost operator of an expression binds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
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
    fn new(
        text: impl Into<Arc<str>>,
        level: Level,
        (sources, leaves): (Vec<Source<K>>, Vec<PortRef>),
        lower: impl Fn(&mut Lowerer<'_, '_>, &K::Shape) -> Sum<K> + 'static,
    ) -> Self {
        Self { text: text.into(), level, sources, leaves, lower: Arc::new(lower) }
    }

    /// Makes an expression of an output alone.
    pub fn output(out: &Out<K>) -> Self {
        let name = out.port.name();
        let own = out.clone();
        let text = name.strip_suffix(".output").unwrap_or(&name).to_owned();
        let from = (vec![Source::Output(out.clone())], vec![out.port.clone()]);
        Self::new(text, Level::Atom, from, move |_, _| Sum::output(&own))
    }

    /// Makes an expression of constant numbers. `text` names it in messages.
    fn fixed(values: Vec<Real>, text: impl Into<Arc<str>>) -> Self {
        let lower = move |_: &mut Lowerer<'_, '_>, _: &K::Shape| Sum::constant(values.clone());
        Self::new(text, Level::Atom, (Vec::new(), Vec::new()), lower)
    }

    /// Returns the text of the expression where its context binds at least as tightly as `level`.
    fn within(&self, level: Level) -> String {
        if self.level < level { format!("({})", self.text) } else { self.text.to_string() }
    }

    fn plus(self, other: Self, minus: bool) -> Self {
        let text = match minus {
            true => format!("{} - {}", self.text, other.within(Level::Product)),
            false => format!("{} + {}", self.text, other.text),
        };
        let sources = [self.sources, other.sources].concat();
        let leaves = [self.leaves, other.leaves].concat();
        let (a, b) = (self.lower, other.lower);
        Self::new(text, Level::Sum, (sources, leaves), move |cx, with| {
            let sign = if minus { -1.0 } else { 1.0 };
            let (a, b) = (a(cx, with), b(cx, with));
            cx.add_sums(with, a, b.scaled(sign))
        })
    }

    fn times_number(self, factor: Real) -> Self {
        let text = match factor == -1.0 {
            true => format!("-{}", self.within(Level::Product)),
            false => format!("{factor} * {}", self.within(Level::Product)),
        };
        let lower = self.lower;
        Self::new(text, Level::Product, (self.sources, self.leaves), move |cx, with| {
            lower(cx, with).scaled(factor)
        })
    }

    fn into_input(self, input: In<K>) -> Route {
        let target = input.port.name();
        Route {
            text: format!("{} >> {}", self.text, target.strip_suffix(".input").unwrap_or(&target)),
            // The name of one of several inputs, such as `inputs[0]`, has characters that a path has not.
            name: format!("to.{}", target.replace('/', ".").replace('[', "-").replace(']', "")),
            via: Synapse::None,
            lower: Box::new(move |cx, via, open| {
                cx.finish(&self, &Destination { input: &input, via, open });
            }),
        }
    }
}

impl<V: VocabTag> Flow<Pointer<V>> {
    /// Makes an expression of a constant pointer. `text` names it in messages.
    pub fn constant(value: &impl AsPointer<V>, text: &str) -> Self {
        Self::fixed(value.as_pointer().to_vec(), text)
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
        if !flow.leaves.is_empty() {
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

impl Flow<Scalar> {
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

type LowerRoute = dyn FnOnce(&mut Lowerer<'_, '_>, Synapse, Option<&Opening>);

/// An expression with the input that it flows into.
#[must_use = "a route does nothing until `route` or a rule adds it to a graph"]
pub struct Route {
    text: String,
    name: String,
    via: Synapse,
    lower: Box<LowerRoute>,
}

impl Route {
    /// Names the scope of the route's nodes. The default is `to.` and the name of the input.
    pub fn named(mut self, name: &str) -> Self {
        self.name = name.into();
        self
    }

    /// Puts a synapse on the connection into the input. The default is none, because modules filter their outputs.
    /// It replaces the 5 ms of bare layers, if the expression has no other outputs. For a constant that a [rule](Rules) lets pass, none stands for 5 ms.
    pub fn via(mut self, synapse: Synapse) -> Self {
        self.via = synapse;
        self
    }

    /// Returns the route as it is written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Adds the nodes to a scope. If there is an opening, the flow passes while its scalar is 1.
    fn lower(self, scope: &mut Scope<'_>, open: Option<&Opening>) {
        let mut cx = Lowerer::new(scope, &self.text);
        (self.lower)(&mut cx, self.via, open);
    }
}

impl std::fmt::Debug for Route {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

impl Module for Route {
    type Ports = ();

    fn expand(self, scope: &mut Scope<'_>) {
        self.lower(scope, None);
    }
}

/// Adds routes to a graph or a scope.
pub trait Routes {
    /// Adds the nodes and connections of a route. Faults are reported when the graph is built; they quote the route.
    fn route(&mut self, route: Route);
}

impl Routes for Scope<'_> {
    #[track_caller]
    fn route(&mut self, route: Route) {
        let name = self.free_name(&route.name);
        self.add(&name, route);
    }
}

impl Routes for GraphBuilder {
    #[track_caller]
    fn route(&mut self, route: Route) {
        self.root().route(route);
    }
}

#[cfg(test)]
mod tests;
