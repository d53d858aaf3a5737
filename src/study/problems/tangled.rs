//! A generator of random domains.

use std::fmt::Write as _;
use std::ops::RangeInclusive;

use rand::seq::IndexedRandom;
use rand::{Rng, RngExt};

use super::{PlanningProblem, outside};
use crate::task::TaskError;

/// Lengths of shortest plans that the generator finds.
pub const TANGLED: RangeInclusive<usize> = 2..=16;

/// Number of facts.
const FACTS: usize = 12;
/// Number of actions: one that achieves each fact, and some more.
const ACTIONS: usize = 18;
/// Number of facts that hold at first.
const START: u32 = 4;
/// Probability that an action has a third precondition. Otherwise it has two.
const THIRD: f64 = 0.3;
/// Probability that an action makes one of its preconditions false.
const CONSUMES: f64 = 0.5;
/// Probability that it makes another fact false.
const SPOILS: f64 = 0.4;
/// Most domains that are drawn. Every tenth or so has a plan of 15 actions.
const TRIES: usize = 10_000;

/// Sets of facts, one bit each.
struct Action {
    needs: u32,
    adds: u32,
    deletes: u32,
}

fn facts(set: u32) -> impl Iterator<Item = usize> {
    (0..FACTS).filter(move |f| set >> f & 1 == 1)
}

fn draw_action(adds: usize, rng: &mut impl Rng) -> Action {
    let wanted = if rng.random_bool(THIRD) { 3 } else { 2 };
    let mut needs = 0u32;
    while needs.count_ones() < wanted {
        needs |= 1 << rng.random_range(0..FACTS);
        needs &= !(1 << adds);
    }
    let mut deletes = 0;
    for fact in facts(needs) {
        if rng.random_bool(CONSUMES) {
            deletes |= 1 << fact;
        }
    }
    if rng.random_bool(SPOILS) {
        deletes |= 1 << rng.random_range(0..FACTS);
    }
    Action { needs, adds: 1 << adds, deletes: deletes & !(1 << adds) }
}

/// Returns all states that can be reached, each with its distance, in order of distance.
fn explore(start: u32, actions: &[Action]) -> Vec<(u32, usize)> {
    let mut seen = vec![false; 1 << FACTS];
    seen[start as usize] = true;
    let mut states = vec![(start, 0)];
    let mut at = 0;
    while let Some((state, distance)) = states.get(at).copied() {
        at += 1;
        for action in actions.iter().filter(|a| state & a.needs == a.needs) {
            let next = state & !action.deletes | action.adds;
            if !std::mem::replace(&mut seen[next as usize], true) {
                states.push((next, distance + 1));
            }
        }
    }
    states
}

/// Draws a random domain of 12 facts and 18 actions, and a problem whose shortest plan has `length` actions.
///
/// Each action has two or three random preconditions, achieves one fact, makes each of its preconditions false with
/// probability 0.5, and another fact with probability 0.4. Four random facts hold at first. The goal is two or three facts
/// that hold together first after `length` actions; it is drawn from all such sets. Domains without one are drawn anew.
///
/// Costs O(states x actions) for each domain that is drawn, of at most 4,096 states.
///
/// # Errors
/// [`TaskError::Range`] if `length` is not in [`TANGLED`].
pub fn tangled(length: usize, rng: &mut impl Rng) -> Result<PlanningProblem, TaskError> {
    let refused = outside("length", length, TANGLED);
    if !TANGLED.contains(&length) {
        return Err(refused);
    }
    for _ in 0..TRIES {
        let adds = |index: usize, rng: &mut _| match index < FACTS {
            true => index,
            false => RngExt::random_range(rng, 0..FACTS),
        };
        let actions: Vec<Action> = (0..ACTIONS)
            .map(|index| {
                let adds = adds(index, rng);
                draw_action(adds, rng)
            })
            .collect();
        let mut start = 0u32;
        while start.count_ones() < START {
            start |= 1 << rng.random_range(0..FACTS);
        }
        let states = explore(start, &actions);
        let first = |goal: &u32| {
            let reached = states.iter().find(|(state, _)| state & goal == *goal);
            reached.is_some_and(|(_, distance)| *distance == length)
        };
        let goals: Vec<u32> = (0u32..1 << FACTS)
            .filter(|goal| matches!(goal.count_ones(), 2 | 3))
            .filter(first)
            .collect();
        if let Some(goal) = goals.choose(rng) {
            return write(&actions, start, *goal);
        }
    }
    Err(refused)
}

fn write(actions: &[Action], start: u32, goal: u32) -> Result<PlanningProblem, TaskError> {
    let list = |set: u32| facts(set).map(|f| format!(" (f{f})")).collect::<String>();
    let mut domain = format!("(define (domain tangled) (:predicates{})", list((1 << FACTS) - 1));
    for (index, action) in actions.iter().enumerate() {
        let deletes: String = facts(action.deletes).map(|f| format!(" (not (f{f}))")).collect();
        let (needs, adds) = (list(action.needs), list(action.adds));
        let _ = write!(
            domain,
            "\n(:action a{index} :parameters () :precondition (and{needs}) :effect (and{adds}{deletes}))"
        );
    }
    domain.push(')');
    let (init, goal) = (list(start), list(goal));
    let problem =
        format!("(define (problem p) (:domain tangled) (:init{init}) (:goal (and{goal})))");
    PlanningProblem::parse(&domain, &problem)
}
