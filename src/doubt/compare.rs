//! Doubts about a demonstration that disagrees with the others: mirrored, shifted, in another frame, below the table, under
//! other ids, or played backwards.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::view::{View, middle};
use super::{Doubt, DoubtKind};

/// Distance by which a fixed object is elsewhere, in metres.
const ELSEWHERE_M: f64 = 0.02;
/// Distance within which a fixed object is in the same place in other demonstrations, in metres, beyond noise.
const FIXED_M: f64 = 4e-3;
/// Number of demonstrations in which something has to agree before one can disagree with it.
const OTHERS: usize = 2;

/// Number of demonstrations that are compared with all others: the cost grows with it and with their number.
const MOST_COMPARED: usize = 200;

/// An object that is in one place at the start of the other demonstrations: the place, and where it is now.
struct Anchor {
    usual: Vector3<f64>,
    now: Vector3<f64>,
}

/// Returns the median of positions that all agree; `None` if some differ.
fn agreed(view: &View<'_>, places: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    if places.len() < OTHERS {
        return None;
    }
    let median =
        Vector3::from_fn(|i, _| middle(&mut places.iter().map(|p| p[i]).collect::<Vec<_>>()));
    let near = |p: &Vector3<f64>| (p - median).norm() < FIXED_M + 6.0 * view.noise_m;
    places.iter().all(near).then_some(median)
}

/// Returns the objects that are in one place at the start of all demonstrations but `demo`.
fn anchors(view: &View<'_>, demo: usize) -> Vec<Anchor> {
    let mut starts: BTreeMap<&str, Vec<(usize, Vector3<f64>)>> = BTreeMap::new();
    for (d, object, seen) in view.starts() {
        starts.entry(object.id).or_default().push((d, seen.at));
    }
    let anchor = |places: Vec<(usize, Vector3<f64>)>| {
        let now = places.iter().find(|(d, _)| *d == demo)?.1;
        let others: Vec<Vector3<f64>> =
            places.iter().filter(|(d, _)| *d != demo).map(|(_, at)| *at).collect();
        Some(Anchor { usual: agreed(view, &others)?, now })
    };
    starts.into_values().filter_map(anchor).collect()
}

/// Returns the kinds that begin at one height in all demonstrations but `demo`: that height, and the coordinates now.
fn heights(view: &View<'_>, demo: usize) -> BTreeMap<String, (f64, Vec<Vector3<f64>>)> {
    let near = FIXED_M + 6.0 * view.noise_m;
    let kinds = view.starts_by_kind().into_iter().filter_map(|(kind, seen)| {
        let (own, others): (Vec<_>, Vec<_>) = seen.into_iter().partition(|(d, _)| *d == demo);
        let mut zs: Vec<f64> = others.iter().map(|(_, s)| s.at.z).collect();
        let usual = middle(&mut zs);
        let agree = zs.len() >= OTHERS && zs.iter().all(|z| (z - usual).abs() < near);
        (agree && !own.is_empty())
            .then(|| (kind.to_owned(), (usual, own.into_iter().map(|(_, s)| s.at).collect())))
    });
    kinds.collect()
}

/// Where objects of a kind begin, from above: the box of the other demonstrations, and the positions now.
struct Region {
    low: [f64; 2],
    high: [f64; 2],
    now: Vec<Vector3<f64>>,
}

impl Region {
    fn holds(&self, at: &Vector3<f64>) -> bool {
        (0..2).all(|i| self.low[i] <= at[i] && at[i] <= self.high[i])
    }

    fn middle(&self) -> Vector3<f64> {
        Vector3::new(0.5 * (self.low[0] + self.high[0]), 0.5 * (self.low[1] + self.high[1]), 0.0)
    }
}

/// Number of poses that show where objects of a kind begin.
const MANY: usize = 4;

/// Returns where the objects of each kind begin in all demonstrations but `demo`. A few poses do not show the whole box, so it
/// is half as wide again to each side, and as wide again if they are very few.
fn boxes<'a>(view: &View<'a>, demo: usize) -> BTreeMap<&'a str, Region> {
    let kinds = view.starts_by_kind().into_iter().filter_map(|(kind, seen)| {
        let (own, others): (Vec<_>, Vec<_>) = seen.into_iter().partition(|(d, _)| *d == demo);
        let end = |i: usize, sign: f64| {
            let all = others.iter().map(|(_, s)| sign * s.at[i]);
            sign * all.fold(f64::MAX, f64::min)
        };
        let share = if others.len() < 2 * MANY { 1.0 } else { 0.5 };
        let wide = |i: usize| share * (end(i, -1.0) - end(i, 1.0)) + 0.01;
        let region = Region {
            low: [0, 1].map(|i| end(i, 1.0) - wide(i)),
            high: [0, 1].map(|i| end(i, -1.0) + wide(i)),
            now: own.into_iter().map(|(_, s)| s.at).collect(),
        };
        (others.len() >= MANY && !region.now.is_empty()).then_some((kind, region))
    });
    kinds.collect()
}

/// A demonstration whose objects begin outside of where their kinds do in the others, and in there if it is mirrored or
/// shifted.
fn region(view: &View<'_>, d: usize, place: &str, boxes: &BTreeMap<&str, Region>) -> Option<Doubt> {
    let all: Vec<(&Region, Vector3<f64>)> =
        boxes.values().flat_map(|r| r.now.iter().map(move |at| (r, *at))).collect();
    let out = all.iter().filter(|(r, at)| !r.holds(at)).count();
    if boxes.len() < 2 || 10 * out < 9 * all.len() || view.demos[d].len() < 2 {
        return None;
    }
    let fits = |read: &dyn Fn(Vector3<f64>) -> Vector3<f64>| {
        let inside = all.iter().filter(|(r, at)| r.holds(&read(*at))).count();
        let off = |(r, at): &(&Region, Vector3<f64>)| (read(*at) - r.middle()).xy().norm();
        (10 * inside >= 9 * all.len()).then(|| all.iter().map(off).sum::<f64>())
    };
    let median =
        |i: usize| middle(&mut all.iter().map(|(r, at)| at[i] - r.middle()[i]).collect::<Vec<_>>());
    let by = Vector3::new(median(0), median(1), 0.0);
    let flip = |i: usize| {
        move |mut at: Vector3<f64>| {
            at[i] = -at[i];
            at
        }
    };
    let mirrored = (0..2).filter_map(|i| Some((fits(&flip(i))?, i)));
    let mirrored = mirrored.min_by(|a, b| a.0.total_cmp(&b.0));
    let moved = fits(&|at| at - by);
    match (mirrored, moved) {
        // A reversed sign explains it with less than a distance does.
        (Some((_, i)), _) => {
            let axis = ["x", "y"][i];
            Some(Doubt::new(DoubtKind::Mirrored, place, format!(
                    "{out} of {} objects begin elsewhere than in the others, and with {axis} reversed \
                     where they do",
                    all.len()
                )).reading(format!("it is the mirror image of the others in {axis}")).ask(format!("reverse {axis} in this session, or leave it out")))
        }
        (_, Some(_)) if out > 3 => Some(shifted(place, by, out)),
        _ => None,
    }
}

/// All doubts about single demonstrations.
pub(super) fn demonstrations(view: &View<'_>) -> Vec<Doubt> {
    let mut all = Vec::new();
    if view.demos.len() <= OTHERS {
        return all;
    }
    for (d, demo) in view.demos.iter().enumerate().take(MOST_COMPARED) {
        let place = format!("demonstration {}", demo.number);
        let boxes = boxes(view, d);
        let found = frame(view, d, &place)
            .or_else(|| level(view, d, &place))
            .or_else(|| region(view, d, &place, &boxes));
        let other_frame = found.is_some();
        all.extend(found);
        if !other_frame {
            all.extend(below(view, d));
            all.extend(swapped(view, d, &place));
            all.extend(backwards(view, d, &place));
        }
    }
    // If most demonstrations disagree with the others, nothing is usual.
    let places: BTreeSet<&String> = all.iter().map(|d| &d.place).collect();
    if 2 * places.len() > view.demos.len() && all.iter().all(|d| d.kind != DoubtKind::BelowTable) {
        all.clear();
    }
    all
}

fn shifted(place: &str, by: Vector3<f64>, count: usize) -> Doubt {
    let mm = by.map(|v| (v * 1e3).round() + 0.0);
    Doubt::new(
        DoubtKind::Shifted,
        place,
        format!(
            "{count} things are elsewhere than in the others, all by ({}, {}, {}) mm",
            mm.x, mm.y, mm.z
        ),
    )
}

/// A demonstration whose fixed objects are all elsewhere.
fn frame(view: &View<'_>, d: usize, place: &str) -> Option<Doubt> {
    let anchors = anchors(view, d);
    let far = |a: &Anchor| (a.now - a.usual).norm() > ELSEWHERE_M + 6.0 * view.noise_m;
    let count = anchors.len();
    if count == 0
        || !anchors.iter().all(|a| far(a) || a.usual.norm() < ELSEWHERE_M)
        || !anchors.iter().any(far)
    {
        return None;
    }
    let near = |tolerance: f64, read: &dyn Fn(&Anchor) -> Vector3<f64>| {
        anchors.iter().all(|a| (read(a) - a.usual).norm() < tolerance + 6.0 * view.noise_m)
    };
    // With one anchor, only an exact reversal is no coincidence.
    let tolerance = if count > 1 { 0.01 } else { 2e-3 };
    let mirrored = |i: usize| {
        near(tolerance, &|a| {
            let mut p = a.now;
            p[i] = -p[i];
            p
        })
    };
    if let Some(i) = (0..3).find(|i| mirrored(*i)) {
        let axis = ["x", "y", "z"][i];
        let kind = if i == 2 { DoubtKind::UpsideDown } else { DoubtKind::Mirrored };
        return Some(
            Doubt::new(
                kind,
                place,
                format!(
                    "{axis} of {count} fixed objects has the opposite sign of that in the others"
                ),
            )
            .reading(format!("it is the mirror image of the others in {axis}"))
            .ask(format!("reverse the sign of {axis} in this session, or leave it out")),
        );
    }
    let orders = [[1, 0, 2], [0, 2, 1], [2, 1, 0], [1, 2, 0], [2, 0, 1]];
    let permuted = |order: &&[usize; 3]| {
        near(tolerance, &|a| Vector3::from_fn(|i, _| a.now[order[i]]))
            || near(tolerance, &|a| {
                // y up, right-handed.
                let sign = [1.0, -1.0, 1.0];
                Vector3::from_fn(|i, _| sign[i] * a.now[order[i]])
            })
    };
    if orders.iter().find(permuted).is_some() {
        return Some(axes(
            place,
            &format!("the coordinates of {count} fixed objects are exchanged"),
        ));
    }
    let by = anchors[0].now - anchors[0].usual;
    if count > 1 && near(0.01, &|a| a.now - by) {
        return Some(shifted(place, by, count));
    }
    None
}

fn axes(place: &str, seen: &str) -> Doubt {
    Doubt::new(DoubtKind::UpAxis, place, seen)
}

/// A demonstration whose heights are all other than usual.
fn level(view: &View<'_>, d: usize, place: &str) -> Option<Doubt> {
    let heights = heights(view, d);
    let all: Vec<(f64, Vector3<f64>)> =
        heights.values().flat_map(|(usual, now)| now.iter().map(|at| (*usual, *at))).collect();
    let near = 5e-3 + 6.0 * view.noise_m;
    let off: Vec<&(f64, Vector3<f64>)> =
        all.iter().filter(|(u, at)| (at.z - u).abs() > near).collect();
    if off.len() < 2 || 5 * off.len() < 4 * all.len() {
        return None;
    }
    let is = |read: &dyn Fn(&Vector3<f64>) -> f64| {
        let fits = all.iter().filter(|(u, at)| (read(at) - u).abs() < near).count();
        10 * fits >= 9 * all.len()
    };
    if is(&|at| -at.z) {
        return Some(Doubt::new(
            DoubtKind::UpsideDown,
            place,
            format!("z of {} objects has the opposite sign of that in the others", all.len()),
        ));
    }
    if let Some(i) = (0..2).find(|i| is(&|at| at[*i]) || is(&|at| -at[*i])) {
        let axis = ["x", "y"][i];
        return Some(axes(
            place,
            &format!("objects rest at the usual heights in {axis}, not in z"),
        ));
    }
    let mut by: Vec<f64> = all.iter().map(|(u, at)| at.z - u).collect();
    let by = middle(&mut by);
    let several = heights.len() >= 2 && off.len() >= 3;
    (several && by.abs() > 0.01 && is(&|at| at.z - by))
        .then(|| shifted(place, Vector3::new(0.0, 0.0, by), all.len()))
}

/// Objects that begin lower than anything does in the other demonstrations, although their kind has a usual height.
fn below(view: &View<'_>, d: usize) -> Vec<Doubt> {
    let lowest = view
        .starts()
        .filter(|(other, ..)| *other != d)
        .map(|(.., s)| s.at.z)
        .fold(f64::MAX, f64::min);
    let heights = heights(view, d);
    let least = ELSEWHERE_M + 6.0 * view.noise_m;
    let own = view.demos[d].objects.iter().filter_map(|o| Some((o, (*o.seen.first()?)?)));
    own.filter_map(|(object, seen)| {
        let (usual, _) = heights.get(object.kind)?;
        (seen.at.z < lowest - least && seen.at.z < usual - least).then(|| Doubt::new(DoubtKind::BelowTable, format!("demonstration {}, `{}`", view.demos[d].number, object.id), format!(
                "it begins at z = {:.3} m, below everything else, and its kind usually at {usual:.3} m",
                seen.at.z
            )))
    })
    .collect()
}

/// Objects of two kinds that are where the other kind is in the other demonstrations.
fn swapped(view: &View<'_>, d: usize, place: &str) -> Vec<Doubt> {
    // What tells kinds apart: their height at the start and, if they are alone of their kind, where they begin and end.
    let near = FIXED_M + 6.0 * view.noise_m;
    let heights = heights(view, d);
    let mut ends: BTreeMap<&str, Vec<(usize, Vector3<f64>)>> = BTreeMap::new();
    for (i, demo) in view.demos.iter().enumerate() {
        for object in &demo.objects {
            let alone = demo.objects.iter().filter(|o| o.kind == object.kind).count() == 1;
            if let Some(last) = object.last().filter(|_| alone) {
                ends.entry(object.kind).or_default().push((i, last.at));
            }
        }
    }
    let mut fixed: BTreeMap<&str, (Vector3<f64>, Vector3<f64>)> = BTreeMap::new();
    for (kind, places) in &ends {
        let now = places.iter().find(|(i, _)| *i == d).map(|(_, at)| *at);
        let others: Vec<_> = places.iter().filter(|(i, _)| *i != d).map(|(_, at)| *at).collect();
        if let (Some(now), Some(usual)) = (now, agreed(view, &others)) {
            fixed.insert(kind, (usual, now));
        }
    }
    let of_kind = |kind: &str| {
        let (usual, now) = heights.get(kind)?;
        Some((*usual, move |z: f64| now.iter().any(|at| (at.z - z).abs() < near)))
    };
    let exchanged = |a: &str, b: &str| {
        let low = of_kind(a)
            .zip(of_kind(b))
            .map(|((ua, is_a), (ub, is_b))| ((ua - ub).abs() > 2.0 * near, is_a(ub) && is_b(ua)));
        let end = fixed.get(a).zip(fixed.get(b)).map(|((ua, na), (ub, nb))| {
            let differ = (ua - ub).norm() > ELSEWHERE_M.max(2.0 * near);
            (differ, (na - ub).norm() < 2.0 * near && (nb - ua).norm() < 2.0 * near)
        });
        let telling: Vec<bool> = [low, end]
            .into_iter()
            .flatten()
            .filter(|(differ, _)| *differ)
            .map(|(_, is)| is)
            .collect();
        !telling.is_empty() && telling.iter().all(|is| *is)
    };
    let kinds: BTreeSet<&str> =
        heights.keys().map(String::as_str).chain(fixed.keys().copied()).collect();
    let mut all = Vec::new();
    for a in &kinds {
        for b in kinds.range::<str, _>((std::ops::Bound::Excluded(*a), std::ops::Bound::Unbounded))
        {
            if exchanged(a, b) {
                all.push(
                    Doubt::new(
                        DoubtKind::SwappedIds,
                        place,
                        format!(
                            "`{a}` and `{b}` are where the other is in the other demonstrations"
                        ),
                    )
                    .ask(format!(
                        "exchange `{a}` and `{b}` in this demonstration, or leave it out"
                    )),
                );
            }
        }
    }
    all
}

/// A demonstration that begins as the others end, and ends as they begin.
fn backwards(view: &View<'_>, d: usize, place: &str) -> Option<Doubt> {
    let (mut back, mut all) = (0, 0);
    // Kinds that are lifted from one height to another, and lowered here.
    let mut lifts: BTreeMap<&str, [Vec<[f64; 2]>; 2]> = BTreeMap::new();
    for (i, demo) in view.demos.iter().enumerate() {
        for object in &demo.objects {
            let Some((first, last)) = object.first().zip(object.last()) else { continue };
            if (first.at - last.at).norm() > view.far_m() {
                let [own, others] = lifts.entry(object.kind).or_default();
                if i == d { own } else { others }.push([first.at.z, last.at.z]);
            }
        }
    }
    for [own, others] in
        lifts.values().filter(|[own, others]| !own.is_empty() && others.len() > OTHERS)
    {
        let usual = [0, 1].map(|i| middle(&mut others.iter().map(|h| h[i]).collect::<Vec<_>>()));
        let near = |h: &[f64; 2], to: [f64; 2]| {
            (0..2).all(|i| (h[i] - to[i]).abs() < FIXED_M + 6.0 * view.noise_m)
        };
        let agree = others.iter().all(|h| near(h, usual));
        if agree && (usual[0] - usual[1]).abs() > 0.01 + 12.0 * view.noise_m {
            all += own.len();
            back += own.iter().filter(|h| near(h, [usual[1], usual[0]])).count();
        }
    }
    (back >= 1 && back == all).then(|| {
        Doubt::new(
            DoubtKind::Disagreement,
            place,
            format!("{back} objects begin where they end in the others, and are taken away"),
        )
    })
}
