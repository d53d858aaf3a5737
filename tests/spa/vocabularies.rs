//! Laws of vocabularies and of their expressions: similarity, seeds, names, and what is refused.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use proptest::prelude::*;
use symbolt::prelude::{GraphBuilder, PopulationPlan, ProbeSpec, SimDuration};
use symbolt::sim::{PointerRef, Seed, VocabTag};
use symbolt::spa::{
    Algebra, Hrr, VocabError, Vocabulary, VocabularyBuilder, cosine_of_slices, dot, norm,
};

struct Things;
impl VocabTag for Things {
    const NAME: &'static str = "things";
}

fn sum(a: &[f32], b: &[f32]) -> Vec<f32> {
    a.iter().zip(b).map(|(x, y)| x + y).collect()
}

fn far(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max)
}

proptest! {
    #[test]
    fn a_vocabulary_keeps_its_ceiling_and_depends_on_its_seed_alone(seed in any::<u64>(), count in 2usize..12) {
        let names: Vec<String> = (0..count).map(|i| format!("N{i}")).collect();
        let build = |seed| {
            VocabularyBuilder::<Things>::new(128, Seed::new(seed))
                .max_similarity(0.15)
                .pointers(names.clone())
                .build()
                .expect("the ceiling can be met")
        };
        let vocabulary = build(seed);
        let again = build(seed);
        prop_assert_eq!(vocabulary.matrix(), again.matrix());
        prop_assert!(vocabulary.matrix() != build(seed.wrapping_add(1)).matrix());
        let mut pairs = 0;
        for i in 0..count {
            let a = vocabulary.vector(i).expect("there").to_vec();
            prop_assert!((norm(&a) - 1.0).abs() < 1e-5);
            for j in 0..i {
                let b = vocabulary.vector(j).expect("there");
                prop_assert!(dot(&a, &b).abs() <= 0.15);
                pairs += 1;
            }
        }
        prop_assert_eq!(pairs, count * (count - 1) / 2);
    }

    #[test]
    fn any_text_is_parsed_or_refused_but_never_panics(text in "[ A-Z0-9_+*~().-]{0,60}") {
        let vocabulary = VocabularyBuilder::<Things>::new(16, Seed::new(1))
            .any_similarity()
            .pointers(["A", "B"])
            .build()
            .expect("sound");
        if let Err(error) = vocabulary.parse(&text) {
            let known = matches!(error, VocabError::Syntax { .. } | VocabError::Unknown { .. } | VocabError::BadVector { .. });
            prop_assert!(known, "{}", error);
            prop_assert!(!error.to_string().is_empty());
        }
    }

    #[test]
    fn any_unicode_text_is_parsed_or_refused(text in "\\PC{0,40}") {
        let vocabulary =
            VocabularyBuilder::<Things>::new(8, Seed::new(1)).any_similarity().pointer("A").build().expect("sound");
        let _ = vocabulary.parse(&text);
    }
}

fn small() -> symbolt::spa::Vocabulary<Things> {
    VocabularyBuilder::new(64, Seed::new(1))
        .any_similarity()
        .pointers(["NUT", "BOLT"])
        .unitary("PRECONDITION")
        .build()
        .expect("sound")
}

#[test]
fn expressions_mean_what_they_say() {
    let v = small();
    let bind = |a: &[f32], b: &[f32]| {
        let mut out = vec![0.0; a.len()];
        Hrr.bind_into(a, b, &mut out, &mut Hrr.scratch(a.len()));
        out
    };
    let inverse = |a: &[f32]| {
        let mut out = vec![0.0; a.len()];
        Hrr.inverse_into(a, &mut out);
        out
    };
    let (nut, bolt) = (v.get("NUT").expect("there"), v.get("BOLT").expect("there"));
    let role = v.get("PRECONDITION").expect("there");
    let same = |text: &str, expected: &[f32]| {
        let found = v.parse(text).expect(text);
        assert!(far(&found, expected) < 1e-5, "{text}");
    };
    same("NUT", &nut);
    same(" ( NUT ) ", &nut);
    same("NUT + BOLT", &sum(&nut, &bolt));
    same("NUT - -BOLT", &sum(&nut, &bolt));
    same("2 * NUT * 0.5", &nut);
    same("NUT * BOLT", &bind(&nut, &bolt));
    same("PRECONDITION * (NUT + BOLT)", &bind(&role, &sum(&nut, &bolt)));
    same("PRECONDITION * NUT + BOLT", &sum(&bind(&role, &nut), &bolt));
    same("PRECONDITION * (NUT + BOLT) * ~PRECONDITION", &sum(&nut, &bolt));
    same("(1 + 1) * NUT - NUT", &nut);
    assert!(cosine_of_slices(&v.parse("~NUT").expect("read"), &inverse(&nut)) > 0.9999);
}

#[test]
fn what_cannot_be_read_says_where_and_what_was_expected() {
    let v = small();
    let cases = [
        ("", "character 0", "the end"),
        ("NUT +", "character 5", "the end"),
        ("NUT BOLT", "character 4", "an operator"),
        ("(NUT", "character 4", "`)`"),
        ("NUT + 1", "character 4", "pointers on both sides"),
        ("~2 * NUT", "character 0", "a pointer"),
        ("3", "character 0", "at least one name"),
        ("1.2.3 * NUT", "character 0", "a number such as"),
        ("nut", "character 0", "a name"),
        ("NUT / BOLT", "character 4", "an operator"),
    ];
    for (text, place, expected) in cases {
        let error = v.parse(text).expect_err(text).to_string();
        assert!(error.contains(place) && error.contains(expected), "{text}: {error}");
    }
    let deep = "(".repeat(500) + "NUT" + &")".repeat(500);
    assert!(v.parse(&deep).expect_err("too deep").to_string().contains("nesting"));
    let unknown = v.parse("NUT + BLOT").expect_err("unknown").to_string();
    assert_eq!(
        unknown,
        "the vocabulary `things` has no `BLOT` (did you mean `BOLT`?); it has: NUT, BOLT, PRECONDITION"
    );
}

#[test]
fn vocabularies_that_cannot_be_are_refused() {
    let build = |b: VocabularyBuilder<Things>| b.build().expect_err("refused");
    let new = |dim| VocabularyBuilder::<Things>::new(dim, Seed::new(1));
    assert!(matches!(build(new(0)), VocabError::Dimension { dim: 0, .. }));
    assert!(matches!(build(new(1)), VocabError::Dimension { .. }));
    for ceiling in [0.0, -0.1, 1.1, f32::NAN] {
        assert!(matches!(build(new(16).max_similarity(ceiling)), VocabError::Ceiling { .. }));
    }
    for name in ["", "nut", "1NUT", "NUT-A", "ÄNUT"] {
        assert!(matches!(build(new(16).pointer(name)), VocabError::BadName { .. }), "{name}");
    }
    assert!(matches!(build(new(64).pointers(["A", "A"])), VocabError::Duplicate { .. }));
    assert!(matches!(
        build(new(64).vector("A", &PointerRef::<Things>::from_raw(&[1.0]))),
        VocabError::BadVector { .. }
    ));
    assert!(matches!(
        build(new(2).vector("A", &PointerRef::<Things>::from_raw(&[1.0, f32::NAN]))),
        VocabError::BadVector { .. }
    ));
    // Ten vectors of four dimensions cannot all be nearly orthogonal. The error names the nearest pointer.
    let crowded = build(new(4).pointers((0..10).map(|i| format!("N{i}"))));
    let VocabError::TooSimilar { dim: 4, best, ref nearest, .. } = crowded else {
        panic!("{crowded}")
    };
    assert!(best > 0.1 && best < 1.0 && nearest.starts_with('N'));
    assert!(crowded.to_string().contains("use more dimensions or a higher ceiling"));
}

#[test]
fn a_vocabulary_that_cannot_be_says_so_soon_and_what_to_do() {
    let new = |dim, names: usize| {
        let names = (0..names).map(|n| format!("N{n}"));
        VocabularyBuilder::<Things>::new(dim, Seed::new(1)).pointers(names)
    };
    for (dim, names, least, most) in
        [(64, 1000, 15, 22), (512, 1500, 300, 500), (1000, 20_000, 4000, 8000)]
    {
        let began = std::time::Instant::now();
        let error = new(dim, names).build().expect_err("too many");
        let took = began.elapsed().as_secs_f64();
        eprintln!("{dim} dimensions, {names} names: {took:.2} s; {error}");
        // About a second each; the bound leaves room for a busy machine.
        assert!(took < 10.0, "{took} s");
        let VocabError::TooSimilar { room, .. } = error else { panic!("{error}") };
        assert!((least..=most).contains(&room), "{dim}: room for {room}");
        let text = error.to_string();
        assert!(
            ["any_similarity", "or_best_of", "max_similarity"].iter().all(|m| text.contains(m)),
            "{text}"
        );
    }
    // The room is real: four fifths of the pointers can be drawn.
    assert_eq!(new(64, 14).build().unwrap().len(), 14);
    assert_eq!(new(256, 60).build().unwrap().len(), 60);
}

#[test]
fn the_best_of_some_draws_is_kept_when_asked() {
    let new = || {
        VocabularyBuilder::<Things>::new(32, Seed::new(1))
            .pointers((0..60).map(|n| format!("N{n}")))
    };
    let greatest = |vocabulary: &Vocabulary<Things>, of: usize| {
        let at = |n: usize| vocabulary.get(&format!("N{n}")).unwrap();
        (0..of).map(|n| dot(&at(n), &at(of)).abs()).fold(0.0, f32::max)
    };
    let mean = |vocabulary: &Vocabulary<Things>| {
        (1..60).map(|of| greatest(vocabulary, of)).sum::<f32>() / 59.0
    };
    let [one, ten, many] = [1, 10, 1000].map(|draws| new().or_best_of(draws).build().unwrap());
    let any = new().any_similarity().build().unwrap();
    assert!(mean(&many) < mean(&ten) - 0.03 && mean(&ten) < mean(&one) - 0.03);
    // One draw is the first draw, and a name that keeps the ceiling has the vector that it has without the setting.
    assert_eq!(one.get("N59").unwrap().to_vec(), any.get("N59").unwrap().to_vec());
    let few = || VocabularyBuilder::<Things>::new(256, Seed::new(1)).pointers(["A", "B", "C", "D"]);
    let (with, without) = (few().or_best_of(20_000).build().unwrap(), few().build().unwrap());
    assert_eq!(with.get("D").unwrap().to_vec(), without.get("D").unwrap().to_vec());
    // A vocabulary that grows keeps the setting.
    let grown = ten.grow().pointers((60..80).map(|n| format!("N{n}"))).build().unwrap();
    assert_eq!(grown.len(), 80);
    assert_eq!(new().or_best_of(0).build().unwrap().len(), 60);
}

#[test]
fn zero_is_the_zero_vector() {
    let things = VocabularyBuilder::<Things>::new(16, Seed::new(1))
        .pointer("A")
        .define("NOTHING", "0")
        .build()
        .unwrap();
    for text in ["0", " 0 ", "0.0", "-0", "0 * 3", "2 - 2"] {
        assert_eq!(things.parse(text).unwrap().to_vec(), vec![0.0; 16], "{text}");
    }
    assert_eq!(things.get("NOTHING").unwrap().to_vec(), vec![0.0; 16]);
    assert!(things.parse("1").is_err() && things.parse("A + 1").is_err());
}

#[test]
fn adding_a_name_changes_no_other_when_nothing_collides() {
    let names = |extra: &[&str]| {
        VocabularyBuilder::<Things>::new(512, Seed::new(9))
            .any_similarity()
            .pointers(["A", "B"])
            .pointers(extra.iter().copied())
            .build()
            .expect("sound")
    };
    let (few, many) = (names(&[]), names(&["C", "D"]));
    assert_eq!(few.matrix(), &many.matrix()[..few.matrix().len()]);
}

#[test]
fn a_power_that_is_not_finite_is_refused() {
    let things = VocabularyBuilder::<Things>::new(64, Seed::new(1)).pointer("NUT").build().unwrap();
    let error = things.power(&things.get("NUT").unwrap(), 1e9).err().unwrap().to_string();
    assert!(error.contains("not finite; use a smaller exponent"), "{error}");
}

#[test]
fn vocabularies_of_the_same_names_with_other_vectors_are_foreign() {
    let of = || VocabularyBuilder::<Things>::new(64, Seed::new(1)).any_similarity();
    let first = of().pointers(["A", "B"]).build().unwrap();
    let again = of().pointers(["A", "B"]).build().unwrap();
    assert!(first.space().same_as(again.space()));
    let unitary = of().unitary("A").unitary("B").build().unwrap();
    let given = of().vector("A", &first.get("B").unwrap()).pointer("B").build().unwrap();
    assert!(!first.space().same_as(unitary.space()) && !first.space().same_as(given.space()));
    let error = first.grow().algebra(symbolt::spa::Vtb).build().err().unwrap().to_string();
    assert!(
        error.contains("a grown vocabulary keeps its algebra HRR; it cannot have VTB"),
        "{error}"
    );
}

#[test]
fn similarities_with_samples_of_another_size_are_refused() {
    let [narrow, wide] = [32, 64].map(|dim| {
        VocabularyBuilder::<Things>::new(dim, Seed::new(1))
            .any_similarity()
            .pointer("A")
            .build()
            .unwrap()
    });
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", wide.stimulus([(0, "A")]).unwrap());
    let probe = graph.probe(&a, ProbeSpec::default());
    let sim =
        graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(5)).unwrap();
    let error = narrow.similarities(sim.samples(&probe), ["A"]).err().unwrap().to_string();
    assert!(error.contains("the samples have 64 components; expected 32"), "{error}");
}

#[test]
fn a_long_sum_is_refused_before_it_exhausts_the_stack() {
    let things = VocabularyBuilder::<Things>::new(64, Seed::new(1)).pointer("A").build().unwrap();
    let sum = |terms: usize| vec!["A"; terms].join(" + ");
    assert!(things.parse(&sum(1_000)).is_ok());
    for long in [sum(20_000), vec!["A"; 20_000].join("*")] {
        let error = things.parse(&long).err().unwrap().to_string();
        assert!(error.contains("at most 1000 operators") && error.len() < 500, "{error}");
    }
    assert!(things.parse("~!A").is_ok());
}
