//! Reading all fillers out of a sum of bound pairs whose roles are known, by soft interference cancellation.
//!
//! Unbinding one role and taking the most similar item (linear read-out) is disturbed by all other pairs. A decoder
//! that takes its own wrong readings out of the sum makes it worse. This one takes out what it expects of each
//! pair: weights over the items, which are small and nearly even while nothing is known, so that an overloaded
//! sum is left nearly as it is. For each role in turn, with what all other pairs are expected to be taken
//! out, an item's log likelihood under Gaussian interference of variance v a component is
//! `(a . r - |a|^2 / 2) / v` for the bound pair `a` and the rest `r`; half of the way is gone to the
//! weights that follow. `v` is what is still unknown of the other pairs, and at least what the sum leaves
//! unexplained. It is multistage detection with soft decisions, from receivers for many users of one channel
//! (Divsalar, Simon and Raphaeli 1998; Tanaka and Okada 2005 for its analysis), with vocabularies for alphabets.
//! How much more is read right than by linear read-out is what the experiment `capacity` counts.

use super::algebra::{Algebra, Hrr, Workspace, dot};
use super::error::VocabError;
use super::item_memory::dots;
use crate::sim::Real;

/// How far the weights go towards what follows from the other pairs' in one turn.
const DAMPING: Real = 0.5;
/// Weights that change by less than this in a round have converged.
const TOLERANCE: Real = 1e-3;
/// The least variance, of all components together: what rounding leaves.
const MIN_VARIANCE: Real = 1e-3;

/// What is bound to a role.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filler {
    /// The item, by its place.
    pub item: usize,
    /// Its weight, 0 to 1, that of all items together being 1. It orders readings by how sure they are and is no
    /// probability: of overloaded sums more readings are right than the weights say, of others fewer.
    pub weight: Real,
}

/// A decoder of sums `role * filler + role * filler + ...` (holographic reduced representations) whose roles are known and
/// whose fillers are some of its items, all of a length about 1.
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
    /// Squared lengths of all bound pairs, `roles x items`.
    lengths: Vec<Real>,
    /// `roles x items`.
    weights: Vec<Real>,
    /// What each pair is expected to be, `roles x dim`.
    expected: Vec<Real>,
    /// What of each pair is still unknown: the squared length that its weights leave.
    unknown: Vec<Real>,
    unexplained: Vec<Real>,
    rest: Vec<Real>,
    unbound: Vec<Real>,
    filler: Vec<Real>,
    scores: Vec<Real>,
    read: Vec<Filler>,
    work: Workspace,
}

impl PairDecoder {
    /// The most rounds over all roles.
    pub const ROUNDS: usize = 24;

    /// A decoder; `roles` and `items` are row-major with `dim` numbers each. Costs 3 transforms a role and item and roles x
    /// items x `dim` products; allocates all that reading needs.
    ///
    /// # Errors
    /// [`VocabError::Dimension`]; [`VocabError::BadVector`] if roles or items are no whole number of vectors, or none,
    /// or a value is not finite.
    pub fn new(dim: usize, roles: &[Real], items: &[Real]) -> Result<Self, VocabError> {
        Hrr.check_dim(dim)?;
        for (name, rows) in [("roles", roles), ("items", items)] {
            let bad = |reason| Err(VocabError::BadVector { name: name.into(), reason });
            if rows.is_empty() || !rows.len().is_multiple_of(dim) {
                let are = format!("{} numbers are no vectors of {dim} dimensions", rows.len());
                return bad(are);
            }
            if let Some(at) = rows.iter().position(|v| !v.is_finite()) {
                let (component, row) = (at % dim, at / dim);
                return bad(format!("component {component} of vector {row} is {}", rows[at]));
            }
        }
        let mut work = Hrr.scratch(dim);
        let mut inverses = vec![0.0; roles.len()];
        for (role, inverse) in roles.chunks_exact(dim).zip(inverses.chunks_exact_mut(dim)) {
            Hrr.inverse_into(role, inverse);
        }
        // A bound pair's squared length is the product of its parts' correlations with themselves.
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

    /// The filler of every role, in the roles' order. Costs at most [`ROUNDS`](Self::ROUNDS) x roles x (6 transforms +
    /// items x dimensions products, twice that while all items have weight); allocates nothing. If a component of the sum is
    /// not a finite number, all weights are 0.
    ///
    /// # Panics
    /// If `sum` has another number of components.
    pub fn read(&mut self, sum: &[Real]) -> &[Filler] {
        assert!(sum.len() == self.dim, "the sum has the decoder's dimensions");
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

    /// One pair's weights towards what follows from the others'; the greatest change of one.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Seed;
    use crate::spa::random_pointer;

    fn vectors(from: u64, count: u64, dim: usize) -> Vec<Real> {
        (from..from + count).flat_map(|i| random_pointer(dim, Seed::new(i))).collect()
    }

    /// The sum of the first pairs, and noise of length `sigma`.
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
        // Overloaded sums of nine pairs in 32 dimensions with noise, 300 of them: readings by weight, and how many of
        // them are right.
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
        // At least 180 readings a bin: three standard errors are at most 11 points.
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
}
