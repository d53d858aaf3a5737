//! Soft interference cancellation: reading one filler out of a sum of bound pairs whose roles are all known.
//!
//! A decoder that takes its own wrong readings out of the sum makes it worse. This one takes out what it expects
//! of each pair: weights over the vocabulary, which are small and nearly even while nothing is known, so that an
//! overloaded sum is left nearly as it is. For each role in turn, with what all other pairs are expected to be
//! taken out, an item's log likelihood under Gaussian interference of variance v a component is
//! `(a . r - |a|^2 / 2) / v` for the bound pair `a` and the rest `r`; half of the way is gone to the
//! weights that follow. `v` is what is still unknown of the other pairs, and at least what the sum leaves
//! unexplained. It is multistage detection with soft decisions, from receivers for many users of one
//! channel (Divsalar, Simon and Raphaeli 1998; Tanaka and Okada 2005 for its analysis), with vocabularies for
//! alphabets.

use crate::sim::Real;
use crate::spa::{Algebra, Hrr, dot, dots};

/// A sum of bound pairs to be read.
pub(super) struct Cancellation<'a> {
    /// The roles, a pair each.
    pub roles: &'a [Vec<Real>],
    /// The vocabulary, a row an item.
    pub rows: &'a [Real],
    /// The sum.
    pub trace: &'a [Real],
}

/// How far the weights go towards what follows from the other pairs' in one turn.
const DAMPING: Real = 0.5;
/// Weights that change less than this in a round are settled.
const SETTLED: Real = 1e-3;
/// The least variance, of all components together: what rounding leaves.
const LEAST: Real = 1e-3;

impl Cancellation<'_> {
    /// The most rounds over all roles.
    pub const ROUNDS: usize = 24;

    /// The item bound to a role. Costs up to [`ROUNDS`](Self::ROUNDS) x roles x (4 transforms + 2 x items x
    /// dimensions products).
    pub fn read(&self, role: usize) -> usize {
        let (dim, pairs) = (self.trace.len(), self.roles.len());
        let items = self.rows.len() / dim;
        let mut work = Hrr.scratch(dim);
        let mut inverse = vec![0.0; dim];
        let inverses: Vec<Vec<Real>> = self
            .roles
            .iter()
            .map(|role| {
                let mut inverse = vec![0.0; dim];
                Hrr.inverse_into(role, &mut inverse);
                inverse
            })
            .collect();
        // A bound pair's squared length is the product of its parts' correlations with themselves.
        let mut with_itself = |part: &[Real], out: &mut [Real]| {
            Hrr.inverse_into(part, &mut inverse);
            Hrr.bind_into(part, &inverse, out, &mut work);
        };
        let mut correlations = vec![0.0; self.rows.len()];
        for (item, out) in self.rows.chunks_exact(dim).zip(correlations.chunks_exact_mut(dim)) {
            with_itself(item, out);
        }
        let (mut own, mut lengths) = (vec![0.0; dim], vec![0.0; pairs * items]);
        for (role, lengths) in self.roles.iter().zip(lengths.chunks_exact_mut(items)) {
            with_itself(role, &mut own);
            dots(&correlations, &own, lengths);
        }

        let mut weights = vec![0.0; pairs * items];
        let mut expected = vec![0.0; pairs * dim];
        // What of each pair is still unknown: the squared length that its weights leave.
        let mut unknown: Vec<Real> = vec![1.0; pairs];
        let mut unexplained = self.trace.to_vec();
        let (mut rest, mut unbound, mut filler) = (own, vec![0.0; dim], vec![0.0; dim]);
        let mut next = vec![0.0; items];
        for _ in 0..Self::ROUNDS {
            let mut change: Real = 0.0;
            for pair in 0..pairs {
                let weights = &mut weights[pair * items..][..items];
                let expected = &mut expected[pair * dim..][..dim];
                for ((r, u), e) in rest.iter_mut().zip(&unexplained).zip(&*expected) {
                    *r = u + e;
                }
                Hrr.bind_into(&rest, &inverses[pair], &mut unbound, &mut work);
                dots(self.rows, &unbound, &mut next);
                let others = unknown.iter().sum::<Real>() - unknown[pair];
                let variance = others.max(dot(&unexplained, &unexplained)).max(LEAST) / dim as Real;
                for (score, length) in next.iter_mut().zip(&lengths[pair * items..]) {
                    *score = (*score - length / 2.0) / variance;
                }
                let most = next.iter().copied().fold(Real::NEG_INFINITY, Real::max);
                next.iter_mut().for_each(|score| *score = (*score - most).exp());
                let all: Real = next.iter().sum();
                filler.fill(0.0);
                let mut known = 0.0;
                let rows = self.rows.chunks_exact(dim);
                for ((weight, new), row) in weights.iter_mut().zip(&next).zip(rows) {
                    let step = DAMPING * (new / all - *weight);
                    change = change.max(step.abs());
                    *weight += step;
                    known += *weight * *weight;
                    if *weight > 1e-6 {
                        filler.iter_mut().zip(row).for_each(|(f, v)| *f += *weight * v);
                    }
                }
                unknown[pair] = (1.0 - known).max(0.0);
                Hrr.bind_into(&self.roles[pair], &filler, expected, &mut work);
                for ((u, r), e) in unexplained.iter_mut().zip(&rest).zip(&*expected) {
                    *u = r - e;
                }
            }
            if change < SETTLED {
                break;
            }
        }
        let scored = weights[role * items..][..items].iter().enumerate();
        scored.max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(item, _)| item)
    }
}
