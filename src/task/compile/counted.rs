//! What is left where objects are taken from. A condition may ask that some are: "a bowl is in its start area".
//!
//! No fact says exactly how many objects are in a state. Instead, an action that takes one of them has a variant for each number that
//! may be there: the variant needs at least so many, and ends the facts that ask for as many or more. With fewer than there are, this
//! says too much is gone, never too little.

use std::collections::BTreeSet;

use super::facts::{GroundAction, Test};
use super::problem::Problem;
use crate::task::domain::{NeedVerdict, Subject};

/// Greatest number of objects of a kind that are counted.
const MOST: usize = 8;

/// Returns the states that objects leave and in which a condition asks for any of them. `in_force` are the undecided needs that are
/// conditions.
pub(super) fn counted(
    problem: &Problem<'_>,
    in_force: &BTreeSet<(usize, usize)>,
) -> BTreeSet<usize> {
    let operators = &problem.domain.operators;
    let mut found = BTreeSet::new();
    for (o, operator) in operators.iter().enumerate() {
        for (n, need) in operator.needs.iter().enumerate() {
            let counts = need.verdict != NeedVerdict::Undecided || in_force.contains(&(o, n));
            let state = need.condition.state;
            let left = || operators.iter().any(|operator| operator.from.contains(&state));
            let any = need.condition.subject == Subject::Any && need.or.is_empty();
            let few = || problem.of_kind(&problem.domain.states[state].kind).count() <= MOST;
            if counts && any && need.is_positive() && left() && few() {
                found.insert(state);
            }
        }
    }
    found
}

/// Returns a source with each number of objects that may be there, the greatest first, if its state is counted.
pub(super) fn among(
    problem: &Problem<'_>,
    counted: &BTreeSet<usize>,
    source: Test,
) -> Vec<(Test, Option<usize>)> {
    let state = match source.of[..] {
        [(state, None)] if !source.given && counted.contains(&state) => state,
        _ => return vec![(source, None)],
    };
    let all = problem.of_kind(&problem.domain.states[state].kind).count();
    (source.least..=all.max(source.least)).rev().map(|n| (source.clone(), Some(n))).collect()
}

impl GroundAction {
    /// Returns the test that as many objects are in the state that the object leaves as this variant takes it from.
    pub(super) fn among_test(&self) -> Option<Test> {
        let least = self.among?;
        Some(Test { of: self.source.of.clone(), least, ..Test::of([]) })
    }

    /// Returns whether a variant may leave fewer objects than a test of any objects asks for.
    pub(super) fn uses_up(&self, test: &Test) -> bool {
        let of_any = test.object.is_none() && test.reference.is_none() && test.within.is_none();
        let counts = self.object.is_none_or(|object| !test.except.contains(&object));
        let spare = test.least + 1 + test.except.len();
        of_any && counts && test.of == self.source.of && self.among.is_some_and(|n| n < spare)
    }
}
