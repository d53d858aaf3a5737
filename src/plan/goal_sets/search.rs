//! The planner's rules without neurons: regression of goal sets, one step at a time.
//!
//! The graph is measured beside this search. Both remember all goal sets and take the best operator; only the search knows
//! utilities exactly.

use std::collections::BTreeSet;

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::rules::Regression;

/// Number of times that a search starts.
const TRIES: usize = 10;
/// Standard deviation of the noise on each utility, in levels of cost.
const NOISE: f64 = 0.1;
/// Bonus of an operator that achieves an unmet goal, or a goal that stands in the way of one, in levels.
const HELPS: f64 = 1.2;
/// Loss for each new goal, in levels.
const FRESH: f64 = 0.3;
/// Bonus of an operator with a precondition that serves another unmet goal as well, in levels.
const SHARES: f64 = 0.6;

/// What a search found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Operators in the order in which they are carried out.
    pub plan: Vec<usize>,
    /// Goal sets that were reached, over all tries.
    pub steps: usize,
}

/// Returns the additive cost of each fluent: one more than the sum of the costs of what its cheapest operator needs (Bonet
/// and Geffner, "Planning as heuristic search", 2001). Costs above [`Regression::levels`] count as so many, as in the graph.
///
/// Costs O(levels x operators). A fluent that cannot be reached has an infinite cost.
pub fn costs(rules: &Regression, state: &BTreeSet<usize>) -> Vec<f64> {
    let operators = rules.operators.iter().map(|o| (&*o.preconditions, &*o.adds));
    additive(rules.fluents, operators, state.iter().copied(), (rules.levels, usize::MAX))
}

/// Returns the additive costs from a state on, of which none is above `most`, after at most so many rounds. Costs up to the number
/// of rounds are right. Of each operator: what it needs and adds.
pub(super) fn additive<'o>(
    fluents: usize,
    operators: impl Iterator<Item = (&'o [usize], &'o [usize])> + Clone,
    state: impl IntoIterator<Item = usize>,
    (most, rounds): (usize, usize),
) -> Vec<f64> {
    let mut costs = vec![f64::INFINITY; fluents];
    state.into_iter().for_each(|f| costs[f] = 0.0);
    for _ in 0..rounds {
        let old = costs.clone();
        for (needs, adds) in operators.clone() {
            let needed: f64 = needs.iter().map(|p| old[*p]).sum();
            if needed.is_infinite() {
                continue;
            }
            for add in adds {
                costs[*add] = costs[*add].min((1.0 + needed).min(most as f64));
            }
        }
        if costs == old {
            break;
        }
    }
    costs
}

/// Searches a plan from a state to a goal. A search that fills all `slots` for goal sets starts again.
///
/// Costs O(steps x (operators + slots) x fluents).
pub fn search(
    rules: &Regression,
    start: &BTreeSet<usize>,
    goal: &BTreeSet<usize>,
    slots: usize,
    rng: &mut impl Rng,
) -> Option<Found> {
    let costs = costs(rules, start);
    let most = slots;
    let mut steps = 0;
    for _ in 0..TRIES {
        let mut slots = vec![(goal.clone(), 0, 0)];
        let mut slot = 0;
        let mut dead = BTreeSet::new();
        loop {
            let goals = &slots[slot].0;
            if goals.is_subset(start) {
                let mut plan = Vec::new();
                while slot > 0 {
                    let (_, operator, parent) = slots[slot];
                    plan.push(operator);
                    slot = parent;
                }
                return Some(Found { plan, steps });
            }
            match best(rules, start, &costs, &slots, slot, rng) {
                Some((operator, child)) if slots.len() < most => {
                    steps += 1;
                    slots.push((child, operator, slot));
                    slot = slots.len() - 1;
                }
                None => {
                    dead.insert(slot);
                    match nearest(rules, &costs, &slots, &dead) {
                        Some(next) => slot = next,
                        None => break,
                    }
                }
                Some(_) => break,
            }
        }
    }
    None
}

/// Returns the slot to go on with after a dead end: of those that are not dead, the lowest, and of several the latest. A slot is as high
/// as it is far from the start of the problem; where that is not known, as its costliest goal costs.
fn nearest(
    rules: &Regression,
    costs: &[f64],
    slots: &[(BTreeSet<usize>, usize, usize)],
    dead: &BTreeSet<usize>,
) -> Option<usize> {
    let height = |slot: usize| {
        let goals = &slots[slot].0;
        let within = rules.heights.iter().filter(|(set, _)| set.iter().all(|f| goals.contains(f)));
        let farthest = within.map(|(_, height)| *height as f64);
        match rules.heights.is_empty() {
            true => goals.iter().map(|f| costs[*f]).fold(0.0, f64::max),
            false => farthest.fold(0.0, f64::max),
        }
    };
    let left = (0..slots.len()).rev().filter(|slot| !dead.contains(slot));
    left.min_by(|a, b| height(*a).total_cmp(&height(*b)))
}

/// Returns the best operator for the goal set of a slot, and the goal set before it.
fn best(
    rules: &Regression,
    start: &BTreeSet<usize>,
    costs: &[f64],
    slots: &[(BTreeSet<usize>, usize, usize)],
    slot: usize,
    rng: &mut impl Rng,
) -> Option<(usize, BTreeSet<usize>)> {
    let goals = &slots[slot].0;
    let open = |f: &usize| goals.contains(f) && !start.contains(f);
    let wanted = rules.operators.iter().filter(|o| o.adds.iter().any(open));
    let blamed: BTreeSet<usize> =
        wanted.flat_map(|o| &o.threatens).filter(|f| goals.contains(f)).copied().collect();
    let pairs = rules.bars.iter().filter(|(pair, _)| pair.iter().all(|f| goals.contains(f)));
    let barred: BTreeSet<usize> = pairs.flat_map(|(_, all)| all).copied().collect();
    let mut best: Option<(f64, usize, BTreeSet<usize>)> = None;
    for (a, operator) in rules.operators.iter().enumerate() {
        let in_goals = |f: &&usize| goals.contains(f);
        if !operator.adds.iter().any(|f| goals.contains(f))
            || operator.threatens.iter().any(|f| goals.contains(f))
            || barred.contains(&a)
            || operator.preconditions.iter().any(|p| costs[*p].is_infinite())
        {
            continue;
        }
        let child: BTreeSet<usize> = goals
            .iter()
            .filter(|f| !operator.adds.contains(f))
            .chain(&operator.preconditions)
            .copied()
            .collect();
        if slots.iter().any(|(old, ..)| old.is_subset(&child)) {
            continue;
        }
        let gain: f64 = operator.adds.iter().filter(in_goals).map(|f| costs[*f]).sum();
        let new: Vec<_> = operator.preconditions.iter().filter(|f| !goals.contains(f)).collect();
        let loss: f64 = new.iter().map(|f| costs[**f] + FRESH).sum();
        let helps = operator.adds.iter().any(|f| open(f) || blamed.contains(f));
        let noise: f64 = StandardNormal.sample(rng);
        let shares = operator.serves.iter().any(open);
        let bonus = |given, levels| if given { levels } else { 0.0 };
        let utility = gain - loss + bonus(helps, HELPS) + bonus(shares, SHARES) + noise * NOISE;
        if best.as_ref().is_none_or(|(u, ..)| utility > *u) {
            best = Some((utility, a, child));
        }
    }
    best.map(|(_, operator, child)| (operator, child))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::goal_sets::mutex::Mutexes;

    fn rules(heights: Vec<(Vec<usize>, usize)>) -> Regression {
        let mutexes = Mutexes::of(4, []);
        let (operators, bars) = (Vec::new(), Vec::new());
        Regression { fluents: 4, operators, mutexes, bars, heights, never: Vec::new(), levels: 16 }
    }

    #[test]
    fn a_dead_end_is_left_for_the_latest_of_the_lowest() {
        let costs = [0.0, 1.0, 2.0, 5.0];
        // The greatest costs are 5, 2, 2 and 2.
        let sets: [&[usize]; 4] = [&[0, 3], &[0, 1, 2], &[2], &[1, 2]];
        let slots = sets.map(|set| (set.iter().copied().collect(), 0, 0));
        let dead = |slots: &[usize]| slots.iter().copied().collect();
        let nearest = |rules: &Regression, ends| nearest(rules, &costs, &slots, &dead(ends));
        let by_costs = rules(Vec::new());
        assert_eq!(nearest(&by_costs, &[]), Some(3));
        assert_eq!(nearest(&by_costs, &[3]), Some(2));
        assert_eq!(nearest(&by_costs, &[1, 2, 3]), Some(0));
        assert_eq!(nearest(&by_costs, &[0, 1, 2, 3]), None);
        // 1 and 2 are far from holding together.
        let by_distances = rules(vec![(vec![2], 1), (vec![1, 2], 3), (vec![3], 2)]);
        assert_eq!(nearest(&by_distances, &[]), Some(2));
        assert_eq!(nearest(&by_distances, &[2]), Some(0));
    }
}
