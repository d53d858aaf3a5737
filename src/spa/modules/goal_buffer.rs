//! A goal buffer: a memory that takes up its input while its gate is open and holds it after.

use super::{FEED_FORWARD, Gate, RECURRENT, population};
use crate::neurons::{LayerPorts, Layers};
use crate::sim::{Add, In, Module, Out, Pointer, Real, Scalar, Scope, Space, Synapse, VocabTag};
use crate::spa::modules::linear::Superpose;
use crate::spa::vocabulary::Vocabulary;

/// A gated memory for one pointer.
///
/// A population holds its value through a recurrent synapse (100 ms). While the gate is open, ten
/// times the difference between input and held value drives it, so that the output follows the
/// input within two feed-forward synapses (5 ms each) and the held value within 10% after 40 ms. Slower feed-forward
/// synapses have a weaker drive, in proportion, and take as much longer: at ten times the difference the loop of
/// gate and memory would ring, and take up what it held before with the opposite sign.
/// Closed, the direct form holds its value unchanged. Its clamp, where a spiking form saturates, is
/// a norm of 3: the drive that charges the slow synapse passes through the same population, and a lower
/// clamp charges it more slowly.
pub struct GoalBuffer<V: VocabTag> {
    space: Space<V>,
    radius: Real,
    synapse: Synapse,
    recurrent: Synapse,
    retention: Real,
}

/// Ports of a [`GoalBuffer`].
pub struct GoalBufferPorts<V: VocabTag> {
    /// What is taken up while the gate is open.
    pub input: In<Pointer<V>>,
    /// 1 to take up, 0 to hold.
    pub open: In<Scalar>,
    /// What is held.
    pub output: Out<Pointer<V>>,
}

/// The greatest factor by which the difference between input and memory drives the memory.
const MAX_GAIN: f64 = 10.0;

impl<V: VocabTag> GoalBuffer<V> {
    /// A memory for pointers of `vocabulary` of norm about 1.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        Self {
            space: vocabulary.space().clone(),
            radius: 3.0,
            synapse: FEED_FORWARD,
            recurrent: RECURRENT,
            retention: 1.0,
        }
    }

    /// Replaces the clamp.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// Replaces the synapse on the way in.
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }

    /// Replaces the synapse by which the value is held.
    pub fn recurrent(mut self, recurrent: Synapse) -> Self {
        self.recurrent = recurrent;
        self
    }

    /// Replaces the weight by which the value is fed back, 0 to 1: below 1 it fades, with a time constant of
    /// the recurrent synapse's over one less the weight; above 1 it would grow up to the clamp.
    pub fn retention(mut self, weight: Real) -> Self {
        self.retention = weight;
        self
    }
}

impl<V: VocabTag> GoalBuffer<V> {
    /// The strongest drive at which the held value overshoots by 4% and no more. With memory m, gate g and gain G,
    /// `tau_r m' = G g` and `tau_f g' = u - m - g`, whose damping is `sqrt(tau_r / (G tau_f)) / 2`: 0.707 here.
    fn gain(&self) -> Real {
        let gain = match (self.recurrent, self.synapse) {
            (Synapse::Lowpass { tau: slow }, Synapse::Lowpass { tau: fast }) => {
                slow.as_secs_f64() / (2.0 * fast.as_secs_f64())
            }
            _ => MAX_GAIN,
        };
        gain.min(MAX_GAIN) as Real
    }
}

impl<V: VocabTag> Module for GoalBuffer<V> {
    type Ports = GoalBufferPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> GoalBufferPorts<V> {
        let gain = self.gain();
        let layer = population(&self.space, self.radius);
        let held: LayerPorts<Pointer<V>> = scope.represent("held", layer);
        let memory = scope.add("memory", Add::pointer(&self.space));
        let output = scope.add("output", Add::pointer(&self.space));
        let difference =
            scope.add("difference", Superpose::<V>::weights(&self.space, &[1.0, -1.0]));
        let gate = scope.add(
            "gate",
            Gate::<V>::in_space(&self.space).radius(self.radius).synapse(self.synapse),
        );
        let drive = scope.add("drive", Superpose::<V>::weights(&self.space, &[gain]));
        scope.connect(&held.output, &memory.input, self.recurrent);
        scope.connect(&held.output, &output.input, self.synapse);
        if self.retention == 1.0 {
            scope.connect(&memory.output, &held.input, Synapse::None);
        } else {
            let leak = Superpose::<V>::weights(&self.space, &[self.retention]);
            let leak = scope.add("leak", leak);
            scope.connect(&memory.output, &leak.inputs[0], Synapse::None);
            scope.connect(&leak.output, &held.input, Synapse::None);
        }
        scope.connect(&memory.output, &difference.inputs[1], Synapse::None);
        scope.connect(&difference.output, &gate.input, Synapse::None);
        scope.connect(&gate.output, &drive.inputs[0], Synapse::None);
        scope.connect(&drive.output, &held.input, Synapse::None);
        GoalBufferPorts {
            input: scope.input("input", difference.inputs[0].clone()),
            open: scope.input("open", gate.open),
            output: scope.output("output", output.output),
        }
    }
}
