//! When an object moved: its noise, the stretches in which it moved, and where these begin and end.

use super::finish::median;
use super::streams::{Sample, Track};

/// A stretch in which an object moved, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Move {
    pub from: f64,
    pub to: f64,
    /// Distance between the places before and after or, if it is more, the median distance from the place before, in metres.
    pub distance: f64,
    /// Whether the places before and after surely differ.
    pub shifted: bool,
}

/// What is known of the motion of one object.
#[derive(Debug, Clone, Default)]
pub(super) struct Motion {
    pub moves: Vec<Move>,
    /// Standard deviation of a coordinate of one sample, in metres.
    pub noise: f64,
    /// Median time between samples, in seconds.
    pub step: f64,
    /// Least distance that is no noise, in metres.
    pub limit: f64,
    /// Whether there are too few samples to see the object move.
    pub sparse: bool,
}

/// Greatest number of samples from which a place is told.
const MOST: usize = 200;
/// Length of the motion that is fitted, in seconds.
const FITTED: f64 = 0.35;
/// Windows in which positions are compared, in seconds, unless the stream is slow.
const WINDOW: f64 = 0.2;
/// Standard deviations at which two windows differ.
const DIFFER: f64 = 6.0;
/// The first quartile of the length of a normal vector in space.
const QUARTILE: f64 = 1.101;
/// Steps between samples above which an object counts as seen now and then, in seconds.
const SPARSE_STEP: f64 = 0.8;
/// Least distance that is no noise, in metres, for streams without noise.
const LEAST: f64 = 5e-4;

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

/// Returns the median of each coordinate.
pub(super) fn middle(samples: &[Sample]) -> Option<[f64; 3]> {
    let mut values: Vec<f64> = Vec::with_capacity(samples.len());
    let mut axis = |axis: usize| {
        values.clear();
        values.extend(samples.iter().map(|s| s.position[axis]));
        median(&mut values)
    };
    Some([axis(0)?, axis(1)?, axis(2)?])
}

/// Returns the samples with times in `from..=to`.
pub(super) fn between(samples: &[Sample], from: f64, to: f64) -> &[Sample] {
    let begin = samples.partition_point(|s| s.t < from);
    let end = samples.partition_point(|s| s.t <= to);
    &samples[begin..end.max(begin)]
}

/// The standard deviation of white noise, from second differences.
fn white(samples: &[Sample], step: f64) -> f64 {
    let even = samples.windows(3).filter(|w| w[2].t - w[0].t < 3.0 * step);
    let mut bends: Vec<f64> = even
        .flat_map(|w| {
            [0, 1, 2].map(|i| (w[0].position[i] - 2.0 * w[1].position[i] + w[2].position[i]).abs())
        })
        .collect();
    median(&mut bends).unwrap_or(0.0) / 0.6745 / 6f64.sqrt()
}

/// Distance from an object's origin at which its turns are seen, in metres.
const LEVER: f64 = 0.05;

/// Finds when an object moved or turned. Costs the number of samples times that in a window,
/// of which it takes at most 200.
pub(super) fn motion(track: &Track) -> Motion {
    let mut found = shifts(&track.samples);
    if found.sparse || !track.samples.iter().any(Sample::oriented) {
        return found;
    }
    // Two points of the object that lie on its axes.
    for axis in [0, 2] {
        let oriented = track.samples.iter().filter(|s| s.oriented());
        let points: Vec<Sample> =
            oriented.map(|s| Sample { position: point(s, axis), ..*s }).collect();
        for turn in shifts(&points).moves {
            if !found
                .moves
                .iter()
                .any(|own| own.from < turn.to + WINDOW && turn.from < own.to + WINDOW)
            {
                found.moves.push(turn);
            }
        }
    }
    found.moves.sort_by(|a, b| a.from.total_cmp(&b.from));
    found
}

/// A point on an axis of an object, from its origin.
fn point(sample: &Sample, axis: usize) -> [f64; 3] {
    let [x, y, z, w] = sample.orientation;
    let unit = match axis {
        0 => [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)],
        _ => [2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)],
    };
    unit.map(|v| v * LEVER)
}

/// Finds when a point moved.
fn shifts(samples: &[Sample]) -> Motion {
    let mut steps: Vec<f64> = samples.windows(2).map(|w| w[1].t - w[0].t).collect();
    let step = median(&mut steps).unwrap_or(f64::INFINITY);
    let mut found =
        Motion { step, sparse: step > SPARSE_STEP || samples.len() < 12, ..Motion::default() };
    if found.sparse {
        return found;
    }
    let white = white(samples, step);
    let window = WINDOW.max(4.0 * step);
    let (mut middles, mut differences, mut fewer) = (Vec::new(), Vec::new(), Vec::new());
    for sample in samples {
        let inside = between(samples, sample.t, sample.t + window - step / 2.0);
        fewer.clear();
        fewer.extend(inside.iter().step_by(inside.len() / (MOST + 1) + 1));
        middles.push(middle(&fewer).unwrap_or(sample.position));
    }
    for (index, sample) in samples.iter().enumerate() {
        let before = samples.partition_point(|s| s.t < sample.t - window + step / 4.0);
        let before = if before >= index { index.saturating_sub(1) } else { before };
        differences.push(distance(middles[before], middles[index]));
    }
    let mut sorted = differences.clone();
    let quarter = sorted.len() / 4;
    let (_, quarter, _) = sorted.select_nth_unstable_by(quarter, f64::total_cmp);
    let count = (window / step).clamp(1.0, MOST as f64);
    // The median of n normal numbers has 1.25 times the deviation of their mean; of two windows, the square root of 2.
    let expected = white * 1.25 * (2.0 / count).sqrt();
    let spread = (*quarter / QUARTILE).clamp(expected, 4.0 * expected.max(LEAST / DIFFER / 4.0));
    found.noise = white.max(spread / (1.25 * (2.0 / count).sqrt()));
    let limit = (DIFFER * spread).max(LEAST);
    found.limit = limit;
    // What rests for less has no place beside which a motion could be told.
    let apart = 2.0 * window + 3.0 * step;
    let mut runs: Vec<(usize, usize)> = Vec::new();
    // Windows that the stream cuts short tell little.
    let whole = samples.partition_point(|s| s.t + window / 2.0 <= samples[samples.len() - 1].t);
    for index in (0..whole).filter(|index| differences[*index] > limit) {
        match runs.last_mut() {
            Some((_, last)) if samples[index].t - samples[*last].t <= apart => *last = index,
            _ => runs.push((index, index)),
        }
    }
    let ends = |at: usize| (samples[runs[at].0].t, samples[runs[at].1].t);
    for run in 0..runs.len() {
        let (from, to) = ends(run);
        let earliest = run.checked_sub(1).map_or(f64::NEG_INFINITY, |before| ends(before).1);
        let latest = if run + 1 < runs.len() { ends(run + 1).0 } else { f64::INFINITY };
        // The places before and after, from samples a window away from the motion.
        let sides = [
            between(samples, (from - 2.0).max(earliest + window), from - window),
            between(samples, (to + window).min(latest), (to + 2.0).min(latest - window)),
        ];
        let (before, after) = (rest(sides[0], true), rest(sides[1], false));
        // The places are medians; they may be noise apart.
        let [few, many] = sides.map(|samples| samples.len().clamp(1, MOST) as f64);
        let sure = 6.0 * 1.25 * found.noise * (1.0 / few + 1.0 / many).sqrt();
        let apart = before.zip(after).map(|(a, b)| distance(a, b) > sure.max(LEAST));
        let shifted = apart.unwrap_or(to - from > 2.0 * window);
        let begin = before.and_then(|place| {
            onset(samples, from, &found, &Rest { place, bound: earliest, follows: false })
        });
        let end = after.and_then(|place| {
            onset(samples, to, &found, &Rest { place, bound: latest, follows: true })
        });
        let (begin, end) = (begin.unwrap_or(from), end.unwrap_or(to));
        let first = before.or_else(|| samples.first().map(|s| s.position));
        let last = after.or_else(|| samples.last().map(|s| s.position));
        let moved = first.zip(last).map_or(0.0, |(a, b)| distance(a, b));
        let farthest = between(samples, from, to).iter().zip(std::iter::repeat(first));
        let farthest = farthest.filter_map(|(s, first)| Some(distance(s.position, first?)));
        let mut farthest: Vec<f64> = farthest.collect();
        let typical = median(&mut farthest).unwrap_or(0.0);
        // What comes back at once was a jump of the sensor.
        if moved < limit && (typical < limit || to - from < 2.0 * window) {
            continue;
        }
        found.moves.push(Move {
            from: begin,
            to: end.max(begin),
            distance: moved.max(typical),
            shifted,
        });
    }
    found
}

/// The place of a resting object; `None` without samples. `last` takes the end of the stretch if it is long.
fn rest(samples: &[Sample], last: bool) -> Option<[f64; 3]> {
    let from = if last { samples.len().saturating_sub(MOST) } else { 0 };
    middle(&samples[from..samples.len().min(from + MOST)])
}

/// A resting place beside a motion.
struct Rest {
    place: [f64; 3],
    /// The other motion on the far side of the rest, in seconds.
    bound: f64,
    /// Whether the rest follows the motion.
    follows: bool,
}

/// Finds when an object left its place or came to it: the distance from the place, in the direction of the motion, is
/// fitted with shapes in which arms and hands begin to move. `near` is a moment at which the object surely moves.
fn onset(samples: &[Sample], near: f64, found: &Motion, rest: &Rest) -> Option<f64> {
    let sign = if rest.follows { -1.0 } else { 1.0 };
    let inside = match rest.follows {
        false => between(samples, (near - 1.0).max(rest.bound), near + FITTED),
        true => between(samples, near - FITTED, (near + 1.0).min(rest.bound)),
    };
    // Time runs towards the motion and is 0 at `near`.
    let mut points: Vec<(f64, [f64; 3])> = (inside.iter())
        .map(|s| ((s.t - near) * sign, [0, 1, 2].map(|axis| s.position[axis] - rest.place[axis])))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let length = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    // The direction is that of the first part of the motion, which is seen above the noise.
    let reach = (12.0 * found.noise).max(2.0 * found.limit).max(0.02);
    let end = points.iter().position(|(t, v)| *t > 0.0 && length(v) > reach);
    let end = end.map_or(points.len(), |at| at + 1);
    if end < 5 {
        return None;
    }
    let mut way = [0.0; 3];
    for (_, v) in &points[end.saturating_sub(3)..end] {
        (0..3).for_each(|axis| way[axis] += v[axis]);
    }
    let long = length(&way);
    if long <= 0.0 {
        return None;
    }
    let along = |v: &[f64; 3]| v.iter().zip(way).map(|(a, b)| a * b).sum::<f64>() / long;
    let values: Vec<(f64, f64)> = points.iter().map(|(t, v)| (*t, along(v))).collect();
    let first = values.first()?.0.max(-0.6);
    // Each shape with the time that it takes; one with a time of its own has one more parameter to fit with.
    let more = (values.len() as f64).ln() / values.len() as f64;
    let mut best: Option<(f64, f64)> = None;
    for (shape, penalty) in
        [(Shape::Even, 0.0), (Shape::Smooth, more), (Shape::Smoother, more + 0.05)]
    {
        for lasts in [0.35, 0.5, 0.7, 1.0, 1.4, 2.0] {
            if shape == Shape::Even && lasts != 1.0 {
                continue;
            }
            let mut start = first;
            while start < 0.15 {
                let (mut dot, mut square, mut total) = (0.0, 0.0, 0.0);
                for (t, d) in &values {
                    let value = shape.at((t - start) / lasts);
                    dot += value * d;
                    square += value * value;
                    total += d * d;
                }
                if square > 0.0 {
                    let error = (total - dot * dot / square) * penalty.exp();
                    if best.is_none_or(|(least, _)| error < least) {
                        best = Some((error, start));
                    }
                }
                start += 0.01;
            }
        }
    }
    best.map(|(_, start)| near + sign * start)
}

/// How the distance grows when a motion begins.
#[derive(Clone, Copy, PartialEq)]
enum Shape {
    /// At once with full speed.
    Even,
    /// With a cubic polynomial, from rest to rest.
    Smooth,
    /// With least jerk, from rest to rest.
    Smoother,
}

impl Shape {
    fn at(self, u: f64) -> f64 {
        let v = u.clamp(0.0, 1.0);
        match self {
            Self::Even => u.max(0.0),
            Self::Smooth => v * v * (3.0 - 2.0 * v),
            Self::Smoother => v * v * v * (10.0 - v * (15.0 - 6.0 * v)),
        }
    }
}
