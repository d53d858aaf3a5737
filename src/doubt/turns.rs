//! Doubts about orientations: the order of quaternions, the unit of angles, and handedness.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::frame::{level, plane};
use super::view::{Seen, View, middle, spread};
use super::{Doubt, DoubtKind};

/// What was read as x, y, z, w, read as w, x, y, z.
fn wxyz(q: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(q.i, q.j, q.k, q.w))
}

/// How upright resting bodies are, as shares of them, as read and reordered.
struct Upright {
    /// Bodies whose z axis points up.
    stand: (f64, f64),
    /// Bodies with some axis along the vertical, or with a level z axis, as those that stand or lie on a face or a side.
    aligned: (f64, f64),
    count: usize,
    kinds: usize,
    /// Whether the objects do not lie on planes that are tilted.
    level: bool,
}

/// Returns the vertical axis, and whether objects do not lie on tilted planes.
fn vertical(view: &View<'_>) -> (usize, bool) {
    let axis = |n: Vector3<f64>| n.iter().any(|v| v.abs() > 0.998);
    (level(view).unwrap_or(2), plane(view).is_none_or(axis))
}

fn upright(view: &View<'_>, only: Option<usize>, (axis, level): (usize, bool)) -> Upright {
    let near = (0.09 + 3.0 * view.noise_rad).min(0.5).cos();
    let flat = (1.0 - near * near).sqrt();
    let demos = view.demos.iter().enumerate().filter(|(d, _)| only.is_none_or(|o| o == *d));
    let (mut turns, mut kinds) = (Vec::new(), BTreeSet::new());
    for object in demos.flat_map(|(_, demo)| &demo.objects) {
        let Some((first, last)) = object.first().zip(object.last()) else { continue };
        kinds.insert(object.kind);
        turns.push(first.turn);
        if first.turn.angle_to(&last.turn) > 0.1 {
            turns.push(last.turn);
        }
    }
    let share = |is: &dyn Fn(&UnitQuaternion<f64>) -> bool| {
        turns.iter().filter(|turn| is(turn)).count() as f64 / turns.len().max(1) as f64
    };
    // The vertical in the frame of the body.
    let down = |turn: &UnitQuaternion<f64>| turn.inverse() * Vector3::<f64>::ith(axis, 1.0);
    let stands = |turn: &UnitQuaternion<f64>| down(turn).z > near;
    let aligned = |turn: &UnitQuaternion<f64>| {
        let down = down(turn);
        down.z.abs() < flat || down.iter().any(|v| v.abs() > near)
    };
    Upright {
        stand: (share(&stands), share(&|turn| stands(&wxyz(turn)))),
        aligned: (share(&aligned), share(&|turn| aligned(&wxyz(turn)))),
        count: turns.len(),
        kinds: kinds.len(),
        level,
    }
}

impl Upright {
    /// Whether bodies stand upright only in the other order.
    fn is_other(&self) -> bool {
        let (read, other) = self.stand;
        let stands = self.count >= 3 && self.kinds >= 2 && read <= 0.2 && other >= 0.7;
        let (read, other) = self.aligned;
        stands
            || self.level && self.count >= 5 && read <= 0.4 && other >= 0.6 && other - read >= 0.4
    }
}

/// Returns whether bodies stand upright only if quaternions are read as w, x, y, z.
pub(super) fn reordered(view: &View<'_>) -> bool {
    upright(view, None, vertical(view)).is_other()
}

/// Doubts about the order of quaternions and the unit of angles.
pub(super) fn order(view: &View<'_>) -> Vec<Doubt> {
    let vertical = vertical(view);
    let whole = upright(view, None, vertical);
    let doubt = |place: String, found: &Upright| {
        let percent = |share: f64| 100.0 * share;
        let (read, other) =
            if found.stand.1 - found.stand.0 >= 0.5 { found.stand } else { found.aligned };
        Doubt::new(
            DoubtKind::QuaternionOrder,
            place,
            format!(
                "{:.0}% of the resting objects are upright; read as w, x, y, z, {:.0}% are",
                percent(read),
                percent(other)
            ),
        )
    };
    if whole.is_other() {
        return vec![doubt(String::new(), &whole)];
    }
    let mut all = Vec::new();
    for (d, demo) in view.demos.iter().enumerate().filter(|_| view.demos.len() > 1) {
        let own = upright(view, Some(d), vertical);
        if own.is_other() {
            all.push(doubt(format!("demo {}", demo.number), &own));
        }
    }
    // Angles in radians that were taken for degrees are below pi degrees, and differ within them.
    let angles: Vec<f64> = (view.starts())
        .filter(|(_, object, _)| object.last().is_some())
        .map(|(_, _, s)| s.turn.angle().to_degrees())
        .collect();
    let greatest = angles.iter().copied().fold(0.0, f64::max);
    let above = angles.iter().filter(|a| **a > 0.3).count();
    let quiet = view.noise_rad.to_degrees() < 0.05;
    if quiet && (1.2..3.2).contains(&greatest) && above >= 6 && 3 * above >= angles.len() {
        all.push(
            Doubt::new(
                DoubtKind::AngleUnit,
                "",
                format!("no object is turned by more than {greatest:.2} degrees"),
            )
            .reading(format!(
                "angles in radians were probably taken for degrees: {:.0} degrees at most",
                greatest.to_radians().to_degrees().to_degrees()
            ))
            .ask("import the log with `angle` set to `rad`"),
        );
    }
    all
}

/// Number of places that are compared with each other.
const MOST_PLACES: usize = 300;

/// From a turned object to one beside it, and how it is turned.
type Beside = (Vector3<f64>, UnitQuaternion<f64>);

/// Doubts about handedness: where objects are placed beside turned ones, the places agree in the frames of these only if
/// positions and orientations have one handedness.
pub(super) fn handed(view: &View<'_>) -> Vec<Doubt> {
    let axis = level(view).unwrap_or(2);
    // Ends of carried objects, each with the nearest object of every other kind.
    let mut pairs: BTreeMap<(&str, &str), Vec<Beside>> = BTreeMap::new();
    for demo in &view.demos {
        for object in &demo.objects {
            let (Some(first), Some(last)) = (object.first(), object.last()) else { continue };
            if (first.at - last.at).norm() < view.far_m() {
                continue;
            }
            let mut near: BTreeMap<&str, (f64, Seen)> = BTreeMap::new();
            for other in demo.objects.iter().filter(|o| o.kind != object.kind) {
                let Some(seen) = other.last() else { continue };
                let far = (seen.at - last.at).norm();
                let best = near.entry(other.kind).or_insert((far, seen));
                if far < best.0 {
                    *best = (far, seen);
                }
            }
            for (kind, (_, seen)) in near {
                pairs.entry((object.kind, kind)).or_default().push((last.at - seen.at, seen.turn));
            }
        }
    }
    let mut flat = Vector3::repeat(1.0);
    flat[(axis + 1) % 3] = -1.0;
    let mut found: Vec<(f64, f64, &str, &str)> = Vec::new();
    for ((object, reference), places) in &pairs {
        let places = &places[..places.len().min(MOST_PLACES)];
        let heading = |turn: &UnitQuaternion<f64>| {
            let x = turn * Vector3::ith((axis + 1) % 3, 1.0);
            x[(axis + 2) % 3].atan2(x[(axis + 1) % 3])
        };
        let turned = spread(places.iter().map(|(_, turn)| heading(turn)));
        if places.len() < 4 || turned < 0.35 {
            continue;
        }
        let nearest = |read: &dyn Fn(&Vector3<f64>) -> Vector3<f64>| {
            let own: Vec<Vector3<f64>> =
                places.iter().map(|(to, turn)| turn.inverse() * read(to)).collect();
            let near = |(i, a): (usize, &Vector3<f64>)| {
                let others = own.iter().enumerate().filter(|(j, _)| *j != i);
                others.map(|(_, b)| (a - b).norm()).fold(f64::MAX, f64::min)
            };
            middle(&mut own.iter().enumerate().map(near).collect::<Vec<_>>())
        };
        let read = nearest(&|to| *to);
        let mirrored = nearest(&|to| to.component_mul(&flat));
        found.push((read, mirrored, object, reference));
    }
    // Some relation holds as read: the handedness is right.
    let tight = |m: f64| m < 5e-3 + 6.0 * view.noise_m;
    if found.iter().any(|(read, mirrored, ..)| tight(*read) && !tight(*mirrored)) {
        return Vec::new();
    }
    let clear = |f: &&(f64, f64, &str, &str)| tight(f.1) && f.0 > 4e-3 && f.1 < 0.2 * f.0;
    let best = found.iter().filter(clear).max_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)));
    best.map(|(read, mirrored, object, reference)| Doubt::new(DoubtKind::LeftHanded, "", format!(
            "places of `{object}` beside a turned `{reference}` differ by {:.0} mm, and mirrored by \
             {:.1} mm",
            read * 1e3,
            mirrored * 1e3
        )))
    .into_iter()
    .collect()
}
