//! Rates and means with their 95% confidence intervals.

use serde_json::{Map, Value, json};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// The 97.5% point of the normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// Number of independent trials below which an interval is only a rough guide
/// ([`Statistic::is_of_few_trials`]).
///
/// The interval of a mean depends on the sample's standard deviation. For `n` normal numbers, this has a relative
/// standard error of about `1 / sqrt(2 (n - 1))`: 24% for ten numbers, 71% for two. For numbers that are not normal,
/// Student's interval may contain the true mean less often than in 95% of cases, and so few trials do not reveal this.
/// The interval of a rate spans 28 percentage points for ten trials and 66 for two, even if all trials agree.
pub const FEW_TRIALS: u64 = 10;

/// The 97.5% point of Student's t distribution. Degrees of freedom below one half count as one half.
fn student(degrees: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees.max(0.5)).map_or(f64::INFINITY, |t| t.inverse_cdf(0.975))
}

/// Successes among a number of trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Number of successes.
    pub successes: u64,
    /// Number of trials.
    pub trials: u64,
    /// Number of independent clusters of trials; equals [`trials`](Self::trials) if all trials are independent.
    pub clusters: u64,
    /// Number of independent trials that would give the same precision; below [`trials`](Self::trials) if trials are
    /// correlated.
    pub effective: f64,
}

impl Rate {
    /// Computes the rate of independent trials. Successes beyond the number of trials are ignored.
    ///
    /// ```
    /// use symbolt::study::statistics::Rate;
    /// let [low, high] = Rate::new(198, 200).interval95();
    /// assert!((low - 0.9643).abs() < 1e-3 && (high - 0.9973).abs() < 1e-3);
    /// ```
    pub fn new(successes: u64, trials: u64) -> Self {
        let successes = successes.min(trials);
        Self { successes, trials, clusters: trials, effective: trials as f64 }
    }

    /// Computes the rate of trials in clusters. Each item is a cluster's number of successes and number of trials.
    /// Clusters are independent of one another; trials within a cluster may be correlated.
    ///
    /// The variance of the rate is computed as that of a ratio of two sums over clusters (Cochran 1977, section 9A.2).
    /// The effective number of trials is the number of independent trials with the same variance. It is reduced because
    /// Student's interval is wider with few clusters (Korn and Graubard 1998); unequal clusters count as fewer equal
    /// clusters (Kish 1965).
    ///
    /// If nearly all trials agree, the data hardly show the correlation within clusters. The effective number is
    /// therefore a weighted harmonic mean of two numbers: the number above, with the count of the rarer answer as its
    /// weight, and the number for clusters of identical trials, with weight 1.
    pub fn of_clusters(clusters: impl Iterator<Item = [u64; 2]> + Clone) -> Self {
        let filled = clusters.filter(|[_, of]| *of > 0).map(|[own, of]| [own.min(of), of]);
        let (mut count, mut successes, mut trials, mut squares) = (0u32, 0, 0, 0.0);
        for [own, of] in filled.clone() {
            (count, successes, trials) = (count + 1, successes + own, trials + of);
            squares += (of as f64).powi(2);
        }
        let plain = Self::new(successes, trials);
        if count < 2 {
            let clusters = u64::from(count);
            return Self { clusters, effective: plain.effective.min(1.0), ..plain };
        }
        let clusters = u64::from(count);
        let (all, share, count) = (trials as f64, plain.share(), f64::from(count));
        let from_mean = |[own, of]: [u64; 2]| (own as f64 - share * of as f64).powi(2);
        let variance = filled.map(from_mean).sum::<f64>() * count / (count - 1.0) / all.powi(2);
        let equal = all.powi(2) / squares;
        let rarer = successes.min(trials - successes) as f64;
        // The variance is zero if the clusters are more alike than chance would make them.
        let shown = if variance > 0.0 { share * (1.0 - share) / variance } else { all };
        let wider = student(equal - 1.0) / Z;
        let effective = (rarer + 1.0) / (rarer / shown.min(all) + 1.0 / equal) / wider.powi(2);
        Self { clusters, effective: effective.min(all), ..plain }
    }

    /// Returns successes divided by trials; 0 without trials.
    pub fn share(&self) -> f64 {
        if self.trials == 0 { 0.0 } else { self.successes as f64 / self.trials as f64 }
    }

    /// Returns Wilson's score interval at `z` standard deviations (Wilson 1927), for the effective number of trials.
    /// The interval stays within 0 and 1 and has a width even if all trials agree. Without trials it is 0 to 1.
    pub fn interval(&self, z: f64) -> [f64; 2] {
        if self.trials == 0 {
            return [0.0, 1.0];
        }
        let (n, share) = (self.effective, self.share().min(1.0));
        let middle = n * share + z * z / 2.0;
        let half = z * (n * share * (1.0 - share) + z * z / 4.0).sqrt();
        // Rounding must not put the rate outside its interval.
        let [low, high] = [middle - half, middle + half].map(|end| end / (n + z * z));
        [low.clamp(0.0, share), high.clamp(share, 1.0)]
    }

    /// Returns the 95% interval.
    pub fn interval95(&self) -> [f64; 2] {
        self.interval(Z)
    }
}

/// Mean and spread of a number that each trial returns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// Mean; NaN without numbers.
    pub mean: f64,
    /// Sample standard deviation; NaN for fewer than two numbers.
    pub sd: f64,
    /// 5%, 50% and 95% quantiles; NaN without numbers.
    pub quantiles: [f64; 3],
    /// Number of trials that returned a number.
    pub n: u64,
    /// Number of independent clusters of these trials; equals [`n`](Self::n) if all trials are independent.
    pub clusters: u64,
    /// Half the width of the 95% interval; infinite for a single number or cluster.
    pub half95: f64,
}

impl Mean {
    /// Computes the mean of independent numbers. NaNs are left out. The interval is Student's.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        Self::of_clusters(values.enumerate().map(|(index, value)| (index as f64, value)))
    }

    /// Computes the mean of numbers in clusters. Each item is a cluster's key and a number. Clusters are independent of
    /// one another; numbers within a cluster may be correlated. The interval is Student's for the number of clusters,
    /// with the variance of a ratio of two sums over clusters (Cochran 1977, section 9A.2). If each cluster has one
    /// number, this is the usual interval.
    pub fn of_clusters(values: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let numbers = values.filter(|(_, v)| !v.is_nan());
        let n = numbers.clone().count();
        let mean = numbers.clone().map(|(_, v)| v).sum::<f64>() / n as f64;
        let square: f64 = numbers.clone().map(|(_, v)| (v - mean).powi(2)).sum();
        let sd = if n > 1 { (square / (n - 1) as f64).sqrt() } else { f64::NAN };
        let mut clustered: Vec<(f64, f64)> = numbers.clone().collect();
        clustered.sort_by(|a, b| a.0.total_cmp(&b.0));
        let clusters = clustered.chunk_by(|a, b| a.0 == b.0);
        let count = clusters.clone().count() as f64;
        let from_mean = clusters.map(|own| own.iter().map(|(_, v)| v - mean).sum::<f64>().powi(2));
        let half95 = if count > 1.0 {
            let variance = from_mean.sum::<f64>() * count / (count - 1.0) / (n as f64).powi(2);
            student(count - 1.0) * variance.sqrt()
        } else {
            f64::INFINITY
        };
        let mut sorted: Vec<f64> = numbers.map(|(_, v)| v).collect();
        sorted.sort_by(f64::total_cmp);
        // Linear interpolation (Hyndman and Fan 1996, definition 7).
        let quantiles = [0.05, 0.5, 0.95].map(|share| {
            let at = share * n.saturating_sub(1) as f64;
            let (below, rest) = (at.floor() as usize, at.fract());
            let low = sorted.get(below).copied().unwrap_or(f64::NAN);
            let high = sorted.get(below + 1).copied().unwrap_or(low);
            low + rest * (high - low)
        });
        Self { mean, sd, quantiles, n: n as u64, clusters: count as u64, half95 }
    }

    /// Computes the mean of differences between two binary outcomes or probabilities, each from -1 to 1. The interval
    /// is computed with one added difference of either sign, so that it has a width even if all differences are zero
    /// (Bonett and Price 2012, for paired proportions).
    pub fn of_differences(values: impl Iterator<Item = f64> + Clone) -> Self {
        let plain = Self::of(values.clone());
        let n = plain.n as f64 + 2.0;
        let numbers = values.filter(|v| !v.is_nan());
        let (sum, squares) = numbers.fold((0.0, 2.0), |(sum, all), v| (sum + v, all + v * v));
        let half95 =
            Z * ((squares / n - (sum / n).powi(2)) / n).sqrt() + (sum / n - plain.mean).abs();
        Self { half95, ..plain }
    }

    /// Returns the 95% interval; infinite for a single number or cluster.
    pub fn interval95(&self) -> [f64; 2] {
        [self.mean - self.half95, self.mean + self.half95]
    }
}

/// How many times as long one thing takes as another. Nothing is assumed of the times' distributions: those on a shared
/// machine have long tails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    /// Median of the ratios; NaN without times.
    pub median: f64,
    /// Interval that holds the true ratio in at least 95% of cases; 0 to infinity for too few times.
    pub interval95: [f64; 2],
}

impl Ratio {
    /// Least number of pairs that give a finite interval.
    pub const LEAST_PAIRS: usize = 6;

    /// Compares times that were measured in pairs, in turn: the first of each over the second. The interval is that of
    /// the sign test, whose ends are two of the ratios.
    pub fn of_pairs(pairs: &[[f64; 2]]) -> Self {
        let n = pairs.len();
        // Ratios of which so many or fewer lie below the median, as often as heads come in n throws.
        let (mut term, mut below, mut cut) = (0.5f64.powi(n as i32), 0.0, 0);
        while cut < n && below + term <= 0.025 {
            below += term;
            term *= (n - cut) as f64 / (cut + 1) as f64;
            cut += 1;
        }
        Self::of_sorted(pairs.iter().map(|[a, b]| a / b).collect(), cut)
    }

    /// Compares times that were measured apart: `own` over `other`. The median is that of all ratios between the two
    /// groups, and the interval that of the rank-sum test (Hodges and Lehmann 1963; Moses 1965), in the normal
    /// approximation. All ratios are kept in memory: their number is the product of the groups' sizes.
    pub fn of_groups(own: &[f64], other: &[f64]) -> Self {
        let (n, m) = (own.len() as f64, other.len() as f64);
        let cut = n * m / 2.0 - Z * (n * m * (n + m + 1.0) / 12.0).sqrt();
        let ratios = own.iter().flat_map(|a| other.iter().map(move |b| a / b)).collect();
        Self::of_sorted(ratios, cut.max(0.0) as usize)
    }

    /// The interval leaves out `cut - 1` ratios at either end.
    fn of_sorted(mut ratios: Vec<f64>, cut: usize) -> Self {
        ratios.sort_by(f64::total_cmp);
        let n = ratios.len();
        let median = Mean::of(ratios.iter().copied()).quantiles[1];
        let interval95 = match cut {
            0 => [0.0, f64::INFINITY],
            cut => [ratios[cut - 1], ratios[n - cut]],
        };
        Self { median, interval95 }
    }
}

/// The statistic of a table's row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Statistic {
    /// Rate of successes.
    Rate(Rate),
    /// Mean of numbers.
    Mean(Mean),
}

impl Statistic {
    /// Returns the rate or the mean.
    pub fn value(&self) -> f64 {
        match self {
            Self::Rate(rate) => rate.share(),
            Self::Mean(mean) => mean.mean,
        }
    }

    /// Returns the 95% interval.
    pub fn interval95(&self) -> [f64; 2] {
        match self {
            Self::Rate(rate) => rate.interval95(),
            Self::Mean(mean) => mean.interval95(),
        }
    }

    fn mean(&self) -> Option<&Mean> {
        if let Self::Mean(mean) = self { Some(mean) } else { None }
    }

    /// Returns the standard deviation of a mean's numbers; `None` for a rate.
    pub fn sd(&self) -> Option<f64> {
        self.mean().map(|mean| mean.sd)
    }

    /// Returns the 5%, 50% and 95% quantiles of a mean's numbers; `None` for a rate.
    pub fn quantiles(&self) -> Option<[f64; 3]> {
        self.mean().map(|mean| mean.quantiles)
    }

    /// Returns the effective number of independent trials of a rate; `None` for a mean.
    pub fn effective_trials(&self) -> Option<f64> {
        match self {
            Self::Rate(rate) => Some(rate.effective),
            Self::Mean(_) => None,
        }
    }

    /// Returns the number of trials.
    pub fn trials(&self) -> u64 {
        match self {
            Self::Rate(rate) => rate.trials,
            Self::Mean(mean) => mean.n,
        }
    }

    /// Returns whether the statistic comes from fewer than [`FEW_TRIALS`] independent trials or clusters.
    pub fn is_of_few_trials(&self) -> bool {
        let independent = match self {
            Self::Rate(rate) => rate.clusters,
            Self::Mean(mean) => mean.clusters,
        };
        independent < FEW_TRIALS
    }

    /// Returns the keys of `--json`. Numbers that are not finite are null.
    pub fn to_json(&self) -> Map<String, Value> {
        let interval = self.interval95();
        let object = match self {
            Self::Rate(rate) => json!({
                "successes": rate.successes, "trials": rate.trials, "rate": rate.share(),
                "effective_trials": rate.effective, "interval95": interval,
                "few_trials": self.is_of_few_trials(),
            }),
            Self::Mean(mean) => json!({
                "mean": mean.mean, "sd": mean.sd, "n": mean.n, "interval95": interval,
                "few_trials": self.is_of_few_trials(),
                "quantiles": {"5": mean.quantiles[0], "50": mean.quantiles[1], "95": mean.quantiles[2]},
            }),
        };
        match object {
            Value::Object(map) => map,
            _ => Map::new(),
        }
    }
}
