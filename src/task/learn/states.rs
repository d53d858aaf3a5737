//! From tracks and tries to states and operators.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use super::gaussian::PoseGaussian;
use super::linkage::Dendrogram;
use super::names::{Landmark, Names, action_name, state_name};
use super::operators::{Evidence, GlobalState, Instance};
use super::threshold::{Manipulation, choose};
use super::tracks::{Track, follow};
use super::tries::{MOVED_M, Try, cut, guess, still_falling};
use super::{Learned, Settings};
use crate::task::domain::{Domain, KindClusters, Operator, Origin, Provenance, State};
use crate::task::error::TaskError;
use crate::task::pose::Pose;
use crate::task::recording::Recording;

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

/// The recording with identities.
struct Scene<'r> {
    recording: &'r Recording,
    tracks: Vec<Vec<Track>>,
    tries: Vec<Try>,
    kinds: Vec<Kind>,
}

/// One kind of object that moves.
struct Kind {
    name: Arc<str>,
    /// (demo, track, snapshot) of every pose that is clustered.
    poses: Vec<(usize, usize, usize)>,
    /// The way back.
    places: HashMap<(usize, usize, usize), usize>,
    tree: Dendrogram,
    /// The cut, and the cluster of each pose; clusters of all kinds are numbered together.
    threshold: f64,
    labels: Vec<usize>,
}

/// A cluster of poses, perhaps a state.
struct Cluster {
    kind: usize,
    members: Vec<(usize, usize, usize)>,
    /// How often a part came into it by a try, and how often otherwise.
    placed: usize,
    found: usize,
}

/// What the parts' ways from cluster to cluster tell.
#[derive(Default)]
struct Ways {
    /// Clusters into which parts came by tries only, that none kept, and around which others went
    /// straight at least as often: the bolt left standing, the nut on the jig's rim.
    detours: BTreeSet<usize>,
    /// Tries that brought a part back to where it had been before, from where it went again.
    undone: BTreeSet<usize>,
}

pub(super) fn learn(recording: &Recording, settings: &Settings) -> Result<Learned, TaskError> {
    let nothing = |reason: &str| TaskError::NothingToLearn { reason: reason.into() };
    if recording.demos.iter().all(|d| d.snapshots.len() < 2) {
        return Err(nothing("no demonstration has two snapshots or more"));
    }
    let mut scene = observe(recording, settings)?;
    if scene.kinds.is_empty() {
        return Err(nothing("no object moved by more than a millimetre"));
    }
    if scene.tries.is_empty() {
        return Err(nothing("no object was taken up and let go"));
    }
    // Guessing the manipulated objects and clustering depend on each other: go round until nothing
    // changes. Five rounds are more than any recording has needed.
    for _ in 0..5 {
        scene.cluster(settings);
        if !scene.reconsider() {
            break;
        }
    }
    scene.conclude(settings)
}

/// Follows all objects, cuts tries, guesses who was manipulated, and builds the dendrograms.
fn observe<'r>(recording: &'r Recording, settings: &Settings) -> Result<Scene<'r>, TaskError> {
    let tracks: Vec<Vec<Track>> = recording.demos.iter().map(follow).collect();
    let mut tries = Vec::new();
    for (d, demo) in recording.demos.iter().enumerate() {
        for mut attempt in cut(d, demo, &tracks[d]) {
            if !attempt.declared {
                attempt.track = guess(demo, &tracks[d], &attempt, settings.p);
            }
            tries.push(attempt);
        }
    }
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
                    if !still_falling(demo, s, object) {
                        poses.push((d, t, s));
                        positions.push(demo.snapshots[s].objects[object].pose.position);
                    }
                }
            }
        }
        let tree = Dendrogram::new(&positions, settings.p, &name)?;
        let places = poses.iter().copied().zip(0..).collect();
        let labels = Vec::new();
        kinds.push(Kind { name, poses, places, tree, threshold: f64::INFINITY, labels });
    }
    Ok(Scene { recording, tracks, tries, kinds })
}

impl Scene<'_> {
    /// Cuts every kind's dendrogram.
    fn cluster(&mut self, settings: &Settings) {
        let mut first = 0;
        for k in 0..self.kinds.len() {
            let manipulations: Vec<Manipulation> = self
                .tries
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
                None => choose(&kind.tree, &manipulations).threshold,
            };
            kind.labels = kind.tree.cut(kind.threshold).iter().map(|l| l + first).collect();
            first += kind.labels.iter().max().map_or(0, |l| l + 1 - first);
        }
    }

    fn kind_of(&self, demo: usize, track: usize) -> Option<usize> {
        self.kinds.iter().position(|k| k.name == self.tracks[demo][track].kind)
    }

    /// The cluster of a track in a snapshot.
    fn label(&self, demo: usize, track: usize, snapshot: usize) -> Option<usize> {
        let kind = &self.kinds[self.kind_of(demo, track)?];
        kind.places.get(&(demo, track, snapshot)).map(|place| kind.labels[*place])
    }

    /// Looks again at guessed tries in which the guessed part stayed in its cluster: if just one
    /// other part came to be where none of its kind was, that one was manipulated and the first was
    /// knocked aside. Returns whether anything changed.
    fn reconsider(&mut self) -> bool {
        let mut changed = false;
        for index in 0..self.tries.len() {
            let attempt = self.tries[index];
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
                self.tries[index].track = Some(other);
                changed = true;
            }
        }
        changed
    }

    /// All clusters, with how parts came into them.
    fn clusters(&self) -> Vec<Cluster> {
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
            self.tries.iter().filter_map(|t| Some((t.demo, t.track?, t.after))).collect();
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

    /// Which of `states` hold in a snapshot.
    fn global_state(&self, demo: usize, snapshot: usize, states: &[usize]) -> GlobalState {
        let held: BTreeSet<usize> =
            (0..self.tracks[demo].len()).filter_map(|t| self.label(demo, t, snapshot)).collect();
        states.iter().map(|s| held.contains(s)).collect()
    }

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

    /// Follows the parts from cluster to cluster to find detours and tries that were undone.
    fn ways(&self, clusters: &[Cluster]) -> Ways {
        let mut ways = Ways::default();
        let mut direct: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        let mut through: BTreeMap<(usize, usize, usize), usize> = BTreeMap::new();
        let (mut passed, mut entered) = (BTreeSet::new(), BTreeSet::new());
        let mut manipulated: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        let mut kept: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        let mut returned: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        let mut back_for_good: Vec<(usize, usize)> = Vec::new();
        let mut by_track: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
        for (index, attempt) in self.tries.iter().enumerate() {
            if let Some(track) = attempt.track {
                by_track.entry((attempt.demo, track)).or_default().push(index);
            }
        }
        for ((demo, track), tries) in by_track {
            if let Some(kind) = self.kind_of(demo, track) {
                manipulated.entry(kind).or_default().insert(demo);
            }
            let ends = |index: usize| {
                let t = &self.tries[index];
                Some((self.label(demo, track, t.before)?, self.label(demo, track, t.after)?))
            };
            let moves: Vec<(usize, usize, usize)> = tries
                .iter()
                .filter_map(|index| ends(*index).map(|(from, to)| (*index, from, to)))
                .filter(|(_, from, to)| from != to)
                .collect();
            let final_label = self.recording.demos[demo]
                .snapshots
                .len()
                .checked_sub(1)
                .and_then(|s| self.label(demo, track, s));
            // The way so far, with loops taken out.
            let mut way: Vec<usize> = Vec::new();
            for (at, (index, from, to)) in moves.iter().copied().enumerate() {
                if way.last() != Some(&from) {
                    way.push(from);
                }
                *direct.entry((from, to)).or_default() += 1;
                let stays = at + 1 == moves.len() && final_label == Some(to);
                if stays {
                    kept.entry(to).or_default().insert(demo);
                }
                if let Some((_, next_from, next_to)) = moves.get(at + 1)
                    && *next_from == to
                    && !way.contains(next_to)
                {
                    *through.entry((from, to, *next_to)).or_default() += 1;
                }
                if let Some(earlier) = way.iter().position(|w| *w == to) {
                    way.truncate(earlier + 1);
                    if stays {
                        returned.entry(to).or_default().insert(demo);
                        back_for_good.push((index, to));
                    } else {
                        ways.undone.insert(index);
                    }
                } else {
                    way.push(to);
                }
                let goes_on = moves.get(at + 1).is_some_and(|(_, next_from, _)| *next_from == to);
                if goes_on {
                    passed.insert(to);
                }
                if goes_on || !stays {
                    entered.insert(to);
                }
            }
        }
        // What happens in fewer than half of the demonstrations is not what they are about.
        let seldom = |cluster: usize, demos: Option<&BTreeSet<usize>>| {
            let all = manipulated.get(&clusters[cluster].kind).map_or(0, BTreeSet::len);
            2 * demos.map_or(0, BTreeSet::len) < all
        };
        for (index, to) in back_for_good {
            if seldom(to, returned.get(&to)) {
                ways.undone.insert(index);
            }
        }
        ways.detours = entered
            .into_iter()
            .filter(|by| clusters[*by].found == 0 && seldom(*by, kept.get(by)))
            .filter(|by| passed.contains(by) || !kept.contains_key(by))
            .filter(|by| {
                through.iter().filter(|((_, b, _), _)| b == by).all(|((from, _, to), times)| {
                    direct.get(&(*from, *to)).is_some_and(|straight| straight >= times)
                })
            })
            .collect();
        ways
    }

    /// Decides which clusters are states, and builds the domain and the report.
    fn conclude(&self, settings: &Settings) -> Result<Learned, TaskError> {
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
        let report = self.report(&clusters, &states, &judged, &operators, &named);
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

    fn poses<'a>(&'a self, cluster: &'a Cluster) -> impl Iterator<Item = &'a Pose> {
        cluster
            .members
            .iter()
            .filter_map(|(d, t, s)| self.tracks[*d][*t].pose(&self.recording.demos[*d], *s))
    }

    /// How many poses of a cluster differ from the same part's pose before by more than a resting
    /// part moves.
    fn distinct(&self, cluster: &Cluster) -> usize {
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
        let mut names = Names::default();
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

    fn report(
        &self,
        clusters: &[Cluster],
        states: &[usize],
        judged: &[Result<usize, Failure>],
        operators: &[Operator],
        named: &[String],
    ) -> LearnReport {
        let number = |demo: usize, snapshot: usize| {
            let demo = &self.recording.demos[demo];
            (demo.number, demo.snapshots[snapshot].number)
        };
        let tries = self
            .tries
            .iter()
            .zip(judged)
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
