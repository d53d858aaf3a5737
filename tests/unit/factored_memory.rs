use rand::RngExt;

use super::*;
use crate::sim::Seed;
use crate::spa::random_pointer;

#[path = "../support/factored.rs"]
mod factored;
use factored::{drawn, furthest};

#[test]
fn two_queries_at_once_give_the_bits_of_each_alone() {
    for (dim, atoms, weighted) in [(64, 40, true), (65, 32, false), (3, 1, true), (100, 77, false)]
    {
        let items = drawn(dim, atoms, weighted);
        let queries = [1, 2].map(|seed| random_pointer(dim, Seed::new(900 + seed)));
        let alone = queries.each_ref().map(|query| {
            let mut found = vec![0.0; items.len()];
            items.similarities_into(query, &mut found);
            found
        });
        let mut scores = vec![0.0; 2 * items.padded_atoms()];
        let mut both = vec![0.0; 2 * items.len()];
        items.apply([&queries[0], &queries[1]], &mut scores, &mut both);
        assert!(both.iter().step_by(2).eq(&alone[0]));
        assert!(both.iter().skip(1).step_by(2).eq(&alone[1]));
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
