//! The basic modules: constants, stimuli, sums and noise.

pub(super) mod closures;
use rand::RngExt;
use rand_distr::StandardNormal;

use super::describe::builder::{Module, Scope};
use super::describe::fingerprint::Fingerprint;
use super::describe::handle::{In, Out};
use super::describe::io::{EmitIo, StepCx};
use super::describe::kind::{AsPointer, Kind, Pointer, Scalar, Space, Vector, VocabTag};
use super::describe::node::Node;
use super::describe::port::{AnyOutput, InputSpec, OutputSpec, PortDecl};
use super::real::Real;
use super::time::SimDuration;

/// An output with a constant value.
///
/// Adding it to a graph returns the handle of the output. A value that is not finite is a fault when the graph is
/// built. Costs one copy per tick.
pub struct Constant<K: Kind> {
    spec: OutputSpec<K>,
    values: Vec<Real>,
}

impl<K: Kind> Constant<K> {
    /// Creates a constant of any kind.
    pub(crate) fn of(spec: OutputSpec<K>, values: &[Real]) -> Self {
        Self { spec, values: values.to_vec() }
    }
}

impl Constant<Scalar> {
    /// Creates a constant number.
    pub fn scalar(value: Real) -> Self {
        Self { spec: OutputSpec::scalar(), values: vec![value] }
    }
}

impl Constant<Vector> {
    /// Creates a constant vector.
    pub fn vector(values: &[Real]) -> Self {
        Self { spec: OutputSpec::vector(values.len()), values: values.to_vec() }
    }
}

impl<V: VocabTag> Constant<Pointer<V>> {
    /// Creates a constant pointer of `space`. `build` reports a `value` with another number of dimensions.
    ///
    /// The value must have the same tag as the space:
    ///
    /// ```
    /// # use symbolt::sim::{Constant, PointerRef, Space, VocabTag};
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// # struct Actions;
    /// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
    /// let (parts, actions) = (Space::<Parts>::new(1, 2, "parts"), Space::<Actions>::new(2, 2, "actions"));
    /// let nut = PointerRef::<Parts>::from_raw(&[1.0, 0.0]);
    /// let grasp = PointerRef::<Actions>::from_raw(&[0.0, 1.0]);
    /// Constant::pointer(&parts, &nut);
    /// ```
    ///
    /// A value with another tag does not compile:
    ///
    /// ```compile_fail
    /// # use symbolt::sim::{Constant, PointerRef, Space, VocabTag};
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// # struct Actions;
    /// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
    /// let (parts, actions) = (Space::<Parts>::new(1, 2, "parts"), Space::<Actions>::new(2, 2, "actions"));
    /// let nut = PointerRef::<Parts>::from_raw(&[1.0, 0.0]);
    /// let grasp = PointerRef::<Actions>::from_raw(&[0.0, 1.0]);
    /// Constant::pointer(&actions, &nut);
    /// ```
    pub fn pointer(space: &Space<V>, value: &impl AsPointer<V>) -> Self {
        Self { spec: OutputSpec::pointer(space), values: value.as_pointer().to_vec() }
    }
}

impl<K: Kind> Module for Constant<K> {
    type Ports = Out<K>;

    fn expand(self, scope: &mut Scope<'_>) -> Out<K> {
        let stimulus = Stimulus {
            spec: self.spec,
            rest: self.values,
            entries: Vec::new(),
            starts: Vec::new(),
        };
        stimulus.expand(scope)
    }
}

/// An output whose value changes at given simulated times.
///
/// Adding it to a graph returns the handle of the output. A value that is not finite is a fault when the graph is
/// built. Costs one copy per tick.
///
/// ```
/// use symbolt::sim::{SimDuration, Stimulus};
/// // 0 until 10 ms, then 1, and 0 again from 20 ms on.
/// let pulse = Stimulus::scalar(0.0)
///     .from(SimDuration::from_millis(10), &[1.0])
///     .from(SimDuration::from_millis(20), &[0.0]);
/// # let _ = pulse;
/// ```
pub struct Stimulus<K: Kind> {
    spec: OutputSpec<K>,
    rest: Vec<Real>,
    entries: Vec<Vec<Real>>,
    starts: Vec<SimDuration>,
}

impl Stimulus<Scalar> {
    /// Creates a stimulus that starts as the number `value`.
    pub fn scalar(value: Real) -> Self {
        Self::new(OutputSpec::scalar(), vec![value])
    }

    /// Changes the number to `values[0]` at `time`.
    ///
    /// `values` must hold one number, and `time` must be later than the time of the previous change. `build` reports
    /// anything else.
    pub fn from(self, time: SimDuration, values: &[Real]) -> Self {
        self.then(time, values)
    }
}

impl Stimulus<Vector> {
    /// Creates a stimulus that starts as the vector `values`.
    pub fn vector(values: &[Real]) -> Self {
        Self::new(OutputSpec::vector(values.len()), values.to_vec())
    }

    /// Changes the vector to `values` at `time`.
    ///
    /// `values` must have the width of the vector, and `time` must be later than the time of the previous change.
    /// `build` reports anything else.
    pub fn from(self, time: SimDuration, values: &[Real]) -> Self {
        self.then(time, values)
    }
}

impl<V: VocabTag> Stimulus<Pointer<V>> {
    /// Creates a stimulus that starts as the pointer `value` of `space`.
    pub fn pointer(space: &Space<V>, value: &impl AsPointer<V>) -> Self {
        Self::new(OutputSpec::pointer(space), value.as_pointer().to_vec())
    }

    /// Changes the pointer to `value` at `time`, which must be later than the time of the previous change. `build`
    /// reports an earlier time.
    ///
    /// ```
    /// # use symbolt::sim::{PointerRef, SimDuration, Space, Stimulus, VocabTag};
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// # struct Actions;
    /// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
    /// let (parts, actions) = (Space::<Parts>::new(1, 2, "parts"), Space::<Actions>::new(2, 2, "actions"));
    /// let nut = PointerRef::<Parts>::from_raw(&[1.0, 0.0]);
    /// let grasp = PointerRef::<Actions>::from_raw(&[0.0, 1.0]);
    /// Stimulus::pointer(&parts, &nut).from(SimDuration::from_millis(5), &nut);
    /// ```
    ///
    /// A value with another tag does not compile:
    ///
    /// ```compile_fail
    /// # use symbolt::sim::{PointerRef, SimDuration, Space, Stimulus, VocabTag};
    /// # struct Parts;
    /// # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
    /// # struct Actions;
    /// # impl VocabTag for Actions { const NAME: &'static str = "actions"; }
    /// let (parts, actions) = (Space::<Parts>::new(1, 2, "parts"), Space::<Actions>::new(2, 2, "actions"));
    /// let nut = PointerRef::<Parts>::from_raw(&[1.0, 0.0]);
    /// let grasp = PointerRef::<Actions>::from_raw(&[0.0, 1.0]);
    /// Stimulus::pointer(&parts, &nut).from(SimDuration::from_millis(5), &grasp);
    /// ```
    pub fn from(self, time: SimDuration, value: &impl AsPointer<V>) -> Self {
        self.then(time, &value.as_pointer())
    }

    /// Changes the pointer to the zero vector at `time`, which must be later than the time of the previous change.
    pub fn silent_from(self, time: SimDuration) -> Self {
        let width = self.rest.len();
        self.then(time, &vec![0.0; width])
    }
}

impl<K: Kind> Stimulus<K> {
    fn new(spec: OutputSpec<K>, rest: Vec<Real>) -> Self {
        Self { spec, rest, entries: Vec::new(), starts: Vec::new() }
    }

    fn then(mut self, time: SimDuration, values: &[Real]) -> Self {
        self.starts.push(time);
        self.entries.push(values.to_vec());
        self
    }
}

impl<K: Kind> Node for Stimulus<K> {
    fn declare(&self, ports: &mut PortDecl) {
        let width = AnyOutput::from(self.spec.clone()).width();
        for values in self.entries.iter().chain([&self.rest]) {
            if values.len() != width {
                ports.fault(format!("a value has {} numbers; expected {width}", values.len()));
            }
            if values.iter().any(|v| !v.is_finite()) {
                ports.fault("a value is infinite or not a number; use finite values");
            }
        }
        if self.starts.windows(2).any(|w| w[0] >= w[1]) {
            ports.fault("the times of a stimulus must increase; give the changes in order of time");
        }
        ports.output("out", self.spec.clone());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&self.rest);
        for (start, values) in self.starts.iter().zip(&self.entries) {
            hash.number(start.as_micros()).reals(values);
        }
    }

    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let now = cx.time();
        let begun = self.starts.partition_point(|start| *start <= now);
        let values = begun.checked_sub(1).map_or(&self.rest, |latest| &self.entries[latest]);
        io.outputs.get_mut(0).copy_from_slice(values);
    }
}

impl<K: Kind> Module for Stimulus<K> {
    type Ports = Out<K>;

    fn expand(self, scope: &mut Scope<'_>) -> Out<K> {
        scope.leaf(self).output("out")
    }
}

/// Ports of an [`Add`].
pub struct AddPorts<K: Kind> {
    /// Takes any number of connections.
    pub input: In<K>,
    /// The sum of all connected values, added in the order of the sources' paths.
    pub output: Out<K>,
}

/// Adds the values of any number of connections, without delay.
pub struct Add<K: Kind> {
    input: InputSpec<K>,
    output: OutputSpec<K>,
}

impl Add<Scalar> {
    /// Creates a sum of numbers.
    pub fn scalar() -> Self {
        Self { input: InputSpec::scalar().sum(), output: OutputSpec::scalar() }
    }
}

impl Add<Vector> {
    /// Creates a sum of vectors with `width` components.
    pub fn vector(width: usize) -> Self {
        Self { input: InputSpec::vector(width).sum(), output: OutputSpec::vector(width) }
    }
}

impl<V: VocabTag> Add<Pointer<V>> {
    /// Creates a sum of pointers of `space`.
    pub fn pointer(space: &Space<V>) -> Self {
        Self { input: InputSpec::pointer(space).sum(), output: OutputSpec::pointer(space) }
    }
}

impl<K: Kind> Node for Add<K> {
    fn declare(&self, ports: &mut PortDecl) {
        ports.input("in", self.input.clone()).output("out", self.output.clone());
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        io.outputs.get_mut(0).copy_from_slice(io.inputs.get(0));
    }
}

impl<K: Kind> Module for Add<K> {
    type Ports = AddPorts<K>;

    fn expand(self, scope: &mut Scope<'_>) -> AddPorts<K> {
        let node = scope.leaf(self);
        AddPorts {
            input: scope.input("input", node.input("in")),
            output: scope.output("output", node.output("out")),
        }
    }
}

/// Ports of a [`Noise`].
pub struct NoisePorts<K: Kind> {
    /// The value without noise.
    pub input: In<K>,
    /// The value with noise added.
    pub output: Out<K>,
}

/// Adds independent Gaussian noise to every component in every tick, without delay.
///
/// The noise depends only on run seed, path and tick. The run multiplies the noise by its noise scale
/// ([`RunConfig::noise`](super::RunConfig::noise)). At scale 0 the output has the same bits as the input. A standard
/// deviation that is negative or not finite is a fault when the graph is built.
pub struct Noise<K: Kind> {
    input: InputSpec<K>,
    output: OutputSpec<K>,
    sd: Real,
    white: bool,
}

impl<K: Kind> Noise<K> {
    /// Scales the standard deviation with the tick, as white noise needs: the given one holds for ticks of 1 ms, and is
    /// multiplied by `sqrt(1 ms / tick)`. The noise behind a synapse is then about the same for every tick.
    pub fn white(mut self) -> Self {
        self.white = true;
        self
    }
}

impl Noise<Scalar> {
    /// Creates noise with standard deviation `sd` for a number.
    pub fn scalar(sd: Real) -> Self {
        Self { input: InputSpec::scalar(), output: OutputSpec::scalar(), sd, white: false }
    }
}

impl Noise<Vector> {
    /// Creates noise with standard deviation `sd` for each of the `width` components of a vector.
    pub fn vector(width: usize, sd: Real) -> Self {
        Self {
            input: InputSpec::vector(width),
            output: OutputSpec::vector(width),
            sd,
            white: false,
        }
    }
}

impl<V: VocabTag> Noise<Pointer<V>> {
    /// Creates noise with a norm of about `sigma` for a pointer of D dimensions: the standard deviation of each
    /// component is `sigma / sqrt(D)`.
    pub fn pointer(space: &Space<V>, sigma: Real) -> Self {
        let sd = sigma / (space.width() as Real).sqrt();
        Self {
            input: InputSpec::pointer(space),
            output: OutputSpec::pointer(space),
            sd,
            white: false,
        }
    }
}

impl<K: Kind> Node for Noise<K> {
    fn declare(&self, ports: &mut PortDecl) {
        if !self.sd.is_finite() || self.sd < 0.0 {
            ports.fault(format!(
                "a standard deviation of {} is not usable; use a finite number of at least 0",
                self.sd
            ));
        }
        ports.input("in", self.input.clone()).output("out", self.output.clone());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&[self.sd]);
        if self.white {
            hash.text("white");
        }
    }

    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let input = io.inputs.get(0);
        let output = io.outputs.get_mut(0);
        output.copy_from_slice(input);
        let per_tick = if self.white { (1e-3 / cx.dt_s()).sqrt() as Real } else { 1.0 };
        let sd = self.sd * per_tick * cx.noise_scale();
        if sd > 0.0 {
            let mut rng = cx.rng();
            for value in output {
                let draw: Real = rng.sample(StandardNormal);
                *value += sd * draw;
            }
        }
    }
}

impl<K: Kind> Module for Noise<K> {
    type Ports = NoisePorts<K>;

    fn expand(self, scope: &mut Scope<'_>) -> NoisePorts<K> {
        let node = scope.leaf(self);
        NoisePorts {
            input: scope.input("input", node.input("in")),
            output: scope.output("output", node.output("out")),
        }
    }
}
