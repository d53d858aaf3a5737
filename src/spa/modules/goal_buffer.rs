//! A goal buffer: a memory that stores its input while its gate is open and holds it afterwards.

use super::weighted_sum::Superpose;
use super::{FEED_FORWARD, Gate, RECURRENT, population};
use crate::neurons::{GatePorts, Layers};
use crate::sim::{Add, Module, Pointer, Ports, Real, Scope, Space, Synapse, VocabTag};
use crate::spa::vocabulary::Vocabulary;

/// A gated memory for one pointer. Its input takes one connection; while `open` is 1 it is stored, while `open` is 0 the
/// stored pointer is held.
///
/// A population holds its value through a recurrent synapse (100 ms). While the gate is open, ten times the difference
/// between input and held value drives the population. The output then follows the input within two feed-forward
/// synapses (5 ms each), and after 40 ms the held value is within 10% of the input. While the gate is closed, direct
/// mode holds the value unchanged; neurons add a slow drift.
///
/// With slower feed-forward synapses the drive is proportionally weaker, and storing takes proportionally longer. With
/// the full drive, the loop of gate and memory would then ring and store the previous value with the opposite sign.
///
/// The radius is 3, because the drive passes through the population that also holds the value. Direct mode clamps at
/// the radius; neurons saturate there.
pub struct GoalBuffer<V: VocabTag> {
    space: Space<V>,
    synapse: Synapse,
    retention: Real,
}

/// Greatest norm that the population represents.
const RADIUS: Real = 3.0;

/// Greatest factor by which the difference between input and memory drives the memory.
const MAX_GAIN: f64 = 10.0;

impl<V: VocabTag> GoalBuffer<V> {
    /// Makes a memory for pointers of `vocabulary` with a norm of about 1.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        Self { space: vocabulary.space().clone(), synapse: FEED_FORWARD, retention: 1.0 }
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
}

impl<V: VocabTag> GoalBuffer<V> {
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

impl<V: VocabTag> Module for GoalBuffer<V> {
    type Ports = GatePorts<Pointer<V>>;

    fn expand(self, scope: &mut Scope<'_>) -> GatePorts<Pointer<V>> {
        let gain = self.gain();
        let layer = population(&self.space, RADIUS);
        let held: Ports<Pointer<V>> = scope.represent("held", layer);
        let memory = scope.add("memory", Add::pointer(&self.space));
        let output = scope.add("output", Add::pointer(&self.space));
        let difference = scope.add("difference", Superpose::in_space(&self.space, &[1.0, -1.0]));
        let gate = scope
            .add("gate", Gate::<V>::in_space(&self.space).radius(RADIUS).synapse(self.synapse));
        let drive = scope.add("drive", Superpose::in_space(&self.space, &[gain]));
        scope.connect(&held.output, &memory.input, RECURRENT);
        scope.connect(&held.output, &output.input, self.synapse);
        if self.retention == 1.0 {
            scope.connect(&memory.output, &held.input, Synapse::None);
        } else {
            let leak = Superpose::in_space(&self.space, &[self.retention]);
            let leak = scope.add("leak", leak);
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
