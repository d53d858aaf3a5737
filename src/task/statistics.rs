//! Rates and means with their 95% intervals.

use serde_json::{Map, Value, json};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// The 97.5% point of the normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// Successes of a number of trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// How many succeeded.
    pub successes: u64,
    /// Of how many.
    pub trials: u64,
    /// How many independent trials would say as much: all of them, or fewer where they come in clusters whose members
    /// are alike.
    pub effective: f64,
}

impl Rate {
    /// Of independent trials.
    ///
    /// ```
    /// use symbolt::task::statistics::Rate;
    /// let [low, high] = Rate::new(198, 200).interval95();
    /// assert!((low - 0.9643).abs() < 1e-3 && (high - 0.9973).abs() < 1e-3);
    /// ```
    pub fn new(successes: u64, trials: u64) -> Self {
        Self { successes, trials, effective: trials as f64 }
    }

    /// Of trials in clusters, each given by its successes and its trials: clusters are independent of one another, their
    /// members need not be. The variance of the share is that of a ratio of two sums over clusters (Cochran 1977,
    /// section 9A.2), and the effective number is that of independent trials of the same variance, lowered by what
    /// Student's interval is wider at so few clusters (Korn and Graubard 1998). Members that all agree, or
    /// that are all of one cluster, tell nothing about how alike they are: they count as independent.
    pub fn of_clusters(clusters: impl Iterator<Item = [u64; 2]> + Clone) -> Self {
        let filled = clusters.filter(|[_, of]| *of > 0);
        let (mut count, mut successes, mut trials) = (0u32, 0, 0);
        for [own, of] in filled.clone() {
            (count, successes, trials) = (count + 1, successes + own, trials + of);
        }
        let independent = Self::new(successes, trials);
        let share = independent.share();
        let from_mean = |[own, of]: [u64; 2]| (own as f64 - share * of as f64).powi(2);
        let squares: f64 = filled.map(from_mean).sum();
        let degrees = f64::from(count) - 1.0;
        let Ok(student) = StudentsT::new(0.0, 1.0, degrees) else { return independent };
        let variance = squares * f64::from(count) / degrees / (trials as f64).powi(2);
        if variance <= 0.0 {
            return independent;
        }
        let wider = (student.inverse_cdf(0.975) / Z).powi(2);
        let effective = (share * (1.0 - share) / variance / wider).min(trials as f64);
        Self { effective, ..independent }
    }

    /// The share of successes; 0 of none.
    pub fn share(&self) -> f64 {
        if self.trials == 0 { 0.0 } else { self.successes as f64 / self.trials as f64 }
    }

    /// Wilson's interval at `z` standard deviations (Wilson 1927), of the effective number of trials: it stays within 0
    /// and 1 and has its width even where all trials agree. Of no trials it is all from 0 to 1.
    pub fn interval(&self, z: f64) -> [f64; 2] {
        if self.trials == 0 {
            return [0.0, 1.0];
        }
        let (n, share) = (self.effective, self.share());
        let middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half =
            z / (1.0 + z * z / n) * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
        [(middle - half).max(0.0), (middle + half).min(1.0)]
    }

    /// The interval at 95% confidence.
    pub fn interval95(&self) -> [f64; 2] {
        self.interval(Z)
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
            Self::Rate(rate) => rate.interval95(),
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

    /// How many independent trials would say as much as those of a rate.
    pub fn effective_trials(&self) -> Option<f64> {
        match self {
            Self::Rate(rate) => Some(rate.effective),
            Self::Mean(_) => None,
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
                "effective_trials": rate.effective, "interval95": interval,
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
            let [a, b] = Rate::new(successes, trials).interval95();
            assert!((a - low).abs() < 5e-5 && (b - high).abs() < 5e-5, "{a} {b}");
        }
        assert_eq!(Rate::new(0, 0).interval95(), [0.0, 1.0]);
    }

    #[test]
    fn members_of_clusters_that_are_alike_count_as_fewer() {
        // Four clusters of five, each all of a kind: as four trials, less what Student's interval is wider.
        let rate = Rate::of_clusters([[5, 5], [0, 5], [5, 5], [0, 5]].into_iter());
        assert_eq!((rate.successes, rate.trials), (10, 20));
        // p(1-p) = 1/4; variance = (4 x 2.5^2) x 4/3 / 20^2 = 1/12; (1.96 / 3.1824)^2 = 0.3793.
        assert!((rate.effective - 3.0 * 0.3793).abs() < 1e-3, "{}", rate.effective);
        // Clusters of one are plain trials, but for Student's part.
        let ones = (0..400).map(|i| [u64::from(i % 4 == 0), 1]);
        let rate = Rate::of_clusters(ones);
        assert!(rate.effective > 390.0 && rate.effective <= 400.0, "{}", rate.effective);
        for agreeing in [vec![[5, 5], [3, 3]], vec![[2, 5]], vec![]] {
            let rate = Rate::of_clusters(agreeing.into_iter());
            assert_eq!(rate.effective, rate.trials as f64);
        }
    }

    #[test]
    fn intervals_of_clusters_hold_the_truth_as_often_as_they_say() {
        // Ten clusters of four whose own rate is 0.2 or 0.9 with equal chance: 0.55 in the mean. 2,000 intervals: three
        // standard errors of a coverage of 95% are 1.5 points. Counting all as independent must fail.
        use crate::sim::Seed;
        use rand::RngExt;
        let mut held = [0.0, 0.0];
        for index in 0..2_000 {
            let mut rng = Seed::new(1).derive_index("intervals", index).rng();
            let clusters: Vec<[u64; 2]> = (0..10)
                .map(|_| {
                    let own = if rng.random() { 0.2 } else { 0.9 };
                    [(0..4).map(|_| u64::from(rng.random_bool(own))).sum(), 4]
                })
                .collect();
            let rate = Rate::of_clusters(clusters.into_iter());
            let all = Rate::new(rate.successes, rate.trials);
            for (held, rate) in held.iter_mut().zip([rate, all]) {
                let [low, high] = rate.interval95();
                *held += f64::from(u8::from(low <= 0.55 && 0.55 <= high)) / 2e3;
            }
        }
        assert!((0.935..=0.985).contains(&held[0]), "{held:?}");
        assert!(held[1] < 0.9, "{held:?}");
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
