//! The parts of a relational goal, as numbers of objects that have certain facts.

use std::collections::BTreeSet;

use super::conditions::{At, Possible};
use crate::task::compile::Test;

/// A part of the goal: at least so many objects each have one of their sets of facts.
pub(super) struct Counted {
    pub least: usize,
    /// Number of objects that can count.
    objects: usize,
    /// Sets of facts with which an object counts; the first is about the object.
    pub candidates: Vec<Vec<At>>,
}

impl Counted {
    fn new(least: usize, candidates: Vec<Vec<At>>) -> Self {
        let objects: BTreeSet<usize> = candidates.iter().map(|c| c[0].0).collect();
        Self { least, objects: objects.len(), candidates }
    }

    /// Returns whether there is one way alone to fulfil the part: every object has one set of facts.
    pub fn each_certain(&self) -> bool {
        self.objects == self.least && self.candidates.len() == self.least
    }
}

/// Returns the parts of the goal.
pub(super) fn terms(possible: &Possible<'_>) -> Vec<Counted> {
    let term = |test: &Test| {
        let all = possible.facts.iter().enumerate();
        let all = all.flat_map(|(i, facts)| facts.iter().map(move |fact| (i, *fact)));
        let all = all.filter(|(i, fact)| test.matches(*i, fact));
        let candidates = match test.within {
            None => all.map(|at| vec![at]).collect(),
            Some(within) => all
                .flat_map(|at| {
                    let of = at.1.reference.map_or(&[][..], |r| &possible.facts[r]);
                    let of = of.iter().filter(|fact| fact.state == within);
                    of.filter_map(move |fact| Some(vec![at, (at.1.reference?, *fact)]))
                })
                .collect(),
        };
        Counted::new(test.least, candidates)
    };
    possible.problem.goal_tests().iter().map(term).collect()
}
