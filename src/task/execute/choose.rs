//! From an action to a part and a target: the effect state's mean, and a part in the state that it is
//! taken from.

use crate::task::domain::{Domain, Grounded, Operator, Snapshot, StateId};
use crate::task::skill::Target;

/// Where the action would put its part; `None` if that state has no place.
pub(super) fn target(domain: &Domain, operator: &Operator) -> Option<Target> {
    let state = domain[operator.to].learned.as_ref()?;
    let [x, y, z, w] = state.mean.orientation;
    // The third column of the rotation: where the mean pose points the part's axis.
    let axis = [2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)];
    Some(Target { position: state.mean.position, axis })
}

/// Objects that the action can be done with, by their places in the snapshot: those of its kind in the
/// state that it is taken from, or, if it was not always taken from one, any that is not where it
/// would be put.
pub(super) fn candidates(operator: &Operator, seen: &Snapshot, states: &[Grounded]) -> Vec<usize> {
    let fits = |state: Option<StateId>| match operator.from {
        Some(_) => state == operator.from,
        None => state != Some(operator.to),
    };
    seen.objects
        .iter()
        .zip(states)
        .enumerate()
        .filter(|(_, (object, grounded))| *object.kind == *operator.kind() && fits(grounded.state))
        .map(|(index, _)| index)
        .collect()
}

/// Whether another object of the same kind lies where the part would be put, as far along the table as
/// [`Handling::in_the_way_m`](crate::task::scene::Handling) says.
pub(super) fn occupied(
    seen: &Snapshot,
    operator: &Operator,
    part: usize,
    target: &Target,
    in_the_way_m: f64,
) -> bool {
    seen.objects.iter().enumerate().any(|(index, object)| {
        let [x, y, _] = object.pose.position;
        let near = (x - target.position[0]).hypot(y - target.position[1]) < in_the_way_m;
        index != part && *object.kind == *operator.kind() && near
    })
}
