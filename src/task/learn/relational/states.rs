//! Finds the states: clusters of rests in frames, joined into states with several places.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::cluster::{Clustering, FramePrior, Item};
use super::likelihood::{Likelihood, Sums, about, overall};
use super::motion::{Came, Motion, Rest};
use crate::task::domain::{MIN_DISTINCT, Origin, Pose, mean_orientation};
use crate::task::learn::gaussian::robust_mean;
use crate::task::learn::names::{Landmark, Names, state_name, symbol};
use crate::task::relational::{
    Coordinate, Frame, FrameState, Place, ROOMY_M, Turn, relative,
};

/// The state of a rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Label {
    pub state: usize,
    pub place: usize,
    /// Track of the reference, in the rest's demonstration.
    pub reference: Option<usize>,
}

/// Rests of one kind in no state.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Unexplained {
    pub kind: String,
    pub rests: Vec<usize>,
}

/// The states, and the state of every rest.
pub(super) struct States {
    pub states: Vec<FrameState>,
    /// For each rest, its state; `None` for fixtures and for unexplained rests.
    pub labels: Vec<Option<Label>>,
    pub unexplained: Vec<Unexplained>,
    /// Kinds that never moved.
    pub fixed: Vec<String>,
    pub names: Names,
}

/// Scale of careful placing, in metres and radians, without sensing noise.
const PLACED_M: f64 = 2e-4;
const PLACED_RAD: f64 = 0.02;
/// Smallest size of the scene in a coordinate, in metres.
const SMALLEST_M: f64 = 0.05;
/// Log priors of the frames: of the world, of kinds that never move and of kinds that move. What moves is a likely
/// reference if it is near, and an unlikely one if it is far.
const WORLD_PRIOR: FramePrior = FramePrior { base: -3.0, slope: 0.0, crowd: 0.0 };
const FIXED_PRIOR: FramePrior = FramePrior { base: -1.0, slope: 2.0, crowd: 0.0 };
const MOVING_PRIOR: FramePrior = FramePrior { base: 2.0, slope: 4.0, crowd: 3.0 };
/// Loss of likelihood that the places of one state may have in a common frame, for each place.
const COMMON: f64 = 8.0;
/// Distance below which an attempt left its object in place, in metres.
const IN_PLACE_M: f64 = 5e-3;
/// Share of a kind's attempts that may end in the cluster in which they began before orientation counts.
const UNEXPLAINED: f64 = 0.3;
/// Greatest distance of two poses of one place, in metres and in standard deviations of careful placing.
const PLACE_M: f64 = 2e-3;
const PLACE_SD: f64 = 6.0;
/// Share of the usual distance of an attempt below which an object was only nudged.
const NUDGED: f64 = 0.1;
/// Evidence for several places in a broad cluster, in nats.
const PLACES: f64 = 6.0;
/// Standard deviation above which an orientation is free, in radians.
const WILD_RAD: f64 = 0.35;
/// Share of the demonstrations in which a state has to occur.
const SUPPORT: f64 = 0.1;

/// Returns the number of demonstrations in which a state or an action has to occur.
pub(super) fn least_support(demos: usize) -> usize {
    if demos < 3 { 1 } else { (SUPPORT * demos as f64).ceil().max(2.0) as usize }
}

/// A cluster of one kind.
struct Group {
    rests: Vec<usize>,
    frame: usize,
    /// Posterior in each frame.
    scores: Vec<f64>,
}

/// Returns the frame in which these groups can be places of one state: the frame with the greatest posterior, if each
/// place loses little by it.
fn common_frame(groups: &[Group], all: &[usize]) -> Option<usize> {
    let frames = groups.first()?.scores.len();
    let total = |f: usize| all.iter().map(|g| groups[*g].scores[f]).sum::<f64>();
    let best = (0..frames).max_by(|a, b| total(*a).total_cmp(&total(*b)).then(b.cmp(a)))?;
    let own: f64 = all.iter().map(|g| groups[*g].scores[groups[*g].frame]).sum();
    (total(best) >= own - COMMON * all.len() as f64).then_some(best)
}

struct Search<'m, 'r> {
    motion: &'m Motion<'r>,
    kinds: Vec<Arc<str>>,
    /// Whether an attempt or anything else ever moved an object of the kind.
    moves: Vec<bool>,
    /// For each rest of an object that its container carried here, the rest before.
    carried_from: BTreeMap<usize, usize>,
    /// The inverse of `carried_from`.
    carried_to: BTreeMap<usize, usize>,
    extent: [f64; 3],
}

pub(super) fn find(motion: &Motion<'_>) -> States {
    let search = Search::new(motion);
    let mut labels = vec![None; motion.rests.len()];
    let mut out = States {
        states: Vec::new(),
        labels: Vec::new(),
        unexplained: Vec::new(),
        fixed: Vec::new(),
        names: Names::default(),
    };
    let landmarks = search.landmarks();
    for kind in 0..search.kinds.len() {
        if !search.moves[kind] {
            out.fixed.push(search.kinds[kind].to_string());
            continue;
        }
        let (groups, turns) = search.groups(kind);
        let mut lost = Vec::new();
        if std::env::var("DBG").is_ok() { for g in &groups { eprintln!("{} frame {} n{} {:?}", search.kinds[kind], g.frame, g.rests.len(), g.rests.iter().map(|r| { let r = &motion.rests[*r]; (r.demo, r.track, r.came, search.pose(g.rests[0], g.frame).map(|_| search.pose(motion.rests.iter().position(|x| x == r).unwrap_or(0), g.frame).map(|p| p.position.map(|v| (v * 1000.0).round())))) }).collect::<Vec<_>>()); } }
        let groups = search.without_nudges(kind, groups);
        for places in search.together(groups) {
            let all: Vec<usize> = places.iter().flat_map(|g| g.rests.clone()).collect();
            if !search.supported(&all) || search.is_everywhere(&places) {
                lost.extend(all);
                continue;
            }
            let state = out.states.len();
            let frame = places[0].frame;
            for (place, group) in places.iter().enumerate() {
                for rest in &group.rests {
                    let reference = search.reference(*rest, frame).map(|(track, _)| track);
                    labels[*rest] = Some(Label { state, place, reference });
                }
            }
            out.states.push(search.model((kind, turns), &places, &landmarks, &mut out.names));
        }
        if !lost.is_empty() {
            lost.sort_unstable();
            out.unexplained.push(Unexplained { kind: search.kinds[kind].to_string(), rests: lost });
        }
    }
    for (now, before) in &search.carried_from {
        labels[*now] = labels[*before];
    }
    out.labels = labels;
    out
}

impl<'m, 'r> Search<'m, 'r> {
    fn new(motion: &'m Motion<'r>) -> Self {
        let mut names: BTreeMap<Arc<str>, BTreeSet<usize>> = BTreeMap::new();
        let mut handled: BTreeSet<Arc<str>> = BTreeSet::new();
        for (d, tracks) in motion.tracks.iter().enumerate() {
            for track in tracks {
                names.entry(track.kind.clone()).or_default();
                let _ = d;
            }
        }
        for rest in &motion.rests {
            let kind = motion.tracks[rest.demo][rest.track].kind.clone();
            match rest.came {
                Came::Found => {}
                Came::Placed(_) => {
                    handled.insert(kind);
                }
                Came::Carried => {
                    names.entry(kind).or_default().insert(rest.demo);
                }
            }
        }
        let demos = motion.recording.demos.len();
        // Something that moved by itself in a single demonstration was knocked.
        let often = (demos / 2).max(2).min(demos);
        let kinds: Vec<Arc<str>> = names.keys().cloned().collect();
        let moves = names.iter().map(|(k, by)| handled.contains(k) || by.len() >= often).collect();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for rest in &motion.rests {
            for i in 0..3 {
                low[i] = low[i].min(rest.pose.position[i]);
                high[i] = high[i].max(rest.pose.position[i]);
            }
        }
        let extent = std::array::from_fn(|i| (1.1 * (high[i] - low[i])).max(SMALLEST_M));
        let mut search = Self {
            motion,
            kinds,
            moves,
            extent,
            carried_from: BTreeMap::new(),
            carried_to: BTreeMap::new(),
        };
        search.follow_containers();
        search
    }

    /// Finds the rests of objects that lie as before in the frame of some other object, which carried them.
    fn follow_containers(&mut self) {
        for (now, rest) in self.motion.rests.iter().enumerate() {
            if rest.came != Came::Carried {
                continue;
            }
            let before = (0..rest.first)
                .rev()
                .find_map(|s| self.motion.index_at(rest.demo, rest.track, s));
            let Some(before) = before else { continue };
            if (1..=self.kinds.len()).any(|f| self.lies_alike(before, now, f)) {
                self.carried_from.insert(now, before);
                self.carried_to.insert(before, now);
            }
        }
    }

    /// Returns the rest in which an object came into its container.
    fn origin(&self, rest: usize) -> usize {
        let mut rest = rest;
        while let Some(before) = self.carried_from.get(&rest) {
            rest = *before;
        }
        rest
    }

    /// Returns whether two rests of one object agree in a frame, with the same reference.
    fn lies_alike(&self, before: usize, now: usize, frame: usize) -> bool {
        let same = |rest: usize| self.reference(rest, frame).map(|(track, _)| track);
        let (Some(a), Some(b)) = (self.pose(before, frame), self.pose(now, frame)) else {
            return false;
        };
        let turn = a.rotation().angle_to(&b.rotation());
        same(before) == same(now)
            && a.distance(&b) <= self.motion.least.0
            && turn <= self.motion.least.1
    }

    /// Returns the first rest of another object during a rest. A container that carried the object comes to rest a
    /// little later.
    fn rest_during(&self, rest: usize, track: usize) -> Option<usize> {
        let own = &self.motion.rests[rest];
        (own.first..=own.last).find_map(|s| self.motion.index_at(own.demo, track, s))
    }

    /// Returns the nearest object of the frame's kind when a rest began, and the number of objects to choose from.
    fn reference(&self, rest: usize, frame: usize) -> Option<(usize, usize)> {
        let kind = self.kinds.get(frame.checked_sub(1)?)?;
        let own = &self.motion.rests[rest];
        let mut nearest: Option<(f64, usize)> = None;
        let mut choices = [0, 0];
        let handled = |rest: &Rest| usize::from(matches!(rest.came, Came::Placed(_)));
        for (t, track) in self.motion.tracks[own.demo].iter().enumerate() {
            if track.kind != *kind || t == own.track {
                continue;
            }
            let Some(there) = self.rest_during(rest, t) else { continue };
            let there = &self.motion.rests[there];
            choices[handled(there)] += 1;
            let far = there.pose.distance(&own.pose);
            if nearest.is_none_or(|(least, _)| far < least) {
                nearest = Some((far, t));
            }
        }
        // What was put somewhere is not mistaken for what lies about.
        let (_, track) = nearest?;
        let there = &self.motion.rests[self.rest_during(rest, track)?];
        Some((track, choices[handled(there)]))
    }

    /// Returns the pose of a rest in a frame; `None` without a reference.
    fn pose(&self, rest: usize, frame: usize) -> Option<Pose> {
        let own = &self.motion.rests[rest];
        if frame == 0 {
            return Some(own.pose);
        }
        let (track, _) = self.reference(rest, frame)?;
        let there = &self.motion.rests[self.rest_during(rest, track)?];
        Some(relative(&there.pose, &own.pose))
    }

    /// Returns whether another object that moves is clearly nearer to a rest than `far`.
    fn is_crowded(&self, rest: usize, far: f64) -> bool {
        let own = &self.motion.rests[rest];
        let tracks = self.motion.tracks[own.demo].iter().enumerate();
        tracks.filter(|(t, _)| *t != own.track).any(|(t, track)| {
            let moves = self.kinds.iter().zip(&self.moves).any(|(k, m)| *k == track.kind && *m);
            moves
                && self.rest_during(rest, t).is_some_and(|r| {
                    self.motion.rests[r].pose.distance(&own.pose) < 0.8 * far
                })
        })
    }

    /// Returns the size of the scene along the axes of a frame: the mean width of the scene's box along the axes of the
    /// references, which may be turned.
    fn extent_in(&self, frame: usize) -> [f64; 3] {
        let Some(kind) = frame.checked_sub(1).and_then(|k| self.kinds.get(k)) else {
            return self.extent;
        };
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for rest in self.motion.rests.iter().filter(|r| self.motion.kind(r) == &**kind) {
            let turn = rest.pose.rotation().to_rotation_matrix();
            count += 1.0;
            for (i, width) in sum.iter_mut().enumerate() {
                *width += (0..3).map(|j| turn[(j, i)].abs() * self.extent[j]).sum::<f64>();
            }
        }
        if count > 0.0 { sum.map(|w| w / count) } else { self.extent }
    }

    fn sums(&self, rest: usize, frame: usize) -> Option<Sums> {
        let own = &self.motion.rests[rest];
        let mut choices = 1;
        let (mut far, mut crowded) = (0.0, 0.0);
        if frame > 0 {
            let (track, of) = self.reference(rest, frame)?;
            choices = of;
            // A frame is refused if its object leaves while the rest lasts.
            let begin = self.rest_during(rest, track)?;
            far = self.motion.rests[begin].pose.distance(&own.pose);
            crowded = f64::from(self.is_crowded(rest, far));
            let end = self.motion.index_at(own.demo, track, own.last);
            if end.is_some_and(|end| end != begin) {
                return None;
            }
        }
        // Nor is a frame kept that its container left behind.
        if let Some(next) = self.carried_to.get(&rest)
            && !self.lies_alike(rest, *next, frame)
        {
            return None;
        }
        let pose = self.pose(rest, frame)?;
        let turn = pose.rotation().to_rotation_matrix();
        Some(Sums {
            sum: pose.position,
            square: pose.position.map(|v| v * v),
            turn: *turn.matrix(),
            choices: (choices as f64).ln(),
            far,
            crowded,
        })
    }

    /// Clusters the rests of a kind.
    fn groups(&self, kind: usize) -> (Vec<Group>, bool) {
        let rests: Vec<usize> = (0..self.motion.rests.len())
            .filter(|r| self.motion.kind(&self.motion.rests[*r]) == &*self.kinds[kind])
            .filter(|r| !self.carried_from.contains_key(r))
            .collect();
        let frames = self.kinds.len() + 1;
        let items: Vec<Item> = rests
            .iter()
            .map(|r| Item { frames: (0..frames).map(|f| self.sums(*r, f)).collect() })
            .collect();
        let priors: Vec<FramePrior> = (0..frames)
            .map(|f| match f.checked_sub(1) {
                None => WORLD_PRIOR,
                Some(kind) if self.moves[kind] => MOVING_PRIOR,
                Some(_) => FIXED_PRIOR,
            })
            .collect();
        let extents: Vec<[f64; 3]> = (0..frames).map(|f| self.extent_in(f)).collect();
        let place: BTreeMap<usize, usize> = rests.iter().copied().zip(0..).collect();
        let attempts: Vec<(usize, usize)> = (self.motion.attempts.iter())
            .filter_map(|a| {
                let track = a.track?;
                let before = self.origin(self.motion.index_at(a.demo, track, a.before)?);
                let after = self.origin(self.motion.index_at(a.demo, track, a.after)?);
                Some((*place.get(&before)?, *place.get(&after)?))
            })
            .filter(|(before, after)| before != after)
            .collect();
        let noise = self.motion.noise;
        let mut likelihood = Likelihood::new(
            PLACED_M.hypot(noise.position_m),
            PLACED_RAD.hypot(noise.angle_rad),
            items.len(),
        );
        let run = |likelihood: &Likelihood| {
            let clustering = Clustering {
                items: &items,
                priors: &priors,
                extents: &extents,
                attempts: &attempts,
                likelihood,
            };
            let clusters = clustering.run().into_iter();
            let scored = clusters.map(|c| (clustering.scores(c.members.len(), &c.frames), c));
            scored.collect::<Vec<_>>()
        };
        // Orientation counts if attempts only turned their object, or if positions leave attempts unexplained.
        let still = attempts.iter().filter(|(a, b)| {
            let pose = |i: usize| self.motion.rests[rests[i]].pose;
            pose(*a).distance(&pose(*b)) <= self.motion.least.0.max(IN_PLACE_M)
        });
        likelihood.turns = still.count() as f64 > UNEXPLAINED * attempts.len() as f64;
        let mut clusters = run(&likelihood);
        if !likelihood.turns {
            let owner = |item: usize| clusters.iter().position(|(_, c)| c.members.contains(&item));
            let same = attempts.iter().filter(|(a, b)| owner(*a) == owner(*b)).count();
            if same as f64 > UNEXPLAINED * attempts.len() as f64 {
                likelihood.turns = true;
                clusters = run(&likelihood);
            }
        }
        let groups = clusters.into_iter().map(|(scores, c)| Group {
            rests: c.members.iter().map(|m| rests[*m]).collect(),
            frame: c.frame,
            scores,
        });
        let split = groups.flat_map(|g| self.split(g, likelihood.scale_m)).collect();
        (split, likelihood.turns)
    }

    /// Joins clusters between which objects were only nudged: moved by no attempt, and much less than attempts move them.
    fn without_nudges(&self, kind: usize, mut groups: Vec<Group>) -> Vec<Group> {
        let mut moved: Vec<f64> = (self.motion.attempts.iter())
            .filter_map(|a| {
                let track = a.track?;
                let own = &self.motion.tracks[a.demo][track].kind == &self.kinds[kind];
                let before = self.motion.rest_at(a.demo, track, a.before)?;
                let after = self.motion.rest_at(a.demo, track, a.after)?;
                own.then(|| before.pose.distance(&after.pose))
            })
            .collect();
        moved.sort_by(f64::total_cmp);
        let Some(usual) = moved.get(moved.len() / 2).copied() else { return groups };
        let mut a = 0;
        while a < groups.len() {
            let nudged = groups[a].rests.iter().find_map(|now| {
                let rest = &self.motion.rests[*now];
                let before = (0..rest.first)
                    .rev()
                    .find_map(|s| self.motion.index_at(rest.demo, rest.track, s))?;
                let far = self.motion.rests[before].pose.distance(&rest.pose);
                let near = rest.came == Came::Carried && far < NUDGED * usual;
                let b = groups.iter().position(|g| g.rests.contains(&before))?;
                (near && a != b).then_some(b)
            });
            match nudged.and_then(|b| Some((b, common_frame(&groups, &[a, b])?))) {
                Some((b, frame)) => {
                    let taken = groups[a].rests.clone();
                    let other = groups[a].scores.clone();
                    groups[b].rests.extend(taken);
                    groups[b].scores.iter_mut().zip(other).for_each(|(x, y)| *x += y);
                    groups[b].frame = frame;
                    groups.remove(a);
                    a = 0;
                }
                None => a += 1,
            }
        }
        groups
    }

    /// Splits a cluster that is broad because it consists of several tight places.
    fn split(&self, group: Group, scale_m: f64) -> Vec<Group> {
        let poses: Vec<Option<Pose>> =
            group.rests.iter().map(|r| self.pose(*r, group.frame)).collect();
        let Some(poses) = poses.into_iter().collect::<Option<Vec<Pose>>>() else {
            return vec![group];
        };
        let range = (0..3)
            .map(|i| {
                let values = poses.iter().map(|p| p.position[i]);
                let low = values.clone().fold(f64::INFINITY, f64::min);
                values.fold(f64::NEG_INFINITY, f64::max) - low
            })
            .fold(0.0, f64::max);
        let width = PLACE_M.max(PLACE_SD * scale_m);
        if range < 3.0 * width {
            return vec![group];
        }
        // Single linkage.
        let mut owner: Vec<usize> = (0..poses.len()).collect();
        for a in 0..poses.len() {
            for b in 0..a {
                if poses[a].distance(&poses[b]) < width && owner[a] != owner[b] {
                    let (keep, drop) = (owner[a].min(owner[b]), owner[a].max(owner[b]));
                    owner.iter_mut().filter(|o| **o == drop).for_each(|o| *o = keep);
                }
            }
        }
        let places: BTreeSet<usize> = owner.iter().copied().collect();
        // Each coincidence beyond the first pose of a place has a chance of about the width over the range.
        let coincidences = (poses.len() - places.len()) as f64 * (range / (2.0 * width)).ln();
        let wide = places.iter().any(|p| {
            let own: Vec<&Pose> =
                poses.iter().zip(&owner).filter(|(_, o)| *o == p).map(|(pose, _)| pose).collect();
            own.iter().any(|a| own.iter().any(|b| a.distance(b) > 3.0 * width))
        });
        let sparse = 2 * places.len() > poses.len();
        if places.len() < 2 || sparse || wide || coincidences < PLACES {
            return vec![group];
        }
        places
            .iter()
            .map(|p| Group {
                rests: group
                    .rests
                    .iter()
                    .zip(&owner)
                    .filter(|(_, o)| *o == p)
                    .map(|(r, _)| *r)
                    .collect(),
                frame: group.frame,
                scores: group.scores.clone(),
            })
            .collect()
    }

    /// Joins clusters into states with several places: clusters in one frame that are entered from the same clusters
    /// and left for the same clusters. Broad clusters that lie together become one place.
    fn together(&self, groups: Vec<Group>) -> Vec<Vec<Group>> {
        let n = groups.len();
        let mut owner: BTreeMap<usize, usize> = BTreeMap::new();
        for (g, group) in groups.iter().enumerate() {
            for r in &group.rests {
                let mut rest = Some(*r);
                while let Some(r) = rest {
                    owner.insert(r, g);
                    rest = self.carried_to.get(&r).copied();
                }
            }
        }
        let mut moves: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for attempt in &self.motion.attempts {
            let ends = attempt.track.and_then(|t| {
                let before = self.motion.index_at(attempt.demo, t, attempt.before)?;
                let after = self.motion.index_at(attempt.demo, t, attempt.after)?;
                Some((*owner.get(&before)?, *owner.get(&after)?))
            });
            if let Some(ends) = ends {
                *moves.entry(ends).or_default() += 1;
            }
        }
        let found: Vec<bool> = groups
            .iter()
            .map(|g| {
                let found = g.rests.iter().filter(|r| self.motion.rests[**r].came == Came::Found);
                2 * found.count() > g.rests.len()
            })
            .collect();
        let mut state: Vec<usize> = (0..n).collect();
        loop {
            let mut merged = false;
            for a in 0..n {
                for b in a + 1..n {
                    if state[a] == state[b] || found[a] != found[b] {
                        continue;
                    }
                    let ends = |x: usize, forwards: bool| -> BTreeSet<usize> {
                        moves
                            .keys()
                            .map(|(f, t)| if forwards { (*f, *t) } else { (*t, *f) })
                            .filter(|(f, _)| state[*f] == state[x])
                            .map(|(_, t)| state[t])
                            .filter(|t| *t != state[x])
                            .collect()
                    };
                    let linked = moves.keys().any(|(f, t)| {
                        (state[*f], state[*t]) == (state[a], state[b])
                            || (state[*f], state[*t]) == (state[b], state[a])
                    });
                    let sources = ends(a, false);
                    let alike = sources == ends(b, false) && ends(a, true) == ends(b, true);
                    let reached = found[a] || !sources.is_empty();
                    let all: Vec<usize> =
                        (0..n).filter(|g| [state[a], state[b]].contains(&state[*g])).collect();
                    if alike && reached && !linked && common_frame(&groups, &all).is_some() {
                        let (keep, drop) = (state[a].min(state[b]), state[a].max(state[b]));
                        state.iter_mut().filter(|s| **s == drop).for_each(|s| *s = keep);
                        merged = true;
                    }
                }
            }
            if !merged {
                break;
            }
        }
        let mut out: BTreeMap<usize, Vec<Group>> = BTreeMap::new();
        let frames: Vec<Option<usize>> = (0..n)
            .map(|g| {
                let all: Vec<usize> = (0..n).filter(|h| state[*h] == state[g]).collect();
                common_frame(&groups, &all)
            })
            .collect();
        for ((mut group, state), frame) in groups.into_iter().zip(state).zip(frames) {
            group.frame = frame.unwrap_or(group.frame);
            out.entry(state).or_default().push(group);
        }
        out.into_values().map(|groups| self.join_overlapping(groups)).collect()
    }

    /// Makes one place of clusters that overlap.
    fn join_overlapping(&self, mut groups: Vec<Group>) -> Vec<Group> {
        let range = |group: &Group| -> [(f64, f64); 3] {
            std::array::from_fn(|i| {
                let values: Vec<f64> = (group.rests.iter())
                    .filter_map(|r| Some(self.pose(*r, group.frame)?.position[i]))
                    .collect();
                let n = values.len().max(1) as f64;
                let mean = values.iter().sum::<f64>() / n;
                let sd = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
                let reach = 2.0 * sd + 2.0 * PLACED_M + 3.0 * self.motion.noise.position_m;
                (mean - reach, mean + reach)
            })
        };
        let mut a = 0;
        while a < groups.len() {
            let mut b = a + 1;
            while b < groups.len() {
                let (x, y) = (range(&groups[a]), range(&groups[b]));
                if (0..3).all(|i| x[i].0 <= y[i].1 && y[i].0 <= x[i].1) {
                    let taken = groups.remove(b);
                    groups[a].rests.extend(taken.rests);
                    b = a + 1;
                } else {
                    b += 1;
                }
            }
            a += 1;
        }
        groups
    }

    /// Returns whether a state occurs in enough demonstrations.
    fn supported(&self, rests: &[usize]) -> bool {
        let demos: BTreeSet<usize> = rests.iter().map(|r| self.motion.rests[*r].demo).collect();
        demos.len() >= least_support(self.motion.recording.demos.len())
    }

    /// Returns whether poses are scattered over the whole scene, heights included. Such poses are outliers.
    fn is_everywhere(&self, groups: &[Group]) -> bool {
        groups.iter().all(|g| {
            g.frame == 0
                && (0..3).all(|i| {
                    let values: Vec<f64> =
                        g.rests.iter().map(|r| self.motion.rests[*r].pose.position[i]).collect();
                    let n = values.len() as f64;
                    let mean = values.iter().sum::<f64>() / n;
                    let sd = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
                    // A uniform distribution has a standard deviation of 0.29 of its range.
                    self.extent[i] > SMALLEST_M && sd > 0.17 * self.extent[i]
                })
        })
    }

    /// Returns the objects of the first snapshot whose kind never moved.
    fn landmarks(&self) -> Vec<Landmark> {
        let first = self.motion.recording.demos.iter().flat_map(|d| d.snapshots.first()).next();
        let fixed = |kind: &str| {
            self.kinds.iter().zip(&self.moves).any(|(k, moves)| **k == *kind && !moves)
        };
        let objects = first.into_iter().flat_map(|s| &s.objects);
        objects
            .filter(|o| fixed(&o.kind))
            .map(|o| Landmark { kind: o.kind.to_string(), pose: o.pose })
            .collect()
    }

    /// Fits the model of a state.
    fn model(
        &self,
        (kind, turn_matters): (usize, bool),
        groups: &[Group],
        landmarks: &[Landmark],
        names: &mut Names,
    ) -> FrameState {
        let frame = groups[0].frame;
        let rests: Vec<usize> = groups.iter().flat_map(|g| g.rests.clone()).collect();
        let count = rests.len();
        let found = rests.iter().filter(|r| self.motion.rests[**r].came == Came::Found).count();
        let origin = if 2 * found > count { Origin::Found } else { Origin::Placed };
        let likelihood = Likelihood::new(
            PLACED_M.hypot(self.motion.noise.position_m),
            PLACED_RAD.hypot(self.motion.noise.angle_rad),
            count,
        );
        let poses: Vec<Vec<Pose>> = groups
            .iter()
            .map(|g| g.rests.iter().filter_map(|r| self.pose(*r, frame)).collect())
            .collect();
        let turn = turn(&poses, &likelihood);
        let places: Vec<Place> =
            poses.iter().map(|p| self.place(p, &turn, frame, &likelihood)).collect();
        let frame = match frame.checked_sub(1) {
            None => Frame::World,
            Some(k) => Frame::Kind(self.kinds[k].to_string()),
        };
        let own = &self.kinds[kind];
        let wanted = match &frame {
            Frame::World => state_name(own, origin, &places[0].pose(), landmarks),
            Frame::Kind(k) => format!("{}_AT_{}", symbol(own), symbol(k)),
        };
        let named_world = frame == Frame::World;
        FrameState {
            name: names.take(&wanted),
            kind: own.to_string(),
            frame,
            turn,
            turn_matters,
            origin,
            count,
            // Two or three found objects can agree in a coordinate by chance.
            any_coordinate: origin == Origin::Found
                && named_world
                && count < MIN_DISTINCT
                && places.len() == 1,
            places,
        }
    }

    fn place(&self, poses: &[Pose], turn: &Turn, frame: usize, likelihood: &Likelihood) -> Place {
        let n = poses.len();
        let extent = self.extent_in(frame);
        let coordinates = std::array::from_fn(|i| {
            let mut values: Vec<f64> = poses.iter().map(|p| p.position[i]).collect();
            let (sum, square) = values.iter().fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
            let (tight, open) = likelihood.coordinate(n, sum, square, extent[i]);
            // Of many poses, a fiftieth at each end may belong elsewhere.
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            let (low, high) = (sorted[n / 50], sorted[n - 1 - n / 50]);
            if tight >= open {
                let mean = robust_mean(&mut values);
                let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
                let sd = (squares / n.saturating_sub(1).max(1) as f64).sqrt();
                if sd > ROOMY_M { Coordinate::Open { low, high } } else { Coordinate::Tight { mean, sd } }
            } else {
                Coordinate::Open { low, high }
            }
        });
        Place { coordinates, orientation: central(poses, turn), count: n }
    }
}

/// Chooses how a state constrains the orientation.
fn turn(places: &[Vec<Pose>], likelihood: &Likelihood) -> Turn {
    let mut logs = [0.0; 3];
    let (mut by_axis, mut all, mut free) = ([0.0; 3], 0.0, 0.0);
    for poses in places {
        let sum: Matrix3<f64> =
            poses.iter().map(|p| *p.rotation().to_rotation_matrix().matrix()).sum();
        let n = poses.len();
        logs.iter_mut().zip(likelihood.turn(n, &sum)).for_each(|(a, b)| *a += b);
        by_axis.iter_mut().zip(about(n, &sum)).for_each(|(a, b)| *a += b);
        all += overall(n, &sum);
        free += n.saturating_sub(1) as f64;
    }
    let sd = |squares: f64, dof: f64| (squares.max(0.0) / (dof * f64::max(free, 1.0))).sqrt();
    if free == 0.0 || logs[0] >= logs[1].max(logs[2]) {
        return Turn::Free;
    }
    if logs[2] >= logs[1] && sd(all, 3.0) < WILD_RAD {
        return Turn::Full { sd: sd(all, 3.0) };
    }
    let best = (0..3).min_by(|a, b| by_axis[*a].total_cmp(&by_axis[*b])).unwrap_or(2);
    let spread = sd(by_axis[best], 2.0);
    if spread >= WILD_RAD {
        return Turn::Free;
    }
    let mut axis = [0.0; 3];
    axis[best] = 1.0;
    Turn::Axis { axis, sd: spread }
}

/// Returns the orientation of a place: the mean if it is fully constrained, else that of the most central pose.
fn central(poses: &[Pose], turn: &Turn) -> [f64; 4] {
    let all: Vec<[f64; 4]> = poses.iter().map(|p| p.orientation).collect();
    let mean = mean_orientation(&all).unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let off = |p: &Pose| match turn {
        Turn::Axis { axis, .. } => {
            let axis = Vector3::from(*axis);
            let sum: Vector3<f64> = poses.iter().map(|q| q.rotation() * axis).sum();
            (p.rotation() * axis).angle(&sum)
        }
        _ => {
            let dot: f64 = p.orientation.iter().zip(mean).map(|(a, b)| a * b).sum();
            1.0 - dot.abs()
        }
    };
    let middle = poses.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    match turn {
        Turn::Full { .. } => mean,
        _ => middle.map_or(mean, |p| p.orientation),
    }
}
