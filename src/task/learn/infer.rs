//! Infers which clusters are states, and the preconditions and effects of each action.

use std::collections::{BTreeMap, BTreeSet};

use super::attempts::Attempt;
use super::gaussian::PoseGaussian;
use super::observations::{Cluster, Observations};
use super::operators::{Evidence, Instance};
use super::summary::{AttemptReport, Failure, LearnReport, UnexplainedPoses};
use super::transitions::Transitions;
use super::{Learned, Settings};
use crate::robot::Pose;
use crate::task::domain::gaussian::{CountedOperator, GaussianState, Gaussians, Geometry};
use crate::task::domain::naming::{Names, action_symbol, landmarks, symbol_in_world};
use crate::task::domain::{KindClusters, Origin, Provenance};
use crate::task::error::TaskError;
use crate::task::propositional::{ActionId, StateId};

impl Observations<'_> {
    /// Returns for each attempt the cluster in which it ended, or why it failed. The clusters `states` are taken as the
    /// states.
    fn judge(&self, states: &[usize], transitions: &Transitions) -> Vec<Result<usize, Failure>> {
        let judge = |(index, t): (usize, &Attempt)| {
            let track = t.track.ok_or(Failure::NothingMoved)?;
            let to = self.label(t.demo, track, t.after).ok_or(Failure::PartLost)?;
            if transitions.detours.contains(&to) {
                return Err(Failure::Detour);
            }
            if transitions.undone.contains(&index) {
                return Err(Failure::Undone);
            }
            let state = state_of(to, states).ok_or(Failure::NothingNew)?;
            let before = self.world_state(t.demo, t.before, states);
            if before.holds(state) { Err(Failure::NothingNew) } else { Ok(to) }
        };
        self.attempts.iter().enumerate().map(judge).collect()
    }

    /// Decides which clusters are states, then builds the domain and the report.
    pub fn infer(&self, settings: &Settings) -> Result<Learned, TaskError> {
        let clusters = self.clusters();
        let mut states: Vec<usize> = (0..clusters.len()).collect();
        let transitions = self.transitions(&clusters);
        states.retain(|s| !transitions.detours.contains(s));
        let judged = loop {
            let judged = self.judge(&states, &transitions);
            let unexplained = self.unexplained(&states, &judged);
            if unexplained.is_empty() {
                break judged;
            }
            states.retain(|s| !unexplained.contains(s));
        };
        let models = self.name_states(&clusters, &states);
        let operators = self.operators(&states, &models, &judged);
        let goal = self.goal(&states, &judged);
        let clusterings = self.kinds.iter().map(|k| KindClusters {
            kind: k.name.to_string(),
            threshold_m: Some(k.threshold).filter(|t| t.is_finite()),
            next_merge_m: k.tree.next_merge(k.threshold),
        });
        let provenance = Provenance {
            threshold_m: settings.threshold_m,
            clusters: clusterings.collect(),
            ..settings.provenance(self.recording)
        };
        let report = self.report(&clusters, &states, &judged, &operators);
        let domain = Gaussians { states: models, operators, goal, provenance }.domain()?;
        let (unachieved, unsure_frames) = (Vec::new(), Vec::new());
        let remarks = Vec::new();
        Ok(Learned { domain, report, outliers: 0, unachieved, unsure_frames, remarks })
    }

    /// Returns the clusters that occur only before or after failed attempts.
    fn unexplained(&self, states: &[usize], judged: &[Result<usize, Failure>]) -> BTreeSet<usize> {
        let (mut used, mut failed) = (BTreeSet::new(), BTreeSet::new());
        for (attempt, outcome) in self.attempts.iter().zip(judged) {
            let Some(track) = attempt.track else { continue };
            let ends = [attempt.before, attempt.after]
                .into_iter()
                .filter_map(|s| self.label(attempt.demo, track, s));
            if outcome.is_ok() { &mut used } else { &mut failed }.extend(ends);
        }
        failed.into_iter().filter(|s| states.contains(s) && !used.contains(s)).collect()
    }

    fn name_states(&self, clusters: &[Cluster], states: &[usize]) -> Vec<GaussianState> {
        let fixed = |kind: &str| self.kinds.iter().all(|k| *k.name != *kind);
        let landmarks = landmarks(self.recording, fixed);
        let mut names = Names::default();
        let mut models = Vec::new();
        for s in states {
            let cluster = &clusters[*s];
            let poses: Vec<Pose> = self.poses(cluster).copied().collect();
            let Some(fit) = PoseGaussian::fit(&poses) else { continue };
            let origin =
                if cluster.placed > cluster.found { Origin::Placed } else { Origin::Found };
            let kind = self.kinds[cluster.kind].name.to_string();
            models.push(GaussianState {
                name: names.take(&symbol_in_world(&kind, origin, &fit.mean, &landmarks)),
                kind,
                geometry: Geometry {
                    count: poses.len(),
                    distinct: self.distinct(cluster),
                    origin,
                    mean: fit.mean,
                    covariance: fit.covariance,
                },
            });
        }
        models
    }

    /// Builds one operator for each state in which a successful attempt ended.
    fn operators(
        &self,
        states: &[usize],
        named: &[GaussianState],
        judged: &[Result<usize, Failure>],
    ) -> Vec<CountedOperator> {
        // States and actions share one set of unique names.
        let mut names = Names::default();
        for state in named {
            names.take(&state.name);
        }
        let mut operators = Vec::new();
        for (at, state) in states.iter().enumerate() {
            let of_it: Vec<&Attempt> = self
                .attempts
                .iter()
                .zip(judged)
                .filter(|(_, outcome)| **outcome == Ok(*state))
                .map(|(attempt, _)| attempt)
                .collect();
            if of_it.is_empty() {
                continue;
            }
            let instances: Vec<Instance> = of_it
                .iter()
                .map(|t| Instance {
                    before: self.world_state(t.demo, t.before, states),
                    after: self.world_state(t.demo, t.after, states),
                })
                .collect();
            let mut origins: BTreeMap<StateId, usize> = BTreeMap::new();
            for attempt in &of_it {
                let from = attempt.track.and_then(|t| self.label(attempt.demo, t, attempt.before));
                if let Some(from) = from.and_then(|f| state_of(f, states)) {
                    *origins.entry(from).or_default() += 1;
                }
            }
            let from = origins
                .into_iter()
                .max_by(|a, b| a.1.cmp(&b.1).then(b.0.cmp(&a.0)))
                .map(|(from, _)| from);
            let evidence = Evidence::count(&instances);
            let indices = |states: Vec<StateId>| states.into_iter().map(StateId::index).collect();
            operators.push(CountedOperator {
                name: names.take(&action_symbol(&named[at].name)),
                from: from.map(StateId::index),
                to: at,
                preconditions: indices(evidence.preconditions()),
                effects: (evidence.effects().iter().map(|s| s.index()))
                    .filter(|state| *state != at)
                    .map(|state| (state, evidence.change[state].max(0) as usize))
                    .collect(),
                absent: indices(evidence.absent()),
                instances: evidence.instances as usize,
                before: evidence.before,
            });
        }
        operators
    }

    /// Returns the state that most demonstrations reached with their last action, in how many they did, and of how many.
    fn goal(
        &self,
        states: &[usize],
        judged: &[Result<usize, Failure>],
    ) -> Option<(usize, [usize; 2])> {
        let mut last: BTreeMap<usize, usize> = BTreeMap::new();
        for (attempt, outcome) in self.attempts.iter().zip(judged) {
            if let Ok(to) = outcome {
                last.insert(attempt.demo, *to);
            }
        }
        let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
        for to in last.into_values() {
            *counts.entry(to).or_default() += 1;
        }
        let (goal, held) = counts.into_iter().max_by(|a, b| a.1.cmp(&b.1).then(b.0.cmp(&a.0)))?;
        Some((state_of(goal, states)?.index(), [held, self.recording.demos.len()]))
    }

    /// Builds the report on every attempt and every cluster that is no state.
    fn report(
        &self,
        clusters: &[Cluster],
        states: &[usize],
        judged: &[Result<usize, Failure>],
        operators: &[CountedOperator],
    ) -> LearnReport {
        let attempts = self.attempts.iter().zip(judged).map(|(attempt, judged)| {
            let demo = &self.recording.demos[attempt.demo];
            // Every state in which a successful attempt ended has an operator.
            let judged = judged.and_then(|to| {
                let state = state_of(to, states).map(StateId::index);
                let action = operators.iter().position(|o| Some(o.to) == state);
                action.map(ActionId::new).ok_or(Failure::NothingNew)
            });
            AttemptReport::new(attempt, demo, &self.tracks[attempt.demo], judged)
        });
        let lost = clusters.iter().enumerate().filter(|(index, _)| !states.contains(index));
        let unexplained = lost.filter_map(|(_, cluster)| {
            let poses: Vec<Pose> = self.poses(cluster).copied().collect();
            let seen = cluster.members.iter().map(|(demo, _, snapshot)| (*demo, *snapshot));
            UnexplainedPoses::new(&self.kinds[cluster.kind].name, &poses, seen, self.recording)
        });
        let tracks = self.tracks.iter().flatten();
        let fixed = tracks.filter(|track| self.kinds.iter().all(|k| k.name != track.kind));
        let fixed: BTreeSet<&str> = fixed.map(|track| &*track.kind).collect();
        LearnReport {
            attempts: attempts.collect(),
            unexplained: unexplained.collect(),
            fixed_kinds: fixed.into_iter().map(str::to_owned).collect(),
        }
    }
}

/// Returns the id of the state that a cluster became, if any.
fn state_of(cluster: usize, states: &[usize]) -> Option<StateId> {
    states.iter().position(|s| *s == cluster).map(StateId::new)
}
