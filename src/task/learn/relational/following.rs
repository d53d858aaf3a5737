//! Follows objects from snapshot to snapshot, robustly: ids may be swapped, and objects may be missing for a while.

use std::collections::BTreeMap;

use crate::task::learn::tracks::Track;
use crate::task::recording::{Demonstration, SnapshotEvent};

/// Follows the objects of a demonstration. Objects that did not move are matched first, whatever their ids, so swapped
/// and shifted ids do no harm. An object may be missing for some snapshots.
pub(super) fn follow(demo: &Demonstration, least_m: f64) -> Vec<Track> {
    // The first and the last snapshot of each id.
    let mut spans: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for (now, snapshot) in demo.snapshots.iter().enumerate() {
        for object in &snapshot.objects {
            spans.entry(&object.id).or_insert((now, now)).1 = now;
        }
    }
    let mut tracks: Vec<Track> = Vec::new();
    let mut last: Vec<(usize, usize)> = Vec::new();
    // The track that a hand touched last.
    let mut held: Option<usize> = None;
    let length = demo.snapshots.len();
    for (now, snapshot) in demo.snapshots.iter().enumerate() {
        let mut free: Vec<usize> = (0..snapshot.objects.len()).collect();
        let mut open: Vec<usize> = (0..tracks.len()).collect();
        // Who let go of something at a new place carried it there, whatever took its old place.
        let carried = held.zip(snapshot.object).filter(|(t, o)| {
            let Some(is) = snapshot.objects.get(*o) else { return false };
            let far = |t: usize| {
                let was = &demo.snapshots[last[t].0].objects[last[t].1];
                was.kind != is.kind || was.pose.distance(&is.pose) > least_m
            };
            let released = snapshot.event == Some(SnapshotEvent::Release);
            released && tracks[*t].kind == is.kind && open.iter().all(|t| far(*t))
        });
        let left = carried.map(|(t, _)| demo.snapshots[last[t].0].objects[last[t].1].pose);
        if let Some((t, o)) = carried {
            open.retain(|other| *other != t);
            free.retain(|other| *other != o);
            tracks[t].at[now] = Some(o);
            last[t] = (now, o);
        }
        let mut pairs = Vec::new();
        let is_new = |id: &str| spans.get(id).is_some_and(|(first, _)| *first == now);
        let returns = |id: &str| spans.get(id).is_some_and(|(_, last)| *last >= now);
        for t in &open {
            let was = &demo.snapshots[last[*t].0].objects[last[*t].1];
            let missing = last[*t].0 + 1 != now;
            for o in &free {
                let is = &snapshot.objects[*o];
                if is.kind == tracks[*t].kind {
                    let far = was.pose.distance(&is.pose);
                    let other = was.id != is.id;
                    let moved = far > least_m;
                    // Unmoved under its own id, unmoved under another, moved under its own id, and the rest by distance.
                    let rank = match (moved, other) {
                        (false, false) => 0,
                        (false, true) => 1,
                        (true, false) => 2,
                        (true, true) => 3,
                    };
                    // Ids that are seen again tell objects apart.
                    if rank < 3 || !(is_new(&is.id) && returns(&was.id)) {
                        pairs.push((rank, missing && moved, far, *t, *o));
                    }
                }
            }
        }
        pairs.sort_by(|a, b| {
            (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)).then((a.3, a.4).cmp(&(b.3, b.4)))
        });
        // If something slid up to where it was, so may have what stood behind: the ids tell.
        let slid = pairs.iter().any(|(rank, _, _, _, o)| {
            let is = &snapshot.objects[*o].pose;
            *rank == 2 && left.is_some_and(|left| left.distance(is) <= least_m)
        });
        let alike = |t: usize| held.is_some_and(|held| tracks[held].kind == tracks[t].kind);
        pairs.retain(|(rank, _, _, t, _)| !slid || matches!(rank, 0 | 2) || !alike(*t));
        for (_, _, _, t, o) in pairs {
            if open.contains(&t) && free.contains(&o) {
                open.retain(|other| *other != t);
                free.retain(|other| *other != o);
                tracks[t].at[now] = Some(o);
                last[t] = (now, o);
            }
        }
        for o in free {
            let mut at = vec![None; length];
            at[now] = Some(o);
            tracks.push(Track { kind: snapshot.objects[o].kind.clone(), at });
            last.push((now, o));
        }
        let touched =
            snapshot.object.and_then(|o| tracks.iter().position(|t| t.at[now] == Some(o)));
        match snapshot.event {
            Some(SnapshotEvent::Contact) => held = touched,
            Some(_) => held = None,
            None => {}
        }
    }
    tracks
}

/// Returns whether an object is missing from a snapshot and seen again later.
pub(super) fn vanishes_for_a_moment(track: &Track) -> bool {
    track.span().is_some_and(|(first, last)| track.at[first..last].contains(&None))
}
