//! The rests of a recording in the frames of objects: references, relative poses and containers.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::likelihood::{Spread, Sums};
use super::motion::{Came, Motion, Rest, widths};
use super::places::NUDGED;
use crate::robot::Pose;
use crate::task::domain::relative;

/// Smallest size of the scene in a coordinate, in metres.
pub(super) const SMALLEST_M: f64 = 0.05;
/// Further weight of the horizontal distance from a reference that moves, beyond that of two parts which touch.
const BESIDE: f64 = 2.0;
const PART_M: f64 = 0.04;
/// Distance up to which two places are the same, in metres.
const SAME_M: f64 = 5e-3;

/// A kind of a family, and its home, the fixed kind to which it goes.
pub(super) type Member = (usize, usize);

/// The frames of a recording. Frame 0 is the world, frame `k + 1` belongs to kind `k`.
#[derive(Clone)]
pub(super) struct Frames<'m, 'r> {
    pub motion: &'m Motion<'r>,
    /// The kinds, in alphabetical order.
    pub kinds: Vec<Arc<str>>,
    /// Whether an attempt or anything else ever moved an object of the kind.
    pub moves: Vec<bool>,
    /// Size of the scene.
    extent: [f64; 3],
    /// The vertical coordinate, if objects were found all over a table.
    pub up: Option<usize>,
    /// For each rest of an object that its container carried here, the rest before.
    pub carried_from: BTreeMap<usize, usize>,
    /// The inverse of `carried_from`.
    pub carried_to: BTreeMap<usize, usize>,
    /// The kinds that are no part of the task, although they move: another hand moved them.
    pub moved_by_others: Vec<usize>,
    /// Kinds that are looked at as one, if any: seen from each, its home changes places with that of the first.
    pub family: Vec<Member>,
}

impl<'m, 'r> Frames<'m, 'r> {
    pub fn new(motion: &'m Motion<'r>) -> Self {
        let mut names: BTreeMap<Arc<str>, BTreeSet<usize>> = BTreeMap::new();
        let mut handled: BTreeSet<Arc<str>> = BTreeSet::new();
        for track in motion.tracks.iter().flatten() {
            names.entry(track.kind.clone()).or_default();
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
        let scene = widths(motion.rests.iter().map(|rest| rest.pose.position));
        let extent = scene.map(|w| (1.1 * w).max(SMALLEST_M));
        let up = motion.up();
        let mut frames = Self {
            motion,
            kinds,
            moves,
            extent,
            up,
            carried_from: BTreeMap::new(),
            carried_to: BTreeMap::new(),
            moved_by_others: Vec::new(),
            family: Vec::new(),
        };
        frames.follow_containers();
        let others = (0..frames.kinds.len()).filter(|k| {
            frames.moves[*k]
                && !handled.contains(&frames.kinds[*k])
                && frames.is_moved_by_others(*k)
        });
        frames.moved_by_others = others.collect();
        for kind in &frames.moved_by_others {
            frames.moves[*kind] = false;
        }
        frames
    }

    /// Returns whether it was another hand that moved objects of a kind that no attempt handled. If they carried one another,
    /// or came to the same place in several demonstrations, while something else was handled, they are part of the task.
    fn is_moved_by_others(&self, kind: usize) -> bool {
        let motion = self.motion;
        let own = (0..motion.rests.len()).filter(|r| {
            let rest = &motion.rests[*r];
            rest.came == Came::Carried && motion.kind(rest) == &*self.kinds[kind]
        });
        let own: Vec<usize> = own.collect();
        if own.iter().any(|rest| self.follows_handled(*rest, self.kinds.len())) {
            return false;
        }
        let frames =
            (0..=self.kinds.len()).filter(|f| f.checked_sub(1).is_none_or(|k| !self.moves[k]));
        let frames: Vec<usize> = frames.collect();
        let near = motion.least.0.max(SAME_M);
        let again = |rest: usize| {
            let others = own.iter().filter(|o| motion.rests[**o].demo != motion.rests[rest].demo);
            let mut alike = others.flat_map(|other| frames.iter().map(|f| (*other, *f)));
            alike.any(|(other, frame)| {
                let (a, b) = (self.pose(rest, frame), self.pose(other, frame));
                a.zip(b).is_some_and(|(a, b)| a.distance(&b) <= near)
            })
        };
        let by_action = own.iter().filter(|r| !motion.moved_between_attempts(**r) && again(**r));
        2 * by_action.count() < own.len()
    }

    /// Returns whether something carried an object to a rest that was itself moved by an attempt, or carried so in turn.
    fn follows_handled(&self, rest: usize, depth: usize) -> bool {
        let Some(before) = self.carried_from.get(&rest).filter(|_| depth > 0) else { return false };
        (1..=self.kinds.len()).filter(|f| self.lies_alike(*before, rest, *f)).any(|frame| {
            let carrier = self.reference(rest, frame);
            let there = carrier.and_then(|(track, _)| self.rest_during(rest, track));
            there.is_some_and(|there| match self.motion.rests[there].came {
                Came::Placed(_) => true,
                Came::Carried => self.follows_handled(there, depth - 1),
                Came::Found => false,
            })
        })
    }

    /// Finds the rests of objects that lie as before in the frame of some other object, which carried them.
    fn follow_containers(&mut self) {
        loop {
            let known = self.carried_from.len();
            for (now, rest) in self.motion.rests.iter().enumerate() {
                let before = self.motion.previous(now).filter(|_| rest.came == Came::Carried);
                let before = before.filter(|_| !self.carried_from.contains_key(&now));
                let Some(before) = before else { continue };
                let carries = |f: &usize| {
                    !self.leaves(before, *f)
                        && self.lies_alike(before, now, *f)
                        && !self.goes_along(now, *f)
                };
                if (1..=self.kinds.len()).any(|f| carries(&f)) {
                    self.carried_from.insert(now, before);
                    self.carried_to.insert(before, now);
                }
            }
            if self.carried_from.len() == known {
                break;
            }
        }
    }

    /// Returns whether the reference of a rest in the frame of its own kind came there as the object did: of two that slide up in a
    /// queue, neither carries the other. What an attempt moved, or what something else carried, carries.
    fn goes_along(&self, now: usize, frame: usize) -> bool {
        let own_kind = self.motion.kind(&self.motion.rests[now]) == &*self.kinds[frame - 1];
        let track = self.reference(now, frame).map(|(track, _)| track);
        let there = track.and_then(|track| self.rest_during(now, track));
        own_kind
            && there.is_some_and(|there| {
                let came = self.motion.rests[there].came;
                came == Came::Carried && !self.carried_from.contains_key(&there)
            })
    }

    /// Returns the rest in which an object came into its container.
    pub fn origin(&self, rest: usize) -> usize {
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

    /// Returns whether the reference of a rest in a frame is moved while the rest lasts.
    pub fn leaves(&self, rest: usize, frame: usize) -> bool {
        let own = &self.motion.rests[rest];
        let Some((track, _)) = self.reference(rest, frame) else { return false };
        let end = self.motion.index_at(own.demo, track, own.last);
        end.is_some_and(|end| Some(end) != self.rest_during(rest, track))
    }

    /// Returns the first rest of another object during a rest. A container that carried the object comes to rest a
    /// little later.
    pub fn rest_during(&self, rest: usize, track: usize) -> Option<usize> {
        let own = &self.motion.rests[rest];
        self.motion.rest_during(own.demo, track, (own.first, own.last))
    }

    /// Returns the frame that stands for this one where kinds are looked at as one.
    fn own_frame(&self, rest: &Rest, frame: usize) -> usize {
        let own = |(kind, _): &&Member| &*self.kinds[*kind] == self.motion.kind(rest);
        let of = |member: Option<&Member>| member.map_or(frame, |(_, home)| home + 1);
        let (first, own) = (of(self.family.first()), of(self.family.iter().find(own)));
        match frame {
            _ if frame == first => own,
            _ if frame == own => first,
            _ => frame,
        }
    }

    /// Returns the nearest object of the frame's kind when a rest began, and the number of objects to choose from. One that is
    /// taken away while the rest lasts is left out if there are others: in a heap, what lies above.
    pub fn reference(&self, rest: usize, frame: usize) -> Option<(usize, usize)> {
        let own = &self.motion.rests[rest];
        let kind = self.kinds.get(self.own_frame(own, frame).checked_sub(1)?)?;
        let mut nearest: Option<(bool, f64, usize)> = None;
        let mut choices = [0, 0];
        let handled = |rest: &Rest| usize::from(matches!(rest.came, Came::Placed(_)));
        for (t, track) in self.motion.tracks[own.demo].iter().enumerate() {
            if track.kind != *kind || t == own.track {
                continue;
            }
            let Some(index) = self.rest_during(rest, t) else { continue };
            let there = &self.motion.rests[index];
            choices[handled(there)] += 1;
            let far = there.pose.distance(&own.pose);
            // Asked of few candidates only: it is a search.
            let taken = || {
                let end = self.motion.index_at(own.demo, t, own.last);
                end.is_some_and(|end| end != index)
            };
            let is_better = nearest.is_none_or(|(was_taken, least, _)| match far < least {
                true => was_taken || !taken(),
                false => was_taken && !taken(),
            });
            if is_better {
                nearest = Some((taken(), far, t));
            }
        }
        // What was put somewhere is not mistaken for what lies about.
        let (.., track) = nearest?;
        let there = &self.motion.rests[self.rest_during(rest, track)?];
        Some((track, choices[handled(there)]))
    }

    /// Returns the pose of a rest in a frame; `None` without a reference.
    pub fn pose(&self, rest: usize, frame: usize) -> Option<Pose> {
        let own = &self.motion.rests[rest];
        if frame == 0 {
            return Some(own.pose);
        }
        let (track, _) = self.reference(rest, frame)?;
        let there = &self.motion.rests[self.rest_during(rest, track)?];
        Some(relative(&there.pose, &own.pose))
    }

    /// Returns whether something came along with an object that was put somewhere, such as the hand that carried it, and was not
    /// only nudged. The object was not put onto that.
    fn came_along(&self, rest: usize, other: usize) -> bool {
        let (motion, own) = (self.motion, &self.motion.rests[rest]);
        let (Came::Placed(attempt), Came::Carried) = (own.came, motion.rests[other].came) else {
            return false;
        };
        let since = motion.attempts[attempt].before;
        // What was not seen when the attempt began may have moved before.
        let moved = |rest: usize| {
            let before = &motion.rests[motion.previous(rest)?];
            (before.last >= since).then(|| before.pose.distance(&motion.rests[rest].pose))
        };
        motion.rests[other].first > since
            && motion.rests[other].first <= own.first
            && moved(other).zip(moved(rest)).is_some_and(|(other, own)| other > NUDGED * own)
    }

    /// Returns whether another object lay relative to one that was put somewhere as it lay before.
    fn rode_along(&self, rest: usize, other: usize) -> bool {
        let motion = self.motion;
        let seen =
            |at: usize, other: usize| relative(&motion.rests[at].pose, &motion.rests[other].pose);
        let before = motion.previous(rest).zip(motion.previous(other));
        before.is_some_and(|(before, there)| {
            let (was, is) = (seen(before, there), seen(rest, other));
            was.distance(&is) <= motion.least.0
                && was.rotation().angle_to(&is.rotation()) <= motion.least.1
        })
    }

    /// Returns whether an object, when an attempt moved it next, took another one along that lay on it.
    fn takes_along(&self, rest: usize, other: usize) -> bool {
        let motion = self.motion;
        let height = |rest: usize, up: usize| motion.rests[rest].pose.position[up];
        if self.up.is_some_and(|up| height(other, up) < height(rest, up)) {
            return false;
        }
        let next = |rest: usize| (rest + 1 < motion.rests.len()).then_some(rest + 1);
        let next = |rest: usize| next(rest).filter(|next| motion.previous(*next) == Some(rest));
        next(rest).zip(next(other)).is_some_and(|(own, there)| {
            let came = [own, there].map(|rest| motion.rests[rest].came);
            matches!(came, [Came::Placed(_), Came::Carried]) && self.rode_along(own, there)
        })
    }

    /// Returns whether another object that moves is clearly nearer to a rest than `far`.
    fn is_crowded(&self, rest: usize, far: f64) -> bool {
        let own = &self.motion.rests[rest];
        let tracks = self.motion.tracks[own.demo].iter().enumerate();
        tracks.filter(|(t, _)| *t != own.track).any(|(t, track)| {
            let moves = self.kinds.iter().zip(&self.moves).any(|(k, m)| *k == track.kind && *m);
            moves
                && self
                    .rest_during(rest, t)
                    .is_some_and(|r| self.motion.rests[r].pose.distance(&own.pose) < 0.8 * far)
        })
    }

    /// Returns the size of the scene along the axes of a frame: the mean width of the scene's box along the axes of the
    /// references, which may be turned.
    pub fn extent_in(&self, frame: usize) -> [f64; 3] {
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

    pub fn sums(&self, rest: usize, frame: usize) -> Option<Sums> {
        let own = &self.motion.rests[rest];
        let mut choices = 1;
        let (mut far, mut crowded) = (0.0, 0.0);
        let noise = &self.motion.noise;
        // In units of the variance of one look.
        let mut seen = self.motion.looks(own);
        if frame > 0 {
            let (track, of) = self.reference(rest, frame)?;
            choices = of;
            if self.leaves(rest, frame) {
                return None;
            }
            let begin = self.rest_during(rest, track)?;
            // What carries the object later on is no hand, unless it lay on the object all along: a lid.
            let carries = |next: &usize| self.lies_alike(rest, *next, frame);
            let later = self.carried_to.get(&rest).is_some_and(carries);
            if (!later || self.rode_along(rest, begin)) && self.came_along(rest, begin) {
                return None;
            }
            // Nor was it found on what lies on it: the hanger that goes up with its shirt.
            if own.came == Came::Found && self.takes_along(rest, begin) {
                return None;
            }
            let there = &self.motion.rests[begin].pose;
            far = there.distance(&own.pose);
            // Not the error by the angle of the reference, which grows with distance: it would speak for what is far.
            seen += self.motion.looks(&self.motion.rests[begin]);
            crowded = f64::from(self.is_crowded(rest, far));
            // What was put beside something that moves belongs to it less than what was put onto it.
            if let Some(up) = self.up.filter(|_| self.moves[frame - 1]) {
                let high = (own.pose.position[up] - there.position[up]).abs();
                let aside = (far * far - high * high).max(0.0).sqrt();
                far = high.hypot(aside + BESIDE * (aside - PART_M).max(0.0));
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
            position: pose.position.map(Spread::of),
            turn: *turn.matrix(),
            choices: (choices as f64).ln(),
            far,
            crowded,
            // What was found and left may lie about, or be where the others were put.
            found: f64::from(own.came == Came::Found && self.motion.is_taken(rest)),
            put: f64::from(own.came != Came::Found),
            noise: seen * noise.position_m.powi(2),
            noise_rad: seen * noise.angle_rad.powi(2),
            explained_rad: 0.0,
        })
    }
}
