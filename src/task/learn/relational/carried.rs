//! Finds the object that a hand carried where the recording does not name it.

use super::motion::{Motion, angle, vertical, widths};
use crate::robot::Pose;
use crate::task::domain::distance::p_distance;
use crate::task::domain::relative;
use crate::task::learn::attempts::Attempt;
use crate::task::recording::Recording;

/// An object that moved less than this share of the farthest movement was nudged.
const NUDGED: f64 = 0.2;

/// Returns the vertical coordinate, if objects lie all over a table when demonstrations begin.
pub(super) fn upright(recording: &Recording) -> Option<usize> {
    let begun = recording.demos.iter().filter_map(|demo| demo.snapshots.first());
    vertical(widths(begun.flat_map(|s| &s.objects).map(|o| o.pose.position)))
}

/// Guesses the object of an attempt, given the first and the last snapshot of each track, and the vertical coordinate
/// ([`upright`]).
///
/// It is one of those that moved between contact and release, or until the next look if the release shows none. What moved
/// with another object as one body was carried by it if it lies higher. Of the others, as the learner of the paper does, the
/// one whose poses differ most by the p-norm is taken. Objects that were only turned come last, then those that were lost.
pub(super) fn guess(
    motion: &Motion<'_>,
    attempt: &Attempt,
    spans: &[Option<(usize, usize)>],
    upwards: Option<usize>,
    p: f64,
) -> Option<usize> {
    let (demo, tracks) = (motion.demo(attempt.demo), &motion.tracks[attempt.demo]);
    // An object can be missing for a moment.
    let ends = |t: usize, released: bool| -> Option<(&Pose, &Pose)> {
        let track = &tracks[t];
        let (_, last) = spans[t].filter(|(first, _)| *first <= attempt.before)?;
        let before = (0..=attempt.before).rev().find_map(|s| track.pose(demo, s))?;
        let after = match released {
            true => track.pose(demo, attempt.released?)?,
            false => (attempt.after..=last).find_map(|s| track.pose(demo, s))?,
        };
        Some((before, after))
    };
    let moved = |released: bool| -> Vec<(usize, f64, f64)> {
        let ends = (0..tracks.len()).filter_map(|t| Some((t, ends(t, released)?)));
        let far = ends.map(|(t, (before, after))| {
            (t, before.distance(after), p_distance(&before.position, &after.position, p))
        });
        far.filter(|(_, moved, _)| *moved > motion.least.0).collect()
    };
    let (mut moving, mut released) = (moved(true), true);
    if moving.is_empty() {
        (moving, released) = (moved(false), false);
    }
    let farthest = moving.iter().map(|m| m.1).fold(0.0, f64::max);
    moving.retain(|(_, far, _)| *far >= NUDGED * farthest);
    // What rides on another object moves with it and lies higher.
    let rides = |rider: usize, base: usize| {
        let (Some(a), Some(b)) = (ends(rider, released), ends(base, released)) else {
            return false;
        };
        let (before, after) = (relative(b.0, a.0), relative(b.1, a.1));
        let up = upwards.map(|up| a.0.position[up] - b.0.position[up]);
        before.distance(&after) <= motion.least.0
            && angle(&before, &after) <= motion.least.1
            && up.is_some_and(|up| up > motion.least.0)
    };
    let bases = moving.iter().filter(|(t, ..)| !moving.iter().any(|(b, ..)| rides(*t, *b)));
    let best =
        bases.max_by(|a, b| a.2.total_cmp(&b.2).then(a.1.total_cmp(&b.1)).then(b.0.cmp(&a.0)));
    let turned = || {
        (0..tracks.len())
            .filter_map(|t| ends(t, false).map(|(before, after)| (t, angle(before, after))))
            .filter(|(_, turn)| *turn > motion.least.1)
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
            .map(|(t, _)| t)
    };
    let mut lost = (0..tracks.len()).filter(|t| {
        tracks[*t].at[attempt.before].is_some()
            && spans[*t].is_some_and(|(_, last)| last < attempt.after)
    });
    best.map(|(t, ..)| *t).or_else(turned).or_else(|| lost.next())
}
