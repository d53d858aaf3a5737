//! Mutual exclusion: pairs of fluents that hold together in no reachable state.

use crate::plan::strips::{GroundOperator, Grounded};

/// A symmetric set of pairs of fluents.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mutexes {
    count: usize,
    /// Whether a pair may hold together, by rows.
    together: Vec<bool>,
}

impl Mutexes {
    /// Finds the pairs by a fixpoint over pairs of fluents (h^2; Haslum and Geffner, "Admissible heuristics for optimal
    /// planning", 2000). It is sound: a pair that it excludes never holds. It does not find all such pairs.
    ///
    /// Costs O(pairs that may hold together x operators that need one of them x preconditions), and up to eight bytes for each such
    /// pair while it is found.
    pub fn new(problem: &Grounded) -> Self {
        let count = problem.fluents.len();
        let pairs = Self { count, together: vec![false; count * count] };
        let mut needed_by = vec![Vec::new(); count];
        let mut free = Vec::new();
        for (place, operator) in problem.operators.iter().enumerate() {
            operator.preconditions.iter().for_each(|need| needed_by[*need].push(place));
            if operator.preconditions.is_empty() {
                free.push(place);
            }
        }
        let applicable = vec![false; problem.operators.len()];
        let mut search = Search { problem, pairs, applicable, new: Vec::new() };
        for a in &problem.start {
            problem.start.iter().for_each(|b| search.allow(*a, *b));
        }
        free.iter().for_each(|operator| search.meet(*operator));
        while let Some([a, b]) = search.new.pop() {
            let [a, b] = [a as usize, b as usize];
            for (need, kept) in [(a, b), (b, a)] {
                for operator in &needed_by[need] {
                    match search.applicable[*operator] {
                        true => search.keep(*operator, kept),
                        false => search.meet(*operator),
                    }
                }
            }
            if a == b {
                free.iter().for_each(|operator| search.keep(*operator, a));
            }
        }
        search.pairs
    }

    /// Makes the set of these pairs of `count` fluents.
    ///
    /// # Panics
    /// If a position is not below `count`.
    pub fn of(count: usize, pairs: impl IntoIterator<Item = [usize; 2]>) -> Self {
        let mut together = vec![true; count * count];
        for [a, b] in pairs {
            assert!(a < count && b < count, "a pair of fluents {a} and {b} of {count}");
            together[a * count + b] = false;
            together[b * count + a] = false;
        }
        Self { count, together }
    }

    /// Returns whether no two of these fluents exclude each other.
    pub(super) fn allow_all(&self, fluents: &[usize]) -> bool {
        fluents.iter().all(|a| fluents.iter().all(|b| self.allowed(*a, *b)))
    }

    fn allowed(&self, a: usize, b: usize) -> bool {
        self.together[a * self.count + b]
    }

    /// Returns whether two fluents exclude each other.
    ///
    /// # Panics
    /// If a position is not that of a fluent of the problem.
    pub fn excludes(&self, a: usize, b: usize) -> bool {
        !self.allowed(a, b)
    }
}

/// The pairs found so far, and those of which nothing has been concluded yet.
struct Search<'p> {
    problem: &'p Grounded,
    pairs: Mutexes,
    /// Operators whose preconditions may hold together.
    applicable: Vec<bool>,
    new: Vec<[u32; 2]>,
}

impl Search<'_> {
    fn allow(&mut self, a: usize, b: usize) {
        let Mutexes { count, together } = &mut self.pairs;
        if !std::mem::replace(&mut together[a * *count + b], true) {
            together[b * *count + a] = true;
            self.new.push([a as u32, b as u32]);
        }
    }

    /// Applies an operator if its preconditions may hold together.
    fn meet(&mut self, operator: usize) {
        let GroundOperator { preconditions: needs, adds, .. } = &self.problem.operators[operator];
        if self.pairs.allow_all(needs) {
            self.applicable[operator] = true;
            for a in adds {
                adds.iter().for_each(|b| self.allow(*a, *b));
            }
            (0..self.pairs.count).for_each(|kept| self.keep(operator, kept));
        }
    }

    /// Concludes what may hold together with a fluent that an applicable operator leaves as it is.
    fn keep(&mut self, operator: usize, kept: usize) {
        let GroundOperator { preconditions: needs, adds, deletes, .. } =
            &self.problem.operators[operator];
        let mut before = needs.iter().chain([&kept]);
        if !adds.contains(&kept)
            && !deletes.contains(&kept)
            && before.all(|need| self.pairs.allowed(*need, kept))
        {
            adds.iter().for_each(|a| self.allow(*a, kept));
        }
    }
}
