//! Values beyond the radius of neurons, where exact maths has no limit, are counted.

use std::sync::Arc;

use symbolt::neurons::{
    LayerSaturation, Layers, Population, PopulationPlan, Product, Represent, Saturation, Select,
    SelectRule,
};
use symbolt::sim::{
    Constant, GraphBuilder, In, InputSpec, Module, OutputSpec, PointerRef, Ports, Real, RunConfig,
    Scope, Seed, SimDuration, SimView, Simulator, Synapse, Timebase, Vector, VocabTag,
};

use symbolt::prelude::*;
use symbolt::spa::{Gate, Selection, State, VocabularyBuilder};

use crate::things::{lif, rate};

struct Words;
impl VocabTag for Words {
    const NAME: &'static str = "words";
}

/// Three products, a choice of two and a represented vector of three.
struct All;

impl Module for All {
    type Ports = [In<Vector>; 4];

    fn expand(self, scope: &mut Scope<'_>) -> Self::Ports {
        let products = scope.product("products", Product::new(3));
        let rule = SelectRule::WinnerTakeAll { level: 0.5 };
        let choice = scope.select("choice", Select::new(2, rule));
        let (three, out) = (InputSpec::vector(3), OutputSpec::vector(3));
        let held = Represent::new::<Vector>(three, out, 1.0);
        let held: Ports<Vector> = scope.represent("held", held);
        [products.a, products.b, held.input, choice.input]
    }
}

/// What ten looks counted, by layer.
fn looks(plan: &PopulationPlan, factor: Real, utility: Real) -> Vec<LayerSaturation> {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[factor, 0.1, factor]));
    let utilities = graph.add("utilities", Constant::vector(&[utility, -3.0]));
    let [a, b, held, choice] = graph.add("all", All);
    for port in [&a, &b, &held] {
        graph.connect(&given, port, Synapse::None);
    }
    graph.connect(&utilities, &choice, Synapse::None);
    let graph = graph.build(Timebase::default(), plan, Seed::new(3)).expect("builds");
    let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).expect("starts");
    let mut saturation = Saturation::default();
    for _ in 0..10 {
        sim.run_for(SimDuration::from_millis(10)).expect("runs");
        saturation.look(&SimView::of(&sim));
    }
    saturation.layers().cloned().collect()
}

#[test]
fn a_saturation_that_exact_maths_has_not_is_counted_by_layer() {
    for plan in [lif(), rate()] {
        let [choice, products] = &looks(&plan, 1.5, 2.4)[..] else { panic!("two layers") };
        // Half the sums are 1.5, 0.1 and 1.5, half the differences 0. The radius of a choice is its level and 0.7.
        assert_eq!((products.path.as_str(), choice.path.as_str()), ("all/products", "all/choice"));
        assert_eq!((products.looked, products.beyond, products.radius), (60, 20, 1.0));
        assert!((products.greatest - 1.5).abs() < 1e-6, "{products}");
        assert!((choice.radius - 1.2).abs() < 1e-6, "{choice}");
        assert_eq!((choice.looked, choice.beyond), (20, 10));
        assert!((choice.greatest - 2.0).abs() < 1e-6, "{choice}");
        assert!((products.share() - 1.0 / 3.0).abs() < 1e-9);
        let said = products.to_string();
        assert_eq!(
            said,
            "all/products: 33.3% of the values lie a fifth or more beyond the radius of 1, the greatest 1.5 times as far"
        );
    }
    let within = looks(&lif(), 1.1, 1.0);
    assert_eq!(within.len(), 2);
    assert!(within.iter().all(|layer| layer.looked > 0 && layer.beyond == 0), "{within:?}");
    let exact = looks(&PopulationPlan::all(Population::Direct), 1.5, 2.4);
    assert_eq!(exact, [], "exact maths has no ensembles");
}

/// What is counted of a choice by a rule, for utilities of 5 and 0.
fn counted_of(rule: SelectRule) -> usize {
    let mut graph = GraphBuilder::new();
    let utilities = graph.add("utilities", Constant::vector(&[5.0, 0.0]));
    let choice = graph.add("choice", Selection::new(2, rule));
    graph.connect(&utilities, &choice.utilities, Synapse::None);
    let mut sim = graph.start(&lif(), Seed::new(3)).expect("starts");
    sim.run_for(SimDuration::from_millis(10)).expect("runs");
    let mut saturation = Saturation::default();
    saturation.look(&SimView::of(&sim));
    saturation.layers().filter(|layer| layer.beyond == 1).count()
}

#[test]
fn choices_whose_exact_form_is_limited_too_are_not_counted() {
    let (level, tau) = (0.5, SimDuration::from_millis(100));
    assert_eq!(counted_of(SelectRule::Threshold { level }), 0);
    assert_eq!(counted_of(SelectRule::IndependentAccumulators { level, tau }), 0);
    assert_eq!(counted_of(SelectRule::Graded { level }), 1);
    assert_eq!(counted_of(SelectRule::WinnerTakeAll { level }), 1);
}

#[test]
fn pointers_with_their_norm_in_one_component_are_counted_and_random_ones_are_not() {
    let words =
        VocabularyBuilder::<Words>::new(64, Seed::new(7)).pointers(["A"]).build().expect("drawn");
    let mut axis = vec![0.0; 64];
    axis[0] = 1.0;
    for (shown, beyond) in [(words.get("A").expect("a word").values().to_vec(), 0), (axis, 2)] {
        let mut graph = GraphBuilder::new();
        let given = graph
            .add("given", Constant::pointer(words.space(), &PointerRef::<Words>::from_raw(&shown)));
        let open = graph.add("open", Constant::scalar(1.0));
        let state = graph.add("state", State::new(&words));
        let gate = graph.add("gate", Gate::new(&words));
        graph.route(&given >> &state);
        graph.route(&given >> &gate);
        graph.route(&open >> &gate.open);
        let mut sim = graph.start(&lif(), Seed::new(3)).expect("starts");
        let mut saturation = Saturation::default();
        for _ in 0..10 {
            sim.run_for(SimDuration::from_millis(50)).expect("runs");
            saturation.look(&SimView::of(&sim));
        }
        let share = |layer: &&LayerSaturation| layer.share() > 0.015;
        let found: Vec<String> =
            saturation.layers().filter(share).map(ToString::to_string).collect();
        assert_eq!(found.len(), beyond, "{found:#?}");
    }
}
