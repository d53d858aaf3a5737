//! The learner's report: the outcome of each attempt, and the poses that belong to no state.

use super::attempts::Attempt;
use super::gaussian::PoseGaussian;
use super::tracks::Track;
use crate::robot::Pose;
use crate::task::propositional::ActionId;
use crate::task::recording::{Demonstration, Recording};

/// The outcome of an attempt.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AttemptOutcome {
    /// The attempt is an instance of this action of the learned domain.
    Action(ActionId),
    /// The attempt achieved nothing.
    Failed(Failure),
}

/// Why an attempt failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Failure {
    /// No object moved.
    NothingMoved,
    /// The manipulated object was lost.
    PartLost,
    /// The object began in no state.
    StartUnknown,
    /// The object ended in a state that already held before the attempt, or in no state.
    NothingNew,
    /// The object ended in a detour: a place where objects seldom stay, and which they bypass at least as often as they
    /// pass through it.
    Detour,
    /// The object returned to a state that it had left earlier. This is no failure if the object stays there in at
    /// least half of the demonstrations.
    Undone,
}

/// One attempt and its outcome.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttemptReport {
    /// Number of the demonstration, as recorded.
    pub demo: u64,
    /// Number of the snapshot before the attempt, as recorded.
    pub before: u64,
    /// Number of the snapshot after the attempt, as recorded.
    pub after: u64,
    /// Id of the manipulated object in the snapshot before the attempt; `None` if no manipulated object was found.
    pub object: Option<String>,
    /// Whether the manipulated object was inferred instead of recorded.
    pub inferred: bool,
    /// Outcome of the attempt.
    pub outcome: AttemptOutcome,
}

/// A cluster of poses that is no state, because it was seen only around failed attempts.
#[derive(Debug, Clone, PartialEq)]
pub struct UnexplainedPoses {
    /// Kind of the objects.
    pub kind: String,
    /// Number of poses.
    pub count: usize,
    /// Robust mean of the poses.
    pub mean: Pose,
    /// Demonstration and snapshot number of each pose.
    pub seen: Vec<(u64, u64)>,
}

/// The learner's report on attempts, unexplained poses and fixtures.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LearnReport {
    /// Every attempt, in the order of the recording.
    pub attempts: Vec<AttemptReport>,
    /// Clusters of poses that are no states.
    pub unexplained: Vec<UnexplainedPoses>,
    /// Kinds of objects that never moved, and so have no states.
    pub fixed_kinds: Vec<String>,
}

impl AttemptReport {
    /// Reports on an attempt in a demonstration whose objects have these tracks.
    pub(super) fn new(
        attempt: &Attempt,
        demo: &Demonstration,
        tracks: &[Track],
        judged: Result<ActionId, Failure>,
    ) -> Self {
        let object = attempt.track.and_then(|track| tracks[track].id(demo, attempt.before));
        Self {
            demo: demo.number,
            before: demo.snapshots[attempt.before].number,
            after: demo.snapshots[attempt.after].number,
            object: object.map(str::to_owned),
            inferred: !attempt.declared,
            outcome: judged.map_or_else(AttemptOutcome::Failed, AttemptOutcome::Action),
        }
    }
}

impl UnexplainedPoses {
    /// Describes poses of a kind, with the demonstration and snapshot in which each was seen; `None` if there are none.
    pub(super) fn new(
        kind: &str,
        poses: &[Pose],
        seen: impl Iterator<Item = (usize, usize)>,
        recording: &Recording,
    ) -> Option<Self> {
        let number = |(demo, snapshot): (usize, usize)| {
            let demo = &recording.demos[demo];
            (demo.number, demo.snapshots[snapshot].number)
        };
        let mean = PoseGaussian::fit(poses)?.mean;
        let (kind, count) = (kind.to_owned(), poses.len());
        Some(Self { kind, count, mean, seen: seen.map(number).collect() })
    }
}

impl LearnReport {
    /// Returns the number of failed attempts.
    pub fn failed(&self) -> usize {
        self.attempts.iter().filter(|t| matches!(t.outcome, AttemptOutcome::Failed(_))).count()
    }
}
