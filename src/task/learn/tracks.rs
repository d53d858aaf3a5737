//! Tracks objects from snapshot to snapshot, even if ids shift because an object is lost.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::robot::Pose;
use crate::task::recording::{Demonstration, Snapshot};

/// One physical object throughout a demonstration.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Track {
    pub kind: Arc<str>,
    /// Index of the object in each snapshot; `None` before the object appears and after it is lost.
    pub at: Vec<Option<usize>>,
}

impl Track {
    /// Pose of the object in a snapshot.
    pub fn pose<'a>(&self, demo: &'a Demonstration, snapshot: usize) -> Option<&'a Pose> {
        let object = (*self.at.get(snapshot)?)?;
        Some(&demo.snapshots.get(snapshot)?.objects.get(object)?.pose)
    }

    /// First and last snapshot in which the object is seen.
    pub fn span(&self) -> Option<(usize, usize)> {
        let first = self.at.iter().position(Option::is_some)?;
        Some((first, self.at.iter().rposition(Option::is_some)?))
    }

    /// Distance that the object moved between two snapshots, in metres; `None` unless it is in both.
    pub fn moved(&self, demo: &Demonstration, from: usize, to: usize) -> Option<f64> {
        Some(self.pose(demo, from)?.distance(self.pose(demo, to)?))
    }

    /// Id of the object in a snapshot.
    pub fn id<'a>(&self, demo: &'a Demonstration, snapshot: usize) -> Option<&'a str> {
        let object = (*self.at.get(snapshot)?)?;
        Some(&demo.snapshots.get(snapshot)?.objects.get(object)?.id)
    }
}

/// Returns the tracks of all objects of a demonstration.
///
/// While the number of objects of a kind stays the same, ids identify them. If the number changes, for example because
/// a part fell off the table and later ids moved down, objects are matched by distance, nearest first. Objects that did
/// not move are thus matched before objects that moved.
pub(crate) fn follow(demo: &Demonstration) -> Vec<Track> {
    let mut tracks: Vec<Track> = Vec::new();
    let length = demo.snapshots.len();
    for (now, snapshot) in demo.snapshots.iter().enumerate() {
        let mut free: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for (index, object) in snapshot.objects.iter().enumerate() {
            free.entry(&object.kind).or_default().push(index);
        }
        if now > 0 {
            let before = &demo.snapshots[now - 1];
            for (kind, objects) in &mut free {
                let alive: Vec<usize> = (0..tracks.len())
                    .filter(|t| &*tracks[*t].kind == *kind && tracks[*t].at[now - 1].is_some())
                    .collect();
                for (track, object) in match_kind(&tracks, &alive, before, snapshot, objects, now) {
                    tracks[track].at[now] = Some(object);
                    objects.retain(|o| *o != object);
                }
            }
        }
        for object in free.into_values().flatten() {
            let mut at = vec![None; length];
            at[now] = Some(object);
            tracks.push(Track { kind: snapshot.objects[object].kind.clone(), at });
        }
    }
    tracks
}

fn match_kind(
    tracks: &[Track],
    alive: &[usize],
    before: &Snapshot,
    after: &Snapshot,
    objects: &[usize],
    now: usize,
) -> Vec<(usize, usize)> {
    let last = |track: usize| tracks[track].at[now - 1].map(|o| &before.objects[o]);
    if alive.len() == objects.len() {
        let by_id: Vec<(usize, usize)> = alive
            .iter()
            .filter_map(|t| {
                let id = &last(*t)?.id;
                objects.iter().find(|o| after.objects[**o].id == *id).map(|o| (*t, *o))
            })
            .collect();
        if by_id.len() == alive.len() {
            return by_id;
        }
    }
    let mut pairs = Vec::new();
    for track in alive {
        for object in objects {
            if let Some(was) = last(*track) {
                let is = &after.objects[*object];
                pairs.push((was.pose.distance(&is.pose), was.id != is.id, *track, *object));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2, a.3).cmp(&(b.1, b.2, b.3))));
    let mut matched: Vec<(usize, usize)> = Vec::new();
    for (_, _, track, object) in pairs {
        if !matched.iter().any(|(t, o)| *t == track || *o == object) {
            matched.push((track, object));
        }
    }
    matched
}
