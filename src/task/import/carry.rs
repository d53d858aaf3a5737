//! Which object was carried in each hold, and what moved with it.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::finish::{Session, median};
use super::motion::{Motion, Move, between, middle, motion};
use super::signals::{Hold, holds};
use super::streams::{Part, Sample, Track};
use crate::robot::Pose;
use crate::robot::pose::quaternion_array;

/// An object that was carried.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Carry {
    pub from: f64,
    pub to: f64,
    /// Index of the object's track.
    pub object: usize,
    /// Tracks that moved with it.
    pub riders: Vec<usize>,
    pub evidence: String,
}

/// The carries of a part, with the motion of each object and what was left out.
#[derive(Debug, Default)]
pub(super) struct Carries {
    pub carries: Vec<Carry>,
    pub motions: Vec<Motion>,
    pub dropped: Vec<String>,
}

/// Distance from which an object that is seen now and then has moved, in metres.
const MOVED: f64 = 0.02;

/// Returns the hand's pose at a time, between the samples beside it.
pub(super) fn hand_at(hand: &Track, t: f64) -> Option<(Vector3<f64>, UnitQuaternion<f64>)> {
    let samples = &hand.samples;
    let next = samples.partition_point(|s| s.t < t);
    let (a, b) = match (next.checked_sub(1).map(|i| &samples[i]), samples.get(next)) {
        (Some(a), Some(b)) => (a, b),
        (Some(only), None) | (None, Some(only)) => (only, only),
        (None, None) => return None,
    };
    let share = if b.t > a.t { ((t - a.t) / (b.t - a.t)).clamp(0.0, 1.0) } else { 0.0 };
    let position = Vector3::from(a.position).lerp(&Vector3::from(b.position), share);
    let turn = match (a.oriented(), b.oriented()) {
        (true, true) => rotation(a).try_slerp(&rotation(b), share, 1e-9).unwrap_or(rotation(a)),
        _ => UnitQuaternion::identity(),
    };
    Some((position, turn))
}

fn rotation(sample: &Sample) -> UnitQuaternion<f64> {
    let [x, y, z, w] = sample.orientation;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

/// Returns the pose that an object has at `to` if it moves with the hand from its pose at `from`.
pub(super) fn ridden(hand: &Track, pose: &Pose, from: f64, to: f64) -> Option<Pose> {
    let (place, turn) = hand_at(hand, from)?;
    let (new_place, new_turn) = hand_at(hand, to)?;
    let change = new_turn * turn.inverse();
    let position = new_place + change * (Vector3::from(pose.position) - place);
    let orientation = quaternion_array(&(change * pose.rotation()));
    Some(Pose { position: position.into(), orientation })
}

/// How well an object moved with the hand in a hold.
struct Ride {
    object: usize,
    /// Median deviation from a pose fixed to the hand, in metres; 0 without a hand.
    off: f64,
    /// Distance from the hand, in metres; 0 without a hand.
    far: f64,
    /// Distance that the object moved, in metres.
    moved: f64,
    height: f64,
    /// The object's position in the hand's frame.
    grip: Option<Vector3<f64>>,
}

/// Where the hand held objects of each kind when nothing else moved with them: positions in the hand's frame.
pub(super) type Grips = BTreeMap<Arc<str>, Vec<Vector3<f64>>>;

/// Finds the carries of the parts of all sessions.
pub(super) fn carries(sessions: &[Session]) -> Vec<Vec<Carries>> {
    let motions: Vec<Vec<Vec<Motion>>> = (sessions.iter())
        .map(|session| {
            session.parts.iter().map(|part| part.tracks.iter().map(motion).collect()).collect()
        })
        .collect();
    let mut grips = Grips::new();
    // The second time it is known where each kind is held.
    let mut all = Vec::new();
    for last in [false, true] {
        let mut new = Grips::new();
        all = sessions
            .iter()
            .zip(&motions)
            .map(|(session, motions)| {
                let parts = session.parts.iter().zip(motions);
                parts
                    .map(|(part, motions)| of_part(part, motions.clone(), &grips, &mut new))
                    .collect()
            })
            .collect();
        if last || new.is_empty() {
            break;
        }
        grips = new;
    }
    all
}

fn of_part(part: &Part, motions: Vec<Motion>, grips: &Grips, new: &mut Grips) -> Carries {
    let mut found = Carries { motions, ..Carries::default() };
    let holds = holds(part);
    holds.iter().flatten().for_each(|hold| held(part, hold, &mut found, grips, new));
    if found.carries.is_empty() {
        moved(part, &mut found, grips, new);
        if holds.is_some() && !found.carries.is_empty() {
            let what =
                "the gripper's signals, with which no object moved; motion alone tells the carries";
            found.dropped.push(what.into());
        }
    }
    found.carries.sort_by(|a, b| a.from.total_cmp(&b.from));
    found
}

/// Notes where the hand holds an object that moves alone.
fn note(part: &Part, rides: &[Ride], new: &mut Grips) {
    if let [alone] = rides
        && let Some(grip) = alone.grip
    {
        new.entry(part.tracks[alone.object].kind.clone()).or_default().push(grip);
    }
}

/// Adds the carry of a hold that the gripper's signals give.
fn held(part: &Part, hold: &Hold, found: &mut Carries, grips: &Grips, new: &mut Grips) {
    let own = |id: &String| part.tracks.iter().position(|track| *track.id == **id);
    let named = hold.object.as_ref().and_then(own);
    let mut rides: Vec<Ride> = (0..part.tracks.len())
        .filter_map(|object| ride(part, found, object, hold.from, hold.to))
        .collect();
    let mut evidence = hold.evidence.clone();
    note(part, &rides, new);
    let object = match named.or_else(|| best(part, &rides, grips)) {
        Some(object) => object,
        None => {
            let what = format!(
                "{:.2} to {:.2} s: {}, and no object moved",
                hold.from, hold.to, hold.evidence
            );
            found.dropped.push(what);
            return;
        }
    };
    if let Some(ride) = rides.iter().find(|ride| ride.object == object) {
        evidence.push_str(&in_words(ride, part.hand.is_some()));
    }
    rides.retain(|ride| ride.object != object);
    let riders = rides.iter().map(|ride| ride.object).collect();
    found.carries.push(Carry { from: hold.from, to: hold.to, object, riders, evidence });
}

fn in_words(ride: &Ride, hand: bool) -> String {
    let moved = ride.moved * 1e3;
    match hand {
        true => format!("; moved {moved:.0} mm with the hand, off by {:.1} mm", ride.off * 1e3),
        false => format!("; moved {moved:.0} mm"),
    }
}

/// Returns how an object moved in a stretch; `None` if it did not move, or not with the hand.
fn ride(part: &Part, found: &Carries, object: usize, from: f64, to: f64) -> Option<Ride> {
    let (track, motion) = (&part.tracks[object], &found.motions[object]);
    let inside = between(&track.samples, from, to);
    let stepped: Vec<&Sample> = inside.iter().step_by((inside.len() / 60).max(1)).collect();
    if !motion.sparse {
        let common =
            |m: &&Move| m.to.min(to) - m.from.max(from) > 0.5 * (m.to - m.from).min(to - from);
        let moved = motion.moves.iter().filter(common).map(|m| m.distance).fold(0.0, f64::max);
        if moved < 2.0 * motion.limit {
            return None;
        }
        let height = inside.first()?.position[2];
        let Some(hand) = &part.hand else {
            return Some(Ride { object, off: 0.0, far: 0.0, moved, height, grip: None });
        };
        let relative: Vec<Sample> = (stepped.iter())
            .filter_map(|s| {
                let (place, turn) = hand_at(hand, s.t)?;
                let position = turn.inverse() * (Vector3::from(s.position) - place);
                Some(Sample { position: position.into(), ..**s })
            })
            .collect();
        let deviation = |samples: &[Sample]| {
            let place = Vector3::from(middle(samples)?);
            let mut off: Vec<f64> =
                samples.iter().map(|s| (Vector3::from(s.position) - place).norm()).collect();
            median(&mut off)
        };
        let own: Vec<Sample> = stepped.iter().map(|s| **s).collect();
        let (off, world) = (deviation(&relative)?, deviation(&own)?);
        let grip = Vector3::from(middle(&relative)?);
        let ride = Ride { object, off, far: grip.norm(), moved, height, grip: Some(grip) };
        return (off < 0.5 * world.max(moved / 4.0)).then_some(ride);
    }
    // Seen now and then: compare the last look before with those during the hold.
    let before = track.samples[..track.samples.partition_point(|s| s.t <= from)].last()?;
    let place = Vector3::from(before.position);
    let pose = Pose::at(before.position);
    let count = stepped.len().max(1) as f64;
    let moved =
        stepped.iter().map(|s| (Vector3::from(s.position) - place).norm()).sum::<f64>() / count;
    if moved < MOVED {
        return None;
    }
    let height = before.position[2];
    let Some(hand) = &part.hand else {
        return Some(Ride { object, off: 0.0, far: 0.0, moved, height, grip: None });
    };
    let (grip, _) = hand_at(hand, from)?;
    let off = (stepped.iter())
        .filter_map(|s| {
            Some(
                (Vector3::from(s.position)
                    - Vector3::from(ridden(hand, &pose, from, s.t)?.position))
                .norm(),
            )
        })
        .sum::<f64>()
        / count;
    let ride = Ride { object, off, far: (place - grip).norm(), moved, height, grip: None };
    (off < 0.5 * moved).then_some(ride)
}

/// A rest that is too short to let go and grasp again, in seconds.
const SHORT_S: f64 = 0.6;

/// Least time of a carry that only motion shows, in seconds.
const LEAST_S: f64 = 0.15;

/// Distance within which a grip is one that was seen before, in metres.
const SAME_GRIP: f64 = 0.03;

/// Returns the object that was held itself. Of those that kept to the hand about as well as any, it is the one whose
/// kind was held in this way before, or else the nearest to the hand. Without a hand, of those that moved about as far
/// as any, it is the lowest: what stands on it or lies in it moves with it.
fn best(part: &Part, rides: &[Ride], grips: &Grips) -> Option<usize> {
    let least = rides.iter().map(|ride| ride.off).fold(f64::INFINITY, f64::min);
    let most = rides.iter().map(|ride| ride.moved).fold(0.0, f64::max);
    let close =
        rides.iter().filter(|ride| ride.off <= 1.5 * least + 2e-3 && ride.moved >= 0.6 * most);
    let close: Vec<&Ride> = close.collect();
    let known = |ride: &Ride| {
        let own = grips.get(&part.tracks[ride.object].kind)?;
        let distance = own
            .iter()
            .filter_map(|grip| Some((ride.grip? - grip).norm()))
            .fold(f64::INFINITY, f64::min);
        (distance < SAME_GRIP).then_some(distance)
    };
    let seen = close.iter().filter_map(|ride| Some((known(ride)?, ride.object)));
    if let Some((_, object)) = seen.min_by(|a, b| a.0.total_cmp(&b.0)) {
        return Some(object);
    }
    let nearest =
        close.iter().min_by(|a, b| a.far.total_cmp(&b.far).then(a.height.total_cmp(&b.height)));
    nearest.map(|ride| ride.object)
}

/// Adds the carries that the motion of the objects alone shows.
fn moved(part: &Part, found: &mut Carries, grips: &Grips, new: &mut Grips) {
    let mut all: Vec<(usize, Move)> = Vec::new();
    for (object, motion) in found.motions.iter().enumerate() {
        let others = |from: f64, to: f64| {
            let inside = |m: &Move| m.from < to && m.to > from;
            found.motions.iter().enumerate().any(|(i, m)| i != object && m.moves.iter().any(inside))
        };
        let mut own: Vec<Move> = Vec::new();
        for next in &motion.moves {
            // What is taken up and put back where it was has no other place, but is away for long.
            let long = next.to - next.from;
            let away = next.distance > 4.0 * motion.limit && long > SHORT_S;
            if next.distance < 2.0 * motion.limit || long < LEAST_S || !(next.shifted || away) {
                continue;
            }
            match own.last_mut() {
                // A rest in the air: it is short, or the hand rests, too.
                Some(last)
                    if next.from - last.to < SHORT_S && !others(last.to, next.from)
                        || part
                            .hand
                            .as_ref()
                            .is_some_and(|hand| rests(hand, last.to, next.from)) =>
                {
                    last.to = next.to;
                    last.distance = last.distance.max(next.distance);
                }
                _ => own.push(*next),
            }
        }
        all.extend(own.into_iter().map(|m| (object, m)));
    }
    all.sort_by(|a, b| a.1.from.total_cmp(&b.1.from));
    while let Some((object, first)) = all.first().copied() {
        // What moved at the same time.
        let common = |m: &Move| {
            m.to.min(first.to) - m.from.max(first.from)
                > 0.5 * (m.to - m.from).min(first.to - first.from)
        };
        let group: Vec<(usize, Move)> = all.iter().filter(|(_, m)| common(m)).copied().collect();
        all.retain(|(_, m)| !common(m));
        let rides: Vec<Ride> =
            group.iter().filter_map(|(i, m)| ride(part, found, *i, m.from, m.to)).collect();
        note(part, &rides, new);
        let Some(best) = best(part, &rides, grips) else {
            let id = &part.tracks[object].id;
            found.dropped.push(format!(
                "{:.2} to {:.2} s: {id} moved, but not with the hand",
                first.from, first.to
            ));
            continue;
        };
        let Some((_, own)) = group.iter().find(|(i, _)| *i == best) else { continue };
        let ride = rides.iter().find(|ride| ride.object == best);
        let evidence = format!(
            "motion{}",
            ride.map_or_else(String::new, |r| in_words(r, part.hand.is_some()))
        );
        let riders = rides.iter().map(|ride| ride.object).filter(|i| *i != best).collect();
        found.carries.push(Carry { from: own.from, to: own.to, object: best, riders, evidence });
    }
}

/// Returns whether the hand stays where it is in a stretch.
fn rests(hand: &Track, from: f64, to: f64) -> bool {
    let Some((place, _)) = hand_at(hand, (from + to) / 2.0) else { return false };
    let inside = between(&hand.samples, from, to);
    to - from < 20.0 && inside.iter().all(|s| (Vector3::from(s.position) - place).norm() < MOVED)
}
