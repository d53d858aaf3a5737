//! A pointer held by a population: as it comes, or kept by a recurrent synapse.

use super::{FEED_FORWARD, population};
use crate::neurons::{LayerPorts, Layers};
use crate::sim::{Add, In, Module, Out, Pointer, Real, Scope, Space, Synapse, VocabTag};
use crate::spa::vocabulary::Vocabulary;

/// A population for one pointer; with a recurrent synapse an integrator that keeps what it was given.
pub struct State<V: VocabTag> {
    space: Space<V>,
    radius: Real,
    synapse: Synapse,
    recurrent: Option<Synapse>,
}

/// Ports of a [`State`].
pub struct StatePorts<V: VocabTag> {
    /// What is represented; any number of sources.
    pub input: In<Pointer<V>>,
    /// The same, one synapse later.
    pub output: Out<Pointer<V>>,
}

impl<V: VocabTag> State<V> {
    /// A population for pointers of `vocabulary` of norm up to 1.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        let space = vocabulary.space().clone();
        Self { space, radius: 1.0, synapse: FEED_FORWARD, recurrent: None }
    }

    /// Feeds the value back with weight 1 through `synapse`, so that it stays when the input goes: an
    /// input held for the synapse's time constant is taken up whole.
    pub fn recurrent(mut self, synapse: Synapse) -> Self {
        self.recurrent = Some(synapse);
        self
    }

    /// Represents pointers of norm up to `radius`.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// Replaces the synapse on the way out.
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl<V: VocabTag> Module for State<V> {
    type Ports = StatePorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> StatePorts<V> {
        let layer = population(&self.space, self.radius);
        let held: LayerPorts<Pointer<V>> = scope.represent("population", layer);
        let output = scope.add("output", Add::pointer(&self.space));
        scope.connect(&held.output, &output.input, self.synapse);
        if let Some(recurrent) = self.recurrent {
            scope.connect(&held.output, &held.input, recurrent);
        }
        StatePorts {
            input: scope.input("input", held.input),
            output: scope.output("output", output.output),
        }
    }
}
