//! Cuts demonstrations into attempts and finds the object that each attempt manipulated.

use super::tracks::Track;
use crate::task::domain::distance::p_distance;
use crate::task::recording::{Demonstration, SnapshotEvent};

/// Smallest displacement that counts as movement, in metres. Slight knocks, slips in the hand and the settling of a
/// resting part are smaller.
pub const MOVED_M: f64 = 1e-3;

/// One attempt: an object was picked up and released.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Attempt {
    /// Index of the demonstration in the recording.
    pub demo: usize,
    /// Index of the snapshot before the attempt.
    pub before: usize,
    /// Index of the snapshot after the attempt, when the objects had come to rest.
    pub after: usize,
    /// Track of the manipulated object, if known.
    pub track: Option<usize>,
    /// Whether the recording names the manipulated object.
    pub declared: bool,
    /// Index of the snapshot of the release, if the attempt ended with one.
    pub released: Option<usize>,
}

/// Cuts a demonstration into attempts.
///
/// With events, an attempt lasts from a contact to the release of the same object. Its result is read from the
/// snapshot after the release, because a released part may still be falling. Without events, every two consecutive
/// snapshots form an attempt.
pub(crate) fn cut(demo: usize, demonstration: &Demonstration, tracks: &[Track]) -> Vec<Attempt> {
    let snapshots = &demonstration.snapshots;
    let track_of =
        |snapshot: usize, object: usize| tracks.iter().position(|t| t.at[snapshot] == Some(object));
    let mut attempts = Vec::new();
    if !snapshots.iter().any(|s| s.event.is_some()) {
        let befores = &snapshots[..snapshots.len().saturating_sub(1)];
        for (before, snapshot) in befores.iter().enumerate() {
            let track = snapshot.object.and_then(|o| track_of(before, o));
            let declared = track.is_some();
            attempts.push(Attempt {
                demo,
                before,
                after: before + 1,
                track,
                declared,
                released: None,
            });
        }
        return attempts;
    }
    let mut held: Option<(usize, Option<usize>)> = None;
    let last = snapshots.len() - 1;
    for (now, snapshot) in snapshots.iter().enumerate() {
        let touched = snapshot.object.and_then(|o| track_of(now, o));
        let mut close = |(before, track): (usize, Option<usize>), after, released| {
            let declared = track.is_some();
            attempts.push(Attempt { demo, before, after, track, declared, released });
        };
        match (snapshot.event, held) {
            (Some(SnapshotEvent::Contact), None) => held = Some((now, touched)),
            // A second contact without a release ends the attempt, as the part has slipped away. The exception is a
            // contact with the same part in the same place: the fingers lost it only for a moment.
            (Some(SnapshotEvent::Contact), Some((before, track))) => {
                let same = track.is_some() && touched == track;
                let moved = track.and_then(|t| tracks[t].moved(demonstration, before, now));
                if !(same && moved.is_some_and(|m| m < MOVED_M)) {
                    close((before, track), now, None);
                    held = Some((now, touched));
                }
            }
            (Some(SnapshotEvent::Release), Some((before, track)))
                if touched.is_none() || track.is_none() || touched == track =>
            {
                close((before, track.or(touched)), (now + 1).min(last), Some(now));
                held = None;
            }
            (Some(SnapshotEvent::End), Some(attempt)) => {
                close(attempt, now, None);
                held = None;
            }
            _ => {}
        }
    }
    if let Some((before, track)) = held
        && before < last
    {
        let declared = track.is_some();
        attempts.push(Attempt { demo, before, after: last, track, declared, released: None });
    }
    attempts
}

impl Attempt {
    /// Returns the pose at the release, as (demonstration, track, snapshot); `None` unless a later snapshot shows the
    /// result. The part may have been falling, so this pose is not clustered.
    pub fn falling(&self) -> Option<(usize, usize, usize)> {
        let snapshot = self.released.filter(|released| *released < self.after)?;
        Some((self.demo, self.track?, snapshot))
    }
}

/// A part that moved less than this share of the longest movement in the attempt was nudged, not manipulated.
const NUDGED: f64 = 0.2;

/// Guesses the manipulated object of an attempt.
///
/// The guess is one of the parts that moved farthest: the part with the largest p-norm between its poses before and
/// after. A part that was knocked across the table stays at the table's height, so its p-norm is small; a manipulated
/// part usually changes its height. If no part moved, the guess is a part that was lost during the attempt.
pub(crate) fn guess(
    demo: &Demonstration,
    tracks: &[Track],
    attempt: &Attempt,
    p: f64,
) -> Option<usize> {
    let moved: Vec<(usize, f64)> = (0..tracks.len())
        .filter_map(|t| Some((t, tracks[t].moved(demo, attempt.before, attempt.after)?)))
        .filter(|(_, moved)| *moved >= MOVED_M)
        .collect();
    let farthest = moved.iter().map(|(_, m)| *m).fold(0.0, f64::max);
    let unlike = |track: usize| {
        let before = tracks[track].pose(demo, attempt.before)?;
        let after = tracks[track].pose(demo, attempt.after)?;
        Some(p_distance(&before.position, &after.position, p))
    };
    let best = moved
        .iter()
        .filter(|(_, m)| *m >= NUDGED * farthest)
        .filter_map(|(track, m)| Some((*track, unlike(*track)?, *m)))
        .max_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)).then(b.0.cmp(&a.0)));
    let mut lost = (0..tracks.len()).filter(|t| {
        tracks[*t].at[attempt.before].is_some() && tracks[*t].at[attempt.after].is_none()
    });
    best.map(|(track, ..)| track).or_else(|| lost.next())
}
