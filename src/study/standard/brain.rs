//! The largest standard network: a memory for a list, with the number of neurons of the largest functional brain model
//! (Eliasmith et al., "A large-scale model of the functioning brain", 2012: 2.5 million).
//!
//! Nine areas work side by side. Each sees a mixture of two items, cleans it up among a thousand, lets it through a gate,
//! and binds it to its place in the list. Two traces hold the sums of the bound pairs, five and four. Then one place is
//! asked for: each trace is unbound by it, and what results is cleaned up. Basal ganglia open the gates, first for the
//! list and then for the question.

use super::planners::{Rule, Slot, gated_slot, turn};
use super::{Plain, Reading, Standard, Watched};
use crate::neurons::SelectRule;
use crate::sim::{
    Constant, GraphBuilder, Out, Pointer, ProbeSpec, Real, SimDuration, Stimulus, Synapse,
};
use crate::spa::{
    BasalGanglia, Bind, CleanupMemory, FEED_FORWARD, Superpose, Unbind, VocabError,
    VocabularyBuilder,
};

/// Number of areas, and of places in the list.
const AREAS: usize = 9;
/// Places in the first trace. The second holds the others.
const FIRST: usize = 5;
/// Number of items among which is cleaned up.
const ITEMS: usize = 1_000;
/// The place that is asked for, counted from 0.
const ASKED: usize = 6;
/// Simulated time for which the list is taken up. Then the question is asked.
const LIST_MS: u64 = 160;
/// Similarity above which an item counts as seen.
const SEEN: SelectRule = SelectRule::WinnerTakeAll { level: 0.5 };
/// Similarity above which an item counts as recalled. In a sum of four pairs of unit length an item has the similarity
/// 0.5, and the nearest of a thousand others about 0.2.
const RECALLED: SelectRule = SelectRule::WinnerTakeAll { level: 0.25 };

/// The gate of the only memories. What the others let through is gone when they close.
const HELD: &str = "trace";
/// Weight of a pair in a trace. The sum is then about twice as long as a trace can hold, so that the trace is filled
/// within the time for the list.
const WEIGHT: Real = 0.9;

/// Weight with which a chosen rule opens a gate. It is above 1, so that a gate is wide open although the choice
/// fluctuates around 1.
const OPEN: Real = 1.3;

/// The gates that each rule opens.
const RULES: [Rule; 2] =
    [("take_up", &["item", "place", "pair", "trace"]), ("ask", &["question", "answer"])];

/// Adds the network. The answer is probed.
pub(super) fn list_memory(
    of: &Standard,
    graph: &mut GraphBuilder,
    probed: ProbeSpec,
) -> Result<(Watched, Reading), VocabError> {
    let none = Synapse::None;
    let names: Vec<String> = (0..ITEMS).map(|i| format!("ITEM_{i}")).collect();
    let items = || names.iter().map(String::as_str);
    let places: Vec<String> = (0..AREAS).map(|i| format!("PLACE_{i}")).collect();
    let known = VocabularyBuilder::<Plain>::new(of.dimensions, of.seed)
        .max_similarity(1.0)
        .pointers(items().chain(places.iter().map(String::as_str)))
        .build()?;
    let space = known.space();

    let turn = |rule| turn(rule, RULES.len());
    let turns = Stimulus::vector(&turn(0)).from(SimDuration::from_millis(LIST_MS), &turn(1));
    let turns = graph.add("turns", turns);
    let selection = graph.add("selection", BasalGanglia::new(RULES.len()));
    graph.connect(&turns, &selection.utilities, none);
    let slot = |graph: &mut GraphBuilder, area: &str, gate: &str| {
        let path = if area.is_empty() { gate.to_owned() } else { format!("{gate}_{area}") };
        let slot = Slot { vocabulary: &known, recurrent: gate == HELD };
        gated_slot(graph, (&path, gate), slot, (&selection.chosen, &RULES, OPEN))
    };

    let mut pairs = Vec::new();
    for (area, place) in places.iter().enumerate() {
        let name = area.to_string();
        let seen = known.parse(&format!("0.8 * ITEM_{area} + 0.3 * ITEM_{}", area + AREAS))?;
        let seen = graph.add(&format!("seen_{name}"), Constant::pointer(space, &seen));
        let there =
            graph.add(&format!("there_{name}"), Constant::pointer(space, &known.get(place)?));
        let memory = CleanupMemory::new(&known, items(), SEEN)?;
        let recognised = graph.add(&format!("recognised_{name}"), memory);
        let [item, place, pair] = ["item", "place", "pair"].map(|gate| slot(graph, &name, gate));
        let bind = graph.add(&format!("bind_{name}"), Bind::new(&known).synapse(FEED_FORWARD));
        graph.connect(&seen, &recognised.input, none);
        graph.connect(&recognised.output, &item.input, none);
        graph.connect(&there, &place.input, none);
        graph.connect(&item.output, &bind.a, none);
        graph.connect(&place.output, &bind.b, none);
        graph.connect(&bind.output, &pair.input, none);
        pairs.push(pair.output);
    }
    let asked = Constant::pointer(space, &known.get(&places[ASKED])?);
    let asked = graph.add("asked", asked);
    let question = slot(graph, "", "question");
    graph.connect(&asked, &question.input, none);
    let (first, second) = pairs.split_at(FIRST);
    let mut answers = Vec::new();
    for (name, pairs) in [("first", first), ("second", second)] {
        let sum = Superpose::new(&known, &vec![WEIGHT; pairs.len()]);
        let sum = graph.add(&format!("sum_{name}"), sum);
        for (pair, input) in pairs.iter().zip(&sum.inputs) {
            graph.connect(pair, input, none);
        }
        let [trace, answer] = ["trace", "answer"].map(|gate| slot(graph, name, gate));
        let unbind = Unbind::new(&known).synapse(FEED_FORWARD);
        let unbind = graph.add(&format!("unbind_{name}"), unbind);
        let recall = CleanupMemory::new(&known, items(), RECALLED)?;
        let recall = graph.add(&format!("recall_{name}"), recall);
        graph.connect(&sum.output, &trace.input, none);
        graph.connect(&trace.output, &unbind.bound, none);
        graph.connect(&question.output, &unbind.role, none);
        graph.connect(&unbind.output, &recall.input, none);
        graph.connect(&recall.output, &answer.input, none);
        answers.push(answer.output);
    }
    let right = known.get(&names[ASKED])?.to_vec();
    let answer: &Out<Pointer<Plain>> = &answers[usize::from(ASKED >= FIRST)];
    Ok((Watched::Pointer(graph.probe(answer, probed)), Reading::Cosine(right)))
}
