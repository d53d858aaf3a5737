//! Joins and splits clusters: states with several places, nudged objects and broad clusters that lie together.

use std::collections::{BTreeMap, BTreeSet};

use super::frames::Frames;
use super::likelihood::PLACED_M;
use super::linked::{linked, spans_more};
use super::motion::Came;
use crate::robot::Pose;

/// Loss of likelihood that the places of one state may have in a common frame, for each place.
const COMMON: f64 = 8.0;
/// Greatest distance of two poses of one place, in metres and in standard deviations of careful placing.
const PLACE_M: f64 = 2e-3;
const PLACE_SD: f64 = 6.0;
/// Share of the usual distance of an attempt below which an object was only nudged.
const NUDGED: f64 = 0.1;
/// Evidence for several places in a broad cluster, in nats.
const PLACES: f64 = 6.0;
/// Least log likelihood of a state's poses, relative to poses scattered over the scene.
const EVIDENCE: f64 = 8.0;
/// Number of demonstrations from which scattered poses can be told from a state.
const MANY: usize = 5;

/// A cluster of one kind.
pub(super) struct Group {
    pub rests: Vec<usize>,
    pub frame: usize,
    /// Posterior in each frame.
    pub scores: Vec<f64>,
    /// Log likelihood in the best frame, relative to poses scattered over the scene.
    pub evidence: f64,
}

/// Returns whether the poses of a state are as good as scattered over the scene. Such poses are outliers.
pub(super) fn is_scattered(places: &[Group], support: usize, demos: usize) -> bool {
    // A few poses say too little, and what occurs in nearly all demonstrations is no error.
    let common = 4 * support >= 3 * demos;
    demos >= MANY && !common && places.iter().map(|g| g.evidence).sum::<f64>() < EVIDENCE
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

impl Frames<'_, '_> {
    /// Joins clusters between which objects were only nudged: moved by no attempt, and much less than attempts move them.
    pub fn without_nudges(&self, kind: usize, mut groups: Vec<Group>) -> Vec<Group> {
        let mut moved: Vec<f64> = (self.motion.attempts.iter())
            .filter_map(|a| {
                let track = a.track?;
                let own = self.motion.tracks[a.demo][track].kind == self.kinds[kind];
                let before = self.motion.rest_at(a.demo, track, a.before)?;
                let after = self.motion.rest_at(a.demo, track, a.after)?;
                own.then(|| before.pose.distance(&after.pose))
            })
            .collect();
        moved.sort_by(f64::total_cmp);
        let Some(usual) = moved.get(moved.len() / 2).copied() else { return groups };
        let mut owner = vec![None; self.motion.rests.len()];
        for (index, group) in groups.iter().enumerate() {
            group.rests.iter().for_each(|rest| owner[*rest] = Some(index));
        }
        let mut a = 0;
        while a < groups.len() {
            let nudged = groups[a].rests.iter().find_map(|now| {
                let rest = &self.motion.rests[*now];
                let before = self.motion.previous(*now)?;
                let far = self.motion.rests[before].pose.distance(&rest.pose);
                // An attempt whose object the recording does not name may have been another object's.
                let unsure = match rest.came {
                    Came::Carried => true,
                    Came::Placed(attempt) => !self.motion.attempts[attempt].declared,
                    Came::Found => false,
                };
                let near = unsure && far < NUDGED * usual;
                owner[before].filter(|b| near && a != *b)
            });
            match nudged.and_then(|b| Some((b, common_frame(&groups, &[a, b])?))) {
                Some((b, frame)) => {
                    let taken = groups.remove(a);
                    let b = if b > a { b - 1 } else { b };
                    owner.iter_mut().flatten().filter(|o| **o > a).for_each(|o| *o -= 1);
                    taken.rests.iter().for_each(|rest| owner[*rest] = Some(b));
                    groups[b].rests.extend(taken.rests);
                    groups[b].scores.iter_mut().zip(taken.scores).for_each(|(x, y)| *x += y);
                    groups[b].frame = frame;
                    groups[b].evidence += taken.evidence;
                    a = 0;
                }
                None => a += 1,
            }
        }
        groups
    }

    /// Splits a cluster that is broad because it consists of several tight places.
    pub fn split(&self, group: Group, scale_m: f64) -> Vec<Group> {
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
        let owner = linked(&poses, width);
        let places: BTreeSet<usize> = owner.iter().copied().collect();
        // Each coincidence beyond the first pose of a place has a chance of about the width over the range.
        let coincidences = (poses.len() - places.len()) as f64 * (range / (2.0 * width)).ln();
        let sparse = 2 * places.len() > poses.len();
        if places.len() < 2 || sparse || coincidences < PLACES {
            return vec![group];
        }
        let mut members: BTreeMap<usize, Vec<Pose>> = BTreeMap::new();
        for (pose, owner) in poses.iter().zip(&owner) {
            members.entry(*owner).or_default().push(*pose);
        }
        if members.values().any(|own| spans_more(own, 3.0 * width)) {
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
                evidence: group.evidence,
            })
            .collect()
    }

    /// Joins clusters into states with several places: clusters in one frame that are entered from the same clusters
    /// and left for the same clusters. Broad clusters that lie together become one place.
    pub fn together(&self, groups: Vec<Group>) -> Vec<Vec<Group>> {
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
}
