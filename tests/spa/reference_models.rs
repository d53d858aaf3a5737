//! Five models of pointers beside those of nengo_spa 2.0, over the same vocabularies: a clean-up, a recall, a parse, a
//! sequence and a routed sequence, on five seeds each.
//!
//! The fixture `pointers.npz` has the vocabularies and what the models of nengo_spa do. `tests/conformance/pointers.py`
//! wrote it. The models and their sizes are those of the public benchmarks of Nengo.

use std::path::Path;

use ndarray::{Ix1, Ix2};
use symbolt::files::npz::NpzReader;
use symbolt::neurons::SelectRule;
use symbolt::prelude::*;
use symbolt::sim::PointerRef;
use symbolt::spa::norm;

const SEEDS: u64 = 5;
/// Networks that the fixture has for each vocabulary where an answer can be wrong.
const NETWORKS: u64 = 4;

symbolt::vocabulary!(Paired = "paired": RED, BLUE, CIRCLE, SQUARE);
symbolt::vocabulary!(Recalled = "recalled": S0, S1, S2, S3, M0, M1, M2, M3);
symbolt::vocabulary!(Parsed = "parsed": WRITE, ONE, TWO, THREE, NONE, VERB, NOUN);
symbolt::vocabulary!(States = "states": S0, S1, S2, S3, S4);

fn fixture() -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/conformance");
    std::fs::read(folder.join("pointers.npz")).unwrap()
}

/// Returns what the model of nengo_spa does on each seed.
fn reference(name: &str) -> Vec<f64> {
    let bytes = fixture();
    let mut npz = NpzReader::new(&bytes).unwrap();
    let found = npz.read::<f64, Ix1>(name).unwrap().to_vec();
    assert_eq!(found.len(), SEEDS as usize);
    found
}

/// Reads a vocabulary, whose tag has the name of the arrays.
fn vocabulary<V: VocabTag>(names: &[&str], seed: u64) -> Vocabulary<V> {
    let bytes = fixture();
    let mut npz = NpzReader::new(&bytes).unwrap();
    let rows = npz.read::<f32, Ix2>(&format!("{}_{seed}", V::NAME)).unwrap();
    assert_eq!(rows.nrows(), names.len());
    let builder = VocabularyBuilder::<V>::new(rows.ncols(), Seed::new(seed)).any_similarity();
    let add = |builder: VocabularyBuilder<V>, (name, row): (&&str, _)| {
        let row: ndarray::ArrayView1<'_, f32> = row;
        let length = norm(row.as_slice().unwrap());
        let row: Vec<f32> = row.iter().map(|v| v / length).collect();
        builder.vector(*name, &PointerRef::<V>::from_raw(&row))
    };
    names.iter().zip(rows.rows()).fold(builder, add).build().unwrap()
}

fn run(graph: &GraphBuilder, seed: u64, ms: u64) -> Simulator {
    let plan = PopulationPlan::lif();
    graph.run(&plan, Seed::new(seed), SimDuration::from_millis(ms)).unwrap()
}

fn smooth(tau_ms: u64) -> ProbeSpec {
    ProbeSpec::default().filtered(Synapse::lowpass_ms(tau_ms))
}

/// Returns the most similar name, by the scalar product.
fn most_similar<'n, V: VocabTag>(
    words: &Vocabulary<V>,
    names: &[&'n str],
    value: &[f32],
) -> &'n str {
    let like = |name: &&str| dot(&PointerRef::<V>::from_raw(value), &words.get(name).unwrap());
    names.iter().copied().max_by(|a, b| like(a).total_cmp(&like(b))).unwrap()
}

/// Two pairs are bound and remembered; twenty questions of 100 ms are answered through a contest of the four names.
fn cleaned(seed: u64, network: u64) -> usize {
    let words = vocabulary::<Paired>(&Paired::NAMES, seed);
    let (asked, answers) =
        (["BLUE", "RED", "CIRCLE", "SQUARE"], ["CIRCLE", "SQUARE", "BLUE", "RED"]);
    let shown = |first, second| words.stimulus([(0, first), (200, second), (400, "0")]).unwrap();
    let questions = (0..20).map(|at| (400 + 100 * at as u64, asked[at % 4]));
    let questions = [(0, "0")].into_iter().chain(questions);
    let mut graph = GraphBuilder::new();
    let shapes = graph.add("shapes", shown("CIRCLE", "SQUARE"));
    let colors = graph.add("colors", shown("BLUE", "RED"));
    let asked = graph.add("asked", words.stimulus(questions).unwrap());
    let slow = Synapse::lowpass_ms(100);
    let [shape, color, query, result, clean] = ["shape", "color", "query", "result", "clean"]
        .map(|name| graph.add(name, State::new(&words)));
    let bound = graph.add("bound", State::new(&words).recurrent(slow));
    let rule = SelectRule::WinnerTakeAll { level: 0.3 };
    let memory = graph.add("memory", CleanupMemory::new(&words, Paired::NAMES, rule).unwrap());
    graph.route(&shapes >> &shape);
    graph.route(&colors >> &color);
    graph.route(&asked >> &query);
    graph.route((0.5 * (&shape * &color) >> &bound).via(slow));
    graph.route(2.0 * (&bound * !&query) >> &result);
    graph.route(&result >> &memory);
    graph.route(&memory >> &clean);
    let probe = graph.probe(&clean.output, smooth(20));
    let sim = run(&graph, 100 * seed + network, 2_400);
    (0..20)
        .filter(|at| {
            let (_, value) = sim.samples(&probe).get(499 + 100 * at).unwrap();
            most_similar(&words, &Paired::NAMES, &value) == answers[at % 4]
        })
        .count()
}

/// Four pairs are bound and remembered in 16 dimensions; each of the eight names is asked for its partner.
fn recalled(seed: u64, network: u64) -> usize {
    let words = vocabulary::<Recalled>(&Recalled::NAMES, seed);
    let names = Recalled::NAMES;
    let shown = |from: usize| {
        let names = (0..4).map(|at| (200 * at as u64, names[from + at]));
        words.stimulus(names.chain([(800, "0")])).unwrap()
    };
    let questions = (0..8).map(|at| (800 + 100 * at as u64, names[at]));
    let questions = words.stimulus([(0, "0")].into_iter().chain(questions)).unwrap();
    let mut graph = GraphBuilder::new();
    let (first, second) = (graph.add("first", shown(0)), graph.add("second", shown(4)));
    let asked = graph.add("asked", questions);
    let [word, marker, motor, cue] =
        ["word", "marker", "motor", "cue"].map(|name| graph.add(name, State::new(&words)));
    let memory = graph.add("memory", State::new(&words).recurrent(Synapse::lowpass_ms(100)));
    graph.route(&first >> &word);
    graph.route(&second >> &marker);
    graph.route(&asked >> &cue);
    graph.route(&word * &marker >> &memory);
    graph.route(&memory * !&cue >> &motor);
    let probe = graph.probe(&motor.output, smooth(30));
    let sim = run(&graph, 100 * seed + network, 1_600);
    (0..8)
        .filter(|at| {
            let (_, value) = sim.samples(&probe).get(899 + 100 * at).unwrap();
            most_similar(&words, &names, &value) == names[(at + 4) % 8]
        })
        .count()
}

/// WRITE and ONE are read for half a second each, then nothing. Returns whether the hand then says ONE.
fn parsed(seed: u64) -> bool {
    use Parsed as P;
    let words = vocabulary::<Parsed>(&P::NAMES, seed);
    let mut graph = GraphBuilder::new();
    let text = words.stimulus([(0, "WRITE"), (500, "ONE"), (1_000, "NONE")]).unwrap();
    let text = graph.add("text", text);
    let [vision, phrase, hand] =
        ["vision", "phrase", "hand"].map(|name| graph.add(name, State::new(&words)));
    let slow = Synapse::lowpass_ms(100);
    let [noun, verb] =
        ["noun", "verb"].map(|name| graph.add(name, State::new(&words).recurrent(slow)));
    graph.route(&text >> &vision);
    graph.route(&noun * P::NOUN + &verb * P::VERB >> &phrase);
    let done = 0.5 * vision.dot(P::NONE - P::WRITE - P::ONE - P::TWO - P::THREE)
        + 0.5 * phrase.dot(P::WRITE * P::VERB);
    let rules = Rules::new()
        .rule("verb", vision.dot(P::WRITE), [&vision >> &verb])
        .rule("noun", vision.dot(P::ONE + P::TWO + P::THREE), [&vision >> &noun])
        .rule("write", done, [&phrase * !P::NOUN >> &hand]);
    graph.add("rules", rules);
    let probe = graph.probe(&hand.output, smooth(30));
    let sim = run(&graph, seed, 1_500);
    let mut sum = vec![0.0; words.dim()];
    for (_, value) in sim.samples(&probe).iter().skip(1_250) {
        sum.iter_mut().zip(value.iter()).for_each(|(sum, v)| *sum += v);
    }
    most_similar(&words, &P::NAMES, &sum) == "ONE"
}

/// Five states follow each other; routed, the last brings back what is seen. The state may remember. Returns the mean
/// time of a state, in ms.
fn period(seed: u64, routed: bool, remembers: bool) -> f64 {
    use States as S;
    let words = vocabulary::<States>(&S::NAMES, seed);
    let mut graph = GraphBuilder::new();
    let start = graph.add("start", words.stimulus([(0, "S0"), (100, "0")]).unwrap());
    let state = State::new(&words);
    let state = if remembers { state.recurrent(Synapse::lowpass_ms(10)) } else { state };
    let state = graph.add("state", state);
    let vision = graph.add("vision", State::new(&words));
    graph.route(&start >> &state);
    graph.route(S::S0 >> &vision);
    let back = if routed { &vision >> &state } else { S::S0 >> &state };
    let rules = Rules::new()
        .rule("0", state.dot(S::S0), [S::S1 >> &state])
        .rule("1", state.dot(S::S1), [S::S2 >> &state])
        .rule("2", state.dot(S::S2), [S::S3 >> &state])
        .rule("3", state.dot(S::S3), [S::S4 >> &state])
        .rule("4", state.dot(S::S4), [back]);
    let rules = graph.add("rules", rules);
    let probe = graph.probe(&rules.chosen, smooth(30));
    let sim = run(&graph, seed, 1_000);
    let best = |value: &[f32]| (0..5).max_by(|a, b| value[*a].total_cmp(&value[*b])).unwrap();
    let best: Vec<usize> = sim.samples(&probe).iter().skip(50).map(|(_, v)| best(v)).collect();
    let changes: Vec<usize> =
        best.windows(2).enumerate().filter(|(_, two)| two[0] != two[1]).map(|(at, _)| at).collect();
    assert!(changes.len() > 5, "{changes:?}");
    let after = changes.iter().map(|at| best[at + 1]).collect::<Vec<_>>();
    assert!(after.windows(2).all(|two| two[1] == (two[0] + 1) % 5), "{after:?}");
    (changes[changes.len() - 1] - changes[0]) as f64 / (changes.len() - 1) as f64
}

fn sum(values: &[f64]) -> f64 {
    values.iter().sum()
}

/// Returns how often a model is right over all vocabularies, with so many networks for each.
fn right(model: fn(u64, u64) -> usize, networks: u64) -> usize {
    let of = |seed| (0..networks).map(|network| model(seed, network)).sum::<usize>();
    let all: Vec<usize> = (1..=SEEDS).map(of).collect();
    println!("{all:?} of {networks} networks each");
    all.iter().sum()
}

/// Checks that a model is right as often as that of the reference, within so many standard errors of the difference.
#[track_caller]
fn as_often(
    name: &str,
    model: fn(u64, u64) -> usize,
    (answers, networks): (f64, u64),
    errors: f64,
) {
    let found = right(model, networks) as f64;
    let share = sum(&reference(name)) / (answers * (SEEDS * NETWORKS) as f64);
    assert!((0.5..0.95).contains(&share), "{share}");
    let all = answers * (SEEDS * networks) as f64;
    let both = 1.0 + networks as f64 / NETWORKS as f64;
    let error = (share * (1.0 - share) * all * both).sqrt();
    println!("{name}: {found} of {all}; reference {:.1}, give or take {error:.1}", share * all);
    assert!(found >= share * all - errors * error, "{name}: {found} of {all}");
}

#[test]
#[ignore = "long: two minutes"]
fn remembered_pairs_are_cleaned_up_and_recalled_as_often_as_by_the_reference() {
    // Over 40 networks for each vocabulary 85% of the clean-ups are right; of the reference 83% over 20, and 85% over the
    // four of the fixture. Exact maths has 80%: it errs where crosstalk favours another name.
    as_often("cleaned", cleaned, (20.0, 12), 1.5);
    as_often("recalled", recalled, (8.0, 12), 1.5);
}

#[test]
fn remembered_pairs_are_cleaned_up_and_recalled_in_one_network_each() {
    as_often("cleaned", cleaned, (20.0, 1), 2.0);
    as_often("recalled", recalled, (8.0, 1), 2.0);
}

#[test]
fn a_command_of_two_words_is_parsed_and_executed() {
    let found: Vec<bool> = (1..=SEEDS).map(parsed).collect();
    println!("parsed {found:?}; reference {:?}", reference("parsed"));
    assert_eq!(found, [true; SEEDS as usize]);
}

#[test]
fn states_follow_each_other_and_what_is_routed_as_fast_as_in_the_reference() {
    for (name, routed) in [("sequence", false), ("routed", true)] {
        let found: Vec<f64> = (1..=SEEDS).map(|seed| period(seed, routed, true)).collect();
        println!("{name} {found:.1?} ms; reference {:.1?}", reference(name));
        assert!(sum(&found) <= sum(&reference(name)), "{name}: {found:?}");
        // Without a memory of its own a state gives way sooner.
        let found: Vec<f64> = (1..=SEEDS).map(|seed| period(seed, routed, false)).collect();
        println!("{name} {found:.1?} ms without a memory");
        assert!(found.iter().all(|ms| (27.0..=34.0).contains(ms)), "{name}: {found:?}");
    }
}
