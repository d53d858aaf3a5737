//! Memories of factored items: similarities, weighted sums, and retrieval by several conditions at once.

use std::sync::Arc;

use super::FEED_FORWARD;
use super::linear::Linear;
use crate::neurons::{Layers, Select, SelectRule};
use crate::sim::{
    Add, EmitIo, Fingerprint, In, InputSpec, Module, Node, Out, OutputSpec, Pointer, PortDecl,
    Real, Scope, Scratch, ScratchSpec, Space, StepCx, Synapse, Vector, VocabTag,
};
use crate::spa::algebra::LinearMap;
use crate::spa::factored::FactoredItems;
use crate::spa::vocabulary::Vocabulary;

/// The dot products of pointers with all of some [`FactoredItems`], without a tick of delay.
///
/// The same numbers as [`Linear::similarities`] of the items as dense pointers, but for rounding. Costs O(atoms x
/// dimensions + terms of all items) per query and tick; a second query reads the memory together with the first.
pub struct FactoredSimilarity<V: VocabTag> {
    space: Space<V>,
    items: Arc<FactoredItems>,
    queries: usize,
}

/// Ports of a [`FactoredSimilarity`].
pub struct FactoredSimilarityPorts<V: VocabTag> {
    /// Pointers to compare with the items; each takes one connection.
    pub queries: Vec<In<Pointer<V>>>,
    /// For each query, the similarities of the items.
    pub outputs: Vec<Out<Vector>>,
}

impl<V: VocabTag> FactoredSimilarity<V> {
    /// Makes a module that compares as many pointers of `vocabulary` with `items` as `queries` says.
    ///
    /// Items of another number of dimensions are a fault when the graph is built.
    pub fn new(vocabulary: &Vocabulary<V>, items: Arc<FactoredItems>, queries: usize) -> Self {
        Self { space: vocabulary.space().clone(), items, queries }
    }
}

/// Returns the fault of items whose vectors have not the dimensions of `space`.
fn foreign<V: VocabTag>(space: &Space<V>, items: &FactoredItems) -> Option<String> {
    (items.dim() != space.width()).then(|| {
        let (found, expected) = (items.dim(), space.width());
        format!("the items have {found} dimensions; expected {expected}, those of {space}")
    })
}

impl<V: VocabTag> Node for FactoredSimilarity<V> {
    fn declare(&self, ports: &mut PortDecl) {
        if let Some(fault) = foreign(&self.space, &self.items) {
            ports.fault(fault);
        }
        for query in 0..self.queries {
            ports.input(&format!("in{query}"), InputSpec::pointer(&self.space));
            ports.output(&format!("out{query}"), OutputSpec::vector(self.items.len()));
        }
        let reals = 2 * (self.items.padded_atoms() + self.items.len());
        ports.scratch(ScratchSpec { reals, ..ScratchSpec::default() });
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.items.fingerprint(hash);
    }

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        let (scores, both) = io.scratch.reals.split_at_mut(2 * self.items.padded_atoms());
        for first in (0..self.queries).step_by(2) {
            let query = io.inputs.get(first);
            if first + 1 == self.queries {
                let scores = &mut scores[..self.items.padded_atoms()];
                self.items.apply([query, &[]], scores, io.outputs.get_mut(first));
                continue;
            }
            let both = &mut both[..2 * self.items.len()];
            self.items.apply([query, io.inputs.get(first + 1)], scores, both);
            for at in 0..2 {
                let own = both.chunks_exact(2).map(|pair| pair[at]);
                let out = io.outputs.get_mut(first + at);
                out.iter_mut().zip(own).for_each(|(out, own)| *out = own);
            }
        }
    }
}

impl<V: VocabTag> Module for FactoredSimilarity<V> {
    type Ports = FactoredSimilarityPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> FactoredSimilarityPorts<V> {
        let queries = self.queries;
        let node = scope.leaf(self);
        let input = |i: usize, scope: &mut Scope<'_>| {
            scope.input(&format!("queries[{i}]"), node.input(&format!("in{i}")))
        };
        let output = |i: usize, scope: &mut Scope<'_>| {
            scope.output(&format!("outputs[{i}]"), node.output(&format!("out{i}")))
        };
        FactoredSimilarityPorts {
            queries: (0..queries).map(|i| input(i, scope)).collect(),
            outputs: (0..queries).map(|i| output(i, scope)).collect(),
        }
    }
}

impl<V: VocabTag> Linear<Vector, Pointer<V>> {
    /// Makes a node that gives a weighted sum of factored items, pointers of `vocabulary`. The input has one weight per
    /// item.
    ///
    /// An item of weight zero costs nothing. Items of another number of dimensions are a fault when the graph is built.
    /// Costs O(terms of the other items + dimensions x atoms of these terms) per tick.
    pub fn factored_combination(vocabulary: &Vocabulary<V>, items: Arc<FactoredItems>) -> Self {
        let fault = foreign(vocabulary.space(), &items);
        let (input, output) =
            (InputSpec::vector(items.len()), OutputSpec::pointer(vocabulary.space()));
        Self::new(input, output, Box::new(Combination { items })).with_fault(fault)
    }
}

/// The weighted sum of factored items.
struct Combination {
    items: Arc<FactoredItems>,
}

impl LinearMap for Combination {
    fn input_width(&self) -> usize {
        self.items.len()
    }

    fn output_width(&self) -> usize {
        self.items.dim()
    }

    fn scratch(&self) -> ScratchSpec {
        ScratchSpec { reals: self.items.atoms(), ..ScratchSpec::default() }
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("combination");
        self.items.fingerprint(hash);
    }

    fn apply_into(&self, input: &[Real], out: &mut [Real], scratch: &mut Scratch<'_>) {
        self.items.combine(input, &mut scratch.reals[..self.items.atoms()], out);
    }
}

/// Finds the items that meet several conditions at once.
///
/// Each condition is a pointer. Every item has a threshold per condition, which compares the item with the condition's
/// pointer, and a threshold on the sum of these, which is reached if all conditions are met. An item that meets one
/// condition very well and another one not at all is therefore not found, as it would be by its similarity to the sum
/// of the conditions.
///
/// | port | kind | what it is |
/// |---|---|---|
/// | `conditions` | one pointer per condition | what the items are compared with |
/// | `channels` | one vector per condition | 1 for each item that meets the condition |
/// | `items` | vector | 1 for each item that meets all conditions |
///
/// # Delay
/// A tick and a synapse of 5 ms for the conditions, and again for the items. In neurons items near the level are slow to
/// fire. With 25,000 objects in 500 dimensions, conditions in a population of their own and one neuron per item, two thirds
/// of the matches are found after 18 ms, 93% after 24 ms, and all that are found at all after 32 ms (one run).
///
/// # Cost
/// [`Tuning::per_item`](crate::neurons::Tuning::per_item) neurons per item and threshold. With
/// [`Tuning::few_per_item`](crate::neurons::Tuning::few_per_item) one neuron is enough, and a large memory in which
/// few items fire is fast. The similarities cost what [`FactoredSimilarity`] costs.
///
/// ```
/// use std::sync::Arc;
/// use symbolt::prelude::*;
/// use symbolt::spa::{FactoredItems, JointMemory};
///
/// # struct Things;
/// # impl VocabTag for Things { const NAME: &'static str = "things"; }
/// let things = VocabularyBuilder::<Things>::new(64, Seed::new(1)).pointers(["RED", "ROUND", "BIG"]).build()?;
/// let apple = vec![(0, 1.0), (1, 1.0)];
/// let brick = vec![(0, 1.0), (2, 1.0)];
/// let items = Arc::new(FactoredItems::new(things.matrix().to_vec(), 64, [apple, brick])?);
/// let mut graph = GraphBuilder::new();
/// let memory = graph.add("memory", JointMemory::new(&things, items, 2));
/// for (name, port) in ["RED", "ROUND"].into_iter().zip(&memory.conditions) {
///     let given = graph.add(name, Constant::pointer(things.space(), &things.get(name)?));
///     graph.connect(&given, port, Synapse::None);
/// }
/// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(40))?;
/// let found = sim.value(&memory.items);
/// assert!(found[0] > 0.9 && found[1] == 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct JointMemory<V: VocabTag> {
    similarity: FactoredSimilarity<V>,
    cleaned: Option<Real>,
    level: Real,
    synapse: Synapse,
}

/// Ports of a [`JointMemory`].
pub struct JointMemoryPorts<V: VocabTag> {
    /// Pointers that say the conditions; each takes one connection.
    pub conditions: Vec<In<Pointer<V>>>,
    /// For each condition, the activity of the items: 1 for each item that meets it, else 0.
    pub channels: Vec<Out<Vector>>,
    /// Activity of the items: 1 for each item that meets all conditions, else 0.
    pub items: Out<Vector>,
}

impl<V: VocabTag> JointMemory<V> {
    /// Makes a memory of `items`, whose vectors are pointers of `vocabulary`, for as many conditions as `conditions`
    /// says (at least 1).
    ///
    /// Items of another number of dimensions are a fault when the graph is built.
    pub fn new(vocabulary: &Vocabulary<V>, items: Arc<FactoredItems>, conditions: usize) -> Self {
        let similarity = FactoredSimilarity::new(vocabulary, items, conditions);
        Self { similarity, cleaned: None, level: LEVEL, synapse: FEED_FORWARD }
    }

    /// Sets the similarity at which an item meets a condition (default 0.65). A level that is not finite is a fault
    /// when the graph is built.
    pub fn level(mut self, level: Real) -> Self {
        self.level = level;
        self
    }

    /// Compares the conditions with the atoms, and the items with the atoms that reach `level` alone. Each condition then
    /// has a threshold per atom, so the first answers come 6 ms later. The last ones come sooner, because no item is near
    /// the level: in the example above all are found after 24 ms.
    ///
    /// This is no longer the similarity of item and condition: atoms that resemble the condition by chance are left out,
    /// so there is no crosstalk while each atom of a condition can be told from all others. Fewer items change at a time,
    /// too, so it costs less. Conditions must be atoms or sums of a few atoms.
    pub fn cleaned(mut self, level: Real) -> Self {
        self.cleaned = Some(level);
        self
    }

    /// Replaces the synapse on the outputs of all thresholds (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

/// Default similarity at which an item meets a condition. It is nearer to 1 than to 0, because most items should not
/// be found.
const LEVEL: Real = 0.65;
/// By how much the sum of the channels, which fluctuate in spikes, may fall short of the number of conditions.
const SLACK: Real = 0.6;

impl<V: VocabTag> Module for JointMemory<V> {
    type Ports = JointMemoryPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> JointMemoryPorts<V> {
        let (items, conditions) = (self.similarity.items.clone(), self.similarity.queries);
        let count = items.len();
        let threshold = |count, level| Select::new(count, SelectRule::Threshold { level });
        let similarity = match self.cleaned {
            None => self.similarity,
            Some(_) => FactoredSimilarity { items: Arc::new(items.alone()), ..self.similarity },
        };
        let similarity = scope.add("similarity", similarity);
        let joint = scope.select("joint", threshold(count, conditions as Real - SLACK));
        let found = scope.add("items", Add::vector(count));
        scope.connect(&joint.output, &found.input, self.synapse);
        let mut channels = Vec::with_capacity(conditions);
        for (index, similarities) in similarity.outputs.iter().enumerate() {
            let condition =
                scope.select(&format!("condition{index}"), threshold(count, self.level));
            let channel = scope.add(&format!("channel{index}"), Add::vector(count));
            if let Some(level) = self.cleaned {
                let atoms = scope.select(&format!("atoms{index}"), threshold(items.atoms(), level));
                let weights = (0..count).flat_map(|item| {
                    items
                        .terms(item)
                        .iter()
                        .map(move |(atom, weight)| (*atom as usize, item, *weight))
                });
                let spread = Linear::sparse(items.atoms(), count, weights);
                let spread = scope.add(&format!("spread{index}"), spread);
                scope.connect(similarities, &atoms.input, Synapse::None);
                scope.connect(&atoms.output, &spread.input, self.synapse);
                scope.connect(&spread.output, &condition.input, Synapse::None);
            } else {
                scope.connect(similarities, &condition.input, Synapse::None);
            }
            scope.connect(&condition.output, &channel.input, self.synapse);
            scope.connect(&channel.output, &joint.input, Synapse::None);
            channels.push(scope.output(&format!("channels[{index}]"), channel.output));
        }
        let inputs = similarity.queries.into_iter().enumerate();
        JointMemoryPorts {
            conditions: inputs
                .map(|(index, input)| scope.input(&format!("conditions[{index}]"), input))
                .collect(),
            channels,
            items: scope.output("items", found.output),
        }
    }
}
