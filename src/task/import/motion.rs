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
        .flat_map(|w| [0, 1, 2].map(|i| (w[0].position[i] - 2.0 * w[1].position[i] + w[2].position[i]).abs()))
        .collect();
    median(&mut bends).unwrap_or(0.0) / 0.6745 / 6f64.sqrt()
}

/// Finds when an object moved. Costs the number of samples times that in a window.
pub(super) fn motion(track: &Track) -> Motion {
    let samples = &*track.samples;
    let mut steps: Vec<f64> = samples.windows(2).map(|w| w[1].t - w[0].t).collect();
    let step = median(&mut steps).unwrap_or(f64::INFINITY);
    let mut found = Motion { step, sparse: step > SPARSE_STEP || samples.len() < 12, ..Motion::default() };
    if found.sparse {
        return found;
    }
    let white = white(samples, step);
    let window = WINDOW.max(4.0 * step);
    let (mut middles, mut differences) = (Vec::new(), Vec::new());
    for sample in samples {
        let inside = between(samples, sample.t, sample.t + window - step / 2.0);
        middles.push(middle(inside).unwrap_or(sample.position));
    }
    for (index, sample) in samples.iter().enumerate() {
        let before = samples.partition_point(|s| s.t < sample.t - window + step / 4.0);
        let before = if before >= index { index.saturating_sub(1) } else { before };
        differences.push(distance(middles[before], middles[index]));
    }
    let mut sorted = differences.clone();
    let quarter = sorted.len() / 4;
    let (_, quarter, _) = sorted.select_nth_unstable_by(quarter, f64::total_cmp);
    let count = (window / step).max(1.0);
    // The median of n normal numbers has 1.25 times the deviation of their mean; of two windows, the square root of 2.
    let expected = white * 1.25 * (2.0 / count).sqrt();
    let spread = (*quarter / QUARTILE).clamp(expected, 4.0 * expected.max(LEAST / DIFFER / 4.0));
    found.noise = white.max(spread / (1.25 * (2.0 / count).sqrt()));
    let limit = (DIFFER * spread).max(LEAST);
    found.limit = limit;
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for index in (0..samples.len()).filter(|index| differences[*index] > limit) {
        match runs.last_mut() {
            Some((_, last)) if samples[index].t - samples[*last].t <= 1.5 * window => *last = index,
            _ => runs.push((index, index)),
        }
    }
    let ends = |at: usize| (samples[runs[at].0].t, samples[runs[at].1].t);
    for run in 0..runs.len() {
        let (from, to) = ends(run);
        let earliest = run.checked_sub(1).map_or(f64::NEG_INFINITY, |before| ends(before).1);
        let latest = if run + 1 < runs.len() { ends(run + 1).0 } else { f64::INFINITY };
        // The places before and after, from samples a window away from the motion.
        let before = rest(between(samples, (from - 2.0).max(earliest + window), from - window), true);
        let after = rest(between(samples, (to + window).min(latest), (to + 2.0).min(latest - window)), false);
        let begin = before.map_or(from, |place| {
            let away = |s: &Sample| distance(s.position, place);
            onset(samples, from, found.noise, limit, earliest, &away, false).unwrap_or(from)
        });
        let end = after.map_or(to, |place| {
            let away = |s: &Sample| distance(s.position, place);
            onset(samples, to, found.noise, limit, latest, &away, true).unwrap_or(to)
        });
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
        found.moves.push(Move { from: begin, to: end.max(begin), distance: moved.max(typical) });
    }
    found
}

/// The place of a resting object; `None` without samples. `last` takes the end of the stretch if it is long.
fn rest(samples: &[Sample], last: bool) -> Option<[f64; 3]> {
    let most = 200;
    let from = if last { samples.len().saturating_sub(most) } else { 0 };
    middle(&samples[from..samples.len().min(from + most)])
}

/// Finds when an object left its place, or, `reversed`, when it came to it: the distance from the place is fitted with
/// a power of the time since then. `near` is a moment at which it surely moves.
fn onset(
    samples: &[Sample],
    near: f64,
    noise: f64,
    limit: f64,
    bound: f64,
    away: &dyn Fn(&Sample) -> f64,
    reversed: bool,
) -> Option<f64> {
    let sign = if reversed { -1.0 } else { 1.0 };
    // Time runs towards the motion; it is 0 at `near`.
    let clock = |s: &Sample| (s.t - near) * sign;
    let inside = match reversed {
        false => between(samples, (near - 1.2).max(bound), near + 0.6),
        true => between(samples, near - 0.6, (near + 1.2).min(bound)),
    };
    let mut points: Vec<(f64, f64)> = inside.iter().map(|s| (clock(s), away(s))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    if points.len() < 6 {
        return None;
    }
    // Only the beginning of the motion follows a power: up to the larger of ten times the noise and a few centimetres.
    let reach = (10.0 * noise).max(2.0 * limit).max(0.02);
    let end = points.iter().position(|(t, d)| *t > 0.0 && *d > reach).map_or(points.len(), |at| at + 1);
    points.truncate(end);
    // A distance from noisy numbers is never 0: compare squares, whose mean grows by three variances.
    let floor = 3.0 * noise * noise;
    let values: Vec<(f64, f64)> =
        points.iter().map(|(t, d)| (*t, (d * d - floor).max(0.0).sqrt())).collect();
    let mut best: Option<(f64, f64)> = None;
    let first = values.first()?.0;
    let last = values.last()?.0;
    for power in [1.0, 2.0, 3.0] {
        let mut start = first;
        while start < last - 0.02 {
            let (mut dot, mut square, mut total) = (0.0, 0.0, 0.0);
            for (t, d) in &values {
                let shape = (t - start).max(0.0).powf(power);
                dot += shape * d;
                square += shape * shape;
                total += d * d;
            }
            if square > 0.0 {
                let error = total - dot * dot / square;
                // Simpler shapes unless another is clearly better.
                let error = error * (1.0 + 0.03 * power);
                if best.is_none_or(|(least, _)| error < least) {
                    best = Some((error, start));
                }
            }
            start += 0.01;
        }
    }
    best.map(|(_, start)| near + sign * start)
}
