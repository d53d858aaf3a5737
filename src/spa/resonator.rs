//! Factors a bound pointer: finds one item of each codebook whose binding it is, with a resonator network.
//!
//! Trying all combinations costs the product of the codebooks' sizes. A resonator network (Frady, Kent, Olshausen and
//! Sommer, "Resonator networks, 1", 2020; Kent and others, "Resonator networks, 2", 2020) keeps an estimate of every
//! factor. It unbinds all other estimates from the pointer, compares the result with the items of the codebook, and
//! takes the sum of the items, weighted by their similarities, as the next estimate. All combinations are searched in
//! superposition.
//!
//! Here the vectors are holographic reduced representations. In the half spectrum their binding multiplies complex
//! numbers, and the phases of the factors add up. The network therefore works with phases alone: the pointer and the
//! items are replaced by the nearest unitary vectors, so that unbinding an item is exact. Estimates are scaled to norm 1.
//! The papers also replace every component of an estimate by one of modulus 1. Here this made the search slower (39
//! rounds on average instead of 33, for three factors of 50 in 1,024 dimensions) and less robust to noise.
//!
//! A factorisation is checked by binding the items that were found. If it does not give the pointer, the network starts
//! again from other estimates.

use super::algebra::{Algebra, Hrr, Workspace, dot, normalize};
use super::error::VocabError;
use super::item_memory::dots;
use crate::sim::{Real, Seed};

/// Change of an estimate's cosine in one round below which the network has settled.
const SETTLED: Real = 1e-4;

/// The items that a [`Resonator`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct Factors {
    /// Index of the item in each codebook.
    pub items: Vec<usize>,
    /// Cosine between the pointer and the binding of the items, in phases alone: about 1 if the pointer is such a
    /// binding, and about 0 if the network found no factors. Noise on the pointer lowers it.
    pub fit: Real,
    /// Number of rounds, over all starts.
    pub rounds: usize,
}

/// Finds one item of each codebook whose binding a pointer is.
///
/// ```
/// use symbolt::sim::Seed;
/// use symbolt::spa::{Algebra, Hrr, Resonator, random_pointer};
///
/// // Three codebooks of 20 items, in 512 dimensions.
/// let book = |of: u64| -> Vec<f32> {
///     (0..20).flat_map(|i| random_pointer(512, Seed::new(100 * of + i))).collect()
/// };
/// let books = [book(1), book(2), book(3)];
/// let item = |book: usize, index: usize| &books[book][512 * index..512 * (index + 1)];
/// let (mut work, mut two, mut all) = (Hrr.scratch(512), vec![0.0; 512], vec![0.0; 512]);
/// Hrr.bind_into(item(0, 7), item(1, 3), &mut two, &mut work);
/// Hrr.bind_into(&two, item(2, 11), &mut all, &mut work);
///
/// let found = Resonator::new(512, &[&books[0], &books[1], &books[2]])?.factor(&all);
/// assert_eq!(found.items, [7, 3, 11]);
/// assert!(found.fit > 0.99);
/// # Ok::<(), symbolt::spa::VocabError>(())
/// ```
#[derive(Debug)]
pub struct Resonator {
    dim: usize,
    /// The codebooks' items as unitary vectors, row-major.
    books: Vec<Vec<Real>>,
    estimates: Vec<Vec<Real>>,
    inverses: Vec<Vec<Real>>,
    scores: Vec<Real>,
    pointer: Vec<Real>,
    unbound: Vec<Real>,
    next: Vec<Real>,
    work: Workspace,
}

impl Resonator {
    /// Greatest number of rounds from one start; one round updates every factor once.
    const ROUNDS: usize = 60;
    /// Greatest number of starts. The first starts from the sum of all items, the others from random sums.
    const STARTS: usize = 10;
    /// Fit at which a factorisation is accepted without another start.
    const ACCEPTED: Real = 0.5;

    /// Makes a resonator network for vectors of `dim` components. Each codebook is row-major, with `dim` numbers per
    /// item. At least two codebooks.
    ///
    /// # Errors
    /// [`VocabError::Dimension`] if the algebra cannot use `dim`; [`VocabError::BadVector`] if there are fewer than two
    /// codebooks, or a codebook is empty, is not a whole number of vectors, or has a component that is not finite.
    pub fn new(dim: usize, books: &[&[Real]]) -> Result<Self, VocabError> {
        Hrr.check_dim(dim)?;
        if books.len() < 2 {
            let reason = format!("there are {} codebooks; expected at least 2", books.len());
            return Err(VocabError::BadVector { name: "codebooks".into(), reason });
        }
        for (index, rows) in books.iter().enumerate() {
            super::pairs::check_some(&format!("codebook {index}"), rows, dim)?;
        }
        let mut work = Hrr.scratch(dim);
        let unitary = |rows: &&[Real]| {
            let mut rows = rows.to_vec();
            rows.chunks_exact_mut(dim).for_each(|row| Hrr.make_unitary(row, &mut work));
            rows
        };
        let owned: Vec<Vec<Real>> = books.iter().map(unitary).collect();
        let most = owned.iter().map(|rows| rows.len() / dim).max().unwrap_or(0);
        Ok(Self {
            dim,
            estimates: vec![vec![0.0; dim]; books.len()],
            inverses: vec![vec![0.0; dim]; books.len()],
            books: owned,
            scores: vec![0.0; most],
            pointer: vec![0.0; dim],
            unbound: vec![0.0; dim],
            next: vec![0.0; dim],
            work,
        })
    }

    /// Factors `pointer`. One call gives the same answer as any other with the same pointer. If a component is not
    /// finite, the fit is 0.
    ///
    /// Starts at most 10 times, for at most 60 rounds each, until the fit is at least 0.5. A round takes, for each of F codebooks,
    /// about 3 F transforms and two products per item and dimension. With three codebooks of 50 items in 1,024
    /// dimensions this is 0.2 ms.
    ///
    /// # Panics
    /// If `pointer` does not have the network's number of dimensions.
    pub fn factor(&mut self, pointer: &[Real]) -> Factors {
        let (found, dim) = (pointer.len(), self.dim);
        assert!(found == dim, "the pointer has {found} components; expected {dim}");
        let mut best = Factors { items: vec![0; self.books.len()], fit: 0.0, rounds: 0 };
        if !pointer.iter().all(|value| value.is_finite()) {
            return best;
        }
        self.pointer.copy_from_slice(pointer);
        Hrr.make_unitary(&mut self.pointer, &mut self.work);
        let mut rounds = 0;
        for start in 0..Self::STARTS {
            self.start(start);
            for _ in 0..Self::ROUNDS {
                rounds += 1;
                let turns = (0..self.books.len()).map(|factor| self.turn(factor));
                if turns.fold(0.0, Real::max) < SETTLED {
                    break;
                }
            }
            let items: Vec<usize> =
                (0..self.books.len()).map(|factor| self.nearest(factor)).collect();
            let fit = self.fit(&items);
            if fit > best.fit {
                best = Factors { items, fit, rounds };
            }
            if best.fit >= Self::ACCEPTED {
                break;
            }
        }
        best.rounds = rounds;
        best
    }

    /// Sets the estimates of one start.
    fn start(&mut self, start: usize) {
        for (index, rows) in self.books.iter().enumerate() {
            let estimate = &mut self.estimates[index];
            estimate.fill(0.0);
            let seed = Seed::new(start as u64).derive_index("factor", index as u64);
            let weights = super::random_pointer((rows.len() / self.dim).max(2), seed);
            for (row, weight) in rows.chunks_exact(self.dim).zip(weights) {
                let weight = if start == 0 { 1.0 } else { weight };
                estimate.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
            }
            normalize(estimate);
            Hrr.inverse_into(estimate, &mut self.inverses[index]);
        }
    }

    /// Replaces the estimate of one factor. Returns by how much its cosine with the last one is below 1.
    fn turn(&mut self, factor: usize) -> Real {
        self.unbound.copy_from_slice(&self.pointer);
        for (other, inverse) in self.inverses.iter().enumerate() {
            if other != factor {
                Hrr.bind_into(&self.unbound, inverse, &mut self.next, &mut self.work);
                std::mem::swap(&mut self.unbound, &mut self.next);
            }
        }
        let rows = &self.books[factor];
        let scores = &mut self.scores[..rows.len() / self.dim];
        dots(rows, &self.unbound, scores);
        self.next.fill(0.0);
        for (row, score) in rows.chunks_exact(self.dim).zip(&*scores) {
            self.next.iter_mut().zip(row).for_each(|(sum, value)| *sum += score * value);
        }
        normalize(&mut self.next);
        let estimate = &mut self.estimates[factor];
        let change = 1.0 - dot(estimate, &self.next);
        estimate.copy_from_slice(&self.next);
        Hrr.inverse_into(estimate, &mut self.inverses[factor]);
        change
    }

    /// Returns the item of a codebook that is most similar to the estimate, whatever the sign.
    fn nearest(&mut self, factor: usize) -> usize {
        let rows = &self.books[factor];
        let scores = &mut self.scores[..rows.len() / self.dim];
        dots(rows, &self.estimates[factor], scores);
        let best = scores.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        best.map_or(0, |(index, _)| index)
    }

    /// Returns the cosine between the pointer and the binding of one item of each codebook.
    fn fit(&mut self, items: &[usize]) -> Real {
        let item = |factor: usize| &self.books[factor][items[factor] * self.dim..][..self.dim];
        self.unbound.copy_from_slice(item(0));
        for factor in 1..items.len() {
            Hrr.bind_into(&self.unbound, item(factor), &mut self.next, &mut self.work);
            std::mem::swap(&mut self.unbound, &mut self.next);
        }
        normalize(&mut self.unbound);
        dot(&self.unbound, &self.pointer)
    }
}
