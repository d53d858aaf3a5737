//! The noise of recorded poses, and the poses that are none: outliers, and fixtures that seem to have moved.

use std::collections::BTreeMap;

use super::motion::angle;
use crate::robot::{Pose, mean_orientation};
use crate::task::learn::tracks::Track;
use crate::task::recording::{Demonstration, Recording};

/// Standard deviations of the recorded poses of objects that rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    /// Of each coordinate, in metres.
    pub position_m: f64,
    /// Of the rotation about each axis, in radians.
    pub angle_rad: f64,
}

/// Leaves out poses that disagree with those before and after, while these agree. Returns their number.
pub(super) fn leave_out(track: &mut Track, demo: &Demonstration, least: (f64, f64)) -> usize {
    let seen: Vec<(usize, Pose)> =
        (0..track.at.len()).filter_map(|s| Some((s, *track.pose(demo, s)?))).collect();
    let differs = |a: &Pose, b: &Pose| a.distance(b) > least.0 || angle(a, b) > least.1;
    let mut out = 0;
    for three in seen.windows(3) {
        let [(_, a), (s, b), (_, c)] = three else { continue };
        if differs(a, b) && differs(b, c) && !differs(a, c) {
            track.at[*s] = None;
            out += 1;
        }
    }
    out
}

/// Share of the demonstrations in which a kind has to move. A kind that moves in fewer is fixed, and poses elsewhere are
/// outliers.
const MOVING: f64 = 0.35;

/// Leaves out the poses in which fixtures seem to have moved. Returns their number.
pub(super) fn hold_fixtures(
    recording: &Recording,
    tracks: &mut [Vec<Track>],
    least_m: f64,
) -> usize {
    if recording.demos.len() < 3 {
        return 0;
    }
    let mut kinds: BTreeMap<String, (usize, usize, bool)> = BTreeMap::new();
    for (demo, tracks) in recording.demos.iter().zip(&*tracks) {
        let mut moved: BTreeMap<&str, bool> = BTreeMap::new();
        for track in tracks {
            let poses: Vec<Pose> =
                (0..track.at.len()).filter_map(|s| track.pose(demo, s).copied()).collect();
            let differs = poses.windows(2).any(|p| p[0].distance(&p[1]) > least_m);
            *moved.entry(&track.kind).or_default() |= differs;
        }
        for (kind, moved) in moved {
            let entry = kinds.entry(kind.to_owned()).or_default();
            entry.0 += usize::from(moved);
            entry.1 += 1;
        }
        for snapshot in &demo.snapshots {
            if let Some(kind) = snapshot.object.and_then(|o| snapshot.objects.get(o)) {
                kinds.entry(kind.kind.to_string()).or_default().2 = true;
            }
        }
    }
    let mut out = 0;
    for (demo, tracks) in recording.demos.iter().zip(tracks) {
        for track in tracks {
            let Some((moved, of, touched)) = kinds.get(&*track.kind) else { continue };
            if *touched || *moved == 0 || *moved as f64 >= MOVING * *of as f64 {
                continue;
            }
            let poses: Vec<(usize, Pose)> =
                (0..track.at.len()).filter_map(|s| Some((s, *track.pose(demo, s)?))).collect();
            let all: Vec<Pose> = poses.iter().map(|(_, pose)| *pose).collect();
            let usual = median(&all);
            for (i, (s, pose)) in poses.iter().enumerate() {
                // What stays elsewhere for two snapshots was moved, as a gate is by its button.
                let near =
                    |other: Option<&Pose>| other.is_some_and(|o| o.distance(pose) <= least_m);
                let stays = near(i.checked_sub(1).and_then(|i| all.get(i))) || near(all.get(i + 1));
                if pose.distance(&usual) > least_m && !stays {
                    track.at[*s] = None;
                    out += 1;
                }
            }
        }
    }
    out
}

/// Greatest number of poses that make a median.
const SAMPLE: usize = 64;

/// Returns the median position and the mean orientation of the poses near the median.
pub(super) fn median(poses: &[Pose]) -> Pose {
    // An even sample of many poses, because the orientations are compared pair by pair.
    let step = poses.len().div_ceil(SAMPLE).max(1);
    let sampled: Vec<Pose> = poses.iter().step_by(step).copied().collect();
    let poses = &sampled;
    let position = std::array::from_fn(|i| {
        let mut values: Vec<f64> = poses.iter().map(|p| p.position[i]).collect();
        values.sort_by(f64::total_cmp);
        let n = values.len();
        0.5 * (values[(n - 1) / 2] + values[n / 2])
    });
    let turns: Vec<[f64; 4]> = poses.iter().map(|p| p.orientation).collect();
    // The orientation with the least sum of angles to the others is no outlier.
    let far = poses.iter().map(|p| (poses.iter().map(|q| angle(p, q)).sum::<f64>(), p));
    let middle = far.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, p)| p);
    let near: Vec<[f64; 4]> = poses
        .iter()
        .filter(|p| middle.is_none_or(|m| angle(m, p) < 0.5))
        .map(|p| p.orientation)
        .collect();
    let kept = if near.is_empty() { &turns } else { &near };
    let orientation = match kept[..] {
        [one] => one,
        _ => mean_orientation(kept).unwrap_or([0.0, 0.0, 0.0, 1.0]),
    };
    Pose { position, orientation }
}

/// Estimates the noise from consecutive poses. Most objects rest between two snapshots, so half the differences are
/// free of movement.
pub(super) fn noise(recording: &Recording) -> Noise {
    let (mut steps, mut turns) = (Vec::new(), Vec::new());
    for demo in &recording.demos {
        for pair in demo.snapshots.windows(2) {
            let before: BTreeMap<&str, &Pose> =
                pair[0].objects.iter().map(|o| (&*o.id, &o.pose)).collect();
            for object in &pair[1].objects {
                if let Some(was) = before.get(&*object.id) {
                    steps.extend((0..3).map(|i| (object.pose.position[i] - was.position[i]).abs()));
                    turns.push(angle(was, &object.pose));
                }
            }
        }
    }
    let middle = |values: &mut Vec<f64>| {
        // The lower quartile allows for movements of a few of the objects.
        let quarter = values.len() / 4;
        if values.is_empty() {
            0.0
        } else {
            *values.select_nth_unstable_by(quarter, f64::total_cmp).1
        }
    };
    // The lower quartiles of |N(0, 1)| and of the length of three such numbers are 0.3186 and 1.1011. A difference has
    // twice the variance.
    Noise {
        position_m: middle(&mut steps) / (0.3186 * std::f64::consts::SQRT_2),
        angle_rad: middle(&mut turns) / (1.1011 * std::f64::consts::SQRT_2),
    }
}
