//! Single linkage of positions, and their span, without comparing all pairs.

use std::collections::HashMap;

use crate::robot::Pose;

/// Members of the cells of a grid, by the numbers of the cell along the axes.
type Cells = HashMap<[i64; 3], Vec<usize>>;

/// Links poses over steps shorter than `width`. Returns for each the first of those that it is linked with.
///
/// All poses in a cell half as wide are linked, and a step leads at most two cells on. Two cells are compared until a
/// step between them is found, so only the poses at their borders cost more than a look.
pub(super) fn linked(poses: &[Pose], width: f64) -> Vec<usize> {
    let mut owner: Vec<usize> = (0..poses.len()).collect();
    let mut cells = Cells::new();
    for (index, pose) in poses.iter().enumerate() {
        let cell = pose.position.map(|v| (2.0 * v / width).floor() as i64);
        let members = cells.entry(cell).or_default();
        owner[index] = members.first().copied().unwrap_or(index);
        members.push(index);
    }
    let mut order: Vec<&[i64; 3]> = cells.keys().collect();
    order.sort_unstable();
    for cell in order {
        let own = &cells[cell];
        let beside = (0..125).map(|i| [i / 25 - 2, i / 5 % 5 - 2, i % 5 - 2]);
        for step in beside.filter(|step| *step > [0; 3]) {
            let Some(others) = cells.get(&std::array::from_fn(|i| cell[i] + step[i])) else {
                continue;
            };
            let (a, b) = (root(&mut owner, own[0]), root(&mut owner, others[0]));
            if a != b && meet(poses, own, others, width) {
                owner[a.max(b)] = a.min(b);
            }
        }
    }
    (0..poses.len()).map(|index| root(&mut owner, index)).collect()
}

/// Returns the first pose that a pose is linked with, and shortens the way to it.
fn root(owner: &mut [usize], index: usize) -> usize {
    let mut at = index;
    while owner[at] != at {
        owner[at] = owner[owner[at]];
        at = owner[at];
    }
    at
}

/// Returns whether some pose of one cell is nearer than `width` to one of another.
fn meet(poses: &[Pose], one: &[usize], other: &[usize], width: f64) -> bool {
    let bound = |axis: usize| {
        let values = other.iter().map(|b| poses[*b].position[axis]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
    };
    let bounds: [(f64, f64); 3] = std::array::from_fn(bound);
    let near = |a: &&usize| {
        let of = |axis: usize| poses[**a].position[axis];
        (0..3).all(|axis| bounds[axis].0 - of(axis) < width && of(axis) - bounds[axis].1 < width)
    };
    let mut near = one.iter().filter(near);
    near.any(|a| other.iter().any(|b| poses[*a].distance(&poses[*b]) < width))
}

/// Returns whether two of the poses are farther apart than `far`.
///
/// Two poses are no farther apart than their distances from the middle together, so the outermost are compared first.
pub(super) fn spans_more(poses: &[Pose], far: f64) -> bool {
    let sum = |axis: usize| poses.iter().map(|p| p.position[axis]).sum::<f64>();
    let middle = Pose::at(std::array::from_fn(|axis| sum(axis) / poses.len().max(1) as f64));
    let mut outer: Vec<(f64, &Pose)> = poses.iter().map(|p| (p.distance(&middle), p)).collect();
    outer.sort_by(|a, b| b.0.total_cmp(&a.0));
    // Rounding must not hide a pair.
    let enough = |a: f64, b: f64| a + b > far * (1.0 - 1e-9);
    let pairs = outer.iter().enumerate().take_while(|(_, a)| enough(outer[0].0, a.0));
    let mut pairs = pairs.map(|(i, a)| (a, &outer[..i]));
    pairs.any(|(a, before)| {
        let mut others = before.iter().take_while(|b| enough(a.0, b.0));
        others.any(|b| a.1.distance(b.1) > far)
    })
}
