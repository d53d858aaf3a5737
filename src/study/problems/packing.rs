//! One-way problems in which only one order of the actions succeeds.

use std::fmt::Write as _;

use rand::Rng;
use rand::seq::SliceRandom;

use super::{PlanningProblem, outside};
use crate::task::TaskError;

/// Draws a problem of packing things into a box, each in its place. A thing blocks the way to all places deeper in the box,
/// and nothing is taken out again, so of all orders only the one from the bottom succeeds. The names of the things do not
/// tell their order.
///
/// A planner that does not notice threats packs in any order: it succeeds once in `things`! trials.
///
/// # Errors
/// [`TaskError::Range`] if `things` is not 2 to 20.
pub fn packing(things: usize, rng: &mut impl Rng) -> Result<PlanningProblem, TaskError> {
    if !(2..=20).contains(&things) {
        return Err(outside("things", things, 2..=20));
    }
    let mut order: Vec<usize> = (0..things).collect();
    order.shuffle(rng);
    let (mut predicates, mut actions) = (String::new(), String::new());
    let (mut init, mut goal) = (String::new(), String::new());
    for thing in 0..things {
        let _ = write!(predicates, " (way-{thing}) (in-{thing})");
        let _ = write!(init, " (way-{thing})");
        let _ = write!(goal, " (in-{thing})");
    }
    for (depth, thing) in order.iter().enumerate() {
        let mut blocked = String::new();
        for deeper in &order[..depth] {
            let _ = write!(blocked, " (not (way-{deeper}))");
        }
        let _ = write!(
            actions,
            "\n(:action pack-{thing} :parameters () :precondition (way-{thing})
                :effect (and (in-{thing}){blocked}))"
        );
    }
    PlanningProblem::parse(
        &format!("(define (domain packing) (:predicates{predicates}){actions})"),
        &format!("(define (problem box) (:domain packing) (:init{init}) (:goal (and{goal})))"),
    )
}

#[cfg(test)]
#[path = "../../../tests/unit/study_packing.rs"]
mod tests;
