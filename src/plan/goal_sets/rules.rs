//! What a planner by regression knows of a problem: which operators achieve and threaten which fluents.

use std::collections::BTreeSet;

use super::mutex::Mutexes;
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
}

impl Regression {
    /// Finds the rules of a problem. Fluents exclude each other if they never hold together after its start.
    pub fn new(problem: &Grounded) -> Self {
        Self::with_mutexes(problem, Mutexes::new(problem))
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
        Self { fluents, operators, mutexes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::strips::{Bodies, Domain, Problem};

    #[test]
    fn an_operator_serves_what_others_with_its_preconditions_add() {
        let domain = b"(define (domain lift) (:predicates (down) (up) (a) (b) (c))
            (:action raise :parameters () :precondition (down) :effect (and (up) (not (down))))
            (:action take-a :parameters () :precondition (up) :effect (a))
            (:action take-b :parameters () :precondition (and (up) (a)) :effect (b))
            (:action take-c :parameters () :precondition (down) :effect (c)))";
        let problem = b"(define (problem p) (:domain lift) (:init (down)) (:goal (and (b) (c))))";
        let domain = Domain::parse(domain, "domain", Bodies::Read).unwrap();
        let problem = Problem::parse(problem, "problem", &domain).unwrap();
        let grounded = Grounded::new(&domain, &problem).unwrap();
        let served = |name: &str| {
            let rules = Regression::new(&grounded);
            let place = grounded.operators.iter().position(|o| o.name == name).unwrap();
            let names = rules.operators[place].serves.iter();
            names.map(|f| grounded.fluents[*f].to_string()).collect::<BTreeSet<_>>()
        };
        let set = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<BTreeSet<_>>();
        assert_eq!(served("(raise)"), set(&["(c)"]));
        assert_eq!(served("(take-a)"), set(&["(b)"]));
        assert_eq!(served("(take-b)"), set(&["(a)"]));
        assert_eq!(served("(take-c)"), set(&["(up)"]));
    }
}
