//! Item memories, memories of factored items, and the decoder of pairs.

#![allow(clippy::expect_used)]

use rand::RngExt;
use symbolt::sim::{Real, Seed};
use symbolt::spa::{
    Algebra, FactoredItems, Hrr, ItemMemory, Match, PairDecoder, dot, random_pointer,
};

#[path = "../support/factored.rs"]
mod factored;
use factored::{drawn, furthest};

fn memory(items: u64, dim: usize) -> ItemMemory {
    let rows = (0..items).flat_map(|i| random_pointer(dim, Seed::new(i))).collect();
    match ItemMemory::new(rows, dim) {
        Ok(memory) => memory,
        Err(error) => panic!("{error}"),
    }
}

fn brute_force(memory: &ItemMemory, query: &[Real]) -> Option<usize> {
    let mut all = vec![0.0; memory.len()];
    memory.similarities_into(query, &mut all);
    (0..all.len()).max_by(|a, b| all[*a].total_cmp(&all[*b]).then(b.cmp(a)))
}

#[test]
fn the_screened_answer_is_the_exact_one() {
    let mut checked = 0;
    for (items, dim) in [(1, 2), (7, 3), (500, 64), (999, 127), (400, 128), (300, 257)] {
        let memory = memory(items, dim);
        let mut queries = Vec::new();
        for i in 0..50 {
            // Pure noise and noisy items, at three scales.
            let noise = random_pointer(dim, Seed::new(90_000 + i));
            let item = memory.row(i as usize % memory.len()).unwrap_or(&noise);
            let scale = [1.0, 1e-20, 1e15][i as usize % 3];
            let mix = [0.0, 0.5, 3.0][i as usize / 17];
            queries.extend(item.iter().zip(&noise).map(|(x, n)| scale * (mix * x + n)));
        }
        let batch = memory.best_batch(&queries);
        for (query, found) in queries.chunks_exact(dim).zip(&batch) {
            let single = memory.best(query);
            assert_eq!(single, *found);
            assert_eq!(found.map(|f| f.index), brute_force(&memory, query));
            checked += 1;
        }
    }
    assert_eq!(checked, 300);
}

#[test]
fn of_equal_items_the_first_is_found() {
    let one = random_pointer(100, Seed::new(1));
    let other = random_pointer(100, Seed::new(2));
    let rows = [&other[..], &one[..], &one[..]].concat();
    let memory = ItemMemory::new(rows, 100);
    assert_eq!(memory.map(|m| m.best(&one).map(|f| f.index)), Ok(Some(1)));
}

#[test]
fn a_query_that_is_no_number_finds_nothing() {
    let memory = memory(10, 16);
    let mut query = random_pointer(16, Seed::new(1));
    query[3] = Real::NAN;
    assert_eq!(memory.best(&query), None);
    assert!(ItemMemory::new(query, 16).is_err());
    assert!(ItemMemory::new(vec![0.0; 5], 2).is_err());
    assert_eq!(ItemMemory::new(Vec::new(), 2).map(|m| m.best(&[1.0, 0.0])), Ok(None));
}

#[test]
fn zero_vectors_are_harmless() {
    let memory = ItemMemory::new(vec![0.0; 12], 4);
    assert_eq!(memory.map(|m| m.best(&[0.0; 4])), Ok(Some(Match { index: 0, similarity: 0.0 })));
}

fn vectors(from: u64, count: u64, dim: usize) -> Vec<Real> {
    (from..from + count).flat_map(|i| random_pointer(dim, Seed::new(i))).collect()
}

/// The sum of the first pairs, plus noise of norm `sigma`.
fn sum(dim: usize, roles: &[Real], items: &[Real], sigma: Real) -> Vec<Real> {
    let mut sum = random_pointer(dim, Seed::new(999));
    sum.iter_mut().for_each(|v| *v *= sigma);
    let (mut work, mut pair) = (Hrr.scratch(dim), vec![0.0; dim]);
    for (role, item) in roles.chunks_exact(dim).zip(items.chunks_exact(dim)) {
        Hrr.bind_into(role, item, &mut pair, &mut work);
        sum.iter_mut().zip(&pair).for_each(|(s, p)| *s += p);
    }
    sum
}

#[test]
fn an_earlier_sum_leaves_nothing_behind() {
    let (roles, items) = (vectors(0, 6, 128), vectors(50, 20, 128));
    let mut decoder = PairDecoder::new(128, &roles, &items).expect("sound");
    let noisy = sum(128, &roles, &items, 0.5);
    let first = decoder.read(&noisy).to_vec();
    decoder.read(&random_pointer(128, Seed::new(7)));
    assert_eq!(decoder.read(&noisy), first);
    let right = first.iter().enumerate().filter(|(at, filler)| filler.item == *at);
    assert_eq!(right.count(), 6);
    assert!(first.iter().all(|filler| filler.weight > 0.9 && filler.weight <= 1.0));
    let mut broken = noisy.clone();
    broken[3] = Real::NAN;
    assert!(decoder.read(&broken).iter().all(|filler| filler.weight == 0.0));
    assert_eq!(decoder.read(&noisy), first);
}

#[test]
fn weights_say_how_sure_a_reading_is() {
    // 300 overloaded sums of nine pairs in 32 dimensions, with noise. Each bin counts the readings of similar
    // weight, and how many of them are right.
    let mut bins = [[0.0; 2]; 4];
    for trial in 0..300 {
        let (roles, items) = (vectors(100 * trial, 9, 32), vectors(100 * trial + 9, 40, 32));
        let mut decoder = PairDecoder::new(32, &roles, &items).expect("sound");
        for (at, filler) in decoder.read(&sum(32, &roles, &items, 0.5)).iter().enumerate() {
            let bin = &mut bins[((filler.weight * 4.0) as usize).min(3)];
            *bin = [bin[0] + 1.0, bin[1] + f64::from(u8::from(filler.item == at))];
        }
    }
    let [lowest, low, high, highest] = bins.map(|[all, right]| right / all);
    // Three standard errors of a share of at least 100 readings are at most 15 percentage points.
    assert!(bins.iter().all(|[all, _]| *all >= 100.0), "{bins:?}");
    assert!(lowest < 0.45 && highest > 0.95, "{bins:?}");
    assert!(lowest + 0.1 < low && low + 0.05 < high && high < highest, "{bins:?}");
}

#[test]
fn what_cannot_be_decoded_is_refused() {
    let (roles, items) = (vectors(0, 2, 64), vectors(50, 4, 64));
    let reason = |dim, roles: &[Real], items: &[Real]| {
        PairDecoder::new(dim, roles, items).expect_err("refused").to_string()
    };
    assert!(reason(0, &roles, &items).contains("0 dimensions"));
    assert!(reason(60, &roles, &items).contains("128 numbers"));
    assert!(reason(64, &[], &items).contains("roles"));
    let mut odd = items.clone();
    odd[70] = Real::NAN;
    assert!(reason(64, &roles, &odd).contains("component 6 of vector 1 is NaN"));
}

#[test]
fn broken_memories_are_refused_with_the_place() {
    let atoms = random_pointer(8, Seed::new(1));
    let refused = |atoms: Vec<Real>, dim, terms: Vec<(usize, Real)>| {
        FactoredItems::new(atoms, dim, [vec![], terms]).err().map(|e| e.to_string())
    };
    let cases = [
        (refused(atoms.clone(), 8, vec![(1, 1.0)]), "item 1 has the weight 1 for atom 1"),
        (refused(atoms.clone(), 8, vec![(0, Real::NAN)]), "item 1 has the weight NaN"),
        (refused(atoms.clone(), 3, vec![]), "8 numbers for atoms of 3 dimensions"),
        (refused(atoms.clone(), 0, vec![]), "8 numbers for atoms of 0 dimensions"),
        (refused(vec![0.0, Real::INFINITY], 2, vec![]), "component 1 of atom 0 is inf"),
    ];
    for (error, expected) in cases {
        let error = error.unwrap_or_default();
        assert!(error.contains(expected), "{error}");
    }
    assert!(refused(atoms, 8, vec![(0, 1.0)]).is_none());
}

/// Similarities computed in double precision from the items as dense vectors.
fn dense(items: &FactoredItems, query: &[Real]) -> Vec<Real> {
    (0..items.len()).map(|index| dot(&items.item(index), query)).collect()
}

#[test]
fn factored_similarities_are_those_of_dense_items() {
    for (dim, atoms, weighted) in [(64, 40, true), (65, 32, false), (3, 1, true), (100, 77, false)]
    {
        let items = drawn(dim, atoms, weighted);
        let query = random_pointer(dim, Seed::new(901));
        let mut found = vec![0.0; items.len()];
        items.similarities_into(&query, &mut found);
        let exact = dense(&items, &query);
        assert!(exact.iter().filter(|value| value.abs() > 0.05).count() > 100);
        assert!(furthest(&found, &exact) < 1e-5, "{}", furthest(&found, &exact));
        // A memory that lost one term of one item is found out.
        let mut wrong: Vec<Vec<(usize, Real)>> = (0..items.len())
            .map(|i| items.terms(i).iter().map(|(atom, w)| (*atom as usize, *w)).collect())
            .collect();
        wrong[12].pop();
        let rows = (0..atoms).filter_map(|i| items.atom(i)).flatten().copied().collect();
        let wrong = FactoredItems::new(rows, dim, wrong).expect("valid");
        wrong.similarities_into(&query, &mut found);
        assert!(furthest(&found, &exact) > 1e-3);
    }
}

#[test]
fn positions_outside_the_memory_give_nothing() {
    let items = drawn(4, 3, true);
    for outside in [500, usize::MAX] {
        assert!(items.terms(outside).is_empty());
        assert_eq!(items.item(outside), [0.0; 4]);
    }
    for outside in [3, usize::MAX] {
        assert!(items.atom(outside).is_none());
    }
    assert!(items.atom(2).is_some() && items.terms(499).len() == 499 % 13);
}
