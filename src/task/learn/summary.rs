//! What the learner says of each try and of poses that made no state.

use std::collections::BTreeSet;

use super::conclude::Conclusion;
use super::gaussian::PoseGaussian;
use super::scene::Scene;
use crate::task::domain::Pose;

/// What came of a try.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// An instance of the named action.
    Action(String),
    /// Nothing was achieved.
    Failed(Failure),
}

/// Why a try achieved nothing.
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

/// One try and what came of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TryReport {
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
    pub outcome: Outcome,
}

/// Poses that made no state, because they were seen only around failed tries.
#[derive(Debug, Clone, PartialEq)]
pub struct StrayPoses {
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
    /// Every try, in the order of the recording.
    pub tries: Vec<TryReport>,
    /// Poses that made no state.
    pub strays: Vec<StrayPoses>,
    /// Kinds that never moved and have no states.
    pub fixed_kinds: Vec<String>,
}

impl LearnReport {
    /// How many tries failed.
    pub fn failed(&self) -> usize {
        self.tries.iter().filter(|t| matches!(t.outcome, Outcome::Failed(_))).count()
    }
}

impl Scene<'_> {
    /// Reports every try and every cluster that is no state.
    pub(super) fn report(&self, conclusion: &Conclusion<'_>) -> LearnReport {
        let Conclusion { clusters, states, named, judged, operators } = conclusion;
        let number = |demo: usize, snapshot: usize| {
            let demo = &self.recording.demos[demo];
            (demo.number, demo.snapshots[snapshot].number)
        };
        let tries = self
            .tries
            .iter()
            .zip(judged.iter())
            .map(|(t, outcome)| {
                let demo = &self.recording.demos[t.demo];
                let action = |to: &usize| {
                    let state = states.iter().position(|s| s == to).map(|at| &named[at]);
                    operators.iter().find(|o| Some(&o.to) == state).map(|o| o.name.clone())
                };
                TryReport {
                    demo: demo.number,
                    before: number(t.demo, t.before).1,
                    after: number(t.demo, t.after).1,
                    object: t
                        .track
                        .and_then(|track| self.tracks[t.demo][track].id(demo, t.before))
                        .map(str::to_owned),
                    inferred: !t.declared,
                    outcome: match outcome {
                        Ok(to) => Outcome::Action(action(to).unwrap_or_default()),
                        Err(why) => Outcome::Failed(*why),
                    },
                }
            })
            .collect();
        let strays = clusters
            .iter()
            .enumerate()
            .filter(|(index, _)| !states.contains(index))
            .filter_map(|(_, cluster)| {
                let poses: Vec<Pose> = self.poses(cluster).copied().collect();
                Some(StrayPoses {
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
        LearnReport { tries, strays, fixed_kinds }
    }
}
