//! Items of a factored memory, drawn from seeds. Types come from whoever includes this file: the library's own tests or others.

use super::*;

pub fn drawn(dim: usize, atoms: usize, weighted: bool) -> FactoredItems {
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

pub fn furthest(a: &[Real], b: &[Real]) -> Real {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, Real::max)
}
