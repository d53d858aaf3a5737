//! Synapses and processes.

use symbolt::prelude::*;
use symbolt::sim::{Filter, Interpolation, NoiseDistribution, Real, WhiteNoise, WhiteSignal};

use super::{ms, rms, run, samples};

/// A rough input of 600 ticks.
fn rough() -> Vec<f64> {
    (0..600u64).map(|k| ((7919 * k * k + 13 * k) % 1009) as f64 / 512.0 - 0.98).collect()
}

fn filtered(synapse: Synapse, input: &[f64]) -> Vec<f64> {
    let filter = Filter::new(synapse, Timebase::default()).expect("sound");
    let mut state = vec![0.0; filter.state_len(1)];
    input.iter().map(|u| f64::from(filter.step(&[*u as Real], &mut state)[0])).collect()
}

fn convolved(taps: &[f64], input: &[f64]) -> Vec<f64> {
    let at = |k: usize| (0..=k.min(taps.len() - 1)).map(|j| taps[j] * input[k - j]).sum();
    (0..input.len()).map(at).collect()
}

fn most(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()))
}

#[test]
fn alpha_and_triangle_are_convolutions() {
    let input = rough();
    for tau in [5, 30] {
        // The taps are the differences of the step response, 1 - (1 + t / tau) exp(-t / tau).
        let step = |k: usize| {
            let t = k as f64 / tau as f64;
            1.0 - (1.0 + t) * (-t).exp()
        };
        let taps: Vec<f64> = (0..600).map(|k| step(k + 1) - step(k)).collect();
        let wanted = convolved(&taps, &input);
        let found = filtered(Synapse::alpha_ms(tau), &input);
        assert!(most(&found, &wanted) < 1e-6 && most(&wanted, &[0.0; 600]) > 0.05);
        let low: Vec<f64> = (0..600).map(|k| (-(k as f64) / tau as f64).exp()).collect();
        let first = 1.0 - (-1.0 / tau as f64).exp();
        let low: Vec<f64> = low.iter().map(|h| first * h).collect();
        assert!(most(&filtered(Synapse::lowpass_ms(tau), &input), &convolved(&low, &input)) < 1e-5);
        assert!(most(&found, &convolved(&low, &input)) > 0.05, "another synapse differs");
        let n = tau as usize + 1;
        let ramp: Vec<f64> = (0..n).map(|j| 2.0 * (n - j) as f64 / (n * (n + 1)) as f64).collect();
        assert!((ramp.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(
            most(&filtered(Synapse::triangle_ms(tau), &input), &convolved(&ramp, &input)) < 1e-6
        );
    }
}

#[test]
fn two_low_passes_combine_into_a_linear_filter() {
    let input = rough();
    let (a, b) = (0.01, 0.02);
    let one = filtered(Synapse::linear(&[1.0], &[a * b, a + b, 1.0]), &input);
    let pair = Synapse::DoubleExponential { rise: ms(10), decay: ms(20) };
    assert!(most(&one, &filtered(pair, &input)) < 1e-6 && most(&one, &[0.0; 600]) > 0.05);
    // Equal constants are an alpha.
    let equal = filtered(Synapse::linear(&[1.0], &[a * a, 2.0 * a, 1.0]), &input);
    assert!(most(&equal, &filtered(Synapse::alpha_ms(10), &input)) < 1e-6);
    assert!(most(&one, &equal) > 1e-3);
    // A gain alone filters nothing; a filter that is not proper is refused.
    assert_eq!(filtered(Synapse::linear(&[2.0], &[1.0]), &[0.25, 1.0]), [0.5, 2.0]);
    assert!(Filter::new(Synapse::linear(&[1.0, 0.0], &[1.0]), Timebase::default()).is_err());
}

/// The power of a signal at `cycles` in its length, by a plain sum.
fn power(values: &[Real], cycles: usize) -> f64 {
    let n = values.len();
    let angle = |k: usize| std::f64::consts::TAU * ((cycles * k) % n) as f64 / n as f64;
    let (mut re, mut im) = (0.0, 0.0);
    for (k, v) in values.iter().enumerate() {
        re += f64::from(*v) * angle(k).cos();
        im += f64::from(*v) * angle(k).sin();
    }
    (re * re + im * im) / (n * n) as f64
}

/// Samples of all components over a run, in turn.
fn recorded<M: Module<Ports = symbolt::sim::Out<Vector>>>(
    module: M,
    micros: u64,
    seeds: (u64, u64),
    millis: u64,
) -> Vec<Vec<Real>> {
    let mut graph = GraphBuilder::new();
    let out = graph.add("process", module);
    let probe = graph.probe(&out, ProbeSpec::default());
    let time = Timebase::new(SimDuration::from_micros(micros)).expect("a tick");
    let graph = graph.build(time, &PopulationPlan::direct(), Seed::new(seeds.0)).expect("builds");
    let config = RunConfig::seeded(Seed::new(seeds.1));
    let mut sim = Simulator::new(graph.into(), config).expect("starts");
    sim.run_for(ms(millis)).expect("runs");
    samples(&sim, &probe)
}

#[test]
fn white_noise_has_a_flat_spectrum_that_grows_as_the_tick_shrinks() {
    let normal = |sd| NoiseDistribution::Gaussian { mean: 0.0, sd };
    for (micros, sd) in [(1000, 1.5), (250, 0.5)] {
        let noise = || WhiteNoise::vector(200).distribution(normal(sd));
        let all = recorded(noise(), micros, (1, 2), 100 * micros / 1000);
        assert_eq!((all.len(), all[0].len()), (100, 200));
        // Divided by the root of the tick, or not.
        let wanted = sd * (1e6 / micros as Real).sqrt();
        let found = rms(all.iter().flatten().copied());
        assert!((found / wanted - 1.0).abs() < 0.03, "{found} {wanted}");
        let plain = recorded(noise().unscaled(), micros, (1, 2), 100 * micros / 1000);
        let found = rms(plain.iter().flatten().copied());
        assert!((found / sd - 1.0).abs() < 0.03, "{found} {sd}");
        let band = |from: usize, to: usize| {
            let of = |at: usize| -> f64 {
                let one: Vec<Real> = all.iter().map(|v| v[at]).collect();
                (from..to).map(|cycles| power(&one, cycles)).sum()
            };
            (0..200).map(of).sum::<f64>()
        };
        // 200 components of 16 frequencies each: a relative standard error of 2%.
        let [low, middle, high] = [band(1, 17), band(17, 33), band(33, 49)];
        assert!((low / middle - 1.0).abs() < 0.12 && (high / middle - 1.0).abs() < 0.12);
    }
}

#[test]
fn a_white_signal_has_its_power_its_start_and_no_seam() {
    for wanted in [0.3, 1.0] {
        let all = recorded(WhiteSignal::vector(100, ms(500), 400.0).rms(wanted), 1000, (1, 1), 500);
        let found = rms(all.iter().flatten().copied());
        assert!((found / wanted - 1.0).abs() < 0.02, "{found}");
    }
    // It begins at the sample nearest to what is asked for.
    for start in [-0.4, 0.0, 0.9] {
        let signal = WhiteSignal::vector(20, ms(100), 500.0).starting_near(start);
        let all = recorded(signal, 1000, (3, 1), 100);
        for at in 0..20 {
            let nearest = all.iter().map(|v| (v[at] - start).abs()).fold(Real::MAX, Real::min);
            assert!((all[0][at] - start).abs() <= nearest + 1e-6, "{start}");
        }
    }
    // Neither it nor its slope jumps, within a period or between two: bounds of the fastest sine, doubled.
    let all = recorded(WhiteSignal::vector(5, ms(500), 10.0), 1000, (4, 1), 2000);
    let (size, turn) = (0.5 * 2f64.sqrt(), std::f64::consts::TAU * 10.0 * 1e-3);
    for at in 0..5 {
        let one: Vec<f64> = all.iter().map(|v| f64::from(v[at])).collect();
        let slopes: Vec<f64> = one.windows(2).map(|w| w[1] - w[0]).collect();
        let bends = slopes.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        assert!(slopes.iter().all(|slope| slope.abs() < 2.0 * size * turn));
        assert!(bends < 4.0 * size * turn * turn, "{bends}");
        assert!(one[..500] == one[500..1000] && one.iter().any(|v| v.abs() > 0.1));
    }
    // Frequencies above half of the sampling, or below one in a period, cannot be.
    for (period, high) in [(1000, 501.0), (100, 9.0), (100, -1.0), (100, f64::NAN)] {
        let mut graph = GraphBuilder::new();
        graph.add("process", WhiteSignal::vector(1, ms(period), high));
        let built = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1));
        assert!(built.expect_err("refused").to_string().contains("`process`"));
    }
}

#[test]
fn processes_repeat_after_a_reset_and_differ_by_seed() {
    let normal = NoiseDistribution::Gaussian { mean: 0.0, sd: 1.0 };
    let mut graph = GraphBuilder::new();
    let noise = graph.add("noise", WhiteNoise::vector(2).distribution(normal).unscaled());
    let brown = graph.add("brown", WhiteNoise::vector(2).integrated());
    let signal = graph.add("signal", WhiteSignal::vector(2, ms(100), 100.0));
    let probes = [noise, brown, signal].map(|out| graph.probe(&out, ProbeSpec::default()));
    let mut sim = run(&graph, &PopulationPlan::direct(), 100);
    let first = probes.map(|probe| samples(&sim, &probe));
    sim.reset().expect("reset");
    sim.run_for(ms(100)).expect("runs");
    assert_eq!(probes.map(|probe| samples(&sim, &probe)), first);
    assert!(first.iter().all(|all| all.len() == 100 && all[0] != all[1]));
    // A seed of its own, or those of build and run.
    let of = |seed: Option<u64>, seeds| {
        let signal = WhiteSignal::vector(1, ms(100), 100.0);
        let signal = match seed {
            Some(seed) => signal.seeded(Seed::new(seed)),
            None => signal,
        };
        recorded(signal, 1000, seeds, 100)
    };
    assert_eq!(of(Some(5), (1, 1)), of(Some(5), (2, 2)));
    assert_ne!(of(Some(5), (1, 1)), of(Some(6), (1, 1)));
    assert_ne!(of(None, (1, 1)), of(None, (2, 1)));
    assert_eq!(of(None, (1, 1)), of(None, (1, 2)));
    let of = |seeds| recorded(WhiteNoise::vector(1), 1000, seeds, 100);
    assert_eq!(of((1, 7)), of((1, 7)));
    assert_ne!(of((1, 7)), of((1, 8)));
}

#[test]
fn inputs_are_presented_in_turn_and_piecewise() {
    let rows = [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]];
    let all = recorded(Stimulus::vectors(&rows, ms(100)), 1000, (1, 1), 1000);
    for (tick, value) in all.iter().enumerate() {
        assert_eq!(value[..], rows[tick / 100 % 3], "{tick}");
    }
    let points = || {
        let from = Stimulus::vector(&[0.0]).from(ms(500), &[1.0]).from(ms(750), &[-1.0]);
        from.from(ms(1000), &[0.0])
    };
    let held = recorded(points(), 1000, (1, 1), 1100);
    for (at, wanted) in [(200, 0.0), (499, 0.0), (580, 1.0), (760, -1.0), (1050, 0.0)] {
        assert_eq!(held[at], [wanted], "{at}");
    }
    let lines = recorded(points().interpolate(Interpolation::Linear), 1000, (1, 1), 1100);
    for (at, wanted) in [(250, 0.5), (500, 1.0), (625, 0.0), (875, -0.5), (1050, 0.0)] {
        assert!((lines[at][0] - wanted).abs() < 1e-5, "{at}");
    }
    let nearest = recorded(points().interpolate(Interpolation::Nearest), 1000, (1, 1), 1100);
    for (at, wanted) in [(240, 0.0), (260, 1.0), (620, 1.0), (630, -1.0), (880, 0.0)] {
        assert_eq!(nearest[at], [wanted], "{at}");
    }
    // A cubic passes through its points and is smooth in between.
    let cubic = recorded(points().interpolate(Interpolation::Cubic), 1000, (1, 1), 1000);
    for (at, wanted) in [(0, 0.0), (500, 1.0), (750, -1.0)] {
        assert!((cubic[at][0] - wanted).abs() < 1e-4, "{at}");
    }
    let bend = |k: usize| (cubic[k + 1][0] - 2.0 * cubic[k][0] + cubic[k - 1][0]).abs();
    assert!((1..999).all(|k| bend(k) < 1e-3));
}
