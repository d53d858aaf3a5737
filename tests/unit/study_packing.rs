//! Unit tests of `src/study/problems/packing.rs`.

use super::*;
use crate::sim::Seed;
use crate::study::problems::Distance;

/// Counts the orders of all actions that are valid plans.
fn valid_orders(made: &PlanningProblem, plan: &mut Vec<usize>) -> usize {
    let all = made.grounded.operators.len();
    if plan.len() == all {
        return usize::from(made.valid_length(plan.iter().copied()).is_some());
    }
    let mut found = 0;
    for operator in 0..all {
        if !plan.contains(&operator) {
            plan.push(operator);
            found += valid_orders(made, plan);
            plan.pop();
        }
    }
    found
}

#[test]
fn one_order_of_all_succeeds() {
    for things in 2..=5 {
        let made = packing(things, &mut Seed::new(things as u64).rng()).expect("a problem");
        assert_eq!(valid_orders(&made, &mut Vec::new()), 1, "{things}");
        assert_eq!(made.distance(1000), Distance::Steps(things));
    }
    assert!(packing(1, &mut Seed::new(1).rng()).is_err());
}
