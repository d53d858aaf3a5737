//! Doubts about units of lengths and times.

use super::view::{Demo, View, middle};
use super::{Doubt, DoubtKind, Found};

/// Largest extent of a scene, in metres. A hand reaches about 2 m to each side, and rails or a second arm add a little.
const WIDEST_M: f64 = 5.0;
/// Largest extent of a scene in which a robot drives, in metres.
const DRIVEN_M: f64 = 50.0;
/// Smallest extent of a scene in which anything is carried, in metres. Hands do not place things within less.
const NARROWEST_M: f64 = 0.012;
/// The usual extent of a table scene, in metres. Of several readings, the nearest to it comes first.
const USUAL_M: f64 = 0.6;
/// Ratio of the extents of demonstrations of one task that is no accident.
const OTHER_SCALE: f64 = 9.0;

/// Units of length, with their number in a metre.
const UNITS: [(&str, f64); 4] = [("mm", 1e3), ("cm", 1e2), ("inch", 39.37), ("um", 1e6)];

/// The greatest side of the box around all objects, in each snapshot in which two are seen, in order of size.
fn extents(demo: &Demo<'_>, without: Option<&str>) -> Vec<f64> {
    let mut all: Vec<f64> = (0..demo.len())
        .filter_map(|s| {
            let own = demo.objects.iter().filter(|o| Some(o.kind) != without);
            let seen: Vec<_> = own.filter_map(|o| o.seen[s]).collect();
            let side = |i: usize| {
                let values = seen.iter().map(|p| p.at[i]);
                values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
            };
            (seen.len() > 1).then(|| side(0).max(side(1)).max(side(2)))
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all
}

/// The extent of the median snapshot; `None` where fewer than two objects are seen.
fn extent(demo: &Demo<'_>, without: Option<&str>) -> Option<f64> {
    let all = extents(demo, without);
    all.get(all.len() / 2).copied()
}

/// The extent of the whole, given those of the demonstrations: the median of the demonstrations', or, with lone objects, how far these move.
fn whole(view: &View<'_>, without: Option<&str>, mut all: Vec<f64>) -> Option<f64> {
    let lone = || {
        let far = view.demos.iter().flat_map(|d| &d.objects).filter(|o| Some(o.kind) != without);
        let far = far.filter_map(|o| Some((o.last()?.at - o.first()?.at).norm()));
        far.filter(|far| *far > 0.0).reduce(f64::max)
    };
    if all.is_empty() { lone() } else { Some(middle(&mut all)) }
}

fn length(metres: f64) -> String {
    match metres {
        m if m < 1e-3 => format!("{:.3} mm", m * 1e3),
        m if m < 1.0 => format!("{:.0} mm", m * 1e3),
        m if m < 10.0 => format!("{m:.1} m"),
        m => format!("{m:.0} m"),
    }
}

/// The units in which an extent makes sense, the likeliest first, with the extent in metres.
fn readings(metres: f64) -> Vec<(&'static str, f64, f64)> {
    let small = metres < NARROWEST_M;
    let read = |(name, per_m): (&'static str, f64)| {
        let scale = if small { per_m } else { 1.0 / per_m };
        (name, per_m, metres * scale)
    };
    let fits = |(_, _, m): &(&str, f64, f64)| (0.05..5.0).contains(m);
    let mut all: Vec<_> = UNITS.into_iter().map(read).filter(fits).collect();
    let off = |m: f64| (m / USUAL_M).ln().abs();
    all.sort_by(|a, b| off(a.2).total_cmp(&off(b.2)));
    all
}

fn unit(place: String, metres: f64, what: &str) -> Doubt {
    let small = metres < NARROWEST_M;
    let readings = readings(metres);
    let words = |(name, _, m): &(&str, f64, f64)| {
        let (from, to) = if small { ("metres taken for ", *name) } else { ("", *name) };
        format!("{from}{to} ({})", length(*m))
    };
    let reading = match &readings[..] {
        [] => "no usual unit makes a table scene of it".into(),
        all => {
            let all: Vec<String> = all.iter().map(words).collect();
            format!("the lengths are probably {}", all.join(" or "))
        }
    };
    let ask = match (readings.first(), small) {
        (Some((name, per_m, _)), false) => format!(
            "import the log with `length` set to `{name}`, or divide the positions by {per_m}"
        ),
        (Some((_, per_m, _)), true) => {
            format!("import the log with `length` set to `m`, or multiply the positions by {per_m}")
        }
        _ => "give the unit to `symbolt import` as `length`".into(),
    };
    Doubt::new(DoubtKind::LengthUnit, place, format!("{what} {} wide", length(metres)))
        .reading(reading)
        .ask(ask)
}

/// Doubts about the unit of lengths. Returns whether lengths say nothing else.
pub(super) fn units(view: &View<'_>, found: &mut Found) -> bool {
    let all: Vec<Vec<f64>> = view.demos.iter().map(|demo| extents(demo, None)).collect();
    let medians: Vec<Option<f64>> = all.iter().map(|e| e.get(e.len() / 2).copied()).collect();
    let Some(metres) = whole(view, None, medians.iter().copied().flatten().collect()) else {
        return false;
    };
    let fits = |m: f64| (NARROWEST_M..WIDEST_M).contains(&m);
    if metres > 0.0 && !fits(metres) {
        let kinds: std::collections::BTreeSet<&str> =
            view.demos.iter().flat_map(|d| &d.objects).map(|o| o.kind).collect();
        // One kind in another unit makes the whole too wide.
        let odd = (kinds.len() > 2 && metres > WIDEST_M).then(|| {
            kinds.iter().find(|kind| {
                let own = view.demos.iter().filter_map(|demo| extent(demo, Some(kind))).collect();
                whole(view, Some(kind), own).is_some_and(fits)
            })
        });
        if let Some(kind) = odd.flatten() {
            let place = format!("objects of kind `{kind}`");
            found.extend([unit(place, metres, "with them, the scene is")]);
            return true;
        }
    }
    // Some demonstrations in another unit than the rest.
    let known: Vec<f64> = medians.iter().copied().flatten().filter(|e| *e > 0.0).collect();
    let sound = known.iter().copied().filter(|e| fits(*e)).count();
    let usual = middle(&mut if sound > 0 {
        known.iter().copied().filter(|e| fits(*e)).collect::<Vec<_>>()
    } else {
        known.clone()
    });
    let odd: Vec<(usize, f64)> = (medians.iter().enumerate())
        .filter_map(|(d, e)| Some((d, (*e)?)))
        // In every snapshot: an object alone may be missing, or far.
        .filter(|(d, _)| {
            let ends = all[*d].first().zip(all[*d].last());
            ends.is_some_and(|(low, high)| {
                *high > 0.0 && (low / usual > OTHER_SCALE || usual / high > OTHER_SCALE)
            })
        })
        .collect();
    if !odd.is_empty() && odd.len() < known.len() && known.len() > 1 {
        let doubts = odd.into_iter().map(|(d, e)| {
            let place = format!("demo {}", view.demos[d].number);
            let what = format!("the others are {} wide, this scene is", length(usual));
            if fits(e) {
                let ratio = if e > usual { e / usual } else { usual / e };
                return Doubt {
                    kind: DoubtKind::LengthUnit,
                    place,
                    seen: format!("{what} {}: {ratio:.0} times", length(e)),
                    reading: "it has another unit than the others".into(),
                    ask: "import its session by itself, with its own `length`".into(),
                };
            }
            unit(place, e, &what)
        });
        found.extend(doubts);
        return true;
    }
    if metres == 0.0 || fits(metres) {
        return false;
    }
    let mut doubt = unit(String::new(), metres, "the scene is");
    let drives = (WIDEST_M..DRIVEN_M).contains(&metres);
    doubt.reading += if drives { ", or the robot drives" } else { "" };
    found.extend([doubt]);
    !drives
}

/// Greatest usual speed of a hand that picks, carries and places, in metres a second. Arms and people are slower.
const FASTEST_M_S: f64 = 3.0;
/// Longest usual time from one snapshot to the next, in seconds.
const LONGEST_STEP_S: f64 = 300.0;
/// A usual time from one snapshot to the next, in seconds.
const USUAL_STEP_S: f64 = 2.0;
/// Time below which a slow task may take it from one snapshot to the next, in seconds: an hour.
const SLOWEST_S: f64 = 3600.0;
/// Units of time, with their number in a second.
const CLOCKS: [(&str, f64); 3] = [("ms", 1e3), ("us", 1e6), ("ns", 1e9)];

fn clock(place: String, step: f64, usual: f64, what: &str) -> Doubt {
    let nearest = |a: &&(&str, f64), b: &&(&str, f64)| {
        let off = |(_, per_s): &(&str, f64)| (step / per_s / usual).ln().abs();
        off(a).total_cmp(&off(b))
    };
    let slow = if step < SLOWEST_S { ", or the task is slow" } else { "" };
    let (name, per_s) = CLOCKS.iter().min_by(nearest).copied().unwrap_or(CLOCKS[0]);
    Doubt::new(DoubtKind::TimeUnit, place, format!("{what} are {step:.0} s apart"))
        .reading(format!("the times are probably {name} ({:.2} s){slow}", step / per_s))
        .ask(format!("import the log with `time_unit` set to `{name}`, or divide `t` by {per_s:e}"))
}

/// Doubts about the times of snapshots. Speeds count only if lengths are `metric`.
pub(super) fn times(view: &View<'_>, metric: bool, found: &mut Found) {
    let step = |demo: &Demo<'_>| {
        let pairs = demo.times_s.windows(2).filter_map(|p| Some(p[1]? - p[0]?));
        let mut steps: Vec<f64> = pairs.filter(|step| *step > 0.0).collect();
        (!steps.is_empty()).then(|| middle(&mut steps))
    };
    let steps: Vec<Option<f64>> = view.demos.iter().map(step).collect();
    let mut known: Vec<f64> = steps.iter().copied().flatten().collect();
    let usual = middle(&mut known);
    if usual > LONGEST_STEP_S {
        found.extend([clock(String::new(), usual, USUAL_STEP_S, "snapshots")]);
    } else if known.len() > 1 {
        for (demo, step) in view.demos.iter().zip(&steps) {
            let Some(step) = step.filter(|s| *s > LONGEST_STEP_S && *s > 100.0 * usual) else {
                continue;
            };
            let place = format!("demo {}", demo.number);
            found.extend([clock(place, step, usual, "its snapshots")]);
        }
    }
    let mut speeds: Vec<f64> = Vec::new();
    for demo in &view.demos {
        for hold in &demo.holds {
            let moved = || {
                let object = &demo.objects[hold.object?];
                let far = (object.since(hold.to)?.at - object.by(hold.from)?.at).norm();
                let took = demo.times_s[hold.to]? - demo.times_s[hold.from]?;
                (far > view.far_m() && took > 0.0).then_some(far / took)
            };
            speeds.extend(moved());
        }
        for s in 1..demo.len() {
            let (Some(before), Some(now)) = (demo.times_s[s - 1], demo.times_s[s]) else {
                continue;
            };
            if now > before {
                continue;
            }
            found.push(DoubtKind::DuplicateTime, || {
                Doubt::new(
                    DoubtKind::DuplicateTime,
                    demo.place(s),
                    format!("its time of {now} s is that of the snapshot before it"),
                )
                .reading("one of the two is recorded twice, or the clock stood")
                .ask("leave the repeated line out, or record with a finer clock")
            });
        }
    }
    let speed = middle(&mut speeds);
    if metric && speed > FASTEST_M_S {
        let seen = format!("objects are carried at {speed:.0} m/s");
        found.extend([Doubt::new(DoubtKind::TimeUnit, "", seen)]);
    }
}
