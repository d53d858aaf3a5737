//! Doubts about movements: wrong labels, exchanged ids, jumps, repeated snapshots, frozen poses, and objects in each other.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::view::{Demo, Object, View, spread};
use super::{Doubt, DoubtKind, Found};
use crate::task::recording::SnapshotEvent;

/// Distance below which two objects of a kind are in each other, in metres, if they stay so: few parts are so thin.
const INSIDE_M: f64 = 1.5e-3;

/// Number of movements while nothing is held beyond which other hands are at work, and not a tracker that errs.
const MOST_LOOSE: usize = 100;
/// Turn beyond which an object was turned on purpose, in radians.
const TURNED_RAD: f64 = 0.5;

/// How far an object moved from a snapshot to another, in metres.
fn moved(object: &Object<'_>, from: usize, to: usize) -> Option<f64> {
    Some((object.since(to)?.at - object.by(from)?.at).norm())
}

fn turned(object: &Object<'_>, from: usize, to: usize) -> Option<f64> {
    Some(object.since(to)?.turn.angle_to(&object.by(from)?.turn))
}

/// All doubts about movements.
pub(super) fn moves(view: &View<'_>, found: &mut Found) {
    let swapped = swaps(view, found);
    found.extend(labels(view, &swapped));
    jumps(view, &swapped, found);
    repeats(view, found);
    let labelled = !found.has(DoubtKind::WrongObject);
    found.extend(still(view, labelled));
    inside(view, found);
}

/// Two ids that are exchanged from a snapshot on.
struct Swap<'a> {
    demo: u64,
    snapshot: usize,
    ids: [&'a str; 2],
}

/// An object that is where another was, while that one is elsewhere.
fn swaps<'a>(view: &View<'a>, found: &mut Found) -> Vec<Swap<'a>> {
    let mut swapped = Vec::new();
    for demo in &view.demos {
        let mut known: BTreeSet<(usize, usize)> = BTreeSet::new();
        for s in 1..demo.len() {
            let moved: Vec<usize> = (0..demo.objects.len())
                .filter(|o| {
                    let object = &demo.objects[*o];
                    let pair = object.seen[s - 1].zip(object.seen[s]);
                    pair.is_some_and(|(a, b)| (a.at - b.at).norm() > 0.02 + view.same_m())
                })
                .collect();
            for a in &moved {
                for b in moved.iter().filter(|b| *b != a) {
                    let (one, other) = (&demo.objects[*a], &demo.objects[*b]);
                    let count = |s: usize| {
                        demo.objects
                            .iter()
                            .filter(|o| o.kind == one.kind && o.seen[s].is_some())
                            .count()
                    };
                    let (Some(was), Some(is)) = (other.seen[s - 1], one.seen[s]) else { continue };
                    let near = (was.at - is.at).norm() < 2e-3 + 6.0 * view.noise_m;
                    // Without events, one of the two could have made room for the other.
                    let back = one.seen[s - 1].zip(other.seen[s]).is_some_and(|(was, is)| {
                        (was.at - is.at).norm() < 2e-3 + 6.0 * view.noise_m
                    });
                    let new = !known.contains(&(*a.min(b), *a.max(b)));
                    // Where one of a kind is lost, later ids move down.
                    if near && new && (back || view.events) && count(s) == count(s - 1) {
                        known.insert((*a.min(b), *a.max(b)));
                        swapped.push(Swap {
                            demo: demo.number,
                            snapshot: s,
                            ids: [one.id, other.id],
                        });
                        found.push(DoubtKind::SwappedIds, || {
                            Doubt::new(
                                DoubtKind::SwappedIds,
                                demo.place(s),
                                format!(
                                    "`{}` is where `{}` was, which is elsewhere now",
                                    one.id, other.id
                                ),
                            )
                            .reading("the tracker has probably exchanged the two ids")
                            .ask(format!(
                                "exchange `{}` and `{}` from there on, or leave it out",
                                one.id, other.id
                            ))
                        });
                    }
                }
            }
        }
    }
    swapped
}

/// A named object that lies still while another moves.
fn labels(view: &View<'_>, swapped: &[Swap<'_>]) -> Vec<Doubt> {
    struct Wrong<'a> {
        doubt: Doubt,
        named: &'a str,
        mover: &'a str,
    }
    let mut wrong: Vec<Wrong<'_>> = Vec::new();
    let mut movers: BTreeMap<&str, usize> = BTreeMap::new();
    for demo in &view.demos {
        for hold in &demo.holds {
            let Some(o) = hold.object else { continue };
            let named = &demo.objects[o];
            let (Some(far), Some(turn)) =
                (moved(named, hold.from, hold.to), turned(named, hold.from, hold.to))
            else {
                continue;
            };
            if far > view.same_m() || turn > 0.05 + 6.0 * view.noise_rad {
                *movers.entry(named.kind).or_default() += 1;
                continue;
            }
            let others = demo.objects.iter().enumerate().filter(|(i, _)| *i != o);
            let others = others.filter_map(|(_, x)| {
                let turn = turned(x, hold.from, hold.to).filter(|turn| *turn > TURNED_RAD);
                // A turn counts as the way of a hand's width.
                Some((moved(x, hold.from, hold.to)? + turn.map_or(0.0, |_| 0.1), x))
            });
            let Some((farthest, other)) = others.max_by(|a, b| a.0.total_cmp(&b.0)) else {
                continue;
            };
            let pair = |w: &Swap<'_>| w.ids.contains(&named.id) && w.ids.contains(&other.id);
            let exchanged = swapped.iter().any(|w| {
                w.demo == demo.number
                    && w.snapshot <= hold.to
                    && (w.snapshot >= hold.from || pair(w))
            });
            if farthest < view.far_m() || exchanged {
                continue;
            }
            wrong.push(Wrong {
                doubt: Doubt::new(
                    DoubtKind::WrongObject,
                    demo.place(hold.from),
                    format!(
                        "`object` is `{}`, which moved by {:.1} mm, while `{}` moved by {:.0} mm",
                        named.id,
                        far * 1e3,
                        other.id,
                        moved(other, hold.from, hold.to).unwrap_or(0.0) * 1e3
                    ),
                )
                .reading(format!("the hand probably held `{}`", other.id))
                .ask(format!(
                    "name `{}` as the `object` of the contact and the release, or \
                         leave `object` out",
                    other.id
                )),
                named: named.kind,
                mover: other.kind,
            });
        }
    }
    // What never moves itself but always moves one kind is a mechanism, such as a button and its door.
    let mut moved_by: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for w in &wrong {
        moved_by.entry(w.named).or_default().push(w.mover);
    }
    moved_by.retain(|named, by| {
        let one = by.iter().all(|mover| *mover == by[0]) && !movers.contains_key(by[0]);
        one && by.len() >= 3 && !movers.contains_key(named)
    });
    wrong.retain(|w| !moved_by.contains_key(w.named));
    wrong.into_iter().map(|w| w.doubt).collect()
}

/// Movements that no hand and no fall explains.
fn jumps(view: &View<'_>, swapped: &[Swap<'_>], found: &mut Found) {
    let least = 0.02 + view.same_m();
    let swapped: BTreeSet<(u64, usize)> = swapped.iter().map(|w| (w.demo, w.snapshot)).collect();
    let (moves, mut loose) = (steps(view, least), 0);
    for (d, demo) in view.demos.iter().enumerate() {
        let len = demo.len();
        for (o, object) in demo.objects.iter().enumerate() {
            let named = |s: usize| {
                demo.holds.iter().any(|h| h.object == Some(o) && h.from <= s && s <= h.to)
            };
            for s in 1..len {
                let (Some(before), Some(now)) = (object.seen[s - 1], object.seen[s]) else {
                    continue;
                };
                let far = (now.at - before.at).norm();
                if far < least || swapped.contains(&(demo.number, s)) {
                    continue;
                }
                let next = object.seen.get(s + 1).copied().flatten();
                let returns = next.is_some_and(|n| (n.at - before.at).norm() < view.same_m());
                // Others that leave together are carried, or seen by a camera.
                let with = demo.objects.iter().enumerate().any(|(i, other)| {
                    let pair = other.seen[s - 1].zip(other.seen[s]);
                    i != o
                        && pair.is_some_and(|(a, b)| {
                            ((b.at - a.at) - (now.at - before.at)).norm() < 5e-3
                        })
                });
                let mut doubt = |what: &str, then: &str| {
                    found.push(DoubtKind::Jump, || {
                        let seen = format!("`{}`{what} {:.0} mm {then}", object.id, far * 1e3);
                        Doubt::new(DoubtKind::Jump, demo.place(s), seen).ask(format!(
                            "leave `{}` out of the snapshots in which it is elsewhere",
                            object.id
                        ))
                    });
                };
                if returns && !named(s) && !with && (view.events || far > 0.1) {
                    doubt(" is", "away in one snapshot and back in the next");
                    continue;
                }
                let came_back = s >= 2 && {
                    let earlier = object.seen[s - 2];
                    earlier.is_some_and(|e| (now.at - e.at).norm() < view.same_m())
                };
                if came_back || !view.events || with {
                    continue;
                }
                let held = demo.held(s - 1);
                // A thing that nobody touches, and that does not move but now.
                let fixed =
                    moves.get(object.kind) == Some(&1) && (now.at - before.at).z.abs() < 0.01;
                if held && !named(s - 1) && fixed && far > 0.1 {
                    doubt(", which the hand does not hold, is", "away all at once");
                } else if !held {
                    // What was just released may fall, and roll to the floor.
                    let released = demo.events[s - 1] == Some(SnapshotEvent::Release);
                    let fell = released && now.at.z < before.at.z - 5e-3 && named(s - 1);
                    if fell {
                        continue;
                    }
                    loose += 1;
                    if fixed || loose <= MOST_LOOSE && strange(view, (d, o, s), now.at) {
                        doubt(" moves by", "while the hand holds nothing");
                    }
                }
            }
        }
    }
}

/// Returns how many steps of each kind move an object by more than `least`, in metres. Kinds that are touched are left out.
fn steps<'a>(view: &View<'a>, least: f64) -> BTreeMap<&'a str, usize> {
    let mut moves: BTreeMap<&str, usize> = BTreeMap::new();
    for object in view.demos.iter().flat_map(|d| &d.objects) {
        let far = |p: &[Option<super::view::Seen>]| {
            p[0].zip(p[1]).is_some_and(|(a, b)| (a.at - b.at).norm() > least)
        };
        *moves.entry(object.kind).or_default() += object.seen.windows(2).filter(|p| far(p)).count();
    }
    for demo in &view.demos {
        let touched = demo.holds.iter().filter_map(|h| h.object);
        for o in touched {
            moves.remove(demo.objects[o].kind);
        }
    }
    moves
}

/// Returns whether a position is far outside of the box around all others of objects of the kind, but those from the snapshot
/// on. Other hands leave things where things of the kind lie.
fn strange(view: &View<'_>, (d, own, snapshot): (usize, usize, usize), at: Vector3<f64>) -> bool {
    let kind = view.demos[d].objects[own].kind;
    let mut all: Vec<Vector3<f64>> = Vec::new();
    for (i, demo) in view.demos.iter().enumerate() {
        for (o, object) in demo.objects.iter().enumerate().filter(|(_, o)| o.kind == kind) {
            let until = if (i, o) == (d, own) { snapshot } else { demo.len() };
            all.extend(object.seen[..until].iter().flatten().map(|s| s.at));
        }
    }
    let far = beyond(&all, at);
    let wide = || (0..3).map(|i| spread(all.iter().map(|p| p[i]))).fold(0.0, f64::max);
    all.len() >= 20 && far > 0.05 && far > 0.05 + 0.5 * wide()
}

/// How far a position is from the box around others, in metres.
fn beyond(all: &[Vector3<f64>], at: Vector3<f64>) -> f64 {
    let beyond = |i: usize| {
        let low = all.iter().map(|p| p[i]).fold(f64::MAX, f64::min);
        let high = all.iter().map(|p| p[i]).fold(f64::MIN, f64::max);
        (low - at[i]).max(at[i] - high).max(0.0)
    };
    (0..3).map(beyond).fold(0.0, f64::max)
}

/// Snapshots that are recorded twice.
fn repeats(view: &View<'_>, found: &mut Found) {
    for demo in &view.demos {
        for s in 1..demo.len() {
            let same = |o: &Object<'_>| o.seen[s] == o.seen[s - 1];
            let event = demo.events[s];
            // Equal times are told of by themselves, and unequal ones are of two moments.
            let timed = demo.times_s[s].is_some() && demo.times_s[s - 1].is_some();
            let again = event == demo.events[s - 1] && demo.named[s] == demo.named[s - 1];
            if event.is_some() && again && !timed && demo.objects.iter().all(same) {
                found.push(DoubtKind::DuplicateTime, || {
                    let seen = "it repeats the snapshot before it, event and all";
                    Doubt::new(DoubtKind::DuplicateTime, demo.place(s), seen)
                });
            }
        }
    }
}

/// Kinds that are touched and never move if the labels are right, demonstrations in which nothing does, and poses that stay to the bit.
fn still(view: &View<'_>, labelled: bool) -> Vec<Doubt> {
    let mut all = Vec::new();
    let nothing = |place: String, seen: String| Doubt::new(DoubtKind::NothingMoves, place, seen);
    let moves = |o: &Object<'_>| {
        let first = o.first();
        o.seen.iter().flatten().any(|s| {
            first.is_some_and(|f| {
                (f.at - s.at).norm() > view.same_m()
                    || f.turn.angle_to(&s.turn) > 0.05 + 6.0 * view.noise_rad
            })
        })
    };
    let mut moving: BTreeSet<&str> = BTreeSet::new();
    for object in view.demos.iter().flat_map(|d| &d.objects).filter(|o| moves(o)) {
        moving.insert(object.kind);
    }
    let long = |demo: &&Demo<'_>| demo.len() > 1;
    if moving.is_empty() && view.demos.iter().any(|d| long(&d)) {
        let seen = "no object moves in any demonstration".into();
        return vec![nothing(String::new(), seen)];
    }
    for demo in view.demos.iter().filter(long) {
        let whole = demo.objects.iter().all(|o| o.seen.iter().all(Option::is_some));
        if whole && !demo.objects.iter().any(moves) {
            let place = format!("demo {}", demo.number);
            all.push(nothing(place, "no object moves, in the others some do".into()));
            continue;
        }
        // From some snapshot on, all poses are the same, whatever the hand does.
        let last = (1..demo.len())
            .rev()
            .find(|s| demo.objects.iter().any(|o| o.seen[*s] != o.seen[*s - 1]));
        let from = last.unwrap_or(0);
        let after = demo.holds.iter().filter(|h| h.from >= from && h.to > h.from).count();
        if after >= 2 {
            all.push(Doubt::new(
                DoubtKind::Frozen,
                demo.place(from),
                format!("no pose changes any more, through {after} grasps"),
            ));
        }
    }
    if view.noise_m > 1e-5 {
        for demo in view.demos.iter().filter(|d| d.len() >= 5) {
            for object in demo.objects.iter().filter(|o| moving.contains(o.kind)) {
                let seen: Vec<_> = object.seen.iter().flatten().collect();
                let frozen = seen.len() >= 5 && seen.windows(2).all(|p| p[0] == p[1]);
                if frozen {
                    all.push(
                        Doubt::new(
                            DoubtKind::Frozen,
                            format!("demo {}, `{}`", demo.number, object.id),
                            format!("its pose is the same to the bit in {} snapshots", seen.len()),
                        )
                        .reading("the tracker has probably lost it and repeats the last pose")
                        .ask(format!("leave `{}` out of these snapshots", object.id)),
                    );
                }
            }
        }
    }
    let mut touched: BTreeMap<&str, usize> = BTreeMap::new();
    for demo in &view.demos {
        for hold in &demo.holds {
            if let Some(o) = hold.object {
                *touched.entry(demo.objects[o].kind).or_default() += 1;
            }
        }
    }
    touched.retain(|kind, count| labelled && *count >= 3 && !moving.contains(kind));
    for (kind, count) in touched {
        let place = format!("objects of kind `{kind}`");
        all.push(nothing(place, format!("they are touched {count} times and never move")));
    }
    all
}

/// Objects of a kind that begin in the same place and stay together, or do so to the bit. Thin things in a stack are parted.
fn inside(view: &View<'_>, found: &mut Found) {
    for demo in &view.demos {
        for (i, one) in demo.objects.iter().enumerate() {
            for other in &demo.objects[..i] {
                let pair = one.seen[0].zip(other.seen[0]);
                let Some((a, b)) = pair.filter(|_| one.kind == other.kind) else { continue };
                let far = (a.at - b.at).norm();
                let together = || {
                    let pairs = one.seen.iter().zip(&other.seen);
                    let mut pairs = pairs.filter_map(|(a, b)| (*a).zip(*b));
                    pairs.all(|(a, b)| (a.at - b.at).norm() < INSIDE_M)
                };
                if far < INSIDE_M && (a.at == b.at || together()) {
                    found.push(DoubtKind::SamePlace, || {
                        let [one, other] = [one.id, other.id];
                        let seen = format!("`{other}` and `{one}` are {:.1} mm apart", far * 1e3);
                        Doubt::new(DoubtKind::SamePlace, demo.place(0), seen)
                            .ask(format!("leave `{one}` out"))
                    });
                }
            }
        }
    }
}
