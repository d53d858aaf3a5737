//! A value that changes at given times.

use crate::sim::describe::builder::{Module, Scope};
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::describe::handle::Out;
use crate::sim::describe::io::{EmitIo, StepCx};
use crate::sim::describe::kind::{AsPointer, Kind, Pointer, Scalar, Space, Vector, VocabTag};
use crate::sim::describe::node::Node;
use crate::sim::describe::port::{AnyOutput, OutputSpec, PortDecl};
use crate::sim::real::Real;
use crate::sim::time::SimDuration;

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
    /// Creates a stimulus of any kind that starts as `rest`.
    pub(super) fn resting(spec: OutputSpec<K>, rest: Vec<Real>) -> Self {
        Self { spec, rest, entries: Vec::new(), starts: Vec::new() }
    }

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
