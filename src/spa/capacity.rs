//! Predicts how reliably pointers are decoded, and how many dimensions and neurons a reliability needs.
//!
//! A sum of K bound role-filler pairs is unbound with one role, and the most similar of M items is taken. The directions
//! of items that are in no pair are uniform, so `(1 + cosine) / 2` of their cosine with the unbound pointer has the
//! distribution `Beta((D - 1) / 2, (D - 1) / 2)`. The reliability is the mean, over the cosine of the right filler, of
//! the probability that none of the M - 1 others scores higher.
//!
//! Let `N = K - 1 + sigma^2` be the power of the other pairs and of the noise, and let the unbound pointer have the dot
//! product `1 + x` with the right filler and the squared length `P (1 + y)`. The cosine of the right filler is
//! `(1 + x) / sqrt(P (1 + y))`, where the logarithm of `1 + y` is taken as normal, and x as normal around a parabola over
//! it. In the spectrum, the squared moduli of a random unit vector have a Dirichlet distribution, whose moments are
//! known. For large D this gives:
//!
//! | | random roles | unitary roles |
//! |---|---|---|
//! | `P` | `2 + N` | `1 + N` |
//! | `D var x` | `2 + N` | `N` |
//! | `D P cov(x, y)` | `8 + 4 N` | `2 N` |
//! | `D P^2 var y` | `48 + 24 N + 4 N^2` | `4 N + 2 N^2` |
//!
//! For random roles the code has the exact moments, which are smaller. The usual formula for large D (Plate 1995,
//! appendix; Frady, Kleyko and Sommer, "A theory of sequence indexing and working memory in recurrent neural networks",
//! 2018) ignores the covariance of x and y, and predicts too little for random roles: 0.78 where 0.90 are sampled, at
//! D = 32, K = 2 and M = 100.
//!
//! An item that is the filler of m other pairs scores with the variance `(P + m) / D` instead of `P / D`: the mean fourth
//! power of the modulus of a random vector's spectrum is 2, not 1. For the same reason, m other pairs with the right
//! filler add `m / D` to `var x`. Fillers count as drawn from the items, so m has the mean `(K - 1) / M`. With 11 pairs
//! of 4 items this asks for a quarter more dimensions.
//!
//! # Neurons
//!
//! A [`State`](super::State) of spiking neurons that holds the sum adds noise. Its variance, at right angles to the sum
//! and relative to the squared norm of the sum, is `a / n + b / n^2 + c` for n neurons per dimension: `a` counts the
//! spikes, `b` the distortion of the decoders, and `c` the values outside the radius of an ensemble. The numbers below
//! were measured with the default tuning, 5 to 200 neurons per dimension, 64 dimensions and a synapse of 5 ms.
//!
//! In 50 configurations drawn at random (1 to 12 pairs, 2 to 1,000 items, noise up to 1, wanted reliabilities from 0.9 to
//! 0.999) the answer was at most 10% above the least number of dimensions found by trial; `tests/spa/capacity.rs` repeats
//! this, and ten configurations in spikes.

use statrs::distribution::{Beta, Continuous, ContinuousCDF, Normal};

use super::vocabulary::Vocabulary;
use crate::neurons::Tuning;
use crate::sim::VocabTag;
use crate::spa::item_memory::dots;

/// A superposition of bound pairs from which one filler is decoded.
///
/// ```
/// use symbolt::neurons::Tuning;
/// use symbolt::spa::Capacity;
///
/// let five_of_hundred = Capacity { dimensions: 256, pairs: 5, items: 100, ..Capacity::default() };
/// assert!(five_of_hundred.reliability() > 0.9999);
/// assert_eq!(five_of_hundred.dimensions_for(0.999), Some(178));
///
/// // A population of spiking neurons holds the sum.
/// let held = Capacity { dimensions: 192, neurons: Some(Tuning::default()), ..five_of_hundred };
/// assert!(held.reliability() > 0.999);
/// assert_eq!(held.neurons_for(0.999), Some(15));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capacity {
    /// Number of dimensions, at least 2.
    pub dimensions: usize,
    /// Number of bound pairs in the sum. Their fillers are drawn from the items.
    pub pairs: usize,
    /// Number of items from which the filler is chosen.
    pub items: usize,
    /// Norm of the noise on the sum; each pair has norm 1. Each component of the noise has the standard deviation
    /// `noise / sqrt(dimensions)`.
    pub noise: f64,
    /// Whether the roles are unitary, so that their inverse is exact.
    pub unitary_roles: bool,
    /// Neurons of the [`State`](super::State) that holds the sum; `None` for exact maths. The role is fixed, as in
    /// [`Linear::unbind`](super::Linear::unbind), so unbinding takes no neurons.
    ///
    /// The radius of the state is the expected norm of the sum, the square root of `pairs + noise^2`; or the sum is
    /// scaled to a radius of 1. A smaller radius cuts the sum off. Only the numbers of neurons and of sub-dimensions
    /// count. Rates, intercepts and regularisation are taken to be the defaults, those of spiking [`Lif`](crate::neurons::Lif)
    /// neurons, and the synapse 5 ms.
    pub neurons: Option<Tuning>,
}

impl Default for Capacity {
    fn default() -> Self {
        let (noise, unitary_roles, neurons) = (0.0, false, None);
        Self { dimensions: 256, pairs: 1, items: 2, noise, unitary_roles, neurons }
    }
}

/// Noise of a population: dimensions of an ensemble, and the coefficients of 1 / n, of 1 / n^2 and of 1.
const POPULATION_NOISE: [[f64; 4]; 5] = [
    [1.0, 0.40, 1.3, 0.017],
    [2.0, 0.58, 0.9, 0.002],
    [4.0, 0.69, 0.9, 0.0],
    [8.0, 0.79, 1.4, 0.0],
    [16.0, 1.03, 2.3, 0.0],
];

/// Returns the squared norm of the noise that a population adds to a pointer of norm 1.
fn population_noise(neurons: &Tuning, dimensions: usize) -> f64 {
    let most = neurons.sub_dimensions.clamp(1, dimensions.max(1));
    let of_one = (1..=most).rev().find(|d| dimensions.is_multiple_of(*d)).unwrap_or(1) as f64;
    let per = neurons.per_dimension as f64 * neurons.scale;
    if per.is_nan() || per <= 0.0 {
        return f64::INFINITY;
    }
    let noise = |[_, a, b, c]: [f64; 4]| a / per + b / (per * per) + c;
    // Between two measured sizes, and beyond the last, on a line over the logarithm of the size.
    let above = POPULATION_NOISE.iter().position(|row| row[0] >= of_one).unwrap_or(4).max(1);
    let (low, high) = (POPULATION_NOISE[above - 1], POPULATION_NOISE[above]);
    let share = (of_one / low[0]).ln() / (high[0] / low[0]).ln();
    noise(low) + share * (noise(high) - noise(low))
}

/// Greatest number of dimensions that [`Capacity::dimensions_for`] considers.
const MOST_DIMENSIONS: usize = 1 << 20;
/// Greatest number of neurons per dimension that [`Capacity::neurons_for`] considers.
const MOST_NEURONS: usize = 10_000;
/// Points at which a normal density is integrated, and the range in standard deviations.
const POINTS: i32 = 80;
const RANGE: f64 = 6.0;

/// Returns the mean of `value` over a standard normal number.
fn mean(mut value: impl FnMut(f64) -> f64) -> f64 {
    let (normal, step) = (Normal::standard(), 2.0 * RANGE / f64::from(POINTS));
    let at = |i: i32| -RANGE + step * f64::from(i);
    let (mut sum, mut weight) = (0.0, 0.0);
    for i in 0..=POINTS {
        let density = normal.pdf(at(i));
        sum += density * value(at(i));
        weight += density;
    }
    sum / weight
}

/// Moments of the dot product `1 + x` and of the squared length `power (1 + y)`.
struct Moments {
    power: f64,
    var_x: f64,
    cov: f64,
    var_y: f64,
}

impl Moments {
    /// Returns the moments in `dim` dimensions, where the other pairs and the noise have the power `other`.
    fn of(dim: f64, other: f64, unitary_roles: bool) -> Self {
        if unitary_roles {
            let power = 1.0 + other;
            let (cov, var_y) = (2.0 * other / power, other * (4.0 + 2.0 * other) / power.powi(2));
            return Self { power, var_x: other / dim, cov: cov / dim, var_y: var_y / dim };
        }
        // The values at 0 and, for even D, at D / 2 are real; `bins` others are complex and stand for two each.
        let real = if dim % 2.0 == 0.0 { 2.0 } else { 1.0 };
        let bins = (dim - real) / 2.0;
        // A sum over all values: of the first number for complex ones, and of the second for real ones.
        let over = |complex: f64, alone: f64| bins * complex + real * alone;
        let two = dim / (dim + 2.0);
        let three = two * dim / (dim + 4.0);
        let four = three * dim / (dim + 6.0);
        let (once, twice, all) = (over(4.0, 3.0), over(16.0, 9.0), dim * dim);
        let apart = all - over(4.0, 1.0);
        let mean = two * once / dim;
        let power = mean + other;
        let dots = two * two * (twice + apart) / all - 1.0;
        let both = two * three * (over(48.0, 45.0) + dim * once - over(8.0, 3.0)) / all - mean;
        let square = two * four * (over(192.0, 315.0) + once * once - twice) / all - mean * mean;
        let crossed = 4.0 * three * over(12.0, 15.0) / all;
        let alone = two * (twice + apart) / all - 1.0;
        Self {
            power,
            var_x: dots + other / dim,
            cov: (both + 2.0 * two * once * other / all) / power,
            var_y: (square + crossed * other + alone * other * other) / power.powi(2),
        }
    }
}

impl Capacity {
    /// Returns the probability that the right filler is decoded, 0 to 1: 0 if the noise is not finite or there are no
    /// neurons. Costs a few milliseconds.
    pub fn reliability(&self) -> f64 {
        let Self { dimensions, pairs, items, noise, unitary_roles, neurons } = *self;
        // Beyond this the formulas leave the range of numbers, and nothing is decoded long before.
        let within = noise.abs() < 1e9 && pairs < 1 << 40 && items < 1 << 60;
        if dimensions < 2 || !within {
            return 0.0;
        }
        if items < 2 || pairs == 0 {
            return 1.0;
        }
        let (dim, others) = (dimensions as f64, (pairs - 1) as f64);
        let sum = 1.0 + others + noise * noise;
        let held = neurons.map_or(0.0, |neurons| sum * population_noise(&neurons, dimensions));
        if !held.is_finite() {
            return 0.0;
        }
        let other = sum - 1.0 + held;
        let Moments { power, var_x, cov, var_y } = Moments::of(dim, other, unitary_roles);
        // How often an item is the filler of another pair: never with this probability, and else so often.
        let copies = others / items as f64;
        let never = (1.0 - 1.0 / items as f64).powf(others);
        let often = if copies > 0.0 { copies / (1.0 - never) } else { 0.0 };
        let var_x = var_x + copies / dim;
        // The logarithm of 1 + y has the deviation `spread`. At z deviations, the mean of x is `slope z + bend (z^2 - 1)`.
        // Without a bend x is normal, with half the squared slope `1 + x` is lognormal. Sampled quantiles for N from 0 to 4
        // and 12 to 48 dimensions lie near the first for small N, and near the second for great N.
        let spread = var_y.ln_1p().sqrt();
        let slope = if spread > 0.0 { cov / spread } else { 0.0 };
        let bend = slope * slope * other / (1.0 + other) / 2.0;
        let rest = (var_x - slope * slope - 2.0 * bend * bend).max(0.0).sqrt();
        let (length, longer) = (power.sqrt(), (power + often).sqrt());
        let Ok(directions) = Beta::new((dim - 1.0) / 2.0, (dim - 1.0) / 2.0) else { return 0.0 };
        let below = |cosine: f64| directions.cdf(((1.0 + cosine) / 2.0).clamp(0.0, 1.0));
        let found = |dot: f64| never * below(dot / length) + (1.0 - never) * below(dot / longer);
        let reliability = mean(|z| {
            let shrink = (spread * (spread / 2.0 - z) / 2.0).exp();
            let middle = 1.0 + slope * z + bend * (z * z - 1.0);
            mean(|h| found((middle + rest * h) * shrink).powf((items - 1) as f64))
        });
        reliability.clamp(0.0, 1.0)
    }

    /// Returns the least number of dimensions with at least this reliability, whatever the value of
    /// [`dimensions`](Self::dimensions); `None` if more than 1,048,576 are needed or `reliability` is not below 1.
    /// Costs some 0.1 s.
    pub fn dimensions_for(&self, reliability: f64) -> Option<usize> {
        least(MOST_DIMENSIONS, |dimensions| {
            reliability < 1.0 && Self { dimensions, ..*self }.reliability() >= reliability
        })
    }

    /// Returns the least number of neurons per dimension with at least this reliability, in these dimensions; `None` if
    /// even 10,000 are too few. The other settings are those of [`neurons`](Self::neurons), or the default ones. Costs
    /// some 0.1 s.
    ///
    /// Neurons replace no dimensions: where [`dimensions_for`](Self::dimensions_for) in exact maths asks for more than
    /// there are, no number of neurons is enough.
    pub fn neurons_for(&self, reliability: f64) -> Option<usize> {
        let neurons = self.neurons.unwrap_or_default();
        let enough = |per_dimension| {
            let neurons = Some(Tuning { per_dimension, ..neurons });
            reliability < 1.0 && Self { neurons, ..*self }.reliability() >= reliability
        };
        least(MOST_NEURONS, enough)
    }
}

/// Returns the least number from 1 to `most` that is enough, if more is never less.
fn least(most: usize, enough: impl Fn(usize) -> bool) -> Option<usize> {
    if !enough(most) {
        return None;
    }
    let (mut low, mut high) = (0, most);
    while high - low > 1 {
        let middle = low.midpoint(high);
        if enough(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

/// Number of classes of similarity in a vocabulary's prediction.
const CLASSES: usize = 400;

impl<V: VocabTag> Vocabulary<V> {
    /// Returns the probability that cleanup finds a pointer of this vocabulary to which noise was added: the mean over
    /// the names, 0 to 1. The similarities are those of the vocabulary's pointers, which count as unit vectors.
    ///
    /// `noise` is the norm of the noise; each component has the standard deviation `noise / sqrt(D)`. Given the noise's
    /// dot product with the right pointer, those with the others count as independent. Costs O(names^2 D): some 0.1 s
    /// for 1,000 names of 512 dimensions.
    pub fn reliability(&self, noise: f64) -> f64 {
        if self.len() < 2 {
            return 1.0;
        }
        if !noise.is_finite() {
            return 0.0;
        }
        let normal = Normal::standard();
        let sd = (noise.abs() / (self.dim() as f64).sqrt()).max(1e-12);
        let middle = |class: usize| -1.0 + (class as f64 + 0.5) * 2.0 / CLASSES as f64;
        let mut similarities = vec![0.0; self.len()];
        let counts: Vec<Vec<(usize, f64)>> = (0..self.len())
            .filter_map(|index| {
                dots(self.matrix(), self.vector(index)?.values(), &mut similarities);
                let mut classes = vec![0.0; CLASSES];
                for (other, similarity) in similarities.iter().enumerate() {
                    let share = (f64::from(*similarity) + 1.0) / 2.0;
                    if other != index {
                        classes[((share * CLASSES as f64) as usize).min(CLASSES - 1)] += 1.0;
                    }
                }
                Some(classes.into_iter().enumerate().filter(|(_, count)| *count > 0.0).collect())
            })
            .collect();
        let average = mean(|h| {
            let right = 1.0 + sd * h;
            let logs: Vec<f64> = (0..CLASSES)
                .map(|class| {
                    let similarity: f64 = middle(class);
                    let margin =
                        right * (1.0 - similarity) / (sd * (1.0 - similarity.powi(2)).sqrt());
                    normal.cdf(margin).max(1e-300).ln()
                })
                .collect();
            let found = |classes: &Vec<(usize, f64)>| -> f64 {
                classes.iter().map(|(class, count)| count * logs[*class]).sum::<f64>().exp()
            };
            counts.iter().map(found).sum::<f64>() / counts.len() as f64
        });
        average.clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neurons::{LifSpec, Population, PopulationPlan, Tuning};
    use crate::sim::{GraphBuilder, ProbeSpec, Real, Seed, Signal, SimDuration, Synapse};
    use crate::spa::{State, VocabularyBuilder, random_pointer};

    /// Mean squared error of a population at right angles to unit pointers, which change every 40 ms, over their squared
    /// length in its output.
    fn measured_noise(dim: usize, spec: Tuning) -> f64 {
        struct Things;
        impl VocabTag for Things {
            const NAME: &'static str = "things";
        }
        let things = VocabularyBuilder::<Things>::new(dim, Seed::new(1)).build().unwrap();
        let shown: Vec<Vec<Real>> =
            (0..40).map(|i| random_pointer(dim, Seed::new(2).derive_index("shown", i))).collect();
        let own = shown.clone();
        let mut graph = GraphBuilder::new();
        let given = Signal::pointer(things.space(), move |time_s, out| {
            out.copy_from_slice(&own[((time_s * 25.0 + 0.01) as usize).min(39)]);
        });
        let given = graph.add("given", given);
        let held = graph.add("held", State::new(&things));
        graph.connect(&given, &held.input, Synapse::None);
        let every = ProbeSpec::every(SimDuration::from_millis(40));
        let probe = graph.probe(&held.output, every);
        let plan = PopulationPlan::all(Population::Lif(LifSpec::tuned(spec)));
        let sim = graph.run(&plan, Seed::new(1), SimDuration::from_millis(1_600)).unwrap();
        let samples = sim.samples(&probe);
        let error = |(pointer, held): (&Vec<Real>, &[Real])| {
            let along = f64::from(crate::spa::dot(pointer, held));
            f64::from(crate::spa::dot(held, held)) / (along * along) - 1.0
        };
        let errors = shown.iter().zip(samples.iter().map(|(_, held)| held));
        errors.map(|(pointer, held)| error((pointer, &held))).sum::<f64>() / samples.len() as f64
    }

    #[test]
    fn a_population_adds_the_noise_that_the_table_says() {
        for (dim, sub_dimensions, per_dimension) in [(64, 16, 20), (64, 4, 10), (60, 12, 20)] {
            let spec = Tuning { sub_dimensions, per_dimension, ..Tuning::default() };
            let (measured, said) = (measured_noise(dim, spec), population_noise(&spec, dim));
            let ratio = measured / said;
            assert!((0.8..1.25).contains(&ratio), "{dim} {sub_dimensions}: {measured} {said}");
            // With half the neurons the table must say something else.
            let half = Tuning { per_dimension: per_dimension / 2, ..spec };
            assert!(population_noise(&half, dim) > 1.8 * measured);
        }
    }
}
