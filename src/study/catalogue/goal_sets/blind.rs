//! Plans made without regard to threats, at random: what chance achieves.

use std::collections::BTreeSet;

use rand::Rng;
use rand::seq::IndexedRandom;

use crate::plan::goal_sets::Regression;
use crate::study::problems::PlanningProblem;

/// Most actions of a plan.
const LONGEST: usize = 48;

/// Goes back from the goal by random operators, each of which achieves an unmet goal, until the goal set holds. Threats count
/// for nothing. Returns the length of the plan if it is valid.
pub(super) fn at_random(problem: &PlanningProblem, rng: &mut impl Rng) -> Option<usize> {
    let rules = Regression::new(&problem.grounded);
    let start: BTreeSet<usize> = problem.grounded.start.iter().copied().collect();
    let mut goals: BTreeSet<usize> = problem.grounded.goal.iter().copied().collect();
    let mut plan = Vec::new();
    while !goals.is_subset(&start) {
        let wanted = |f: &usize| goals.contains(f) && !start.contains(f);
        let relevant: Vec<usize> = (0..rules.operators.len())
            .filter(|a| rules.operators[*a].adds.iter().any(wanted))
            .collect();
        let operator = *relevant.choose(rng).filter(|_| plan.len() < LONGEST)?;
        plan.push(operator);
        rules.operators[operator].adds.iter().for_each(|f| {
            goals.remove(f);
        });
        goals.extend(&rules.operators[operator].preconditions);
    }
    problem.valid_length(plan.into_iter().rev())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Seed;
    use crate::study::problems::{Kitchen, packing};

    /// Share of valid plans among many.
    fn share(problem: &PlanningProblem) -> f64 {
        let rng = &mut Seed::new(7).rng();
        let valid = (0..2000).filter(|_| at_random(problem, rng).is_some()).count();
        valid as f64 / 2000.0
    }

    #[test]
    fn chance_is_what_counting_the_orders_says() {
        // Of the orders of k things one succeeds. The interval is five standard deviations.
        for (things, orders) in [(3, 6.0), (4, 24.0)] {
            let made = packing(things, &mut Seed::new(2).rng()).expect("a problem");
            let (share, chance) = (share(&made), 1.0 / orders);
            assert!((share - chance).abs() < 5.0 * (chance / 2000.0f64).sqrt(), "{share}");
        }
        // Plugging in is chosen first in one half of the plans. In the other half it is chosen before the tap in one half.
        let made = Kitchen { one_fuse: true, put_back: false }.problem(4).expect("a problem");
        let share = share(&made);
        assert!((share - 0.75).abs() < 0.05, "{share}");
    }
}
