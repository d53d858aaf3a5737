//! Routes: expressions with the inputs that they flow into.

use super::expression::{Flow, Source};
use super::kinds::{FlowKind, Gates};
use super::lower::{Lowerer, Sum};
use crate::sim::{
    GraphBuilder, In, InputSpec, Module, Out, PortRef, Scalar, Scope, Synapse, Vector,
};
use crate::spa::modules::{FEED_FORWARD, WeightedRows};

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

impl<K: FlowKind> Sink for In<K> {
    type Kind = K;

    fn sink(&self) -> In<K> {
        self.clone()
    }
}

/// A kind of value that flows into inputs of kind `T`: every kind into its own, and a number into a vector of one component.
/// `build` reports a vector of another width.
#[diagnostic::on_unimplemented(
    message = "a value of kind `{Self}` does not flow into an input of kind `{T}`"
)]
pub trait FlowsInto<T: FlowKind>: FlowKind {
    #[doc(hidden)]
    fn convert(flow: Flow<Self>) -> Flow<T>;
}

impl<K: FlowKind> FlowsInto<K> for K {
    fn convert(flow: Flow<K>) -> Flow<K> {
        flow
    }
}

impl FlowsInto<Vector> for Scalar {
    fn convert(flow: Flow<Scalar>) -> Flow<Vector> {
        flow.into_vector()
    }
}

/// The scalar that opens a way, and the gates on it.
#[derive(Clone)]
pub(super) struct Opening {
    pub by: Out<Scalar>,
    pub gates: Gates,
}

type LowerRoute = dyn FnOnce(&mut Lowerer<'_, '_>, Option<Synapse>, Option<&Opening>);

/// An expression with the input that it flows into.
#[must_use = "a route does nothing until `route` or a rule adds it to a graph"]
pub struct Route {
    text: String,
    pub(super) name: String,
    via: Option<Synapse>,
    lower: Box<LowerRoute>,
}

impl Route {
    #[doc(hidden)]
    pub fn new<K: FlowKind>(flow: Flow<K>, to: In<K>) -> Self {
        let target = to.port.name();
        Self {
            text: format!("{} >> {}", flow.text, target.strip_suffix(".input").unwrap_or(&target)),
            // The name of one of several inputs, such as `inputs[0]`, has characters that a path has not.
            name: format!("to.{}", target.replace('/', ".").replace('[', "-").replace(']', "")),
            via: None,
            lower: Box::new(move |cx, via, open| cx.finish(&flow, &to, via, open)),
        }
    }

    /// Names the scope of the route's nodes. The default is `to.` and the name of the input.
    pub fn named(mut self, name: &str) -> Self {
        self.name = name.into();
        self
    }

    /// Puts a synapse on the connection into the input. The default is none, because modules filter their outputs.
    /// It replaces the 5 ms of bare layers, such as ensembles, unless the expression multiplies values that change and has
    /// other outputs too, or a [rule](super::Rules) opens the route: bare layers then have the 5 ms in front of it. What is
    /// constant in a sum with a bare layer is not filtered. For a constant that a rule lets pass, none stands for 5 ms.
    ///
    /// [`Synapse::None`] in the place of the 5 ms of a bare layer is a fault when the graph is built.
    pub fn via(mut self, synapse: Synapse) -> Self {
        self.via = Some(synapse);
        self
    }

    /// Returns the route as it is written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Adds the nodes to a scope. If there is an opening, the flow passes while its scalar is 1.
    pub(super) fn lower(self, scope: &mut Scope<'_>, open: Option<&Opening>) {
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

impl Lowerer<'_, '_> {
    /// Lowers an expression, and connects it to an input.
    fn finish<K: FlowKind>(
        &mut self,
        flow: &Flow<K>,
        to: &In<K>,
        mut via: Option<Synapse>,
        open: Option<&Opening>,
    ) {
        let shape = flow.shape(self.scope).or_else(|| K::shape_of_input(self.scope, to));
        // A faulty handle is reported when it is connected.
        let Some(shape) = shape else {
            if let Some(Source::Output(out)) = flow.sources.first() {
                self.scope.connect(out, to, via.unwrap_or(Synapse::None));
            }
            return;
        };
        let bare = |port: &PortRef| self.scope.needs_synapse(port);
        let leaves = &flow.leaves.ports;
        let all_bare = !leaves.is_empty() && leaves.iter().all(bare);
        if all_bare && open.is_none() {
            self.bare = via.take().unwrap_or(FEED_FORWARD);
        } else if leaves.iter().any(bare) && open.is_none() && !flow.leaves.multiplied {
            // A linear filter commutes with sums and matrices. In front of them it replaces the synapse that bare layers need.
            if let Some(via) = via.take() {
                self.beside.clone_from(leaves);
                self.bare = via;
            }
        }
        let mut via = via.unwrap_or(Synapse::None);
        let mut sum = (flow.lower)(self, &shape);
        if sum.constant.as_ref().is_some_and(|values| !self.fits::<K>(&shape, values)) {
            return;
        }
        if let Some(open) = open {
            // A constant has the synapse of a gate, unless the route has its own.
            if sum.terms.is_empty() && via == Synapse::None {
                via = open.gates.synapse;
            }
            sum = self.gated(&shape, sum, open);
        }
        if self.scope.adds(to) {
            let before = sum.terms.len();
            let (plain, scaled): (Vec<_>, Vec<_>) =
                sum.terms.into_iter().partition(|(_, weight)| *weight == 1.0);
            sum.terms = scaled;
            plain.iter().for_each(|(out, _)| self.end_at(out, to, via));
            if sum.terms.len() < before && sum.is_zero() {
                return;
            }
        }
        let out = self.one(&shape, sum);
        self.end_at(&out, to, via);
    }

    fn end_at<K: FlowKind>(&mut self, out: &Out<K>, to: &In<K>, via: Synapse) {
        let bare = self.takes_synapse(&out.port) && via == Synapse::None;
        self.scope.connect(out, to, if bare { self.bare } else { via });
    }

    /// Lets a sum pass while its opening is 1.
    fn gated<K: FlowKind>(&mut self, shape: &K::Shape, sum: Sum<K>, open: &Opening) -> Sum<K> {
        if let Some(values) = sum.fixed(K::width(shape)) {
            let specs = (InputSpec::scalar(), K::specs(shape).1);
            let map = Box::new(WeightedRows::one(values));
            return Sum::output(&self.linear("constant", &open.by, specs, map));
        }
        let value = self.one(shape, sum);
        let gate = K::gate(self.scope, shape, open.gates);
        self.connect(&value, &gate.input);
        let by = self.one(&(), Sum::output(&open.by).scaled(K::DRIVE));
        self.connect(&by, &gate.open);
        Sum::output(&gate.output)
    }
}
