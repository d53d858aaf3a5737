//! What a planner by regression knows of a problem: which operators achieve and threaten which fluents.

use super::mutex::Mutexes;
use crate::task::strips::Grounded;

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
}

impl Regression {
    /// Finds the rules of a problem.
    pub fn new(problem: &Grounded) -> Self {
        let mutexes = Mutexes::new(problem);
        let fluents = problem.fluents.len();
        let operators = problem.operators.iter().map(|operator| {
            let adds = operator.adds.clone();
            let preconditions = operator.preconditions.clone();
            let threatened = |fluent: &usize| {
                let excluded = || preconditions.iter().any(|need| mutexes.excludes(*need, *fluent));
                !adds.contains(fluent) && (operator.deletes.contains(fluent) || excluded())
            };
            let threatens = (0..fluents).filter(threatened).collect();
            Regressed { adds, preconditions, threatens }
        });
        let operators = operators.collect();
        Self { fluents, operators, mutexes }
    }
}
