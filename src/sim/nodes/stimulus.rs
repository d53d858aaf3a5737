//! A value that changes at given times, at once or gradually, once or again and again.

use super::spline;
use crate::sim::describe::builder::{Module, Scope};
use crate::sim::describe::fingerprint::Fingerprint;
use crate::sim::describe::handle::Out;
use crate::sim::describe::io::{EmitIo, StepCx};
use crate::sim::describe::kind::{AsPointer, Kind, Pointer, Scalar, Space, Vector, VocabTag};
use crate::sim::describe::node::Node;
use crate::sim::describe::port::{AnyOutput, OutputSpec, PortDecl};
use crate::sim::real::{Numbers, Real};
use crate::sim::time::SimDuration;

/// How a [`Stimulus`] goes from one value to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Interpolation {
    /// Holds a value until the time of the next.
    #[default]
    Hold,
    /// Takes the value whose time is nearest; of two, the earlier.
    Nearest,
    /// Draws straight lines.
    Linear,
    /// Draws the cubic spline whose third derivative is continuous at the second and the last but one value. It needs at
    /// least four values, and goes beyond them in between.
    Cubic,
}

/// An output whose value changes at given simulated times.
///
/// A tick has the value of its start: a change at 10 ms shows first in the tick from 10 to 11 ms. The value at the
/// beginning counts as one at 0 ms, and the last one holds for ever, unless the stimulus [repeats](Self::repeat).
///
/// Adding it to a graph returns the handle of the output. A value that is not finite is a fault when the graph is
/// built. Costs one copy per tick.
///
/// ```
/// use symbolt::sim::{Interpolation, SimDuration, Stimulus};
/// // 0 until 10 ms, then 1, and 0 again from 20 ms on.
/// let pulse = Stimulus::steps_ms([(0, 0.0), (10, 1.0), (20, 0.0)]);
/// // Up to 1 in 100 ms and down again, for ever.
/// let ramp = Stimulus::scalar(0.0)
///     .from(SimDuration::from_millis(100), &[1.0])
///     .from(SimDuration::from_millis(200), &[0.0])
///     .interpolate(Interpolation::Linear)
///     .repeat(SimDuration::from_millis(200));
/// // Three values for 50 ms each, in turn.
/// let rows = Stimulus::scalars(&[0.1, 0.7, -0.2], SimDuration::from_millis(50));
/// # let _ = (pulse, ramp, rows);
/// ```
#[doc(alias = "Piecewise")]
#[doc(alias = "PresentInput")]
pub struct Stimulus<K: Kind> {
    spec: OutputSpec<K>,
    course: Course,
}

/// How the value changes, whatever its kind.
struct Course {
    rest: Vec<Real>,
    entries: Vec<Vec<Real>>,
    starts: Vec<SimDuration>,
    interpolation: Interpolation,
    every: Option<SimDuration>,
    /// Second derivatives at the entries, component by component, of a cubic spline.
    curvatures: Vec<Vec<f64>>,
}

impl Stimulus<Scalar> {
    /// Creates a stimulus that starts as the number `value`.
    pub fn scalar(value: Real) -> Self {
        Self::new(OutputSpec::scalar(), vec![value])
    }

    /// Creates a stimulus that shows each value for a time of `each`, and then begins again.
    pub fn scalars(values: &[Real], each: SimDuration) -> Self {
        let rows = values.iter().map(|value| vec![*value]).collect();
        Self::rows(OutputSpec::scalar(), rows, each)
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
    /// Creates a stimulus of numbers, or of arrays of numbers, each from its time in ms on. Times must increase. Before
    /// the first the value is 0.
    ///
    /// ```
    /// use symbolt::sim::Stimulus;
    /// // One number, and two.
    /// let pulse = Stimulus::steps_ms([(200, 1.0), (300, 0.0)]);
    /// let pair = Stimulus::steps_ms([(0, [1.0, 0.0]), (50, [0.0, 1.0])]);
    /// # let _ = (pulse, pair);
    /// ```
    pub fn steps_ms<N: Numbers>(steps: impl IntoIterator<Item = (u64, N)>) -> Self {
        let mut stimulus = Self::vector(&vec![0.0; N::WIDTH]);
        for (place, (at, numbers)) in steps.into_iter().enumerate() {
            let mut values = vec![0.0; N::WIDTH];
            numbers.write(&mut values);
            match at {
                0 if place == 0 => stimulus.course.rest = values,
                // A second value for the start, which is a fault.
                0 => {
                    stimulus =
                        stimulus.then(SimDuration::ZERO, &values).then(SimDuration::ZERO, &values)
                }
                _ => stimulus = stimulus.then(SimDuration::from_millis(at), &values),
            }
        }
        stimulus
    }

    /// Creates a stimulus that starts as the vector `values`.
    pub fn vector(values: &[Real]) -> Self {
        Self::new(OutputSpec::vector(values.len()), values.to_vec())
    }

    /// Creates a stimulus that shows each row, a vector, for a time of `each`, and then begins again. The first row
    /// decides the width.
    pub fn vectors<R: AsRef<[Real]>>(rows: &[R], each: SimDuration) -> Self {
        let rows: Vec<Vec<Real>> = rows.iter().map(|row| row.as_ref().to_vec()).collect();
        let width = rows.first().map_or(1, Vec::len);
        Self::rows(OutputSpec::vector(width), rows, each)
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

    /// Creates a stimulus that shows each pointer of `space` for a time of `each`, and then begins again.
    pub fn pointers<P: AsPointer<V>>(space: &Space<V>, values: &[P], each: SimDuration) -> Self {
        let rows = values.iter().map(|value| value.as_pointer().to_vec()).collect();
        Self::rows(OutputSpec::pointer(space), rows, each)
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
        let width = self.course.rest.len();
        self.then(time, &vec![0.0; width])
    }
}

impl<K: Kind> Stimulus<K> {
    /// Creates a stimulus of any kind that starts as `rest`.
    pub(super) fn new(spec: OutputSpec<K>, rest: Vec<Real>) -> Self {
        let course = Course {
            rest,
            entries: Vec::new(),
            starts: Vec::new(),
            interpolation: Interpolation::Hold,
            every: None,
            curvatures: Vec::new(),
        };
        Self { spec, course }
    }

    fn rows(spec: OutputSpec<K>, rows: Vec<Vec<Real>>, each: SimDuration) -> Self {
        let times = |n: usize| SimDuration::from_micros(each.as_micros().saturating_mul(n as u64));
        let mut stimulus = Self::new(spec, rows.first().cloned().unwrap_or_else(|| vec![0.0]));
        stimulus.course.starts = (0..rows.len()).map(times).collect();
        stimulus.course.every = Some(times(rows.len()));
        stimulus.course.entries = rows;
        stimulus
    }

    /// Sets how the value goes from one to the next.
    pub fn interpolate(mut self, interpolation: Interpolation) -> Self {
        self.course.interpolation = interpolation;
        self
    }

    /// Begins again whenever a time of `every` has passed. It must be longer than the time of the last change; `build`
    /// reports a shorter one.
    pub fn repeat(mut self, every: SimDuration) -> Self {
        self.course.every = Some(every);
        self
    }

    fn then(mut self, time: SimDuration, values: &[Real]) -> Self {
        self.course.starts.push(time);
        self.course.entries.push(values.to_vec());
        self
    }
}

impl Course {
    fn declare(&self, ports: &mut PortDecl, spec: AnyOutput) {
        let width = spec.width();
        for values in self.entries.iter().chain([&self.rest]) {
            if values.len() != width {
                ports.fault(format!("a value has {} numbers; expected {width}", values.len()));
            }
            if values.iter().any(|v| !v.is_finite()) {
                ports.fault("a value is infinite or not a number; use finite values");
            }
        }
        if self.entries.is_empty() && self.every.is_some_and(SimDuration::is_zero) {
            ports.fault("no values; give at least one");
        } else if self.starts.windows(2).any(|w| w[0] >= w[1]) {
            ports.fault("the times of a stimulus must increase; give the changes in order of time");
        } else if let Some(every) = self.every
            && self.starts.last().map_or(every.is_zero(), |last| *last >= every)
        {
            ports.fault(format!(
                "it begins again after {every}; use a longer time than that of its last change, and more than 0"
            ));
        }
        if self.interpolation == Interpolation::Cubic && self.starts.len() < 4 {
            ports.fault(format!(
                "a cubic interpolation of {} values is not possible; give at least 4, with the one at 0 ms",
                self.starts.len()
            ));
        }
        ports.output("out", spec);
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.reals(&self.rest);
        for (start, values) in self.starts.iter().zip(&self.entries) {
            hash.number(start.as_micros()).reals(values);
        }
        if self.interpolation != Interpolation::Hold {
            hash.number(self.interpolation as u64);
        }
        if let Some(every) = self.every {
            hash.text("every").number(every.as_micros());
        }
    }

    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let now = match self.every {
            Some(every) => SimDuration::from_micros(cx.time().as_micros() % every.as_micros()),
            None => cx.time(),
        };
        let out = io.outputs.get_mut(0);
        let begun = self.starts.partition_point(|start| *start <= now);
        let Some(latest) = begun.checked_sub(1) else { return out.copy_from_slice(&self.rest) };
        let values = &self.entries[latest];
        if self.interpolation == Interpolation::Hold || begun == self.starts.len() {
            return out.copy_from_slice(values);
        }
        let next = &self.entries[begun];
        let span = |from: SimDuration, to: SimDuration| (to.as_micros() - from.as_micros()) as f64;
        let whole = span(self.starts[latest], self.starts[begun]);
        let share = span(self.starts[latest], now) / whole;
        if self.interpolation == Interpolation::Nearest {
            return out.copy_from_slice(if share <= 0.5 { values } else { next });
        }
        for (index, (out, (from, to))) in out.iter_mut().zip(values.iter().zip(next)).enumerate() {
            let ends = [f64::from(*from), f64::from(*to)];
            let bend = self.curvatures.get(index).map_or([0.0; 2], |c| [c[latest], c[begun]]);
            *out = spline::cubic(ends, bend, whole * 1e-6, share) as Real;
        }
    }
    /// Adds the value at the beginning, and the curvatures of a spline.
    fn prepare(&mut self) {
        if self.interpolation != Interpolation::Hold
            && self.starts.first() != Some(&SimDuration::ZERO)
        {
            self.starts.insert(0, SimDuration::ZERO);
            self.entries.insert(0, self.rest.clone());
        }
        let width = self.rest.len();
        let even = self.entries.iter().all(|values| values.len() == width);
        let ordered = self.starts.windows(2).all(|w| w[0] < w[1]);
        if self.interpolation == Interpolation::Cubic && self.starts.len() >= 4 && even && ordered {
            let times: Vec<f64> = self.starts.iter().map(|start| start.as_secs_f64()).collect();
            let of = |at: usize| -> Vec<f64> {
                let values = self.entries.iter().map(|values| f64::from(values[at]));
                spline::curvatures(&times, &values.collect::<Vec<f64>>())
            };
            self.curvatures = (0..width).map(of).collect();
        }
    }
}

impl<K: Kind> Node for Stimulus<K> {
    fn declare(&self, ports: &mut PortDecl) {
        self.course.declare(ports, self.spec.clone().into());
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.course.fingerprint(hash);
    }

    fn emit(&self, cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        self.course.emit(cx, io);
    }
}

impl<K: Kind> Module for Stimulus<K> {
    type Ports = Out<K>;

    fn expand(mut self, scope: &mut Scope<'_>) -> Out<K> {
        self.course.prepare();
        scope.leaf(self).output("out")
    }
}
