//! How many random pointers keep a similarity ceiling.

use statrs::distribution::{Beta, ContinuousCDF};

use super::builder::MAX_ATTEMPTS;
use crate::sim::Real;

/// Chance below which a vocabulary counts as impossible.
const HOPELESS: f64 = 1e-9;
/// Products that an impossible vocabulary may cost, about a second without optimisation.
const BUDGET: f64 = 5e8;
/// Cost of drawing a component, in products.
const DRAW: f64 = 15.0;

/// The room that a ceiling leaves to independent random unit vectors.
pub(super) struct Room {
    dim: f64,
    /// Chance that two vectors keep the ceiling.
    pair: f64,
}

impl Room {
    /// For two random unit vectors of D dimensions, `(1 + similarity) / 2` has a beta distribution of parameters
    /// `(D - 1) / 2`.
    pub fn of(dim: usize, ceiling: Real) -> Self {
        let shape = 0.5 * (dim.max(2) - 1) as f64;
        let below = |ceiling: f64| {
            Beta::new(shape, shape).map_or(0.0, |beta| beta.cdf(0.5 * (1.0 - ceiling.min(1.0))))
        };
        Self { dim: dim as f64, pair: 1.0 - 2.0 * below(f64::from(ceiling)) }
    }

    /// Returns about how many pointers can be drawn: with that many others, half of the allowed draws are expected.
    pub fn pointers(&self) -> usize {
        let others = (0.5 * MAX_ATTEMPTS as f64).ln() / -self.pair.ln();
        (others as usize).saturating_add(1)
    }

    /// Returns how many vectors to draw for each of so many pointers. Fewer if all draws together would hardly do.
    pub fn attempts(&self, pointers: usize) -> u64 {
        let name = |others: usize| {
            let missed = MAX_ATTEMPTS as f64 * (-self.pair.powf(others as f64)).ln_1p();
            (-missed.exp_m1()).ln()
        };
        let mut chance = 0.0;
        for others in 1..pointers {
            chance += name(others);
            if chance < HOPELESS.ln() {
                // A draw is compared until it meets one that it is too similar to.
                let compared = 1.0 / (1.0 - self.pair);
                let most = BUDGET / (compared * self.dim * (compared + DRAW));
                return most.clamp(1.0, MAX_ATTEMPTS as f64) as u64;
            }
        }
        MAX_ATTEMPTS
    }
}
