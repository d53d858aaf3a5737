use rand::RngExt;

use super::*;
use crate::sim::Seed;
use crate::spa::algebra::dot;
use crate::spa::random_pointer;

fn drawn(dim: usize, atoms: usize, weighted: bool) -> FactoredItems {
    let rows = (0..atoms).flat_map(|i| random_pointer(dim, Seed::new(i as u64))).collect();
    let mut rng = Seed::new(77).rng();
    let items: Vec<Vec<(usize, Real)>> = (0..500)
        .map(|item| {
            let term = |_| {
                let weight = if weighted { 2.0 * rng.random::<Real>() - 1.0 } else { 1.0 };
                (rng.random_range(0..atoms), weight)
            };
            (0..item % 13).map(term).collect()
        })
        .collect();
    FactoredItems::new(rows, dim, items).expect("valid")
}

/// Similarities computed in double precision from the items as dense vectors.
fn dense(items: &FactoredItems, query: &[Real]) -> Vec<Real> {
    (0..items.len()).map(|index| dot(&items.item(index), query)).collect()
}

fn furthest(a: &[Real], b: &[Real]) -> Real {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, Real::max)
}

#[test]
fn factored_similarities_are_those_of_dense_items() {
    for (dim, atoms, weighted) in [(64, 40, true), (65, 32, false), (3, 1, true), (100, 77, false)]
    {
        let items = drawn(dim, atoms, weighted);
        let queries = [1, 2].map(|seed| random_pointer(dim, Seed::new(900 + seed)));
        let mut found = vec![0.0; items.len()];
        items.similarities_into(&queries[0], &mut found);
        let exact = queries.each_ref().map(|query| dense(&items, query));
        assert!(exact[0].iter().filter(|value| value.abs() > 0.05).count() > 100);
        assert!(furthest(&found, &exact[0]) < 1e-5, "{}", furthest(&found, &exact[0]));
        // Two queries at once give the same bits as each alone.
        let mut scores = vec![0.0; 2 * items.padded_atoms()];
        let mut both = vec![0.0; 2 * items.len()];
        items.apply([&queries[0], &queries[1]], &mut scores, &mut both);
        let first: Vec<Real> = both.iter().step_by(2).copied().collect();
        let second: Vec<Real> = both.iter().skip(1).step_by(2).copied().collect();
        assert_eq!(first, found);
        assert!(furthest(&second, &exact[1]) < 1e-5);
        // A memory that lost one term of one item is found out.
        let mut wrong: Vec<Vec<(usize, Real)>> = (0..items.len())
            .map(|i| items.terms(i).iter().map(|(atom, w)| (*atom as usize, *w)).collect())
            .collect();
        wrong[12].pop();
        let wrong = FactoredItems::new(items.atoms.clone(), dim, wrong).expect("valid");
        wrong.similarities_into(&queries[0], &mut found);
        assert!(furthest(&found, &exact[0]) > 1e-3);
    }
}

#[test]
fn a_sum_of_items_is_the_sum_of_their_vectors() {
    let items = drawn(48, 20, true);
    let mut weights = vec![0.0; items.len()];
    (weights[7], weights[400]) = (0.5, -2.0);
    let (mut sums, mut out) = (vec![0.0; items.atoms()], vec![0.0; 48]);
    items.combine(&weights, &mut sums, &mut out);
    let exact: Vec<Real> =
        items.item(7).iter().zip(items.item(400)).map(|(a, b)| 0.5 * a - 2.0 * b).collect();
    assert!(exact.iter().any(|v| v.abs() > 0.1) && furthest(&out, &exact) < 1e-5);
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
