//! Movements in a recording: robust tracks, and the times for which each object rests.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

use super::following::{follow, vanishes_for_a_moment};
use super::likelihood::Spread;
use super::noise::{Noise, hold_fixtures, leave_out, median, noise};
use super::{carried, views};
use crate::robot::{Pose, rotation_between};
use crate::task::learn::attempts::{self, Attempt, MOVED_M};
use crate::task::learn::attributes::Family;
use crate::task::learn::tracks::Track;
use crate::task::recording::{Demonstration, Recording, Snapshot, SnapshotEvent};

/// How an object came to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Came {
    /// It lay there when the demonstration began.
    Found,
    /// An attempt put it there: its index in [`Motion::attempts`].
    Placed(usize),
    /// Something else moved it, such as its container or a knock.
    Carried,
}

/// A time for which an object rests.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rest {
    pub demo: usize,
    pub track: usize,
    /// First and last snapshot of the rest.
    pub first: usize,
    pub last: usize,
    /// Median pose.
    pub pose: Pose,
    /// Number of snapshots that show it.
    pub seen: usize,
    pub came: Came,
}

/// A recording as objects that rest and are moved.
pub(super) struct Motion<'r> {
    pub recording: &'r Recording,
    pub noise: Noise,
    pub tracks: Vec<Vec<Track>>,
    /// The attempts, in the order of the demonstrations.
    pub attempts: Vec<Attempt>,
    /// The rests of each track in order, one track after the other.
    pub rests: Vec<Rest>,
    /// For each demonstration and track, its rests.
    of_track: Vec<Vec<Range<usize>>>,
    /// Number of poses that disagree with the rest of their object.
    pub outliers: usize,
    /// Distance and angle beyond which a pose differs from another.
    pub least: (f64, f64),
    /// Whether some object is missing from a snapshot and seen again later.
    pub flickers: bool,
    /// The kinds that nothing ever moved.
    pub landmarks: BTreeSet<Arc<str>>,
    /// Kinds to which the same is done, but for the fixed kind to which each goes.
    pub families: Vec<Family>,
    /// A kind that nobody handled and whose poses differ from look to look, with the usual difference in metres.
    pub views: Option<(String, f64)>,
}

/// Number of standard deviations beyond which two noisy poses differ. The distance of two noisy positions exceeds six
/// standard deviations of one coordinate in 1 of 2,500 pairs.
const FAR: f64 = 6.0;
/// Noise above which single disagreeing poses are taken for outliers, in metres.
const NOISY_M: f64 = 5e-5;
/// Smallest turn that counts as movement, in radians.
const TURNED_RAD: f64 = 0.05;

/// Greatest distance between a release and the rest after it, in metres.
const FALLEN_M: f64 = 0.03;
/// Number of snapshots for which an object may be missing at the end of a demonstration without being taken for lost.
const MOMENT: usize = 2;

pub(super) fn angle(a: &Pose, b: &Pose) -> f64 {
    rotation_between(a, b).iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Least angle by which things are turned against each other, in radians, least cosine of its axis and a coordinate, and least number
/// of things that are.
const TURNED_BY: f64 = 0.2;
const ABOUT: f64 = 0.98;
const TURNS: usize = 5;
/// Least ratio of the width of a table to the differences in height on it.
const FLAT: f64 = 4.0;

/// Returns the widths of the box around positions, in metres.
pub(super) fn widths(positions: impl Iterator<Item = [f64; 3]> + Clone) -> [f64; 3] {
    std::array::from_fn(|i| {
        let spread = Spread::over(positions.clone().map(|at| at[i]));
        spread.map_or(0.0, |s| s.high - s.low)
    })
}

/// Returns the vertical coordinate of a box, if things lie all over a table in it.
pub(super) fn vertical(widths: [f64; 3]) -> Option<usize> {
    (0..3).find(|i| (0..3).all(|j| j == *i || FLAT * widths[*i] < widths[j]))
}

impl<'r> Motion<'r> {
    /// Follows all objects, cuts the attempts and finds the rests.
    pub fn of(recording: &'r Recording, p: f64) -> Self {
        let (mut noise, mut views) = (noise(recording), None);
        if let Some((kind, spread)) = views::differing(recording, &noise) {
            views = Some((kind, spread.position_m * std::f64::consts::SQRT_2));
            noise.position_m = noise.position_m.max(spread.position_m);
            noise.angle_rad = noise.angle_rad.max(spread.angle_rad);
        }
        let least = (MOVED_M + FAR * noise.position_m, TURNED_RAD + FAR * noise.angle_rad);
        let (mut outliers, mut flickers) = (0, false);
        let tracks: Vec<Vec<Track>> = recording
            .demos
            .iter()
            .map(|demo| {
                let mut tracks = follow(demo, least.0);
                flickers |= tracks.iter().any(vanishes_for_a_moment);
                outliers += tracks.iter_mut().map(|t| leave_out(t, demo, least)).sum::<usize>();
                tracks
            })
            .collect();
        let mut tracks = tracks;
        outliers += hold_fixtures(recording, &mut tracks, least.0);
        let mut motion = Self {
            recording,
            noise,
            of_track: Vec::with_capacity(tracks.len()),
            tracks,
            attempts: Vec::new(),
            rests: Vec::new(),
            outliers,
            least,
            flickers,
            landmarks: BTreeSet::new(),
            families: Vec::new(),
            views,
        };
        let upwards = carried::upright(recording);
        for d in 0..recording.demos.len() {
            let demo = &recording.demos[d];
            let spans: Vec<_> = motion.tracks[d].iter().map(Track::span).collect();
            for mut attempt in attempts::cut(d, demo, &motion.tracks[d]) {
                if !attempt.declared {
                    attempt.track = carried::guess(&motion, &attempt, &spans, upwards, p);
                }
                motion.attempts.push(attempt);
            }
            let own = (0..spans.len()).map(|t| {
                let first = motion.rests.len();
                motion.rest(d, t);
                first..motion.rests.len()
            });
            let own = own.collect();
            motion.of_track.push(own);
        }
        let kind = |rest: &Rest| motion.tracks[rest.demo][rest.track].kind.clone();
        let moved = motion.rests.iter().filter(|rest| rest.came != Came::Found);
        let moved: BTreeSet<Arc<str>> = moved.map(kind).collect();
        let all: BTreeSet<Arc<str>> = motion.rests.iter().map(kind).collect();
        motion.landmarks = &all - &moved;
        motion
    }

    pub fn demo(&self, demo: usize) -> &'r Demonstration {
        &self.recording.demos[demo]
    }

    /// Returns the index of the last snapshot of a demonstration; `None` if it has none.
    pub fn last(&self, demo: usize) -> Option<usize> {
        self.demo(demo).snapshots.len().checked_sub(1)
    }

    /// Returns whether the poses have errors of sensing.
    pub fn is_noisy(&self) -> bool {
        self.noise.position_m > NOISY_M || self.outliers > 0
    }

    /// Returns whether a rest is no error of sensing: two snapshots agree on it, or there are no such errors.
    pub fn is_sure(&self, rest: &Rest) -> bool {
        rest.seen > 1 || !self.is_noisy()
    }

    /// Returns the rest of a track in a snapshot.
    pub fn index_at(&self, demo: usize, track: usize, snapshot: usize) -> Option<usize> {
        self.latest(demo, track, snapshot).filter(|rest| snapshot <= self.rests[*rest].last)
    }

    /// Returns the last rest of a track that began by a snapshot.
    pub fn latest(&self, demo: usize, track: usize, snapshot: usize) -> Option<usize> {
        let own = self.of_track[demo][track].clone();
        let begun = self.rests[own.clone()].partition_point(|rest| rest.first <= snapshot);
        Some(own.start + begun.checked_sub(1)?)
    }

    /// Returns the rest in which a track is known to be in a snapshot: where it was seen last. If objects are missing for a
    /// moment, one that a hand moved is nowhere until it is seen again.
    pub fn known(&self, demo: usize, track: usize, snapshot: usize) -> Option<usize> {
        let latest = self.latest(demo, track, snapshot)?;
        (!self.flickers || !self.vanished(demo, track, snapshot)).then_some(latest)
    }

    /// Returns whether a hand moved a track after it was seen last, up to a snapshot, or moved something that is not known.
    pub fn vanished(&self, demo: usize, track: usize, snapshot: usize) -> bool {
        let Some(latest) = self.latest(demo, track, snapshot) else { return true };
        let until = self.rests[latest].last;
        let own = self.attempts[self.attempts_of(demo)].iter();
        let mut unknown = own.filter(|a| a.track.is_none() && until <= a.before);
        unknown.any(|a| a.after <= snapshot) || self.was_moved(demo, track, (until, snapshot))
    }

    /// Returns whether an attempt moved a track between two snapshots, in which it was not seen.
    fn was_moved(&self, demo: usize, track: usize, (since, until): (usize, usize)) -> bool {
        let own = self.attempts[self.attempts_of(demo)].iter();
        let mut later = own.rev().take_while(|a| a.after > since);
        later.any(|a| a.track == Some(track) && a.after <= until)
    }

    /// Returns whether an object came to a rest while nothing was handled.
    pub fn moved_between_attempts(&self, rest: usize) -> bool {
        let Some(before) = self.previous(rest) else { return false };
        let (since, until) = (self.rests[before].last, self.rests[rest].first);
        let own = &self.attempts[self.attempts_of(self.rests[rest].demo)];
        own.iter().all(|a| a.after <= since || until <= a.before)
    }

    /// Returns the rests in which the object of an attempt was before and after it; `None` if it is not known, or was lost.
    /// An object can be missing for a moment.
    pub fn ends(&self, attempt: &Attempt) -> Option<(usize, usize)> {
        let (demo, track) = (attempt.demo, attempt.track?);
        let after = match self.flickers {
            true => self.next(demo, track, attempt.after),
            false => self.index_at(demo, track, attempt.after),
        };
        Some((self.before(attempt)?, after?))
    }

    /// Returns the rest in which the object of an attempt was before it.
    pub fn before(&self, attempt: &Attempt) -> Option<usize> {
        let (demo, track) = (attempt.demo, attempt.track?);
        match self.flickers {
            true => self.known(demo, track, attempt.before),
            false => self.index_at(demo, track, attempt.before),
        }
    }

    /// Returns the first rest of a track that ended in a snapshot or later.
    pub fn next(&self, demo: usize, track: usize, snapshot: usize) -> Option<usize> {
        let own = self.of_track[demo][track].clone();
        let over = self.rests[own.clone()].partition_point(|rest| rest.last < snapshot);
        own.clone().nth(over)
    }

    /// Returns the rest of the same track before a rest.
    pub fn previous(&self, rest: usize) -> Option<usize> {
        let (before, now) = (self.rests.get(rest.checked_sub(1)?)?, &self.rests[rest]);
        ((before.demo, before.track) == (now.demo, now.track)).then_some(rest - 1)
    }

    /// Returns whether an object rests elsewhere after a rest, or is seen no more.
    pub fn is_taken(&self, rest: usize) -> bool {
        let own = &self.rests[rest];
        let next = rest + 1;
        let again = next < self.rests.len() && self.previous(next) == Some(rest);
        again || self.last(own.demo).is_some_and(|last| own.last < last)
    }

    /// Returns the indices of the attempts of a demonstration.
    fn attempts_of(&self, demo: usize) -> Range<usize> {
        let first = self.attempts.partition_point(|a| a.demo < demo);
        first..first + self.attempts[first..].partition_point(|a| a.demo == demo)
    }

    /// Returns the rest of a track during these snapshots. If objects are missing for a moment, one that is not seen then
    /// lies where it was seen last, unless it vanished for longer than a moment.
    pub fn rest_during(
        &self,
        demo: usize,
        track: usize,
        (first, last): (usize, usize),
    ) -> Option<usize> {
        // What carried an object that is seen at a release alone comes to rest after it.
        let own = &self.attempts[self.attempts_of(demo)];
        let release = own.iter().find(|a| self.flickers && a.released == Some(last));
        let last = release.map_or(last, |release| release.after);
        let next = self.next(demo, track, first);
        let seen = next.filter(|rest| self.rests[*rest].first <= last);
        seen.or_else(|| {
            let before = self.latest(demo, track, first.checked_sub(1)?);
            let before = before.filter(|_| self.flickers)?;
            let until = self.rests[before].last.min(first - 1);
            if self.was_moved(demo, track, (until, last)) {
                return None;
            }
            let again = self.next(demo, track, last).is_some();
            let stays = self.landmarks.contains(&self.tracks[demo][track].kind);
            (again || stays || last - until <= MOMENT).then_some(before)
        })
    }

    /// Returns the vertical coordinate, if things were found all over a table. Where they stand in a row, a table seems to stand on its
    /// edge: the coordinate about which they are turned decides.
    pub fn up(&self) -> Option<usize> {
        let found = self.rests.iter().filter(|rest| rest.came == Came::Found);
        let flat = vertical(widths(found.map(|rest| rest.pose.position)))?;
        Some(self.turned_about().unwrap_or(flat))
    }

    /// Returns the coordinate about which the things of each kind that were found are turned against each other; `None` if they are not,
    /// or not all about one.
    fn turned_about(&self) -> Option<usize> {
        let mut first: BTreeMap<&str, Pose> = BTreeMap::new();
        let (mut about, mut turned) = ([0; 3], 0);
        for rest in self.rests.iter().filter(|rest| rest.came == Came::Found) {
            let turn =
                rotation_between(first.entry(self.kind(rest)).or_insert(rest.pose), &rest.pose);
            let angle = turn.iter().map(|v| v * v).sum::<f64>().sqrt();
            if angle >= TURNED_BY {
                turned += 1;
                (0..3).for_each(|i| about[i] += usize::from(turn[i].abs() > ABOUT * angle));
            }
        }
        (0..3).find(|i| turned >= TURNS && 10 * about[*i] >= 9 * turned)
    }

    /// Returns the variance of the pose of a rest in units of that of one look: it is the median of several.
    pub fn looks(&self, rest: &Rest) -> f64 {
        (std::f64::consts::FRAC_PI_2 / rest.seen as f64).min(1.0)
    }

    pub fn kind(&self, rest: &Rest) -> &str {
        &self.tracks[rest.demo][rest.track].kind
    }

    /// Returns whether a track's pose differs between two snapshots by more than noise.
    fn differs(&self, a: &Pose, b: &Pose) -> bool {
        a.distance(b) > self.least.0 || angle(a, b) > self.least.1
    }

    /// Cuts the life of an object into rests.
    fn rest(&mut self, d: usize, t: usize) {
        let length = self.demo(d).snapshots.len();
        let own: Vec<(usize, Attempt)> = (self.attempts_of(d).map(|a| (a, self.attempts[a])))
            .filter(|(_, a)| a.track == Some(t))
            .collect();
        let mut from = 0;
        let mut came = Came::Found;
        for (index, attempt) in own {
            self.segment(d, t, from, attempt.before, came);
            (from, came) = (attempt.after, Came::Placed(index));
        }
        if from < length {
            self.segment(d, t, from, length - 1, came);
        }
    }

    /// Finds the rests within a time in which no attempt moved the object.
    fn segment(&mut self, d: usize, t: usize, from: usize, to: usize, came: Came) {
        let demo = self.demo(d);
        let mut poses: Vec<(usize, Pose)> =
            (from..=to).filter_map(|s| Some((s, *self.tracks[d][t].pose(demo, s)?))).collect();
        if let (true, true, Came::Placed(attempt)) = (poses.is_empty(), self.flickers, came) {
            // It was seen last when the hand let go of it.
            let released = self.attempts[attempt].released;
            let pose = released.and_then(|s| self.tracks[d][t].pose(demo, s));
            poses.extend(pose.map(|pose| (from, *pose)));
        }
        let kept = self.without_outliers(d, &poses);
        self.outliers += poses.len() - kept.len();
        let mut came = came;
        let mut first = match (came, kept.first()) {
            (Came::Placed(attempt), Some((seen, pose))) => {
                self.lies_since(&self.attempts[attempt], t, (*seen, pose)).then_some(from)
            }
            _ => None,
        };
        for group in self.lying(kept) {
            self.finish(d, t, &group, (came, first));
            (came, first) = (Came::Carried, None);
        }
    }

    /// Cuts the poses of an object that no attempt moved where it was moved all the same. Two looks that differ by noise are
    /// no movement: the object lies after them as it lay before.
    fn lying(&self, poses: Vec<(usize, Pose)>) -> Vec<Vec<(usize, Pose)>> {
        let mut groups: Vec<Vec<(usize, Pose)>> = Vec::new();
        for (s, pose) in poses {
            match groups.last_mut().filter(|g| g.last().is_some_and(|l| !self.differs(&l.1, &pose)))
            {
                Some(group) => group.push((s, pose)),
                None => groups.push(vec![(s, pose)]),
            }
        }
        if groups.len() < 2 || !self.is_noisy() {
            return groups;
        }
        let middle = |group: &[(usize, Pose)]| {
            median(&group.iter().map(|(_, pose)| *pose).collect::<Vec<Pose>>())
        };
        let mut out: Vec<Vec<(usize, Pose)>> = Vec::new();
        for group in groups {
            match out.last_mut().filter(|last| !self.differs(&middle(last), &middle(&group))) {
                Some(last) => last.extend(group),
                None => out.push(group),
            }
        }
        out
    }

    /// Returns whether an object lay where it was first seen after an attempt ever since the attempt's end. It did if it is near
    /// the pose of its release, or if nothing else was handled meanwhile, which could have carried it.
    fn lies_since(&self, attempt: &Attempt, track: usize, (seen, pose): (usize, &Pose)) -> bool {
        let demo = self.demo(attempt.demo);
        let released =
            attempt.released.and_then(|s| self.tracks[attempt.demo][track].pose(demo, s));
        match released {
            Some(released) => released.distance(pose) < FALLEN_M + self.least.0,
            None => {
                let event = |s: &Snapshot| s.event == Some(SnapshotEvent::Contact);
                demo.snapshots[attempt.after.min(seen)..seen].iter().all(|s| !event(s))
            }
        }
    }

    /// Leaves out a single pose at either end that disagrees with two others, in noisy recordings. A pose stays if a hand
    /// moved something meanwhile that may have carried the object.
    fn without_outliers(&self, d: usize, poses: &[(usize, Pose)]) -> Vec<(usize, Pose)> {
        let mut kept = poses.to_vec();
        let handled = |from: usize, to: usize| {
            let own = &self.attempts[self.attempts_of(d)];
            let begun = own[..own.partition_point(|a| a.before < to)].iter().rev();
            begun.take_while(|a| from < a.after).any(|a| a.declared)
        };
        if self.noise.position_m > NOISY_M {
            let lone = |a: (usize, Pose), b: (usize, Pose), c: &Pose| {
                self.differs(&a.1, &b.1)
                    && !self.differs(&b.1, c)
                    && !handled(a.0.min(b.0), a.0.max(b.0))
            };
            if kept.len() >= 3 && lone(kept[0], kept[1], &kept[2].1) {
                kept.remove(0);
            }
            let n = kept.len();
            if n >= 3 && lone(kept[n - 1], kept[n - 2], &kept[n - 3].1) {
                kept.pop();
            }
        }
        kept
    }

    fn finish(
        &mut self,
        demo: usize,
        track: usize,
        group: &[(usize, Pose)],
        (came, since): (Came, Option<usize>),
    ) {
        let (Some((first, _)), Some((last, _))) = (group.first(), group.last()) else { return };
        let (first, last) = (since.unwrap_or(*first), *last);
        let poses: Vec<Pose> = group.iter().map(|(_, pose)| *pose).collect();
        let (pose, seen) = (median(&poses), poses.len());
        self.rests.push(Rest { demo, track, first, last, pose, seen, came });
    }
}
