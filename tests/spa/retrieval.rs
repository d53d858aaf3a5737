//! Retrieval by two conditions: exact methods against their closed forms, and small networks of one neuron an item.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::sync::Arc;

use symbolt::neurons::{LifSpec, Population, PopulationPlan, Tuning};
use symbolt::prelude::*;
use symbolt::spa::{FactoredItems, FactoredSimilarity, JointMemory, Linear};
use symbolt::study::retrieval::{
    Method, Network, NetworkSpec, Reach, Roles, Score, Symbols, World, WorldSpec, exact, predicted,
};

/// A world of a fiftieth of the size, in which a query has about as many matches and half matches.
fn small(each: f64) -> WorldSpec {
    WorldSpec { places: 30, goals: 60, objects: 500, each, actions: 300, effects: 60 }
}

struct Parts;
impl VocabTag for Parts {
    const NAME: &'static str = "parts";
}

#[test]
fn a_tight_frame_of_bound_pointers_disturbs_less_than_random_pointers() {
    let names = |kind: char, count| (0..count).map(move |i| format!("{kind}{i}"));
    let build = |framed: bool| {
        let start = VocabularyBuilder::<Parts>::new(64, Seed::new(2)).any_similarity();
        let start = start.unitary("LOCATION").unitary("GOAL");
        let built = match framed {
            true => start.bound_frame([("LOCATION", names('P', 60)), ("GOAL", names('G', 90))]),
            false => start.pointers(names('P', 60)).pointers(names('G', 90)),
        };
        built.build().expect("sound")
    };
    // Mean square of the similarities of all bound pointers.
    let crosstalk = |vocabulary: &symbolt::spa::Vocabulary<Parts>| {
        let of = |role: &str, kind, count| {
            let all: Vec<_> = names(kind, count)
                .map(|name| vocabulary.parse(&format!("{name} * {role}")).expect("sound").to_vec())
                .collect();
            all
        };
        let all = [of("LOCATION", 'P', 60), of("GOAL", 'G', 90)].concat();
        let mut sum = 0.0;
        for (i, a) in all.iter().enumerate() {
            for b in &all[..i] {
                sum += f64::from(symbolt::spa::dot(a, b)).powi(2);
            }
        }
        sum / (150.0 * 149.0 / 2.0)
    };
    let (framed, random) = (crosstalk(&build(true)), crosstalk(&build(false)));
    // (N / D - 1) / (N - 1), the bound of Welch, and 1 / D.
    assert!((framed - (150.0 / 64.0 - 1.0) / 149.0).abs() < 1e-5, "{framed}");
    assert!((random - 1.0 / 64.0).abs() < 2e-3, "{random}");
    let start = VocabularyBuilder::<Parts>::new(64, Seed::new(2)).pointer("ROLE");
    let refused = start.bound_frame([("ROLE", names('P', 3))]).build().err();
    let refused = refused.map(|error| error.to_string()).unwrap_or_default();
    assert!(refused.contains("`ROLE`") && refused.contains("unitary"), "{refused}");
}

#[test]
fn exact_methods_agree_with_their_closed_forms() {
    let spec = WorldSpec { objects: 4_000, ..small(5.0) };
    let world = World::draw(&spec, Seed::new(5));
    let queries = world.queries(150, Seed::new(5));
    let methods = [
        Method::Sum(Roles::Gaussian),
        Method::Sum(Roles::Unitary),
        Method::Joint { roles: Roles::Unitary, level: 0.65, noise: 0.0 },
        Method::Joint { roles: Roles::Unitary, level: 0.65, noise: 0.03 },
    ];
    let mut found = Vec::new();
    for method in methods {
        let score = exact(&world, 256, method, [&queries, &[]], Seed::new(5)).expect("runs");
        assert!(score.objects.matches > 5_000);
        let (precision, recall) = (score.objects.precision(), score.objects.recall());
        let closed = predicted(&spec, 256, method);
        // Thousands of objects, correlated within 90 atoms.
        assert!((recall - closed.recall).abs() < 0.04, "{method:?}: {recall} {closed:?}");
        found.push((precision, closed.precision));
    }
    // The threshold on the sum counts all matches in its precision: found ones alone make it a little smaller.
    for ((precision, closed), method) in found.iter().zip(methods) {
        assert!((precision - closed).abs() < 0.1, "{method:?}: {precision} {closed}");
    }
    assert!(found[0].0 < found[1].0 && found[1].0 < found[2].0, "{found:?}");
}

#[test]
fn a_memory_that_lost_a_property_of_an_object_is_found_out() {
    let world = World::draw(&small(4.0), Seed::new(3));
    let symbols = Symbols::draw(&world, 128, Roles::Frame, Seed::new(3)).expect("draws");
    let objects = symbols.objects(&world).expect("sound");
    let mut wrong = world.clone();
    let lost = wrong.objects.iter().position(|own| own[0].contains(&0)).expect("one");
    wrong.objects[lost][0].retain(|place| *place != 0);
    let other = symbols.objects(&wrong).expect("sound");
    let query = symbols.vocabulary.parse("P0 * LOCATION + G0 * GOAL").expect("sound");
    let dense: Vec<f32> =
        (0..objects.len()).map(|i| symbolt::spa::dot(&objects.item(i), &query)).collect();
    let mut values = vec![0.0; objects.len()];
    let mut off = |items: &FactoredItems| {
        items.similarities_into(&query, &mut values);
        let differences = values.iter().zip(&dense).map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f32::max)
    };
    assert!(off(&objects) < 1e-5);
    assert!(off(&other) > 1e-3);
    let [factored, all] = objects.multiply_adds();
    assert!(factored < all / 2, "{factored} {all}");
}

#[test]
fn the_similarity_node_gives_the_dot_products_of_dense_items_for_any_number_of_queries() {
    let words: Vec<String> = (0..12).map(|i| format!("W{i}")).collect();
    let vocabulary = VocabularyBuilder::<Parts>::new(48, Seed::new(1))
        .any_similarity()
        .pointers(&words)
        .build()
        .expect("sound");
    let items = (0..30).map(|i| vec![(i % 12, 1.0), ((i * 5 + 1) % 12, -0.5)]);
    let items = FactoredItems::new(vocabulary.matrix().to_vec(), 48, items).expect("sound");
    let items = Arc::new(items);
    for count in 1..=3 {
        let mut graph = GraphBuilder::new();
        let node = graph.add("node", FactoredSimilarity::new(&vocabulary, items.clone(), count));
        let sum = Linear::factored_combination(&vocabulary, items.clone());
        let sum = graph.add("sum", sum);
        for (word, port) in words.iter().zip(&node.queries) {
            let pointer = vocabulary.get(word).expect("a word");
            let given = graph.add(word, Constant::pointer(vocabulary.space(), &pointer));
            graph.connect(&given, port, Synapse::None);
        }
        graph.connect(&node.outputs[0], &sum.input, Synapse::None);
        let ms = SimDuration::from_millis(1);
        let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms).expect("runs");
        let mut summed = vec![0.0; 48];
        for (query, out) in node.outputs.iter().enumerate() {
            let pointer = vocabulary.get(&words[query]).expect("a word");
            for (index, found) in sim.value(out).iter().enumerate() {
                let item = items.item(index);
                assert!((found - symbolt::spa::dot(&item, &pointer)).abs() < 1e-5);
                if query == 0 {
                    summed.iter_mut().zip(item).for_each(|(sum, value)| *sum += found * value);
                }
            }
        }
        let out = sim.value(&sum.output);
        assert!(out.iter().zip(&summed).all(|(a, b)| (a - b).abs() < 1e-4));
    }
    let other = VocabularyBuilder::<Parts>::new(32, Seed::new(1)).build().expect("sound");
    let mut graph = GraphBuilder::new();
    graph.add("node", JointMemory::new(&other, items, 2));
    let built = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
    let fault = built.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(fault.contains("48 dimensions; expected 32"), "{fault}");
}

fn answered(spec: &NetworkSpec, queries: usize, seed: u64) -> (Score, usize) {
    let seed = Seed::new(seed);
    let world = World::draw(&small(3.0), seed);
    let queries = world.queries_of_actions(queries, seed);
    let network = Network::build(&world, spec, &queries, seed).expect("builds");
    let at = [SimDuration::from_millis(40)];
    let scores = network.run(&world, &queries, &at, seed).expect("runs");
    (scores[0], network.neurons())
}

#[test]
fn one_neuron_an_item_finds_objects_and_actions_in_spikes() {
    // The default of 50 neurons per dimension takes longer.
    let lif = LifSpec::tuned(Tuning { per_dimension: 30, ..Tuning::default() });
    let spec = NetworkSpec {
        dimensions: 160,
        reach: Reach::Actions,
        conditions: Some(lif),
        ..NetworkSpec::default()
    };
    let (score, neurons) = answered(&spec, 20, 4);
    assert_eq!(neurons, 3 * 160 * 30 + 3 * 500 + 3 * 300);
    assert!(score.objects.matches >= 20 && score.actions.matches >= 20);
    assert!(score.objects.precision() > 0.9 && score.objects.recall() > 0.85, "{score:?}");
    assert!(score.actions.precision() > 0.75 && score.actions.recall() > 0.85, "{score:?}");
    // In exact maths, too.
    let (score, neurons) = answered(&NetworkSpec { conditions: None, ..spec }, 20, 4);
    assert_eq!(neurons, 0);
    assert!(score.objects.recall() > 0.9 && score.actions.recall() > 0.85, "{score:?}");
    // The wrong variant: without a frame, a level below the crosstalk finds much that does not match.
    let (score, _) = answered(
        &NetworkSpec { conditions: None, level: 0.1, roles: Roles::Unitary, ..spec },
        20,
        4,
    );
    assert!(score.objects.precision() < 0.5, "{score:?}");
}

#[test]
fn cleaned_conditions_leave_no_crosstalk_even_in_few_dimensions() {
    let lif = LifSpec::tuned(Tuning { per_dimension: 30, ..Tuning::default() });
    let spec = NetworkSpec {
        dimensions: 48,
        conditions: Some(lif),
        cleaned: true,
        ..NetworkSpec::default()
    };
    let (cleaned, _) = answered(&spec, 20, 6);
    let (plain, _) = answered(&NetworkSpec { cleaned: false, ..spec }, 20, 6);
    assert!(cleaned.objects.precision() > 0.98, "{cleaned:?}");
    assert!(cleaned.objects.recall() > 0.98, "{cleaned:?}");
    assert!(plain.objects.precision() + plain.objects.recall() < 1.9, "{plain:?}");
}

#[test]
fn a_spread_of_intercepts_is_refused_if_it_is_not_a_number() {
    let bad = LifSpec::tuned(Tuning { item_spread: f64::NAN, ..Tuning::few_per_item(1) });
    let mut graph = GraphBuilder::new();
    let rule = symbolt::neurons::SelectRule::Threshold { level: 0.5 };
    graph.add("choice", symbolt::spa::Selection::new(3, rule));
    let plan = PopulationPlan::all(Population::Lif(bad));
    let built = graph.build(Timebase::default(), &plan, Seed::new(1));
    let fault = built.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(fault.contains("`item_spread` is NaN"), "{fault}");
}
