//! Cleanup and associative memory: compares a pointer with keys, chooses among the keys, and recalls the values stored
//! with them.

use super::FEED_FORWARD;
use super::linear::Linear;
use super::maps::Rows;
use crate::neurons::{Layers, Select, SelectPorts, SelectRule};
use crate::sim::{
    Add, AsPointer, Constant, In, InputSpec, Module, Out, OutputSpec, Pointer, PointerRef, Real,
    Scope, Space, Synapse, Vector, VocabTag,
};
use crate::spa::error::VocabError;
use crate::spa::vocabulary::Vocabulary;

/// Ports of a memory with keys of vocabulary `A` and values of vocabulary `B`.
pub struct MemoryPorts<A: VocabTag, B: VocabTag> {
    /// Pointer to compare with the keys; takes one connection.
    pub input: In<Pointer<A>>,
    /// Inhibition, one number per item: 1 keeps the item from being chosen. Adds any number of connections, or none.
    pub inhibit: In<Vector>,
    /// Sum of the values of the chosen items.
    pub output: Out<Pointer<B>>,
    /// Activity, one number per item: 1 if chosen, else 0.
    pub items: Out<Vector>,
}

/// An associative memory: maps a pointer to the values stored with similar keys.
///
/// The memory computes the similarity (dot product) of the input to every key. A [`SelectRule`] chooses items by
/// similarity. The output is the sum of the values of the chosen items, one synapse (5 ms) later.
///
/// [`SelectRule::Threshold`] can choose several items: a superposition of keys then gives the superposition of their
/// values; [`SelectRule::Graded`] weighs each by its similarity. [`SelectRule::WinnerTakeAll`] chooses only the most
/// similar key. If all similarities are below the level, the memory chooses nothing and the output is zero (a miss), or
/// the pointer of [`otherwise`](Self::otherwise).
///
/// Comparing and recalling cost O(items x dimensions) per tick. Exact, rate and spiking answers differ by at most 0.1 to
/// 0.15, by the rule (`docs/agreement.md`).
pub struct AssociativeMemory<A: VocabTag, B: VocabTag> {
    keys: Space<A>,
    values: Space<B>,
    pairs: Vec<[Vec<Real>; 2]>,
    rule: SelectRule,
    synapse: Synapse,
    otherwise: Option<Vec<Real>>,
}

type Parse<'v> = &'v dyn Fn(&str) -> Result<Vec<Real>, VocabError>;

fn parsed(
    pairs: Vec<(&str, &str)>,
    parse_key: Parse<'_>,
    parse_value: Parse<'_>,
) -> Result<Vec<[Vec<Real>; 2]>, VocabError> {
    if pairs.is_empty() {
        let reason = "the memory has no items; expected at least one".into();
        return Err(VocabError::BadVector { name: "memory".into(), reason });
    }
    pairs.into_iter().map(|(key, value)| Ok([parse_key(key)?, parse_value(value)?])).collect()
}

impl<A: VocabTag, B: VocabTag> AssociativeMemory<A, B> {
    /// Makes a memory of pairs of expressions: a key over `keys` and a value over `values`.
    ///
    /// # Errors
    /// As for [`Vocabulary::parse`] if an expression is invalid or a name unknown; [`VocabError::BadVector`] if there
    /// are no pairs.
    pub fn new<'p>(
        keys: &Vocabulary<A>,
        values: &Vocabulary<B>,
        pairs: impl IntoIterator<Item = (&'p str, &'p str)>,
        rule: SelectRule,
    ) -> Result<Self, VocabError> {
        let key = |text: &str| Ok(keys.parse(text)?.into_values());
        let value = |text: &str| Ok(values.parse(text)?.into_values());
        let pairs = parsed(pairs.into_iter().collect(), &key, &value)?;
        let (keys, values) = (keys.space().clone(), values.space().clone());
        Ok(Self { keys, values, pairs, rule, synapse: FEED_FORWARD, otherwise: None })
    }

    /// Sets the default output: the pointer that is recalled while no item is chosen, another synapse (5 ms) later.
    ///
    /// ```
    /// use symbolt::neurons::SelectRule;
    /// use symbolt::prelude::*;
    ///
    /// symbolt::vocabulary!(Words = "words": RED, BLUE, UNKNOWN);
    /// let words = Words::vocabulary(64, Seed::new(1))?;
    /// let rule = SelectRule::WinnerTakeAll { level: 0.5 };
    /// let memory = CleanupMemory::new(&words, ["RED", "BLUE"], rule)?.otherwise(words.get("UNKNOWN")?);
    /// let mut graph = GraphBuilder::new();
    /// let memory = graph.add("memory", memory);
    /// graph.route(0.1 * Words::RED >> &memory);
    /// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(100))?;
    /// assert!(cosine(&sim.value(&memory.output), &words.get("UNKNOWN")?) > 0.99);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn otherwise(mut self, value: impl AsPointer<B>) -> Self {
        self.otherwise = Some(value.as_pointer().to_vec());
        self
    }

    /// Replaces the synapse on the output of the selection (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.synapse = synapse;
        self
    }
}

impl<A: VocabTag, B: VocabTag> Module for AssociativeMemory<A, B> {
    type Ports = MemoryPorts<A, B>;

    fn expand(self, scope: &mut Scope<'_>) -> MemoryPorts<A, B> {
        let items = self.pairs.len();
        let keys = self.pairs.iter().map(|[key, _]| PointerRef::from_raw(key));
        let similarity = scope.add("similarity", Linear::similarities(&self.keys, keys));
        let select: SelectPorts = scope.select("select", Select::new(items, self.rule));
        let active = scope.add("items", Add::vector(items));
        let values = self.pairs.iter().map(|[_, value]| PointerRef::from_raw(value));
        let recall = scope.add("recall", Linear::combination(&self.values, values));
        scope.connect(&similarity.output, &select.input, Synapse::None);
        scope.connect(&select.output, &active.input, self.synapse);
        scope.connect(&active.output, &recall.input, Synapse::None);
        let output = match &self.otherwise {
            None => recall.output,
            Some(value) => {
                // Active at 1 less the activity of all items; a graded activity is at least the level.
                let graded = matches!(self.rule, SelectRule::Graded { level } if level > 0.0);
                let weight = if graded { self.rule.level().recip() } else { 1.0 };
                let map = Box::new(Rows::one(vec![-weight; items]));
                let (from, to) = (InputSpec::vector(items), OutputSpec::vector(1));
                let chosen = scope.add("chosen", Linear::new(from, to, map));
                let one = scope.add("one", Constant::vector(&[1.0]));
                let rule = SelectRule::Threshold { level: 0.5 };
                let none: SelectPorts = scope.select("otherwise", Select::new(1, rule));
                let value = [PointerRef::from_raw(value)];
                let value = scope.add("default", Linear::combination(&self.values, value));
                let output = scope.add("output", Add::pointer(&self.values));
                scope.connect(&active.output, &chosen.input, Synapse::None);
                scope.connect(&chosen.output, &none.input, Synapse::None);
                scope.connect(&one, &none.input, Synapse::None);
                scope.connect(&none.output, &value.input, self.synapse);
                scope.connect(&value.output, &output.input, Synapse::None);
                scope.connect(&recall.output, &output.input, Synapse::None);
                output.output
            }
        };
        MemoryPorts {
            input: scope.input("input", similarity.input),
            inhibit: scope.input("inhibit", select.inhibit),
            output: scope.output("output", output),
            items: scope.output("items", active.output),
        }
    }
}

/// A cleanup memory: replaces a noisy or superposed pointer by the stored pointers that are similar to it.
///
/// It is an [`AssociativeMemory`] whose values are its keys.
pub struct CleanupMemory<V: VocabTag> {
    memory: AssociativeMemory<V, V>,
}

impl<V: VocabTag> CleanupMemory<V> {
    /// Makes a cleanup memory of the named pointers of `vocabulary`.
    ///
    /// # Errors
    /// [`VocabError::Unknown`] if the vocabulary does not have a name; [`VocabError::BadVector`] if `names` is empty.
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

    /// Sets the pointer that is recalled while no item is chosen: see [`AssociativeMemory::otherwise`].
    pub fn otherwise(mut self, value: impl AsPointer<V>) -> Self {
        self.memory = self.memory.otherwise(value);
        self
    }

    /// Replaces the synapse on the output of the selection (default 5 ms).
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
