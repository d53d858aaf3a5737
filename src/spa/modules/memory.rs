//! Cleanup and associative memory: similarity to keys, a choice among them, the values of the chosen.

use super::FEED_FORWARD;
use super::linear::Linear;
use crate::neurons::{Layers, Select, SelectPorts, SelectRule};
use crate::sim::{
    Add, AsPointer, In, Module, Out, Pointer, Scope, Space, Synapse, Vector, VocabTag,
};
use crate::spa::error::VocabError;
use crate::spa::pointer::PointerValue;
use crate::spa::vocabulary::Vocabulary;

/// Ports of a memory with keys of `A` and values of `B`.
pub struct MemoryPorts<A: VocabTag, B: VocabTag> {
    /// What the keys are compared with; one source.
    pub input: In<Pointer<A>>,
    /// An inhibition of 1 keeps an item from being chosen; may stay unfed. One number an item.
    pub inhibit: In<Vector>,
    /// The sum of the values of the chosen items.
    pub output: Out<Pointer<B>>,
    /// How active each item is: 1 when chosen. One number an item.
    pub items: Out<Vector>,
}

/// Maps a pointer that is similar to a stored key to the value stored with that key.
///
/// The similarity (dot product) of the input to every key feeds a selection, and each chosen item's value
/// is added to the output, one synapse (5 ms) later. With the threshold rule several items can be chosen
/// at once, so a superposition of keys gives the superposition of their values; with winner-take-all
/// only the most similar. Below the level nothing is chosen and the output is zero: a miss.
pub struct AssociativeMemory<A: VocabTag, B: VocabTag> {
    keys: Space<A>,
    values: Space<B>,
    pairs: Vec<(PointerValue<A>, PointerValue<B>)>,
    rule: SelectRule,
    synapse: Synapse,
}

impl<A: VocabTag, B: VocabTag> AssociativeMemory<A, B> {
    /// A memory of pairs of expressions: a key over `keys` and a value over `values`.
    ///
    /// # Errors
    /// If an expression cannot be read or names something that its vocabulary does not have, or if
    /// there is no pair at all.
    pub fn new<'p>(
        keys: &Vocabulary<A>,
        values: &Vocabulary<B>,
        pairs: impl IntoIterator<Item = (&'p str, &'p str)>,
        rule: SelectRule,
    ) -> Result<Self, VocabError> {
        let pairs: Vec<_> = pairs
            .into_iter()
            .map(|(key, value)| Ok((keys.parse(key)?, values.parse(value)?)))
            .collect::<Result<_, VocabError>>()?;
        if pairs.is_empty() {
            let reason = "a memory needs at least one item".into();
            return Err(VocabError::BadVector { name: "memory".into(), reason });
        }
        Ok(Self {
            keys: keys.space().clone(),
            values: values.space().clone(),
            pairs,
            rule,
            synapse: FEED_FORWARD,
        })
    }

    /// Replaces the synapse behind the selection.
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl<A: VocabTag, B: VocabTag> Module for AssociativeMemory<A, B> {
    type Ports = MemoryPorts<A, B>;

    fn expand(self, scope: &mut Scope<'_>) -> MemoryPorts<A, B> {
        let items = self.pairs.len();
        let keys = self.pairs.iter().map(|(key, _)| key.as_pointer());
        let similarity = scope.add("similarity", Linear::similarities(&self.keys, keys));
        let select: SelectPorts = scope.select("select", Select::new(items, self.rule));
        let active = scope.add("items", Add::vector(items));
        let values = self.pairs.iter().map(|(_, value)| value.as_pointer());
        let recall = scope.add("recall", Linear::combination(&self.values, values));
        scope.connect(&similarity.output, &select.input, Synapse::None);
        scope.connect(&select.output, &active.input, self.synapse);
        scope.connect(&active.output, &recall.input, Synapse::None);
        MemoryPorts {
            input: scope.input("input", similarity.input),
            inhibit: scope.input("inhibit", select.inhibit),
            output: scope.output("output", recall.output),
            items: scope.output("items", active.output),
        }
    }
}

/// Replaces a noisy or superposed pointer by the stored pointers that it is similar to.
///
/// An associative memory whose values are its keys.
pub struct CleanupMemory<V: VocabTag> {
    memory: AssociativeMemory<V, V>,
}

impl<V: VocabTag> CleanupMemory<V> {
    /// A cleanup over the named pointers of `vocabulary`.
    ///
    /// # Errors
    /// If a name is unknown, or none is given.
    pub fn new<'n>(
        vocabulary: &Vocabulary<V>,
        names: impl IntoIterator<Item = &'n str>,
        rule: SelectRule,
    ) -> Result<Self, VocabError> {
        let mut pairs = Vec::new();
        for name in names {
            vocabulary.position(name)?;
            pairs.push((name, name));
        }
        Ok(Self { memory: AssociativeMemory::new(vocabulary, vocabulary, pairs, rule)? })
    }

    /// Replaces the synapse behind the selection.
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.memory = self.memory.synapse(synapse);
        self
    }
}

impl<V: VocabTag> Module for CleanupMemory<V> {
    type Ports = MemoryPorts<V, V>;

    fn expand(self, scope: &mut Scope<'_>) -> MemoryPorts<V, V> {
        self.memory.expand(scope)
    }
}
