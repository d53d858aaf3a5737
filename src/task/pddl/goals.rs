//! The parts of a relational goal, as numbers of objects that have certain facts.

use std::collections::BTreeSet;

use super::conditions::{At, Possible};
use crate::task::domain::Quantity;

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
    let problem = possible.problem;
    let mut terms = Vec::new();
    for goal in problem.goals() {
        let state = &problem.domain().states[goal.state];
        let all: Vec<At> = (possible.facts.iter().enumerate())
            .flat_map(|(i, facts)| facts.iter().map(move |fact| (i, *fact)))
            .filter(|(_, fact)| fact.state == goal.state)
            .collect();
        let plain = |list: Vec<At>| list.into_iter().map(|at| vec![at]).collect::<Vec<_>>();
        match goal.quantity {
            Quantity::AtLeast(0) | Quantity::EachReference(0) => {}
            Quantity::AtLeast(least) => terms.push(Counted::new(
                least,
                match goal.reference {
                    None => plain(all),
                    Some(within) => all
                        .into_iter()
                        .flat_map(|at| {
                            let of = at.1.reference.map_or(&[][..], |r| &possible.facts[r]);
                            let of = of.iter().filter(|fact| fact.state == within);
                            of.filter_map(move |fact| Some(vec![at, (at.1.reference?, *fact)]))
                        })
                        .collect(),
                },
            )),
            Quantity::EachReference(least) => {
                let kind = state.frame.kind().unwrap_or_default();
                let objects = problem.objects().iter().enumerate();
                for (r, _) in objects.filter(|(_, o)| *o.kind == *kind) {
                    let here = all.iter().filter(|(_, fact)| fact.reference == Some(r)).copied();
                    terms.push(Counted::new(least, plain(here.collect())));
                }
            }
            Quantity::EachObject => {
                let least = problem.objects().iter().filter(|o| *o.kind == *state.kind).count();
                if least > 0 {
                    terms.push(Counted::new(least, plain(all)));
                }
            }
        }
    }
    terms
}
