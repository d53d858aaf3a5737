//! Rates, means and their intervals, against published tables and drawn samples.

use rand::RngExt;
use statrs::distribution::{ContinuousCDF, Normal};
use symbolt::sim::Seed;
use symbolt::study::retrieval::{Method, Roles, WorldSpec, predicted};
use symbolt::study::statistics::{Mean, Rate, Ratio, Statistic};

#[test]
fn wilsons_interval_agrees_with_published_tables() {
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
fn intervals_of_ratios_are_those_of_rank_tests() {
    // Of n pairs the sign test leaves out k - 1 at either end: n = 6, 9, 12, 20 have k = 1, 2, 3, 6 (Conover 1999, A3).
    for (n, k) in [(6, 1), (9, 2), (12, 3), (20, 6)] {
        let pairs: Vec<[f64; 2]> = (1..=n).map(|at| [f64::from(at), 1.0]).collect();
        let ratio = Ratio::of_pairs(&pairs);
        assert_eq!(ratio.interval95, [f64::from(k), f64::from(n + 1 - k)], "{n} pairs");
        assert_eq!(ratio.median, f64::from(n + 1) / 2.0);
    }
    assert_eq!(Ratio::of_pairs(&[[1.0, 1.0]; 5]).interval95, [0.0, f64::INFINITY]);
    assert!(Ratio::of_pairs(&[]).median.is_nan() && Ratio::of_groups(&[], &[]).median.is_nan());
    // Of two groups, the rank-sum test: of 5 and 5 it leaves out two of the 25 ratios at either end (Conover 1999, A7).
    let own: Vec<f64> = (1..=5).map(f64::from).collect();
    let ratio = Ratio::of_groups(&own, &[1.0, 1.1, 1.2, 1.3, 1.4]);
    let mut all: Vec<f64> =
        own.iter().flat_map(|a| [1.0, 1.1, 1.2, 1.3, 1.4].map(|b| a / b)).collect();
    all.sort_by(f64::total_cmp);
    assert_eq!((ratio.interval95, ratio.median), ([all[2], all[22]], all[12]));
    assert_eq!(Ratio::of_groups(&own[..3], &own[..3]).interval95, [0.0, f64::INFINITY]);
    // Intervals hold the truth in at least 95% of cases: here 3 times as long, whatever the tails.
    let (mut rng, mut held) = (Seed::new(1).rng(), [0; 2]);
    let mut draw = |scale: f64| scale / (1.0 - rng.random::<f64>()).powi(2);
    for _ in 0..2_000 {
        let pairs: Vec<[f64; 2]> = (0..9).map(|_| [draw(3.0), draw(1.0)]).collect();
        let [own, other] = [0, 1].map(|side| pairs.iter().map(|p| p[side]).collect::<Vec<_>>());
        for (held, ratio) in
            held.iter_mut().zip([Ratio::of_pairs(&pairs), Ratio::of_groups(&own, &other)])
        {
            let [low, high] = ratio.interval95;
            *held += usize::from(low <= 3.0 && 3.0 <= high);
        }
    }
    assert!(held.iter().all(|held| (1_870..2_000).contains(held)), "{held:?}");
}

#[test]
fn correlated_trials_of_a_cluster_count_as_fewer() {
    // Four clusters of five, each with equal answers: p(1-p) = 1/4 and variance = (4 x 2.5^2) x 4/3 / 20^2 = 1/12,
    // as of 3 trials; (10 + 1) / (10/3 + 1/4) = 3.0698; Student's 3.1824 instead of 1.96 leaves 0.379 of that.
    let rate = Rate::of_clusters([[5, 5], [0, 5], [5, 5], [0, 5]].into_iter());
    assert_eq!((rate.successes, rate.trials), (10, 20));
    assert!((rate.effective - 3.0698 * 0.3793).abs() < 1e-3, "{}", rate.effective);
    // Clusters of one trial are plain trials, apart from Student's factor.
    let rate = Rate::of_clusters((0..400).map(|i| [u64::from(i % 4 == 0), 1]));
    assert!(rate.effective > 390.0 && rate.effective <= 400.0, "{}", rate.effective);
    // If all agree, each cluster counts as one trial, apart from Student's factor. One cluster counts as one trial.
    let effective = |clusters: &[[u64; 2]]| Rate::of_clusters(clusters.iter().copied()).effective;
    assert!((effective(&[[5, 5], [5, 5], [5, 5]]) - 3.0 * (1.96f64 / 4.3027).powi(2)).abs() < 1e-3);
    assert_eq!((effective(&[[2, 5]]), effective(&[[0, 0]]), effective(&[])), (1.0, 0.0, 0.0));
    // More failures show the correlation better, so the effective number grows.
    let failing = |of: [u64; 3]| Rate::of_clusters(of.map(|f| [250 - f, 250]).into_iter());
    let ends = [[0, 0, 0], [0, 1, 0], [1, 1, 1], [4, 5, 4]].map(|f| failing(f).effective);
    assert!(ends.is_sorted() && ends[0] > 0.6 && ends[3] < 750.0, "{ends:?}");
}

#[test]
fn intervals_of_clusters_hold_the_truth_as_often_as_they_say() {
    // Clusters differ: the rate of each is drawn from two values. With 2,000 intervals, three standard errors
    // of a coverage of 95% are 1.5 points; too high a coverage is no fault. Counting all trials as independent
    // must give too low a coverage.
    let cases: [(usize, &[u64], [f64; 2]); 4] = [
        (10, &[4], [0.2, 0.9]),
        (10, &[4], [0.7, 1.0]),
        (20, &[96], [0.98, 1.0]),
        (12, &[1, 12, 5], [0.3, 0.9]),
    ];
    for (count, sizes, own) in cases {
        let truth = (own[0] + own[1]) / 2.0;
        let mut held = [0.0, 0.0];
        for index in 0..2_000 {
            let mut rng = Seed::new(1).derive_index("intervals", index).rng();
            let clusters: Vec<[u64; 2]> = (0..count)
                .map(|cluster| {
                    let (size, own) =
                        (sizes[cluster % sizes.len()], own[usize::from(rng.random::<bool>())]);
                    [(0..size).map(|_| u64::from(rng.random_bool(own))).sum(), size]
                })
                .collect();
            let rate = Rate::of_clusters(clusters.into_iter());
            let all = Rate::new(rate.successes, rate.trials);
            for (held, rate) in held.iter_mut().zip([rate, all]) {
                let [low, high] = rate.interval95();
                *held += f64::from(u8::from(low <= truth && truth <= high)) / 2e3;
            }
        }
        assert!(held[0] >= 0.935 && held[1] < 0.92, "{count} of {sizes:?}, {own:?}: {held:?}");
    }
}

#[test]
fn a_rate_lies_in_its_interval_and_without_trials_the_interval_is_0_to_1() {
    for trials in 1..400 {
        for successes in [0, 1, trials / 2, trials] {
            let rate = Rate::new(successes.min(trials), trials);
            let [low, high] = rate.interval95();
            assert!(0.0 <= low && low <= rate.share() && rate.share() <= high && high <= 1.0);
        }
    }
    // A caller's mistake must not panic.
    let odd = [Rate::new(7, 3), Rate::of_clusters([[9, 4], [1, 4]].into_iter())];
    assert!(odd.iter().all(|rate| rate.successes <= rate.trials && rate.interval95()[1] <= 1.0));
    let unknown = Rate { effective: 0.0, ..Rate::new(3, 4) };
    assert_eq!(unknown.interval95(), [0.0, 1.0]);
}

#[test]
fn nine_independent_trials_are_few_and_ten_are_not() {
    let rate = |trials| Statistic::Rate(Rate::new(1, trials));
    assert!(rate(9).is_of_few_trials() && !rate(10).is_of_few_trials());
    assert_eq!(rate(2).to_json()["few_trials"], true);
    let mean = |n: u64| Statistic::Mean(Mean::of((0..n).map(|i| i as f64)));
    assert!(mean(9).is_of_few_trials() && !mean(10).is_of_few_trials());
    assert_eq!(mean(10).to_json()["few_trials"], false);
    // Many trials in few clusters count as few. Trials without a number do not count.
    let clustered = Rate::of_clusters([[90, 96]; 3].into_iter());
    assert!(Statistic::Rate(clustered).is_of_few_trials());
    let pooled = Mean::of_clusters((0..100).map(|i| (f64::from(i % 4), f64::from(i))));
    assert!(Statistic::Mean(pooled).is_of_few_trials());
    let missing = Mean::of((0..40).map(|i| if i < 2 { 1.0 } else { f64::NAN }));
    assert!(Statistic::Mean(missing).is_of_few_trials());
}

#[test]
fn nan_is_left_out_of_a_mean() {
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

#[test]
fn variances_are_those_of_the_formulas() {
    let spec = WorldSpec::default();
    let of = |dimensions, roles| predicted(&spec, dimensions, Method::Sum(roles)).variance;
    for dim in [256, 500, 1000] {
        let d = dim as f64;
        assert!((of(dim, Roles::Gaussian) - 33.0 / d).abs() < 1e-9);
        assert!((of(dim, Roles::Unitary) - 21.0 / d).abs() < 1e-9);
        assert!((of(dim, Roles::Frame) - 21.0 / d * (1.0 - d / 1250.0)).abs() < 1e-9);
    }
}

#[test]
fn noise_meets_both_atoms_of_a_match() {
    // Hardly any further atoms, and no crosstalk.
    let spec = WorldSpec { each: 1e-9, ..WorldSpec::default() };
    let method = Method::Joint { roles: Roles::Unitary, level: 0.5, noise: 0.25 };
    let found = predicted(&spec, 1 << 40, method).recall;
    let met = |atoms: f64| Normal::standard().sf(-0.5 / (0.25 * atoms.sqrt())).powi(2);
    assert!((found - met(2.0)).abs() < 1e-6, "{found}");
    assert!((met(1.0) - met(2.0)).abs() > 0.1);
}

#[test]
fn means_of_clusters_and_of_differences_are_as_wide_as_they_should_be() {
    // Two clusters of two equal numbers count as two numbers.
    let two = Mean::of([1.0, 3.0].into_iter());
    let four = Mean::of_clusters([(7.0, 1.0), (9.0, 3.0), (7.0, 1.0), (9.0, 3.0)].into_iter());
    assert!((two.half95 - four.half95).abs() < 1e-9 && four.n == 4, "{two:?} {four:?}");
    assert!(Mean::of_clusters([(1.0, 2.0), (1.0, 4.0)].into_iter()).half95.is_infinite());
    // Even without a difference in 1,000 pairs, one in 1,000 of either sign remains possible.
    let none = Mean::of_differences([0.0; 1000].into_iter());
    assert!(none.mean == 0.0 && none.half95 > 1e-3 && none.half95 < 4e-3, "{none:?}");
    // Bonett and Price: 12 against 3 discordant pairs of 100 give (9/102) -+ 1.96 sqrt((17 - 81/102) / 102^2).
    let pairs = (0..100).map(|i| {
        if i < 12 {
            1.0
        } else if i < 15 {
            -1.0
        } else {
            0.0
        }
    });
    let [low, high] = Mean::of_differences(pairs).interval95();
    let half = 1.96 * ((17.0f64 - 81.0 / 102.0) / 102.0f64.powi(2)).sqrt();
    assert!(low <= 9.0 / 102.0 - half + 1e-4 && high >= 9.0 / 102.0 + half - 1e-4);
    assert!(high - low < 2.0 * half + 0.005, "{low} {high}");
}
