//! Marginal likelihoods of clusters of poses, in closed form.
//!
//! A coordinate of a cluster is *tight* (a Gaussian with unknown mean and variance) or *open* (uniform over the scene,
//! or over a range of unknown ends). The mean of a tight coordinate has a uniform prior over the scene. Its variance has
//! a prior that is a mixture of three inverse-gamma distributions with shape 1/2: careful, loose and broad placings. The
//! width of a range has a log-uniform prior. All of these integrate out. The likelihood of a coordinate is the weighted
//! mean of all five. Orientations are treated alike: free, tight about one axis, or tight.

use nalgebra::{Matrix3, Vector3};
use statrs::function::gamma::ln_gamma;

use super::noise::Noise;

/// Shape of the prior of a variance.
const SHAPE: f64 = 0.5;
/// Scale of careful placing, in metres and radians, without noise of sensing.
const PLACED_M: f64 = 2e-4;
const PLACED_RAD: f64 = 0.02;
/// Scale of a displacement that is meant to be the same each time, in metres.
const DISPLACED_M: f64 = 1e-3;
/// Scales of loose and of broad placings, in metres.
const LOOSE_M: f64 = 3e-3;
const BROAD_M: f64 = 4e-2;
/// Smallest width of a range in which objects lie anywhere, in metres.
const RANGE_M: f64 = 2e-2;
/// Log probability that an object was put onto something uneven.
const UNEVEN: f64 = -4.0;
/// Ratio of a variance to that of noise up to which it may be noise. Of few values, the variance is uncertain.
const NOISE: f64 = 5.0;
/// Numbers of sides from which objects may look alike, and of poses from which this is seen.
pub(super) const SIDES: [f64; 4] = [2.0, 3.0, 4.0, 6.0];
pub(super) const SYMMETRIC: usize = 3;
/// Evidence for such sides up to which they may be chance, in nats: few angles nearly fit some number of sides.
pub(super) const BY_CHANCE: f64 = 3.0;
/// Volume of the rotations as rotation vectors, per coordinate: the cube root of 8 pi squared.
const TURN_EXTENT: f64 = 4.290_6;
/// The same for directions: the square root of 4 pi.
const DIRECTION_EXTENT: f64 = 3.544_9;

/// What the likelihood of the values of one coordinate depends on, beside their number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spread {
    pub sum: f64,
    pub square: f64,
    pub low: f64,
    pub high: f64,
}

impl Spread {
    pub fn of(value: f64) -> Self {
        Self { sum: value, square: value * value, low: value, high: value }
    }

    /// Returns the spread of some values; `None` if there are none.
    pub fn over(values: impl Iterator<Item = f64>) -> Option<Self> {
        values.map(Self::of).reduce(|a, b| a.add(&b))
    }

    fn add(&self, other: &Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            square: self.square + other.square,
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Sum of the squared deviations of `n` values from their mean.
    pub fn squares(&self, n: usize) -> f64 {
        self.square - self.sum * self.sum / n as f64
    }
}

/// Additive sums over the poses of a cluster in one frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sums {
    pub position: [Spread; 3],
    pub turn: Matrix3<f64>,
    /// Sum of the logarithms of the number of references to choose from.
    pub choices: f64,
    /// Sum of the distances to the reference, in metres. Beside a reference that moves, they count more.
    pub far: f64,
    /// Number of poses to which another object that moves is nearer than the reference.
    pub crowded: f64,
    /// Number of poses in which objects were found and from which they were taken.
    pub found: f64,
    /// Number of poses in which objects were put.
    pub put: f64,
    /// Sum of the variances of a coordinate by noise of sensing, of the object and of its reference, in square metres.
    pub noise: f64,
    /// The same of an angle about one axis, in square radians.
    pub noise_rad: f64,
    /// Share of the squared angles about each axis that noise may explain, in square radians; 0 unless it is left out.
    pub explained_rad: f64,
}

/// Returns the share of the variances of `n` poses that noise may explain in their squares.
fn explained_share(n: usize) -> f64 {
    NOISE * n.saturating_sub(1) as f64 / n as f64
}

impl Sums {
    /// Leaves out the scatter of `n` poses that noise may explain. What was seen with noise scatters more in the frame of
    /// something that was seen with noise, too, which says nothing about where it belongs.
    pub fn without_noise(&self, n: usize) -> Self {
        let explained = explained_share(n) * self.noise;
        let position = self.position.map(|spread| Spread {
            square: spread.square - explained.min(spread.squares(n)),
            ..spread
        });
        Self { position, explained_rad: explained_share(n) * self.noise_rad, ..self.clone() }
    }

    pub fn add(&self, other: &Self) -> Self {
        Self {
            position: std::array::from_fn(|i| self.position[i].add(&other.position[i])),
            turn: self.turn + other.turn,
            choices: self.choices + other.choices,
            far: self.far + other.far,
            crowded: self.crowded + other.crowded,
            found: self.found + other.found,
            put: self.put + other.put,
            noise: self.noise + other.noise,
            noise_rad: self.noise_rad + other.noise_rad,
            explained_rad: self.explained_rad + other.explained_rad,
        }
    }
}

/// The settings of a likelihood.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Likelihood {
    /// Scale of a tight coordinate, in metres.
    pub scale_m: f64,
    /// Scale of a tight orientation, in radians.
    pub scale_rad: f64,
    /// Whether orientation counts.
    pub turns: bool,
    /// `ln_gamma(SHAPE + k / 2)` for every k.
    gammas: Vec<f64>,
}

impl Likelihood {
    /// Returns the likelihood of at most `most` poses of objects that were put down.
    pub fn of_placing(noise: &Noise, most: usize) -> Self {
        let gammas = (0..=3 * most).map(|k| ln_gamma(SHAPE + k as f64 / 2.0)).collect();
        let scale_rad = PLACED_RAD.hypot(noise.angle_rad);
        Self { scale_m: PLACED_M.hypot(noise.position_m), scale_rad, turns: false, gammas }
    }

    /// Returns the likelihood of at most `most` displacements.
    pub fn of_displacing(noise: &Noise, most: usize) -> Self {
        let scale_m = DISPLACED_M.hypot(noise.position_m);
        Self { scale_m, ..Self::of_placing(noise, most) }
    }

    fn gamma(&self, k: usize) -> f64 {
        self.gammas.get(k).copied().unwrap_or_else(|| ln_gamma(SHAPE + k as f64 / 2.0))
    }

    /// Log marginal likelihood of `n` values with this sum of squared deviations, if they are tight.
    pub fn tight(&self, n: usize, squares: f64, extent: f64, scale: f64) -> f64 {
        let b = SHAPE * scale * scale;
        let free = n.saturating_sub(1);
        -extent.ln() - 0.5 * (n as f64).ln() - 0.5 * free as f64 * std::f64::consts::TAU.ln()
            + self.gamma(free)
            - self.gamma(0)
            + SHAPE * b.ln()
            - (SHAPE + 0.5 * free as f64) * (b + 0.5 * squares.max(0.0)).ln()
    }

    /// Log marginal likelihood of `n` values from a range of unknown ends. Of the ranges of width w, the values leave a share
    /// of (w - span) / extent; the width has the density 1 / (w ln(extent / RANGE_M)).
    fn ranged(n: usize, span: f64, extent: f64) -> f64 {
        let n = n as f64;
        let extent = extent.max(1.1 * span).max(1.1 * RANGE_M);
        let least = span.max(RANGE_M);
        let share = |power: f64| 1.0 - (least / extent).powf(power);
        let ranges = if n > 1.0 { share(n - 1.0) / (n - 1.0) } else { (extent / least).ln() }
            - span / least * share(n) / n;
        (1.0 - n) * least.ln() + (ranges / (extent / RANGE_M).ln()).ln() - extent.ln()
    }

    /// Log marginal likelihoods of tight values of three scales.
    fn scales(&self, n: usize, spread: &Spread, extent: f64) -> [f64; 3] {
        [self.scale_m, LOOSE_M.max(self.scale_m), BROAD_M.max(self.scale_m)]
            .map(|scale| self.tight(n, spread.squares(n), extent, scale))
    }

    /// Log marginal likelihoods of one coordinate: tight and open, with their priors of 3/4 and 1/4. Tight is the mean
    /// of three scales, open that of the scene and of a range.
    pub fn coordinate(&self, n: usize, spread: &Spread, extent: f64) -> (f64, f64) {
        let [a, b, c] = self.scales(n, spread, extent);
        let range = Self::ranged(n, spread.high - spread.low, extent);
        let open = log_add(-(n as f64) * extent.ln(), range);
        (log_add(log_add(a, b), c) - 4f64.ln(), open - 8f64.ln())
    }

    /// Log marginal likelihood of heights of objects that were put onto something. They agree unless they were put onto
    /// several things.
    pub fn heights(&self, n: usize, spread: &Spread, extent: f64) -> f64 {
        let [a, b, _] = self.scales(n, spread, extent);
        let (tight, open) = self.coordinate(n, spread, extent);
        log_add(log_add(a, b) - 2f64.ln(), log_add(tight, open) + UNEVEN)
    }

    /// Returns whether values agree so well that they are placed with care.
    pub fn is_careful(&self, n: usize, spread: &Spread, extent: f64) -> bool {
        let [a, b, c] = self.scales(n, spread, extent);
        n >= 2 && log_add(a, b) > log_add(c, -(n as f64) * extent.ln()) + 1.0
    }

    /// Log marginal likelihoods of the orientations, relative to uniform ones: free, about one axis, full. Each has
    /// its prior of 1/3. `explained` is the sum of the squared angles about each axis that does not count.
    pub fn turn(&self, n: usize, turn: &Matrix3<f64>, explained: f64) -> [f64; 3] {
        let third = 3f64.ln();
        if n < 2 {
            return [-third; 3];
        }
        let about = about(n, turn).map(|squares| (squares - 2.0 * explained).max(0.0));
        let all = (overall(n, turn) - 3.0 * explained).max(0.0);
        let coordinate = |n: usize, squares: f64, extent: f64| {
            self.tight(n, squares, extent, self.scale_rad) + n as f64 * extent.ln()
        };
        let [x, y, z] = about.map(|squares| 2.0 * coordinate(n, squares / 2.0, DIRECTION_EXTENT));
        let axis = log_add(log_add(x, y), z) - third;
        let full = 3.0 * coordinate(n, all / 3.0, TURN_EXTENT);
        [-third, axis - third, full - third]
    }

    /// Log marginal likelihood of `n` poses in one frame. `extent` is the size of the scene.
    pub fn poses(&self, n: usize, sums: &Sums, extent: &[f64; 3]) -> f64 {
        let mut total = -sums.choices;
        for (spread, extent) in sums.position.iter().zip(extent) {
            let (tight, open) = self.coordinate(n, spread, *extent);
            total += log_add(tight, open);
        }
        if self.turns {
            total += self.orientation(n, sums);
        }
        total
    }

    /// Returns by how much likelier orientations are if objects that look alike from several sides were put down in any of these ways:
    /// turned by parts of a full turn about one of their axes. `sums` are the sums of the poses.
    pub fn symmetric(&self, turns: &[Matrix3<f64>], sums: &Sums) -> f64 {
        let n = turns.len();
        if n < SYMMETRIC {
            return 0.0;
        }
        let explained = explained_share(n) * sums.noise_rad;
        let squares = about(n, &sums.turn);
        let axis = (0..3).min_by(|a, b| squares[*a].total_cmp(&squares[*b])).unwrap_or(2);
        let folded = SIDES.map(|sides| self.sides(turns, (axis, sides), explained));
        let lines = (0..3).map(|axis| self.line(turns, axis, explained));
        let line = lines.fold(f64::NEG_INFINITY, f64::max) - 9f64.ln();
        // What lies face up or face down has no such axis, but its sides are all horizontal.
        let best = folded.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let [free, axis, full] = self.turn(n, &sums.turn, explained);
        let best = line.max(best - (3.0 * SIDES.len() as f64).ln());
        (best - BY_CHANCE - log_add(log_add(free, axis), full)).max(0.0)
    }

    /// Returns the log likelihood, relative to uniform ones, of orientations in which an axis of the object points in one direction and its
    /// turns about that are one of so many equal parts of a full turn; minus infinity if the axis does not point in one direction.
    /// `explained` is as in [`turn`](Self::turn).
    pub fn sides(
        &self,
        turns: &[Matrix3<f64>],
        (axis, sides): (usize, f64),
        explained: f64,
    ) -> f64 {
        let n = turns.len();
        let tilt = (about(n, &turns.iter().sum())[axis] - 2.0 * explained).max(0.0);
        let direction = self.tight(n, tilt / 2.0, DIRECTION_EXTENT, self.scale_rad);
        let direction = 2.0 * (direction + n as f64 * DIRECTION_EXTENT.ln());
        if direction <= 0.0 {
            return f64::NEG_INFINITY;
        }
        let extent = std::f64::consts::TAU / sides;
        let squares = (folded(turns, axis, sides) - explained).max(0.0);
        let around = self.tight(n, squares, extent, self.scale_rad);
        direction + around + n as f64 * extent.ln()
    }

    /// Returns the log likelihood, relative to uniform ones, of orientations in which an axis of the object lies along one line, with either
    /// end ahead. `explained` is as in [`turn`](Self::turn).
    pub fn line(&self, turns: &[Matrix3<f64>], axis: usize, explained: f64) -> f64 {
        let (n, extent) = (turns.len(), DIRECTION_EXTENT / 2f64.sqrt());
        let squares = (off_line(turns, axis).0 - 2.0 * explained).max(0.0);
        2.0 * (self.tight(n, squares / 2.0, extent, self.scale_rad) + n as f64 * extent.ln())
    }

    /// Log marginal likelihood of `n` orientations, relative to uniform ones.
    pub fn orientation(&self, n: usize, sums: &Sums) -> f64 {
        let [free, axis, full] = self.turn(n, &sums.turn, sums.explained_rad);
        log_add(log_add(free, axis), full)
    }
}

/// Returns the sums of the squared angles of each axis of the object, given the sum of the rotation matrices.
pub(super) fn about(n: usize, turn: &Matrix3<f64>) -> [f64; 3] {
    std::array::from_fn(|i| 2.0 * (n as f64 - turn.column(i).norm()))
}

/// Returns the sum of the squared angles between an axis of the object and the line that it lies along, with either end ahead, and the
/// greatest of these angles, in radians.
pub(super) fn off_line(turns: &[Matrix3<f64>], axis: usize) -> (f64, f64) {
    let scatter: Matrix3<f64> =
        turns.iter().map(|turn| turn.column(axis) * turn.column(axis).transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let (at, most) = eigen.eigenvalues.argmax();
    let line = eigen.eigenvectors.column(at).into_owned();
    let off = |turn: &Matrix3<f64>| turn.column(axis).dot(&line).abs().min(1.0).acos();
    (turns.len() as f64 - most, turns.iter().map(off).fold(0.0, f64::max))
}

/// Returns the sum of the squared angles between the orientations and their mean.
pub(super) fn overall(n: usize, turn: &Matrix3<f64>) -> f64 {
    let values = (turn.transpose() * turn).symmetric_eigenvalues();
    let mut roots = [values[0], values[1], values[2]].map(|v: f64| v.max(0.0).sqrt());
    roots.sort_by(|a, b| b.total_cmp(a));
    let last = if turn.determinant() < 0.0 { -roots[2] } else { roots[2] };
    3.0 * n as f64 - (roots[0] + roots[1] + last)
}

/// Returns the sum of the squared angles of orientations about their mean, when turned by parts of a full turn about an axis of the object
/// as near to it as they come.
pub(super) fn folded(turns: &[Matrix3<f64>], axis: usize, sides: f64) -> f64 {
    let sum: Matrix3<f64> = turns.iter().sum();
    let mean = sum.column(axis).normalize();
    let aside = if mean.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
    let aside = (aside - mean * mean.dot(&aside)).normalize();
    let ahead = mean.cross(&aside);
    let angle = |turn: &Matrix3<f64>| {
        let side = turn.column((axis + 1) % 3);
        side.dot(&ahead).atan2(side.dot(&aside))
    };
    let total = |of: fn(f64) -> f64| turns.iter().map(|t| of(sides * angle(t))).sum::<f64>();
    let spread = turns.len() as f64 - total(f64::cos).hypot(total(f64::sin));
    2.0 * spread / (sides * sides)
}

pub(super) fn log_add(a: f64, b: f64) -> f64 {
    let most = a.max(b);
    most + ((a - most).exp() + (b - most).exp()).ln()
}
