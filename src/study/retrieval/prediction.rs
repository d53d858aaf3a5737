//! Closed forms of retrieval in exact arithmetic.
//!
//! An object is an unnormalised sum of bound atoms, and a query is the sum of two bound atoms. A match scores 2 on the
//! average, an object with one of the two atoms 1: a half match. Half matches above the threshold are the errors.
//!
//! Each further atom of an object adds the product with both atoms of the query to its score. The product of two
//! different bound atoms has the variance 1 / D; with Gaussian roles it is 2 / D within a role, because the mean
//! fourth power of the modulus of a role's spectrum is 2. One further atom therefore adds 2 / D with unitary roles and
//! 3 / D with Gaussian ones. The atom that a half match shares adds 1 / D by its product with the other atom of the
//! query, and 2 / D by its own length with Gaussian roles. So a half match with 2 m further atoms has the variance
//! `(4 m + 1) / D` or `(6 m + 3) / D`. The two atoms of a match have one product that counts twice: `4 / D`, and another
//! `4 / D` by their lengths with Gaussian roles. In a tight frame of N atoms the products have the variance
//! `(1 - D / N) / D`.
//!
//! The number of further atoms has a Poisson distribution with the mean 2 m.

use statrs::distribution::{ContinuousCDF, Discrete, Normal, Poisson};

use super::exact::Method;
use super::symbols::Roles;
use super::world::WorldSpec;

/// What closed forms predict for the objects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Predicted {
    /// Variance of the score of a half match, or of its similarity to the condition that it does not meet.
    pub variance: f64,
    /// Share of found objects that are matches.
    pub precision: f64,
    /// Share of matches that are found.
    pub recall: f64,
}

/// Predicts precision and recall of the objects.
pub fn predicted(spec: &WorldSpec, dimensions: usize, method: Method) -> Predicted {
    let (dim, each) = (dimensions as f64, spec.each);
    let per_place = spec.objects as f64 * each / spec.places as f64;
    let matches = per_place * each / spec.goals as f64;
    let halves = per_place + spec.objects as f64 * each / spec.goals as f64;
    let roles = match method {
        Method::Sum(roles) | Method::Joint { roles, .. } => roles,
    };
    let atoms = (spec.places + spec.goals) as f64;
    let frame = if roles == Roles::Frame { (1.0 - dim / atoms).max(0.0) } else { 1.0 };
    // Variances, in units of 1 / D, of each further atom, of a half match and of a match.
    let [further, half, whole] = match (method, roles) {
        (Method::Sum(_), Roles::Gaussian) => [3.0, 3.0, 8.0],
        (Method::Sum(_), _) => [2.0, 1.0, 4.0],
        (Method::Joint { .. }, Roles::Gaussian) => [1.5, 1.0, 3.0],
        (Method::Joint { .. }, _) => [1.0, 1.0, 1.0],
    };
    let noise = match method {
        Method::Sum(_) => 0.0,
        Method::Joint { noise, .. } => f64::from(noise).powi(2),
    };
    // The noise of a condition meets all atoms of an object: those that it shares with the query, and the further ones.
    let sd = |(own, shared): (f64, f64), count: f64| {
        (frame * (own + further * count) / dim + noise * (count + shared)).sqrt()
    };
    let mean_of = |own: (f64, f64), excess: &dyn Fn(f64) -> f64| {
        over_poisson(2.0 * each, |count| excess(sd(own, count)))
    };
    let (half, whole) = ((half, 1.0), (whole, 2.0));
    let variance = sd(half, 2.0 * each).powi(2);
    match method {
        Method::Sum(_) => {
            let recall = 0.9;
            let level = falling_to(recall, [0.0, 4.0], |level| {
                mean_of(whole, &|sd| tail((level - 2.0) / sd))
            });
            let false_ones = halves * mean_of(half, &|sd| tail((level - 1.0) / sd));
            // As the paper counts: all matches over all matches and false alarms.
            Predicted { variance, precision: matches / (matches + false_ones), recall }
        }
        Method::Joint { level, .. } => {
            let level = f64::from(level);
            let meets = |sd: f64| tail((level - 1.0) / sd);
            let recall = mean_of(whole, &|sd| meets(sd).powi(2));
            let false_ones = halves * mean_of(half, &|sd| meets(sd) * tail(level / sd));
            let found = matches * recall;
            Predicted { variance, precision: found / (found + false_ones), recall }
        }
    }
}

/// Returns the probability that a standard normal number is at least `z`.
fn tail(z: f64) -> f64 {
    Normal::standard().sf(z)
}

/// Returns the mean of `value` over a number with a Poisson distribution.
fn over_poisson(mean: f64, value: impl Fn(f64) -> f64) -> f64 {
    let Ok(poisson) = Poisson::new(mean) else { return value(0.0) };
    let most = (mean + 10.0 * mean.sqrt() + 10.0) as u64;
    (0..=most).map(|count| poisson.pmf(count) * value(count as f64)).sum()
}

/// Returns where a falling function has the value `target`.
fn falling_to(target: f64, [mut low, mut high]: [f64; 2], value: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if value(middle) > target { low = middle } else { high = middle }
    }
    (low + high) / 2.0
}
