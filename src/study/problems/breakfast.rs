//! Tea, and toast on the same socket.

use super::PlanningProblem;
use crate::task::TaskError;

/// What is wanted for breakfast.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Breakfast {
    /// A cup of tea: ten actions.
    Tea,
    /// Tea and buttered toast: fourteen actions.
    TeaAndToast,
    /// Both, and the kettle plugged in again: sixteen actions.
    PluggedInAgain,
}

impl Breakfast {
    /// All of them with their names.
    pub const ALL: [(&'static str, Self); 3] = [
        ("tea", Self::Tea),
        ("tea and toast on one socket", Self::TeaAndToast),
        ("tea and toast, kettle plugged in again", Self::PluggedInAgain),
    ];

    /// Returns the length of the shortest plan.
    pub fn shortest(self) -> usize {
        match self {
            Self::Tea => 10,
            Self::TeaAndToast => 14,
            Self::PluggedInAgain => 16,
        }
    }
}

/// The domain: 18 fluents and 14 operators.
const DOMAIN: &str = "(define (domain breakfast)
    (:requirements :strips :negative-preconditions)
    (:predicates (kettle-in) (toaster-in) (on-counter) (under-tap) (full) (boiled) (cup) (bag) (tea)
        (bread-in) (toast) (buttered))
    (:action unplug-kettle :parameters () :precondition (kettle-in) :effect (not (kettle-in)))
    (:action plug-in-kettle :parameters ()
        :precondition (and (not (kettle-in)) (not (toaster-in)) (on-counter)) :effect (kettle-in))
    (:action put-kettle-under-tap :parameters ()
        :precondition (and (not (kettle-in)) (on-counter))
        :effect (and (under-tap) (not (on-counter))))
    (:action put-kettle-back :parameters () :precondition (under-tap)
        :effect (and (on-counter) (not (under-tap))))
    (:action fill-kettle :parameters () :precondition (and (under-tap) (not (full)))
        :effect (full))
    (:action boil :parameters () :precondition (and (kettle-in) (full)) :effect (boiled))
    (:action get-cup :parameters () :precondition (not (cup)) :effect (cup))
    (:action put-bag-in-cup :parameters () :precondition (and (cup) (not (bag))) :effect (bag))
    (:action pour :parameters () :precondition (and (boiled) (bag) (not (kettle-in)) (on-counter))
        :effect (and (tea) (not (full)) (not (boiled))))
    (:action plug-in-toaster :parameters ()
        :precondition (and (not (kettle-in)) (not (toaster-in))) :effect (toaster-in))
    (:action unplug-toaster :parameters () :precondition (toaster-in) :effect (not (toaster-in)))
    (:action put-bread-in :parameters () :precondition (not (bread-in)) :effect (bread-in))
    (:action toast-bread :parameters () :precondition (and (toaster-in) (bread-in))
        :effect (and (toast) (not (bread-in))))
    (:action butter-toast :parameters () :precondition (toast)
        :effect (and (buttered) (not (toast)))))";

/// Returns the problem: the kettle stands on the counter, empty and plugged in.
///
/// # Errors
/// None: the text is typed STRIPS. The type is that of all problems.
pub fn breakfast(wanted: Breakfast) -> Result<PlanningProblem, TaskError> {
    let goal = match wanted {
        Breakfast::Tea => "(tea)",
        Breakfast::TeaAndToast => "(tea) (buttered)",
        Breakfast::PluggedInAgain => "(tea) (buttered) (kettle-in)",
    };
    let init = "(kettle-in) (on-counter)";
    let problem = format!(
        "(define (problem morning) (:domain breakfast) (:init {init}) (:goal (and {goal})))"
    );
    PlanningProblem::parse(DOMAIN, &problem)
}
