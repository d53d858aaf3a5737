//! Views that disagree: what nobody handles is seen elsewhere from look to look, as by two cameras that are calibrated
//! differently.

use std::collections::{BTreeMap, BTreeSet};

use super::motion::{Noise, angle};
use crate::robot::Pose;
use crate::task::recording::Recording;

/// Share of the differences that may be movements or errors of single poses.
const OTHERS: f64 = 0.25;
/// Ratio of the differences between looks to the noise within one view from which the views disagree.
const BEYOND: f64 = 1.3;
/// Greatest difference, as the standard deviation of a coordinate in metres, that is taken for one of views.
const MOST_M: f64 = 0.015;
/// Least number of differences.
const FEW: usize = 8;

/// Returns the kind that nobody handled whose poses differ least between its looks, with their standard deviations, if these
/// exceed the `noise` by far.
pub(super) fn differing(recording: &Recording, noise: &Noise) -> Option<(String, Noise)> {
    let snapshots = || recording.demos.iter().flat_map(|demo| &demo.snapshots);
    let touched = snapshots().filter_map(|s| Some(&*s.objects.get(s.object?)?.kind));
    let touched: BTreeSet<&str> = touched.collect();
    // What is not known to be handled by nobody tells nothing.
    if touched.is_empty() {
        return None;
    }
    let mut differences: BTreeMap<&str, Vec<(f64, f64)>> = BTreeMap::new();
    for demo in &recording.demos {
        let mut last: BTreeMap<&str, &Pose> = BTreeMap::new();
        for object in demo.snapshots.iter().flat_map(|s| &s.objects) {
            if touched.contains(&*object.kind) {
                continue;
            }
            if let Some(was) = last.insert(&object.id, &object.pose) {
                let difference = (was.distance(&object.pose), angle(was, &object.pose));
                differences.entry(&object.kind).or_default().push(difference);
            }
        }
    }
    let spreads = differences.into_iter().filter(|(_, values)| values.len() >= FEW);
    let spreads = spreads.map(|(kind, values)| {
        let (positions, angles) = values.into_iter().unzip();
        // Three coordinates, and two looks for each difference.
        let of = |values| (trimmed_square(values) / 6.0).sqrt();
        (kind, Noise { position_m: of(positions), angle_rad: of(angles) })
    });
    let (kind, spread) = spreads.min_by(|a, b| a.1.position_m.total_cmp(&b.1.position_m))?;
    let differ = spread.position_m > BEYOND * noise.position_m && spread.position_m < MOST_M;
    differ.then(|| (kind.to_owned(), spread))
}

/// Returns the mean square of the values without the greatest of them.
fn trimmed_square(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.truncate(values.len() - (OTHERS * values.len() as f64).ceil() as usize);
    values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64
}
