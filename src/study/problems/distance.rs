//! The length of the shortest plan, breadth first over states.

use std::collections::{BTreeSet, HashSet};

use super::PlanningProblem;
use crate::plan::strips::{Bits, Grounded, bits, contains};

/// How far a goal is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Distance {
    /// Number of actions of a shortest plan.
    Steps(usize),
    /// No plan reaches the goal.
    Never,
    /// Not known: more states can be reached than were allowed.
    Unknown,
}

impl PlanningProblem {
    /// Finds how far the goal is from the start. Otherwise as [`distance`].
    pub fn distance(&self, most: usize) -> Distance {
        distance(&self.grounded, &self.grounded.start.iter().copied().collect(), most)
    }
}

/// Finds how far the goal of a problem is from a state, a set of positions of fluents. It looks at no more than `most`
/// states.
///
/// Costs O(states x operators x fluents / 64). It does not use costs, mutexes or regression, so it is independent of the
/// planners that are compared with it.
pub fn distance(problem: &Grounded, start: &BTreeSet<usize>, most: usize) -> Distance {
    let words = problem.fluents.len().div_ceil(64);
    let of = |fluents: &[usize]| bits(fluents.iter().copied(), words);
    let operators: Vec<[Bits; 3]> = problem
        .operators
        .iter()
        .map(|o| [of(&o.preconditions), of(&o.deletes), of(&o.adds)])
        .collect();
    let goal = of(&problem.goal);
    let start = bits(start.iter().copied().filter(|f| *f < problem.fluents.len()), words);
    if contains(&start, &goal) {
        return Distance::Steps(0);
    }
    let mut seen = HashSet::from([start.clone()]);
    let mut layer = vec![start];
    let mut steps = 0;
    while !layer.is_empty() {
        steps += 1;
        let mut next = Vec::new();
        for state in &layer {
            for [needs, deletes, adds] in &operators {
                if !contains(state, needs) {
                    continue;
                }
                let changed = state.iter().zip(deletes).zip(adds);
                let after: Bits = changed.map(|((s, d), a)| (s & !d) | a).collect();
                if contains(&after, &goal) {
                    return Distance::Steps(steps);
                }
                if !seen.contains(&after) {
                    if seen.len() >= most {
                        return Distance::Unknown;
                    }
                    seen.insert(after.clone());
                    next.push(after);
                }
            }
        }
        layer = next;
    }
    Distance::Never
}
