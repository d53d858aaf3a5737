//! The moments of a recording: poses at the start, at each contact and release, and at the end.

use std::collections::HashMap;
use std::sync::Arc;

use super::carry::{Carries, Carry, carries, ridden};
use super::finish::{Log, Session, median};
use super::mapping::Mapping;
use super::motion::{between, middle};
use super::streams::{Dropped, Guess, Part, Sample, Track};
use crate::robot::Pose;
use crate::robot::pose::mean_orientation;
use crate::task::recording::{Demonstration, ObjectPose, Recording, Snapshot, SnapshotEvent};

/// A contact or release that was found, with its evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Index of the session, which is the number of the demonstration.
    pub session: usize,
    /// Index of the part in its session.
    pub part: usize,
    /// Contact or release.
    pub event: SnapshotEvent,
    /// Time in the log, in seconds.
    pub t: f64,
    /// Id of the object.
    pub object: Arc<str>,
    /// Position of the object in the snapshot, in metres.
    pub position: [f64; 3],
    /// Ids of the objects that moved with it.
    pub with: Vec<Arc<str>>,
    /// Where the event is seen, in words.
    pub evidence: String,
    /// Number of samples behind the object's pose; 0 if it follows from the hand's motion or from another time.
    pub samples: usize,
}

/// What was seen of one object in a session.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Index of the session.
    pub session: usize,
    /// Id of the object.
    pub id: Arc<str>,
    /// Kind of the object.
    pub kind: Arc<str>,
    /// Number of samples.
    pub samples: usize,
    /// Samples a second.
    pub rate_hz: f64,
    /// Standard deviation of a coordinate at rest, in metres; `None` if it is seen too rarely.
    pub noise_m: Option<f64>,
    /// Number of carries.
    pub carried: usize,
}

/// A recording made from a log, with everything that led to it.
#[derive(Debug, Clone)]
pub struct Imported {
    /// The recording. Each session is a demonstration.
    pub recording: Recording,
    /// The contacts and releases.
    pub moments: Vec<Moment>,
    /// The objects of each session.
    pub seen: Vec<Seen>,
    /// The streams.
    pub sessions: Vec<Session>,
    /// What was guessed.
    pub guesses: Vec<Guess>,
    /// What was left out.
    pub dropped: Vec<Dropped>,
    /// Columns that were not used, by file.
    pub unused: Vec<(String, Vec<String>)>,
    /// The mapping with what was guessed for all files.
    pub mapping: Mapping,
    /// Number of rows that were read.
    pub rows: u64,
}

/// Number of samples from which a pose is averaged.
const MOST_SAMPLES: usize = 1000;

/// Share of the distance of a carry within which the object may settle after its release.
const SETTLED: f64 = 0.3;

/// A pose with the number of samples behind it.
type Found = (Pose, usize);

/// The time of which a snapshot tells, in seconds: it ends half-way to the snapshots before and after.
type Look = (f64, f64);
const WHOLE: Look = (f64::NEG_INFINITY, f64::INFINITY);

/// Least number of samples of a snapshot, if the rest has as many: those nearest to its time.
const LEAST_SAMPLES: usize = 16;

/// Time beside a motion in which an object may still move, in seconds.
const UNSURE_S: f64 = 0.1;

impl Log {
    /// Finds contacts and releases and takes a snapshot of all objects at each.
    ///
    /// An object that rests has a robust mean of its samples about the time of the snapshot, half-way to those before and
    /// after, or of all its samples until it moves again where these are few. An object that is not seen after its release
    /// has moved with the hand since it was last seen. What is not seen otherwise keeps its last pose.
    ///
    /// Costs a window of 0.2 s, of which at most 200 samples count, for each sample; about 0.1 ms for each motion; and,
    /// for each contact and release, up to 1,000 samples of each object.
    pub fn import(self) -> Imported {
        let Self { sessions, guesses, mut dropped, unused, mapping, rows } = self;
        let (mut moments, mut seen, mut demos) = (Vec::new(), Vec::new(), Vec::new());
        for (number, (session, found)) in sessions.iter().zip(carries(&sessions)).enumerate() {
            for what in found.iter().flat_map(|found| &found.dropped) {
                dropped.push(Dropped { what: format!("{}, {what}", session.name), count: 1 });
            }
            let mut taker = Taker {
                session,
                number,
                found: &found,
                known: Vec::new(),
                index: HashMap::new(),
                moments: &mut moments,
                offset: 0.0,
            };
            let snapshots = taker.take();
            seen.extend(taker.seen());
            demos.push(Demonstration { number: number as u64, snapshots });
        }
        let recording = Recording { demos };
        Imported { recording, moments, seen, sessions, guesses, dropped, unused, mapping, rows }
    }
}

/// An object of a session with its last pose.
struct Known {
    id: Arc<str>,
    kind: Arc<str>,
    pose: Option<Pose>,
}

struct Taker<'a> {
    session: &'a Session,
    number: usize,
    found: &'a [Carries],
    known: Vec<Known>,
    /// Indices of the known objects, by id.
    index: HashMap<Arc<str>, usize>,
    moments: &'a mut Vec<Moment>,
    /// What is added to times so that parts follow each other.
    offset: f64,
}

impl Taker<'_> {
    fn take(&mut self) -> Vec<Snapshot> {
        for track in self.session.parts.iter().flat_map(|part| &part.tracks) {
            if !track.samples.is_empty() && !self.index.contains_key(&track.id) {
                self.index.insert(track.id.clone(), self.known.len());
                let (id, kind) = (track.id.clone(), track.kind.clone());
                self.known.push(Known { id, kind, pose: None });
            }
        }
        // What is first seen later was there before.
        for known in &mut self.known {
            let parts = self.session.parts.iter().zip(self.found);
            known.pose = parts
                .filter_map(|(part, found)| {
                    let index = part.tracks.iter().position(|track| track.id == known.id)?;
                    let first = part.tracks[index].samples.first()?.t;
                    Some(resting(part, found, index, first, WHOLE)?.0)
                })
                .next();
        }
        let mut snapshots = Vec::new();
        let last_part = self.session.parts.len().saturating_sub(1);
        let mut end = f64::NEG_INFINITY;
        for (index, (part, found)) in self.session.parts.iter().zip(self.found).enumerate() {
            let Some((first, last)) = part.span() else { continue };
            self.offset = if first + self.offset < end { end - first } else { self.offset };
            let mut events: Vec<(f64, SnapshotEvent, Option<&Carry>)> = Vec::new();
            if index == 0 {
                events.push((first, SnapshotEvent::Start, None));
            }
            for carry in &found.carries {
                events.push((carry.from, SnapshotEvent::Contact, Some(carry)));
                events.push((carry.to, SnapshotEvent::Release, Some(carry)));
            }
            if index == last_part {
                events.push((last, SnapshotEvent::End, None));
            }
            events.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (at, &(t, event, carry)) in events.iter().enumerate() {
                let half = |other: &(f64, SnapshotEvent, Option<&Carry>)| (other.0 + t) / 2.0;
                let before = at.checked_sub(1).map_or(f64::NEG_INFINITY, |at| half(&events[at]));
                let look = (before, events.get(at + 1).map_or(f64::INFINITY, half));
                let number = snapshots.len();
                snapshots.push(self.snapshot(index, (t, look), event, carry, number));
                let Some(carry) = carry else { continue };
                let id = part.tracks[carry.object].id.clone();
                let with = carry.riders.iter().map(|i| part.tracks[*i].id.clone()).collect();
                let own = match event {
                    SnapshotEvent::Release => self.settled(index, carry.object, carry, WHOLE),
                    _ => own_pose(part, found, carry.object, carry, WHOLE),
                };
                // An object that is first seen later was there before.
                let known = self.index.get(&id).and_then(|known| self.known[*known].pose);
                self.moments.push(Moment {
                    session: self.number,
                    part: index,
                    event,
                    t,
                    object: id,
                    with,
                    position: own
                        .map(|(pose, _)| pose)
                        .or(known)
                        .map_or([0.0; 3], |pose| pose.position),
                    evidence: carry.evidence.clone(),
                    samples: own.map_or(0, |(_, count)| count),
                });
            }
            end = last + self.offset;
        }
        snapshots
    }

    fn snapshot(
        &mut self,
        number_of: usize,
        (t, look): (f64, Look),
        event: SnapshotEvent,
        carry: Option<&Carry>,
        number: usize,
    ) -> Snapshot {
        let (part, found) = (&self.session.parts[number_of], &self.found[number_of]);
        for (index, track) in part.tracks.iter().enumerate() {
            let moved = |carry: &&Carry| carry.object == index || carry.riders.contains(&index);
            let pose = match carry.filter(moved) {
                Some(carry) if event == SnapshotEvent::Release => {
                    self.settled(number_of, index, carry, look)
                }
                Some(carry) => own_pose(part, found, index, carry, look),
                _ => resting(part, found, index, t, look),
            };
            if let (Some(known), Some((pose, _))) = (self.index.get(&track.id), pose) {
                self.known[*known].pose = Some(pose);
            }
        }
        let pose = |known: &Known| {
            Some(ObjectPose { id: known.id.clone(), kind: known.kind.clone(), pose: known.pose? })
        };
        let objects: Vec<ObjectPose> = self.known.iter().filter_map(pose).collect();
        let touched = carry.map(|carry| &part.tracks[carry.object].id);
        let object = touched.and_then(|id| objects.iter().position(|o| o.id == *id));
        Snapshot {
            number: number as u64,
            time_s: Some(t + self.offset),
            event: Some(event),
            object,
            objects,
        }
    }

    /// The pose of an object after a carry in which it moved. If it was not seen again in its part, the next part tells
    /// where it came to rest, unless somebody has moved it since.
    fn settled(&self, index: usize, object: usize, carry: &Carry, look: Look) -> Option<Found> {
        let part = &self.session.parts[index];
        let (pose, count) = after(part, &self.found[index], object, carry, look)?;
        if count > 0 {
            return Some((pose, count));
        }
        let before = part.tracks[object].samples
            [..part.tracks[object].samples.partition_point(|s| s.t <= carry.from)]
            .last();
        let moved = before.map_or(0.0, |s| Pose::at(s.position).distance(&pose));
        let next = (self.session.parts.iter().zip(self.found).skip(index + 1)).find_map(
            |(part, found)| {
                let own = part
                    .tracks
                    .iter()
                    .position(|track| track.id == self.session.parts[index].tracks[object].id)?;
                resting(part, found, own, part.tracks[own].samples.first()?.t, WHOLE)
            },
        );
        let near = |(next, _): &Found| next.distance(&pose) < SETTLED * moved;
        Some(next.filter(near).unwrap_or((pose, 0)))
    }

    fn seen(&self) -> Vec<Seen> {
        let of = |known: &Known| {
            let parts = self.session.parts.iter().zip(self.found);
            let own = parts.filter_map(|(part, found)| {
                let index = part.tracks.iter().position(|track| track.id == known.id)?;
                let carried = found.carries.iter().filter(|carry| carry.object == index).count();
                Some((part.tracks[index].samples.len(), &found.motions[index], carried))
            });
            let own: Vec<_> = own.collect();
            let mut steps: Vec<f64> =
                own.iter().map(|(_, m, _)| m.step).filter(|s| s.is_finite()).collect();
            let noise =
                own.iter().filter(|(_, m, _)| !m.sparse).map(|(_, m, _)| m.noise).reduce(f64::max);
            Seen {
                session: self.number,
                id: known.id.clone(),
                kind: known.kind.clone(),
                samples: own.iter().map(|(count, _, _)| count).sum(),
                rate_hz: median(&mut steps).map_or(0.0, |step| 1.0 / step),
                noise_m: noise,
                carried: own.iter().map(|(_, _, carried)| carried).sum(),
            }
        };
        self.known.iter().map(of).collect()
    }
}

/// The pose of an object before a carry in which it moved.
fn own_pose(
    part: &Part,
    found: &Carries,
    object: usize,
    carry: &Carry,
    look: Look,
) -> Option<Found> {
    let rest = rest_around(found, object, carry.from, false);
    glance(&part.tracks[object], found.motions[object].sparse, rest, look)
}

/// The pose of an object after a carry in which it moved.
fn after(part: &Part, found: &Carries, object: usize, carry: &Carry, look: Look) -> Option<Found> {
    let track = &part.tracks[object];
    let sparse = found.motions[object].sparse;
    let rest = rest_around(found, object, carry.to, true);
    if let Some(found) = glance(track, sparse, rest, look) {
        return Some(found);
    }
    // It was not seen any more: it moved with the hand since it was last seen.
    let last = track.samples[..track.samples.partition_point(|s| s.t <= carry.to)].last()?;
    let pose = pose(last, [0.0, 0.0, 0.0, 1.0]);
    let ridden = part
        .hand
        .as_ref()
        .filter(|_| last.t >= carry.from)
        .and_then(|hand| ridden(hand, &pose, last.t, carry.to));
    Some((ridden.unwrap_or(pose), 0))
}

/// The pose of an object at a time at which no event is its own.
fn resting(part: &Part, found: &Carries, object: usize, t: f64, look: Look) -> Option<Found> {
    let (from, to) = rest_around(found, object, t, true);
    let track = &part.tracks[object];
    let sparse = found.motions[object].sparse;
    let inside = (from..=to).contains(&t);
    match inside {
        true => glance(track, sparse, (from, to), look),
        // It moves at this time.
        false => {
            let step = found.motions[object].step.min(1.0);
            estimate(track, sparse, t - 2.0 * step, t + 2.0 * step)
        }
    }
}

/// The stretch of rest of an object that contains `t`, or that begins (`later`) or ends at about `t`.
fn rest_around(found: &Carries, object: usize, t: f64, later: bool) -> (f64, f64) {
    let carried = found.carries.iter().filter(|c| c.object == object || c.riders.contains(&object));
    let mut busy: Vec<(f64, f64)> = carried.map(|c| (c.from, c.to)).collect();
    // A motion that has to do with a carry widens it: settling, or a lift before the gripper is sure.
    for own in &found.motions[object].moves {
        match busy.iter_mut().find(|(from, to)| own.from < *to && own.to > *from) {
            Some((from, to)) => (*from, *to) = (from.min(own.from), to.max(own.to)),
            None if own.shifted => busy.push((own.from, own.to)),
            None => {}
        }
    }
    busy.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
    for (begin, end) in busy {
        let middle = (begin + end) / 2.0;
        let before = if later {
            end <= t || (begin..=end).contains(&t) && t >= middle
        } else {
            end < t && middle < t
        };
        if before {
            from = from.max(end);
        } else if begin >= t || middle > t || !later {
            to = to.min(begin);
        }
    }
    (from, to)
}

fn pose(sample: &Sample, otherwise: [f64; 4]) -> Pose {
    let orientation = if sample.oriented() { sample.orientation } else { otherwise };
    Pose { position: sample.position, orientation }
}

/// Returns the pose of an object that rests from `from` to `to`, as it was seen in the time of a snapshot. Snapshots share few
/// samples, so that their poses show how sure they are.
fn glance(track: &Track, sparse: bool, (from, to): (f64, f64), look: Look) -> Option<Found> {
    let rest = between(&track.samples, from + UNSURE_S, to - UNSURE_S);
    if sparse || rest.is_empty() {
        return estimate(track, sparse, from, to);
    }
    let (begin, end) =
        (rest.partition_point(|s| s.t < look.0), rest.partition_point(|s| s.t <= look.1));
    let (middle, half) = ((begin + end) / 2, LEAST_SAMPLES / 2);
    let (begin, end) = (begin.min(middle.saturating_sub(half)), end.max(middle + half));
    let begin = begin.min(rest.len().saturating_sub(LEAST_SAMPLES));
    let end = end.max(begin + LEAST_SAMPLES).min(rest.len());
    estimate(track, false, rest[begin].t, rest[end - 1].t)
}

/// Returns a robust mean of an object's poses in a stretch of rest.
fn estimate(track: &Track, sparse: bool, from: f64, to: f64) -> Option<Found> {
    let all = between(&track.samples, from, to);
    // Of two looks the later counts: it is taken from where the work is.
    let begin = if sparse && all.len() < 3 { all.len().saturating_sub(1) } else { 0 };
    let inside: Vec<Sample> =
        all[begin..].iter().step_by(all.len() / MOST_SAMPLES + 1).copied().collect();
    let inside = &*inside;
    let center = middle(inside)?;
    let off = |s: &Sample| {
        s.position.iter().zip(center).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    let mut spread: Vec<f64> = inside.iter().map(off).collect();
    let limit = 3.0 * median(&mut spread)?;
    let kept: Vec<&Sample> = inside.iter().filter(|s| off(s) <= limit.max(1e-9)).collect();
    let count = kept.len().max(1) as f64;
    let mean = [0, 1, 2].map(|axis| kept.iter().map(|s| s.position[axis]).sum::<f64>() / count);
    let position = if sparse { center } else { mean };
    let turns: Vec<[f64; 4]> =
        kept.iter().filter(|s| s.oriented()).map(|s| s.orientation).collect();
    let rough = mean_orientation(&turns);
    let alike =
        |q: &[f64; 4], mean: &[f64; 4]| q.iter().zip(mean).map(|(a, b)| a * b).sum::<f64>().abs();
    let turns = rough.map(|mean| {
        let mut likeness: Vec<f64> = turns.iter().map(|q| 1.0 - alike(q, &mean)).collect();
        let limit = median(&mut likeness).unwrap_or(0.0) * 9.0 + 1e-12;
        turns.iter().filter(|q| 1.0 - alike(q, &mean) <= limit).copied().collect::<Vec<_>>()
    });
    let orientation = turns.and_then(|turns| mean_orientation(&turns)).or(rough);
    Some((Pose { position, orientation: orientation.unwrap_or([0.0, 0.0, 0.0, 1.0]) }, kept.len()))
}
