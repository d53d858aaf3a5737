//! Fixtures that stand level, however they are turned: kinds that nothing moved and that always had one side up.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::motion::Motion;
use crate::task::domain::levelled;

/// Noise of the orientations, in radians, up to which a tilt is what it seems.
const EXACT_RAD: f64 = 1e-3;
/// Least number of demonstrations that show a kind.
const SHOWN: usize = 3;
/// Greatest ratio of the tilts to those that noise makes, and what is level without any, in radians.
const TILTED: f64 = 1.5;
const PLAY_RAD: f64 = 3e-3;

/// Returns for each kind of fixture that stands level the side that is up, as a direction in the frame of its objects, and gives
/// the rests of these kinds poses without the tilt, which is noise. Nothing is returned if orientations are free of noise, or if
/// nobody knows what is up.
pub(super) fn level(motion: &mut Motion<'_>) -> BTreeMap<String, [f64; 3]> {
    let Some(up) = motion.up().filter(|_| motion.noise.angle_rad > EXACT_RAD) else {
        return BTreeMap::new();
    };
    let up = Vector3::ith(up, 1.0);
    let kinds: BTreeSet<String> = motion.landmarks.iter().map(|kind| kind.to_string()).collect();
    let mut level = BTreeMap::new();
    for kind in kinds {
        let own: Vec<usize> =
            (0..motion.rests.len()).filter(|r| motion.kind(&motion.rests[*r]) == kind).collect();
        let demos: BTreeSet<usize> = own.iter().map(|r| motion.rests[*r].demo).collect();
        let side = |r: &usize| motion.rests[*r].pose.rotation().inverse() * up;
        let sum: Vector3<f64> = own.iter().map(side).sum();
        if demos.len() < SHOWN || sum.norm() < 0.5 * own.len() as f64 {
            continue;
        }
        let mean = sum.normalize();
        // Two of the angles about the axes tilt an object.
        let tilts: f64 = own.iter().map(|r| side(r).angle(&mean).powi(2)).sum();
        let noise: f64 = own.iter().map(|r| 2.0 * motion.looks(&motion.rests[*r])).sum();
        let noise = noise * motion.noise.angle_rad.powi(2);
        let most = (TILTED * TILTED * noise).max(own.len() as f64 * PLAY_RAD * PLAY_RAD);
        if tilts > most {
            continue;
        }
        // A mean of few directions has noise, too. The sides of most bodies are those of their frames.
        let error = (noise / own.len() as f64).sqrt() + PLAY_RAD;
        let axes = (0..3).flat_map(|i| [Vector3::ith(i, 1.0), Vector3::ith(i, -1.0)]);
        let side = axes.min_by(|a, b| a.angle(&mean).total_cmp(&b.angle(&mean)));
        let side = side.filter(|side| side.angle(&mean) <= error).unwrap_or(mean);
        for rest in own {
            let pose = &mut motion.rests[rest].pose;
            *pose = levelled(pose, &side, &up);
        }
        level.insert(kind, side.into());
    }
    level
}
