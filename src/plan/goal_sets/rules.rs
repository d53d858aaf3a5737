//! What a planner by regression knows of a problem: which operators achieve and threaten which fluents.

use std::collections::BTreeSet;

use super::costs::levels;
use super::mutex::Mutexes;
use super::useless::useless;
use crate::plan::strips::Grounded;

/// An operator, as regression sees it. All numbers are positions of fluents, in increasing order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Regressed {
    /// Fluents that it achieves.
    pub adds: Vec<usize>,
    /// Fluents that become goals in place of the achieved ones.
    pub preconditions: Vec<usize>,
    /// Fluents that must not be goals: the operator deletes them, or they exclude a precondition and the operator does
    /// not add them.
    pub threatens: Vec<usize>,
    /// Fluents that it does not achieve, but another operator does that shares a precondition with it. While one of them is
    /// an open goal, a precondition of this operator serves two goals.
    pub serves: Vec<usize>,
}

/// The rules of a problem.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Regression {
    /// Number of fluents.
    pub fluents: usize,
    /// Operators, in the order of the problem.
    pub operators: Vec<Regressed>,
    /// Pairs of fluents that exclude each other.
    pub mutexes: Mutexes,
    /// Levels of cost that are told apart: 16, or 32 if a fluent costs more from the start of the problem on.
    pub levels: usize,
}

impl Regression {
    /// Finds the rules of a problem. Fluents exclude each other if they never hold together after its start. Operators that
    /// are in no plan, because they can never be applied or put the goal out of reach, achieve nothing.
    pub fn new(problem: &Grounded) -> Self {
        let mutexes = Mutexes::new(problem);
        let mut useful = problem.clone();
        for (operator, useless) in useful.operators.iter_mut().zip(useless(problem, &mutexes)) {
            if useless {
                operator.adds.clear();
            }
        }
        Self::with_mutexes(&useful, mutexes)
    }

    /// Finds the rules of a problem in which these fluents exclude each other.
    ///
    /// # Panics
    /// If `mutexes` has another number of fluents.
    pub fn with_mutexes(problem: &Grounded, mutexes: Mutexes) -> Self {
        let fluents = problem.fluents.len();
        // What the operators that need a fluent add.
        let mut added = vec![BTreeSet::new(); fluents];
        for operator in &problem.operators {
            operator.preconditions.iter().for_each(|need| added[*need].extend(&operator.adds));
        }
        let operators = problem.operators.iter().map(|operator| {
            let adds = operator.adds.clone();
            let preconditions = operator.preconditions.clone();
            let threatened = |fluent: &usize| {
                let excluded = || preconditions.iter().any(|need| mutexes.excludes(*need, *fluent));
                !adds.contains(fluent) && (operator.deletes.contains(fluent) || excluded())
            };
            let threatens = (0..fluents).filter(threatened).collect();
            let shared = preconditions.iter().flat_map(|need| &added[*need]);
            let serves: BTreeSet<usize> = shared.filter(|f| !adds.contains(f)).copied().collect();
            let serves = serves.into_iter().collect();
            Regressed { adds, preconditions, threatens, serves }
        });
        let operators = operators.collect();
        Self { fluents, operators, mutexes, levels: levels(problem) }
    }

    /// Returns whether the preconditions of an operator may hold together.
    pub(super) fn possible(&self, operator: &Regressed) -> bool {
        self.mutexes.allow_all(&operator.preconditions)
    }
}
