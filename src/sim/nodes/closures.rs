//! Nodes made from closures: signals of the simulated time, and functions of an input.
//!
//! A closure is computed exactly in every mode; it stands for no neurons. A checkpoint knows the closure by the name of
//! its type, so it does not notice other captured values.

use crate::sim::describe::builder::{Module, Scope};
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::describe::handle::{Out, Ports};
use crate::sim::describe::io::{EmitIo, StepCx};
use crate::sim::describe::kind::{Kind, Pointer, Scalar, Space, Vector, VocabTag};
use crate::sim::describe::node::Node;
use crate::sim::describe::port::{InputSpec, OutputSpec, PortDecl};
use crate::sim::real::{Numbers, Real};

type OfTime = Box<dyn Fn(f64, &mut [Real]) + Send + Sync>;
type OfInput = Box<dyn Fn(&[Real], &mut [Real]) + Send + Sync>;

/// A signal computed by a closure of the simulated time in seconds.
///
/// Adding it to a graph returns the handle of the output. A value that is not finite ends the run with an error.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::sim::Signal;
///
/// let mut graph = GraphBuilder::new();
/// let wave = graph.add("wave", Signal::of(|t| [(6.28 * t).sin(), (6.28 * t).cos()]));
/// let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
/// sim.run_for(SimDuration::from_millis(251))?;
/// assert!((sim.value(&wave)[0] - 1.0).abs() < 1e-3);
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
pub struct Signal<K: Kind> {
    spec: OutputSpec<K>,
    name: &'static str,
    function: OfTime,
}

impl<K: Kind> Signal<K> {
    fn new<F: Fn(f64, &mut [Real]) + Send + Sync + 'static>(
        spec: OutputSpec<K>,
        name: &'static str,
        function: F,
    ) -> Self {
        Self { spec, name, function: Box::new(function) }
    }
}

impl Signal<Scalar> {
    /// Creates a signal of one number.
    pub fn scalar<F: Fn(f64) -> Real + Send + Sync + 'static>(function: F) -> Self {
        let name = std::any::type_name::<F>();
        Self::new(OutputSpec::scalar(), name, move |time, out| out[0] = function(time))
    }
}

impl Signal<Vector> {
    /// Creates a signal of the number, or the array of numbers, that the closure returns.
    pub fn of<N: Numbers, F: Fn(f64) -> N + Send + Sync + 'static>(function: F) -> Self {
        let name = std::any::type_name::<F>();
        Self::new(OutputSpec::vector(N::WIDTH), name, move |time, out| function(time).write(out))
    }

    /// Creates a signal of `width` numbers. The closure writes them.
    pub fn vector<F: Fn(f64, &mut [Real]) + Send + Sync + 'static>(
        width: usize,
        function: F,
    ) -> Self {
        Self::new(OutputSpec::vector(width), std::any::type_name::<F>(), function)
    }
}

impl<V: VocabTag> Signal<Pointer<V>> {
    /// Creates a signal of a pointer of `space`. The closure writes its components.
    pub fn pointer<F: Fn(f64, &mut [Real]) + Send + Sync + 'static>(
        space: &Space<V>,
        function: F,
    ) -> Self {
        Self::new(OutputSpec::pointer(space), std::any::type_name::<F>(), function)
    }
}

impl<K: Kind> Node for Signal<K> {
    fn declare(&self, ports: &mut PortDecl) {
        ports.output("out", self.spec.clone());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name);
    }

    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let out = io.outputs.get_mut(0);
        // The function may write some components only.
        out.fill(0.0);
        (self.function)(cx.time().as_millis_f64() / 1e3, out);
    }
}

impl<K: Kind> Module for Signal<K> {
    type Ports = Out<K>;

    fn expand(self, scope: &mut Scope<'_>) -> Out<K> {
        scope.leaf(self).output("out")
    }
}

/// A function of an input, computed by a closure without a tick of delay.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::sim::Apply;
///
/// let mut graph = GraphBuilder::new();
/// let three = graph.add("three", Constant::scalar(3.0));
/// let square = graph.add("square", Apply::scalar(|x| x * x));
/// graph.route(&three >> &square);
/// let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
/// sim.run_for(SimDuration::from_millis(1))?;
/// assert_eq!(sim.value(&square.output)[0], 9.0);
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
pub struct Apply<A: Kind, B: Kind> {
    input: InputSpec<A>,
    output: OutputSpec<B>,
    name: &'static str,
    function: OfInput,
}

impl<A: Kind, B: Kind> Apply<A, B> {
    /// Creates a function from one kind of port to another. The closure gets the input and writes the output.
    pub fn new<F: Fn(&[Real], &mut [Real]) + Send + Sync + 'static>(
        input: InputSpec<A>,
        output: OutputSpec<B>,
        function: F,
    ) -> Self {
        let name = std::any::type_name::<F>();
        Self { input: input.sum(), output, name, function: Box::new(function) }
    }
}

impl Apply<Scalar, Scalar> {
    /// Creates a function of one number.
    pub fn scalar<F: Fn(Real) -> Real + Send + Sync + 'static>(function: F) -> Self {
        let name = std::any::type_name::<F>();
        let whole = Self::new(InputSpec::scalar(), OutputSpec::scalar(), move |input, out| {
            out[0] = function(input[0]);
        });
        Self { name, ..whole }
    }
}

impl<A: Kind, B: Kind> Node for Apply<A, B> {
    fn declare(&self, ports: &mut PortDecl) {
        ports.input("in", self.input.clone()).output("out", self.output.clone());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text(self.name);
    }

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let out = io.outputs.get_mut(0);
        out.fill(0.0);
        (self.function)(io.inputs.get(0), out);
    }
}

impl<A: Kind, B: Kind> Module for Apply<A, B> {
    type Ports = Ports<A, B>;

    fn expand(self, scope: &mut Scope<'_>) -> Ports<A, B> {
        let node = scope.leaf(self);
        scope.ports(Ports::of(&node))
    }
}
