//! Vocabularies made from others: grown, united, cut down and translated.

#![allow(clippy::unwrap_used)]

use symbolt::neurons::PopulationPlan;
use symbolt::sim::{
    Constant, GraphBuilder, Real, RunConfig, Seed, SimDuration, Simulator, Synapse, Timebase,
    VocabTag,
};
use symbolt::spa::{State, VocabError, Vocabulary, VocabularyBuilder, cosine, dot};

struct Parts;

impl VocabTag for Parts {
    const NAME: &'static str = "parts";
}

struct Words;

impl VocabTag for Words {
    const NAME: &'static str = "words";
}

fn parts() -> Vocabulary<Parts> {
    let names = ["NUT", "BOLT", "JIG"];
    VocabularyBuilder::new(64, Seed::new(1)).pointers(names).build().unwrap()
}

/// Connects a pointer of `from` to a port of `to`, and builds.
fn connects(from: &Vocabulary<Parts>, to: &Vocabulary<Parts>) -> bool {
    let mut graph = GraphBuilder::new();
    let nut = graph.add("nut", Constant::pointer(from.space(), &from.get("NUT").unwrap()));
    let state = graph.add("state", State::new(to));
    graph.connect(&nut, &state.input, Synapse::None);
    graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1)).is_ok()
}

#[test]
fn a_grown_vocabulary_fits_old_ports_and_a_foreign_one_is_refused() {
    let parts = parts();
    let grown = parts.grow().pointers(["TABLE", "ARM"]).build().unwrap();
    let small = grown.subset(["NUT", "ARM"]).unwrap();
    let foreign =
        VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointers(["NUT", "ARM"]).build().unwrap();
    assert!(connects(&grown, &parts) && connects(&parts, &grown) && connects(&small, &parts));
    assert!(!connects(&foreign, &parts) && !connects(&parts, &foreign));
    assert_eq!(grown.names(), ["NUT", "BOLT", "JIG", "TABLE", "ARM"]);
    assert_eq!(small.names(), ["NUT", "ARM"]);
    // Growing draws what a builder with all the names draws.
    let at_once = ["NUT", "BOLT", "JIG", "TABLE", "ARM"];
    let at_once =
        VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointers(at_once).build().unwrap();
    assert_eq!(grown.matrix(), at_once.matrix());
}

#[test]
fn unions_keep_each_pointer_and_refuse_another_space() {
    let parts = parts();
    let a = parts.grow().pointer("TABLE").build().unwrap();
    let b = parts.grow().pointer("ARM").build().unwrap();
    let both = a.union(&b).unwrap();
    assert_eq!(both.names(), ["NUT", "BOLT", "JIG", "TABLE", "ARM"]);
    assert_eq!(both.get("ARM").unwrap().to_vec(), b.get("ARM").unwrap().to_vec());
    let other = VocabularyBuilder::<Parts>::new(64, Seed::new(2)).pointer("ARM").build().unwrap();
    assert!(matches!(parts.union(&other), Err(VocabError::BadVector { .. })));
    let c = parts.grow().define("ARM", "NUT * BOLT").build().unwrap();
    assert!(matches!(b.union(&c), Err(VocabError::Duplicate { .. })));
    assert!(matches!(parts.subset(["NIT"]), Err(VocabError::Unknown { .. })));
    assert!(matches!(parts.subset(["NUT", "NUT"]), Err(VocabError::Duplicate { .. })));
}

#[test]
fn orthonormal_pointers_are_at_right_angles_up_to_the_number_of_dimensions() {
    let names: Vec<String> = (0..65).map(|i| format!("N{i}")).collect();
    let build = |count: usize| {
        VocabularyBuilder::<Parts>::new(64, Seed::new(1))
            .orthonormal(names[..count].to_vec())
            .build()
    };
    let all = build(64).unwrap();
    for i in 0..64 {
        for j in 0..=i {
            let expected = if i == j { 1.0 } else { 0.0 };
            let product = dot(&all.vector(i).unwrap(), &all.vector(j).unwrap());
            assert!((product - expected).abs() < 1e-5, "{i} {j}: {product}");
        }
    }
    assert!(matches!(build(65), Err(VocabError::BadVector { .. })));
}

#[test]
fn a_translation_takes_every_common_name_to_its_pointer() {
    let parts = parts();
    let words = ["JIG", "WRITE", "NUT", "BOLT"];
    let words = VocabularyBuilder::<Words>::new(96, Seed::new(5)).pointers(words).build().unwrap();
    let said = parts.parse("0.5 * NUT - BOLT + 2 * JIG").unwrap();
    let expected = words.parse("0.5 * NUT - BOLT + 2 * JIG").unwrap();
    let mut graph = GraphBuilder::new();
    let said = graph.add("said", Constant::pointer(parts.space(), &said));
    let translation = graph.add("translation", parts.translation(&words).unwrap());
    graph.connect(&said, &translation.input, Synapse::None);
    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1)).unwrap();
    let mut sim = Simulator::new(graph.into(), RunConfig::default()).unwrap();
    sim.run_for(SimDuration::from_millis(2)).unwrap();
    let found = sim.value(&translation.output);
    let off = found.iter().zip(&*expected).map(|(f, e)| (f - e).abs()).fold(0.0, f32::max);
    assert!(off < 1e-4, "{off}");
    // A sum of outer products, without the fit, is not exact: the pointers are not at right angles.
    let naive: Vec<f32> = (0..96)
        .map(|i| {
            let names = ["NUT", "BOLT", "JIG"];
            let share = |n: &&str| {
                let weight = dot(
                    &parts.parse("0.5 * NUT - BOLT + 2 * JIG").unwrap(),
                    &parts.get(n).unwrap(),
                );
                weight * words.get(n).unwrap()[i]
            };
            names.iter().map(share).sum()
        })
        .collect();
    let off = naive.iter().zip(&*expected).map(|(f, e)| (f - e).abs()).fold(0.0, f32::max);
    assert!(off > 1e-3, "{off}");
    let none = VocabularyBuilder::<Words>::new(96, Seed::new(5)).pointer("SAY").build().unwrap();
    assert!(matches!(parts.translation(&none).err(), Some(VocabError::BadVector { .. })));
}

#[test]
fn the_identity_binds_without_change_and_zero_has_no_words() {
    let parts = parts();
    let mut graph = parts.grow().vector("ONE", &parts.identity()).build().unwrap();
    assert!(cosine(&graph.parse("ONE * NUT").unwrap(), &parts.get("NUT").unwrap()) > 0.9999);
    assert_eq!(parts.describe(&parts.zero(), 0.1), "0");
    graph = graph.subset(["NUT"]).unwrap();
    assert_eq!(graph.describe(&graph.parse("-0.25 * NUT").unwrap(), 0.1), "-0.25 NUT");
}

/// Returns the sum of all squared similarities, over its least possible value.
fn potential(rows: &[Real], dim: usize) -> f64 {
    let all: Vec<&[Real]> = rows.chunks_exact(dim).collect();
    let sum: f64 = all.iter().flat_map(|a| all.iter().map(|b| f64::from(dot(a, b)).powi(2))).sum();
    let count = all.len() as f64;
    sum / (count * count / dim as f64).max(count)
}

#[test]
fn frames_reach_the_bound_of_welch_and_random_vectors_do_not() {
    for (count, dim) in [(5, 4), (12, 8), (60, 24), (24, 24), (10, 24), (1, 6)] {
        let names = || (0..count).map(|i| format!("N{i}"));
        let build = |drawn: VocabularyBuilder<Parts>| drawn.any_similarity().build().unwrap();
        let of = || VocabularyBuilder::<Parts>::new(dim, Seed::new(3));
        let (frame, random) = (build(of().frame(names())), build(of().pointers(names())));
        let (frame, random) = (frame.matrix(), random.matrix());
        assert_eq!(frame.len(), count * dim);
        let lengths = frame.chunks_exact(dim).map(|row| dot(row, row));
        assert!(lengths.into_iter().all(|square| (square - 1.0).abs() < 1e-5));
        let reached = potential(frame, dim);
        assert!((reached - 1.0).abs() < 1e-4, "{count} rows of {dim}: {reached}");
        assert!(count == 1 || potential(random, dim) > 1.05, "{count} rows of {dim}");
    }
}
