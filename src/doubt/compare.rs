//! Doubts about a demonstration that disagrees with the others: mirrored, shifted, in another frame, below the table, under
//! other ids, or played backwards.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::view::{View, middle};
use super::{Doubt, DoubtKind, Found};

/// Distance by which a fixed object is elsewhere, in metres.
const ELSEWHERE_M: f64 = 0.02;
/// Distance within which a fixed object is in the same place in other demonstrations, in metres, beyond noise.
const FIXED_M: f64 = 4e-3;
/// Number of demonstrations in which something has to agree before one can disagree with it.
const OTHERS: usize = 2;

/// Least and greatest number of demonstrations that are compared with all others.
const COMPARED: [usize; 2] = [30, 200];
/// Number of poses that are looked at for it: within the bounds, the more objects, the fewer demonstrations are compared.
const LOOKS: usize = 3_000_000;

/// Values by a name, each with the index of its demonstration, in order of the demonstrations.
type Entries<'a, T> = BTreeMap<&'a str, Vec<(usize, T)>>;

/// What the comparison needs of all demonstrations.
struct Summary<'v, 'a> {
    view: &'v View<'a>,
    /// Where each id begins.
    ids: Entries<'a, Vector3<f64>>,
    /// Where the objects end that are alone of their kind.
    ends: Entries<'a, Vector3<f64>>,
    /// Heights from and to which objects of a kind are carried.
    lifts: Entries<'a, [f64; 2]>,
    /// The least height at which anything begins in each demonstration.
    lowest: Vec<f64>,
}

impl<'v, 'a> Summary<'v, 'a> {
    fn of(view: &'v View<'a>) -> Self {
        let (mut ids, mut ends, mut lifts) = (Entries::new(), Entries::new(), Entries::new());
        let mut lowest = vec![f64::MAX; view.demos.len()];
        for (d, object, seen) in view.starts() {
            ids.entry(object.id).or_default().push((d, seen.at));
            lowest[d] = seen.at.z.min(lowest[d]);
        }
        for (d, demo) in view.demos.iter().enumerate() {
            let mut last: BTreeMap<&str, (usize, Option<Vector3<f64>>)> = BTreeMap::new();
            for object in &demo.objects {
                let ended = object.last().map(|seen| seen.at);
                let entry = last.entry(object.kind).or_insert((0, ended));
                entry.0 += 1;
                let Some((first, last)) = object.first().zip(ended) else { continue };
                if (first.at - last).norm() > view.far_m() {
                    lifts.entry(object.kind).or_default().push((d, [first.at.z, last.z]));
                }
            }
            for (kind, (count, ended)) in last {
                if let Some(at) = ended.filter(|_| count == 1) {
                    ends.entry(kind).or_default().push((d, at));
                }
            }
        }
        Self { view, ids, ends, lifts, lowest }
    }
}

/// Returns the values of a demonstration, and those of all others.
fn apart<T: Copy>(
    entries: &[(usize, T)],
    demo: usize,
) -> (impl Iterator<Item = T> + Clone, impl Iterator<Item = T> + Clone) {
    let from = entries.partition_point(|(d, _)| *d < demo);
    let to = entries.partition_point(|(d, _)| *d <= demo);
    let own = entries[from..to].iter().map(|(_, value)| *value);
    (own, entries[..from].iter().chain(&entries[to..]).map(|(_, value)| *value))
}

/// An object that is in one place at the start of the other demonstrations: the place, and where it is now.
struct Anchor {
    usual: Vector3<f64>,
    now: Vector3<f64>,
}

/// Returns the median of positions that all agree; `None` if some differ.
fn agreed(
    view: &View<'_>,
    places: impl Iterator<Item = Vector3<f64>> + Clone,
) -> Option<Vector3<f64>> {
    let most = FIXED_M + 6.0 * view.noise_m;
    let first = places.clone().next()?;
    // What is in several places is so in the first few demonstrations.
    if places.clone().any(|p| (p - first).norm() > 2.0 * most) {
        return None;
    }
    let axis = |i: usize| places.clone().map(|p| p[i]).collect::<Vec<f64>>();
    let mut axes = [0, 1, 2].map(axis);
    if axes[0].len() < OTHERS {
        return None;
    }
    let median = Vector3::from_fn(|i, _| middle(&mut axes[i]));
    places.clone().all(|p| (p - median).norm() < most).then_some(median)
}

/// Returns the objects that are in one place at the start of all demonstrations but `demo`.
fn anchors(all: &Summary<'_, '_>, demo: usize) -> Vec<Anchor> {
    let anchor = |places: &Vec<(usize, Vector3<f64>)>| {
        let (mut own, others) = apart(places, demo);
        Some(Anchor { now: own.next()?, usual: agreed(all.view, others)? })
    };
    all.ids.values().filter_map(anchor).collect()
}

/// The kinds that begin at one height in all demonstrations but one: that height, and the coordinates in this one.
type Heights<'a> = BTreeMap<&'a str, (f64, Vec<Vector3<f64>>)>;

fn heights<'a>(all: &Summary<'_, 'a>, demo: usize) -> Heights<'a> {
    let near = FIXED_M + 6.0 * all.view.noise_m;
    let kinds = all.view.starts_by_kind.iter().filter_map(|(kind, seen)| {
        let (own, others) = apart(seen, demo);
        let own: Vec<Vector3<f64>> = own.map(|s| s.at).collect();
        let mut zs: Vec<f64> = others.map(|s| s.at.z).collect();
        let usual = middle(&mut zs);
        let agree = zs.len() >= OTHERS && zs.iter().all(|z| (z - usual).abs() < near);
        (agree && !own.is_empty()).then_some((*kind, (usual, own)))
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
fn boxes<'a>(all: &Summary<'_, 'a>, demo: usize) -> BTreeMap<&'a str, Region> {
    let kinds = all.view.starts_by_kind.iter().filter_map(|(kind, seen)| {
        let (own, others) = apart(seen, demo);
        let now: Vec<Vector3<f64>> = own.map(|s| s.at).collect();
        let count = seen.len() - now.len();
        if count < MANY || now.is_empty() {
            return None;
        }
        let (low, high) = others.fold(([f64::MAX; 2], [f64::MIN; 2]), |(low, high), s| {
            ([0, 1].map(|i| s.at[i].min(low[i])), [0, 1].map(|i| s.at[i].max(high[i])))
        });
        let share = if count < 2 * MANY { 1.0 } else { 0.5 };
        let wide = |i: usize| share * (high[i] - low[i]) + 0.01;
        let region = Region {
            low: [0, 1].map(|i| low[i] - wide(i)),
            high: [0, 1].map(|i| high[i] + wide(i)),
            now,
        };
        Some((*kind, region))
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
pub(super) fn demonstrations(view: &View<'_>, found: &mut Found) {
    if view.demos.len() <= OTHERS {
        return;
    }
    let all = Summary::of(view);
    let poses = view.starts_by_kind.values().map(Vec::len).sum::<usize>().max(1);
    let compared = (LOOKS / poses).clamp(COMPARED[0], COMPARED[1]).min(view.demos.len());
    let (mut own, mut disagree) = (Found::default(), 0);
    for (d, demo) in view.demos.iter().enumerate().take(compared) {
        let before = own.count();
        let place = format!("demo {}", demo.number);
        let heights = heights(&all, d);
        let other = frame(&all, d, &place)
            .or_else(|| level(view, &heights, &place))
            .or_else(|| region(view, d, &place, &boxes(&all, d)));
        if other.is_none() {
            below(&all, d, &heights, &mut own);
            swapped(&all, d, &heights, &place, &mut own);
            own.extend(backwards(&all, d, &place));
        }
        own.extend(other);
        disagree += usize::from(own.count() > before);
    }
    // If most demonstrations disagree with the others, nothing is usual.
    if 2 * disagree <= compared || own.has(DoubtKind::BelowTable) {
        found.take(own);
    }
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
fn frame(all: &Summary<'_, '_>, d: usize, place: &str) -> Option<Doubt> {
    let (view, anchors) = (all.view, anchors(all, d));
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
fn level(view: &View<'_>, heights: &Heights<'_>, place: &str) -> Option<Doubt> {
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
fn below(all: &Summary<'_, '_>, d: usize, heights: &Heights<'_>, found: &mut Found) {
    let others = all.lowest.iter().enumerate().filter(|(other, _)| *other != d);
    let lowest = others.map(|(_, low)| *low).fold(f64::MAX, f64::min);
    let least = ELSEWHERE_M + 6.0 * all.view.noise_m;
    let demo = &all.view.demos[d];
    for object in &demo.objects {
        let start = object.seen.first().copied().flatten();
        let Some((seen, (usual, _))) = start.zip(heights.get(object.kind)) else { continue };
        let z = seen.at.z;
        if z < lowest - least && z < usual - least {
            found.push(DoubtKind::BelowTable, || {
                let place = format!("demo {}, `{}`", demo.number, object.id);
                let seen = format!(
                    "it begins at z = {z:.3} m, below everything else, and its kind usually at {usual:.3} m"
                );
                Doubt::new(DoubtKind::BelowTable, place, seen)
            });
        }
    }
}

/// A kind in a demonstration, with what tells it from others.
struct Told<'h, 'a> {
    kind: &'a str,
    /// The usual height at the start, and the coordinates now.
    low: Option<&'h (f64, Vec<Vector3<f64>>)>,
    /// Where an object that is alone of its kind usually ends, and where it does now.
    end: Option<(Vector3<f64>, Vector3<f64>)>,
}

/// Objects of two kinds that are where the other kind is in the other demonstrations.
fn swapped(all: &Summary<'_, '_>, d: usize, heights: &Heights<'_>, place: &str, found: &mut Found) {
    let near = FIXED_M + 6.0 * all.view.noise_m;
    let differ = ELSEWHERE_M.max(2.0 * near);
    let kinds: BTreeSet<&str> = heights.keys().chain(all.ends.keys()).copied().collect();
    let told = kinds.into_iter().filter_map(|kind| {
        let low = heights.get(kind);
        let end = all.ends.get(kind).and_then(|places| {
            let (mut own, others) = apart(places, d);
            let now = own.next()?;
            Some((agreed(all.view, others)?, now))
        });
        // What is where it always is was not exchanged.
        let off = low.is_some_and(|(usual, now)| now.iter().any(|at| (at.z - usual).abs() > near))
            || end.is_some_and(|(usual, now)| (now - usual).norm() > differ - 2.0 * near);
        off.then_some(Told { kind, low, end })
    });
    let told: Vec<Told<'_, '_>> = told.collect();
    let is = |now: &[Vector3<f64>], z: f64| now.iter().any(|at| (at.z - z).abs() < near);
    let exchanged = |a: &Told<'_, '_>, b: &Told<'_, '_>| {
        let low = a.low.zip(b.low).filter(|((ua, _), (ub, _))| (ua - ub).abs() > 2.0 * near);
        let low = low.map(|((ua, na), (ub, nb))| is(na, *ub) && is(nb, *ua));
        let end = a.end.zip(b.end).filter(|((ua, _), (ub, _))| (ua - ub).norm() > differ);
        let end = end.map(|((ua, na), (ub, nb))| {
            (na - ub).norm() < 2.0 * near && (nb - ua).norm() < 2.0 * near
        });
        low.or(end).is_some() && low.unwrap_or(true) && end.unwrap_or(true)
    };
    for (i, one) in told.iter().enumerate() {
        for other in told[i + 1..].iter().filter(|other| exchanged(one, other)) {
            found.push(DoubtKind::SwappedIds, || {
                let (a, b) = (one.kind, other.kind);
                let seen =
                    format!("`{a}` and `{b}` are where the other is in the other demonstrations");
                Doubt::new(DoubtKind::SwappedIds, place, seen)
                    .ask(format!("exchange `{a}` and `{b}` in this demonstration, or leave it out"))
            });
        }
    }
}

/// A demonstration that begins as the others end, and ends as they begin.
fn backwards(all: &Summary<'_, '_>, d: usize, place: &str) -> Option<Doubt> {
    let (mut back, mut count) = (0, 0);
    let near = FIXED_M + 6.0 * all.view.noise_m;
    let is = |h: &[f64; 2], to: [f64; 2]| (0..2).all(|i| (h[i] - to[i]).abs() < near);
    for lifts in all.lifts.values() {
        let (own, others) = apart(lifts, d);
        let own: Vec<[f64; 2]> = own.collect();
        if own.is_empty() || lifts.len() - own.len() <= OTHERS {
            continue;
        }
        let usual = [0, 1].map(|i| middle(&mut others.clone().map(|h| h[i]).collect::<Vec<_>>()));
        let agree = others.clone().all(|h| is(&h, usual));
        // Kinds that are lifted from one height to another, and lowered here.
        if agree && (usual[0] - usual[1]).abs() > 0.01 + 12.0 * all.view.noise_m {
            count += own.len();
            back += own.iter().filter(|h| is(h, [usual[1], usual[0]])).count();
        }
    }
    (back >= 1 && back == count).then(|| {
        Doubt::new(
            DoubtKind::Disagreement,
            place,
            format!("{back} objects begin where they end in the others, and are taken away"),
        )
    })
}
