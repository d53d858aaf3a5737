//! Predicted capacities, against sampled decoding and cleanup.

#![allow(clippy::unwrap_used)]

use rand_distr::{Distribution, StandardNormal};
use symbolt::sim::{Real, Seed, VocabTag};
use symbolt::spa::{Algebra, Capacity, Hrr, VocabularyBuilder, dot, random_pointer};

/// Returns the share of trials in which the right filler is decoded, and its standard error.
fn sampled(size: &Capacity, trials: u64) -> (f64, f64) {
    let Capacity { dimensions: dim, pairs, items, noise, unitary_roles, .. } = *size;
    let mut work = Hrr.scratch(dim);
    let mut right = 0;
    for trial in 0..trials {
        let seed = Seed::new(9).derive_index("trial", trial);
        let mut rng = seed.derive("", "noise").rng();
        let fillers: Vec<Vec<Real>> =
            (0..items).map(|i| random_pointer(dim, seed.derive_index("item", i as u64))).collect();
        let sd = (noise / (dim as f64).sqrt()) as Real;
        let mut sum: Vec<Real> =
            (0..dim).map(|_| -> Real { StandardNormal.sample(&mut rng) }).map(|z| sd * z).collect();
        let (mut first, mut pair) = (Vec::new(), vec![0.0; dim]);
        for (i, filler) in fillers.iter().enumerate().take(pairs) {
            let mut role = random_pointer(dim, seed.derive_index("role", i as u64));
            if unitary_roles {
                Hrr.make_unitary(&mut role, &mut work);
            }
            Hrr.bind_into(&role, filler, &mut pair, &mut work);
            sum.iter_mut().zip(&pair).for_each(|(s, p)| *s += p);
            if i == 0 {
                first = role;
            }
        }
        let (mut inverse, mut found) = (vec![0.0; dim], vec![0.0; dim]);
        Hrr.inverse_into(&first, &mut inverse);
        Hrr.bind_into(&sum, &inverse, &mut found, &mut work);
        let score = |i: &usize| dot(&found, &fillers[*i]);
        let best = (0..items).max_by(|a, b| score(a).total_cmp(&score(b)));
        right += u64::from(best == Some(0));
    }
    let share = right as f64 / trials as f64;
    (share, (share * (1.0 - share) / trials as f64).sqrt())
}

#[test]
fn the_prediction_agrees_with_sampled_decoding() {
    let base = Capacity { dimensions: 64, pairs: 4, items: 32, ..Capacity::default() };
    for size in [
        base,
        Capacity { unitary_roles: true, dimensions: 32, ..base },
        Capacity { noise: 1.5, ..base },
        Capacity { dimensions: 128, pairs: 8, ..base },
        Capacity { dimensions: 32, pairs: 2, items: 100, ..base },
    ] {
        let (share, error) = sampled(&size, 1_000);
        let predicted = size.reliability();
        // 4 standard errors: a false alarm in one of 3,000 runs of five cases; 0.02 for the limit of large D.
        assert!((share - predicted).abs() < 4.0 * error + 0.02, "{size:?}: {share} {predicted}");
        // A formula that forgets the other pairs must be caught.
        let wrong = Capacity { pairs: 1, ..size }.reliability();
        assert!((share - wrong).abs() > 0.03, "{size:?}: {share} {wrong}");
    }
}

#[test]
fn the_dimensions_needed_are_the_least_that_suffice() {
    let size = Capacity { pairs: 6, items: 1_000, ..Capacity::default() };
    let needed = size.dimensions_for(0.99).unwrap();
    let at = |dimensions| Capacity { dimensions, ..size }.reliability();
    assert!(at(needed) >= 0.99 && at(needed - 1) < 0.99, "{needed}");
    assert_eq!(size.dimensions_for(1.5), None);
    assert_eq!(Capacity { items: 1, ..size }.reliability(), 1.0);
    assert_eq!(Capacity { noise: f64::NAN, ..size }.reliability(), 0.0);
}

#[test]
fn the_prediction_for_a_vocabulary_agrees_with_sampled_cleanup() {
    struct Things;
    impl VocabTag for Things {
        const NAME: &'static str = "things";
    }
    // Half of the names resemble another one closely.
    let mut builder = VocabularyBuilder::<Things>::new(64, Seed::new(2)).any_similarity();
    for i in 0..20 {
        builder = builder.pointer(format!("N{i}")).pointer(format!("M{i}"));
        builder = builder.define(format!("L{i}"), format!("0.8 * N{i} + 0.6 * M{i}"));
    }
    let things = builder.build().unwrap();
    let (noise, trials) = (2.0, 6_000u64);
    let (mut right, mut rng) = (0, Seed::new(5).rng());
    let sd = (noise / 64f64.sqrt()) as Real;
    for trial in 0..trials as usize {
        let own = trial % things.len();
        let mut query = things.vector(own).unwrap().to_vec();
        for value in &mut query {
            let z: Real = StandardNormal.sample(&mut rng);
            *value += sd * z;
        }
        let score = |i: &usize| dot(&query, &things.vector(*i).unwrap());
        let best = (0..things.len()).max_by(|a, b| score(a).total_cmp(&score(b)));
        right += u64::from(best == Some(own));
    }
    let share = right as f64 / trials as f64;
    let predicted = things.reliability(noise);
    assert!((share - predicted).abs() < 0.03, "{share} {predicted}");
    // Without the similar names cleanup would look much better.
    let names: Vec<String> = (0..20).map(|i| format!("N{i}")).collect();
    let apart = things.subset(names.iter().map(String::as_str)).unwrap();
    assert!(apart.reliability(noise) > share + 0.03);
    assert!(things.reliability(0.0) > 0.999);
}
