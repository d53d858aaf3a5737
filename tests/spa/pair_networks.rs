//! The network that decodes all pairs of a sum, in all modes.

#![allow(clippy::unwrap_used)]

use symbolt::neurons::PopulationPlan;
use symbolt::sim::{GraphBuilder, Real, Seed, SimDuration, VocabTag};
use symbolt::spa::{DecodePairs, Routes, State, VocabularyBuilder};

struct Things;

impl VocabTag for Things {
    const NAME: &'static str = "things";
}

/// How a sum is decoded: numbers of dimensions, pairs and items, and the share of cancellation.
#[derive(Clone, Copy)]
struct Size {
    dim: usize,
    pairs: usize,
    items: usize,
    cancellation: Real,
}

/// A sum from a time in ms on: the filler of each role, `None` for an absent role.
type Shown = (u64, Vec<Option<usize>>);

/// Returns the weights of all items for each role after `ms`, and the number of neurons.
fn decode(
    plan: &PopulationPlan,
    size: Size,
    trial: u64,
    sums: &[Shown],
    ms: u64,
) -> (Vec<Vec<Real>>, usize) {
    let Size { dim, pairs, items, cancellation } = size;
    let roles: Vec<String> = (0..pairs).map(|i| format!("R{i}")).collect();
    let names: Vec<String> = (0..items).map(|i| format!("I{i}")).collect();
    let things = VocabularyBuilder::<Things>::new(dim, Seed::new(500 + trial))
        .any_similarity()
        .pointers(roles.iter().chain(&names).cloned())
        .build()
        .unwrap();
    let text = |fillers: &[Option<usize>]| {
        let terms = fillers.iter().enumerate();
        let terms = terms.filter_map(|(role, item)| Some(format!("R{role} * I{}", (*item)?)));
        terms.collect::<Vec<_>>().join(" + ")
    };
    let texts: Vec<(u64, String)> = sums.iter().map(|(at, sum)| (*at, text(sum))).collect();
    let scale = (pairs as Real).sqrt().recip();
    let mut graph = GraphBuilder::new();
    let shown = things.stimulus(texts.iter().map(|(at, text)| (*at, text.as_str()))).unwrap();
    let shown = graph.add("shown", shown);
    let held = graph.add("held", State::new(&things));
    let module = DecodePairs::new(
        &things,
        roles.iter().map(String::as_str),
        names.iter().map(String::as_str),
    );
    let module = graph.add("decode", module.unwrap().scale(scale).cancellation(cancellation));
    graph.route(scale * &shown >> &held);
    graph.route(&held >> &module.input);
    let sim = graph.run(plan, Seed::new(trial), SimDuration::from_millis(ms)).unwrap();
    let neurons = sim.graph().event_sources().map(|(_, source)| source.units).sum();
    let weights = module.weights.iter().map(|weights| sim.value(weights).to_vec());
    (weights.collect(), neurons)
}

/// Returns how many fillers have the greatest weight of their role.
fn matches(weights: &[Vec<Real>], fillers: &[Option<usize>]) -> usize {
    let right = |(weights, filler): (&Vec<Real>, &Option<usize>)| {
        let most = weights.iter().copied().fold(Real::MIN, Real::max);
        filler.is_some_and(|filler| most > 0.1 && weights[filler] == most)
    };
    weights.iter().zip(fillers).map(right).filter(|right| *right).count()
}

/// Returns the fillers of all roles in one of many sums.
fn fillers(size: Size, number: usize) -> Vec<Option<usize>> {
    (0..size.pairs).map(|pair| Some((31 * pair + 7 * number) % size.items)).collect()
}

/// Returns how many fillers of random sums are right after `ms`, and the number of neurons.
fn right(plan: &PopulationPlan, size: Size, sums: u64, ms: u64) -> (usize, usize) {
    let (mut right, mut neurons) = (0, 0);
    for trial in 0..sums {
        let wanted = fillers(size, trial as usize);
        let (weights, count) = decode(plan, size, trial, &[(0, wanted.clone())], ms);
        right += matches(&weights, &wanted);
        neurons = count;
    }
    (right, neurons)
}

fn lif() -> PopulationPlan {
    PopulationPlan::lif()
}

#[test]
fn all_pairs_of_a_sum_are_decoded_in_every_mode() {
    let size = Size { dim: 128, pairs: 10, items: 60, cancellation: 1.0 };
    let rate = PopulationPlan::rate();
    for plan in [PopulationPlan::direct(), rate, lif()] {
        let (found, _) = right(&plan, size, 4, 500);
        println!("{found} of 40");
        assert!(found >= 38, "{found} of 40");
    }
    // Without cancellation, each role is read alone. With more pairs, half of the fillers are wrong then.
    let size = Size { dim: 128, pairs: 16, items: 256, cancellation: 1.0 };
    let direct = PopulationPlan::direct();
    let (joint, _) = right(&direct, size, 3, 500);
    let (alone, _) = right(&direct, Size { cancellation: 0.0, ..size }, 3, 500);
    println!("of 48: {joint} jointly, {alone} alone");
    assert!(joint >= 46 && alone <= 32, "of 48: {joint} jointly, {alone} alone");
}

#[test]
fn a_sum_that_changes_is_decoded_anew() {
    let size = Size { dim: 128, pairs: 10, items: 60, cancellation: 1.0 };
    for plan in [PopulationPlan::direct(), lif()] {
        let mut found = [0, 0];
        for trial in 0..4 {
            let (old, new) = (fillers(size, trial), fillers(size, trial + 4));
            let sums = [(0, old.clone()), (400, new.clone())];
            let (weights, _) = decode(&plan, size, trial as u64, &sums, 900);
            found[0] += matches(&weights, &new);
            found[1] += matches(&weights, &old);
        }
        println!("of 40: {} of the new sum, {} of the old", found[0], found[1]);
        assert!(found[0] >= 38 && found[1] <= 1, "{found:?}");
    }
}

#[test]
fn a_role_that_is_absent_from_the_sum_has_small_weights() {
    let size = Size { dim: 128, pairs: 10, items: 60, cancellation: 1.0 };
    for plan in [PopulationPlan::direct(), lif()] {
        for trial in 0..3 {
            let mut wanted = fillers(size, trial);
            wanted[3..].fill(None);
            let (weights, _) = decode(&plan, size, trial as u64, &[(0, wanted.clone())], 500);
            let most = |w: &Vec<Real>| w.iter().copied().fold(Real::MIN, Real::max);
            let most: Vec<Real> = weights.iter().map(most).collect();
            println!("{most:.2?}");
            assert_eq!(matches(&weights, &wanted), 3);
            let [present, absent] = [&most[..3], &most[3..]];
            let least = present.iter().copied().fold(Real::MAX, Real::min);
            assert!(absent.iter().all(|weight| *weight < 0.5 * least), "{most:?}");
        }
    }
}

#[test]
#[ignore = "long: a minute"]
fn sixteen_pairs_of_256_items_are_decoded_in_spikes() {
    let size = Size { dim: 128, pairs: 16, items: 256, cancellation: 1.0 };
    let all = 12 * 16;
    let (exact, _) = right(&PopulationPlan::direct(), size, 12, 500);
    let (spiking, neurons) = right(&lif(), size, 12, 500);
    let (alone, _) = right(&PopulationPlan::direct(), Size { cancellation: 0.0, ..size }, 12, 500);
    println!(
        "of {all}: {exact} in direct mode, {spiking} in {neurons} spiking neurons, {alone} alone"
    );
    // 98% of 1,600 were right with other seeds. Wrong fillers cluster by sum, so 12 sums give no interval.
    assert!(spiking * 100 >= 85 * all, "{spiking} of {all}");
    assert!(alone * 100 < 60 * all, "{alone} of {all} without cancellation");
}

#[test]
fn settings_out_of_range_are_faults() {
    let things =
        VocabularyBuilder::<Things>::new(64, Seed::new(1)).pointers(["A", "B"]).build().unwrap();
    let mut graph = GraphBuilder::new();
    let decode = || DecodePairs::new(&things, ["A"], ["B"]).unwrap();
    let sum = graph.add("sum", State::new(&things));
    graph.route(things.get("A").unwrap() >> &sum);
    for (name, decode) in [("a", decode().scale(0.0)), ("b", decode().cancellation(1.5))] {
        let decode = graph.add(name, decode);
        graph.route(&sum >> &decode.input);
    }
    let built = graph.start(&PopulationPlan::direct(), Seed::new(1));
    let text = built.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(text.contains("the scale is 0; expected a finite number above 0"), "{text}");
    assert!(text.contains("the cancellation is 1.5; expected a number from 0 to 1"), "{text}");
    let reason = |roles: &[&str], items: &[&str]| {
        let names = (roles.iter().copied(), items.iter().copied());
        DecodePairs::new(&things, names.0, names.1).err().unwrap().to_string()
    };
    assert!(reason(&[], &["B"]).contains("there are no roles"));
    assert!(reason(&["A"], &[]).contains("there are no items"));
    assert!(reason(&["C"], &["B"]).contains("A, B"));
}
