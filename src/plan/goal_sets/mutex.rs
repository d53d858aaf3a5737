//! Mutual exclusion: pairs of fluents that hold together in no reachable state.

use crate::plan::strips::Grounded;

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
    /// Costs O(passes x operators x fluents), with few passes in practice.
    pub fn new(problem: &Grounded) -> Self {
        let count = problem.fluents.len();
        let mut pairs = Self { count, together: vec![false; count * count] };
        for a in &problem.start {
            for b in &problem.start {
                pairs.allow(*a, *b);
            }
        }
        let mut changed = true;
        while changed {
            changed = false;
            for operator in &problem.operators {
                let needs = &operator.preconditions;
                if !needs.iter().all(|a| needs.iter().all(|b| pairs.allowed(*a, *b))) {
                    continue;
                }
                for a in &operator.adds {
                    for b in &operator.adds {
                        changed |= pairs.allow(*a, *b);
                    }
                }
                for kept in 0..count {
                    let changes = operator.adds.contains(&kept) || operator.deletes.contains(&kept);
                    if changes || operator.adds.iter().all(|a| pairs.allowed(*a, kept)) {
                        continue;
                    }
                    if pairs.allowed(kept, kept) && needs.iter().all(|n| pairs.allowed(*n, kept)) {
                        for a in &operator.adds {
                            changed |= pairs.allow(*a, kept);
                        }
                    }
                }
            }
        }
        pairs
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

    fn allowed(&self, a: usize, b: usize) -> bool {
        self.together[a * self.count + b]
    }

    /// Allows a pair. Returns whether this is new.
    fn allow(&mut self, a: usize, b: usize) -> bool {
        let new = !self.allowed(a, b);
        self.together[a * self.count + b] = true;
        self.together[b * self.count + a] = true;
        new
    }

    /// Returns whether two fluents exclude each other.
    ///
    /// # Panics
    /// If a position is not that of a fluent of the problem.
    pub fn excludes(&self, a: usize, b: usize) -> bool {
        !self.allowed(a, b)
    }
}
