//! Decodes all fillers of a sum of role-filler pairs at once, by soft interference cancellation.
//!
//! The usual read-out unbinds one role and takes the most similar item (linear read-out). All other pairs act as
//! noise. Subtracting pairs that are already read helps only if they were read correctly; wrong readings add noise.
//!
//! This decoder subtracts the expected value of each pair. It keeps a weight for every item of every role. While it
//! knows little, the weights are small and nearly equal, and it subtracts almost nothing from an overloaded sum.
//!
//! The decoder visits one role after another. Let r be the sum minus the expected values of the pairs of all other
//! roles, p the visited role bound to an item, and v the variance of Gaussian interference per component. Then the log
//! likelihood of the item is `(p . r - |p|^2 / 2) / v`, up to a constant. The weights of the role move half of the way
//! to the normalised likelihoods. The variance v follows from how much of the other pairs is still unknown, or from
//! the part of the sum that is still unexplained, whichever is greater.
//!
//! The method is multistage detection with soft decisions, used in receivers for several users of one channel
//! (Divsalar, Simon and Raphaeli 1998; analysed by Tanaka and Okada 2005). Here the alphabet is a vocabulary. The
//! experiment `capacity` compares the method with linear read-out.

use super::algebra::{Algebra, Hrr, Workspace, dot};
use super::error::{VocabError, check_rows};
use super::item_memory::dots;
use crate::sim::Real;

/// Fraction of the way that weights move towards their new values in one turn.
const DAMPING: Real = 0.5;
/// Change of a weight in one round below which the decoder has converged.
const TOLERANCE: Real = 1e-3;
/// Least variance, summed over all components. It allows for rounding.
const MIN_VARIANCE: Real = 1e-3;

/// The item that a [`PairDecoder`] reads for a role.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filler {
    /// Index of the item among the decoder's items.
    pub item: usize,
    /// Weight of the item, 0 to 1. The weights of all items for one role add up to 1. If the sum was not finite, all
    /// weights are 0.
    ///
    /// Greater weights mark more reliable readings, but a weight is not a probability. In overloaded sums more
    /// readings are right than the weights suggest. In other sums, fewer readings are right.
    pub weight: Real,
}

/// A decoder of sums `ROLE1 * FILLER1 + ROLE2 * FILLER2 + ...` of holographic reduced representations.
///
/// The roles are known. Every filler is one of the decoder's items. All vectors have a norm of about 1.
///
/// The decoder reads all fillers together, by soft interference cancellation. For each role it subtracts the expected
/// values of all other pairs, and repeats this until the weights of the items settle. It reads more fillers correctly
/// than unbinding one role at a time (multistage detection with soft decisions: Divsalar, Simon and Raphaeli 1998;
/// Tanaka and Okada 2005).
///
/// ```
/// use symbolt::sim::Seed;
/// use symbolt::spa::{Algebra, Hrr, PairDecoder, random_pointer};
///
/// // Twelve pairs in 256 dimensions, of 64 items.
/// let vectors = |from: u64, count: u64| -> Vec<f32> {
///     (from..from + count).flat_map(|i| random_pointer(256, Seed::new(i))).collect()
/// };
/// let (roles, items) = (vectors(0, 12), vectors(100, 64));
/// let (mut work, mut pair, mut sum) = (Hrr.scratch(256), vec![0.0; 256], vec![0.0; 256]);
/// for (role, item) in roles.chunks(256).zip(items.chunks(256)) {
///     Hrr.bind_into(role, item, &mut pair, &mut work);
///     sum.iter_mut().zip(&pair).for_each(|(s, p)| *s += p);
/// }
/// let mut decoder = PairDecoder::new(256, &roles, &items)?;
/// let read: Vec<usize> = decoder.read(&sum).iter().map(|filler| filler.item).collect();
/// assert_eq!(read, (0..12).collect::<Vec<_>>());
/// # Ok::<(), symbolt::spa::VocabError>(())
/// ```
#[derive(Debug)]
pub struct PairDecoder {
    dim: usize,
    roles: Vec<Real>,
    inverses: Vec<Real>,
    items: Vec<Real>,
    /// Squared norms of all bound pairs, `roles x items`.
    lengths: Vec<Real>,
    /// Weight of each item for each role, `roles x items`.
    weights: Vec<Real>,
    /// Expected value of each pair, `roles x dim`.
    expected: Vec<Real>,
    /// Fraction of the squared norm of each pair that is still unknown.
    unknown: Vec<Real>,
    /// The sum minus the expected values of all pairs.
    unexplained: Vec<Real>,
    /// `unexplained` plus the expected value of the current pair.
    rest: Vec<Real>,
    unbound: Vec<Real>,
    filler: Vec<Real>,
    scores: Vec<Real>,
    read: Vec<Filler>,
    work: Workspace,
}

/// Checks that `rows` are one or more vectors of `dim` finite numbers.
pub(super) fn check_some(name: &str, rows: &[Real], dim: usize) -> Result<(), VocabError> {
    if rows.is_empty() || !rows.len().is_multiple_of(dim) {
        let numbers = rows.len();
        let reason = format!(
            "{numbers} numbers are not whole vectors of {dim}; expected a multiple of {dim} above 0"
        );
        return Err(VocabError::BadVector { name: name.into(), reason });
    }
    check_rows(name, "vector", rows, dim)
}

impl PairDecoder {
    /// Greatest number of rounds; one round visits every role once.
    pub const ROUNDS: usize = 24;

    /// Makes a decoder for vectors of `dim` components. `roles` and `items` are row-major, with `dim` numbers per
    /// vector.
    ///
    /// Costs 3 transforms per role and per item, and roles x items x `dim` products. Allocates all memory that reading
    /// needs.
    ///
    /// # Errors
    /// [`VocabError::Dimension`] if the algebra cannot use `dim`; [`VocabError::BadVector`] if `roles` or `items` is
    /// empty, is not a whole number of vectors, or has a component that is not finite.
    pub fn new(dim: usize, roles: &[Real], items: &[Real]) -> Result<Self, VocabError> {
        Hrr.check_dim(dim)?;
        for (name, rows) in [("roles", roles), ("items", items)] {
            check_some(name, rows, dim)?;
        }
        let mut work = Hrr.scratch(dim);
        let mut inverses = vec![0.0; roles.len()];
        for (role, inverse) in roles.chunks_exact(dim).zip(inverses.chunks_exact_mut(dim)) {
            Hrr.inverse_into(role, inverse);
        }
        // The squared norm of a bound pair is the dot product of the autocorrelations of its two parts.
        let mut inverse = vec![0.0; dim];
        let mut with_itself = |part: &[Real], out: &mut [Real]| {
            Hrr.inverse_into(part, &mut inverse);
            Hrr.bind_into(part, &inverse, out, &mut work);
        };
        let mut correlations = vec![0.0; items.len()];
        for (item, out) in items.chunks_exact(dim).zip(correlations.chunks_exact_mut(dim)) {
            with_itself(item, out);
        }
        let (pairs, count) = (roles.len() / dim, items.len() / dim);
        let (mut own, mut lengths) = (vec![0.0; dim], vec![0.0; pairs * count]);
        for (role, lengths) in roles.chunks_exact(dim).zip(lengths.chunks_exact_mut(count)) {
            with_itself(role, &mut own);
            dots(&correlations, &own, lengths);
        }
        Ok(Self {
            dim,
            roles: roles.to_vec(),
            inverses,
            items: items.to_vec(),
            lengths,
            weights: vec![0.0; pairs * count],
            expected: vec![0.0; roles.len()],
            unknown: vec![1.0; pairs],
            unexplained: vec![0.0; dim],
            rest: vec![0.0; dim],
            unbound: vec![0.0; dim],
            filler: vec![0.0; dim],
            scores: vec![0.0; count],
            read: vec![Filler { item: 0, weight: 0.0 }; pairs],
            work,
        })
    }

    /// Decodes the filler of every role, in the order of the roles. If a component of `sum` is not finite, all
    /// weights are 0.
    ///
    /// Costs at most [`ROUNDS`](Self::ROUNDS) x roles x (6 transforms + items x dimensions products), with twice as
    /// many products while all items still have weight. Allocates nothing.
    ///
    /// # Panics
    /// If `sum` does not have the decoder's number of dimensions.
    pub fn read(&mut self, sum: &[Real]) -> &[Filler] {
        let (found, dim) = (sum.len(), self.dim);
        assert!(found == dim, "the sum has {found} components; expected {dim}");
        self.weights.fill(0.0);
        self.expected.fill(0.0);
        self.unknown.fill(1.0);
        self.unexplained.copy_from_slice(sum);
        if !sum.iter().all(|v| v.is_finite()) {
            self.read.fill(Filler { item: 0, weight: 0.0 });
            return &self.read;
        }
        for _ in 0..Self::ROUNDS {
            let turns = (0..self.unknown.len()).map(|pair| self.turn(pair));
            if turns.fold(0.0, Real::max) < TOLERANCE {
                break;
            }
        }
        let count = self.scores.len();
        for (read, weights) in self.read.iter_mut().zip(self.weights.chunks_exact(count)) {
            let weighed = weights.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
            *read = weighed.map_or(*read, |(item, weight)| Filler { item, weight: *weight });
        }
        &self.read
    }

    /// Moves the weights of one pair towards the values that follow from all other pairs. Returns the greatest change
    /// of a weight.
    fn turn(&mut self, pair: usize) -> Real {
        let (dim, count) = (self.dim, self.scores.len());
        let weights = &mut self.weights[pair * count..][..count];
        let expected = &mut self.expected[pair * dim..][..dim];
        for ((r, u), e) in self.rest.iter_mut().zip(&self.unexplained).zip(&*expected) {
            *r = u + e;
        }
        let inverse = &self.inverses[pair * dim..][..dim];
        Hrr.bind_into(&self.rest, inverse, &mut self.unbound, &mut self.work);
        dots(&self.items, &self.unbound, &mut self.scores);
        let others = self.unknown.iter().sum::<Real>() - self.unknown[pair];
        let left = dot(&self.unexplained, &self.unexplained);
        let variance = others.max(left).max(MIN_VARIANCE) / dim as Real;
        for (score, length) in self.scores.iter_mut().zip(&self.lengths[pair * count..]) {
            *score = (*score - length / 2.0) / variance;
        }
        let most = self.scores.iter().copied().fold(Real::NEG_INFINITY, Real::max);
        self.scores.iter_mut().for_each(|score| *score = (*score - most).exp());
        let all: Real = self.scores.iter().sum();
        self.filler.fill(0.0);
        let (mut known, mut change) = (0.0, 0.0);
        let items = self.items.chunks_exact(dim);
        for ((weight, new), item) in weights.iter_mut().zip(&self.scores).zip(items) {
            let step = DAMPING * (new / all - *weight);
            change = Real::max(change, step.abs());
            *weight += step;
            known += *weight * *weight;
            if *weight > 1e-6 {
                self.filler.iter_mut().zip(item).for_each(|(f, v)| *f += *weight * v);
            }
        }
        self.unknown[pair] = (1.0 - known).max(0.0);
        let role = &self.roles[pair * dim..][..dim];
        Hrr.bind_into(role, &self.filler, expected, &mut self.work);
        for ((u, r), e) in self.unexplained.iter_mut().zip(&self.rest).zip(&*expected) {
            *u = r - e;
        }
        change
    }
}
