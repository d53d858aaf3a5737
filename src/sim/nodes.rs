//! The few nodes that know no symbols: constants, scripted stimuli, sums, noise.

use rand::RngExt;
use rand_distr::StandardNormal;

use super::builder::{Module, Scope};
use super::fingerprint::Fingerprint;
use super::handle::{In, Out};
use super::kind::{AsPointer, Kind, Pointer, Scalar, Space, Vector, VocabTag};
use super::node::{EmitIo, Node, Real, StepCx};
use super::port::{AnyOutput, InputSpec, OutputSpec, PortDecl};
use super::time::SimDuration;

/// Values that never change. Costs one copy a tick; adds no tick of delay.
pub struct Constant<K: Kind> {
    spec: OutputSpec<K>,
    values: Vec<Real>,
}

impl Constant<Scalar> {
    /// One number.
    pub fn scalar(value: Real) -> Self {
        Self { spec: OutputSpec::scalar(), values: vec![value] }
    }
}

impl Constant<Vector> {
    /// A vector.
    pub fn vector(values: &[Real]) -> Self {
        Self { spec: OutputSpec::vector(values.len()), values: values.to_vec() }
    }
}

impl<V: VocabTag> Constant<Pointer<V>> {
    /// A pointer of `space`; any other length is a fault that `build` reports.
    ///
    /// A pointer of one vocabulary stands where one of that vocabulary is wanted,
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
    /// and where one of another is wanted, the program does not compile:
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

/// Values on a schedule: what holds from the start, then at given times something else. Costs
/// one copy a tick; adds no tick of delay.
pub struct Stimulus<K: Kind> {
    spec: OutputSpec<K>,
    rest: Vec<Real>,
    entries: Vec<Vec<Real>>,
    starts: Vec<SimDuration>,
}

impl Stimulus<Scalar> {
    /// One number, `value` from the start.
    pub fn scalar(value: Real) -> Self {
        Self::new(OutputSpec::scalar(), vec![value])
    }

    /// From `time` on, `values`, one number. Times must be given in increasing order.
    pub fn from(self, time: SimDuration, values: &[Real]) -> Self {
        self.then(time, values)
    }
}

impl Stimulus<Vector> {
    /// A vector, `values` from the start.
    pub fn vector(values: &[Real]) -> Self {
        Self::new(OutputSpec::vector(values.len()), values.to_vec())
    }

    /// From `time` on, `values`. Times must be given in increasing order.
    pub fn from(self, time: SimDuration, values: &[Real]) -> Self {
        self.then(time, values)
    }
}

impl<V: VocabTag> Stimulus<Pointer<V>> {
    /// A pointer of `space`, `value` from the start.
    pub fn pointer(space: &Space<V>, value: &impl AsPointer<V>) -> Self {
        Self::new(OutputSpec::pointer(space), value.as_pointer().to_vec())
    }

    /// From `time` on, `value`, as for every other kind in order of time.
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

    /// From `time` on, the zero vector.
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
                ports.fault(format!("{} values are given for a width of {width}", values.len()));
            }
            if values.iter().any(|v| !v.is_finite()) {
                ports.fault("a value is not a finite number");
            }
        }
        if self.starts.windows(2).any(|w| w[0] >= w[1]) {
            ports.fault("the times of a stimulus must increase");
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

/// Input and output of an [`Add`].
pub struct AddPorts<K: Kind> {
    /// Takes any number of sources.
    pub input: In<K>,
    /// Their sum, in the order of the sources' paths.
    pub output: Out<K>,
}

/// Adds any number of sources. No tick of delay.
pub struct Add<K: Kind> {
    input: InputSpec<K>,
    output: OutputSpec<K>,
}

impl Add<Scalar> {
    /// A sum of numbers.
    pub fn scalar() -> Self {
        Self { input: InputSpec::scalar().sum(), output: OutputSpec::scalar() }
    }
}

impl Add<Vector> {
    /// A sum of vectors of `width`.
    pub fn vector(width: usize) -> Self {
        Self { input: InputSpec::vector(width).sum(), output: OutputSpec::vector(width) }
    }
}

impl<V: VocabTag> Add<Pointer<V>> {
    /// A sum of pointers of `space`.
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
        AddPorts { input: node.input("in"), output: node.output("out") }
    }
}

/// Input and output of a [`Noise`].
pub struct NoisePorts<K: Kind> {
    /// What is to be disturbed.
    pub input: In<K>,
    /// It, with noise added.
    pub output: Out<K>,
}

/// Adds independent Gaussian noise to every component in every tick. No tick of delay.
///
/// The noise is a function of run seed, path and tick alone, and is multiplied by the run's noise
/// scale: at 0 the output equals the input bit for bit.
pub struct Noise<K: Kind> {
    input: InputSpec<K>,
    output: OutputSpec<K>,
    sd: Real,
}

impl Noise<Scalar> {
    /// Noise of standard deviation `sd` on a number.
    pub fn scalar(sd: Real) -> Self {
        Self { input: InputSpec::scalar(), output: OutputSpec::scalar(), sd }
    }
}

impl Noise<Vector> {
    /// Noise of standard deviation `sd` on every component of a vector.
    pub fn vector(width: usize, sd: Real) -> Self {
        Self { input: InputSpec::vector(width), output: OutputSpec::vector(width), sd }
    }
}

impl<V: VocabTag> Noise<Pointer<V>> {
    /// Noise of norm about `sigma` on a pointer: `sigma / sqrt(D)` a component.
    pub fn pointer(space: &Space<V>, sigma: Real) -> Self {
        let sd = sigma / (space.width() as Real).sqrt();
        Self { input: InputSpec::pointer(space), output: OutputSpec::pointer(space), sd }
    }
}

impl<K: Kind> Node for Noise<K> {
    fn declare(&self, ports: &mut PortDecl) {
        if !self.sd.is_finite() || self.sd < 0.0 {
            ports.fault(format!("a noise of {} is not a finite number of at least 0", self.sd));
        }
        ports.input("in", self.input.clone()).output("out", self.output.clone());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&[self.sd]);
    }

    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let input = io.inputs.get(0);
        let output = io.outputs.get_mut(0);
        output.copy_from_slice(input);
        let sd = self.sd * cx.noise_scale();
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
        NoisePorts { input: node.input("in"), output: node.output("out") }
    }
}
