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
const DOMAIN: &str = include_str!("breakfast.pddl");

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
