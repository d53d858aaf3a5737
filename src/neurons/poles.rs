//! Finds where a function is not finite, also between the points at which its decoders are solved.

use super::tuning::{TuningError, refuse};

/// A function of vectors: gets an argument and writes its values.
pub(super) type Function<'a> = dyn Fn(&[f64], &mut [f64]) + 'a;

/// The error for a function whose value cannot be decoded.
pub(super) fn not_finite(value: f64, at: impl std::fmt::Debug) -> TuningError {
    refuse("function", format!("{value} at {at:?}"), "finite values within the radius")
}

/// Greatest number of places that are searched.
const PLACES: usize = 24;
/// Halvings of an interval: two neighbours of single precision remain.
const HALVINGS: usize = 60;

/// One number of a value, as a function of the place between two points: 0 at the first and 1 at the second.
struct Between<'a> {
    function: &'a Function<'a>,
    ends: [&'a [f64]; 2],
    output: usize,
    outputs: usize,
}

impl Between<'_> {
    fn point(&self, share: f64) -> Vec<f64> {
        self.ends[0].iter().zip(self.ends[1]).map(|(a, b)| a + (b - a) * share).collect()
    }

    fn at(&self, share: f64) -> f64 {
        let mut out = vec![0.0; self.outputs];
        (self.function)(&self.point(share), &mut out);
        out[self.output]
    }

    /// Follows a change of sign, or the greatest magnitude. Returns the place and value where it ends, and the
    /// magnitude after a few steps.
    fn follow(&self, changes_sign: bool) -> (f64, f64, f64) {
        let (mut low, mut high, mut early) = (0.0, 1.0, 0.0);
        let sign = self.at(0.0) < 0.0;
        for step in 0..HALVINGS {
            let third = (high - low) / 3.0;
            let (a, b) = match changes_sign {
                true => (low + 1.5 * third, low + 1.5 * third),
                false => (low + third, high - third),
            };
            let (at_a, at_b) = (self.at(a), self.at(b));
            for (at, value) in [(a, at_a), (b, at_b)] {
                if !value.is_finite() {
                    return (at, value, early);
                }
            }
            let upward = if changes_sign { (at_a < 0.0) == sign } else { at_a.abs() < at_b.abs() };
            if upward {
                low = a
            } else {
                high = b
            }
            if step < if changes_sign { 8 } else { 16 } {
                early = at_a.abs().max(at_b.abs());
            }
        }
        let (at_low, at_high) = (self.at(low), self.at(high));
        if at_low.abs() > at_high.abs() { (low, at_low, early) } else { (high, at_high, early) }
    }
}

/// Checks that a function of the ball around 0 is finite at the center and at both ends of the first 64 axes, and that
/// it has no poles between points, so far as they can be seen.
///
/// Between neighbouring points (in one dimension; else points that follow each other) where the function changes its
/// sign, the change is followed by halving; in one dimension, so are the greatest magnitudes. A pole is where values
/// then grow without end: at last beyond 30 times those at both points, 1,000 times the median, and 10 times what they
/// were after some steps. `points` and `values` have a row per point. Costs some thousand calls of the function.
pub(super) fn check(
    function: &Function<'_>,
    radius: f64,
    (points, dims): (&[f64], usize),
    (values, outputs): (&[f64], usize),
) -> Result<(), TuningError> {
    let mut out = vec![0.0; outputs];
    for axis in 0..=2 * dims.min(64) {
        let mut point = vec![0.0; dims];
        if axis > 0 {
            point[(axis - 1) / 2] = if axis % 2 == 0 { radius } else { -radius };
        }
        out.fill(0.0);
        function(&point, &mut out);
        if let Some(value) = out.iter().find(|value| !value.is_finite()) {
            return Err(not_finite(*value, point));
        }
    }
    between(function, (points, dims), (values, outputs))
}

/// As [`check`], only between the points.
pub(super) fn between(
    function: &Function<'_>,
    (points, dims): (&[f64], usize),
    (values, outputs): (&[f64], usize),
) -> Result<(), TuningError> {
    let mut order: Vec<usize> = (0..points.len() / dims.max(1)).collect();
    if dims == 1 {
        order.sort_by(|a, b| points[*a].total_cmp(&points[*b]));
    }
    for output in 0..outputs {
        let value = |at: usize| values[order[at] * outputs + output];
        let point = |at: usize| &points[order[at] * dims..][..dims];
        let mut magnitudes: Vec<f64> = (0..order.len()).map(|at| value(at).abs()).collect();
        let peak = |at: usize| {
            let here = value(at).abs();
            here > value(at - 1).abs() && here >= value(at + 1).abs()
        };
        // The first point, the number of steps to the last, and whether the sign changes.
        let mut places: Vec<(usize, usize, bool)> = (1..order.len())
            .filter(|at| (value(at - 1) < 0.0) != (value(*at) < 0.0))
            .map(|at| (at - 1, 1, true))
            .chain(
                (1..order.len().saturating_sub(1))
                    .filter(|at| dims == 1 && peak(*at))
                    .map(|at| (at - 1, 2, false)),
            )
            .collect();
        let most = |place: &(usize, usize, bool)| {
            (place.0..=place.0 + place.1).map(|at| value(at).abs()).fold(0.0, f64::max)
        };
        places.sort_by(|a, b| most(b).total_cmp(&most(a)));
        magnitudes.sort_by(f64::total_cmp);
        let median = magnitudes.get(magnitudes.len() / 2).copied().unwrap_or_default();
        for place in places.iter().take(PLACES) {
            let ends = [point(place.0), point(place.0 + place.1)];
            let line = Between { function, ends, output, outputs };
            let (share, found, early) = line.follow(place.2);
            let bound = (30.0 * most(place)).max(1e3 * median).max(10.0 * early);
            if !found.is_finite() || found.abs() > bound {
                return Err(not_finite(found, line.point(share)));
            }
        }
    }
    Ok(())
}
