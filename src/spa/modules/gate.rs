//! A gate: lets a pointer pass while a scalar is 1, and silences it while the scalar is 0.

use super::{FEED_FORWARD, population};
use crate::neurons::{GatePorts, Layers};
use crate::sim::{Add, Module, Pointer, Real, Scope, Space, Synapse, VocabTag};
use crate::spa::vocabulary::Vocabulary;

/// A gate: lets a pointer pass while it is open, one synapse (5 ms) later. Its input adds any number of connections.
///
/// A sum at `open` below 0 counts as 0, and a sum above 1 as 1. In direct mode, values between 0 and 1 scale the
/// pointer; neurons respond more steeply.
///
/// Pointers are typed by vocabulary. A gate of `Parts` takes a pointer of `Parts`:
///
/// ```
/// # use symbolt::prelude::*;
/// # use symbolt::sim::VocabTag;
/// # use symbolt::spa::{Gate, VocabularyBuilder};
/// struct Parts;
/// impl VocabTag for Parts { const NAME: &'static str = "parts"; }
/// struct Actions;
/// impl VocabTag for Actions { const NAME: &'static str = "actions"; }
///
/// let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointer("NUT").build()?;
/// let actions = VocabularyBuilder::<Actions>::new(64, Seed::new(1)).pointer("GRASP").build()?;
/// let mut graph = GraphBuilder::new();
/// let nut = graph.add("nut", Constant::pointer(parts.space(), &parts.get("NUT")?));
/// let gate = graph.add("gate", Gate::new(&parts));
/// graph.connect(&nut, &gate.input, Synapse::None);
/// # Ok::<(), symbolt::spa::VocabError>(())
/// ```
///
/// A gate of `Actions` does not take it, so this program does not compile:
///
/// ```compile_fail
/// # use symbolt::prelude::*;
/// # use symbolt::sim::VocabTag;
/// # use symbolt::spa::{Gate, VocabularyBuilder};
/// struct Parts;
/// impl VocabTag for Parts { const NAME: &'static str = "parts"; }
/// struct Actions;
/// impl VocabTag for Actions { const NAME: &'static str = "actions"; }
///
/// let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointer("NUT").build()?;
/// let actions = VocabularyBuilder::<Actions>::new(64, Seed::new(1)).pointer("GRASP").build()?;
/// let mut graph = GraphBuilder::new();
/// let nut = graph.add("nut", Constant::pointer(parts.space(), &parts.get("NUT")?));
/// let gate = graph.add("gate", Gate::new(&actions));
/// graph.connect(&nut, &gate.input, Synapse::None);
/// # Ok::<(), symbolt::spa::VocabError>(())
/// ```
pub struct Gate<V: VocabTag> {
    space: Space<V>,
    radius: Real,
    synapse: Synapse,
    inhibition: Real,
}

impl<V: VocabTag> Gate<V> {
    /// Makes a gate for pointers of `vocabulary` with a norm of up to 1.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        Self::in_space(vocabulary.space())
    }

    pub(crate) fn in_space(space: &Space<V>) -> Self {
        Self { space: space.clone(), radius: 1.0, synapse: FEED_FORWARD, inhibition: 1.0 }
    }

    /// Sets the radius: the greatest norm of a pointer that passes unchanged.
    ///
    /// The default is 1. Anything but a finite number above 0 is a fault when the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// Sets the current that closes the gate, as a share of the default: see [`Rules::inhibition`](crate::spa::Rules).
    pub(crate) fn inhibition(mut self, share: Real) -> Self {
        self.inhibition = share;
        self
    }

    /// Replaces the synapse on the output (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl<V: VocabTag> Module for Gate<V> {
    type Ports = GatePorts<Pointer<V>>;

    fn expand(self, scope: &mut Scope<'_>) -> GatePorts<Pointer<V>> {
        let layer = population(&self.space, self.radius).inhibition(self.inhibition);
        let gated: GatePorts<Pointer<V>> = scope.represent_gated("population", layer);
        let output = scope.add("output", Add::pointer(&self.space));
        scope.connect(&gated.output, &output.input, self.synapse);
        GatePorts {
            input: scope.input("input", gated.input),
            open: scope.input("open", gated.open),
            output: scope.output("output", output.output),
        }
    }
}
