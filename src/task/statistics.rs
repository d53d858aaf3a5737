//! Rates and means with their 95% intervals.

use serde_json::{Map, Value, json};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// The 97.5% point of the normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// Successes of a number of trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    /// How many succeeded.
    pub successes: u64,
    /// Of how many.
    pub trials: u64,
}

impl Rate {
    /// The share of successes; 0 of none.
    pub fn share(&self) -> f64 {
        if self.trials == 0 { 0.0 } else { self.successes as f64 / self.trials as f64 }
    }

    /// Wilson's interval at `z` standard deviations (Wilson 1927): it stays within 0 and 1 and has its width
    /// even where all trials agree.
    pub fn interval(&self, z: f64) -> [f64; 2] {
        if self.trials == 0 {
            return [0.0, 1.0];
        }
        let (n, share) = (self.trials as f64, self.share());
        let middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half =
            z / (1.0 + z * z / n) * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
        [(middle - half).max(0.0), (middle + half).min(1.0)]
    }
}

/// Mean and spread of a number of trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// The mean; NaN of none.
    pub mean: f64,
    /// The standard deviation of the trials; NaN of fewer than two.
    pub sd: f64,
    /// Numbers below which a twentieth, half, and all but a twentieth of the trials lie; NaN of none.
    pub quantiles: [f64; 3],
    /// How many trials gave a number.
    pub n: u64,
}

impl Mean {
    /// Of numbers in their order, leaving out those that are not one.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let numbers = values.filter(|v| !v.is_nan());
        let n = numbers.clone().count();
        let mean = numbers.clone().sum::<f64>() / n as f64;
        let square: f64 = numbers.clone().map(|v| (v - mean).powi(2)).sum();
        let sd = if n > 1 { (square / (n - 1) as f64).sqrt() } else { f64::NAN };
        let mut sorted: Vec<f64> = numbers.collect();
        sorted.sort_by(f64::total_cmp);
        // Between two trials in proportion (Hyndman and Fan 1996, definition 7).
        let quantiles = [0.05, 0.5, 0.95].map(|share| {
            let at = share * n.saturating_sub(1) as f64;
            let (below, rest) = (at.floor() as usize, at.fract());
            let low = sorted.get(below).copied().unwrap_or(f64::NAN);
            let high = sorted.get(below + 1).copied().unwrap_or(low);
            low + rest * (high - low)
        });
        Self { mean, sd, quantiles, n: n as u64 }
    }

    /// The interval of the mean by Student's distribution; without ends below two trials.
    pub fn interval95(&self) -> [f64; 2] {
        let half = match StudentsT::new(0.0, 1.0, self.n.saturating_sub(1) as f64) {
            Ok(t) if self.n > 1 => t.inverse_cdf(0.975) * self.sd / (self.n as f64).sqrt(),
            _ => f64::INFINITY,
        };
        [self.mean - half, self.mean + half]
    }
}

/// What a row of a table says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Statistic {
    /// A share of successes.
    Rate(Rate),
    /// A mean.
    Mean(Mean),
}

impl Statistic {
    /// The share or the mean.
    pub fn value(&self) -> f64 {
        match self {
            Self::Rate(rate) => rate.share(),
            Self::Mean(mean) => mean.mean,
        }
    }

    /// Between which values it lies with 95% confidence.
    pub fn interval95(&self) -> [f64; 2] {
        match self {
            Self::Rate(rate) => rate.interval(Z),
            Self::Mean(mean) => mean.interval95(),
        }
    }

    /// The standard deviation of a mean's trials.
    pub fn sd(&self) -> Option<f64> {
        match self {
            Self::Rate(_) => None,
            Self::Mean(mean) => Some(mean.sd),
        }
    }

    /// The 5, 50 and 95% points of a mean's trials.
    pub fn quantiles(&self) -> Option<[f64; 3]> {
        match self {
            Self::Rate(_) => None,
            Self::Mean(mean) => Some(mean.quantiles),
        }
    }

    /// How many trials there were.
    pub fn trials(&self) -> u64 {
        match self {
            Self::Rate(rate) => rate.trials,
            Self::Mean(mean) => mean.n,
        }
    }

    /// The keys of `--json`; what is no finite number is null.
    pub fn to_json(&self) -> Map<String, Value> {
        let interval = self.interval95();
        let object = match self {
            Self::Rate(rate) => json!({
                "successes": rate.successes, "trials": rate.trials, "rate": rate.share(),
                "interval95": interval,
            }),
            Self::Mean(mean) => json!({
                "mean": mean.mean, "sd": mean.sd, "n": mean.n, "interval95": interval,
                "quantiles": {"5": mean.quantiles[0], "50": mean.quantiles[1], "95": mean.quantiles[2]},
            }),
        };
        match object {
            Value::Object(map) => map,
            _ => Map::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilsons_interval_is_that_of_the_tables() {
        // Newcombe 1998, table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29.
        for (successes, trials, low, high) in [
            (81, 263, 0.2553, 0.3662),
            (15, 148, 0.0624, 0.1605),
            (0, 20, 0.0, 0.1611),
            (1, 29, 0.0061, 0.1718),
        ] {
            let [a, b] = Rate { successes, trials }.interval(Z);
            assert!((a - low).abs() < 5e-5 && (b - high).abs() < 5e-5, "{a} {b}");
        }
    }

    #[test]
    fn a_mean_leaves_out_what_is_no_number() {
        let mean = Mean::of([1.0, f64::NAN, 2.0, 3.0, 6.0].into_iter());
        assert_eq!((mean.mean, mean.n), (3.0, 4));
        assert!((mean.sd - (14.0f64 / 3.0).sqrt()).abs() < 1e-12);
        let [low, middle, high] = mean.quantiles;
        assert!((low - 1.15).abs() < 1e-12 && middle == 2.5 && (high - 5.55).abs() < 1e-12);
        // Student's 97.5% point of 3 degrees of freedom is 3.1824.
        let half = mean.interval95()[1] - 3.0;
        assert!((half - 3.1824 * mean.sd / 2.0).abs() < 1e-3, "{half}");
        assert!(Mean::of([1.0].into_iter()).interval95()[1].is_infinite());
    }
}
