//! Views that disagree, as those of two cameras do: what nobody handles is seen elsewhere from look to look, or in some
//! demonstrations elsewhere than in others.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::motion::{Motion, Rest, angle};
use super::noise::Noise;
use super::states::States;
use crate::robot::Pose;
use crate::task::domain::{Coordinate, FrameState, Origin, relative};
use crate::task::recording::Recording;

/// Share of the differences that may be movements or errors of single poses.
const OTHERS: f64 = 0.25;
/// Ratio of the differences between looks to the noise within one view from which the views disagree.
const BEYOND: f64 = 1.3;
/// Greatest difference, as the standard deviation of a coordinate in metres, that is taken for one of views.
const MOST_M: f64 = 0.015;
/// Least number of differences.
const FEW: usize = 8;
/// Greatest standard deviation of a coordinate that is taken for noise where poses are held between looks, in metres.
const HELD_M: f64 = 5e-3;
/// Ratio of a difference to the next smaller one from which the two are unlike, and the least share of unlike ones.
const UNLIKE: (f64, f64) = (1.01, 0.75);
/// Least difference of views that is told from noise by its two modes, in metres.
const TOLD_M: f64 = 3e-3;
/// Ratio of the usual difference to a small one from which looks have two modes.
const MODES: f64 = 4.0;

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
                // What is equal to the last bit was not looked at again, if other looks differ.
                if noise.position_m == 0.0 && *was == object.pose {
                    continue;
                }
                let difference = (was.distance(&object.pose), angle(was, &object.pose));
                differences.entry(&object.kind).or_default().push(difference);
            }
        }
    }
    let held = noise.position_m == 0.0;
    let spreads = differences.into_iter().filter(|(_, values)| {
        values.len() >= FEW && (!held || are_unlike(values.iter().map(|v| v.0).collect()))
    });
    let spreads = spreads.map(|(kind, values)| {
        let (positions, angles) = values.into_iter().unzip();
        // Three coordinates, and two looks for each difference.
        let (positions, angles): (Vec<f64>, Vec<f64>) = (positions, angles);
        let bimodal = has_two_modes(positions.clone());
        let of = |values| (trimmed_square(values) / 6.0).sqrt();
        (kind, Noise { position_m: of(positions), angle_rad: of(angles) }, bimodal)
    });
    let (kind, spread, bimodal) =
        spreads.min_by(|a, b| a.1.position_m.total_cmp(&b.1.position_m))?;
    let beyond = spread.position_m > BEYOND * noise.position_m;
    let differ = beyond || (bimodal && spread.position_m > TOLD_M);
    let most = if held { HELD_M } else { MOST_M };
    (differ && spread.position_m < most).then(|| (kind.to_owned(), spread))
}

/// Returns whether most differences are unlike, as those by noise are. Those between the stops of a mechanism agree.
fn are_unlike(mut values: Vec<f64>) -> bool {
    values.sort_by(f64::total_cmp);
    let unlike = values.windows(2).filter(|two| two[1] > UNLIKE.0 * two[0]).count();
    unlike as f64 >= UNLIKE.1 * values.len() as f64
}

/// Returns whether some differences are much smaller than is usual.
fn has_two_modes(mut values: Vec<f64>) -> bool {
    values.sort_by(f64::total_cmp);
    values[values.len() / 10] * MODES < values[values.len() / 2]
}

/// Returns the mean square of the values without the greatest of them.
fn trimmed_square(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.truncate(values.len() - (OTHERS * values.len() as f64).ceil() as usize);
    values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64
}

/// Demonstrations in which something is seen elsewhere than in the others.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shifted {
    /// Kind of the reference from which all is off; `None` if it is the world.
    pub reference: Option<String>,
    /// Kind of what is off; `None` for all that was put at the reference.
    pub own: Option<String>,
    /// The demonstrations.
    pub demos: BTreeSet<usize>,
    /// By how much, in metres along the axes of the reference.
    pub by: [f64; 3],
}

/// Greatest shift of a reference between demonstrations, in metres. What is farther apart are two places.
const SHIFT_M: f64 = 0.012;
/// Least number of demonstrations on each side.
const SIDE: usize = 2;
/// Number of standard deviations by which a shift exceeds the noise.
const SURE: f64 = 6.0;
/// Share of a shift, beside the noise, by which that of another state may differ.
const ALIKE: f64 = 0.3;

/// A place of a state, with the poses of each demonstration in its frame.
struct Seats<'s> {
    state: &'s FrameState,
    poses: Vec<(usize, Vector3<f64>)>,
}

/// Returns the demonstrations in which all that was put at a reference that nothing moves lies off by the same, in each of
/// them and in no other; or all objects of one kind.
pub(super) fn shifted(motion: &Motion<'_>, found: &States) -> Option<Shifted> {
    let frames = || found.fixed.iter().map(|kind| Some(&**kind));
    let kinds: BTreeSet<&str> = found.states.iter().map(|state| &*state.kind).collect();
    let all = frames().map(|frame| (frame, None));
    let single = frames().chain(kinds.iter().map(|k| Some(*k))).chain([None]);
    let single = single.flat_map(|f| kinds.iter().map(move |k| (f, Some(*k))));
    all.chain(single).find_map(|(frame, own)| shift_of(motion, found, frame, own))
}

fn shift_of(
    motion: &Motion<'_>,
    found: &States,
    frame: Option<&str>,
    own: Option<&str>,
) -> Option<Shifted> {
    let mut seats: BTreeMap<(usize, usize), Seats<'_>> = BTreeMap::new();
    for (rest, label) in motion.rests.iter().zip(&found.labels) {
        let Some(fact) = label else { continue };
        let state = &found.states[fact.state];
        let other = own.is_some_and(|own| own != state.kind);
        if other || state.frame.kind() != frame || state.origin != Origin::Placed {
            continue;
        }
        let Some(pose) = seat(motion, rest, fact.reference) else { continue };
        let own = seats.entry((fact.state, fact.place));
        own.or_insert(Seats { state, poses: Vec::new() }).poses.push((rest.demo, pose));
    }
    let noise = motion.noise.position_m.max(CAREFUL_M);
    let seats: Vec<Seats<'_>> = seats.into_values().flat_map(|s| s.split(SURE * noise)).collect();
    for (index, a) in seats.iter().enumerate() {
        for b in seats[index + 1..].iter().filter(|b| b.state.kind == a.state.kind) {
            let (few, many) = if a.demos().len() < b.demos().len() { (a, b) } else { (b, a) };
            let (demos, others) = (few.demos(), many.demos());
            let by = few.mean()? - many.mean()?;
            let told = by.norm() > SURE * noise && by.norm() <= SHIFT_M;
            let sides = demos.len() >= SIDE && others.len() >= SIDE;
            if !told || !sides || !demos.is_disjoint(&others) || !few.is_tight() || !many.is_tight()
            {
                continue;
            }
            // Every place that both sides show is off by the same.
            let near = ALIKE * by.norm() + SURE * noise;
            let agrees = seats.iter().all(|seat| {
                let all = seats.iter().filter(|other| {
                    let apart = other.mean().zip(seat.mean());
                    other.state.kind == seat.state.kind
                        && apart.is_some_and(|(a, b)| (a - b).norm() <= SHIFT_M + near)
                });
                let all: Vec<&Seats<'_>> = all.collect();
                let side = |inside: bool| {
                    let poses = all.iter().flat_map(|s| &s.poses);
                    mean(poses.filter(|(d, _)| demos.contains(d) == inside).map(|(_, p)| *p))
                };
                side(true).zip(side(false)).is_none_or(|(a, b)| (a - b - by).norm() <= near)
            });
            if agrees {
                let [reference, own] = [frame, own].map(|kind| kind.map(str::to_owned));
                return Some(Shifted { reference, own, demos, by: by.into() });
            }
        }
    }
    None
}

/// Standard deviation of a careful placing, in metres.
const CAREFUL_M: f64 = 3e-4;

fn seat(motion: &Motion<'_>, rest: &Rest, reference: Option<usize>) -> Option<Vector3<f64>> {
    let Some(reference) = reference else { return Some(rest.pose.position.into()) };
    let there = motion.rest_during(rest.demo, reference, (rest.first, rest.last))?;
    Some(relative(&motion.rests[there].pose, &rest.pose).position.into())
}

fn mean(values: impl Iterator<Item = Vector3<f64>>) -> Option<Vector3<f64>> {
    let (sum, count) = values.fold((Vector3::zeros(), 0.0), |(sum, n), v| (sum + v, n + 1.0));
    (count > 0.0).then(|| sum / count)
}

impl Seats<'_> {
    /// Cuts poses at their widest gap, if it is wider than `least` and cuts no demonstration.
    fn split(self, least: f64) -> Vec<Self> {
        let gap = (0..3).filter_map(|i| {
            let mut values: Vec<f64> = self.poses.iter().map(|(_, pose)| pose[i]).collect();
            values.sort_by(f64::total_cmp);
            let widest = values.windows(2).map(|two| (two[1] - two[0], two[0]));
            widest.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(wide, below)| (wide, i, below))
        });
        let gap = gap.filter(|(wide, ..)| *wide > least).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, i, below)) = gap.filter(|_| self.is_tight()) else { return vec![self] };
        let (low, high) = self.poses.iter().partition(|(_, pose)| pose[i] <= below);
        let sides = [low, high].map(|poses| Seats { state: self.state, poses });
        match sides[0].demos().is_disjoint(&sides[1].demos()) {
            true => sides.into(),
            false => vec![self],
        }
    }

    fn demos(&self) -> BTreeSet<usize> {
        self.poses.iter().map(|(demo, _)| *demo).collect()
    }

    fn mean(&self) -> Option<Vector3<f64>> {
        mean(self.poses.iter().map(|(_, pose)| *pose))
    }

    fn is_tight(&self) -> bool {
        let tight = |c: &Coordinate| matches!(c, Coordinate::Tight { .. });
        self.state.places.iter().all(|p| p.coordinates.iter().all(tight))
    }
}

impl Shifted {
    /// Puts everything where the other demonstrations see it.
    pub fn correct(&self, motion: &mut Motion<'_>, found: &States) {
        let by = Vector3::from(self.by);
        let here = |motion: &Motion<'_>, rest: &Rest, kind: &str| {
            self.demos.contains(&rest.demo) && motion.kind(rest) == kind
        };
        let mut moves: Vec<(usize, Vector3<f64>)> = Vec::new();
        match (&self.own, &self.reference) {
            // The reference is off, the other way.
            (None, Some(kind)) => {
                let own = (motion.rests.iter().enumerate()).filter(|(_, r)| here(motion, r, kind));
                moves.extend(own.map(|(index, rest)| (index, rest.pose.rotation() * by)));
            }
            (own, reference) => {
                let mut shifted: BTreeSet<(usize, usize)> = BTreeSet::new();
                for (index, (rest, label)) in motion.rests.iter().zip(&found.labels).enumerate() {
                    let Some(fact) = label else { continue };
                    let state = &found.states[fact.state];
                    let is_own = own.as_deref().is_none_or(|own| here(motion, rest, own))
                        && state.frame.kind() == reference.as_deref()
                        && state.origin == Origin::Placed;
                    // What lies on it goes with it.
                    let rides = fact.reference.is_some_and(|on| shifted.contains(&(rest.demo, on)));
                    if !self.demos.contains(&rest.demo) || !(is_own || rides) {
                        continue;
                    }
                    let frame = fact
                        .reference
                        .filter(|_| is_own)
                        .and_then(|on| motion.rest_during(rest.demo, on, (rest.first, rest.last)));
                    let turned = frame.map_or(by, |f| motion.rests[f].pose.rotation() * by);
                    shifted.insert((rest.demo, rest.track));
                    moves.push((index, -turned));
                }
            }
        }
        for (rest, by) in moves {
            (0..3).for_each(|i| motion.rests[rest].pose.position[i] += by[i]);
        }
    }
}
