//! Vocabularies and algebras.

use symbolt::prelude::*;
use symbolt::sim::{PointerRef, Real};
use symbolt::spa::{Hrr, Tvtb, VocabError, Vtb, norm};

use super::{Others, Words, run, smooth, words};

/// The greatest difference of two pointers.
fn off(a: &[Real], b: &[Real]) -> Real {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, Real::max)
}

#[test]
fn vocabularies_are_populated_parsed_and_cut() {
    let v = VocabularyBuilder::<Words>::new(64, Seed::new(1)).pointers(["A", "B"]);
    let v = v.define("C", "A + 0.5 * B").define("D", "C * ~B").unitary("E").build().expect("sound");
    assert_eq!(v.names(), ["A", "B", "C", "D", "E"]);
    let get = |name: &str| v.get(name).expect("there").to_vec();
    let sum: Vec<Real> = get("A").iter().zip(get("B")).map(|(a, b)| a + 0.5 * b).collect();
    assert!(off(&get("C"), &sum) < 1e-6);
    let parsed = |text: &str| v.parse(text).expect("sound").to_vec();
    assert!(off(&parsed("A+0.5*B"), &sum) < 1e-6 && off(&parsed("(A + B) - 0.5*B"), &sum) < 1e-6);
    assert!(
        off(&parsed("C * ~B"), &get("D")) < 1e-6 && off(&parsed("A * B"), &parsed("B * A")) < 1e-6
    );
    assert!(parsed("0").iter().all(|x| *x == 0.0) && off(&parsed("-A"), &parsed("-1 * A")) < 1e-6);
    // What has no meaning is refused.
    assert!(matches!(v.parse("A + X"), Err(VocabError::Unknown { .. })));
    for wrong in ["A +", "(A", "A B", "a", "", "A ** 2"] {
        assert!(v.parse(wrong).is_err(), "{wrong}");
    }
    let named =
        |name: &str| VocabularyBuilder::<Words>::new(16, Seed::new(1)).pointer(name).build();
    assert!(named("A1").is_ok() && ["a", "1A", "A-B", "", "A B"].iter().all(|n| named(n).is_err()));
    let twice = VocabularyBuilder::<Words>::new(16, Seed::new(1)).any_similarity();
    assert!(twice.pointers(["A", "A"]).build().is_err());
    // A part of it, in the same space.
    let part = v.subset(["C", "A"]).expect("there");
    assert_eq!((part.len(), part.get("C").expect("there").to_vec()), (2, get("C")));
    assert!(part.get("B").is_err() && part.space().same_as(v.space()) && v.subset(["X"]).is_err());
    // Into another vocabulary of another size.
    let w = words::<Others>(32, 2, &["A", "B", "X"]);
    let mut graph = GraphBuilder::new();
    let sum =
        graph.add("sum", Constant::pointer(v.space(), &v.parse("A - 0.5 * B").expect("sound")));
    let there = graph.add("there", v.translation(&w).expect("two names"));
    graph.route(&sum >> &there);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), super::ms(1)).expect("runs");
    assert!(off(&sim.value(&there.output), &w.parse("A - 0.5 * B").expect("sound")) < 1e-5);
}

#[test]
fn algebras_obey_their_laws() {
    let new = || {
        let builder = VocabularyBuilder::<Words>::new(64, Seed::new(1)).or_best_of(100);
        builder.pointers(["A", "B", "C"]).unitary("U").unitary("V")
    };
    let algebras = [new().algebra(Hrr), new().algebra(Vtb), new().algebra(Tvtb)];
    for v in algebras.map(|builder| builder.build()) {
        let v = v.expect("sound");
        let of = |text: &str| v.parse(text).expect("sound").to_vec();
        let name = v.algebra().name();
        // What was bound is found again, exactly if it was bound to something unitary.
        let a = v.get("A").expect("there");
        let back = v.parse("A * B * ~B").expect("sound");
        assert!(cosine(&back, &a) > 0.6, "{name}: {}", cosine(&back, &a));
        assert!(cosine(&v.parse("A * B").expect("sound"), &a).abs() < 0.4);
        assert!(off(&of("A * U * ~U"), &of("A")) < 1e-5, "{name}");
        assert!(off(&of("(A + B) * C"), &of("A * C + B * C")) < 1e-5);
        assert!((norm(&of("A * U")) - 1.0).abs() < 1e-5 && off(&of("~~A"), &of("A")) < 1e-7);
        let commutes = off(&of("A * B"), &of("B * A")) < 1e-5;
        assert_eq!(commutes, name == Hrr.name_of(), "{name}");
        // The identity and zero.
        let bind = |a: &[Real], b: &[Real]| {
            let (mut out, mut work) = (vec![0.0; 64], v.algebra().scratch(64));
            v.algebra().bind_into(a, b, &mut out, &mut work);
            out
        };
        assert!(off(&bind(&a, &v.identity()), &a) < 1e-5);
        assert!(bind(&a, &v.zero()).iter().all(|x| x.abs() < 1e-7));
        // Powers: binding with one is binding as many times.
        let power = |text: &str, exponent: f64| v.power(&v.parse(text).expect("sound"), exponent);
        let whole = |exponent| power("U", exponent).expect("a whole power").to_vec();
        for count in [0, 1, 2, 3, 5] {
            let times = (0..count).fold(a.to_vec(), |product, _| bind(&product, &of("U")));
            assert!(off(&bind(&a, &whole(f64::from(count))), &times) < 1e-5, "{name} {count}");
        }
        assert!(off(&whole(-1.0), &of("~U")) < 1e-6);
        assert!(off(&bind(&bind(&a, &whole(3.0)), &whole(-2.0)), &of("A * U")) < 1e-5);
        // Fractional powers of what is positive, such as a square, add up; of other pointers there are none.
        let part = |exponent| power("U * U", exponent).map(|value| value.to_vec());
        if commutes {
            let [three, four, seven] = [0.3, 0.4, 0.7].map(|exponent| part(exponent).expect("one"));
            assert!(off(&bind(&three, &four), &seven) < 1e-5);
            assert!((norm(&three) - 1.0).abs() < 1e-4);
            let root = part(0.5).expect("one");
            assert!(off(&bind(&root, &root), &of("U * U")) < 1e-5);
        } else {
            assert!(matches!(part(0.3), Err(VocabError::Exponent { .. })));
        }
        assert!(power("U", f64::NAN).is_err());
    }
    // Vector-derived transformations need a square number of dimensions.
    let odd = VocabularyBuilder::<Words>::new(60, Seed::new(1)).pointer("A").algebra(Vtb).build();
    assert!(odd.is_err_and(|error| error.to_string().contains("square")));
}

/// The name of an algebra as a value.
trait NameOf {
    fn name_of(&self) -> &'static str;
}

impl NameOf for Hrr {
    fn name_of(&self) -> &'static str {
        symbolt::spa::Algebra::name(self)
    }
}

#[test]
fn vectors_are_drawn_with_the_properties_asked_for() {
    let names: Vec<String> = (0..20).map(|n| format!("N{n}")).collect();
    let new = || VocabularyBuilder::<Words>::new(64, Seed::new(1)).any_similarity();
    let drawn = new().pointers(names.clone()).build().expect("sound");
    let mut mean = 0.0;
    for at in 0..20 {
        let vector = drawn.vector(at).expect("there");
        assert!((norm(&vector) - 1.0).abs() < 1e-5);
        mean += vector.iter().sum::<Real>() / (20.0 * 64.0);
    }
    // The mean of a component has a standard error of 1 / sqrt(64 x 1280).
    assert!(mean.abs() < 5.0 / (64.0f32 * 1280.0).sqrt(), "{mean}");
    for algebra in [true, false] {
        let builder = if algebra { new().algebra(Hrr) } else { new().algebra(Vtb) };
        let unitary = builder.unitary("A").unitary("B").build().expect("sound");
        for text in ["A * B * ~B", "A * A * ~A"] {
            let back = unitary.parse(text).expect("sound");
            assert!(off(&back, &unitary.get("A").expect("there")) < 1e-5, "{text}");
        }
        assert!(off(&unitary.get("A").expect("there"), &unitary.get("B").expect("there")) > 0.1);
    }
    let right = new().orthonormal(names.clone()).build().expect("sound");
    for (i, j) in (0..20).flat_map(|i| (0..=i).map(move |j| (i, j))) {
        let product = dot(&right.vector(i).expect("there"), &right.vector(j).expect("there"));
        assert!((product - Real::from(u8::from(i == j))).abs() < 1e-5, "{i} {j}: {product}");
    }
    let more = VocabularyBuilder::<Words>::new(16, Seed::new(1)).orthonormal(names).build();
    assert!(more.is_err(), "20 at right angles in 16 dimensions");
    // Along the axes, given one by one.
    let axes = (0..3).fold(VocabularyBuilder::<Words>::new(3, Seed::new(1)), |builder, at| {
        let mut axis = [0.0; 3];
        axis[at] = 1.0;
        builder.vector(["A", "B", "C"][at], &PointerRef::<Words>::from_raw(&axis))
    });
    let axes = axes.build().expect("sound");
    assert_eq!(*axes.parse("A - 2 * C").expect("sound"), [1.0, 0.0, -2.0]);
}

#[test]
fn traces_are_told_in_similarities_and_words() {
    let v = VocabularyBuilder::<Words>::new(64, Seed::new(1)).orthonormal(["A", "B", "C"]);
    let v = v.build().expect("sound");
    let mut graph = GraphBuilder::new();
    let state = graph.add("state", State::new(&v));
    graph.route(0.8 * Words::A - 0.3 * Words::B >> &state);
    let probe = graph.probe(&state.output, smooth(30));
    let sim = run(&graph, 300);
    let series = v.similarities(sim.samples(&probe), ["A", "B", "C", "A * B"]).expect("sound");
    let last = |name: &str| series.last(name).expect("a column");
    assert!((last("A") - 0.8).abs() < 0.1 && (last("B") + 0.3).abs() < 0.1, "{series}");
    assert!(last("C").abs() < 0.1 && last("A * B").abs() < 0.35);
    let words = v.describe(&sim.samples(&probe).last().expect("there").1, 0.15);
    assert!(
        words.starts_with("0.") && words.contains(" A - 0.") && words.ends_with(" B"),
        "{words}"
    );
    let exact = v.parse("0.8 * A - 0.3 * C").expect("sound");
    assert_eq!(v.describe(&exact, 0.1), "0.80 A - 0.30 C");
    assert_eq!(v.describe(&exact, 0.5), "0.80 A");
    assert_eq!(v.describe(&v.zero(), 0.1), "0");
    assert!(v.similarities(sim.samples(&probe), ["X"]).is_err());
}
