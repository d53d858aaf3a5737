//! A population that represents one pointer and, with a recurrent synapse, remembers it.

use super::weighted_sum::Superpose;
use super::{FEED_FORWARD, population};
use crate::neurons::Layers;
use crate::sim::Ports;
use crate::sim::{Add, Module, Pointer, Real, Scope, Space, Synapse, VocabTag};
use crate::spa::vocabulary::Vocabulary;

/// A population that represents one pointer, one synapse (5 ms) later. Its input adds any number of connections.
///
/// With a [`recurrent`](Self::recurrent) synapse it is an integrator: it remembers its input.
///
/// Exact, rate and spiking answers to random pointers differ by at most 0.15 for norms up to the radius, and by 0.3 beyond it
/// (`docs/agreement.md`). Neurons saturate where one component holds most of the norm, as in the identity of circular convolution;
/// [`Saturation`](crate::neurons::Saturation) counts it.
pub struct State<V: VocabTag> {
    space: Space<V>,
    radius: Real,
    synapse: Synapse,
    recurrent: Option<Synapse>,
    retention: Real,
}

impl<V: VocabTag> State<V> {
    /// Makes a population for pointers of `vocabulary` with a norm of up to 1.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        let space = vocabulary.space().clone();
        Self { space, radius: 1.0, synapse: FEED_FORWARD, recurrent: None, retention: 1.0 }
    }

    /// Feeds the value back with weight 1 through `synapse`. The population then keeps the value when the input ends.
    ///
    /// The population integrates its input. An input that lasts as long as the time constant of the synapse is stored
    /// with its full norm, and a longer one with more: up to twice the radius in exact maths, and 1.6 to 2.3 in neurons. Answers differ
    /// by at most 0.7 for pointers of norm 1 (`docs/agreement.md`). In spikes, what is stored keeps a cosine of about .86 for 2 s at 64 dimensions, and a memory into
    /// which nothing was written drifts to a norm of about .1 in that time: [`retention`](Self::retention) below 1 forgets.
    pub fn recurrent(mut self, synapse: Synapse) -> Self {
        self.recurrent = Some(synapse);
        self
    }

    /// Replaces the weight of the recurrent connection (default 1). It has no effect without a
    /// [`recurrent`](Self::recurrent) synapse.
    ///
    /// With a weight of `1 - s / tau`, where `s` is the time constant of the recurrent synapse, the value decays with the
    /// time constant `tau`, and a constant input is amplified by `tau / s` until the population saturates. A weight that is
    /// not finite is a fault when the graph is built.
    ///
    /// ```
    /// use symbolt::prelude::*;
    ///
    /// symbolt::vocabulary!(Parts = "parts": NUT);
    /// let parts = Parts::vocabulary(64, Seed::new(1))?;
    /// let mut graph = GraphBuilder::new();
    /// let leaky = State::new(&parts).recurrent(Synapse::lowpass_ms(10)).retention(0.8);
    /// let leaky = graph.add("leaky", leaky);
    /// graph.route(0.1 * Parts::NUT >> &leaky);
    /// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(500))?;
    /// let amplified = dot(&sim.value(&leaky.output), &parts.get("NUT")?);
    /// assert!((amplified - 0.5).abs() < 0.01);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn retention(mut self, weight: Real) -> Self {
        self.retention = weight;
        self
    }

    /// Sets the radius: the greatest norm of a pointer that is represented unchanged.
    ///
    /// The default is 1. Anything but a finite number above 0 is a fault when the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// Replaces the synapse on the output (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl<V: VocabTag> Module for State<V> {
    type Ports = Ports<Pointer<V>>;

    fn expand(self, scope: &mut Scope<'_>) -> Ports<Pointer<V>> {
        let mut layer = population(&self.space, self.radius);
        if self.recurrent.is_some() {
            layer = if self.retention == 1.0 { layer.kept() } else { layer.fed_back() };
        }
        let held: Ports<Pointer<V>> = scope.represent("population", layer);
        let output = scope.add("output", Add::pointer(&self.space));
        scope.connect(&held.output, &output.input, self.synapse);
        match self.recurrent {
            Some(recurrent) if self.retention == 1.0 => {
                scope.connect(&held.output, &held.input, recurrent);
            }
            Some(recurrent) => {
                let leak = Superpose::in_space(&self.space, &[self.retention]);
                let leak = scope.add("leak", leak);
                scope.connect(&held.output, &leak.inputs[0], recurrent);
                scope.connect(&leak.output, &held.input, Synapse::None);
            }
            None => {}
        }
        Ports {
            input: scope.input("input", held.input),
            output: scope.output("output", output.output),
        }
    }
}
