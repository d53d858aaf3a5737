//! Finds the states: clusters of rests in frames.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix3, Vector3};

use super::cluster::{Clustering, FramePrior, Item, near};
use super::frames::{Frames, Member};
use super::likelihood::{Likelihood, Spread, Sums};
use super::motion::{Came, Motion, Rest};
use super::places::{Group, is_scattered, told_apart};
use crate::robot::Pose;
use crate::task::domain::{Fact, FrameState};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Unexplained {
    pub kind: String,
    pub rests: Vec<usize>,
}

/// The states, and the state of every rest.
pub(super) struct States {
    pub states: Vec<FrameState>,
    /// For each rest, its state, with the track of the reference in the rest's demonstration; `None` for fixtures and for
    /// unexplained rests.
    pub labels: Vec<Option<Fact>>,
    pub unexplained: Vec<Unexplained>,
    /// Of the unexplained rests, those in which an object fell over.
    pub fallen: BTreeSet<usize>,
    /// Kinds that never moved, or that another hand moved.
    pub fixed: Vec<String>,
    /// Kinds that another hand moved.
    pub moved_by_others: Vec<String>,
}

/// Log priors of the frames: of the world, of kinds that never move and of kinds that move. What moves is a likely
/// reference if it is near, and an unlikely one if it is far.
const WORLD_PRIOR: FramePrior = FramePrior { base: -3.0, slope: 0.0, crowd: 0.0, put: 0.0 };
const FIXED_PRIOR: FramePrior = FramePrior { base: 0.0, slope: 2.0, crowd: 0.0, put: 0.0 };
/// That of the kind to which a kind of a family goes.
const HOME_PRIOR: FramePrior = FramePrior { put: 4.0, ..FIXED_PRIOR };
const MOVING_PRIOR: FramePrior = FramePrior { base: 2.0, slope: 4.0, crowd: 3.0, put: 0.0 };
/// Distance of the middle of an area in which objects lie about, in its diagonals, beyond which it does not belong to a reference.
const FAR_AREA: f64 = 1.5;
/// Length of such an area, as a share of the diagonal of the area in the world, beyond which it does not belong to one that moves about.
const LONG_AREA: f64 = 0.75;
/// Number of found objects up to which they show no area.
const FEW_FOUND: usize = 2;
/// Number of found objects up to which a place of some of them may be chance.
const FEW_LYING: usize = 4;
/// Distance below which an attempt left its object in place, in metres.
const IN_PLACE_M: f64 = 5e-3;
/// Share of a kind's attempts that may end in the cluster in which they began before orientation counts.
const UNEXPLAINED: f64 = 0.3;
/// Share of the demonstrations in which a state has to occur.
const SUPPORT: f64 = 0.1;

/// Returns the number of demonstrations in which a state or an action has to occur.
pub(super) fn least_support(demos: usize) -> usize {
    if demos < 3 { 1 } else { (SUPPORT * demos as f64).ceil().max(2.0) as usize }
}

pub(super) fn find(motion: &Motion<'_>) -> States {
    let frames = Frames::new(motion);
    let mut labels = vec![None; motion.rests.len()];
    let mut out = States {
        states: Vec::new(),
        labels: Vec::new(),
        unexplained: Vec::new(),
        fallen: BTreeSet::new(),
        fixed: Vec::new(),
        moved_by_others: Vec::new(),
    };
    let mut lost: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    // The places of each state, with its kind and whether it may be turned.
    let mut all: Vec<(usize, bool, Vec<Group>)> = Vec::new();
    let mut in_families = frames.families();
    for kind in 0..frames.kinds.len() {
        if !frames.moves[kind] {
            out.fixed.push(frames.kinds[kind].to_string());
            continue;
        }
        let (groups, turns) = in_families.remove(&kind).unwrap_or_else(|| frames.groups(&[kind]));
        let mut groups = frames.without_nudges(kind, groups);
        let own = frames.without_fallen(&mut groups);
        if !own.is_empty() {
            out.fallen.extend(&own);
            lost.insert(kind, own);
        }
        let (groups, sides): (Vec<Group>, Vec<bool>) = frames.by_side(groups).into_iter().unzip();
        // Sides are told by orientations.
        let turns = turns || sides.contains(&true);
        let together = frames.with_taken(frames.together(groups, turns));
        all.extend(together.into_iter().map(|places| (kind, turns, places)));
    }
    let others = frames.moved_by_others.iter();
    out.moved_by_others = others.map(|kind| frames.kinds[*kind].to_string()).collect();
    frames.lend(&mut all);
    // What was used most comes first: planners take the first of several places.
    all.iter_mut().for_each(|(.., places)| places.sort_by_key(|g| usize::MAX - g.rests.len()));
    let demos = motion.recording.demos.len();
    let scattered = |places: &[Group]| {
        let rests: Vec<usize> = places.iter().flat_map(|g| g.rests.clone()).collect();
        let support = frames.support(&rests);
        (rests, support < least_support(demos), is_scattered(places, support, demos))
    };
    let shared = all.iter().map(|(kind, _, places)| match scattered(places) {
        (rests, false, true) => frames.shared(*kind, &rests, &all),
        _ => None,
    });
    let shared: Vec<Option<usize>> = shared.collect();
    for ((kind, turns, mut places), shared) in all.into_iter().zip(shared) {
        let (rests, seldom, scattered) = scattered(&places);
        let rare = seldom || (scattered && shared.is_none());
        if rare && !frames.were_left(&rests) && !frames.are_all_put(kind, &rests) {
            lost.entry(kind).or_default().extend(rests);
            continue;
        }
        if let Some(frame) = shared {
            let scores = places[0].scores.clone();
            places = vec![Group { rests, frame, scores, evidence: 0.0, stacked: false }];
        }
        let state = out.states.len();
        let frame = places[0].frame;
        for (place, group) in places.iter().enumerate() {
            for rest in &group.rests {
                let reference = frames.reference(*rest, frame).map(|(track, _)| track);
                labels[*rest] = Some(Fact { state, place, reference });
            }
        }
        out.states.push(frames.model((kind, turns), &places));
    }
    for (kind, mut rests) in lost {
        rests.sort_unstable();
        out.unexplained.push(Unexplained { kind: frames.kinds[kind].to_string(), rests });
    }
    for (now, before) in &frames.carried_from {
        labels[*now] = labels[*before];
        if out.fallen.contains(before) {
            out.fallen.insert(*now);
        }
    }
    out.labels = labels;
    out
}

fn turned(pose: Pose) -> Matrix3<f64> {
    *pose.rotation().to_rotation_matrix().matrix()
}

impl Frames<'_, '_> {
    /// Clusters the rests of families of kinds, those of a family together.
    fn families(&self) -> BTreeMap<usize, (Vec<Group>, bool)> {
        let index = |name: &String| self.kinds.binary_search_by(|kind| (**kind).cmp(name)).ok();
        let mut all = BTreeMap::new();
        for family in &self.motion.families {
            let members = family.iter().filter_map(|(own, home)| index(own).zip(index(home)));
            let family = members.filter(|(own, home)| self.moves[*own] && !self.moves[*home]);
            let family: Vec<Member> = family.collect();
            let kinds: Vec<usize> = family.iter().map(|(kind, _)| *kind).collect();
            let mut as_one = self.clone();
            as_one.family.clone_from(&family);
            let (groups, turns) = as_one.groups(&kinds);
            for (kind, home) in &family {
                let own = groups
                    .iter()
                    .filter_map(|group| self.member(group, *kind, [family[0].1, *home]));
                all.insert(*kind, (own.collect(), turns));
            }
        }
        all
    }

    /// Returns the rests of a kind in a group of several, with these two kinds changing places; `None` without any.
    fn member(&self, group: &Group, kind: usize, [first, home]: [usize; 2]) -> Option<Group> {
        let own = |rest: &usize| self.motion.kind(&self.motion.rests[*rest]) == &*self.kinds[kind];
        let rests: Vec<usize> = group.rests.iter().copied().filter(own).collect();
        let share = rests.len() as f64 / group.rests.len() as f64;
        let mut scores: Vec<f64> = group.scores.iter().map(|score| score * share).collect();
        scores.swap(first + 1, home + 1);
        let frame = match group.frame {
            frame if frame == first + 1 => home + 1,
            frame if frame == home + 1 => first + 1,
            frame => frame,
        };
        let (evidence, stacked) = (group.evidence * share, group.stacked);
        (!rests.is_empty()).then_some(Group { rests, frame, scores, evidence, stacked })
    }

    /// Clusters the rests of some kinds as those of one.
    fn groups(&self, kinds: &[usize]) -> (Vec<Group>, bool) {
        let own =
            |rest: &Rest| kinds.iter().any(|kind| self.motion.kind(rest) == &*self.kinds[*kind]);
        let rests: Vec<usize> = (0..self.motion.rests.len())
            .filter(|r| own(&self.motion.rests[*r]))
            .filter(|r| !self.carried_from.contains_key(r))
            .collect();
        let frames = self.kinds.len() + 1;
        let items: Vec<Item> = rests
            .iter()
            .map(|r| Item { frames: (0..frames).map(|f| self.sums(*r, f)).collect() })
            .collect();
        let home = self.family.first().map(|(_, home)| *home);
        let priors: Vec<FramePrior> = (0..frames)
            .map(|f| match f.checked_sub(1) {
                None => WORLD_PRIOR,
                Some(kind) if home == Some(kind) => HOME_PRIOR,
                Some(kind) if self.moves[kind] => MOVING_PRIOR,
                Some(_) => FIXED_PRIOR,
            })
            .collect();
        let extents: Vec<[f64; 3]> = (0..frames).map(|f| self.extent_in(f)).collect();
        let near_m = near(extents[0]);
        let place: BTreeMap<usize, usize> = rests.iter().copied().zip(0..).collect();
        let attempts: Vec<(usize, usize)> = (self.motion.attempts.iter())
            .filter_map(|a| {
                let (before, after) = self.motion.ends(a)?;
                Some((*place.get(&self.origin(before))?, *place.get(&self.origin(after))?))
            })
            .filter(|(before, after)| before != after)
            .collect();
        let placing = Likelihood::of_placing(&self.motion.noise, items.len());
        let problem = Clustering {
            items: &items,
            priors: &priors,
            extents: &extents,
            near_m,
            attempts: &attempts,
            likelihood: &placing,
        };
        let mut likelihood = placing.clone();
        let run = |likelihood: &Likelihood| {
            let clustering = Clustering { likelihood, ..problem };
            let mut clusters = clustering.run();
            let scored = clusters.iter_mut().map(|c| {
                let (_, mut scores) = clustering.frame(c.members.len(), &c.frames, true);
                let own: Vec<usize> = c.members.iter().map(|m| rests[*m]).collect();
                c.frame = self.favour_symmetric(likelihood, &own, &c.frames, &mut scores);
                scores
            });
            let scores: Vec<Vec<f64>> = scored.collect();
            scores.into_iter().zip(clusters).collect::<Vec<_>>()
        };
        // Orientation counts if attempts only turned their object, or if positions leave attempts unexplained.
        let still = attempts.iter().filter(|(a, b)| {
            let pose = |i: usize| self.motion.rests[rests[i]].pose;
            pose(*a).distance(&pose(*b)) <= self.motion.least.0.max(IN_PLACE_M)
        });
        likelihood.turns = still.count() as f64 > UNEXPLAINED * attempts.len() as f64;
        let mut clusters = run(&likelihood);
        if !likelihood.turns {
            let mut owner = vec![0; items.len()];
            for (index, (_, cluster)) in clusters.iter().enumerate() {
                cluster.members.iter().for_each(|item| owner[*item] = index);
            }
            let same = attempts.iter().filter(|(a, b)| owner[*a] == owner[*b]).count();
            if same as f64 > UNEXPLAINED * attempts.len() as f64 {
                likelihood.turns = true;
                clusters = run(&likelihood);
            }
        }
        let groups = clusters.into_iter().map(|(scores, c)| {
            let scattered: f64 = extents[c.frame].iter().map(|l| -l.ln()).sum();
            let n = c.members.len();
            let likely = c.frames[c.frame]
                .as_ref()
                .map_or(0.0, |sums| likelihood.poses(n, sums, &extents[c.frame]));
            Group {
                rests: c.members.iter().map(|m| rests[*m]).collect(),
                frame: c.frame,
                scores,
                evidence: likely - n as f64 * scattered,
                stacked: false,
            }
        });
        let groups = self.lying_about(groups.collect(), &likelihood).into_iter();
        let clustering = Clustering { likelihood: &likelihood, ..problem };
        let frame = |own: &[usize], turns: bool| {
            let members: Vec<usize> = own.iter().map(|rest| place[rest]).collect();
            clustering.frame(members.len(), &clustering.sums(&members), turns)
        };
        let groups = groups.map(|group| self.without_far_areas(group, &likelihood)).collect();
        let split = self.split_all(groups, &likelihood).into_iter();
        let split = split.flat_map(|places| self.unstacked(places, frame)).collect();
        (self.without_singles(self.in_heaps(split, frame), &likelihood), likelihood.turns)
    }

    /// Makes one area of the places in which objects of a kind were found, if each was found at a place of its own, or if they are few
    /// and no place is tight: they lay about.
    fn lying_about(&self, groups: Vec<Group>, likelihood: &Likelihood) -> Vec<Group> {
        let is_found = |group: &Group| {
            group.rests.iter().all(|rest| self.motion.rests[*rest].came == Came::Found)
        };
        let found = || groups.iter().filter(|group| is_found(group));
        let few = found().map(|group| group.rests.len()).sum::<usize>() <= FEW_LYING;
        let alone = |group: &Group| {
            group.rests.len() == 1 || (few && group.frame == 0 && !self.is_tight(group, likelihood))
        };
        if found().count() < 2 || !found().all(alone) {
            return groups;
        }
        let mut out: Vec<Group> = Vec::new();
        let mut area: Option<usize> = None;
        for group in groups {
            match area.filter(|_| is_found(&group)) {
                Some(at) => {
                    let whole = &mut out[at];
                    whole.rests.extend(group.rests);
                    whole.scores.iter_mut().zip(group.scores).for_each(|(a, b)| *a += b);
                    whole.evidence += group.evidence;
                    whole.frame = 0;
                }
                None => {
                    area = area.or(is_found(&group).then_some(out.len()));
                    out.push(group);
                }
            }
        }
        out
    }

    /// Adds to the posterior of each frame what speaks for it if the objects look alike from several sides: a lid that is put onto its box
    /// either way round does not belong to what lies in the box. Returns the best frame.
    fn favour_symmetric(
        &self,
        likelihood: &Likelihood,
        rests: &[usize],
        sums: &[Option<Sums>],
        scores: &mut [f64],
    ) -> usize {
        let mut best = 0;
        for (frame, sums) in sums.iter().enumerate() {
            let Some(sums) = sums else { continue };
            let turns = rests.iter().map(|rest| self.pose(*rest, frame).map(turned));
            if let Some(turns) = turns.collect::<Option<Vec<Matrix3<f64>>>>() {
                scores[frame] += likelihood.symmetric(&turns, sums);
            }
            if scores[frame] > scores[best] + 1e-9 {
                best = frame;
            }
        }
        best
    }

    /// Gives a cluster of found objects another frame if they lie all over an area far from the reference, or one that is about as long as
    /// that in the world though the reference moves about as far: where things lie about by chance, they seem to lie in one direction of
    /// something, or in a strip across it.
    fn without_far_areas(&self, mut group: Group, likelihood: &Likelihood) -> Group {
        let found = |rest: &usize| self.motion.rests[*rest].came == Came::Found;
        // The ranges along the open axes of a frame.
        let area = |group: &Group, frame: usize| -> Option<Vec<Spread>> {
            let all = group.rests.iter().map(|rest| self.sums(*rest, frame));
            let sum = all.collect::<Option<Vec<Sums>>>()?.into_iter().reduce(|a, b| a.add(&b))?;
            let (n, extent) = (group.rests.len(), self.extent_in(frame));
            let careful = |i: &usize| likelihood.is_careful(n, &sum.position[*i], extent[*i]);
            Some((0..3).filter(|i| !careful(i)).map(|i| sum.position[i]).collect())
        };
        let length = |all: &[Spread], of: fn(&Spread) -> f64| {
            all.iter().map(|s| of(s).powi(2)).sum::<f64>().sqrt()
        };
        let wide: fn(&Spread) -> f64 = |s| s.high - s.low;
        // How far the references stood apart: in one that hardly moves, an area is as long as in the world.
        let apart = |group: &Group| -> f64 {
            let there = |rest: &usize| {
                let (track, _) = self.reference(*rest, group.frame)?;
                Some(self.motion.rests[self.rest_during(*rest, track)?].pose.position)
            };
            let all: Vec<[f64; 3]> = group.rests.iter().filter_map(there).collect();
            let range = |i: usize| {
                let values = all.iter().map(|at| at[i]);
                values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
            };
            if all.is_empty() { 0.0 } else { (0..3).map(|i| range(i).powi(2)).sum::<f64>().sqrt() }
        };
        let far = |group: &Group| {
            let open = area(group, group.frame).filter(|open| open.len() > 1);
            open.is_some_and(|open| {
                let longest = open.iter().map(wide).fold(0.0, f64::max);
                let world = area(group, 0).map_or(f64::INFINITY, |world| length(&world, wide));
                length(&open, |s| (s.low + s.high) / 2.0) > FAR_AREA * length(&open, wide)
                    || longest > LONG_AREA * world && apart(group) >= longest
            })
        };
        let several = group.rests.len() > FEW_FOUND && group.rests.iter().all(found);
        while several && group.frame > 0 && far(&group) {
            group.scores[group.frame] = f64::NEG_INFINITY;
            let best = (0..group.scores.len())
                .rev()
                .max_by(|a, b| group.scores[*a].total_cmp(&group.scores[*b]));
            group.frame = best.filter(|f| group.scores[*f].is_finite()).unwrap_or(0);
        }
        group
    }

    /// Gives those of several places of one cluster that are on a part that moves to the part: what is stacked is seen at several
    /// heights above the table, but at one height above what it lies on. `of` returns the best frame of some rests, with the
    /// posterior in each frame, by their orientations as well if it is told so.
    fn unstacked(
        &self,
        places: Vec<Group>,
        of: impl Fn(&[usize], bool) -> (usize, Vec<f64>),
    ) -> Vec<Group> {
        if places.len() < 2 {
            return places;
        }
        let on: Vec<Vec<BTreeSet<usize>>> = places
            .iter()
            .map(|group| group.rests.iter().map(|rest| self.lies_on(*rest)).collect())
            .collect();
        let (mut stacked, mut others): (Vec<Group>, Vec<Group>) = (Vec::new(), Vec::new());
        for (index, mut group) in places.into_iter().enumerate() {
            let elsewhere = (0..on.len()).filter(|other| *other != index);
            let elsewhere: Vec<BTreeSet<usize>> =
                elsewhere.flat_map(|other| on[other].iter().cloned()).collect();
            // Of two or three, all may be turned alike by chance.
            let turns = told_apart(&on[index], &elsewhere).is_none();
            let (frame, scores) = of(&group.rests, turns);
            let part = frame.checked_sub(1).is_some_and(|kind| self.moves[kind]);
            // What stands beside a part is not on it.
            let upon = |on: &BTreeSet<usize>| self.up.is_none() || on.contains(&(frame - 1));
            if group.rests.len() > 1 && part && frame != group.frame && on[index].iter().all(upon) {
                (group.stacked, group.frame, group.scores) = (true, frame, scores);
                stacked.push(group);
            } else {
                others.push(group);
            }
        }
        // What lies on parts of one kind in one way is one state, whatever the height of the heap.
        let mut out: Vec<Group> = Vec::new();
        for group in stacked.into_iter().chain(others) {
            let joined = out.iter_mut().filter(|other| other.stacked).find_map(|other| {
                let both = [&other.rests[..], &group.rests[..]].concat();
                let (common, scores) = of(&both, true);
                // The posterior of a place of a cluster is that of the whole cluster.
                let own = of(&group.rests, true).1[group.frame];
                let alike =
                    common == other.frame && scores[common] > other.scores[other.frame] + own;
                alike.then_some((other, both, scores))
            });
            match joined {
                Some((other, both, scores)) => {
                    (other.rests, other.scores) = (both, scores);
                    other.evidence += group.evidence;
                }
                None => out.push(group),
            }
        }
        out
    }

    /// Joins what lies on parts of one kind in one way, whether it was found so or put so, and at any height of the heap. `of` is that
    /// of [`unstacked`](Self::unstacked).
    fn in_heaps(
        &self,
        mut groups: Vec<Group>,
        of: impl Fn(&[usize], bool) -> (usize, Vec<f64>),
    ) -> Vec<Group> {
        let mut first = 0;
        while first < groups.len() {
            let heap = &groups[first];
            let (frame, own) = (heap.frame, heap.scores[heap.frame]);
            let upon = |group: &Group| {
                frame > 0
                    && group.rests.iter().all(|rest| self.lies_on(*rest).contains(&(frame - 1)))
            };
            let joins = |other: &usize| {
                let group = &groups[*other];
                let (alike, on) = (group.frame == frame, upon(group));
                // Nobody puts a part so near to where it was found: it is one way to lie there.
                let same = || alike && on && upon(heap) && self.is_near(heap, group);
                if *other == first || !(heap.stacked && (alike || on) || same()) {
                    return None;
                }
                let both = [&heap.rests[..], &group.rests[..]].concat();
                let (common, scores) = of(&both, true);
                let alone = of(&group.rests, true).1[group.frame];
                let better = common == frame && scores[frame] > own + alone;
                (better || same()).then_some((both, scores))
            };
            let joined = (0..groups.len()).find_map(|other| Some((other, joins(&other)?)));
            match joined {
                Some((other, (rests, scores))) => {
                    let evidence = groups[first].evidence + groups[other].evidence;
                    groups[first] = Group { rests, scores, evidence, frame, stacked: true };
                    groups.remove(other);
                    first -= usize::from(other < first);
                }
                None => first += 1,
            }
        }
        groups
    }

    /// Returns whether the mean positions of two groups in the frame of the first are so near that nobody would move an object from one
    /// to the other.
    fn is_near(&self, one: &Group, other: &Group) -> bool {
        let mean = |group: &Group| self.mean(group, one.frame);
        (mean(one) - mean(other)).norm_squared() < IN_PLACE_M * IN_PLACE_M
    }

    /// Returns the mean position of a group in a frame.
    fn mean(&self, group: &Group, frame: usize) -> Vector3<f64> {
        let poses = group.rests.iter().filter_map(|rest| self.pose(*rest, frame));
        poses.map(|pose| Vector3::from(pose.position)).sum::<Vector3<f64>>()
            / group.rests.len() as f64
    }

    /// Returns whether two groups are so near, beside how far each is spread, that they are one place: objects that fell into a bin here
    /// and there.
    pub fn overlap(&self, one: &Group, other: &Group) -> bool {
        let spread = |group: &Group| {
            let mean = self.mean(group, one.frame);
            let poses = group.rests.iter().filter_map(|rest| self.pose(*rest, one.frame));
            let squares = poses.map(|pose| (Vector3::from(pose.position) - mean).norm_squared());
            squares.sum::<f64>() / group.rests.len().saturating_sub(1).max(1) as f64
        };
        let apart = (self.mean(one, one.frame) - self.mean(other, one.frame)).norm_squared();
        apart <= (4.0 * (spread(one) + spread(other))).min((2.0 * IN_PLACE_M).powi(2))
    }

    /// Returns whether objects were found in all of these rests and some were then moved on purpose. What was shown once is
    /// uncertain, but it is no accident of the demonstrator, and no error of sensing if it was seen twice.
    fn were_left(&self, rests: &[usize]) -> bool {
        let motion = self.motion;
        let found = |rest: &usize| motion.rests[*rest].came == Came::Found;
        let moved = |rest: &usize| {
            let Rest { demo, track, .. } = motion.rests[*rest];
            let own = motion.attempts.iter().filter(|a| a.declared && a.demo == demo);
            let mut own = own.filter(|a| a.track == Some(track));
            own.any(|a| motion.before(a) == Some(*rest))
        };
        let sure = |rest: &usize| motion.is_sure(&motion.rests[*rest]);
        rests.iter().all(|rest| found(rest) && sure(rest)) && rests.iter().any(moved)
    }

    /// Returns whether objects of a kind were put nowhere else than in these rests. Where a thing is for is where it goes,
    /// even if it was needed once.
    fn are_all_put(&self, kind: usize, rests: &[usize]) -> bool {
        let all = 0..self.motion.rests.len();
        let mut own =
            all.filter(|r| self.motion.kind(&self.motion.rests[*r]) == &*self.kinds[kind]);
        rests.iter().any(|rest| self.was_put(*rest))
            && own.all(|rest| !self.was_put(rest) || rests.contains(&rest))
    }

    pub fn was_put(&self, rest: usize) -> bool {
        matches!(self.motion.rests[rest].came, Came::Placed(_))
    }

    /// Gives a state in which an object was put once the frame in which most were put: a single pose tells of no frame.
    fn lend(&self, states: &mut [(usize, bool, Vec<Group>)]) {
        let mut put = vec![0; self.kinds.len() + 1];
        for group in states.iter().flat_map(|(.., places)| places) {
            if group.rests.len() > 1 {
                put[group.frame] += group.rests.iter().filter(|r| self.was_put(**r)).count();
            }
        }
        let usual = (0..put.len()).rev().max_by_key(|frame| put[*frame]).unwrap_or(0);
        for (.., places) in states {
            if let [group] = &mut places[..]
                && let [rest] = group.rests[..]
                && self.was_put(rest)
                && put[usual] > 0
                && group.scores[usual].is_finite()
            {
                group.frame = usual;
            }
        }
    }

    /// Returns the number of demonstrations in which some rests occur.
    fn support(&self, rests: &[usize]) -> usize {
        let demos: BTreeSet<usize> = rests.iter().map(|r| self.motion.rests[*r].demo).collect();
        demos.len()
    }
}
