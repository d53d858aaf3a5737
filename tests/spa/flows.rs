//! Expressions of outputs, the rules that route them, and the nodes that they become.

#![allow(clippy::unwrap_used)]

use symbolt::neurons::PopulationPlan;
use symbolt::sim::{
    Constant, GraphBuilder, RunConfig, Seed, SimDuration, Simulator, Timebase, VocabTag,
};
use symbolt::spa::{
    FlowExt, Hrr, Routes, Rules, State, Vocabulary, VocabularyBuilder, Vtb, cosine, dot,
};

struct Things;

impl VocabTag for Things {
    const NAME: &'static str = "things";
}

fn things() -> Vocabulary<Things> {
    let names = ["A", "B", "C", "ROLE"];
    VocabularyBuilder::new(128, Seed::new(3)).pointers(names).build().unwrap()
}

fn run(graph: GraphBuilder, plan: &PopulationPlan, ms: u64) -> Simulator {
    let graph = graph.build(Timebase::default(), plan, Seed::new(1)).unwrap();
    let mut sim = Simulator::new(graph.into(), RunConfig::default()).unwrap();
    sim.run_for(SimDuration::from_millis(ms)).unwrap();
    sim
}

#[test]
fn an_expression_has_the_value_that_the_algebra_computes() {
    let of = |dim| VocabularyBuilder::new(dim, Seed::new(3));
    for builder in [of(128).algebra(Hrr), of(121).algebra(Vtb)] {
        let things: Vocabulary<Things> =
            builder.max_similarity(0.3).pointers(["A", "B", "C", "ROLE"]).build().unwrap();
        let product = dot(&things.get("A").unwrap(), &things.get("B").unwrap());
        let cases = [
            "A * B + 0.5 * (C * ~ROLE)".to_owned(),
            "(A - B) * ROLE".to_owned(),
            "ROLE * (A - B)".to_owned(),
            "~(A * ROLE)".to_owned(),
            if product < 0.0 {
                format!("B - {} * C", -product)
            } else {
                format!("{product} * C + B")
            },
        ];
        let mut graph = GraphBuilder::new();
        let a = graph.add("a", Constant::pointer(things.space(), &things.get("A").unwrap()));
        let b = graph.add("b", Constant::pointer(things.space(), &things.get("B").unwrap()));
        let (c, role) = (things.get("C").unwrap(), things.get("ROLE").unwrap());
        let outs: Vec<_> = (0..cases.len())
            .map(|i| graph.add(&format!("out{i}"), State::new(&things).radius(4.0)))
            .collect();
        graph.route(&a * &b + 0.5 * (c * !role) >> &outs[0]);
        graph.route((&a - &b) * role >> &outs[1]);
        graph.route(role * (&a - &b) >> &outs[2]);
        graph.route(!(&a * role) >> &outs[3]);
        graph.route(a.dot(&b) * c + a.dot(&a) * &b >> &outs[4]);
        let sim = run(graph, &PopulationPlan::direct(), 100);
        for (out, text) in outs.iter().zip(&cases) {
            let expected = things.parse(text).unwrap();
            let found = sim.value(&out.output);
            let off = found.iter().zip(&*expected).map(|(f, e)| (f - e).abs()).fold(0.0, f32::max);
            assert!(off < 1e-3, "{text} at D = {}: {off}", things.dim());
        }
    }
}

#[test]
fn neurons_bind_by_vector_derived_transformations() {
    let things: Vocabulary<Things> = VocabularyBuilder::new(64, Seed::new(3))
        .algebra(Vtb)
        .any_similarity()
        .pointers(["A", "B"])
        .build()
        .unwrap();
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", Constant::pointer(things.space(), &things.get("A").unwrap()));
    let b = graph.add("b", Constant::pointer(things.space(), &things.get("B").unwrap()));
    let out = graph.add("out", State::new(&things));
    graph.route(&a * &b >> &out);
    let sim = run(graph, &PopulationPlan::lif(), 200);
    let similarity = cosine(&sim.value(&out.output), &things.parse("A * B").unwrap());
    assert!(similarity > 0.85, "{similarity}");
}

#[test]
fn rules_route_what_the_chosen_rule_says() {
    let things = things();
    let (a, b) = (things.get("A").unwrap(), things.get("B").unwrap());
    for (plan, least) in [(PopulationPlan::direct(), 0.9), (PopulationPlan::lif(), 0.5)] {
        let mut graph = GraphBuilder::new();
        let seen = graph.add("seen", Constant::pointer(things.space(), &a));
        let (first, second) =
            (graph.add("first", State::new(&things)), graph.add("second", State::new(&things)));
        let rules = Rules::new()
            .rule("a", seen.dot(a), [&seen >> &first, b >> &second])
            .rule("b", seen.dot(b), [&seen >> &second])
            .otherwise("wait", 0.4, []);
        let rules = graph.add("rules", rules);
        let sim = run(graph, &plan, 300);
        assert!(cosine(&sim.value(&first.output), &a) > least);
        assert!(cosine(&sim.value(&second.output), &b) > least);
        assert_eq!(rules.position("b"), Some(1));
        let chosen = sim.value(&rules.chosen);
        assert!(chosen[0] > 0.7 && chosen[1] < 0.2 && chosen[2] < 0.2, "{chosen:?}");
    }
}

#[test]
fn nodes_have_stable_paths_and_a_route_reads_as_it_was_written() {
    let things = things();
    let mut graph = GraphBuilder::new();
    let (a, b) = (graph.add("a", State::new(&things)), graph.add("b", State::new(&things)));
    let c = graph.add("c", State::new(&things));
    let route = &a * &b - 2.0 * (&a + !&b) >> &c;
    assert_eq!(route.text(), "a * b - 2 * (a + !b) >> c");
    graph.route(route);
    graph.route(&a * !things.get("ROLE").unwrap() >> &c);
    graph.route((&b * &a >> &c).named("last"));
    graph.route(&a >> &b);
    graph.route(&b >> &a);
    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1)).unwrap();
    let paths: Vec<&str> = graph.paths().collect();
    for path in [
        "to.c.input/bind/products",
        "to.c.input/inverse",
        "to.c.input/sum",
        "to.c.input-2/bind",
        "last/bind/back",
    ] {
        assert!(paths.contains(&path), "{path} of {paths:?}");
    }
}

#[test]
fn faults_quote_the_expression() {
    let things = things();
    let short = VocabularyBuilder::<Things>::new(64, Seed::new(3)).pointer("A").build().unwrap();
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", State::new(&things));
    graph.route(&a * short.get("A").unwrap() >> &a);
    let (x, y) = (things.get("A").unwrap(), things.get("B").unwrap());
    graph.route(x.dot(y) * &a >> &a);
    let built = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
    let text = built.err().map(|e| e.to_string()).unwrap_or_default();
    assert!(
        text.contains("`a * pointer >> a`: a constant has 64 dimensions; expected 128"),
        "{text}"
    );
    assert!(
        text.contains("`dot(pointer, pointer) * a >> a`: the scalar product of two constants"),
        "{text}"
    );
}
