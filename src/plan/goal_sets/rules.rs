//! What a planner by regression knows of a problem: which operators achieve and threaten which fluents.

use std::collections::{BTreeMap, BTreeSet};

use super::costs::levels;
use super::mutex::Mutexes;
use super::triples::triples;
use super::useless::useless;
use crate::plan::strips::Grounded;

/// Most operators over all pairs of goals that bar them: see [`Regression::bars`].
const MOST_BARS: usize = 60_000;

/// An operator, as regression sees it. All numbers are positions of fluents, in increasing order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Regressed {
    /// Fluents that it achieves.
    pub adds: Vec<usize>,
    /// Fluents that become goals in place of the achieved ones.
    pub preconditions: Vec<usize>,
    /// Fluents that must not be goals: the operator deletes them, or they exclude a precondition or two, and the operator
    /// does not add them.
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
    /// Pairs of fluents, and the operators that must not be taken while both are goals: with a precondition of the operator, the
    /// two never hold in a plan, and it adds neither. Known of problems with at most 64 fluents and 1,000 operators, unless there are
    /// more than 60,000.
    pub bars: Vec<([usize; 2], Vec<usize>)>,
    /// Sets of one to three fluents, and how far at least each goal set that contains them is from the start of the problem, in
    /// sixths of the greatest distance. Known of the same problems.
    pub heights: Vec<(Vec<usize>, usize)>,
    /// Sets of two or three fluents that never hold together in a plan. Known of the same problems, without those that contain
    /// others.
    pub never: Vec<Vec<usize>>,
    /// Levels of cost that are told apart: 16, or 32 if a fluent costs more from the start of the problem on.
    pub levels: usize,
}

impl Regression {
    /// Finds the rules of a problem. Fluents exclude each other if they never hold together after its start. Operators that
    /// are in no plan, because they can never be applied or put the goal out of reach, achieve nothing. In small problems, fluents that
    /// exclude each other only in threes count as well.
    pub fn new(problem: &Grounded) -> Self {
        let mutexes = Mutexes::new(problem);
        let mut useful = problem.clone();
        for (operator, useless) in useful.operators.iter_mut().zip(useless(problem, &mutexes)) {
            if useless {
                operator.adds.clear();
            }
        }
        let triples = triples(&useful);
        let mut rules = Self::with_mutexes(&useful, mutexes);
        rules.exclude(&triples.never);
        rules.heights = triples.heights;
        rules.never = triples.never;
        rules
    }

    /// Returns up to three of these fluents that never hold together in a plan, or one that never holds, if any are known.
    pub fn never_together(&self, goals: &[usize]) -> Option<Vec<usize>> {
        let alone = goals.iter().find(|goal| self.mutexes.excludes(**goal, **goal));
        let pairs = goals.iter().flat_map(|a| goals.iter().map(move |b| [*a, *b]));
        let pair = || pairs.clone().find(|[a, b]| self.mutexes.excludes(*a, *b));
        let among = || self.never.iter().find(|set| set.iter().all(|f| goals.contains(f)));
        let two = || pair().map(|pair| pair.to_vec());
        alone.map(|goal| vec![*goal]).or_else(two).or_else(|| among().cloned())
    }

    /// Lets operators be barred by sets of two or three fluents that exclude each other.
    fn exclude(&mut self, sets: &[Vec<usize>]) {
        let mut bars: BTreeMap<[usize; 2], BTreeSet<usize>> = BTreeMap::new();
        for (place, operator) in self.operators.iter_mut().enumerate() {
            if operator.adds.is_empty() {
                continue;
            }
            let mut needed = vec![false; self.fluents];
            operator.preconditions.iter().for_each(|f| needed[*f] = true);
            let mut against = vec![false; self.fluents];
            operator.threatens.iter().for_each(|f| against[*f] = true);
            let mut pairs = Vec::new();
            for set in sets {
                let others = set.iter().filter(|f| !needed[**f]).count();
                if others == set.len() || set.iter().any(|f| operator.adds.contains(f)) {
                    continue;
                }
                let mut rest = set.iter().filter(|f| !needed[**f]).copied();
                match (rest.next(), rest.next()) {
                    (Some(one), Some(other)) => pairs.push([one, other]),
                    (Some(one), None) => against[one] = true,
                    (None, _) => {}
                }
            }
            operator.threatens = (0..self.fluents).filter(|f| against[*f]).collect();
            // A pair with a fluent that bars the operator alone is no news.
            pairs.retain(|pair| !pair.iter().any(|f| against[*f]));
            pairs.into_iter().for_each(|pair| _ = bars.entry(pair).or_default().insert(place));
        }
        if bars.values().map(BTreeSet::len).sum::<usize>() <= MOST_BARS {
            let listed = |(pair, operators): ([usize; 2], BTreeSet<usize>)| {
                (pair, operators.into_iter().collect())
            };
            self.bars = bars.into_iter().map(listed).collect();
        }
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
        Self {
            fluents,
            operators,
            mutexes,
            bars: Vec::new(),
            heights: Vec::new(),
            never: Vec::new(),
            levels: levels(problem),
        }
    }

    /// Returns whether the preconditions of an operator may hold together.
    pub(super) fn possible(&self, operator: &Regressed) -> bool {
        self.mutexes.allow_all(&operator.preconditions)
    }
}
