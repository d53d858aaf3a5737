//! A gate: a pointer passes while a scalar is 1 and is silenced while it is 0.

use super::{FEED_FORWARD, population};
use crate::neurons::{GatedPorts, Layers};
use crate::sim::{Add, In, Module, Out, Pointer, Real, Scalar, Scope, Space, Synapse, VocabTag};
use crate::spa::vocabulary::Vocabulary;

/// Lets a pointer pass while its gate is open, one synapse (5 ms) later.
///
/// As everywhere, a pointer of one vocabulary goes where one of that vocabulary is wanted,
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
/// and where one of another is wanted, the program does not compile:
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
}

/// Ports of a [`Gate`].
pub struct GatePorts<V: VocabTag> {
    /// What may pass; any number of sources.
    pub input: In<Pointer<V>>,
    /// 1 to open, 0 to close; values between scale.
    pub open: In<Scalar>,
    /// What has passed.
    pub output: Out<Pointer<V>>,
}

impl<V: VocabTag> Gate<V> {
    /// A gate for pointers of `vocabulary` of norm up to 1.
    pub fn new(vocabulary: &Vocabulary<V>) -> Self {
        Self::in_space(vocabulary.space())
    }

    pub(crate) fn in_space(space: &Space<V>) -> Self {
        Self { space: space.clone(), radius: 1.0, synapse: FEED_FORWARD }
    }

    /// Represents pointers of norm up to `radius`.
    pub fn radius(mut self, radius: Real) -> Self {
        self.radius = radius;
        self
    }

    /// Replaces the synapse behind the gate's population.
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl<V: VocabTag> Module for Gate<V> {
    type Ports = GatePorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> GatePorts<V> {
        let layer = population(&self.space, self.radius);
        let gated: GatedPorts<Pointer<V>> = scope.represent_gated("population", layer);
        let output = scope.add("output", Add::pointer(&self.space));
        scope.connect(&gated.output, &output.input, self.synapse);
        GatePorts {
            input: scope.input("input", gated.input),
            open: scope.input("open", gated.open),
            output: scope.output("output", output.output),
        }
    }
}
