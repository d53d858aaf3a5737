//! States, bindings and expressions.

use symbolt::neurons::Ensemble;
use symbolt::prelude::*;
use symbolt::sim::{Apply, InputSpec, OutputSpec, Real, Signal};
use symbolt::spa::{Bind, Compare, Hrr, Tvtb, Unbind, Vtb};

use super::{Others, Words, like, mean, run, smooth, words};

#[test]
fn a_state_follows_its_input_and_forgets_it() {
    let v = words::<Words>(32, 1, &["A", "B"]);
    let mut graph = GraphBuilder::new();
    let shown = graph.add("shown", v.stimulus([(0, "A"), (300, "B"), (600, "0")]).expect("sound"));
    let state = graph.add("state", State::new(&v));
    graph.route(&shown >> &state);
    let probe = graph.probe(&state.output, smooth(50));
    let sim = run(&graph, 900);
    let of = |at: usize| ["A", "B"].map(|name| like(&v, &sim, &probe, name, (at - 10, at)));
    let (a, b, none) = (of(300), of(600), of(900));
    assert!(a[0] > 0.9 && a[1] < 0.2, "{a:?}");
    assert!(b[1] > 0.9 && b[0] < 0.2, "{b:?}");
    assert!(none.iter().all(|found| found.abs() < 0.2), "{none:?}");
}

#[test]
fn a_recurrent_state_remembers_and_a_leaky_one_decays() {
    let v = words::<Words>(32, 1, &["A", "B"]);
    let mut graph = GraphBuilder::new();
    let shown = graph.add("shown", v.stimulus([(0, "A"), (50, "0")]).expect("sound"));
    let fast = Synapse::lowpass_ms(10);
    let memory = graph.add("memory", State::new(&v).recurrent(fast));
    let leaky = graph.add("leaky", State::new(&v).recurrent(fast).retention(0.8));
    graph.route(&shown >> &memory);
    graph.route(&shown >> &leaky);
    let probes = [&memory, &leaky].map(|state| graph.probe(&state.output, smooth(30)));
    let sim = run(&graph, 500);
    let of = |probe, when| like(&v, &sim, probe, "A", when);
    let held = |when| of(&probes[0], when);
    let leaks = |when| of(&probes[1], when);
    let (peak, later, last) = (held((50, 100)), held((200, 300)), held((490, 500)));
    assert!(peak > 0.85 && later > 0.7 && last > 0.5, "{peak} {later} {last}");
    let (full, gone) = (leaks((45, 55)), leaks((290, 300)));
    assert!(full > 0.75 && gone < 0.4, "{full} {gone}");
}

#[test]
fn two_states_are_bound_and_unbound() {
    let v = words::<Words>(64, 1, &["A", "B"]);
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", v.stimulus([(0, "A"), (150, "B")]).expect("sound"));
    let b = graph.add("b", v.stimulus([(0, "B")]).expect("sound"));
    let bind = graph.add("bind", Bind::new(&v));
    let unbind = graph.add("unbind", Unbind::new(&v));
    graph.route(&a >> &bind.a);
    graph.route(&b >> &bind.b);
    graph.route(&bind.output >> &unbind.bound);
    graph.route(&b >> &unbind.role);
    let probes = [&bind.output, &unbind.output].map(|out| graph.probe(out, smooth(30)));
    let sim = run(&graph, 300);
    let of = |probe: usize, at: usize, text: &str| {
        let value = sim.samples(&probes[probe]).get(at).expect("there").1;
        cosine(&value, &v.parse(text).expect("sound"))
    };
    assert!(of(0, 148, "A * B") > 0.9 && of(0, 148, "B * B") < 0.4);
    assert!(of(0, 298, "B * B") > 0.9 && of(0, 298, "A * B") < 0.4);
    assert!(of(1, 148, "A * B * ~B") > 0.85 && of(1, 148, "A") > 0.6);
    assert!(of(1, 298, "B") > 0.6 && of(1, 298, "A") < 0.4);
}

#[test]
fn two_states_are_compared() {
    let v = words::<Words>(16, 1, &["A", "B"]);
    let mut graph = GraphBuilder::new();
    let shown = graph.add("shown", v.stimulus([(0, "A"), (100, "B")]).expect("sound"));
    let compare = graph.add("compare", Compare::new(&v));
    graph.route(&shown >> &compare.a);
    graph.route(Words::A >> &compare.b);
    let probe = graph.probe(&compare.output, smooth(30));
    let sim = run(&graph, 250);
    let at = |at: usize| sim.samples(&probe).get(at).expect("there").1[0];
    assert!(at(100) > 0.8 && at(249) < 0.2, "{} {}", at(100), at(249));
}

#[test]
fn functions_encode_and_decode_pointers() {
    let v = words::<Words>(16, 1, &["A"]);
    let a = v.get("A").expect("there").to_vec();
    let mut graph = GraphBuilder::new();
    let switch = graph.add("switch", Signal::scalar(|t| if t > 0.2 { 1.0 } else { 0.0 }));
    let scaled = a.clone();
    let encode = move |x: &[Real], out: &mut [Real]| {
        out.iter_mut().zip(&scaled).for_each(|(out, a)| *out = x[0] * a);
    };
    let encode = Apply::new(InputSpec::scalar(), OutputSpec::pointer(v.space()), encode);
    let encode = graph.add("encode", encode);
    let state = graph.add("state", State::new(&v));
    let decode = move |x: &[Real], out: &mut [Real]| out[0] = symbolt::spa::dot(x, &a);
    let decode = Apply::new(InputSpec::pointer(v.space()), OutputSpec::vector(1), decode);
    let decode = graph.add("decode", decode);
    graph.route(&switch >> &encode);
    graph.route(&encode >> &state);
    graph.route(&state >> &decode);
    let probe = graph.probe(&decode.output, smooth(30));
    let sim = run(&graph, 400);
    assert!(mean(&sim, &probe, (100, 200))[0].abs() < 0.1);
    assert!((mean(&sim, &probe, (380, 400))[0] - 1.0).abs() < 0.1);
}

#[test]
fn pointers_are_translated_and_reinterpreted() {
    let v = words::<Words>(64, 1, &["A", "B"]);
    let same = words::<Others>(64, 7, &["A", "B"]);
    let small = words::<Others>(32, 7, &["A", "B"]);
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", State::new(&v));
    graph.route(Words::A >> &a);
    let read = graph.add("read", State::new(&same));
    graph.route(a.reinterpret(&same) >> &read);
    let translated = graph.add("translated", State::new(&small));
    graph.route(a.translate(&small) >> &translated);
    let probes = [&read, &translated].map(|state| graph.probe(&state.output, smooth(30)));
    let sim = run(&graph, 400);
    let read = sim.samples(&probes[0]).last().expect("there").1;
    let as_it_was =
        cosine(&read, &symbolt::sim::PointerRef::from_raw(v.get("A").unwrap().values()));
    assert!(as_it_was > 0.9 && cosine(&read, &same.get("A").expect("there")) < 0.4, "{as_it_was}");
    let found = ["A", "B"].map(|name| like(&small, &sim, &probes[1], name, (200, 400)));
    assert!(found[0] > 0.8 && found[1] < 0.4, "{found:?}");
}

#[test]
fn an_expression_over_modules_is_that_over_pointers() {
    let of = |v: Vocabulary<Words>| {
        let mut graph = GraphBuilder::new();
        let [a, b] = ["a", "b"].map(|name| graph.add(name, State::new(&v)));
        let out = graph.add("out", State::new(&v));
        graph.route(Words::A >> &a);
        graph.route(Words::B >> &b);
        let left = 0.5 * Words::C * &a + 0.5 * Words::D;
        graph.route(left * (0.5 * &b + &a * 0.5) >> &out);
        let undone = graph.add("undone", State::new(&v));
        graph.route(&a * &b * !&b >> &undone);
        let probes = [&out, &undone].map(|state| graph.probe(&state.output, smooth(30)));
        let sim = run(&graph, 400);
        let texts = ["(0.5 * C * A + 0.5 * D) * (0.5 * B + 0.5 * A)", "A * B * ~B"];
        for (probe, text) in probes.iter().zip(texts) {
            let found = sim.samples(probe).last().expect("there").1;
            let similar = cosine(&found, &v.parse(text).expect("sound"));
            assert!(similar > 0.85, "{} {text}: {similar}", v.algebra().name());
        }
        let back = sim.samples(&probes[1]).last().expect("there").1;
        assert!(cosine(&back, &v.get("A").expect("there")) > 0.5);
    };
    let new = || {
        let builder = VocabularyBuilder::<Words>::new(64, Seed::new(1)).or_best_of(200);
        builder.pointers(["A", "B", "C", "D"])
    };
    of(new().algebra(Hrr).build().expect("sound"));
    of(new().algebra(Vtb).build().expect("sound"));
}

#[test]
fn the_product_of_two_matrices_is_bound_and_unbound_on_either_side() {
    let builder = VocabularyBuilder::<Words>::new(64, Seed::new(1)).or_best_of(200);
    let v = builder.pointers(["A", "B"]).algebra(Tvtb).build().expect("sound");
    let mut graph = GraphBuilder::new();
    let [a, b] = ["A", "B"].map(|name| {
        let state = graph.add(&name.to_lowercase(), State::new(&v));
        let given = v.get(name).expect("there");
        let given = graph.add(&format!("{name}-given"), Constant::pointer(v.space(), &given));
        graph.route(&given >> &state);
        state
    });
    let [bound, left, right] =
        ["bound", "left", "right"].map(|name| graph.add(name, State::new(&v)));
    graph.route(&a * &b >> &bound);
    graph.route(!&a * &bound >> &left);
    graph.route(&bound * !&b >> &right);
    let probes = [&bound, &left, &right].map(|s| graph.probe(&s.output, smooth(30)));
    let sim = run(&graph, 400);
    for (probe, text) in probes.iter().zip(["A * B", "~A * A * B", "A * B * ~B"]) {
        let found = sim.samples(probe).last().expect("there").1;
        let similar = cosine(&found, &v.parse(text).expect("sound"));
        assert!(similar > 0.8, "{text}: {similar}");
        // Not what the other order binds to.
        assert!(cosine(&found, &v.parse("B * A").expect("sound")) < 0.6, "{text}");
    }
    for (probe, name) in [(&probes[1], "B"), (&probes[2], "A")] {
        let found = sim.samples(probe).last().expect("there").1;
        assert!(cosine(&found, &v.get(name).expect("there")) > 0.5, "{name}");
    }
}

#[test]
fn numbers_and_pointers_are_added_and_multiplied() {
    let v = words::<Words>(32, 1, &["A", "B"]);
    let mut graph = GraphBuilder::new();
    let [a, b] = [("a", 0.6), ("b", 0.4)].map(|(name, value)| {
        let number = graph.add(name, Ensemble::new(1).neurons(100).identity("x"));
        let given = graph.add(&format!("{name}-given"), Constant::vector(&[value]));
        graph.route(&given >> &number.input);
        let read = graph.add(&format!("{name}-read"), Add::scalar());
        graph.route((number.output("x").component(0) >> &read).via(Synapse::lowpass_ms(5)));
        read
    });
    let state = graph.add("state", State::new(&v));
    graph.route(Words::A >> &state);
    let numbers = graph.add("numbers", Add::vector(5));
    let all =
        [&a + &b, &a * &b, -&a, state.dot(Words::A) - 0.5 * state.dot(Words::B), state.dot(&state)];
    for (at, number) in all.into_iter().enumerate() {
        graph.route(number.embed(at, 5) >> &numbers);
    }
    let weighed = graph.add("weighed", State::new(&v));
    graph.route(&a * Words::B + 0.5 * Words::A >> &weighed);
    let probe = graph.probe(&numbers.output, smooth(30));
    let pointer = graph.probe(&weighed.output, smooth(30));
    let sim = run(&graph, 300);
    let found = mean(&sim, &probe, (200, 300));
    let [aa, ab] = ["A", "B"].map(|name| dot(&v.get("A").unwrap(), &v.get(name).unwrap()));
    let wanted = [1.0, 0.24, -0.6, aa - 0.5 * ab, 1.0];
    let off = found.iter().zip(wanted).map(|(f, w)| (f - w).abs()).fold(0.0, Real::max);
    assert!(off < 0.15, "{found:?} instead of {wanted:?}");
    let text = ["A", "B"].map(|name| like(&v, &sim, &pointer, name, (200, 300)));
    assert!((text[0] - 0.5 - 0.6 * ab).abs() < 0.1 && (text[1] - 0.6 - 0.5 * ab).abs() < 0.1);
}
