//! The learner's report: the outcome of each attempt, and the poses that belong to no state.

use std::collections::BTreeSet;

use super::gaussian::PoseGaussian;
use super::infer::{Inferred, state_of};
use super::observations::Observations;
use crate::robot::Pose;
use crate::task::propositional::{ActionId, StateId};

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

impl LearnReport {
    /// Returns the number of failed attempts.
    pub fn failed(&self) -> usize {
        self.attempts.iter().filter(|t| matches!(t.outcome, AttemptOutcome::Failed(_))).count()
    }
}

impl Observations<'_> {
    /// Builds the report on every attempt and every cluster that is no state.
    pub(super) fn report(&self, inferred: &Inferred<'_>) -> LearnReport {
        let Inferred { clusters, states, judged, operators } = inferred;
        let number = |demo: usize, snapshot: usize| {
            let demo = &self.recording.demos[demo];
            (demo.number, demo.snapshots[snapshot].number)
        };
        let attempts = self
            .attempts
            .iter()
            .zip(judged.iter())
            .map(|(t, outcome)| {
                let demo = &self.recording.demos[t.demo];
                let action = |to: usize| {
                    let state = state_of(to, states);
                    operators
                        .iter()
                        .position(|o| Some(StateId::new(o.to)) == state)
                        .map(ActionId::new)
                };
                AttemptReport {
                    demo: demo.number,
                    before: number(t.demo, t.before).1,
                    after: number(t.demo, t.after).1,
                    object: t
                        .track
                        .and_then(|track| self.tracks[t.demo][track].id(demo, t.before))
                        .map(str::to_owned),
                    inferred: !t.declared,
                    outcome: match outcome.map(action) {
                        Ok(Some(action)) => AttemptOutcome::Action(action),
                        // Unreachable: every state in which a successful attempt ended has an operator.
                        Ok(None) => AttemptOutcome::Failed(Failure::NothingNew),
                        Err(why) => AttemptOutcome::Failed(why),
                    },
                }
            })
            .collect();
        let unexplained = clusters
            .iter()
            .enumerate()
            .filter(|(index, _)| !states.contains(index))
            .filter_map(|(_, cluster)| {
                let poses: Vec<Pose> = self.poses(cluster).copied().collect();
                Some(UnexplainedPoses {
                    kind: self.kinds[cluster.kind].name.to_string(),
                    count: poses.len(),
                    mean: PoseGaussian::fit(&poses)?.mean,
                    seen: cluster.members.iter().map(|(d, _, s)| number(*d, *s)).collect(),
                })
            })
            .collect();
        let mut fixed: BTreeSet<&str> = BTreeSet::new();
        for track in self.tracks.iter().flatten() {
            if self.kinds.iter().all(|k| k.name != track.kind) {
                fixed.insert(&track.kind);
            }
        }
        let fixed_kinds = fixed.into_iter().map(str::to_owned).collect();
        LearnReport { attempts, unexplained, fixed_kinds }
    }
}
