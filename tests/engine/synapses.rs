//! Synapses: outputs as Nengo computes them, closed forms, delays, state, bits and faults.

use std::path::Path;
use std::sync::Arc;

use ndarray::{Ix1, Ix2};
use symbolt::files::npz::NpzReader;
use symbolt::prelude::*;
use symbolt::sim::{Filter, Fingerprint, ProbeId, Signal, SimError, SynapseError, Threads};

const TICKS: u64 = 3000;

fn ms(millis: u64) -> SimDuration {
    SimDuration::from_millis(millis)
}

/// The synapses of the fixture, and the greatest error over the size of the output.
fn synapses() -> Vec<(&'static str, Synapse, f64)> {
    let pair = |rise, decay| Synapse::DoubleExponential { rise: ms(rise), decay: ms(decay) };
    let sixth: Vec<f64> = [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0]
        .iter()
        .enumerate()
        .map(|(k, c)| c * 10f64.powi(k as i32) / 1e6)
        .collect();
    vec![
        ("lowpass_5ms", Synapse::lowpass_ms(5), 1e-6),
        ("lowpass_30ms", Synapse::lowpass_ms(30), 1e-6),
        // Its state is in single precision.
        ("lowpass_1s", Synapse::lowpass_ms(1000), 3e-5),
        ("lowpass_1s", Synapse::linear(&[1.0], &[1.0, 1.0]), 1e-6),
        ("alpha_5ms", Synapse::alpha_ms(5), 1e-6),
        ("alpha_30ms", Synapse::alpha_ms(30), 1e-6),
        ("alpha_1s", Synapse::alpha_ms(1000), 1e-6),
        ("rise_2ms_decay_20ms", pair(2, 20), 1e-6),
        ("rise_10ms_decay_1s", pair(10, 1000), 1e-6),
        ("triangle_5ms", Synapse::triangle_ms(5), 1e-6),
        ("triangle_30ms", Synapse::triangle_ms(30), 1e-6),
        ("triangle_1s", Synapse::triangle_ms(1000), 1e-6),
        ("lead_10ms_20ms", Synapse::linear(&[0.01, 1.0], &[0.02, 1.0]), 1e-6),
        ("integrator", Synapse::linear(&[1.0], &[1.0, 0.0]), 1e-6),
        ("gain", Synapse::linear(&[2.0], &[3.0]), 1e-6),
        ("damped_5hz", Synapse::linear(&[2.0, 1000.0], &[1.0, 10.0, 1000.0]), 1e-6),
        (
            "biproper_third",
            Synapse::linear(&[1e-6, 2e-4, 0.03, 1.0], &[8e-6, 1.2e-3, 0.06, 1.0]),
            1e-6,
        ),
        ("sixth_100ms", Synapse::linear(&[1.0], &sixth), 1e-6),
        ("delay_3ms", Synapse::delay_ms(3), 1e-6),
    ]
}

/// A step, an impulse and a rough input in tick `k`.
fn told(k: u64) -> [f32; 3] {
    let rough = ((7919 * k * k + 13 * k) % 1009) as f32;
    [1.0, if k == 0 { 1.0 } else { 0.0 }, (rough - 504.0) / 512.0]
}

fn source() -> Signal<Vector> {
    Signal::vector(3, |t, out| out.copy_from_slice(&told((t * 1000.0).round() as u64)))
}

/// One source with all synapses behind it, each on a connection and in a probe.
#[expect(clippy::type_complexity, reason = "a pair of probes for each synapse")]
fn all() -> (GraphBuilder, Vec<(ProbeId<Vector>, ProbeId<Vector>)>) {
    let mut graph = GraphBuilder::new();
    let from = graph.add("source", source());
    let probes = synapses().into_iter().enumerate().map(|(index, (_, synapse, _))| {
        let to = graph.add(&format!("relay-{index}"), Add::vector(3));
        graph.route((&from >> &to).via(synapse));
        let behind = graph.probe(&to.output, ProbeSpec::default());
        (behind, graph.probe(&from, ProbeSpec::default().filtered(synapse)))
    });
    let probes = probes.collect();
    (graph, probes)
}

fn values(sim: &Simulator, probe: &ProbeId<Vector>) -> Vec<Vec<f32>> {
    sim.samples(probe).iter().map(|(_, value)| value.to_vec()).collect()
}

#[test]
fn every_synapse_gives_what_nengo_computes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/conformance");
    let bytes = std::fs::read(folder.join("synapses.npz")).unwrap();
    let mut npz = NpzReader::new(&bytes).unwrap();
    let ticks: Vec<usize> =
        npz.read::<f64, Ix1>("ticks").unwrap().iter().map(|k| *k as usize).collect();
    assert_eq!((ticks.len(), ticks[89]), (90, 2999));

    let (graph, probes) = all();
    let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1)).unwrap();
    sim.run_for(ms(TICKS)).unwrap();
    let (mut moved, mut report) = (0, String::new());
    for ((name, synapse, bound), (behind, probed)) in synapses().into_iter().zip(&probes) {
        let expected = npz.read::<f64, Ix2>(name).unwrap();
        let (behind, probed) = (values(&sim, behind), values(&sim, probed));
        assert_eq!((behind.len(), probed.len()), (3000, 3000));
        let size = expected.iter().fold(1.0f64, |most, v| most.max(v.abs()));
        let mut worst = 0.0f64;
        for (row, tick) in ticks.iter().enumerate() {
            for at in 0..3 {
                let error = (f64::from(behind[*tick][at]) - expected[(row, at)]).abs() / size;
                worst = worst.max(error);
                moved += usize::from(behind[*tick][at] != 0.0);
            }
        }
        report += &format!("{name} {synapse}: {worst:.1e}\n");
        assert!(worst < bound, "{name}: {worst:e}");
        // A probe shows the output of a filter in its own tick, and a connection in the next; a delay is as long in both.
        match synapse {
            Synapse::Delay { .. } => assert_eq!(behind, probed, "{name}"),
            _ => assert_eq!(behind[1..], probed[..2999], "{name}"),
        }
        // A node that filters for itself has the same bits as a probe.
        let filter = Filter::new(synapse, Timebase::default()).unwrap();
        let mut state = vec![0.0; filter.state_len(3)];
        let own: Vec<Vec<f32>> =
            (0..TICKS).map(|k| filter.step(&told(k), &mut state).to_vec()).collect();
        assert_eq!(own, probed, "{name}");
    }
    assert!(moved > 3000, "{moved} outputs other than zero");
    eprintln!("{report}");
    // Nengo's probes have the tick that connections have.
    let late = npz.read::<f64, Ix2>("probed_alpha_5ms").unwrap();
    let alpha = values(&sim, &probes[4].1);
    assert!((f64::from(alpha[38][0]) - late[(39, 0)]).abs() < 1e-6);
    assert!((f64::from(alpha[5][0]) - late[(5, 0)]).abs() > 1e-2);
}

#[test]
fn a_triangle_of_half_ticks_has_the_taps_of_the_even_number() {
    for (length_us, tick_us, taps) in
        [(3_500, 1_000, 5), (2_500, 1_000, 3), (2_501, 1_000, 4), (350, 100, 5)]
    {
        let [length, tick] = [length_us, tick_us].map(SimDuration::from_micros);
        let filter =
            Filter::new(Synapse::Triangle { length }, Timebase::new(tick).unwrap()).unwrap();
        let mut state = vec![0.0; filter.state_len(1)];
        let answers: Vec<f32> = (0..20)
            .map(|k| filter.step(&[if k == 0 { 1.0 } else { 0.0 }], &mut state)[0])
            .collect();
        assert_eq!(
            answers.iter().filter(|y| **y > 0.0).count(),
            taps,
            "{length_us} us: {answers:?}"
        );
        assert!((answers.iter().sum::<f32>() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn two_low_passes_in_series_would_be_caught() {
    let lowpass = Filter::new(Synapse::lowpass_ms(5), Timebase::default()).unwrap();
    let alpha = Filter::new(Synapse::alpha_ms(5), Timebase::default()).unwrap();
    let [mut one, mut two] = [[0.0], [0.0]];
    let mut state = vec![0.0; alpha.state_len(1)];
    let mut worst = 0.0f32;
    for _ in 0..40 {
        let first = lowpass.step(&[1.0], &mut one)[0];
        let series = lowpass.step(&[first], &mut two)[0];
        worst = worst.max((alpha.step(&[1.0], &mut state)[0] - series).abs());
    }
    assert!((worst - 0.034).abs() < 1e-3, "{worst}");
}

/// `1 / (tau s + 1)^order`, and its answer to a step after `time`.
fn cascade(order: usize, tau: f64) -> (Synapse, impl Fn(f64) -> f64) {
    let mut below = vec![1.0];
    for _ in 0..order {
        let mut next = vec![0.0; below.len() + 1];
        for (k, c) in below.iter().enumerate() {
            next[k] += tau * c;
            next[k + 1] += c;
        }
        below = next;
    }
    let step = move |time: f64| {
        let x = time / tau;
        let terms = (1..order).scan(1.0, |term, j| {
            *term *= x / j as f64;
            Some(*term)
        });
        1.0 - (-x).exp() * (1.0 + terms.sum::<f64>())
    };
    (Synapse::linear(&[1.0], &below), step)
}

#[test]
fn chains_of_any_order_and_speed_are_exact() {
    for order in 1..=8 {
        for (tau, tick_us) in
            [(0.000_05, 1000), (0.005, 1000), (0.1, 1000), (1.0, 500), (10.0, 100)]
        {
            let (synapse, step) = cascade(order, tau);
            let time = Timebase::new(SimDuration::from_micros(tick_us)).unwrap();
            let filter = Filter::new(synapse, time).unwrap();
            let mut state = vec![0.0; filter.state_len(1)];
            for k in 1..=20_000u32 {
                let y = filter.step(&[2.0], &mut state)[0];
                let error = f64::from(y) / 2.0 - step(f64::from(k) * time.dt_s());
                assert!(error.abs() < 2e-7, "order {order}, {tau} s, tick {k}: {error:e}");
            }
        }
    }
}

#[test]
fn two_time_constants_may_be_far_apart_or_nearly_equal() {
    for [rise_us, decay_us] in
        [[1, 10_000_000], [1000, 1_000_000], [5000, 5001], [20_000, 1000], [7, 90]]
    {
        let [rise, decay] = [rise_us, decay_us].map(SimDuration::from_micros);
        let synapse = Synapse::DoubleExponential { rise, decay };
        let filter = Filter::new(synapse, Timebase::default()).unwrap();
        let mut state = vec![0.0; filter.state_len(1)];
        let [r, d] = [rise.min(decay), rise.max(decay)].map(SimDuration::as_secs_f64);
        for k in 1..=30_000u32 {
            let y = filter.step(&[1.0], &mut state)[0];
            let t = f64::from(k) * 1e-3;
            // The difference quotient of t exp(-t / tau), without cancellation where the two are nearly equal.
            let share = r / (d - r) * (-t / d).exp() * -(t / d - t / r).exp_m1();
            let exact = 1.0 - (-t / d).exp() - share;
            assert!((f64::from(y) - exact).abs() < 2e-7, "{synapse}, tick {k}: {y} {exact}");
        }
    }
}

#[test]
fn filters_without_input_reach_zero_and_are_never_subnormal() {
    let mut checked = 0;
    for (name, synapse, _) in synapses() {
        if matches!(name, "integrator") {
            continue;
        }
        let filter = Filter::new(synapse, Timebase::default()).unwrap();
        let mut state = vec![0.0; filter.state_len(2)];
        filter.step(&[1.0, 1e-40], &mut state);
        for _ in 0..110_000 {
            filter.step(&[0.0, 0.0], &mut state);
            if checked % 64 == 0 {
                assert!(state.iter().all(|v| !v.is_subnormal()), "{name}");
            }
            checked += 1;
        }
        assert!(state[..2].iter().all(|v| *v == 0.0), "{name}: {:?}", &state[..2]);
    }
    assert!(checked > 1_000_000);
}

#[test]
fn checkpoints_resets_and_threads_keep_the_bits() {
    let (graph, probes) = all();
    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1)).unwrap();
    let graph = Arc::new(graph);
    let all_of = |sim: &Simulator| -> Vec<Vec<Vec<f32>>> {
        probes.iter().flat_map(|(a, b)| [values(sim, a), values(sim, b)]).collect()
    };
    let mut sim = Simulator::new(graph.clone(), RunConfig::default()).unwrap();
    sim.run_for(ms(70)).unwrap();
    let saved = sim.checkpoint().unwrap();
    sim.clear_recordings();
    sim.run_for(ms(90)).unwrap();
    let went_on = all_of(&sim);
    let text = serde_json::to_string(&saved).unwrap();
    let saved = serde_json::from_str(&text).unwrap();
    let threads = RunConfig::default().with_threads(Threads::Exactly(3));
    let mut other = Simulator::new(graph, threads).unwrap();
    other.run_for(ms(5)).unwrap();
    other.restore(&saved).unwrap();
    other.run_for(ms(90)).unwrap();
    assert_eq!(all_of(&other), went_on);
    assert_eq!(went_on[0].len(), 90);
    other.reset().unwrap();
    other.run_for(ms(70)).unwrap();
    sim.reset().unwrap();
    sim.run_for(ms(70)).unwrap();
    assert_eq!(all_of(&other), all_of(&sim));
}

/// Number of values that the connections of a graph hold.
fn held(synapses: &[Synapse]) -> usize {
    let mut graph = GraphBuilder::new();
    let from = graph.add("source", source());
    for (index, synapse) in synapses.iter().enumerate() {
        let to = graph.add(&format!("relay-{index}"), Add::vector(3));
        graph.route((&from >> &to).via(*synapse));
    }
    let sim = graph.start(&PopulationPlan::direct(), Seed::new(1)).unwrap();
    let json = serde_json::to_value(sim.checkpoint().unwrap()).unwrap();
    json["held"].as_array().unwrap().len()
}

#[test]
fn equal_synapses_share_a_filter_and_others_do_not() {
    let (alpha, low) = (Synapse::alpha_ms(5), Synapse::lowpass_ms(5));
    let linear = |last| Synapse::linear(&[1.0], &[0.005, last]);
    assert_eq!(held(&[low, low]), 3);
    assert_eq!(held(&[alpha, alpha, alpha]), 15);
    assert_eq!(held(&[alpha, low, Synapse::alpha_ms(6)]), 33);
    assert_eq!(held(&[linear(1.0), linear(1.0), linear(1.1)]), 18);
    // Coefficients of zero in front say nothing.
    assert_eq!(Synapse::linear(&[0.0, 1.0], &[0.0, 0.005, 1.0]), linear(1.0));
    assert_eq!(held(&[Synapse::delay_ms(1)]), 3);
    assert_eq!(held(&[Synapse::delay_ms(4)]), 13);
}

#[test]
fn a_delay_is_as_long_as_it_says_and_a_fingerprint_and_a_drawing_tell_it() {
    let graph = |synapse| {
        let mut graph = GraphBuilder::new();
        let from = graph.add("source", source());
        let to = graph.add("relay", Add::vector(3));
        graph.route((&from >> &to).via(synapse));
        let probe = graph.probe(&to.output, ProbeSpec::default());
        (graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1)).unwrap(), probe)
    };
    for delay in [1, 2, 7] {
        let (graph, probe) = graph(Synapse::delay_ms(delay));
        assert!(graph.to_dot().contains(&format!("delay {delay} ms\", style=dashed")));
        let mut sim = Simulator::new(Arc::new(graph), RunConfig::default()).unwrap();
        sim.run_for(ms(30)).unwrap();
        let late = values(&sim, &probe);
        for k in 0..30 {
            let expected = if k < delay { [0.0; 3] } else { told(k - delay) };
            assert_eq!(late[k as usize], expected, "{delay} ms, tick {k}");
        }
    }
    let saved = |synapse| {
        let graph = Arc::new(graph(synapse).0);
        Simulator::new(graph, RunConfig::default()).unwrap().checkpoint().unwrap()
    };
    let alpha = |tau| saved(Synapse::alpha_ms(tau));
    assert_ne!(alpha(5), alpha(6));
    let mut other =
        Simulator::new(Arc::new(graph(Synapse::alpha_ms(6)).0), RunConfig::default()).unwrap();
    assert_eq!(other.restore(&alpha(5)), Err(SimError::ForeignCheckpoint));
    let dot = graph(Synapse::linear(&[1.0], &[1.0, 2.0, 3.0])).0.to_dot();
    assert!(dot.contains("linear of order 2"), "{dot}");
    let of = |synapse: Synapse| {
        let mut hash = Fingerprint::default();
        synapse.fingerprint(&mut hash);
        hash.value()
    };
    let mut all: Vec<u64> = synapses().into_iter().map(|(_, synapse, _)| of(synapse)).collect();
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), synapses().len());
}

#[test]
fn every_synapse_that_cannot_be_made_has_its_sentence() {
    let zero = SimDuration::ZERO;
    let nine = [1.0; 10];
    let bad = [
        (
            Synapse::lowpass_ms(0),
            "has a time constant of zero; use a longer one, or `Synapse::None`",
        ),
        (Synapse::alpha_ms(0), "has a time constant of zero"),
        (Synapse::DoubleExponential { rise: zero, decay: ms(5) }, "has a time constant of zero"),
        (Synapse::DoubleExponential { rise: ms(5), decay: zero }, "has a time constant of zero"),
        (Synapse::triangle_ms(0), "has a time constant of zero"),
        (Synapse::delay_ms(0), "has a time constant of zero"),
        (
            Synapse::Delay { length: SimDuration::from_micros(2500) },
            "2500 us is not a whole number of ticks of 1 ms",
        ),
        (Synapse::delay_ms(2_000_000), "2000000 ticks; use at most 1000000"),
        (Synapse::triangle_ms(2_000_000), "2000000 ticks; use at most 1000000"),
        (Synapse::linear(&[1.0], &nine), "order 9; use an order of at most 8"),
        (
            Synapse::linear(&[1.0, 2.0, 3.0], &[1.0, 2.0]),
            "numerator of order 2 above a denominator of order 1",
        ),
        (Synapse::linear(&[], &[1.0]), "numerator has only zeros"),
        (Synapse::linear(&[0.0], &[1.0, 1.0]), "numerator has only zeros"),
        (Synapse::linear(&[1.0], &[0.0, 0.0]), "denominator has only zeros"),
        (Synapse::linear(&[1.0], &[f64::NAN, 1.0]), "not finite"),
        (Synapse::linear(&[f64::INFINITY], &[1.0, 1.0]), "not finite"),
        (Synapse::linear(&[1e300], &[1e-300, 0.0]), "not finite"),
        (Synapse::linear(&[1.0], &[1.0, -1e6]), "not finite"),
    ];
    for (synapse, expected) in bad {
        let mut graph = GraphBuilder::new();
        let one = graph.add("one", Constant::scalar(1.0));
        let sum = graph.add("sum", Add::scalar());
        graph.connect(&one, &sum.input, synapse);
        graph.probe(&one, ProbeSpec::default().filtered(synapse));
        let error = graph
            .build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))
            .expect_err("refused");
        assert_eq!(error.0.len(), 2, "{error}");
        let texts = [error.0[0].to_string(), error.0[1].to_string()];
        assert!(texts[0].starts_with("the connection from `one.out` to `sum.in"), "{}", texts[0]);
        assert!(texts[1].starts_with("the probe on `one.out` cannot record: its filter has "));
        assert!(texts.iter().all(|text| text.contains(expected)), "{texts:?} lacks {expected}");
    }
    assert_eq!(
        Filter::new(Synapse::delay_ms(0), Timebase::default()).map(|_| ()),
        Err(SynapseError::ZeroTime)
    );
}

#[test]
fn an_unstable_filter_ends_the_run_with_the_name_of_its_output() {
    let grows = Synapse::linear(&[1.0], &[1.0, -2000.0]);
    for probed in [false, true] {
        let mut graph = GraphBuilder::new();
        let one = graph.add("one", Constant::scalar(1.0));
        let sum = graph.add("sum", Add::scalar());
        match probed {
            true => {
                graph.route(&one >> &sum);
                graph.probe(&one, ProbeSpec::default().filtered(grows));
            }
            false => graph.route((&one >> &sum).via(grows)),
        }
        let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1)).unwrap();
        let error = sim.run_for(ms(200)).expect_err("infinite").to_string();
        assert!(error.starts_with("`one.out (filtered)` became inf in tick"), "{error}");
    }
}

fn low_pass(tau: Synapse) -> Filter {
    Filter::new(tau, Timebase::default()).unwrap()
}

#[test]
fn a_low_pass_gives_the_closed_form_of_a_step_and_an_euler_step_would_not() {
    let filter = low_pass(Synapse::lowpass_ms(5));
    let (mut held, mut worst, mut euler, mut off) = ([0.0f32], 0.0f64, 0.0f64, 0.0f64);
    for k in 1..=60 {
        filter.step(&[2.0], &mut held);
        let exact = 2.0 * (1.0 - (-f64::from(k) / 5.0).exp());
        worst = worst.max((f64::from(held[0]) - exact).abs());
        euler += (2.0 - euler) / 5.0;
        off = off.max((euler - exact).abs());
    }
    assert!(held[0] > 1.9, "the filter moved");
    assert!(worst < 1e-6 && off > 1e-2, "{worst} {off}");
}

#[test]
fn a_low_pass_without_input_reaches_zero_and_is_never_subnormal() {
    for millis in [1, 5, 100, 1000] {
        let filter = low_pass(Synapse::lowpass_ms(millis));
        // The last input is subnormal and would keep its filter subnormal.
        let mut held = [1.0f32, -1.0, 1e-3, f32::MAX, 1e-40];
        let input = [0.0, 0.0, 0.0, 0.0, 1e-40];
        // ln(3.4e38 / 1.1e-19) = 132 time constants.
        let mut ticks = 0;
        while held.iter().any(|v| *v != 0.0) && ticks < 135 * millis {
            filter.step(&input, &mut held);
            let small = held.iter().any(|v| v.is_subnormal() || (v * v).is_subnormal());
            assert!(!small, "{held:?} in tick {ticks}");
            ticks += 1;
        }
        assert_eq!(held, [0.0; 5], "{millis} ms");
    }
}

#[test]
fn values_that_are_not_finite_are_not_hidden() {
    for synapse in [Synapse::lowpass_ms(5), Synapse::alpha_ms(5), Synapse::triangle_ms(5)] {
        let filter = low_pass(synapse);
        let mut state = vec![0.0; filter.state_len(2)];
        let out = filter.step(&[f32::NAN, f32::INFINITY], &mut state);
        assert!(out[0].is_nan() && !out[1].is_finite(), "{synapse}: {out:?}");
    }
}
