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
    /// Whether the planner stopped by itself, because it held the goal for reached or knew no move.
    pub stopped: bool,
    /// Number of accepted moves.
    pub accepted: usize,
    /// Number of refused moves.
    pub refused: usize,
}

/// Carries out moves until the planner stops or `most` moves were tried.
///
/// `plan` gets the scene as sensed and returns an object's id and a target pose, or `None` to stop. It is asked again
/// after each move. Errors of sensing are drawn from `seed` and the number of the question.
pub fn carry_out(
    run: &mut Run,
    most: usize,
    sensing: &Sensing,
    seed: Seed,
    mut plan: impl FnMut(&Snapshot) -> Option<(String, Pose)>,
) -> Outcome {
    let mut outcome = Outcome::default();
    for question in 0..=most {
        let scene = sensing.apply(&run.snapshot(), seed, question as u64);
        let Some((object, target)) = plan(&scene) else {
            outcome.stopped = true;
            break;
        };
        if question == most {
            break;
        }
        if run.act(&object, &target) {
            outcome.accepted += 1;
        } else {
            outcome.refused += 1;
        }
    }
    outcome.solved = run.solved();
    outcome
}
