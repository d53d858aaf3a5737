//! Expressions over vectors, numbers and pointers, bare layers, and ensembles of several dimensions.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::precedence)]

use symbolt::neurons::{Ensemble, SolvedModel};
use symbolt::prelude::*;
use symbolt::sim::{Module, Pointer, Scope, Signal};
use symbolt::spa::{Bind, Compare, Flow, Multiply, Sequence, Weigh};

symbolt::vocabulary!(Things = "things": RED, BLUE, CIRCLE);
symbolt::vocabulary!(Words = "words": CIRCLE, BLUE);

fn lif() -> PopulationPlan {
    PopulationPlan::lif()
}

fn ms(ms: u64) -> SimDuration {
    SimDuration::from_millis(ms)
}

#[test]
fn an_expression_has_the_bits_of_the_graph_wired_by_hand() {
    let things = Things::vocabulary(64, Seed::new(2)).unwrap();
    let trace = |plan: &PopulationPlan, by_hand: Option<bool>| -> Vec<u32> {
        let mut graph = GraphBuilder::new();
        let a = graph.add("a", things.stimulus([(0, "RED"), (20, "BLUE")]).unwrap());
        let b = graph.add("b", things.stimulus([(0, "CIRCLE")]).unwrap());
        let out = graph.add("out", State::new(&things));
        match by_hand {
            None => graph.route((&a * &b >> &out).named("route")),
            Some(exchanged) => {
                let bind = graph.add("route", OneBind { exchanged, things: &things });
                graph.connect(&a, &bind.0, Synapse::None);
                graph.connect(&b, &bind.1, Synapse::None);
                graph.connect(&bind.2, &out.input, Synapse::None);
            }
        }
        let probe = graph.probe(&out.output, ProbeSpec::default());
        let sim = graph.run(plan, Seed::new(3), ms(40)).unwrap();
        sim.samples(&probe).iter().flat_map(|(_, v)| v.to_vec()).map(f32::to_bits).collect()
    };
    let rate = PopulationPlan::rate();
    for plan in [PopulationPlan::direct(), rate, lif()] {
        let expression = trace(&plan, None);
        assert_eq!(expression.len(), 40 * 64);
        assert!(expression.iter().any(|bits| *bits != 0));
        assert!(expression == trace(&plan, Some(false)));
        // Exact binding commutes bit by bit; neurons must notice exchanged factors.
        let exact = plan == PopulationPlan::direct();
        assert_eq!(expression == trace(&plan, Some(true)), exact);
    }
}

struct OneBind<'v> {
    things: &'v Vocabulary<Things>,
    exchanged: bool,
}

type Three = (In<Pointer<Things>>, In<Pointer<Things>>, Out<Pointer<Things>>);

impl Module for OneBind<'_> {
    type Ports = Three;

    fn expand(self, scope: &mut Scope<'_>) -> Three {
        let bind = scope.add("bind", Bind::new(self.things));
        let (a, b) = if self.exchanged { (bind.b, bind.a) } else { (bind.a, bind.b) };
        (scope.input("a", a), scope.input("b", b), scope.output("output", bind.output))
    }
}

#[test]
fn vectors_are_added_transformed_weighed_and_cut() {
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", Constant::vector(&[1.0, 2.0, 3.0]));
    let half = graph.add("half", Signal::scalar(|_| 0.5));
    let outs: Vec<_> = [3, 2, 2, 3, 2]
        .iter()
        .enumerate()
        .map(|(i, width)| graph.add(&format!("out{i}"), Add::vector(*width)))
        .collect();
    let number = graph.add("number", Add::scalar());
    graph.route(2.0 * &a - [1.0, 1.0, 1.0] >> &outs[0]);
    graph.route(a.transform([[1.0, 0.0, 1.0], [0.0, -1.0, 0.0]]) >> &outs[1]);
    graph.route((&a + &a).slice(1..3) >> &outs[2]);
    graph.route(&half * &a >> &outs[3]);
    graph.route((&half * &half + 1.0).transform([[1.0], [-2.0]]) >> &outs[4]);
    graph.route(1.0 - a.component(2) >> &number);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(60)).unwrap();
    let expected: [&[f32]; 5] =
        [&[1.0, 3.0, 5.0], &[4.0, -2.0], &[4.0, 6.0], &[0.5, 1.0, 1.5], &[1.25, -2.5]];
    for (out, expected) in outs.iter().zip(expected) {
        let found = sim.value(&out.output);
        assert_eq!(found.len(), expected.len());
        let off = found.iter().zip(expected).map(|(f, e)| (f - e).abs()).fold(0.0, f32::max);
        assert!(off < 1e-3, "{found:?} instead of {expected:?}");
    }
    assert_eq!(sim.value(&number.output)[0], -2.0);
}

#[test]
fn a_pointer_is_translated_and_reinterpreted() {
    let things = Things::vocabulary(64, Seed::new(1)).unwrap();
    let words = Words::vocabulary(64, Seed::new(2)).unwrap();
    let mut graph = GraphBuilder::new();
    let seen = graph.add("seen", things.stimulus([(0, "0.5 * BLUE + CIRCLE")]).unwrap());
    let [word, same] = ["word", "same"].map(|name| graph.add(name, State::new(&words)));
    graph.route(seen.translate(&words) >> &word);
    let identity = (0..64).map(|at| std::array::from_fn::<f32, 64, _>(|i| f32::from(i == at)));
    graph.route(seen.transform(identity).reinterpret(&words) >> &same);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(60)).unwrap();
    let expected = words.parse("0.5 * BLUE + CIRCLE").unwrap();
    assert!(cosine(&sim.value(&word.output), &expected) > 0.99);
    assert!(cosine(&sim.value(&same.output), &expected) < 0.5, "the wrong way is caught");
    let raw = things.parse("0.5 * BLUE + CIRCLE").unwrap();
    assert!(symbolt::spa::cosine_of_slices(&sim.value(&same.output), &raw) > 0.99);
}

#[test]
fn rules_gate_vectors_and_numbers() {
    let things = Things::vocabulary(64, Seed::new(1)).unwrap();
    for plan in [PopulationPlan::direct(), lif()] {
        let mut graph = GraphBuilder::new();
        let seen = graph.add("seen", things.stimulus([(0, "RED")]).unwrap());
        let arm = graph.add("arm", Constant::vector(&[0.5, -0.5]));
        let [left, right] = ["left", "right"].map(|name| graph.add(name, Add::vector(2)));
        let fixed = graph.add("fixed", Add::vector(2));
        let rules = Rules::new()
            .rule("red", seen.dot(Things::RED), [&arm >> &left, arm.slice(0..2) >> &right])
            .rule(
                "blue",
                seen.dot(Things::BLUE),
                [&arm >> &right, Flow::vector(&[1.0, 2.0]) >> &fixed],
            );
        graph.add("rules", rules);
        let probe =
            graph.probe(&left.output, ProbeSpec::default().filtered(Synapse::lowpass_ms(20)));
        let sim = graph.run(&plan, Seed::new(1), ms(250)).unwrap();
        let (_, found) = sim.samples(&probe).last().unwrap();
        assert!((found[0] - 0.5).abs() < 0.12 && (found[1] + 0.5).abs() < 0.12, "{found:?}");
        assert!(sim.value(&fixed.output).iter().all(|v| v.abs() < 0.05));
    }
}

#[test]
fn standard_modules_multiply_in_every_mode() {
    let things = Things::vocabulary(64, Seed::new(1)).unwrap();
    for (plan, within) in [(PopulationPlan::direct(), 1e-3), (lif(), 0.12)] {
        let mut graph = GraphBuilder::new();
        let a = graph.add("a", things.stimulus([(0, "0.8 * RED")]).unwrap());
        let b = graph.add("b", things.stimulus([(0, "RED")]).unwrap());
        let [x, y] =
            [0.6, -0.7].map(|v| graph.add(&format!("x{v}").replace('-', "m"), Constant::scalar(v)));
        let compare = graph.add("compare", Compare::new(&things));
        let multiply = graph.add("multiply", Multiply::new());
        let weigh = graph.add("weigh", Weigh::pointer(&things));
        let outs = [graph.add("dot", Add::scalar()), graph.add("product", Add::scalar())];
        let weighed = graph.add("weighed", State::new(&things));
        graph.route(&a >> &compare.a);
        graph.route(&b >> &compare.b);
        graph.route(&x >> &multiply.a);
        graph.route(&y >> &multiply.b);
        graph.route(&x >> &weigh.weight);
        graph.route(&b >> &weigh.value);
        graph.route(&compare >> &outs[0]);
        graph.route(&multiply >> &outs[1]);
        graph.route(&weigh >> &weighed);
        let filtered = ProbeSpec::default().filtered(Synapse::lowpass_ms(30));
        let probes =
            [graph.probe(&outs[0].output, filtered), graph.probe(&outs[1].output, filtered)];
        let sim = graph.run(&plan, Seed::new(2), ms(300)).unwrap();
        for (probe, expected) in probes.iter().zip([0.8, -0.42]) {
            let (_, found) = sim.samples(probe).last().unwrap();
            assert!((found[0] - expected).abs() < within, "{found:?} instead of {expected}");
        }
        let red = sim.value(&weighed.output);
        let length = symbolt::spa::dot(&red, &things.get("RED").unwrap());
        assert!((length - 0.6).abs() < 1.5 * within, "{length}");
    }
}

/// An ensemble of two dimensions and three functions, with a constant input.
fn three_functions(plan: &PopulationPlan) -> ([f32; 4], SolvedModel) {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.6, -0.5]));
    let ensemble = Ensemble::new(2)
        .size(2.0)
        .decode("product", 1, |x, out| out[0] = x[0] * x[1])
        .identity("same")
        .decode("square", 1, |x, out| out[0] = x[0] * x[0] + x[1] * x[1]);
    let ensemble = graph.add("ensemble", ensemble);
    graph.route(&given >> &ensemble);
    let filtered = ProbeSpec::default().filtered(Synapse::lowpass_ms(30));
    let probes =
        ["product", "same", "square"].map(|name| graph.probe(&ensemble.output(name), filtered));
    let graph = graph.build(Timebase::default(), plan, Seed::new(4)).unwrap();
    let model = SolvedModel::of(&graph);
    let mut sim = Simulator::new(graph.into(), RunConfig::default()).unwrap();
    sim.run_for(ms(300)).unwrap();
    let last = probes.map(|probe| sim.samples(&probe).last().unwrap().1.to_vec());
    ([last[0][0], last[1][0], last[1][1], last[2][0]], model)
}

#[test]
fn an_ensemble_decodes_functions_of_several_dimensions() {
    let expected = [-0.3, 0.6, -0.5, 0.61];
    let rate = PopulationPlan::rate();
    for (plan, within) in [(PopulationPlan::direct(), 1e-3), (rate, 0.03), (lif(), 0.06)] {
        let (found, _) = three_functions(&plan);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < within, "{found} instead of {expected}");
        }
    }
    // Functions of single components cannot stand for a product; the test would notice.
    assert!((0.6f32 - 0.5 - expected[0]).abs() > 0.3);
}

#[test]
fn an_ensemble_from_a_solved_model_has_the_same_bits() {
    let (found, model) = three_functions(&lif());
    assert_eq!(model.neurons(), 400);
    let read = SolvedModel::decode(&model.encode().unwrap()).unwrap();
    assert_eq!(three_functions(&lif().solved(read)).0.map(f32::to_bits), found.map(f32::to_bits));
}

#[test]
fn copies_of_an_ensemble_have_neurons_of_their_own() {
    for plan in [PopulationPlan::direct(), lif()] {
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(&[0.6, 0.5, -0.4, 0.8]));
        let pairs = Ensemble::new(2)
            .copies(2)
            .decode("product", 1, |x, out| out[0] = x[0] * x[1])
            .decode("swapped", 2, |x, out| (out[0], out[1]) = (x[1], x[0]));
        let pairs = graph.add("pairs", pairs);
        graph.route(&given >> &pairs);
        let filtered = ProbeSpec::default().filtered(Synapse::lowpass_ms(30));
        let product = graph.probe(&pairs.output("product"), filtered);
        let swapped = graph.probe(&pairs.output("swapped"), filtered);
        let sim = graph.run(&plan, Seed::new(4), ms(300)).unwrap();
        let found: Vec<f32> = [product, swapped]
            .iter()
            .flat_map(|probe| sim.samples(probe).last().unwrap().1.to_vec())
            .collect();
        let expected = [0.3, -0.32, 0.5, 0.6, 0.8, -0.4];
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 0.12, "{found} instead of {expected}");
        }
    }
}

#[test]
fn a_route_from_a_bare_layer_has_one_synapse() {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.5]));
    let bare = graph.add("bare", Ensemble::new(1).identity("x"));
    graph.route(&given >> &bare);
    let outs: Vec<_> = (0..5).map(|i| graph.add(&format!("out{i}"), Add::vector(1))).collect();
    let slow = Synapse::lowpass_ms(40);
    graph.connect(&bare.output("x"), &outs[0].input, slow);
    graph.route((&bare.output("x") >> &outs[1]).via(slow));
    graph.route((bare.output("x").slice(0..1) >> &outs[2]).via(slow));
    graph.connect(&bare.output("x"), &outs[3].input, Synapse::lowpass_ms(5));
    graph.route(&bare.output("x") >> &outs[4]);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(40)).unwrap();
    let found: Vec<f32> = outs.iter().map(|out| sim.value(&out.output)[0]).collect();
    assert!(found[0] > 0.2 && found[0] < 0.4, "{found:?}");
    assert_eq!((found[1], found[2], found[4]), (found[0], found[0], found[3]));
    assert!(found[3] > 0.49);
}

#[test]
fn a_bare_layer_beside_others_has_the_synapse_of_its_route_alone() {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.5]));
    let one = graph.add("one", Constant::scalar(1.0));
    let bare = graph.add("bare", Ensemble::new(1).identity("x"));
    graph.route(&given >> &bare);
    let outs: Vec<_> = (0..5).map(|i| graph.add(&format!("out{i}"), Add::vector(1))).collect();
    let slow = Synapse::lowpass_ms(40);
    let x = bare.output("x");
    for from in [&given, &x, &x] {
        graph.connect(from, &outs[0].input, slow);
    }
    let doubled = x.transform([[2.0]]);
    graph.route((&given + 2.0 * &x >> &outs[1]).via(slow));
    graph.route((&given + doubled.clone() >> &outs[2]).via(slow));
    let twice = &given + doubled.clone() + &given + doubled.clone();
    graph.route((0.5 * twice >> &outs[3]).via(slow));
    // A product needs the synapse in front of it too.
    graph.route((&given + &one * doubled >> &outs[4]).via(slow));
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(40)).unwrap();
    let found: Vec<f32> = outs.iter().map(|out| sim.value(&out.output)[0]).collect();
    assert!(found[0] > 0.7 && found[0] < 1.0, "{found:?}");
    assert!(found[1..4].iter().all(|value| (value - found[0]).abs() < 1e-6), "{found:?}");
    assert!(found[4] < found[0] - 0.02, "{found:?}");
}

#[test]
fn faults_of_maps_and_ensembles_say_what_is_expected() {
    let things = Things::vocabulary(64, Seed::new(1)).unwrap();
    struct Other;
    impl VocabTag for Other {
        const NAME: &'static str = "other";
    }
    let other = VocabularyBuilder::<Other>::new(64, Seed::new(1)).pointer("X").build().unwrap();
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", Constant::vector(&[1.0, 2.0]));
    let seen = graph.add("seen", things.stimulus([(0, "RED")]).unwrap());
    let [two, number] = ["two", "number"].map(|name| graph.add(name, Add::vector(2)));
    let one = graph.add("one", Add::scalar());
    let (state, word) =
        (graph.add("state", State::new(&things)), graph.add("x", State::new(&other)));
    graph.route(a.transform([[1.0, 2.0, 3.0]]) >> &two);
    graph.route(a.slice(1..4) >> &two);
    graph.route(a.component(2) >> &one);
    graph.route(&a + [1.0, 2.0, 3.0] >> &number);
    graph.route(a.reinterpret(&things) >> &state);
    graph.route(seen.translate(&other) >> &word);
    let nothing = graph.add("nothing", Ensemble::new(2));
    graph.route(&a >> &nothing);
    let nan = graph.add("nan", Ensemble::new(2).decode("root", 1, |x, out| out[0] = x[0].sqrt()));
    graph.route(&a >> &nan);
    graph.route(&nan.output("rot") >> &two);
    let built = graph.build(Timebase::default(), &lif(), Seed::new(1));
    let all = built.err().map(|error| format!("{error:#}")).unwrap_or_default();
    for expected in [
        "`transform(a.out) >> two`: row 0 of the matrix has 3 columns; expected 2, as many",
        "`a.out[1..4] >> two`: there are no components 1..4",
        "`a.out[2] >> one`: there is no component 2; expected 0 to 1",
        "a constant has 3 dimensions; expected 2, those of a vector of 2",
        "a value of 2 components; expected 64",
        "has no name in common with",
        "nothing is decoded; expected at least one function",
        "root: vector",
    ] {
        assert!(all.contains(expected), "{expected}\nis not in\n{all}");
    }
}

#[test]
fn a_function_that_is_not_finite_is_refused() {
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", Constant::vector(&[0.5]));
    let root = graph.add("root", Ensemble::new(1).decode("root", 1, |x, out| out[0] = x[0].sqrt()));
    graph.route(&a >> &root);
    let built = graph.build(Timebase::default(), &lif(), Seed::new(1));
    let text = built.err().map(|error| format!("{error:#}")).unwrap_or_default();
    assert!(text.contains("expected finite values within the radius"), "{text}");
}

#[test]
fn white_noise_behind_a_synapse_does_not_depend_on_the_tick() {
    let sd = |tick: SimDuration, white: bool| {
        let mut graph = GraphBuilder::new();
        let zero = graph.add("zero", Constant::vector(&[0.0; 200]));
        let noise = Noise::vector(200, 1.0);
        let noise = graph.add("noise", if white { noise.white() } else { noise });
        let out = graph.add("out", Add::vector(200));
        graph.route(&zero >> &noise);
        graph.route((&noise >> &out).via(Synapse::lowpass_ms(20)));
        let time = Timebase::new(tick).unwrap();
        let graph = graph.build(time, &PopulationPlan::direct(), Seed::new(1)).unwrap();
        let mut sim = Simulator::new(graph.into(), RunConfig::default()).unwrap();
        let mut square = 0.0;
        for _ in 0..10 {
            sim.run_for(ms(200)).unwrap();
            square += sim.value(&out.output).iter().map(|v| v * v).sum::<f32>() / 2_000.0;
        }
        square.sqrt()
    };
    let (coarse, fine) = (SimDuration::from_millis(2), SimDuration::from_micros(250));
    // 2,000 values: the ratio is off by 10% for one seed in 10,000.
    let ratio = sd(fine, true) / sd(coarse, true);
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    let plain = sd(fine, false) / sd(coarse, false);
    assert!((plain - 8f32.sqrt().recip()).abs() < 0.05, "noise that is not white: {plain}");
}

#[test]
fn a_sequence_steps_through_its_names_in_every_mode() {
    symbolt::vocabulary!(Steps = "steps": A, B, C, D);
    let steps = Steps::vocabulary(128, Seed::new(5)).unwrap();
    let rate = PopulationPlan::rate();
    for plan in [PopulationPlan::direct(), rate, lif()] {
        for repeated in [false, true] {
            let mut graph = GraphBuilder::new();
            let clock = Signal::scalar(|t| f32::from(u8::from(t % 0.2 >= 0.1)));
            let clock = graph.add("clock", clock);
            let sequence = Sequence::new(&steps, Steps::NAMES).unwrap();
            let sequence = if repeated { sequence.repeated() } else { sequence };
            let sequence = graph.add("sequence", sequence);
            graph.route(&clock >> &sequence.next);
            let probe = graph.probe(&sequence.output, ProbeSpec::default());
            let sim = graph.run(&plan, Seed::new(1), ms(1_000)).unwrap();
            let shown = steps.similarities(sim.samples(&probe), Steps::NAMES).unwrap();
            let at = |ms: u32| shown.best(f64::from(ms) / 1e3).map(|(name, _)| name).unwrap();
            let found: Vec<&str> = (0..5).map(|i| at(200 * i + 90)).collect();
            let last = if repeated { "A" } else { "D" };
            assert_eq!(found, ["A", "B", "C", "D", last]);
        }
    }
    let reason =
        |names: &[&str]| Sequence::new(&steps, names.iter().copied()).err().unwrap().to_string();
    assert!(reason(&["A", "B", "A"]).contains("`A`"));
    assert!(reason(&[]).contains("no names"));
    assert!(reason(&["A", "E"]).contains("A, B, C, D"));
}

#[test]
fn a_scalar_product_with_a_constant_has_a_linear_map() {
    let things = Things::vocabulary(64, Seed::new(2)).unwrap();
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", things.stimulus([(0, "RED")]).unwrap());
    let out = graph.add("out", Add::vector(2));
    let red = things.get("RED").unwrap();
    graph.route(a.dot(red).transform([[1.0], [-2.0]]) >> &out);
    // Numbers have a map, too.
    let number = graph.add("number", Add::vector(2));
    graph.route(0.5.transform([[1.0], [3.0]]) >> &number);
    // Owned pointers are operands like borrowed ones.
    let state = graph.add("state", State::new(&things));
    graph.route(things.parse("RED * BLUE").unwrap() * !things.parse("BLUE").unwrap() >> &state);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(50)).unwrap();
    let values = sim.value(&out.output);
    assert!((values[0] - 1.0).abs() < 1e-3 && (values[1] + 2.0).abs() < 1e-3, "{values:?}");
    assert_eq!(*sim.value(&number.output), [0.5, 1.5]);
    assert!(dot(&sim.value(&state.output), &red) > 0.5);
}

#[test]
fn rules_with_one_name_and_the_names_of_their_parts_are_refused_once() {
    let things = Things::vocabulary(64, Seed::new(2)).unwrap();
    let mut graph = GraphBuilder::new();
    let rule = |name| symbolt::spa::Rule::new(name, 0.5, []);
    let twice: Rules = ["red", "red", "choice", "blue"].map(rule).into_iter().collect();
    graph.add("rules", twice);
    graph.add("none", Rules::new());
    graph.add("ensemble", Ensemble::new(1).radius(-1.0).identity("out"));
    let one = graph.add("one", things.stimulus([(0, "RED")]).unwrap());
    let state = graph.add("state", State::new(&things));
    graph.route(&one >> &state);
    let built = graph.start(&lif(), Seed::new(1));
    let text = built.err().map(|error| format!("{error:#}")).unwrap_or_default();
    let faults: Vec<&str> = text.lines().skip(1).map(str::trim).collect();
    let expected = [
        "- `ensemble/neurons`: the radius is -1; expected a finite number above 0",
        "- `none`: there are no rules; expected at least one",
        "- `rules`: the rule `choice`: a part of every set of rules has this name; choose another name",
        "- `rules`: the rule `red`: another rule has this name; choose another name",
    ];
    for fault in expected {
        assert_eq!(faults.iter().filter(|own| **own == fault).count(), 1, "{fault}\nin\n{text}");
    }
    // Besides, the input of the ensemble is not connected.
    assert_eq!(faults.len(), expected.len() + 1, "{text}");
}

#[test]
fn what_a_function_does_not_write_is_zero_in_every_mode() {
    use symbolt::sim::Apply;
    let rate = PopulationPlan::rate();
    for plan in [PopulationPlan::direct(), rate, lif()] {
        let mut graph = GraphBuilder::new();
        let input = graph.add("input", Signal::scalar(|t| if t < 0.1 { 0.8 } else { -0.8 }));
        let positive = |x: &[f32], out: &mut [f32]| {
            if x[0] > 0.0 {
                out[0] += x[0];
            }
        };
        let ensemble = graph.add("ensemble", Ensemble::new(1).size(4.0).decode("f", 1, positive));
        let vector = graph.add("vector", Signal::vector(1, |_, out: &mut [f32]| out[0] += 1.0));
        let apply = Apply::new(
            symbolt::sim::InputSpec::scalar(),
            symbolt::sim::OutputSpec::scalar(),
            |_, out: &mut [f32]| out[0] += 1.0,
        );
        let apply = graph.add("apply", apply);
        graph.route(&input >> &apply);
        graph.route(input.transform([[1.0]]) >> &ensemble);
        let smooth = ProbeSpec::default().filtered(Synapse::lowpass_ms(10));
        let decoded = graph.probe(&ensemble.output("f"), smooth);
        let sim = graph.run(&plan, Seed::new(1), ms(200)).unwrap();
        let at = |ms: usize| sim.samples(&decoded).get(ms - 1).unwrap().1[0];
        assert!((at(100) - 0.8).abs() < 0.1 && at(200).abs() < 0.1, "{} {}", at(100), at(200));
        assert_eq!((sim.value(&vector)[0], sim.value(&apply.output)[0]), (1.0, 1.0));
    }
}

#[test]
fn one_of_several_inputs_is_a_target_and_huge_inputs_keep_their_direction() {
    let things = Things::vocabulary(64, Seed::new(2)).unwrap();
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", things.stimulus([(0, "RED")]).unwrap());
    let sum = graph.add("sum", symbolt::spa::Superpose::new(&things, &[1.0, 0.5]));
    graph.route(&a >> &sum.inputs[0]);
    graph.route(Things::BLUE >> &sum.inputs[1]);
    let state = graph.add("state", State::new(&things));
    graph.route(1e30 * &a >> &state);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(50)).unwrap();
    let red = things.get("RED").unwrap();
    assert!(dot(&sim.value(&sum.output), &red) > 0.9);
    assert!((dot(&sim.value(&state.output), &red) - 1.0).abs() < 1e-3);
}

#[test]
fn numbers_that_are_not_finite_and_parts_that_are_too_large_are_refused_with_the_expression() {
    let things = Things::vocabulary(64, Seed::new(2)).unwrap();
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", things.stimulus([(0, "RED")]).unwrap());
    let [state, other] = ["state", "other"].map(|name| graph.add(name, State::new(&things)));
    let [number, vector] = ["number", "vector"].map(|name| graph.add(name, Add::scalar()));
    graph.route(&a * (f32::NAN * Things::BLUE) >> &state);
    graph.route(&a >> &other);
    graph.route(a.dot(f32::INFINITY * Things::BLUE) >> &number);
    graph.route(a.slice(1..usize::MAX).component(0) >> &vector);
    for (name, ensemble) in [
        ("copies", Ensemble::new(1).identity("x").copies(usize::MAX)),
        ("dims", Ensemble::new(usize::MAX).identity("x")),
        ("width", Ensemble::new(1).decode("x", usize::MAX, |_, _| {})),
        ("name", Ensemble::new(1).identity("a,b")),
    ] {
        graph.add(name, ensemble);
    }
    let built = graph.start(&lif(), Seed::new(1));
    let text = built.err().map(|error| format!("{error:#}")).unwrap_or_default();
    for fault in [
        "`a.out * (NaN * BLUE) >> state`: a constant has the number NaN; expected finite numbers",
        "`dot(a.out, inf * BLUE) >> number`: a constant has the number",
        "there are no components 1..18446744073709551615; expected a range that is not empty, within 0..64",
        "18446744073709551615 copies of 1 dimensions with 1 decoded components are too large",
        "1 copies of 18446744073709551615 dimensions",
        "1 copies of 1 dimensions with 18446744073709551615 decoded components are too large",
        "`a,b` is not a valid name of a function",
    ] {
        assert!(text.contains(fault), "{fault}\nis not in\n{text}");
    }
}

#[test]
fn values_are_refused_or_read_back_from_their_text() {
    let things = Things::vocabulary(64, Seed::new(2)).unwrap();
    let refused = |flow: Flow<Pointer<Things>>| things.value(flow).err().unwrap().to_string();
    for flow in [f32::NAN * Things::RED, 1e30 * (1e30 * Things::RED)] {
        let text = refused(flow);
        assert!(text.contains("finite") && text.matches("RED").count() <= 1, "{text}");
    }
    assert!(things.list("3 * RED", vec!["BLUE"; 200]).is_err());
    // What `value` and `describe` write, `parse` reads.
    let value = things.value(Things::RED * !(Things::BLUE - 0.5 * Things::CIRCLE)).unwrap();
    let again = things.parse(value.expression()).unwrap();
    assert!(cosine(&value, &again) > 0.9999, "{}", value.expression());
    let sum = things.parse("0.8 RED - 0.3 * BLUE").unwrap();
    let again = things.parse(&things.describe(&sum, 0.2)).unwrap();
    assert!(cosine(&sum, &again) > 0.98);
    let vtb = VocabularyBuilder::<Things>::new(64, Seed::new(1))
        .algebra(symbolt::spa::Vtb)
        .any_similarity()
        .pointers(["RED", "BLUE", "CIRCLE"])
        .build()
        .unwrap();
    let nested = vtb.value(Things::RED * (Things::BLUE * Things::CIRCLE)).unwrap();
    assert_eq!(nested.expression(), "RED * (BLUE * CIRCLE)");
    assert!(cosine(&nested, &vtb.parse(nested.expression()).unwrap()) > 0.9999);
    let books = [["RED", "BLUE"], ["CIRCLE", "BLUE"]];
    let network = symbolt::spa::ResonatorNetwork::new(&vtb, books).err().unwrap().to_string();
    assert!(network.contains("the binding of VTB does not commute"), "{network}");
}

#[test]
fn a_number_flows_into_an_ensemble_of_one_dimension_and_outputs_need_no_ampersand() {
    let mut graph = GraphBuilder::new();
    let half = graph.add("half", Constant::scalar(0.5));
    let a = graph.add(
        "a",
        Ensemble::new(1).identity("x").decode("square", 1, |x, out| out[0] = x[0] * x[0]),
    );
    let b = graph.add("b", Ensemble::new(1).identity("x"));
    let sum = graph.add("sum", Add::scalar());
    graph.route(&half >> &a);
    graph.route(a.output("square") >> &b);
    graph.route(2.0 * a.output("x").component(0) + 1.0 >> &sum);
    // The sum of a number and an output of an ensemble, both by value.
    let c = graph.add("c", Ensemble::new(1).identity("x"));
    graph.route(a.output("x") + b.output("x") >> c.input.clone());
    let d = graph.add("d", Ensemble::new(1).identity("x"));
    graph.route(&half * &half + 0.25 >> &d);
    graph.route((0.125 * &half >> &d).via(Synapse::lowpass_ms(5)));
    // An output is an operand and its methods leave it where it is.
    let x = b.output("x");
    let [first, second] = ["first", "second"].map(|name| graph.add(name, Add::scalar()));
    graph.route(x.component(0) >> &first);
    graph.route(x.component(0) >> &second);
    let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1)).unwrap();
    sim.run_for(SimDuration::from_millis(100)).unwrap();
    let near = |out: &[f32], expected: f32| {
        assert!((out[0] - expected).abs() < 1e-4, "{out:?} {expected}")
    };
    near(sim.value(&a.output("x")), 0.5);
    near(sim.value(&b.output("x")), 0.25);
    near(sim.value(&c.output("x")), 0.75);
    near(sim.value(&d.output("x")), 0.5625);
    near(sim.value(&sum.output), 2.0);
    near(sim.value(&second.output), 0.25);
}

#[test]
fn a_number_into_a_wider_vector_is_told_with_both_ports() {
    let mut graph = GraphBuilder::new();
    let half = graph.add("half", Constant::scalar(0.5));
    let three = graph.add("three", Ensemble::new(3).identity("x"));
    let pair = graph.add("pair", Add::vector(2));
    graph.route(&half >> &three);
    graph.route(2.0 * &half >> &pair);
    let error = graph
        .build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))
        .expect_err("widths");
    let texts: Vec<String> = error.0.iter().map(ToString::to_string).collect();
    assert!(
        texts
            .iter()
            .any(|t| t.starts_with("`half.out` has width 1 but `three.input` takes width 3")),
        "{texts:?}"
    );
    assert!(
        texts
            .iter()
            .any(|t| t
                .contains("`to.pair.input/sum.output` has width 1 but `pair.input` takes width 2")),
        "{texts:?}"
    );
}
