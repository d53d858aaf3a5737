//! Tests of each module: topology, output, delay and misses.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::sync::Arc;

use symbolt::neurons::{PopulationPlan, SelectRule};
use symbolt::sim::{
    Constant, Graph, GraphBuilder, Out, Pointer, ProbeId, ProbeSpec, RunConfig, Seed, SimDuration,
    Simulator, Stimulus, Synapse, Timebase, Vector, VocabTag,
};
use symbolt::spa::{
    AssociativeMemory, Bind, CleanupMemory, Gate, GoalBuffer, MemoryPorts, Reinterpret, Selection,
    Superpose, Unbind, UnbindFixed, VocabError, Vocabulary, VocabularyBuilder,
    cosine_of_slices as cosine, norm,
};

#[derive(Debug)]
struct Things;
impl VocabTag for Things {
    const NAME: &'static str = "things";
}

#[derive(Debug)]
struct Names;
impl VocabTag for Names {
    const NAME: &'static str = "names";
}

const DIM: usize = 256;

fn things() -> Vocabulary<Things> {
    VocabularyBuilder::new(DIM, Seed::new(1))
        .pointers(["A", "B", "C", "D"])
        .unitary("ROLE")
        .build()
        .expect("sound")
}

fn names() -> Vocabulary<Names> {
    VocabularyBuilder::new(DIM, Seed::new(1)).pointers(["X", "Y"]).build().expect("sound")
}

fn build(graph: GraphBuilder) -> Arc<Graph> {
    match graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1)) {
        Ok(graph) => Arc::new(graph),
        Err(error) => panic!("{error}"),
    }
}

fn ran(graph: GraphBuilder, ms: u64) -> Simulator {
    let mut sim = Simulator::new(build(graph), RunConfig::default()).expect("starts");
    sim.run_for(SimDuration::from_millis(ms)).expect("runs");
    sim
}

fn pointer(
    graph: &mut GraphBuilder,
    name: &str,
    v: &Vocabulary<Things>,
    of: &str,
) -> Out<Pointer<Things>> {
    let value = v.parse(of).expect("a sound expression");
    graph.add(name, Constant::pointer(v.space(), &value))
}

const NONE: Synapse = Synapse::None;
const WINNER: SelectRule = SelectRule::WinnerTakeAll { level: 0.3 };
const EVERY: SelectRule = SelectRule::Threshold { level: 0.5 };

#[test]
fn bind_and_unbind_are_those_of_the_algebra_one_synapse_later() {
    let v = things();
    let mut graph = GraphBuilder::new();
    let (a, b) = (pointer(&mut graph, "a", &v, "A"), pointer(&mut graph, "b", &v, "B"));
    let bind = graph.add("bind", Bind::new(&v));
    let unbind = graph.add("unbind", Unbind::new(&v));
    graph.connect(&a, &bind.a, NONE);
    graph.connect(&b, &bind.b, NONE);
    graph.connect(&bind.output, &unbind.bound, NONE);
    graph.connect(&b, &unbind.role, NONE);
    let bound = graph.probe(&bind.output, ProbeSpec::default());
    let taken = graph.probe(&unbind.output, ProbeSpec::default());
    let graph = build(graph);
    // The module's nodes: two maps, the products, and the map back.
    let paths: Vec<&str> = graph.paths().filter(|p| p.starts_with("bind/")).collect();
    assert_eq!(paths, ["bind/back", "bind/left", "bind/products", "bind/right"]);
    let products = graph.output("bind/products.out").expect("there");
    let mut sim = Simulator::new(graph, RunConfig::default()).expect("starts");
    sim.run_for(SimDuration::from_millis(60)).expect("runs");
    assert_eq!(sim.value_of(products).len(), 2 * DIM + 4);
    let expected = v.parse("A * B").expect("read");
    let shown: Vec<f32> = sim.samples(&bound).iter().map(|(_, p)| cosine(&p, &expected)).collect();
    assert_eq!(shown.len(), 60);
    assert_eq!(norm(&sim.samples(&bound).get(0).expect("there").1), 0.0);
    assert!(shown[59] > 0.9999, "{}", shown[59]);
    let grown = norm(&sim.samples(&bound).get(5).expect("there").1) / norm(&expected);
    assert!((f64::from(grown) - (1.0 - (-1.0f64).exp())).abs() < 1e-3, "{grown}");
    let back = sim.samples(&taken).last().expect("there").1;
    let exact = v.parse("A * B * ~B").expect("read");
    assert!(cosine(&back, &exact) > 0.999 && cosine(&back, &v.get("A").expect("there")) > 0.6);
}

#[test]
fn a_fixed_unitary_role_unbinds_exactly_and_at_once() {
    let v = things();
    let mut graph = GraphBuilder::new();
    let bound = pointer(&mut graph, "bound", &v, "ROLE * (A + B)");
    let unbind = graph.add("unbind", UnbindFixed::new(&v, "ROLE").expect("there"));
    graph.connect(&bound, &unbind.input, NONE);
    let out = graph.probe(&unbind.output, ProbeSpec::default());
    let sim = ran(graph, 1);
    let value = sim.samples(&out).last().expect("there").1;
    let expected = v.parse("A + B").expect("read");
    assert!(value.iter().zip(&*expected).all(|(x, y)| (x - y).abs() < 1e-5));
    assert!(norm(&value) > 1.0);
    assert!(matches!(UnbindFixed::new(&v, "ROLL"), Err(VocabError::Unknown { .. })));
}

#[test]
fn superpose_adds_with_its_weights() {
    let v = things();
    let mut graph = GraphBuilder::new();
    let (a, b) = (pointer(&mut graph, "a", &v, "A"), pointer(&mut graph, "b", &v, "B"));
    let sum = graph.add("sum", Superpose::new(&v, &[1.0, -0.5]));
    graph.connect(&a, &sum.inputs[0], NONE);
    graph.connect(&b, &sum.inputs[1], NONE);
    let out = graph.probe(&sum.output, ProbeSpec::default());
    let sim = ran(graph, 1);
    let expected = v.parse("A - 0.5 * B").expect("read");
    let value = sim.samples(&out).last().expect("there").1;
    assert!(value.iter().zip(&*expected).all(|(x, y)| (x - y).abs() < 1e-6) && norm(&value) > 1.0);
}

struct Asked {
    sim: Simulator,
    output: ProbeId<Pointer<Things>>,
    items: ProbeId<Vector>,
}

fn ask(v: &Vocabulary<Things>, rule: SelectRule, question: &str, inhibit: Option<&[f32]>) -> Asked {
    let mut graph = GraphBuilder::new();
    let input = pointer(&mut graph, "input", v, question);
    let cleanup =
        graph.add("cleanup", CleanupMemory::new(v, ["A", "B", "C", "D"], rule).expect("there"));
    graph.connect(&input, &cleanup.input, NONE);
    if let Some(values) = inhibit {
        let silence = graph.add("silence", Constant::vector(values));
        graph.connect(&silence, &cleanup.inhibit, NONE);
    }
    let output = graph.probe(&cleanup.output, ProbeSpec::default());
    let items = graph.probe(&cleanup.items, ProbeSpec::default());
    Asked { sim: ran(graph, 60), output, items }
}

impl Asked {
    fn active(&self) -> Vec<usize> {
        let items = self.sim.samples(&self.items).last().expect("there").1;
        (0..items.len()).filter(|i| items[*i] > 0.5).collect()
    }
}

#[test]
fn cleanup_finds_the_winner_or_everything_above_its_level_or_nothing() {
    let v = things();
    let noisy = ask(&v, WINNER, "0.6 * B + 0.4 * A * C", None);
    assert_eq!(noisy.active(), [1]);
    let clean = noisy.sim.samples(&noisy.output).last().expect("there").1;
    assert!(cosine(&clean, &v.get("B").expect("there")) > 0.9999);
    // A superposition: the winner alone, or both items above the level.
    assert_eq!(ask(&v, WINNER, "A + 0.9 * C", None).active(), [0]);
    assert_eq!(ask(&v, EVERY, "A + 0.9 * C", None).active(), [0, 2]);
    // A miss chooses nothing and gives a zero pointer.
    let miss = ask(&v, EVERY, "0.3 * A", None);
    assert!(miss.active().is_empty());
    assert_eq!(norm(&miss.sim.samples(&miss.output).last().expect("there").1), 0.0);
    // An inhibited item is not chosen.
    assert_eq!(ask(&v, WINNER, "A + 0.9 * C", Some(&[1.0, 0.0, 0.0, 0.0])).active(), [2]);
    assert_eq!(ask(&v, EVERY, "A + 0.9 * C", Some(&[0.0, 0.0, 1.0, 0.0])).active(), [0]);
    // Ablation: without the cleanup the pointer remains noisy.
    let noise = v.parse("0.6 * B + 0.4 * A * C").expect("read");
    assert!(cosine(&noise, &v.get("B").expect("there")) < 0.9);
}

#[test]
fn an_associative_memory_maps_keys_of_one_vocabulary_to_values_of_another() {
    let (v, n) = (things(), names());
    let pairs = [("A", "X"), ("B", "Y"), ("C", "X + Y")];
    let describe = |rule, question: &str| {
        let mut graph = GraphBuilder::new();
        let input = pointer(&mut graph, "input", &v, question);
        let memory = AssociativeMemory::new(&v, &n, pairs, rule).expect("sound");
        let memory: MemoryPorts<Things, Names> = graph.add("memory", memory);
        graph.connect(&input, &memory.input, NONE);
        let probe = graph.probe(&memory.output, ProbeSpec::default());
        let sim = ran(graph, 60);
        sim.samples(&probe).last().expect("there").1.to_vec()
    };
    assert!(cosine(&describe(WINNER, "A"), &n.get("X").expect("there")) > 0.9999);
    assert!(cosine(&describe(WINNER, "C + 0.2 * A"), &n.parse("X + Y").expect("read")) > 0.9999);
    // A superposition of keys gives the superposition of values.
    let both = describe(EVERY, "A + B");
    assert!(cosine(&both, &n.parse("X + Y").expect("read")) > 0.9999 && norm(&both) > 1.2);
    assert_eq!(norm(&describe(WINNER, "D")), 0.0);
    let none: [(&str, &str); 0] = [];
    assert!(AssociativeMemory::<Things, Names>::new(&v, &n, none, WINNER).is_err());
    assert!(matches!(
        AssociativeMemory::<Things, Names>::new(&v, &n, [("A", "Z")], WINNER),
        Err(VocabError::Unknown { .. })
    ));
}

#[test]
fn a_gate_lets_through_scales_and_silences() {
    let v = things();
    for (open, expected) in [(1.0, 1.0), (0.5, 0.5), (0.0, 0.0), (7.0, 1.0), (-3.0, 0.0)] {
        let mut graph = GraphBuilder::new();
        let input = pointer(&mut graph, "input", &v, "A");
        let switch = graph.add("switch", Constant::scalar(open));
        let gate = graph.add("gate", Gate::new(&v));
        graph.connect(&input, &gate.input, NONE);
        graph.connect(&switch, &gate.open, NONE);
        let out = graph.probe(&gate.output, ProbeSpec::default());
        let sim = ran(graph, 100);
        let length = norm(&sim.samples(&out).last().expect("there").1);
        assert!((length - expected).abs() < 1e-4, "{open}: {length}");
    }
}

#[test]
fn a_goal_buffer_follows_while_it_is_open_and_holds_while_it_is_closed() {
    let v = things();
    let ms = SimDuration::from_millis;
    let (a, b) = (v.get("A").expect("there"), v.get("B").expect("there"));
    let mut graph = GraphBuilder::new();
    // The input is A for 60 ms, then B. The gate is open for the first 40 ms and again from 600 to 640 ms.
    let input = graph.add("input", Stimulus::pointer(v.space(), &a).from(ms(60), &b));
    let open = graph.add(
        "open",
        Stimulus::scalar(1.0).from(ms(40), &[0.0]).from(ms(600), &[1.0]).from(ms(640), &[0.0]),
    );
    let buffer = graph.add("buffer", GoalBuffer::new(&v));
    graph.connect(&input, &buffer.input, NONE);
    graph.connect(&open, &buffer.open, NONE);
    let out = graph.probe(&buffer.output, ProbeSpec::default());
    let sim = ran(graph, 900);
    let samples = sim.samples(&out);
    let at = |t: usize| samples.get(t - 1).expect("there").1;
    assert_eq!(samples.len(), 900);
    // After two feed-forward synapses the output resembles the input.
    assert!(cosine(&at(12), &a) > 0.99 && norm(&at(12)) > 0.5);
    // In direct mode the closed buffer holds its value without drift.
    assert!(cosine(&at(120), &a) > 0.999);
    assert!((norm(&at(120)) - 1.0).abs() < 0.1, "{}", norm(&at(120)));
    assert!((norm(&at(590)) / norm(&at(120)) - 1.0).abs() < 1e-3);
    // After the gate reopens, B replaces A.
    assert!(cosine(&at(612), &b) > 0.7);
    assert!(cosine(&at(890), &b) > 0.99 && (norm(&at(890)) - 1.0).abs() < 0.1);
    // No memory of A is left.
    assert!(cosine(&at(890), &a).abs() < 0.2);
}

#[test]
fn a_goal_buffer_with_slow_synapses_does_not_turn_round_what_it_held_before() {
    let v = things();
    let ms = SimDuration::from_millis;
    let [a, b] = ["A", "B"].map(|name| v.get(name).expect("there"));
    for tau in [5, 20, 40] {
        for open_ms in [40, 80, 120, 200] {
            // The buffer stores A for a second, then B for `open_ms`.
            let (change, end) = (1_000, 1_000 + open_ms);
            let mut graph = GraphBuilder::new();
            let input = Stimulus::pointer(v.space(), &a).from(ms(change), &b);
            let input = graph.add("input", input);
            let open = graph.add("open", Stimulus::scalar(1.0).from(ms(end), &[0.0]));
            let buffer = GoalBuffer::new(&v).synapse(Synapse::lowpass_ms(tau));
            let buffer = graph.add("buffer", buffer);
            graph.connect(&input, &buffer.input, NONE);
            graph.connect(&open, &buffer.open, NONE);
            let sim = ran(graph, end + 600);
            let held = sim.value(&buffer.output);
            let before = norm(&held) * cosine(&held, &a);
            assert!(before > -0.1, "{tau} ms, open for {open_ms}: {before} of A is left");
            // Open for eight time constants, the buffer holds B alone.
            if open_ms >= 8 * tau {
                let taken = norm(&held) * cosine(&held, &b);
                assert!((taken - 1.0).abs() < 0.12 && before < 0.12, "{tau}: {taken} {before}");
            }
        }
    }
}

#[test]
fn selection_chooses_one_or_all_above_its_level() {
    let choose = |rule, utilities: &[f32]| {
        let mut graph = GraphBuilder::new();
        let input = graph.add("utilities", Constant::vector(utilities));
        let selection = graph.add("selection", Selection::new(utilities.len(), rule));
        graph.connect(&input, &selection.utilities, NONE);
        let out = graph.probe(&selection.items, ProbeSpec::default());
        let sim = ran(graph, 60);
        let items = sim.samples(&out).last().expect("there").1;
        (0..items.len()).filter(|i| items[*i] > 0.99).collect::<Vec<_>>()
    };
    assert_eq!(choose(WINNER, &[0.3, 0.8, 0.4]), [1]);
    assert_eq!(choose(EVERY, &[0.5, 0.8, 0.4]), [0, 1]);
    assert_eq!(choose(WINNER, &[0.3, 0.3]), [0]);
    assert!(choose(WINNER, &[0.2, -5.0, 0.1]).is_empty());
    assert_eq!(choose(SelectRule::WinnerTakeAll { level: -1.0 }, &[-0.5, -0.9]), [0]);
}

#[test]
fn reinterpreting_crosses_vocabularies_without_changing_a_number() {
    let (v, n) = (things(), names());
    let mut graph = GraphBuilder::new();
    let a = pointer(&mut graph, "a", &v, "A");
    let across = graph.add(
        "across",
        Reinterpret::<Pointer<Things>, Pointer<Names>>::new(
            symbolt::sim::InputSpec::pointer(v.space()),
            symbolt::sim::OutputSpec::pointer(n.space()),
        ),
    );
    graph.connect(&a, &across.input, NONE);
    let out = graph.probe(&across.output, ProbeSpec::default());
    let sim = ran(graph, 1);
    assert_eq!(*sim.samples(&out).last().expect("there").1, *v.get("A").expect("there"));
}
