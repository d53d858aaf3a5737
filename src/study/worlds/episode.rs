//! Carries out a planner's moves in a world.

use super::Run;
use crate::robot::Pose;
use crate::sim::Seed;
use crate::task::recording::{Sensing, Snapshot};

/// How an episode ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Outcome {
    /// Whether the goal is reached, by the rules of the world.
    pub solved: bool,
    /// Whether the planner stopped because it held the goal for reached.
    pub met: bool,
    /// Number of accepted moves.
    pub accepted: usize,
    /// Number of refused moves.
    pub refused: usize,
}

impl Outcome {
    /// Returns whether the planner stopped because it held the goal for reached, and it is.
    pub fn done(&self) -> bool {
        self.solved && self.met
    }
}

/// Carries out moves until the planner stops or `most` moves were tried. Returns the outcome, and why the planner gave up
/// if it did.
///
/// `plan` gets the scene as sensed and returns an object's id and a target pose, `None` if it holds the goal for reached,
/// or the reason for which it knows no move. It is asked again after each move. Errors of sensing are drawn from `seed` and
/// the number of the question.
pub fn carry_out(
    run: &mut Run,
    most: usize,
    sensing: &Sensing,
    seed: Seed,
    mut plan: impl FnMut(&Snapshot) -> Result<Option<(String, Pose)>, String>,
) -> (Outcome, Option<String>) {
    let (mut outcome, mut trouble) = (Outcome::default(), None);
    for question in 0..=most {
        let scene = sensing.apply(&run.snapshot(), seed, question as u64);
        let (object, target) = match plan(&scene) {
            Ok(Some(step)) => step,
            Ok(None) => {
                outcome.met = true;
                break;
            }
            Err(reason) => {
                trouble = Some(reason);
                break;
            }
        };
        if question == most {
            break;
        }
        if run.act(&object, &target) {
            outcome.accepted += 1;
            run.disturb();
        } else {
            outcome.refused += 1;
        }
    }
    outcome.solved = run.solved();
    (outcome, trouble)
}
