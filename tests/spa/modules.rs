//! Tests of each module: topology, output, delay and misses.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::sync::Arc;

use symbolt::neurons::{Layers, PopulationPlan, Product, SelectRule};
use symbolt::sim::{
    Add, Constant, Fingerprint, Graph, GraphBuilder, In, InputSpec, Module, Out, OutputSpec,
    Pointer, ProbeId, ProbeSpec, RunConfig, Scalar, Scope, Scratch, ScratchSpec, Seed, SimDuration,
    Simulator, Stimulus, Synapse, Timebase, Vector, VocabTag,
};
use symbolt::spa::{
    Algebra, AssociativeMemory, BilinearPorts, Bind, CleanupMemory, FEED_FORWARD, FlowExt, Gate,
    GoalBuffer, Hrr, Linear, LinearMap, MemoryPorts, ProductForm, Routes, Selection, Superpose,
    Unbind, VocabError, Vocabulary, VocabularyBuilder, cosine_of_slices as cosine, norm,
    random_pointer,
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
    assert_eq!(sim.value_of(products).len(), 2 * DIM - 2);
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
    let unbind = graph.add("unbind", Linear::unbind(&v, "ROLE").expect("there"));
    graph.connect(&bound, &unbind.input, NONE);
    let out = graph.probe(&unbind.output, ProbeSpec::default());
    let sim = ran(graph, 1);
    let value = sim.samples(&out).last().expect("there").1;
    let expected = v.parse("A + B").expect("read");
    assert!(value.iter().zip(&*expected).all(|(x, y)| (x - y).abs() < 1e-5));
    assert!(norm(&value) > 1.0);
    assert!(matches!(Linear::unbind(&v, "ROLL"), Err(VocabError::Unknown { .. })));
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
        Linear::reinterpret(InputSpec::pointer(v.space()), OutputSpec::pointer(n.space())),
    );
    graph.connect(&a, &across.input, NONE);
    let out = graph.probe(&across.output, ProbeSpec::default());
    let sim = ran(graph, 1);
    assert_eq!(*sim.samples(&out).last().expect("there").1, *v.get("A").expect("there"));
}

/// A user's module for pointers of any vocabulary. One line makes its ports an operand and a target.
struct Halved<V: VocabTag>(Vocabulary<V>);
struct HalvedPorts<V: VocabTag> {
    input: In<Pointer<V>>,
    output: Out<Pointer<V>>,
}
symbolt::flow_ports!([V: VocabTag] HalvedPorts<V>, output: Pointer<V>, input: Pointer<V>);

impl<V: VocabTag> Module for Halved<V> {
    type Ports = HalvedPorts<V>;

    fn expand(self, scope: &mut Scope<'_>) -> HalvedPorts<V> {
        let half = scope.add("half", Superpose::new(&self.0, &[0.5]));
        HalvedPorts {
            input: scope.input("input", half.inputs[0].clone()),
            output: scope.output("output", half.output),
        }
    }
}

/// The same for a number.
struct Quarter;
struct QuarterPorts {
    output: Out<Scalar>,
}
symbolt::flow_ports!(QuarterPorts, output: Scalar);

impl Module for Quarter {
    type Ports = QuarterPorts;

    fn expand(self, scope: &mut Scope<'_>) -> QuarterPorts {
        let quarter = scope.add("quarter", Constant::scalar(0.25));
        QuarterPorts { output: scope.output("output", quarter) }
    }
}

#[test]
#[allow(clippy::precedence)]
fn a_module_of_your_own_has_every_operator_by_one_line() {
    let v = things();
    let mut graph = GraphBuilder::new();
    let a = pointer(&mut graph, "a", &v, "2 * A");
    let half = graph.add("half", Halved(v.clone()));
    let quarter = graph.add("quarter", Quarter);
    graph.route(&a >> &half);
    let [a, b, role] = ["A", "B", "ROLE"].map(|name| v.get(name).expect("there"));
    let pointers = [
        ("A * ROLE", &half * role),
        ("0.25 * A", &half * &quarter),
        ("0.125 * A", 0.5 * (&quarter * &half)),
        ("2 * A", 2.0 * &half),
        ("A + B", &half + b),
        ("A - B", &half - b),
        ("-A", -&half),
        ("~A", !&half),
    ];
    let numbers = [
        (1.25, 1.0 + &quarter),
        (0.75, 1.0 - &quarter),
        (-0.75, &quarter - 1.0),
        (-0.25, -&quarter),
        (0.5, 2.0 * &quarter),
        (1.0, half.dot(a)),
    ];
    let mut shown = Vec::new();
    for (at, (text, flow)) in pointers.into_iter().enumerate() {
        let out = graph.add(&format!("pointer{at}"), Add::pointer(v.space()));
        graph.route(flow >> &out);
        shown.push((text, out));
    }
    let mut told = Vec::new();
    for (at, (expected, flow)) in numbers.into_iter().enumerate() {
        let out = graph.add(&format!("number{at}"), Add::scalar());
        graph.route(flow >> &out);
        told.push((expected, out));
    }
    let sim = ran(graph, 60);
    for (text, out) in shown {
        let (found, expected) = (sim.value(&out.output), v.parse(text).expect("read"));
        assert!(found.iter().zip(&*expected).all(|(x, y)| (x - y).abs() < 1e-3), "{text}");
    }
    for (expected, out) in told {
        assert!((sim.value(&out.output)[0] - expected).abs() < 1e-3, "{expected}");
    }
}

/// A map of a convolution with six more products, which have a factor that is always zero.
struct Padded {
    map: Box<dyn LinearMap>,
    back: bool,
}

impl LinearMap for Padded {
    fn input_width(&self) -> usize {
        self.map.input_width() + if self.back { 6 } else { 0 }
    }

    fn output_width(&self) -> usize {
        self.map.output_width() + if self.back { 0 } else { 6 }
    }

    fn scratch(&self) -> ScratchSpec {
        self.map.scratch()
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        self.map.fingerprint(hash);
    }

    fn apply_into(&self, input: &[f32], out: &mut [f32], scratch: &mut Scratch<'_>) {
        if self.back {
            // Two of the six are subtracted from the values of the spectrum at 0 and at D/2, which come last.
            let (products, zeros) = input.split_at(self.map.input_width());
            let mut products = products.to_vec();
            let real = products.len() - 2;
            products[real..].iter_mut().zip(zeros).for_each(|(value, zero)| *value -= zero);
            self.map.apply_into(&products, out, scratch);
        } else {
            let (factors, zeros) = out.split_at_mut(self.map.output_width());
            zeros.fill(0.0);
            self.map.apply_into(input, factors, scratch);
        }
    }
}

struct Convolution(ProductForm);

impl Module for Convolution {
    type Ports = BilinearPorts<Vector>;

    fn expand(self, scope: &mut Scope<'_>) -> BilinearPorts<Vector> {
        let ProductForm { pairs, magnitude, left, right, back } = self.0;
        let (into, from) = (InputSpec::vector, OutputSpec::vector);
        let (d, n) = (left.input_width(), pairs);
        let left = scope.add("left", Linear::new(into(d), from(n), left));
        let right = scope.add("right", Linear::new(into(d), from(n), right));
        let products = scope.product("products", Product::new(n).radius(magnitude));
        let back = scope.add("back", Linear::new(into(n), from(d), back));
        scope.connect(&left.output, &products.a, NONE);
        scope.connect(&right.output, &products.b, NONE);
        scope.connect(&products.output, &back.input, FEED_FORWARD);
        BilinearPorts { a: left.input, b: right.input, output: back.output }
    }
}

/// Returns the mean squared error of a convolution in spikes: of all components, and of the spectrum's two real values.
fn errors(dim: usize, seed: u64, zeros: bool) -> [f64; 2] {
    let draw = |index| random_pointer(dim, Seed::new(seed).derive_index("factor", index));
    let (a, b, mut exact) = (draw(0), draw(1), vec![0.0; dim]);
    Hrr.bind_into(&a, &b, &mut exact, &mut Hrr.scratch(dim));
    let mut form = Hrr.product_form(dim);
    if zeros {
        let padded = |map, back| -> Box<dyn LinearMap> { Box::new(Padded { map, back }) };
        form.pairs += 6;
        form.left = padded(form.left, false);
        form.right = padded(form.right, false);
        form.back = padded(form.back, true);
    }
    let mut graph = GraphBuilder::new();
    let convolution = graph.add("convolution", Convolution(form));
    let (a, b) = (graph.add("a", Constant::vector(&a)), graph.add("b", Constant::vector(&b)));
    graph.connect(&a, &convolution.a, NONE);
    graph.connect(&b, &convolution.b, NONE);
    let probe = graph.probe(&convolution.output, ProbeSpec::default());
    let plan = PopulationPlan::lif();
    let sim = graph.run(&plan, Seed::new(seed), SimDuration::from_millis(200)).expect("runs");
    let (mut all, mut real, mut ticks) = (0.0, 0.0, 0.0);
    for (_, value) in sim.samples(&probe).iter().skip(50) {
        let off: Vec<f64> = value.iter().zip(&exact).map(|(x, y)| f64::from(x - y)).collect();
        let turned = off.iter().enumerate().map(|(at, v)| if at % 2 == 0 { *v } else { -v });
        all += off.iter().map(|v| v * v).sum::<f64>();
        real += off.iter().sum::<f64>().powi(2) + turned.sum::<f64>().powi(2);
        ticks += 1.0;
    }
    [all / ticks, real / ticks]
}

#[test]
fn leaving_out_the_products_with_zero_makes_a_convolution_in_spikes_no_worse() {
    let mean = |zeros| {
        let each: Vec<_> = (1..=20).map(|seed| errors(16, seed, zeros)).collect();
        [0, 1].map(|which| each.iter().map(|e| e[which]).sum::<f64>() / 20.0)
    };
    let ([all, real], [padded, padded_real]) = (mean(false), mean(true));
    println!("all {all:.5} {padded:.5}, real {real:.5} {padded_real:.5}");
    assert!(all < padded && real < 0.8 * padded_real, "{all} {padded}, {real} {padded_real}");
}
