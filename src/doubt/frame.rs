//! Doubts about the frame of reference: which axis points up, whether it is upright, and whether it stands still.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::turns::reordered;
use super::view::{Seen, View, spread};
use super::{Doubt, DoubtKind};

/// Heights agree if they differ by less, in metres, beyond noise: what rests on one table.
const LEVEL_M: f64 = 3e-3;
/// Positions differ if they spread over more, in metres.
const WIDE_M: f64 = 0.02;
/// Number of poses that show which way is up.
const ENOUGH: usize = 4;
/// Least tilt of a frame that is told, in radians: 4 degrees. A table is more level than that.
const TILTED_RAD: f64 = 0.07;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Returns the axis along which the resting heights of each kind agree; `None` if the poses do not tell.
pub(super) fn level(view: &View<'_>) -> Option<usize> {
    let mut votes = [0; 3];
    for seen in view.starts_by_kind.values().filter(|seen| seen.len() >= 3) {
        let over = |axis: usize| spread(seen.iter().map(|(_, s)| s.at[axis]));
        for (axis, vote) in votes.iter_mut().enumerate() {
            let others = (0..3).filter(|a| *a != axis).all(|a| over(a) > WIDE_M);
            if over(axis) < LEVEL_M + 6.0 * view.noise_m && others {
                *vote += seen.len();
            }
        }
    }
    let total: usize = votes.iter().sum();
    let best = (0..3).max_by_key(|axis| votes[*axis])?;
    (votes[best] >= ENOUGH && 5 * votes[best] >= 4 * total).then_some(best)
}

/// Share of the kinds whose z axis points along a direction when objects of the kind begin to rest.
pub(super) fn along(view: &View<'_>, up: Vector3<f64>) -> f64 {
    let near = (0.1 + 3.0 * view.noise_rad).min(0.5).cos();
    let kinds = &view.starts_by_kind;
    let points = |seen: &&Vec<(usize, Seen)>| {
        let own = seen.iter().filter(|(_, s)| (s.turn * Vector3::z()).dot(&up) > near);
        2 * own.count() > seen.len()
    };
    kinds.values().filter(points).count() as f64 / kinds.len().max(1) as f64
}

/// How often an object was put above another, and below one.
fn stacked(view: &View<'_>) -> (usize, usize) {
    let (mut above, mut below) = (0, 0);
    for demo in &view.demos {
        for (o, object) in demo.objects.iter().enumerate() {
            let (Some(first), Some(last)) = (object.first(), object.last()) else { continue };
            if (last.at - first.at).norm() < view.far_m() {
                continue;
            }
            for (r, other) in demo.objects.iter().enumerate() {
                let Some(under) = other.last().filter(|_| r != o && other.kind != object.kind)
                else {
                    continue;
                };
                let rose = (last.at - under.at).z;
                let still = other.first().is_some_and(|f| (f.at - under.at).norm() < view.same_m());
                if still && (last.at - under.at).xy().norm() < 0.015 && rose.abs() > 8e-3 {
                    if rose > 0.0 { above += 1 } else { below += 1 }
                }
            }
        }
    }
    (above, below)
}

/// Returns whether any object is carried to another coordinate along an axis.
fn lifted(view: &View<'_>, axis: usize) -> bool {
    let far = LEVEL_M + 6.0 * view.noise_m;
    let mut ends = view
        .demos
        .iter()
        .flat_map(|demo| &demo.objects)
        .filter_map(|object| Some(object.last()?.at[axis] - object.first()?.at[axis]));
    ends.any(|by| by.abs() > far)
}

/// Doubts about which way is up.
pub(super) fn up(view: &View<'_>) -> Vec<Doubt> {
    let level = level(view);
    if let Some(axis) = level.filter(|axis| *axis != 2) {
        // A recording whose bodies stand along y as well is right in a frame with y up.
        let up = Vector3::ith(axis, 1.0);
        let (own, z) = (along(view, up).max(along(view, -up)), along(view, Vector3::z()));
        // What stands along z and is never lifted along the axis is moved about on a wall.
        let wall = z > own && !lifted(view, axis);
        if wall || axis == 1 && own > z {
            return Vec::new();
        }
        return vec![
            Doubt::new(
                DoubtKind::UpAxis,
                "",
                format!("objects of a kind rest at one {}, not at one z", AXES[axis]),
            )
            .reading(format!("{} probably points up, or two axes are exchanged", AXES[axis]))
            .ask(format!(
                "import the log with `up` set to `{}`, or exchange the columns",
                AXES[axis]
            )),
        ];
    }
    let heights: Vec<f64> = view.starts().map(|(_, _, s)| s.at.z).collect();
    let (low, high) = heights.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    let lowered = high < 5e-3 && low < -5e-3;
    let (above, below) = stacked(view);
    let sinks = below >= 2 && below > 2 * above;
    // What is put onto other things rests on them: only z upwards shows that, wherever the table stands.
    let rests = above >= 2 && above > 2 * below;
    let stands = along(view, Vector3::z());
    let hangs = along(view, -Vector3::z()) > 0.69 && stands == 0.0;
    // Most objects begin on the table, which is the lowest plane, and not the highest.
    let top = heights.iter().filter(|h| high - **h < 0.25 * (high - low)).count();
    let ceiling = high - low > 0.01 && 10 * top > 6 * heights.len();
    let floor = heights.iter().filter(|h| **h - low < 0.25 * (high - low)).count();
    let floor = high - low > 0.01 && 10 * floor > 6 * heights.len();
    // A table at 0 with everything below it.
    let under = high > -0.06 && !floor;
    // Where things stand upright, their heights alone do not tell.
    let heights = stands <= 0.69 && (hangs || ceiling || under);
    let down = lowered && (sinks || heights) || hangs && !floor && !reordered(view);
    if down && !rests {
        let seen = if lowered {
            format!("z is {low:.3} to {high:.3} m at the start: nothing is above 0")
        } else {
            "the z axes of nearly all objects point down, and most begin at the greatest z".into()
        };
        return vec![
            Doubt::new(DoubtKind::UpsideDown, "", seen)
                .reading("z probably points down")
                .ask("import the log with `up` set to `-z`"),
        ];
    }
    Vec::new()
}

/// Doubts about a camera's frame: tilted, or moving.
pub(super) fn camera(view: &View<'_>) -> Vec<Doubt> {
    let mut all = Vec::new();
    let tilt = |normal: Vector3<f64>| {
        let near = (0..3).map(|i| normal[i].abs()).fold(0.0, f64::max);
        near.min(1.0).acos()
    };
    // The direction in which most bodies stand, and the normal of the planes on which they lie.
    let standing = common_axis(view);
    let normal = if level(view).is_none() { plane(view) } else { None };
    let found = [standing, normal].into_iter().flatten().find(|n| tilt(*n) > TILTED_RAD);
    if let Some(normal) = found {
        let degrees = tilt(normal).to_degrees();
        let shown = normal.map(|v| (v * 100.0).round() / 100.0 + 0.0);
        all.push(Doubt::new(
            DoubtKind::TiltedFrame,
            "",
            format!(
                "objects stand and lie along ({}, {}, {}), {degrees:.0} degrees off every axis",
                shown.x, shown.y, shown.z
            ),
        ));
    }
    for demo in &view.demos {
        let (mut moved, mut steps) = (0, 0);
        let mut far = 0.0f64;
        for s in 1..demo.len() {
            let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = (demo.objects.iter())
                .filter_map(|o| Some((o.seen[s - 1]?.at, o.seen[s]?.at)))
                .collect();
            if pairs.len() < 3 {
                continue;
            }
            steps += 1;
            let least = 2e-3 + 6.0 * view.noise_m;
            let shifted = pairs.iter().filter(|(a, b)| (a - b).norm() > least).count();
            // All but what the hand carries.
            if shifted + 1 >= pairs.len() && shifted >= 3 {
                moved += 1;
                far = pairs.iter().map(|(a, b)| (a - b).norm()).fold(far, f64::max);
            }
        }
        if steps >= 3 && 2 * moved > steps {
            all.push(Doubt::new(
                DoubtKind::MovingCamera,
                format!("demo {}", demo.number),
                format!(
                    "in {moved} of {steps} steps nearly all objects move, by up to {:.0} mm",
                    far * 1e3
                ),
            ));
        }
    }
    all
}

/// Returns the direction along which the z axes of at least seven in ten resting bodies point.
fn common_axis(view: &View<'_>) -> Option<Vector3<f64>> {
    let axes: Vec<Vector3<f64>> = view.starts().map(|(_, _, s)| s.turn * Vector3::z()).collect();
    let near = (0.05 + 3.0 * view.noise_rad).min(0.4).cos();
    let sample = axes.iter().step_by(axes.len().div_ceil(100).max(1));
    let with = |a: &Vector3<f64>| axes.iter().filter(|b| a.dot(b) > near).count();
    let best = sample.max_by_key(|a| with(a))?;
    let enough = axes.len() >= ENOUGH && 10 * with(best) >= 7 * axes.len();
    let sum: Vector3<f64> = axes.iter().filter(|b| best.dot(b) > near).sum();
    enough.then(|| sum.try_normalize(1e-9)).flatten()
}

/// Returns the normal of parallel planes, one a kind, on which objects begin.
pub(super) fn plane(view: &View<'_>) -> Option<Vector3<f64>> {
    let mut pooled = Matrix3::zeros();
    let mut freedom = 0usize;
    for seen in view.starts_by_kind.values().filter(|seen| seen.len() >= 3) {
        let mean = seen.iter().map(|(_, s)| s.at).sum::<Vector3<f64>>() / seen.len() as f64;
        for (_, s) in seen {
            pooled += (s.at - mean) * (s.at - mean).transpose();
        }
        freedom += seen.len() - 1;
    }
    if freedom < 6 {
        return None;
    }
    let eigen = SymmetricEigen::new(pooled / freedom as f64);
    let least = eigen.eigenvalues.imin();
    let sd = |i: usize| eigen.eigenvalues[i].max(0.0).sqrt();
    let flat = sd(least) < 2e-3 + 3.0 * view.noise_m;
    let wide = (0..3).filter(|i| *i != least).all(|i| sd(i) > 0.03);
    (flat && wide).then(|| eigen.eigenvectors.column(least).into())
}
