//! Splits clusters into places, and joins nudged objects.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use statrs::function::gamma::ln_gamma;

use super::frames::Frames;
use super::likelihood::{Likelihood, Sums, log_add};
use super::motion::Came;

/// Loss of likelihood that each place of a state may have in a common frame: in that of one of them, and in another. What goes
/// onto a shelf or onto a stand goes to two places, not to two strips of the world.
const COMMON: (f64, f64) = (8.0, 3.0);
/// Smallest gap between two places, in metres and in standard deviations of careful placing.
pub(super) const PLACE_M: f64 = 2e-3;
pub(super) const PLACE_SD: f64 = 6.0;
/// Share of the usual distance of an attempt below which an object was only nudged.
pub(super) const NUDGED: f64 = 0.1;
/// Number of objects that come to a cluster by themselves, and their spread as a share of the way, from which and up to which it
/// was meant.
const MEANT: usize = 3;
const ONE_WAY: f64 = 0.25;
/// Greatest ratio of the squared distance of what is found in a heap from what it lies on to that of their heights.
const HEAPED: f64 = 1.1;
/// Evidence for several places in a broad cluster, in nats.
const PLACES: f64 = 1.0;
/// Evidence for tight places in which poses coincide, in nats.
const COINCIDENCES: f64 = 3.0;
/// Width of the uniform distribution as uncertain as a Gaussian, in standard deviations: the square root of 2 pi e.
const GAUSSIAN: f64 = 4.13;
/// Evidence against a cut whose sides are told by what their rests lie on: a kind of a few.
const TOLD: f64 = -1.5;
/// Evidence against a cut beyond which further cuts do not make up for it.
const HOPELESS: f64 = 6.0;
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
    /// Whether this is a place on a part in a heap of places in another frame: no place in that frame.
    pub stacked: bool,
}

/// Returns whether the poses of a state are as good as scattered over the scene. Such poses are outliers.
pub(super) fn is_scattered(places: &[Group], support: usize, demos: usize) -> bool {
    // A few poses say too little, and what occurs in nearly all demonstrations is no error.
    let common = 4 * support >= 3 * demos;
    demos >= MANY && !common && places.iter().map(|g| g.evidence).sum::<f64>() < EVIDENCE
}

/// Returns the frame in which these groups can be places of one state: the frame with the greatest posterior, if each
/// place loses little by it.
pub(super) fn common_frame(groups: &[Group], all: &[usize]) -> Option<usize> {
    let frames = groups.first()?.scores.len();
    let total = |f: usize| all.iter().map(|g| groups[*g].scores[f]).sum::<f64>();
    let best = (0..frames).max_by(|a, b| total(*a).total_cmp(&total(*b)).then(b.cmp(a)))?;
    let is_own = all.iter().any(|g| groups[*g].frame == best);
    let most = if is_own { COMMON.0 } else { COMMON.1 };
    let loses = |g: &Group| g.scores[g.frame] - g.scores[best];
    let stacked = |g: &Group| g.stacked && g.frame != best;
    let may = |g: &usize| loses(&groups[*g]) <= most && !stacked(&groups[*g]);
    all.iter().all(may).then_some(best)
}

/// Returns a kind that all of some rests lie on, and none of some others, if each set has the kinds that one rest lies on.
pub(super) fn told_apart(own: &[BTreeSet<usize>], others: &[BTreeSet<usize>]) -> Option<usize> {
    let mut kinds = own.first()?.iter().copied();
    kinds.find(|kind| {
        own.iter().all(|on| on.contains(kind)) && !others.iter().any(|on| on.contains(kind))
    })
}

/// Rests with their sums in one frame.
type Place = Vec<(usize, Sums)>;

fn total(place: &[(usize, Sums)]) -> Sums {
    place[1..].iter().fold(place[0].1.clone(), |sum, (_, one)| sum.add(one))
}

/// Cuts poses into the likeliest places, one gap in one coordinate after the other. Returns also how much likelier they are
/// than one place. In the other coordinates, both sides of a gap may have the same values. `least` is the smallest gap, `logs`
/// the log marginal likelihoods of the coordinates and of the orientation of a place. `lies_on` returns the kinds of the parts
/// that a rest lies on: where they tell the sides of a gap, nothing else has to.
fn modes(
    mut poses: Place,
    least: f64,
    logs: &impl Fn(usize, &Sums) -> [f64; 4],
    lies_on: &impl Fn(usize) -> BTreeSet<usize>,
) -> (Vec<Place>, f64) {
    let n = poses.len();
    let whole = logs(n, &total(&poses));
    let mut best = (f64::NEG_INFINITY, 0, 0);
    let along = |i: usize| {
        move |a: &(usize, Sums), b: &(usize, Sums)| {
            a.1.position[i].low.total_cmp(&b.1.position[i].low).then(a.0.cmp(&b.0))
        }
    };
    for i in 0..3 {
        poses.sort_by(along(i));
        let gaps =
            (1..n).filter(|k| poses[*k].1.position[i].low - poses[k - 1].1.position[i].low > least);
        for cut in gaps {
            let (left, right) =
                (logs(cut, &total(&poses[..cut])), logs(n - cut, &total(&poses[cut..])));
            let apart = |j: usize| left[j] + right[j] - whole[j];
            let shared = |j: usize| log_add(0.0, apart(j)) - 2f64.ln();
            let others: f64 = (0..4).filter(|j| *j != i).map(shared).sum();
            let sides = ln_gamma(cut as f64 + 1.0) + ln_gamma((n - cut) as f64 + 1.0);
            let sides = sides - ln_gamma(n as f64 + 2.0) - 3f64.ln();
            let told = || {
                let on = |side: &[(usize, Sums)]| -> Vec<BTreeSet<usize>> {
                    side.iter().map(|(rest, _)| lies_on(*rest)).collect()
                };
                let (left, right) = (on(&poses[..cut]), on(&poses[cut..]));
                told_apart(&left, &right).is_some() || told_apart(&right, &left).is_some()
            };
            let gain = apart(i) + others;
            let gain = gain + if gain > 0.0 && told() { sides.max(TOLD) } else { sides };
            if gain > best.0 {
                best = (gain, i, cut);
            }
        }
    }
    let (gain, i, cut) = best;
    if cut == 0 || gain < -HOPELESS {
        return (vec![poses], 0.0);
    }
    poses.sort_by(along(i));
    let right = poses.split_off(cut);
    let ((mut places, left), (others, right)) =
        (modes(poses, least, logs, lies_on), modes(right, least, logs, lies_on));
    places.extend(others);
    let gain = gain + left + right;
    if gain > 0.0 { (places, gain) } else { (vec![places.concat()], 0.0) }
}

/// Cuts poses at all gaps of more than `least`. Returns also how much likelier it is than at random, in nats, that as many
/// of them coincide: each pose chooses a place, and each beyond the first of its place is there by a chance of the width of a
/// place over the range. `scale` is the least spread of a place, `demo` the demonstration of a rest. Where no two poses of a
/// demonstration share a place, each chooses among those that are free.
fn coincidences(
    poses: Place,
    least: f64,
    scale: f64,
    demo: impl Fn(usize) -> usize,
) -> (Vec<Place>, f64) {
    let n = poses.len() as f64;
    let whole = total(&poses);
    let range = whole.position.iter().map(|s| s.high - s.low).fold(0.0, f64::max);
    let mut places = vec![poses];
    // After a cut in one coordinate, there can be gaps in another.
    for i in (0..3).chain(0..3) {
        let mut cut: Vec<Place> = Vec::new();
        for mut place in places {
            place.sort_by(|a, b| a.1.position[i].low.total_cmp(&b.1.position[i].low));
            let low = |one: &(usize, Sums)| one.1.position[i].low;
            cut.extend(place.chunk_by(|a, b| low(b) - low(a) <= least).map(<[_]>::to_vec));
        }
        places = cut;
    }
    let k = places.len() as f64;
    let squares = |i: usize| {
        let of = places.iter().map(|p| total(p).position[i].squares(p.len()).max(0.0));
        (of.sum::<f64>() / (n - k).max(1.0)).sqrt()
    };
    let spread = (0..3).map(squares).fold(scale, f64::max);
    let mut chosen: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, place) in places.iter().enumerate() {
        place.iter().for_each(|(rest, _)| chosen.entry(demo(*rest)).or_default().push(index));
    }
    let choices = chosen.values().map(|own| {
        let shared = own.windows(2).any(|pair| pair[0] == pair[1]);
        let free = |i: usize| if shared { k } else { k - i as f64 };
        (0..own.len()).map(|i| free(i).ln()).sum::<f64>()
    });
    let choices: f64 = choices.sum();
    (places, (n - k) * (range / (GAUSSIAN * spread)).ln() - choices)
}

impl Frames<'_, '_> {
    /// Returns the kinds of the parts that an object lies on: they were put there, and are more above or below it than aside. What was
    /// found on something was found in a heap, right above it, and what is below stays there.
    pub fn lies_on(&self, rest: usize) -> BTreeSet<usize> {
        let (motion, mut on) = (self.motion, BTreeSet::new());
        let Some(up) = self.up else { return on };
        let own = &motion.rests[rest];
        for kind in (0..self.kinds.len()).filter(|kind| self.moves[*kind]) {
            let below = self.reference(rest, kind + 1);
            let below = below.and_then(|(track, _)| self.rest_during(rest, track));
            let Some(there) = below.map(|there| &motion.rests[there]) else { continue };
            let far = there.pose.distance(&own.pose);
            let high = (there.pose.position[up] - own.pose.position[up]).abs();
            let heaped = there.came == Came::Found && own.came == Came::Found;
            let stays = || !self.leaves(rest, kind + 1);
            let upon = match heaped {
                true => HEAPED * high * high > far * far && stays(),
                false => there.came != Came::Found && 2.0 * high * high > far * far,
            };
            if upon {
                on.insert(kind);
            }
        }
        on
    }

    /// Returns whether objects came to a cluster by themselves and all in one way, such as screws that are driven in: nudges go this
    /// way and that. `owner` is the cluster of each rest.
    fn is_meant(&self, group: &Group, owner: &[Option<usize>]) -> bool {
        let motion = self.motion;
        let by = group.rests.iter().map(|now| {
            let before = motion.previous(*now)?;
            let carried = motion.rests[*now].came == Came::Carried && owner[before] != owner[*now];
            let ends = self.pose(before, group.frame).zip(self.pose(*now, group.frame));
            let (a, b) = ends.filter(|_| carried)?;
            Some(Vector3::from(b.position) - Vector3::from(a.position))
        });
        let Some(by) = by.collect::<Option<Vec<Vector3<f64>>>>() else { return false };
        let demos: BTreeSet<usize> = group.rests.iter().map(|r| motion.rests[*r].demo).collect();
        let mean = by.iter().sum::<Vector3<f64>>() / by.len() as f64;
        let off = by.iter().map(|by| (by - mean).norm_squared()).sum::<f64>() / by.len() as f64;
        // Two positions of three coordinates.
        let noise = 6.0 * motion.noise.position_m.powi(2);
        let alike = off <= (ONE_WAY * mean.norm()).powi(2) + noise;
        by.len() >= MEANT && demos.len() > 1 && alike && mean.norm() > motion.least.0
    }

    /// Joins clusters between which objects were only nudged: moved by no attempt, and much less than attempts move them.
    pub fn without_nudges(&self, kind: usize, mut groups: Vec<Group>) -> Vec<Group> {
        let mut moved: Vec<f64> = (self.motion.attempts.iter())
            .filter_map(|a| {
                let track = a.track?;
                let own = self.motion.tracks[a.demo][track].kind == self.kinds[kind];
                let (before, after) = self.motion.ends(a)?;
                let pose = |rest: usize| self.motion.rests[rest].pose;
                own.then(|| pose(before).distance(&pose(after)))
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
            let meant = self.is_meant(&groups[a], &owner);
            let nudged = groups[a].rests.iter().filter(|_| !meant).find_map(|now| {
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

    /// Splits clusters that are broad because they consist of several places, each of them tight, if that is more likely. What is
    /// put so carefully at other places of the frame has places here too.
    pub fn split_all(&self, groups: Vec<Group>, likelihood: &Likelihood) -> Vec<Vec<Group>> {
        let split = groups.into_iter().map(|group| self.split(group, likelihood, COINCIDENCES));
        let split: Vec<Vec<Group>> = split.collect();
        let careful = |group: &Group| {
            group.rests.len() > 1
                && group.rests.iter().all(|rest| self.was_put(*rest))
                && self.is_tight(group, likelihood)
        };
        let tight: BTreeSet<usize> =
            split.iter().flatten().filter(|group| careful(group)).map(|g| g.frame).collect();
        let again = |mut places: Vec<Group>| match (places.pop(), places.is_empty()) {
            (Some(whole), true) if tight.contains(&whole.frame) => {
                self.split(whole, likelihood, 0.0)
            }
            (last, _) => places.into_iter().chain(last).collect(),
        };
        split.into_iter().map(again).collect()
    }

    /// Gives what was put somewhere once to what was put just so several times beside something else: the second wagon of a train is
    /// behind a wagon, as the third one is, and not at a place of its own behind the engine.
    pub fn without_singles(&self, mut groups: Vec<Group>, likelihood: &Likelihood) -> Vec<Group> {
        let least = PLACE_M.max(PLACE_SD * likelihood.scale_m);
        let mut at = 0;
        while at < groups.len() {
            let single = groups[at].rests.first().copied();
            let single = single.filter(|rest| groups[at].rests.len() == 1 && self.was_put(*rest));
            let fits = |other: &Group, rest: usize| {
                let near = |one: &usize| {
                    let (a, b) = (self.pose(*one, other.frame), self.pose(rest, other.frame));
                    a.zip(b).is_some_and(|(a, b)| a.distance(&b) <= least)
                };
                other.frame > 0
                    && other.rests.len() >= MEANT
                    && other.rests.iter().all(|one| self.was_put(*one) && near(one))
                    && self.is_tight(other, likelihood)
                    && self.sums(rest, other.frame).is_some()
            };
            let home = single.and_then(|rest| groups.iter().position(|other| fits(other, rest)));
            let Some(home) = home else {
                at += 1;
                continue;
            };
            let taken = groups.remove(at);
            let home = &mut groups[if home > at { home - 1 } else { home }];
            home.rests.extend(taken.rests);
            home.scores.iter_mut().zip(taken.scores).for_each(|(a, b)| *a += b);
            home.evidence += taken.evidence;
        }
        groups
    }

    /// Returns whether the positions of a cluster agree as those of careful placing do.
    pub fn is_tight(&self, group: &Group, likelihood: &Likelihood) -> bool {
        let sums = group.rests.iter().map(|rest| self.sums(*rest, group.frame));
        let sums: Option<Vec<Sums>> = sums.collect();
        let extent = self.extent_in(group.frame);
        sums.and_then(|all| all.into_iter().reduce(|a, b| a.add(&b))).is_some_and(|sum| {
            let careful =
                |i: usize| likelihood.is_careful(group.rests.len(), &sum.position[i], extent[i]);
            (0..3).all(careful)
        })
    }

    /// Splits a cluster if it is more likely, from as much evidence of coinciding poses as `from`, in nats; without any, one place
    /// of two poses is enough.
    fn split(&self, group: Group, likelihood: &Likelihood, from: f64) -> Vec<Group> {
        let poses = group.rests.iter().map(|r| Some((*r, self.sums(*r, group.frame)?)));
        let Some(poses) = poses.collect::<Option<Vec<(usize, Sums)>>>() else { return vec![group] };
        let extent = self.extent_in(group.frame);
        let put = group.rests.iter().all(|r| self.motion.rests[*r].came != Came::Found);
        let up = self.up.filter(|_| put);
        let logs = |n: usize, sums: &Sums| -> [f64; 4] {
            std::array::from_fn(|i| {
                if i == 3 {
                    return likelihood.orientation(n, sums);
                }
                let spread = &sums.position[i];
                if up == Some(i) {
                    return likelihood.heights(n, spread, extent[i]);
                }
                let (tight, open) = likelihood.coordinate(n, spread, extent[i]);
                log_add(tight, open)
            })
        };
        let least = PLACE_M.max(PLACE_SD * likelihood.scale_m);
        let (mut places, mut gain) =
            coincidences(poses.clone(), least, likelihood.scale_m, |r| self.motion.rests[r].demo);
        let most = if from > 0.0 { poses.len() / 2 } else { poses.len().saturating_sub(1) };
        if gain < from || places.len() > most {
            (places, gain) = modes(poses, least, &logs, &|rest| self.lies_on(rest));
        }
        let tight = |p: &Place| {
            let whole = total(p);
            let careful = |i: usize| likelihood.is_careful(p.len(), &whole.position[i], extent[i]);
            p.len() == 1 || (0..3).all(careful)
        };
        if places.len() < 2
            || places.len() > most
            || gain < PLACES.min(from)
            || !places.iter().all(tight)
        {
            return vec![group];
        }
        let of = |place: &Place| Group {
            rests: place.iter().map(|(rest, _)| *rest).collect(),
            scores: group.scores.clone(),
            ..group
        };
        places.iter().map(of).collect()
    }
}
