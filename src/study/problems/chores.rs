//! A generator of households with long plans.

use std::fmt::Write as _;
use std::ops::RangeInclusive;

use rand::{Rng, RngExt};

use super::{Distance, PlanningProblem, outside};
use crate::task::TaskError;

/// Lengths of shortest plans that the generator finds.
const CHORES: RangeInclusive<usize> = 5..=18;

/// Most households that are drawn.
const TRIES: usize = 2_000;
/// Most states that a household may have.
const STATES: usize = 60_000;

/// A device with a plug.
struct Device {
    /// Whether it must be taken to another place to be loaded, where it cannot be plugged in.
    carried: bool,
    /// Things that are put into it.
    things: Vec<usize>,
    /// Whether it can be emptied only while it is not plugged in.
    unplugged: bool,
}

/// Draws a household with one socket, one to three devices that each make something of things from a cupboard, and a meal of
/// all that they make. The shortest plan has `length` actions.
///
/// Random are: which devices must be carried to be loaded, what is put into each, which is plugged in at first, which must be
/// unplugged to be emptied, whether the cupboard is shut at first and must be shut at the end, and whether a device must be
/// plugged in or at its place at the end.
///
/// # Errors
/// [`TaskError::Range`] if `length` is not in [`CHORES`].
pub fn chores(length: usize, rng: &mut impl Rng) -> Result<PlanningProblem, TaskError> {
    let refused = outside("length", length, CHORES);
    if !CHORES.contains(&length) {
        return Err(refused);
    }
    for _ in 0..TRIES {
        let drawn = draw(rng)?;
        if drawn.distance(STATES) == Distance::Steps(length) {
            return Ok(drawn);
        }
    }
    Err(refused)
}

fn draw(rng: &mut impl Rng) -> Result<PlanningProblem, TaskError> {
    let things = rng.random_range(1..=3);
    let devices: Vec<Device> = (0..rng.random_range(1..=3))
        .map(|_| Device {
            carried: rng.random(),
            things: (0..things).filter(|_| rng.random_bool(0.5)).collect(),
            unplugged: rng.random(),
        })
        .collect();
    let cupboard: bool = rng.random();
    let mut text = String::from(
        "(define (domain chores) (:requirements :strips :negative-preconditions) (:predicates (open) (meal)",
    );
    for thing in 0..things {
        let _ = write!(text, " (have{thing})");
    }
    for d in 0..devices.len() {
        let _ = write!(text, " (plugged{d}) (away{d}) (loaded{d}) (done{d}) (made{d})");
    }
    text.push(')');
    let mut action = |name: String, needs: String, effects: String| {
        let _ = write!(
            text,
            "\n(:action {name} :parameters () :precondition (and {needs}) :effect (and {effects}))"
        );
    };
    let free: String = (0..devices.len()).map(|d| format!("(not (plugged{d}))")).collect();
    let mut ready = String::new();
    for (d, device) in devices.iter().enumerate() {
        let place = format!("(not (away{d}))");
        action(format!("plug-in{d}"), format!("{free} {place}"), format!("(plugged{d})"));
        action(format!("unplug{d}"), format!("(plugged{d})"), format!("(not (plugged{d}))"));
        let there = match device.carried {
            true => {
                let needs = format!("{place} (not (plugged{d}))");
                action(format!("take{d}"), needs, format!("(away{d})"));
                action(format!("return{d}"), format!("(away{d})"), format!("(not (away{d}))"));
                format!("(away{d})")
            }
            false => String::new(),
        };
        let parts: String = device.things.iter().map(|t| format!("(have{t})")).collect();
        let used: String = device.things.iter().map(|t| format!("(not (have{t}))")).collect();
        let needs = format!("{there} {parts} (not (loaded{d}))");
        action(format!("load{d}"), needs, format!("(loaded{d}) {used}"));
        let done = format!("(done{d}) (not (loaded{d}))");
        action(format!("run{d}"), format!("(plugged{d}) (loaded{d})"), done);
        let off = if device.unplugged { format!("(not (plugged{d}))") } else { String::new() };
        let made = format!("(made{d}) (not (done{d}))");
        action(format!("empty{d}"), format!("(done{d}) {off}"), made);
        let _ = write!(ready, "(made{d})");
    }
    for thing in 0..things {
        let open = if cupboard { "(open)" } else { "" };
        let needs = format!("{open} (not (have{thing}))");
        action(format!("fetch{thing}"), needs, format!("(have{thing})"));
    }
    if cupboard {
        action("open-cupboard".into(), "(not (open))".into(), "(open)".into());
        action("shut-cupboard".into(), "(open)".into(), "(not (open))".into());
    }
    action("serve".into(), ready, "(meal)".into());
    text.push(')');
    let (mut init, mut goal) = (String::new(), String::from("(meal)"));
    if rng.random() {
        let _ = write!(init, "(plugged{})", rng.random_range(0..devices.len()));
    }
    if cupboard && rng.random() {
        goal.push_str("(not (open))");
    }
    if rng.random() {
        let _ = write!(goal, "(plugged{})", rng.random_range(0..devices.len()));
    }
    for (d, device) in devices.iter().enumerate() {
        if device.carried && rng.random() {
            let _ = write!(goal, "(not (away{d}))");
        }
    }
    let problem =
        format!("(define (problem p) (:domain chores) (:init {init}) (:goal (and {goal})))");
    PlanningProblem::parse(&text, &problem)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::goal_sets::Regression;
    use crate::plan::strips::{GroundOperator, Grounded};
    use crate::sim::Seed;
    use std::collections::BTreeSet;

    #[test]
    fn households_are_large_and_full_of_threats() {
        for length in [10, 12, 15] {
            for seed in 0..3 {
                let made = chores(length, &mut Seed::new(seed).rng()).expect("a problem");
                assert_eq!(made.distance(STATES), Distance::Steps(length));
                let made = made.grounded;
                let start: BTreeSet<usize> = made.start.iter().copied().collect();
                let rules = Regression::new(&made);
                let threats: usize = rules.operators.iter().map(|o| o.threatens.len()).sum();
                assert!(threats >= 6, "{threats}");
                // Were nothing made false, every fluent could be reached within a few parallel steps.
                let mut reached: BTreeSet<usize> = start.clone();
                for _ in 1..length {
                    let able = |o: &&GroundOperator| Grounded::all_hold(&reached, &o.preconditions);
                    let adds: Vec<usize> =
                        made.operators.iter().filter(able).flat_map(|o| o.adds.clone()).collect();
                    reached.extend(adds);
                }
                assert_eq!(reached.len(), made.fluents.len());
            }
        }
        assert!(chores(4, &mut Seed::new(1).rng()).is_err());
    }
}
