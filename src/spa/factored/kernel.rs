//! The loops of factored items: similarities of atoms, and sums of these for items.

use multiversion::multiversion;

use crate::sim::Real;

/// Number of atoms whose similarities are computed together.
pub(super) const ATOMS: usize = 32;
/// Number of items that are summed together.
pub(super) const ITEMS: usize = 8;

/// Returns the dot products of a query with the atoms of a block.
///
/// A block holds [`ATOMS`] atoms, component by component. Every dot product is summed in the order of the
/// components, so its bits do not depend on the width of the registers.
#[inline(always)]
fn block_of(block: &[[Real; ATOMS]], query: &[Real]) -> [Real; ATOMS] {
    let mut sums = [0.0; ATOMS];
    for (row, value) in block.iter().zip(query) {
        for lane in 0..ATOMS {
            sums[lane] += row[lane] * value;
        }
    }
    sums
}

/// Writes the dot products of `K` queries with all atoms to `scores`, one row of `K` per atom.
#[inline(always)]
fn atoms_of<const K: usize>(blocks: &[Real], queries: [&[Real]; K], scores: &mut [[Real; K]]) {
    let dim = queries[0].len();
    for (block, scores) in blocks.chunks_exact(dim * ATOMS).zip(scores.chunks_exact_mut(ATOMS)) {
        let (block, _) = block.as_chunks::<ATOMS>();
        // The block stays in the cache for the second query.
        for (k, query) in queries.iter().enumerate() {
            let sums = block_of(block, query);
            scores.iter_mut().zip(sums).for_each(|(score, sum)| score[k] = sum);
        }
    }
}

/// Items with the same number of terms, [`ITEMS`] at a time.
pub(super) struct Group {
    /// Number of terms of each item.
    pub terms: usize,
    /// Positions of the items.
    pub items: Vec<u32>,
    /// Atoms, by block of items, then by term, then by item. Places without an item have atom 0.
    pub atoms: Vec<u16>,
    /// Weights in the order of the atoms; empty if all weights are 1.
    pub weights: Vec<Real>,
}

/// Writes the similarities of the items of a group to `out`, one row of `K` per item.
#[inline(always)]
fn items_of<const K: usize>(group: &Group, scores: &[[Real; K]], out: &mut [[Real; K]]) {
    let wide = group.terms * ITEMS;
    if wide == 0 {
        group.items.iter().for_each(|item| out[*item as usize] = [0.0; K]);
        return;
    }
    for (index, (items, atoms)) in
        group.items.chunks(ITEMS).zip(group.atoms.chunks_exact(wide)).enumerate()
    {
        let (rows, _) = atoms.as_chunks::<ITEMS>();
        let mut sums = [[0.0; K]; ITEMS];
        if group.weights.is_empty() {
            for row in rows {
                for (sums, atom) in sums.iter_mut().zip(row) {
                    let score = &scores[*atom as usize];
                    for k in 0..K {
                        sums[k] += score[k];
                    }
                }
            }
        } else {
            let weights = &group.weights[index * wide..(index + 1) * wide];
            let (weights, _) = weights.as_chunks::<ITEMS>();
            for (row, weights) in rows.iter().zip(weights) {
                for ((sums, atom), weight) in sums.iter_mut().zip(row).zip(weights) {
                    let score = &scores[*atom as usize];
                    for k in 0..K {
                        sums[k] += weight * score[k];
                    }
                }
            }
        }
        for (item, sums) in items.iter().zip(sums) {
            out[*item as usize] = sums;
        }
    }
}

macro_rules! kernels {
    ($($name:ident $queries:literal)*) => {$(
        #[multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
        fn $name(
            (blocks, groups): (&[Real], &[Group]),
            queries: [&[Real]; $queries],
            scores: &mut [[Real; $queries]],
            out: &mut [[Real; $queries]],
        ) {
            atoms_of(blocks, queries, scores);
            groups.iter().for_each(|group| items_of(group, scores, out));
        }
    )*};
}

kernels! { one 1 two 2 }

/// Writes the similarities of all items to one query. `scores` and `out` are working memory: one number per padded
/// atom, and one per item.
pub(super) fn similarities_to_one(
    of: (&[Real], &[Group]),
    query: &[Real],
    scores: &mut [Real],
    out: &mut [Real],
) {
    one(of, [query], scores.as_chunks_mut().0, out.as_chunks_mut().0);
}

/// Writes the similarities of all items to two queries, two numbers per item. `scores` has two numbers per padded atom.
/// Reads the memory once for both.
pub(super) fn similarities_to_two(
    of: (&[Real], &[Group]),
    queries: [&[Real]; 2],
    scores: &mut [Real],
    out: &mut [Real],
) {
    two(of, queries, scores.as_chunks_mut().0, out.as_chunks_mut().0);
}
