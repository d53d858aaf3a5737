//! Deciding which clusters are states, and counting what each action needs and does.

use std::collections::{BTreeMap, BTreeSet};

use super::gaussian::PoseGaussian;
use super::names::{Landmark, Names, action_name, state_name};
use super::operators::{Evidence, Instance};
use super::scene::{Cluster, Scene};
use super::summary::Failure;
use super::tries::Try;
use super::ways::Ways;
use super::{Learned, Settings};
use crate::task::domain::Pose;
use crate::task::domain::{Domain, KindClusters, Operator, Origin, Provenance, State};
use crate::task::error::TaskError;

/// What was decided, for the report.
pub(super) struct Conclusion<'a> {
    pub clusters: &'a [Cluster],
    /// The clusters that are states, and their names.
    pub states: &'a [usize],
    pub named: &'a [String],
    /// For each try, the cluster that it brought about, or why it failed.
    pub judged: &'a [Result<usize, Failure>],
    pub operators: &'a [Operator],
}

impl Scene<'_> {
    /// For each try, the cluster that it brought about, or why it failed, if the given clusters
    /// are states.
    fn judge(&self, states: &[usize], ways: &Ways) -> Vec<Result<usize, Failure>> {
        let judge = |(index, t): (usize, &Try)| {
            let track = t.track.ok_or(Failure::NothingMoved)?;
            let to = self.label(t.demo, track, t.after).ok_or(Failure::PartLost)?;
            if ways.detours.contains(&to) {
                return Err(Failure::Detour);
            }
            if ways.undone.contains(&index) {
                return Err(Failure::Undone);
            }
            let at = states.iter().position(|s| *s == to).ok_or(Failure::NothingNew)?;
            let before = self.global_state(t.demo, t.before, states);
            if before[at] { Err(Failure::NothingNew) } else { Ok(to) }
        };
        self.tries.iter().enumerate().map(judge).collect()
    }

    /// Decides which clusters are states, and builds the domain and the report.
    pub fn conclude(&self, settings: &Settings) -> Result<Learned, TaskError> {
        let clusters = self.clusters();
        let mut states: Vec<usize> = (0..clusters.len()).collect();
        let ways = self.ways(&clusters);
        states.retain(|s| !ways.detours.contains(s));
        let judged = loop {
            let judged = self.judge(&states, &ways);
            let strays = self.strays(&states, &judged);
            if strays.is_empty() {
                break judged;
            }
            states.retain(|s| !strays.contains(s));
        };
        let (named, models) = self.name_states(&clusters, &states);
        let operators = self.operators(&states, &named, &judged);
        let goal = self.goal(&states, &named, &judged);
        let provenance = Provenance {
            symbolt: env!("CARGO_PKG_VERSION").into(),
            seed: settings.seed,
            p: settings.p,
            threshold_m: settings.threshold_m,
            demonstrations: self.recording.demos.len(),
            snapshots: self.recording.snapshot_count(),
            clusters: self
                .kinds
                .iter()
                .map(|k| KindClusters {
                    kind: k.name.to_string(),
                    threshold_m: Some(k.threshold).filter(|t| t.is_finite()),
                    next_merge_m: k.tree.next_merge(k.threshold),
                })
                .collect(),
        };
        let report = self.report(&Conclusion {
            clusters: &clusters,
            states: &states,
            judged: &judged,
            named: &named,
            operators: &operators,
        });
        let domain = Domain::new(models, operators, goal, provenance)?;
        Ok(Learned { domain, report })
    }

    /// States that were touched by failed tries and by no action.
    fn strays(&self, states: &[usize], judged: &[Result<usize, Failure>]) -> BTreeSet<usize> {
        let (mut used, mut failed) = (BTreeSet::new(), BTreeSet::new());
        for (attempt, outcome) in self.tries.iter().zip(judged) {
            let Some(track) = attempt.track else { continue };
            let ends = [attempt.before, attempt.after]
                .into_iter()
                .filter_map(|s| self.label(attempt.demo, track, s));
            if outcome.is_ok() { &mut used } else { &mut failed }.extend(ends);
        }
        failed.into_iter().filter(|s| states.contains(s) && !used.contains(s)).collect()
    }

    fn name_states(&self, clusters: &[Cluster], states: &[usize]) -> (Vec<String>, Vec<State>) {
        let landmarks = self.landmarks();
        let mut names = Names::default();
        let mut models = Vec::new();
        for s in states {
            let cluster = &clusters[*s];
            let poses: Vec<Pose> = self.poses(cluster).copied().collect();
            let Some(fit) = PoseGaussian::fit(&poses) else { continue };
            let origin =
                if cluster.placed > cluster.found { Origin::Placed } else { Origin::Found };
            let kind = self.kinds[cluster.kind].name.to_string();
            models.push(State {
                name: names.take(&state_name(&kind, origin, &fit.mean, &landmarks)),
                kind,
                count: poses.len(),
                distinct: self.distinct(cluster),
                origin,
                mean: fit.mean,
                covariance: fit.covariance,
            });
        }
        (models.iter().map(|m| m.name.clone()).collect(), models)
    }

    /// The objects of the first snapshot whose kind never moved.
    fn landmarks(&self) -> Vec<Landmark> {
        let first = self.recording.demos.iter().flat_map(|d| d.snapshots.first()).next();
        first
            .map(|snapshot| {
                snapshot
                    .objects
                    .iter()
                    .filter(|o| self.kinds.iter().all(|k| k.name != o.kind))
                    .map(|o| Landmark { kind: o.kind.to_string(), pose: o.pose })
                    .collect()
            })
            .unwrap_or_default()
    }

    /// One operator for each state in which a part was let go.
    fn operators(
        &self,
        states: &[usize],
        named: &[String],
        judged: &[Result<usize, Failure>],
    ) -> Vec<Operator> {
        let name = |index: usize| named[index].clone();
        // States and actions share one space of names.
        let mut names = Names::default();
        for name in named {
            names.take(name);
        }
        let mut operators = Vec::new();
        for (at, state) in states.iter().enumerate() {
            let of_it: Vec<&Try> = self
                .tries
                .iter()
                .zip(judged)
                .filter(|(_, outcome)| **outcome == Ok(*state))
                .map(|(attempt, _)| attempt)
                .collect();
            let Some(first) = of_it.first() else { continue };
            let Some(track) = first.track else { continue };
            let instances: Vec<Instance> = of_it
                .iter()
                .map(|t| Instance {
                    before: self.global_state(t.demo, t.before, states),
                    after: self.global_state(t.demo, t.after, states),
                })
                .collect();
            let mut origins: BTreeMap<usize, usize> = BTreeMap::new();
            for attempt in &of_it {
                let from = attempt.track.and_then(|t| self.label(attempt.demo, t, attempt.before));
                if let Some(from) = from.and_then(|f| states.iter().position(|s| *s == f)) {
                    *origins.entry(from).or_default() += 1;
                }
            }
            let from = origins
                .into_iter()
                .max_by(|a, b| a.1.cmp(&b.1).then(b.0.cmp(&a.0)))
                .map(|(from, _)| name(from));
            let evidence = Evidence::count(&instances);
            let list = |which: Vec<usize>| which.into_iter().map(name).collect();
            operators.push(Operator {
                name: names.take(&action_name(&named[at])),
                kind: self.tracks[first.demo][track].kind.to_string(),
                from,
                to: name(at),
                preconditions: list(evidence.preconditions()),
                effects: list(evidence.effects()),
                absent: list(evidence.absent()),
                removes: list(evidence.removes()),
                evidence: evidence.into(),
            });
        }
        operators
    }

    /// The state that the last action of most demonstrations brought about.
    fn goal(
        &self,
        states: &[usize],
        named: &[String],
        judged: &[Result<usize, Failure>],
    ) -> Option<String> {
        let mut last: BTreeMap<usize, usize> = BTreeMap::new();
        for (attempt, outcome) in self.tries.iter().zip(judged) {
            if let Ok(to) = outcome {
                last.insert(attempt.demo, *to);
            }
        }
        let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
        for to in last.into_values() {
            *counts.entry(to).or_default() += 1;
        }
        let (goal, _) = counts.into_iter().max_by(|a, b| a.1.cmp(&b.1).then(b.0.cmp(&a.0)))?;
        states.iter().position(|s| *s == goal).map(|at| named[at].clone())
    }
}
