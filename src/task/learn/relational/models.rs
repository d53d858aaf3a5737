//! Fits the models of states: places, open coordinates and constrained orientations.

use nalgebra::{Matrix3, Vector3};

use super::frames::Frames;
use super::likelihood::{
    BY_CHANCE, Likelihood, SIDES, SYMMETRIC, Spread, about, folded, off_line, overall,
};
use super::motion::Came;
use super::places::Group;
use crate::robot::{Pose, mean_orientation};
use crate::task::domain::gaussian::{MIN_DISTINCT, WILD_RAD};
use crate::task::domain::{Coordinate, Frame, FrameState, Origin, Place, ROOMY_M, Turn};
use crate::task::learn::gaussian::robust_mean;

/// Number of poses below which a loose agreement is taken for chance.
const FEW: usize = 8;
/// Standard deviation of turns about an axis, as a share of the turn from one side to the next, up to which sides are told apart.
const NARROW: f64 = 1.0 / 16.0;
/// Spread of a loose agreement, in standard deviations of careful placing.
const CHANCE_SD: f64 = 5.0;
/// Angle from a line from which an object does not lie along it, in standard deviations: one of 3,000 does by chance.
const ASIDE_SD: f64 = 4.0;

impl Frames<'_, '_> {
    /// Fits the model of a state, which gets its name when all states are known.
    pub fn model(&self, (kind, turn_matters): (usize, bool), groups: &[Group]) -> FrameState {
        let frame = groups[0].frame;
        let rests: Vec<usize> = groups.iter().flat_map(|g| g.rests.clone()).collect();
        let count = rests.len();
        let came = rests.iter().map(|r| self.motion.rests[*r].came);
        let found = came.clone().filter(|came| *came == Came::Found).count();
        let put = came.filter(|came| matches!(came, Came::Placed(_))).count();
        // Where something else moved it says neither.
        let origin = if found > put { Origin::Found } else { Origin::Placed };
        let likelihood = Likelihood::of_placing(&self.motion.noise, count);
        let poses: Vec<Vec<Pose>> = groups
            .iter()
            .map(|g| {
                let rests = self.without_chance(g, origin);
                rests.iter().filter_map(|r| self.pose(*r, frame)).collect()
            })
            .collect();
        let turn = turn(&poses, origin, &likelihood);
        let places: Vec<Place> =
            poses.iter().map(|p| self.place(p, &turn, frame, &likelihood)).collect();
        let frame = match frame.checked_sub(1) {
            None => Frame::World,
            Some(k) => Frame::Kind(self.kinds[k].to_string()),
        };
        let own = &self.kinds[kind];
        let named_world = frame == Frame::World;
        FrameState {
            name: String::new(),
            kind: own.to_string(),
            frame,
            turn,
            turn_matters,
            origin,
            count,
            // Two or three found objects can agree in a coordinate by chance.
            any_coordinate: origin == Origin::Found
                && named_world
                && count < MIN_DISTINCT
                && places.len() == 1,
            places,
        }
    }

    /// Returns the rests from which a place is learned. A few objects that were found beside many that were put there agree
    /// with them in some coordinate by chance, such as rollers at the height of the rollers in their bin.
    fn without_chance(&self, group: &Group, origin: Origin) -> Vec<usize> {
        let put = |r: &&usize| self.motion.rests[**r].came != Came::Found;
        let placed: Vec<usize> = group.rests.iter().filter(put).copied().collect();
        let few = 4 * (group.rests.len() - placed.len()) <= group.rests.len();
        if group.frame > 0 && origin == Origin::Placed && few {
            placed
        } else {
            group.rests.clone()
        }
    }

    fn place(&self, poses: &[Pose], turn: &Turn, frame: usize, likelihood: &Likelihood) -> Place {
        let n = poses.len();
        let extent = self.extent_in(frame);
        let mut coordinates: [Coordinate; 3] = std::array::from_fn(|i| {
            let mut values: Vec<f64> = poses.iter().map(|p| p.position[i]).collect();
            let spread = Spread::over(values.iter().copied());
            let (tight, open) =
                spread.map_or((0.0, 0.0), |s| likelihood.coordinate(n, &s, extent[i]));
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            let (low, high) = range(&sorted, frame > 0);
            if tight >= open {
                let mean = robust_mean(&mut values);
                let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
                let sd = (squares / n.saturating_sub(1).max(1) as f64).sqrt();
                if sd > ROOMY_M {
                    Coordinate::Open { low, high }
                } else {
                    Coordinate::Tight { mean, sd }
                }
            } else {
                Coordinate::Open { low, high }
            }
        });
        // Beside an open coordinate, few poses that agree loosely in another one agree by chance.
        let careful = CHANCE_SD * likelihood.scale_m;
        if n < FEW && coordinates.iter().any(|c| c.is_open()) {
            for (i, coordinate) in coordinates.iter_mut().enumerate() {
                if matches!(coordinate, Coordinate::Tight { sd, .. } if *sd > careful) {
                    let values = poses.iter().map(|p| p.position[i]);
                    let low = values.clone().fold(f64::INFINITY, f64::min);
                    *coordinate = Coordinate::Open { low, high: values.fold(low, f64::max) };
                }
            }
        }
        Place { coordinates, orientation: central(poses, turn), count: n }
    }
}

/// Returns the range of sorted values. Of many, a fiftieth at each end may belong elsewhere. Beside an object
/// (`in_frame`), a single value that is farther from all others than these span belongs elsewhere: something was dropped
/// or rolled away.
fn range(sorted: &[f64], in_frame: bool) -> (f64, f64) {
    let n = sorted.len();
    let (mut from, mut to) = (n / 50, n - 1 - n / 50);
    if in_frame && n >= FEW {
        let span = |a: usize, b: usize| sorted[b] - sorted[a];
        if span(to - 1, to) > span(from, to - 1) {
            to -= 1;
        } else if span(from, from + 1) > span(from + 1, to) {
            from += 1;
        }
    }
    (sorted[from], sorted[to])
}

/// Chooses how a state constrains the orientation.
fn turn(places: &[Vec<Pose>], origin: Origin, likelihood: &Likelihood) -> Turn {
    let mut logs = [0.0; 3];
    let (mut by_axis, mut all, mut free) = ([0.0; 3], 0.0, 0.0);
    for poses in places {
        let sum: Matrix3<f64> =
            poses.iter().map(|p| *p.rotation().to_rotation_matrix().matrix()).sum();
        let n = poses.len();
        logs.iter_mut().zip(likelihood.turn(n, &sum, 0.0)).for_each(|(a, b)| *a += b);
        by_axis.iter_mut().zip(about(n, &sum)).for_each(|(a, b)| *a += b);
        all += overall(n, &sum);
        free += n.saturating_sub(1) as f64;
    }
    let sd = |squares: f64, dof: f64| (squares.max(0.0) / (dof * f64::max(free, 1.0))).sqrt();
    let best = (0..3).min_by(|a, b| by_axis[*a].total_cmp(&by_axis[*b])).unwrap_or(2);
    if origin == Origin::Placed
        && let Some(alike) = sides(places, best, likelihood, logs[0].max(logs[1]).max(logs[2]))
    {
        return alike;
    }
    if origin == Origin::Placed
        && let Some(line) = line(places, likelihood, logs[0].max(logs[1]).max(logs[2]))
    {
        return line;
    }
    if free == 0.0 || logs[0] >= logs[1].max(logs[2]) {
        return Turn::Free;
    }
    if logs[2] >= logs[1] && sd(all, 3.0) < WILD_RAD {
        return Turn::Full { sd: sd(all, 3.0) };
    }
    let spread = sd(by_axis[best], 2.0);
    if spread >= WILD_RAD {
        return Turn::Free;
    }
    let mut axis = [0.0; 3];
    axis[best] = 1.0;
    Turn::Axis { axis, sd: spread }
}

fn matrices(places: &[Vec<Pose>]) -> Vec<Vec<Matrix3<f64>>> {
    let turned = |p: &Pose| *p.rotation().to_rotation_matrix().matrix();
    places.iter().map(|poses| poses.iter().map(turned).collect()).collect()
}

/// Returns that objects were put down along a line with either end ahead, such as pens into a tray, if that is likelier than `other`, the
/// best evidence for another turn, and not by chance.
fn line(places: &[Vec<Pose>], likelihood: &Likelihood, other: f64) -> Option<Turn> {
    let all = matrices(places);
    let evidence = |axis: usize| {
        let several = all.iter().filter(|turns| turns.len() > 1);
        several.map(|turns| likelihood.line(turns, axis, 0.0)).sum::<f64>() - 9f64.ln()
    };
    let best = (0..3).max_by(|a, b| evidence(*a).total_cmp(&evidence(*b)))?;
    let free: usize = all.iter().map(|turns| turns.len().saturating_sub(1)).sum();
    let off: Vec<(f64, f64)> = all.iter().map(|turns| off_line(turns, best)).collect();
    let squares: f64 = off.iter().map(|(squares, _)| squares).sum();
    let sd = (squares.max(0.0) / (2.0 * free.max(1) as f64)).sqrt();
    let mut axis = [0.0; 3];
    axis[best] = 1.0;
    // Cubes that happen to lie on the same face, but for a few, lie on any.
    let farthest = off.iter().map(|(_, farthest)| *farthest).fold(0.0, f64::max);
    let near = farthest <= ASIDE_SD * sd.max(likelihood.scale_rad);
    let likely = free >= SYMMETRIC && evidence(best) > other + BY_CHANCE && sd < WILD_RAD && near;
    likely.then_some(Turn::Line { axis, sd })
}

/// Returns that objects which were put down turned by parts of a full turn about an axis look alike from so many sides, if that is
/// likelier than `other`, the best evidence for another turn, and not by chance.
fn sides(places: &[Vec<Pose>], axis: usize, likelihood: &Likelihood, other: f64) -> Option<Turn> {
    let all = matrices(places);
    let count: usize = all.iter().map(Vec::len).sum();
    // About an axis that lies, a part rolls: from which side a hand can take it is not what was meant.
    let stands = |turns: &Vec<Matrix3<f64>>| {
        let sum: Matrix3<f64> = turns.iter().sum();
        sum.column(axis).normalize().z.abs() > 0.9
    };
    if count < SYMMETRIC || !all.iter().all(stands) {
        return None;
    }
    let prior = -(3.0 * SIDES.len() as f64).ln();
    let evidence = |sides: f64| {
        let several = all.iter().filter(|turns| turns.len() > 1);
        prior + several.map(|turns| likelihood.sides(turns, (axis, sides), 0.0)).sum::<f64>()
    };
    // From one side, turns about the axis may be less exact than tilts.
    let other = other.max(evidence(1.0));
    let evidence = SIDES.map(evidence);
    let best = (0..4).max_by(|a, b| evidence[*a].total_cmp(&evidence[*b]))?;
    let free = all.iter().map(|turns| turns.len().saturating_sub(1)).sum::<usize>().max(1) as f64;
    let around: f64 = all.iter().map(|turns| folded(turns, axis, SIDES[best])).sum();
    let tilt: f64 = all.iter().map(|turns| about(turns.len(), &turns.iter().sum())[axis]).sum();
    let sd = ((around + tilt).max(0.0) / (3.0 * free)).sqrt();
    let likely = evidence[best] > other + BY_CHANCE && sd < WILD_RAD;
    let clear = around.max(0.0) / free < (NARROW * std::f64::consts::TAU / SIDES[best]).powi(2);
    let mut unit = [0.0; 3];
    unit[axis] = 1.0;
    (likely && clear).then_some(Turn::Sides { axis: unit, sides: SIDES[best] as u8, sd })
}

/// Returns the orientation of a place: the mean if it is fully constrained, else that of the most central pose. Of an object that looks
/// alike from several sides, it is the mean from the side of the first pose.
fn central(poses: &[Pose], turn: &Turn) -> [f64; 4] {
    let first = poses.first();
    let faced = |p: &Pose| first.map_or(p.orientation, |first| turn.faced(p, first).orientation);
    let all: Vec<[f64; 4]> = poses.iter().map(faced).collect();
    let mean = mean_orientation(&all).unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let along = |p: &Pose| match turn {
        Turn::Axis { axis, .. } => p.rotation() * Vector3::from(*axis),
        _ => Vector3::zeros(),
    };
    let sum: Vector3<f64> = poses.iter().map(along).sum();
    let off = |p: &Pose| match turn {
        Turn::Axis { .. } => along(p).angle(&sum),
        _ => {
            let dot: f64 = p.orientation.iter().zip(mean).map(|(a, b)| a * b).sum();
            1.0 - dot.abs()
        }
    };
    let middle = poses.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    match turn {
        Turn::Full { .. } | Turn::Line { .. } | Turn::Sides { .. } => mean,
        _ => middle.map_or(mean, |p| p.orientation),
    }
}

#[cfg(test)]
#[path = "../../../../tests/unit/learn_models.rs"]
mod tests;
