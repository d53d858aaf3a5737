//! Observations: a recording as parts that move between clusters of poses.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::sync::Arc;

use super::Settings;
use super::attempts::{Attempt, MOVED_M, cut, guess};
use super::linkage::Dendrogram;
use super::threshold::{Manipulation, choose};
use super::tracks::{Track, follow};
use crate::robot::Pose;
use crate::task::error::TaskError;
use crate::task::event::{Event, LearningStep, Observer};
use crate::task::propositional::WorldState;
use crate::task::recording::Recording;

/// A recording with its tracks, attempts and clusters.
pub(super) struct Observations<'r> {
    pub recording: &'r Recording,
    pub tracks: Vec<Vec<Track>>,
    pub attempts: Vec<Attempt>,
    pub kinds: Vec<Kind>,
}

/// A kind of object that moves, with its clustered poses.
pub(super) struct Kind {
    pub name: Arc<str>,
    /// (demonstration, track, snapshot) of every clustered pose.
    poses: Vec<(usize, usize, usize)>,
    /// Index in `poses` of each (demonstration, track, snapshot).
    places: HashMap<(usize, usize, usize), usize>,
    pub tree: Dendrogram,
    /// Linkage at which the dendrogram is cut.
    pub threshold: f64,
    /// Cluster of each pose. Clusters of all kinds are numbered together.
    labels: Vec<usize>,
}

/// A cluster of poses, which may become a state.
pub(super) struct Cluster {
    pub kind: usize,
    pub members: Vec<(usize, usize, usize)>,
    /// Number of times that an attempt brought a part into the cluster.
    pub placed: usize,
    /// Number of times that a part came into the cluster without an attempt.
    pub found: usize,
}

impl<'r> Observations<'r> {
    /// Tracks all objects, cuts the attempts, guesses the manipulated objects and builds the dendrograms.
    pub fn observe(
        recording: &'r Recording,
        settings: &Settings,
        observer: &mut dyn Observer,
    ) -> Result<Self, TaskError> {
        let snapshots = recording.snapshot_count();
        observer.observe(&Event::Learning(LearningStep::Following { snapshots }));
        let tracks: Vec<Vec<Track>> = recording.demos.iter().map(follow).collect();
        let mut attempts = Vec::new();
        for (d, demo) in recording.demos.iter().enumerate() {
            for mut attempt in cut(d, demo, &tracks[d]) {
                if !attempt.declared {
                    attempt.track = guess(demo, &tracks[d], &attempt, settings.p);
                }
                attempts.push(attempt);
            }
        }
        let falling: HashSet<(usize, usize, usize)> =
            attempts.iter().filter_map(Attempt::falling).collect();
        let mut moving: BTreeMap<Arc<str>, bool> = BTreeMap::new();
        for (demo, tracks) in recording.demos.iter().zip(&tracks) {
            for track in tracks {
                let moves = (1..demo.snapshots.len())
                    .filter_map(|now| track.moved(demo, now - 1, now))
                    .any(|moved| moved >= MOVED_M);
                *moving.entry(track.kind.clone()).or_default() |= moves;
            }
        }
        let mut kinds = Vec::new();
        for name in moving.into_iter().filter(|(_, moves)| *moves).map(|(name, _)| name) {
            let mut poses = Vec::new();
            let mut positions = Vec::new();
            for (d, demo) in recording.demos.iter().enumerate() {
                for (t, track) in tracks[d].iter().enumerate().filter(|(_, t)| t.kind == name) {
                    for s in 0..demo.snapshots.len() {
                        let Some(object) = track.at[s] else { continue };
                        if !falling.contains(&(d, t, s)) {
                            poses.push((d, t, s));
                            positions.push(demo.snapshots[s].objects[object].pose.position);
                        }
                    }
                }
            }
            let step = LearningStep::Clustering { kind: &name, poses: poses.len() };
            observer.observe(&Event::Learning(step));
            let tree = Dendrogram::new(&positions, settings.p, &name)?;
            let places = poses.iter().copied().zip(0..).collect();
            let labels = Vec::new();
            kinds.push(Kind { name, poses, places, tree, threshold: f64::INFINITY, labels });
        }
        Ok(Self { recording, tracks, attempts, kinds })
    }
}

impl Observations<'_> {
    /// Cuts the dendrogram of every kind into clusters.
    pub fn cluster(&mut self, settings: &Settings) {
        let mut first = 0;
        for k in 0..self.kinds.len() {
            let manipulations: Vec<Manipulation> = self
                .attempts
                .iter()
                .filter_map(|t| {
                    let track = t.track?;
                    let kind = &self.kinds[k];
                    let before = *kind.places.get(&(t.demo, track, t.before))?;
                    let after = *kind.places.get(&(t.demo, track, t.after))?;
                    let demo = &self.recording.demos[t.demo];
                    let moved = self.tracks[t.demo][track].moved(demo, t.before, t.after)?;
                    Some(Manipulation { demo: t.demo, before, after, moved })
                })
                .collect();
            let kind = &mut self.kinds[k];
            kind.threshold = match settings.threshold_m {
                Some(threshold) => threshold,
                None => choose(&kind.tree, &manipulations),
            };
            kind.labels = kind.tree.cut(kind.threshold).iter().map(|l| l + first).collect();
            first += kind.labels.iter().max().map_or(0, |l| l + 1 - first);
        }
    }

    pub fn kind_of(&self, demo: usize, track: usize) -> Option<usize> {
        self.kinds.iter().position(|k| k.name == self.tracks[demo][track].kind)
    }

    /// Returns the cluster of a track in a snapshot.
    pub fn label(&self, demo: usize, track: usize, snapshot: usize) -> Option<usize> {
        let kind = &self.kinds[self.kind_of(demo, track)?];
        kind.places.get(&(demo, track, snapshot)).map(|place| kind.labels[*place])
    }

    /// Corrects guesses of the manipulated part. If the guessed part stayed in its cluster and exactly one other part
    /// moved to a cluster that was empty before, the other part was manipulated and the guessed part was knocked aside.
    /// Returns whether any guess changed.
    pub fn reconsider(&mut self) -> bool {
        let mut changed = false;
        for index in 0..self.attempts.len() {
            let attempt = self.attempts[index];
            let (Some(guessed), false) = (attempt.track, attempt.declared) else { continue };
            let (d, before, after) = (attempt.demo, attempt.before, attempt.after);
            let ends = |t: usize| Some((self.label(d, t, before)?, self.label(d, t, after)?));
            if ends(guessed).is_none_or(|(from, to)| from != to) {
                continue;
            }
            let held: BTreeSet<usize> =
                (0..self.tracks[d].len()).filter_map(|t| self.label(d, t, before)).collect();
            let demo = &self.recording.demos[d];
            let others: Vec<usize> = (0..self.tracks[d].len())
                .filter(|t| ends(*t).is_some_and(|(from, to)| from != to && !held.contains(&to)))
                .filter(|t| {
                    self.tracks[d][*t].moved(demo, before, after).is_some_and(|m| m >= MOVED_M)
                })
                .collect();
            if let [other] = others[..] {
                self.attempts[index].track = Some(other);
                changed = true;
            }
        }
        changed
    }

    /// Returns all clusters and counts how parts came into them.
    pub fn clusters(&self) -> Vec<Cluster> {
        let mut clusters: Vec<Cluster> = Vec::new();
        for (k, kind) in self.kinds.iter().enumerate() {
            for (pose, label) in kind.poses.iter().zip(&kind.labels) {
                while clusters.len() <= *label {
                    clusters.push(Cluster { kind: k, members: Vec::new(), placed: 0, found: 0 });
                }
                clusters[*label].members.push(*pose);
            }
        }
        let arrivals: BTreeSet<(usize, usize, usize)> =
            self.attempts.iter().filter_map(|t| Some((t.demo, t.track?, t.after))).collect();
        for (d, tracks) in self.tracks.iter().enumerate() {
            for t in 0..tracks.len() {
                let mut last = None;
                for s in 0..self.recording.demos[d].snapshots.len() {
                    let Some(now) = self.label(d, t, s) else { continue };
                    if last != Some(now) {
                        if arrivals.contains(&(d, t, s)) {
                            clusters[now].placed += 1;
                        } else {
                            clusters[now].found += 1;
                        }
                    }
                    last = Some(now);
                }
            }
        }
        clusters
    }

    /// Returns the states that hold in a snapshot. The clusters `states` are taken as the states.
    pub fn world_state(&self, demo: usize, snapshot: usize, states: &[usize]) -> WorldState {
        let held: BTreeSet<usize> =
            (0..self.tracks[demo].len()).filter_map(|t| self.label(demo, t, snapshot)).collect();
        states.iter().map(|s| held.contains(s)).collect()
    }

    pub fn poses<'a>(&'a self, cluster: &'a Cluster) -> impl Iterator<Item = &'a Pose> {
        cluster
            .members
            .iter()
            .filter_map(|(d, t, s)| self.tracks[*d][*t].pose(&self.recording.demos[*d], *s))
    }

    /// Number of distinct poses of a cluster: consecutive poses of a part that did not move count once.
    pub fn distinct(&self, cluster: &Cluster) -> usize {
        let mut last: Option<((usize, usize), &Pose)> = None;
        let mut count = 0;
        for ((d, t, _), pose) in cluster.members.iter().zip(self.poses(cluster)) {
            let same =
                last.is_some_and(|(whose, was)| whose == (*d, *t) && was.distance(pose) < MOVED_M);
            count += usize::from(!same);
            last = Some(((*d, *t), pose));
        }
        count
    }
}
