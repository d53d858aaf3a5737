//! A resonator network as a module: populations that hold estimates of all factors of a bound pointer.

use super::{Linear, State};
use crate::neurons::{Layers, Map};
use crate::sim::{
    AsPointer, Constant, In, Module, Noise, Out, Pointer, Real, Scope, Synapse, Vector, VocabTag,
};
use crate::spa::algebra::{cosine, normalize};
use crate::spa::error::VocabError;
use crate::spa::flow::{Flow, IntoFlow, Routes};
use crate::spa::pointer::PointerValue;
use crate::spa::vocabulary::Vocabulary;

/// Factor by which an estimate exceeds the range of its population, which scales it back to norm 1.
const GAIN: Real = 10.0;
/// Norm of the constant input that keeps the estimates from staying zero, before the gain.
const KICK: Real = 0.02;
/// Norm of the noise with which the estimates leave wrong combinations, before the gain. From 0.3 on they leave the right
/// one, too.
const NOISE: Real = 0.1;

/// Factors a bound pointer: a population for each factor holds an estimate, and the others are unbound by it.
///
/// Each estimate is the sum of the items of its codebook, weighted by their similarity with the input from which all other
/// estimates are unbound, and limited to norm 1 (Frady, Kent, Olshausen and Sommer 2020; see
/// [`Resonator`](crate::spa::Resonator), which does the same without a graph and checks the result). Use it with a
/// vocabulary of unitary pointers: only these are unbound exactly.
///
/// F factors take F (F - 1) bindings and F populations; one round through them takes F + 1 synapses of 5 ms. Keep the
/// input constant until the estimates have settled. The network does not notice when it is stuck and does not start
/// again: in direct mode it found 17 of 20 combinations of three factors of 50 in 1,024 dimensions within 1.5 s, where
/// `Resonator` finds all.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::spa::ResonatorNetwork;
///
/// struct Things;
/// impl VocabTag for Things { const NAME: &'static str = "things"; }
/// let books = [["RED", "BLUE", "GREEN"], ["CIRCLE", "SQUARE", "STAR"]];
/// let mut things = VocabularyBuilder::<Things>::new(128, Seed::new(1));
/// for name in books.concat() {
///     things = things.unitary(name);
/// }
/// let things = things.build()?;
/// let mut graph = GraphBuilder::new();
/// let seen = graph.add("seen", things.stimulus([(0, "BLUE * STAR")])?);
/// let factors = graph.add("factors", ResonatorNetwork::new(&things, books)?);
/// graph.route(&seen >> &factors.input);
/// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(300))?;
/// assert!(cosine(&sim.value(&factors.outputs[0]), &things.get("BLUE")?) > 0.9);
/// assert!(cosine(&sim.value(&factors.outputs[1]), &things.get("STAR")?) > 0.9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ResonatorNetwork<V: VocabTag> {
    vocabulary: Vocabulary<V>,
    books: Vec<Vec<PointerValue<V>>>,
}

/// Ports of a [`ResonatorNetwork`].
pub struct ResonatorNetworkPorts<V: VocabTag> {
    /// Pointer to factor; adds any number of connections.
    pub input: In<Pointer<V>>,
    /// Estimate of each factor: about the item itself once the network has settled.
    pub outputs: Vec<Out<Pointer<V>>>,
    /// Scalar products of each factor's estimate with the items of its codebook.
    pub items: Vec<Out<Vector>>,
}

impl<V: VocabTag> ResonatorNetwork<V> {
    /// Makes a network with one codebook of names for each factor.
    ///
    /// # Errors
    /// [`VocabError::Unknown`] if the vocabulary does not have a name; [`VocabError::BadVector`] if there are fewer than two
    /// codebooks, or one of them is empty.
    pub fn new<'n, B: IntoIterator<Item = &'n str>>(
        vocabulary: &Vocabulary<V>,
        books: impl IntoIterator<Item = B>,
    ) -> Result<Self, VocabError> {
        let book = |names: B| names.into_iter().map(|name| vocabulary.parse(name)).collect();
        let books: Vec<Vec<_>> = books.into_iter().map(book).collect::<Result<_, _>>()?;
        let refused = |reason: String| VocabError::BadVector { name: "codebooks".into(), reason };
        if books.len() < 2 {
            return Err(refused(format!(
                "there are {} codebooks; expected at least 2",
                books.len()
            )));
        }
        if let Some(empty) = books.iter().position(Vec::is_empty) {
            return Err(refused(format!("codebook {empty} has no names; expected at least one")));
        }
        let (a, b) = (&books[0][0], &books[1][0]);
        let exchanged = [vocabulary.value(a * b)?, vocabulary.value(b * a)?];
        if cosine(&exchanged[0], &exchanged[1]) < 0.999 {
            let algebra = vocabulary.algebra().name();
            return Err(refused(format!(
                "the binding of {algebra} does not commute; use a vocabulary of an algebra whose binding does, such as HRR"
            )));
        }
        Ok(Self { vocabulary: vocabulary.clone(), books })
    }
}

impl<V: VocabTag> Module for ResonatorNetwork<V> {
    type Ports = ResonatorNetworkPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> ResonatorNetworkPorts<V> {
        let space = self.vocabulary.space();
        let input = scope.add("input", crate::sim::Add::pointer(space));
        let states: Vec<_> = (0..self.books.len())
            .map(|factor| scope.add(&format!("factor-{factor}"), State::new(&self.vocabulary)))
            .collect();
        let mut items = Vec::new();
        for (factor, book) in self.books.iter().enumerate() {
            let keys = || book.iter().map(PointerValue::as_pointer);
            let others = states.iter().enumerate().filter(|(other, _)| *other != factor);
            let start: Flow<Pointer<V>> = (&input).into_flow();
            let unbound = others.fold(start, |rest, (_, other)| rest * !other);
            let similarity = Linear::similarities(space, keys());
            let similarity = scope.add(&format!("similarity-{factor}"), similarity);
            let recall = Linear::combination(space, keys());
            let recall = scope.add(&format!("recall-{factor}"), recall);
            scope.route((unbound >> &similarity).named(&format!("unbind-{factor}")));
            // Weights of at least 0: two factors with changed signs have the same binding.
            let weights = Map::each(book.len(), |similarity| similarity.max(0.0)).above(0.0);
            let weights = scope.map(&format!("weights-{factor}"), weights);
            scope.route(&similarity >> &weights.input);
            scope.route(&weights.output >> &recall);
            let noise = Noise::pointer(space, GAIN * NOISE);
            let noise = scope.add(&format!("noise-{factor}"), noise);
            scope.route((GAIN * &recall >> &noise).named(&format!("gain-{factor}")));
            scope.route(&noise >> &states[factor]);
            let mut kick = vec![0.0; space.width()];
            for item in book {
                kick.iter_mut().zip(&**item).for_each(|(sum, value)| *sum += value);
            }
            normalize(&mut kick);
            kick.iter_mut().for_each(|value| *value *= GAIN * KICK);
            let kick = Constant::of(crate::sim::OutputSpec::pointer(space), &kick);
            let kick = scope.add(&format!("kick-{factor}"), kick);
            scope.connect(&kick, &states[factor].input, Synapse::None);
            let found = Linear::similarities(space, keys());
            let found = scope.add(&format!("items-{factor}"), found);
            scope.route((&states[factor] >> &found).named(&format!("found-{factor}")));
            items.push(scope.output(&format!("items-{factor}"), found.output));
        }
        let outputs = states.into_iter().enumerate();
        ResonatorNetworkPorts {
            input: scope.input("input", input.input),
            outputs: outputs
                .map(|(factor, state)| scope.output(&format!("output-{factor}"), state.output))
                .collect(),
            items,
        }
    }
}
