//! Carries out a planner's moves in a world.

use std::collections::HashSet;

use super::Run;
use crate::robot::Pose;
use crate::sim::Seed;
use crate::task::recording::{ObjectPose, Sensing, Snapshot};

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

/// Number of times that a scene is sensed for one look, for objects that are missing from some of them.
const FRAMES: u64 = 3;

/// Looks at a scene: each object as it is first sensed, or as it was `known` if it is missing from all frames.
fn look(
    scene: Snapshot,
    sensing: &Sensing,
    seed: Seed,
    question: u64,
    known: &mut Vec<ObjectPose>,
) -> Snapshot {
    let frames = (0..FRAMES).map(|frame| sensing.apply(&scene, seed, question + (frame << 32)));
    let mut seen = HashSet::new();
    for object in frames.flat_map(|frame| frame.objects) {
        if seen.insert(object.id.clone()) {
            match known.iter_mut().find(|k| k.id == object.id) {
                Some(known) => *known = object,
                None => known.push(object),
            }
        }
    }
    Snapshot { objects: known.clone(), ..scene }
}

/// Carries out moves until the planner stops or `most` moves were tried. Returns the outcome, and why the planner gave up
/// if it did.
///
/// `plan` gets the scene as sensed and returns an object's id and a target pose, `None` if it holds the goal for reached,
/// or the reason for which it knows no move. It is asked again after each move. Errors of sensing are drawn from `seed` and
/// the number of the question; what is not seen for a moment lies where it was seen last.
pub fn carry_out(
    run: &mut Run,
    most: usize,
    sensing: &Sensing,
    seed: Seed,
    mut plan: impl FnMut(&Snapshot) -> Result<Option<(String, Pose)>, String>,
) -> (Outcome, Option<String>) {
    let (mut outcome, mut trouble) = (Outcome::default(), None);
    let mut known = Vec::new();
    for question in 0..=most {
        let scene = look(run.snapshot(), sensing, seed, question as u64, &mut known);
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
