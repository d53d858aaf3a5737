//! What the learner says of each attempt and of poses that made no state.

use std::collections::BTreeSet;

use super::gaussian::PoseGaussian;
use super::infer::{Inferred, state_of};
use super::observations::Observations;
use crate::task::domain::{ActionId, Pose};

/// What came of an attempt.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AttemptOutcome {
    /// An instance of this action of the learned domain.
    Action(ActionId),
    /// Nothing was achieved.
    Failed(Failure),
}

/// Why an attempt achieved nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Failure {
    /// No object moved.
    NothingMoved,
    /// The manipulated part was lost.
    PartLost,
    /// The part ended in a state that held already.
    NothingNew,
    /// The part ended in a place that it did not keep and that others did without on the same way.
    Detour,
    /// The part came back to a state that it had left before, and left it again.
    Undone,
}

/// One attempt and what came of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttemptReport {
    /// The recorder's number of the demonstration.
    pub demo: u64,
    /// The recorder's number of the snapshot before.
    pub before: u64,
    /// The recorder's number of the snapshot after.
    pub after: u64,
    /// The manipulated object's id in the snapshot before.
    pub object: Option<String>,
    /// Whether the object was inferred, not recorded.
    pub inferred: bool,
    /// What came of it.
    pub outcome: AttemptOutcome,
}

/// Poses that made no state, because they were seen only around failed attempts.
#[derive(Debug, Clone, PartialEq)]
pub struct UnexplainedPoses {
    /// The kind of object.
    pub kind: String,
    /// How many poses there are.
    pub count: usize,
    /// Their robust mean.
    pub mean: Pose,
    /// Where they were seen: demonstration and snapshot numbers.
    pub seen: Vec<(u64, u64)>,
}

/// How the learning went.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LearnReport {
    /// Every attempt, in the order of the recording.
    pub attempts: Vec<AttemptReport>,
    /// Poses that made no state.
    pub unexplained: Vec<UnexplainedPoses>,
    /// Kinds that never moved and have no states.
    pub fixed_kinds: Vec<String>,
}

impl LearnReport {
    /// How many attempts failed.
    pub fn failed(&self) -> usize {
        self.attempts.iter().filter(|t| matches!(t.outcome, AttemptOutcome::Failed(_))).count()
    }
}

impl Observations<'_> {
    /// Reports every attempt and every cluster that is no state.
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
                    operators.iter().position(|o| Some(o.to) == state).map(ActionId::new)
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
                        // Every state that an attempt brought about has an operator.
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
