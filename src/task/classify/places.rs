//! What the states of a domain show of their places: the vertical of a frame, differences between places, pooled spreads.

use nalgebra::Vector3;

use super::classifier::{FLOOR, FOUND_M, GAP};
use super::tolerance::{Directions, Pool};
use crate::task::domain::{Coordinate, Frame, FrameState, Origin, Place, Turn};

/// Returns whether objects in a state rest in a demonstrated orientation on what they were put onto.
pub(super) fn rests(state: &FrameState) -> bool {
    state.origin == Origin::Placed && state.turn != Turn::Free
}

/// Returns whether objects came to rest in any orientation. They tumbled, so no sideways direction of their place is narrower
/// than another.
pub(super) fn tumbled(state: &FrameState) -> bool {
    state.origin == Origin::Placed && state.turn == Turn::Free
}

/// Returns the widest range of a place.
pub(super) fn widest(place: &Place) -> f64 {
    let open = |c: &Coordinate| match c {
        Coordinate::Open { low, high } => high - low,
        Coordinate::Tight { .. } => 0.0,
    };
    place.coordinates.iter().map(open).fold(0.0, f64::max)
}

/// Returns the direction, in the frame of a place, of the axis that the state fixes. For a fully constrained orientation,
/// this is the object's z axis; for one with several sides it is the axis about which they are.
pub(super) fn upright(state: &FrameState, place: &Place) -> Option<Vector3<f64>> {
    let axis = match state.turn {
        Turn::Free => return None,
        Turn::Axis { axis, .. } | Turn::Line { axis, .. } | Turn::Sides { axis, .. } => {
            Vector3::from(axis)
        }
        Turn::Full { .. } => Vector3::z(),
    };
    Some(place.pose().rotation() * axis)
}

/// How many times more exactly the heights of a place agree than its other coordinates. Sideways, hands and clearances differ.
const STEADY: f64 = 10.0;

/// Returns frames with the coordinate in which all places that show one agree most exactly.
pub(super) fn heights(states: &[FrameState]) -> Vec<(Frame, usize)> {
    let steady = |place: &Place| {
        let sds: Option<Vec<f64>> = place
            .coordinates
            .iter()
            .map(|c| match *c {
                Coordinate::Tight { sd, .. } => Some(sd),
                Coordinate::Open { .. } => None,
            })
            .collect();
        let sds = sds.filter(|_| place.count > 2)?;
        (0..3).find(|i| (0..3).all(|j| j == *i || sds[*i] * STEADY <= sds[j]))
    };
    let mut found: Vec<(Frame, Option<usize>)> = Vec::new();
    for (frame, axis) in states.iter().flat_map(|state| {
        state.places.iter().filter_map(|place| Some((&state.frame, steady(place)?)))
    }) {
        match found.iter_mut().find(|(own, _)| own == frame) {
            Some((_, known)) => *known = known.filter(|known| *known == axis),
            None => found.push((frame.clone(), Some(axis))),
        }
    }
    found.into_iter().filter_map(|(frame, axis)| Some((frame, axis?))).collect()
}

/// Returns, for each place on a table, the coordinates in which its objects agree.
pub(super) fn agreements(state: &FrameState) -> impl Iterator<Item = [bool; 3]> {
    let world = state.frame == Frame::World;
    state.places.iter().filter(move |_| world).map(|p| p.coordinates.map(|c| !c.is_open()))
}

/// Returns for each state, place and coordinate the difference from the nearest place of the same kind and frame that differs
/// in this coordinate alone; infinite if there is none.
pub(super) fn gaps(states: &[FrameState]) -> Vec<Vec<[f64; 3]>> {
    // How far two places are apart in a coordinate; `None` if one of them leaves it open.
    let apart = |a: &Place, b: &Place, i: usize| match (a.coordinates[i], b.coordinates[i]) {
        (Coordinate::Tight { mean: a, .. }, Coordinate::Tight { mean: b, .. }) => {
            Some((a - b).abs())
        }
        _ => None,
    };
    let near = |a: &Place, b: &Place, i: usize| apart(a, b, i).is_none_or(|m| m < FOUND_M);
    let of = |state: &FrameState, place: &Place| {
        std::array::from_fn(|i| {
            let same = states.iter().filter(|s| s.kind == state.kind && s.frame == state.frame);
            let others = same
                .flat_map(|s| &s.places)
                .filter(|other| (0..3).all(|j| j == i || near(place, other, j)));
            // Nearer ones differ in something else, such as their orientation.
            let gaps = others.filter_map(|other| apart(place, other, i));
            let gaps = gaps.filter(|gap| *gap > GAP * FLOOR.0);
            gaps.fold(f64::INFINITY, f64::min)
        })
    };
    states.iter().map(|s| s.places.iter().map(|p| of(s, p)).collect()).collect()
}

/// Returns the standard deviations of placed objects, pooled over all states.
pub(super) fn priors(states: &[FrameState]) -> Directions {
    let mut pool = Pool::default();
    for state in states.iter().filter(|s| rests(s)) {
        for place in &state.places {
            let dof = place.count.saturating_sub(1);
            let up = upright(state, place).unwrap_or_else(Vector3::z);
            for (i, coordinate) in place.coordinates.iter().enumerate() {
                if let Coordinate::Tight { sd, .. } = *coordinate {
                    pool.position(up[i], sd, dof);
                }
            }
        }
        if let Some(sd) = state.turn.sd() {
            let dof = state.places.iter().map(|p| p.count.saturating_sub(1)).sum();
            pool.tilt(sd, dof);
        }
    }
    pool.priors()
}
