//! Gates: pass a value while a scalar is 1, scale it while the scalar is less, and are silent while it is 0.

use super::FEED_FORWARD;
use crate::neurons::{GatePorts, Layers, Represent};
use crate::sim::{Add, Module, Pointer, Real, Scalar, Scope, Space, Synapse, Vector, VocabTag};
use crate::spa::flow::FlowKind;
use crate::spa::vocabulary::Vocabulary;

/// A gate: lets a pointer pass while it is open, one synapse (5 ms) later. Its input adds any number of connections.
///
/// `open` is a gain, in every mode: the output is `open` times the pointer. Below 0.1 the gate is closed and its neurons
/// are silent; a sum above 1 counts as 1. Exact, rate and spiking answers to random pointers differ by at most 0.15 (`docs/agreement.md`).
/// [`ValueGate`] is a gate for numbers and vectors.
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
pub type Gate<V> = ValueGate<Pointer<V>>;

impl<V: VocabTag> ValueGate<Pointer<V>> {
    /// Makes a gate for pointers of `vocabulary` with a norm of up to 1.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        Self::in_space(vocabulary.space())
    }

    pub(crate) fn in_space(space: &Space<V>) -> Self {
        Self::of(space.clone())
    }

    /// Sets the current that closes the gate, as a share of the default: see [`Rules::inhibition`](crate::spa::Rules).
    pub(crate) fn inhibition(mut self, share: Real) -> Self {
        self.inhibition = share;
        self
    }
}

/// A [`Gate`] for a number or a vector: the output is `open` times the input, one synapse (5 ms) later, and silent while
/// `open` is below 0.1. Its input adds any number of connections.
pub struct ValueGate<K: FlowKind> {
    shape: K::Shape,
    radius: Real,
    synapse: Synapse,
    inhibition: Real,
    split: bool,
}

impl ValueGate<Scalar> {
    /// Makes a gate for a number between -1 and 1.
    pub fn scalar() -> Self {
        Self::of(())
    }
}

impl ValueGate<Vector> {}

impl<K: FlowKind> ValueGate<K> {
    pub(super) fn of(shape: K::Shape) -> Self {
        Self { shape, radius: 1.0, synapse: FEED_FORWARD, inhibition: 1.0, split: false }
    }

    /// Sets the greatest magnitude of a component, or of a pointer the greatest norm, that passes unchanged (default 1).
    /// Anything but a finite number above 0 is a fault when the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// Replaces the synapse on the output (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }

    /// Gives each component an ensemble of its own: see [`Represent::split`].
    pub(super) fn split(mut self) -> Self {
        self.split = true;
        self
    }
}

impl<K: FlowKind> Module for ValueGate<K> {
    type Ports = GatePorts<K>;

    fn expand(self, scope: &mut Scope<'_>) -> GatePorts<K> {
        let (input, output) = K::specs(&self.shape);
        let add = Add::of(input.clone(), output.clone());
        let layer = Represent::new::<K>(input, output, self.radius).inhibition(self.inhibition);
        let layer = if self.split { layer.split() } else { layer };
        let gated: GatePorts<K> = scope.represent_gated("population", layer);
        let output = scope.add("output", add);
        scope.connect(&gated.output, &output.input, self.synapse);
        GatePorts {
            input: scope.input("input", gated.input),
            open: scope.input("open", gated.open),
            output: scope.output("output", output.output),
        }
    }
}
