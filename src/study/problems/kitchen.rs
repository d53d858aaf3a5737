//! The kitchen of Blouw, Eliasmith and Tripp (2016), and kitchens with more threats.

use super::{PlanningProblem, outside};
use crate::task::TaskError;

/// A kitchen with a kettle, a tap and a socket.
///
/// The goal is boiled water. The kettle is filled under the tap, where it must not be plugged in; it boils only while it is
/// plugged in. In the model of 2016 the senses hold each action back until its turn; here they do not, so the planner has to
/// find the order. Source: "A scaleable spiking neural model of action planning" (CogSci 2016).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Kitchen {
    /// Whether the kettle can be plugged in only on the counter, so that it must be put back.
    pub put_back: bool,
    /// Whether the kettle can be plugged in only once, because that blows the fuse. Then a wrong order is fatal.
    pub one_fuse: bool,
}

impl Kitchen {
    /// Returns the greatest number of actions that this kitchen can need.
    pub fn most_actions(self) -> usize {
        5 + usize::from(self.put_back)
    }

    /// Returns the problem that needs this number of actions, the others being done already.
    ///
    /// # Errors
    /// [`TaskError::Range`] if `actions` is not 2 to [`most_actions`](Self::most_actions).
    pub fn problem(self, actions: usize) -> Result<PlanningProblem, TaskError> {
        let most = self.most_actions();
        if !(2..=most).contains(&actions) {
            return Err(outside("actions", actions, 2..=most));
        }
        // The first situations of both kitchens are the same, counted from the whole plan.
        let begin = match most - actions {
            0 => "(plugged) (on-counter)",
            1 => "(on-counter)",
            2 => "(under-tap)",
            3 => "(under-tap) (full)",
            _ => "(on-counter) (full)",
        };
        let fuse = if self.one_fuse { "(fuse)" } else { "" };
        let init = format!("{begin} {fuse}");
        PlanningProblem::parse(
            &self.domain(),
            &format!("(define (problem tea) (:domain kitchen) (:init {init}) (:goal (boiled)))"),
        )
    }

    fn domain(self) -> String {
        let (place, back) = match self.put_back {
            true => (
                "(on-counter)",
                "(:action put-kettle-back :parameters () :precondition (under-tap)
                    :effect (and (on-counter) (not (under-tap))))",
            ),
            false => ("", ""),
        };
        let (fuse, declared, blown) = match self.one_fuse {
            true => ("(fuse)", "(fuse)", "(not (fuse))"),
            false => ("", "", ""),
        };
        format!(
            "(define (domain kitchen)
                (:requirements :strips :negative-preconditions)
                (:predicates (plugged) (on-counter) (under-tap) (full) (boiled) {declared})
                (:action unplug-kettle :parameters () :precondition (plugged)
                    :effect (not (plugged)))
                (:action put-kettle-under-tap :parameters ()
                    :precondition (and (not (plugged)) (on-counter))
                    :effect (and (under-tap) (not (on-counter))))
                (:action fill-kettle-from-tap :parameters () :precondition (under-tap)
                    :effect (full))
                {back}
                (:action plug-in-kettle :parameters ()
                    :precondition (and (not (plugged)) {place} {fuse})
                    :effect (and (plugged) {blown}))
                (:action boil-kettle :parameters () :precondition (and (plugged) (full))
                    :effect (boiled)))"
        )
    }
}
