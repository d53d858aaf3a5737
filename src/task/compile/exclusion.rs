//! Facts that exclude each other, whatever happens: they hold together in no situation.
//!
//! A planner that goes back from its goal does without situations that cannot be. Which situations cannot be reached from
//! the start is no help: a surprise may lead anywhere. What counts is that an object is in one state only.

use std::collections::BTreeSet;

use super::facts::Test;
use super::problem::Problem;
use crate::task::domain::Fact;
use crate::task::propositional::StateId;

/// Greatest number of pairs of a fact and an object in a state. Above it, nothing is found.
const MOST: usize = 20_000_000;

/// The objects in states that a test counts, as a set of bits.
type Atoms = Vec<u64>;

/// Returns the pairs of facts that exclude each other, the lesser one first.
///
/// Two facts do if one asks for more objects than the other allows and everything that it counts counts for the other
/// as well; or if both ask for more objects together than there are, and nothing counts for both. There may be more such
/// pairs.
///
/// Costs O(facts^2 x objects x states x references).
pub(super) fn exclusions(problem: &Problem<'_>, tests: &[Test]) -> Vec<[StateId; 2]> {
    let objects = 0..problem.objects.len();
    let atoms: Vec<(usize, Fact)> =
        objects.flat_map(|o| problem.facts_of(o).into_iter().map(move |f| (o, f))).collect();
    if atoms.len().saturating_mul(tests.len()) > MOST {
        return Vec::new();
    }
    let counted: Vec<Atoms> = tests.iter().map(|test| counted(test, &atoms)).collect();
    let limits = |a: usize, b: usize| {
        let (asks, allows) = (&tests[a], &tests[b]);
        allows.most.is_some_and(|most| asks.least > most)
            && (allows.within.is_none() || allows.within == asks.within)
            && counted[a].iter().zip(&counted[b]).all(|(a, b)| a & !b == 0)
    };
    let crowded = |a: usize, b: usize| {
        let least = tests[a].least + tests[b].least;
        let both = || counted[a].iter().zip(&counted[b]);
        if tests[a].least == 0 || tests[b].least == 0 || both().any(|(a, b)| a & b != 0) {
            return false;
        }
        let either = atoms.iter().enumerate().filter(|(i, _)| {
            let bit = 1 << (i % 64);
            (counted[a][i / 64] | counted[b][i / 64]) & bit != 0
        });
        either.map(|(_, (object, _))| object).collect::<BTreeSet<_>>().len() < least
    };
    let pairs = (0..tests.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
    let excluded = pairs.filter(|(a, b)| limits(*a, *b) || limits(*b, *a) || crowded(*a, *b));
    excluded.map(|(a, b)| [a, b].map(StateId::new)).collect()
}

fn counted(test: &Test, atoms: &[(usize, Fact)]) -> Atoms {
    let mut bits = vec![0; atoms.len().div_ceil(64)];
    for (i, (object, fact)) in atoms.iter().enumerate() {
        bits[i / 64] |= u64::from(test.matches(*object, fact)) << (i % 64);
    }
    bits
}
