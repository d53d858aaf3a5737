//! Turns an action into a target and candidate parts. The target is the mean pose of the operator's `to` state. The
//! candidates are the parts in its `from` state.

use crate::task::domain::{Domain, Grounded, Operator, Snapshot, StateId};
use crate::task::skill::Target;

/// Returns the target of the action; `None` if the operator's `to` state has no mean pose.
pub(super) fn target(domain: &Domain, operator: &Operator) -> Option<Target> {
    let state = domain[operator.to].learned.as_ref()?;
    let [x, y, z, w] = state.mean.orientation;
    // The third column of the rotation matrix: the direction of the part's axis in the mean pose.
    let axis = [2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)];
    Some(Target::along(state.mean.position, axis))
}

/// Returns the objects that the action can move, by their index in the snapshot: objects of its kind in the operator's
/// `from` state. Without a `from` state, these are all objects of its kind that are not in the `to` state.
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

/// Returns whether another object of the same kind lies within `in_the_way_m` of the target, measured along
/// the table (see [`Handling::in_the_way_m`](crate::task::scene::Handling)).
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
