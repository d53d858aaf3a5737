//! Laws of the algebra and of vocabularies for any number of dimensions, and wrong variants that the tests must catch.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use proptest::prelude::*;
use symbolt::sim::{Complex, PointerRef, Scratch, Seed, VocabTag};
use symbolt::spa::{
    Algebra, Hrr, LinearMap, VocabError, VocabularyBuilder, Vtb, cosine_of_slices, dot, norm,
    random_pointer,
};

struct Things;
impl VocabTag for Things {
    const NAME: &'static str = "things";
}

fn sum(a: &[f32], b: &[f32]) -> Vec<f32> {
    a.iter().zip(b).map(|(x, y)| x + y).collect()
}

/// Circular convolution by its definition, in double precision.
fn convolve(a: &[f32], b: &[f32]) -> Vec<f64> {
    let n = a.len();
    (0..n).map(|j| (0..n).map(|k| f64::from(a[k]) * f64::from(b[(n + j - k) % n])).sum()).collect()
}

fn far(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max)
}

/// Numbers of dimensions of every kind: tiny, odd, prime, powers of two.
fn dims() -> impl Strategy<Value = usize> {
    prop_oneof![
        Just(2),
        Just(3),
        Just(7),
        Just(16),
        Just(63),
        Just(64),
        Just(101),
        Just(256),
        2usize..300
    ]
}

/// An algebra with three random vectors.
#[derive(Debug, Clone)]
struct Case {
    algebra: &'static dyn Algebra,
    a: Vec<f32>,
    b: Vec<f32>,
    c: Vec<f32>,
}

impl Case {
    fn of(algebra: &'static dyn Algebra, dim: usize, seed: u64) -> Self {
        let draw = |k| random_pointer(dim, Seed::new(seed).derive_index("law", k));
        Self { algebra, a: draw(0), b: draw(1), c: draw(2) }
    }

    fn bind(&self, a: &[f32], b: &[f32]) -> Vec<f32> {
        let mut out = vec![0.0; a.len()];
        self.algebra.bind_into(a, b, &mut out, &mut self.algebra.scratch(a.len()));
        out
    }

    fn inverse(&self, a: &[f32]) -> Vec<f32> {
        let mut out = vec![0.0; a.len()];
        self.algebra.inverse_into(a, &mut out);
        out
    }

    fn unitary(&self, a: &[f32]) -> Vec<f32> {
        let mut out = a.to_vec();
        self.algebra.make_unitary(&mut out, &mut self.algebra.scratch(a.len()));
        out
    }

    fn power(&self, a: &[f32], exponent: f64) -> Result<Vec<f32>, VocabError> {
        let mut out = vec![0.0; a.len()];
        self.algebra.power_into(a, exponent, &mut out, &mut self.algebra.scratch(a.len()))?;
        Ok(out)
    }
}

/// Every algebra, with numbers of dimensions that it can use.
fn cases() -> impl Strategy<Value = Case> {
    let square = prop_oneof![Just(4usize), Just(9), Just(64), Just(121), Just(256)];
    prop_oneof![
        (dims(), any::<u64>()).prop_map(|(dim, seed)| Case::of(&Hrr, dim, seed)),
        (square, any::<u64>()).prop_map(|(dim, seed)| Case::of(&Vtb, dim, seed)),
    ]
}

fn hrr() -> impl Strategy<Value = Case> {
    (dims(), any::<u64>()).prop_map(|(dim, seed)| Case::of(&Hrr, dim, seed))
}

fn apply(map: &dyn LinearMap, x: &[f32]) -> Vec<f32> {
    let spec = map.scratch();
    let (mut reals, mut complexes) =
        (vec![0.0; spec.reals], vec![Complex::default(); spec.complexes]);
    let mut out = vec![0.0; map.output_width()];
    let mut scratch =
        Scratch { reals: &mut reals, doubles: &mut [], complexes: &mut complexes, words: &mut [] };
    map.apply_into(x, &mut out, &mut scratch);
    out
}

/// Vector-derived transformation binding by its definition: each block of the left vector times the matrix of the right.
fn transform(a: &[f32], b: &[f32]) -> Vec<f64> {
    let d = a.len().isqrt();
    let component = |n: usize| -> f64 {
        let (block, row) = (n / d, n % d);
        (0..d).map(|j| f64::from(b[row * d + j]) * f64::from(a[block * d + j])).sum()
    };
    (0..a.len()).map(|n| (d as f64).sqrt() * component(n)).collect()
}

proptest! {
    #[test]
    fn binding_is_what_its_definition_says(case in cases()) {
        let Case { algebra, a, b, .. } = &case;
        let exact = match algebra.name() {
            "HRR" => convolve(a, b),
            _ => transform(a, b),
        };
        for (fast, slow) in case.bind(a, b).iter().zip(exact) {
            prop_assert!((f64::from(*fast) - slow).abs() < 1e-5, "{fast} {slow}");
        }
    }

    #[test]
    fn binding_distributes_and_is_not_superposition(case in cases()) {
        let Case { a, b, c, .. } = &case;
        let (left, right) = (case.bind(a, &sum(b, c)), sum(&case.bind(a, b), &case.bind(a, c)));
        prop_assert!(far(&left, &right) < 1e-5);
        let (left, right) = (case.bind(&sum(a, b), c), sum(&case.bind(a, c), &case.bind(b, c)));
        prop_assert!(far(&left, &right) < 1e-5);
        // A wrong law must fail.
        prop_assert!(a.len() < 16 || far(&case.bind(a, b), &sum(a, b)) > 1e-2);
    }

    #[test]
    fn convolution_commutes_and_associates_and_transformation_does_not(case in cases()) {
        let Case { algebra, a, b, c } = &case;
        let swapped = far(&case.bind(a, b), &case.bind(b, a));
        let regrouped = far(&case.bind(&case.bind(a, b), c), &case.bind(a, &case.bind(b, c)));
        match algebra.name() {
            "HRR" => prop_assert!(swapped < 1e-5 && regrouped < 2e-5),
            _ => prop_assert!(a.len() < 16 || (swapped > 1e-3 && regrouped > 1e-3)),
        }
    }

    #[test]
    fn the_identity_and_the_inverse_do_what_they_should(case in cases()) {
        let Case { algebra, a, .. } = &case;
        let mut one = vec![0.0; a.len()];
        algebra.identity_into(&mut one);
        prop_assert!((norm(&one) - 1.0).abs() < 1e-5);
        prop_assert!(far(&case.bind(a, &one), a) < 1e-5);
        prop_assert_eq!(case.inverse(&case.inverse(a)), a.clone());
    }

    #[test]
    fn the_inverse_of_a_convolution_is_the_convolution_of_the_inverses(case in hrr()) {
        let Case { a, b, .. } = &case;
        let (left, right) = (case.inverse(&case.bind(a, b)), case.bind(&case.inverse(a), &case.inverse(b)));
        prop_assert!(far(&left, &right) < 1e-5);
    }

    #[test]
    fn unitary_vectors_keep_lengths_and_unbind_exactly(case in cases()) {
        let Case { a, b, .. } = &case;
        let role = case.unitary(a);
        prop_assert!((norm(&role) - 1.0).abs() < 1e-5);
        let bound = case.bind(b, &role);
        prop_assert!((norm(&bound) - norm(b)).abs() < 1e-5);
        prop_assert!(far(&case.bind(&bound, &case.inverse(&role)), b) < 1e-5);
        // Unbinding a vector that is not unitary is only approximate.
        if a.len() >= 64 {
            prop_assert!(far(&case.bind(&case.bind(b, a), &case.inverse(a)), b) > 1e-3);
        }
    }

    #[test]
    fn the_product_form_and_the_linear_maps_are_the_binding(case in cases()) {
        let Case { algebra, a, b, .. } = &case;
        let form = algebra.product_form(a.len());
        let pairs = match algebra.name() {
            "HRR" => 4 * (a.len() / 2 + 1),
            _ => a.len() * a.len().isqrt(),
        };
        prop_assert_eq!(form.pairs, pairs);
        let (left, right) = (apply(&*form.left, a), apply(&*form.right, b));
        let products: Vec<f32> = left.iter().zip(&right).map(|(x, y)| x * y).collect();
        prop_assert!(far(&apply(&*form.back, &products), &case.bind(a, b)) < 1e-5);
        prop_assert!(far(&apply(&*algebra.bind_with(b), a), &case.bind(a, b)) < 1e-5);
        prop_assert!(far(&apply(&*algebra.bind_onto(a), b), &case.bind(a, b)) < 1e-5);
    }

    #[test]
    fn binding_with_a_power_is_binding_as_often(case in cases()) {
        let Case { a, b, .. } = &case;
        let role = case.unitary(a);
        let thrice = case.bind(&case.bind(&case.bind(b, &role), &role), &role);
        prop_assert!(far(&case.bind(b, &case.power(&role, 3.0)?), &thrice) < 2e-5);
        prop_assert!(far(&case.bind(&thrice, &case.power(&role, -3.0)?), b) < 4e-5);
        prop_assert!(far(&case.power(a, -1.0)?, &case.inverse(a)) < 1e-6);
        prop_assert!(far(&case.power(a, 1.0)?, a) < 1e-5);
        let mut one = vec![0.0; a.len()];
        case.algebra.identity_into(&mut one);
        prop_assert!(far(&case.power(a, 0.0)?, &one) < 1e-5);
        let refused = matches!(case.power(a, f64::NAN), Err(VocabError::Exponent { .. }));
        prop_assert!(refused);
    }

    #[test]
    fn fractional_powers_of_a_convolution_add_their_exponents(case in hrr(), share in 0.0..1.0) {
        let Case { a, b, .. } = &case;
        // A square has no negative real values in its spectrum.
        let base = case.power(&case.unitary(a), 2.0)?;
        let (first, second) = (case.power(&base, share)?, case.power(&base, 1.0 - share)?);
        prop_assert!(far(&case.bind(&case.bind(b, &first), &second), &case.bind(b, &base)) < 1e-4);
    }

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
    let hrr = Case::of(&Hrr, 2, 1);
    let (bind, inverse) = (|a: &[f32], b: &[f32]| hrr.bind(a, b), |a: &[f32]| hrr.inverse(a));
    let v = small();
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
