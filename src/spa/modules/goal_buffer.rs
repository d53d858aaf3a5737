//! Gated memories: store their input while the gate is open and hold it afterwards.

use super::gate::ValueGate;
use super::weighted_sum::Superpose;
use super::{FEED_FORWARD, RECURRENT, refuse_none};
use crate::neurons::{GatePorts, Layers, Represent};
use crate::sim::{Add, Module, Pointer, Ports, Real, Scalar, Scope, Synapse, Vector, VocabTag};
use crate::spa::flow::FlowKind;
use crate::spa::vocabulary::Vocabulary;

/// A gated memory for one pointer. Its input takes one connection; while `open` is 1 it is stored, while `open` is 0 the
/// stored pointer is held. [`GatedMemory`] stores numbers and vectors in the same way.
///
/// A population holds its value through a recurrent synapse (100 ms). While the gate is open, ten times the difference
/// between input and held value, times `open`, drives the population. The output then follows the input within two
/// feed-forward synapses (5 ms each), and after 40 ms the held value is within 10% of the input. Any opening from 0.1 on
/// stores the input, in inverse proportion more slowly; below 0.1 the gate is closed, in every mode.
///
/// While the gate is closed, direct mode holds the value unchanged. Neurons drift: at the default number of neurons a
/// pointer of norm 1 keeps its norm within 10% and a cosine of at least 0.95 for 2 s, one of norm 0.5 at least 0.9. Answers
/// of the modes differ by at most 0.12 in the first 200 ms (`docs/agreement.md`).
///
/// With slower feed-forward synapses the drive is proportionally weaker, and storing takes proportionally longer. With
/// the full drive, the loop of gate and memory would then ring and store the previous value with the opposite sign.
///
/// The drive passes through the population that also holds the value, so the population represents three times the
/// radius. Direct mode clamps there; in neurons each component has an ensemble of its own, which saturates at 2.5
/// standard deviations of a random pointer of the radius.
pub type GoalBuffer<V> = GatedMemory<Pointer<V>>;

impl<V: VocabTag> GatedMemory<Pointer<V>> {
    /// Makes a memory for pointers of `vocabulary` with a norm of about 1.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        Self { split: true, ..Self::of(vocabulary.space().clone()) }
    }
}

/// A gated memory for a number or a vector: stores its input while `open` is 1 and holds it while `open` is 0, as a
/// [`GoalBuffer`] does for pointers. Its input takes one connection.
///
/// Nengo's `InputGatedMemory` does the same with the opposite sign: its gate is shut by 1.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::sim::Signal;
/// use symbolt::spa::GatedMemory;
///
/// let mut graph = GraphBuilder::new();
/// let input = graph.add("input", Signal::scalar(|t| if t < 0.2 { 0.6 } else { -0.8 }));
/// let open = graph.add("open", Signal::scalar(|t| if t < 0.1 { 1.0 } else { 0.0 }));
/// let memory = graph.add("memory", GatedMemory::scalar());
/// graph.route(&input >> &memory);
/// graph.route(&open >> &memory.open);
/// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(500))?;
/// assert!((sim.value(&memory.output)[0] - 0.6).abs() < 0.01);
/// # Ok::<(), symbolt::sim::SimError>(())
/// ```
pub struct GatedMemory<K: FlowKind> {
    shape: K::Shape,
    radius: Real,
    synapse: Synapse,
    retention: Real,
    /// Whether each component of a pointer has an ensemble of its own.
    split: bool,
}

/// Radius of the population, in units of the radius of a stored value. It leaves room for the drive.
const ROOM: Real = 3.0;

/// Greatest factor by which the difference between input and memory drives the memory.
const MAX_GAIN: f64 = 10.0;

impl GatedMemory<Scalar> {
    /// Makes a memory for a number between -1 and 1.
    pub fn scalar() -> Self {
        Self::of(())
    }
}

impl GatedMemory<Vector> {
    /// Makes a memory for vectors of `width` components between -1 and 1.
    pub fn vector(width: usize) -> Self {
        Self::of(width)
    }
}

impl<K: FlowKind> GatedMemory<K> {
    fn of(shape: K::Shape) -> Self {
        Self { shape, radius: 1.0, synapse: FEED_FORWARD, retention: 1.0, split: false }
    }

    /// Sets the greatest magnitude of a component, or of a pointer the greatest norm, that is stored unchanged (default 1).
    /// Held values drift more, the smaller they are beside it. Anything but a finite number above 0 is a fault when the
    /// graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// Replaces the feed-forward synapse of the gate and the output (default 5 ms). Slower synapses also weaken the
    /// drive.
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }

    /// Replaces the weight of the recurrent connection (default 1).
    ///
    /// Below 1 the held value decays with the time constant `tau / (1 - weight)`, where `tau` is the time constant of
    /// the recurrent synapse. Above 1 the value grows until it reaches the radius. A weight that is not finite is a
    /// fault when the graph is built.
    pub fn retention(mut self, weight: Real) -> Self {
        self.retention = weight;
        self
    }

    /// Returns the strongest drive at which the held value overshoots by at most 4%.
    ///
    /// With memory m, gate g, input u and gain G, `tau_r m' = G g` and `tau_f g' = u - m - g`. The damping ratio of
    /// this system is `sqrt(tau_r / (G tau_f)) / 2`, which is 0.707 for the gain chosen here.
    fn gain(&self) -> Real {
        let gain = match (RECURRENT, self.synapse) {
            (Synapse::Lowpass { tau: slow }, Synapse::Lowpass { tau: fast }) => {
                slow.as_secs_f64() / (2.0 * fast.as_secs_f64())
            }
            _ => MAX_GAIN,
        };
        gain.min(MAX_GAIN) as Real
    }
}

impl<K: FlowKind> Module for GatedMemory<K> {
    type Ports = GatePorts<K>;

    fn expand(self, scope: &mut Scope<'_>) -> GatePorts<K> {
        refuse_none(scope, "components", K::width(&self.shape));
        if !(self.radius.is_finite() && self.radius > 0.0) {
            let found = self.radius;
            scope.refuse(format!("the radius is {found}; expected a finite number above 0"));
        }
        let (gain, radius, split) = (self.gain(), ROOM * self.radius, self.split);
        let specs = || K::specs(&self.shape);
        let add = || Add::of(specs().0, specs().1);
        let superpose = |weights: &[Real]| Superpose {
            specs: specs(),
            weights: weights.to_vec(),
            constant: vec![0.0; K::width(&self.shape)],
        };
        let layer = Represent::new::<K>(specs().0, specs().1, radius);
        let layer = if split { layer.split() } else { layer.kept() };
        let held: Ports<K> = scope.represent("held", layer);
        let memory = scope.add("memory", add());
        let output = scope.add("output", add());
        let difference = scope.add("difference", superpose(&[1.0, -1.0]));
        // A number behind the gate drives the memory to its limit long before the difference is greatest. Neurons that
        // represent no more are less noisy.
        let passed = if split { ROOM } else { ROOM.min((ROOM + 1.0) / gain) } * self.radius;
        let gate = ValueGate::<K>::of(self.shape.clone()).radius(passed).synapse(self.synapse);
        let gate = scope.add("gate", if split { gate.split() } else { gate });
        let drive = scope.add("drive", superpose(&[gain]));
        scope.connect(&held.output, &memory.input, RECURRENT);
        scope.connect(&held.output, &output.input, self.synapse);
        if self.retention == 1.0 {
            scope.connect(&memory.output, &held.input, Synapse::None);
        } else {
            let leak = scope.add("leak", superpose(&[self.retention]));
            scope.connect(&memory.output, &leak.inputs[0], Synapse::None);
            scope.connect(&leak.output, &held.input, Synapse::None);
        }
        scope.connect(&memory.output, &difference.inputs[1], Synapse::None);
        scope.connect(&difference.output, &gate.input, Synapse::None);
        scope.connect(&gate.output, &drive.inputs[0], Synapse::None);
        scope.connect(&drive.output, &held.input, Synapse::None);
        GatePorts {
            input: scope.input("input", difference.inputs[0].clone()),
            open: scope.input("open", gate.open),
            output: scope.output("output", output.output),
        }
    }
}
