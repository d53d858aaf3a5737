//! Standard networks of a single module, and the channel of two arrays.

use rand::RngExt;

use super::{Plain, Reading, Standard, Watched};
use crate::neurons::{Layers, Map};
use crate::sim::{
    Constant, GraphBuilder, Module, PointerRef, Ports, ProbeSpec, Real, Scope, Seed, SimDuration,
    Stimulus, Synapse, Vector,
};
use crate::spa::{
    BasalGanglia, Bind, CleanupMemory, FEED_FORWARD, RECURRENT, State, VocabError,
    VocabularyBuilder, random_pointer,
};

type Described = (Watched, Reading);

const CHANNELS: usize = 500;
const ITEMS: usize = 1_000;
const ACTIONS: usize = 10;
const CHOSEN: usize = 3;

fn pointer(seed: Seed, name: &str, dim: usize) -> Vec<Real> {
    random_pointer(dim, seed.derive(name, "input"))
}

/// Adds a binding of two constant pointers.
pub(super) fn bind(
    of: &Standard,
    graph: &mut GraphBuilder,
    probed: ProbeSpec,
) -> Result<Described, VocabError> {
    let (dim, seed) = (of.dimensions, of.seed);
    let vocabulary = VocabularyBuilder::<Plain>::new(dim, seed).build()?;
    let (a, b) = (pointer(seed, "a", dim), pointer(seed, "b", dim));
    let bind = graph.add("bind", Bind::new(&vocabulary).synapse(FEED_FORWARD));
    for (name, value, port) in [("a", &a, &bind.a), ("b", &b, &bind.b)] {
        let given =
            graph.add(name, Constant::pointer(vocabulary.space(), &PointerRef::from_raw(value)));
        graph.connect(&given, port, Synapse::None);
    }
    let mut exact = vec![0.0; dim];
    let algebra = vocabulary.algebra();
    algebra.bind_into(&a, &b, &mut exact, &mut algebra.scratch(dim));
    Ok((Watched::Pointer(graph.probe(&bind.output, probed)), Reading::Cosine(exact)))
}

/// Adds a memory whose recurrent connection holds a pointer that is shown for 100 ms.
pub(super) fn state(
    of: &Standard,
    graph: &mut GraphBuilder,
    probed: ProbeSpec,
) -> Result<Described, VocabError> {
    let (dim, seed) = (of.dimensions, of.seed);
    let vocabulary = VocabularyBuilder::<Plain>::new(dim, seed).build()?;
    let given = pointer(seed, "a", dim);
    let input = Stimulus::pointer(vocabulary.space(), &PointerRef::from_raw(&given))
        .silent_from(SimDuration::from_millis(100));
    let input = graph.add("input", input);
    let state = graph.add("state", State::new(&vocabulary).recurrent(RECURRENT));
    graph.connect(&input, &state.input, Synapse::None);
    Ok((Watched::Pointer(graph.probe(&state.output, probed)), Reading::Cosine(given)))
}

/// Adds a cleanup memory of a thousand items. Its input is a mixture of two items.
pub(super) fn memory(
    of: &Standard,
    graph: &mut GraphBuilder,
    probed: ProbeSpec,
) -> Result<Described, VocabError> {
    let names: Vec<String> = (0..ITEMS).map(|i| format!("V{i}")).collect();
    let vocabulary = VocabularyBuilder::<Plain>::new(of.dimensions, of.seed)
        .max_similarity(1.0)
        .pointers(names.iter().map(String::as_str))
        .build()?;
    let mixed = vocabulary.parse("0.8 * V0 + 0.3 * V1")?;
    let names = names.iter().map(String::as_str);
    let memory = graph.add("memory", CleanupMemory::new(&vocabulary, names, of.choice)?);
    let input = graph.add("input", Constant::pointer(vocabulary.space(), &mixed));
    graph.connect(&input, &memory.input, Synapse::None);
    let right = vocabulary.get("V0")?.to_vec();
    Ok((Watched::Pointer(graph.probe(&memory.output, probed)), Reading::Cosine(right)))
}

/// Adds basal ganglia that choose one of ten actions. The thalamus is probed.
pub(super) fn select(graph: &mut GraphBuilder, probed: ProbeSpec) -> Described {
    let mut utilities = vec![0.3; ACTIONS];
    utilities[CHOSEN] = 0.8;
    let input = graph.add("input", Constant::vector(&utilities));
    let select = graph.add("select", BasalGanglia::new(ACTIONS));
    graph.connect(&input, &select.utilities, Synapse::None);
    (Watched::Vector(graph.probe(&select.thalamus, probed)), Reading::Choice(CHOSEN))
}

/// A module that passes a vector through one ensemble for each component.
struct Array {
    width: usize,
}

impl Module for Array {
    type Ports = Ports<Vector>;

    fn expand(self, scope: &mut Scope<'_>) -> Ports<Vector> {
        scope.map("population", Map::each(self.width, |x| x))
    }
}

/// Adds two arrays of scalar ensembles in series.
pub(super) fn channel(of: &Standard, graph: &mut GraphBuilder, probed: ProbeSpec) -> Described {
    let mut rng = of.seed.derive("channel", "input").rng();
    let given: Vec<Real> = (0..CHANNELS).map(|_| 2.0 * rng.random::<Real>() - 1.0).collect();
    let input = graph.add("input", Constant::vector(&given));
    let first = graph.add("first", Array { width: CHANNELS });
    let second = graph.add("second", Array { width: CHANNELS });
    graph.connect(&input, &first.input, Synapse::None);
    graph.connect(&first.output, &second.input, FEED_FORWARD);
    (Watched::Vector(graph.probe(&second.output, probed)), Reading::Distance(given))
}
