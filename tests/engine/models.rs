//! The closed forms of a neuron, and the plan that gives each node its model.

#![allow(clippy::expect_used)]

use symbolt::neurons::{
    Ensemble, Lif, LifRate, NeuronModel, PathPattern, PatternError, Population, PopulationPlan,
    Traffic,
};
use symbolt::prelude::*;

#[test]
fn gain_and_bias_give_the_rate_and_the_intercept_asked_for() {
    let lif = Lif::default();
    for (rate, intercept) in [(200.0, -1.0), (400.0, 0.9), (317.0, 0.0), (480.0, -0.3)] {
        let (gain, bias) = lif.gain_bias(rate, intercept).expect("possible");
        assert!((lif.rate(gain + bias) - rate).abs() < 1e-6 * rate);
        assert!((gain * intercept + bias - 1.0).abs() < 1e-9);
    }
}

#[test]
fn spikes_come_at_the_closed_forms_rate() {
    let lif = Lif::default();
    for current in [1.05, 1.5, 3.0, 10.0, 40.0] {
        for dt_s in [0.001, 0.0005, 0.0001] {
            let (mut voltage, mut refractory) = (0.0, 0.0);
            let steps = (4.0 / dt_s) as usize;
            let spikes = (0..steps)
                .filter(|_| lif.step_exactly(dt_s, current, &mut voltage, &mut refractory))
                .count();
            let expected = 4.0 * lif.rate(current);
            assert!(expected > 50.0);
            assert!(
                (spikes as f64 - expected).abs() <= 1.5,
                "{current} {dt_s}: {spikes} {expected}"
            );
        }
    }
}

#[test]
fn without_the_moment_of_the_spike_the_rate_would_be_wrong() {
    // The wrong variant: the refractory period begins at the end of the step.
    let (lif, dt_s) = (Lif::default(), 0.001);
    let (mut voltage, mut refractory, mut spikes) = (0.0f64, 0.0, 0);
    for _ in 0..4_000 {
        if lif.step_exactly(dt_s, 10.0, &mut voltage, &mut refractory) {
            spikes += 1;
            refractory = lif.tau_ref_s + dt_s;
        }
    }
    let expected = 4.0 * lif.rate(10.0);
    assert!((f64::from(spikes) - expected).abs() > 20.0, "{spikes} {expected}");
}

#[test]
fn what_cannot_be_is_refused() {
    let lif = Lif::default();
    for (rate, intercept) in [(500.0, 0.0), (0.0, 0.0), (-3.0, 0.0), (f64::NAN, 0.0)] {
        let error = lif.gain_bias(rate, intercept).expect_err("impossible").to_string();
        assert!(error.contains("`max_rate`") && error.contains("500 Hz"), "{error}");
    }
    for intercept in [1.0, -1.5, f64::NAN] {
        let error = lif.gain_bias(300.0, intercept).expect_err("impossible").to_string();
        assert!(error.contains("`intercept`"), "{error}");
    }
    assert!(Lif { tau_rc_s: -0.02, ..Lif::default() }.check(0.001).is_err());
    assert!(Lif { tau_ref_s: f64::NAN, ..Lif::default() }.check(0.001).is_err());
}

#[test]
fn an_amplitude_scales_spikes_and_rates_and_nothing_else() {
    let (whole, half) = (Lif::default(), Lif { amplitude: 0.5, ..Lif::default() });
    assert_eq!(whole.gain_bias(300.0, 0.2).ok(), half.gain_bias(300.0, 0.2).ok());
    let mut singles = [1.5f32, 7.0, 0.5];
    half.rates_single(&mut singles);
    for (current, single) in [1.5, 7.0, 0.5].into_iter().zip(singles) {
        assert_eq!(half.rate(current), 0.5 * whole.rate(current));
        assert!((f64::from(single) - half.rate(current)).abs() < 1e-2);
    }
    // Far above threshold, without a refractory time too.
    for (tau_ref_s, currents) in [(0.002, [1e3, 1e6, f32::INFINITY]), (0.0, [1e3, 1e6, 1e8])] {
        let lif = Lif { tau_ref_s, ..Lif::default() };
        let mut singles = currents;
        lif.rates_single(&mut singles);
        for (current, single) in currents.into_iter().zip(singles) {
            let rate = lif.rate(f64::from(current));
            assert!((f64::from(single) / rate - 1.0).abs() < 1e-4, "{current}: {single}, {rate}");
        }
    }
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.6]));
    let spikes = Ensemble::new(1).neurons(100).model(half).expose_neurons().identity("x");
    let spikes = graph.add("spikes", spikes);
    let rates =
        graph.add("rates", Ensemble::new(1).neurons(100).model(LifRate(half)).identity("x"));
    graph.route(&given >> &spikes.input);
    graph.route(&given >> &rates.input);
    let smooth = ProbeSpec::default().filtered(Synapse::lowpass_ms(50));
    let read = [&spikes, &rates].map(|ensemble| graph.probe(&ensemble.output("x"), smooth));
    let activity = graph.probe(&spikes.neurons(), ProbeSpec::default());
    let plan = PopulationPlan::lif();
    let sim = graph.run(&plan, Seed::new(1), SimDuration::from_millis(300)).expect("runs");
    for probe in &read {
        let x = sim.samples(probe).last().expect("there").1[0];
        assert!((x - 0.6).abs() < 0.05, "{x}");
    }
    let all: Vec<f32> = sim.samples(&activity).iter().flat_map(|(_, row)| row.to_vec()).collect();
    let fired = all.iter().filter(|rate| **rate > 0.0);
    assert!(fired.clone().count() > 1_000 && fired.clone().all(|rate| (rate - 500.0).abs() < 1e-3));
}

#[test]
fn traffic_is_counted_from_the_layout() {
    let of = |functions: usize| {
        let mut graph = GraphBuilder::new();
        let given = graph.add("given", Constant::vector(&[0.5]));
        let names: Vec<String> = (0..functions).map(|n| format!("x{n}")).collect();
        let new = Ensemble::new(1).neurons(100);
        let a = graph.add("a", names.iter().fold(new, |a, name| a.identity(name)));
        graph.route(&given >> &a.input);
        let plan = PopulationPlan::lif();
        let sim = graph.run(&plan, Seed::new(1), SimDuration::from_millis(20)).expect("runs");
        Traffic::of(&sim)
    };
    // 100 neurons are padded to 104; each has an encoder, a bias, a decoder, a voltage and a refractory time of 4 bytes.
    let one = of(1);
    assert_eq!(one.visited, 100.0);
    assert_eq!((one.read, one.written), (4.0 * (3.0 * 104.0 + 1.0), 4.0 * (2.0 * 104.0 + 1.0)));
    assert_eq!(one.operations, 104.0 * (1.0 + 2.0 + 30.0) + 2.0 * 104.0);
    // Of several outputs only the decoders of those that fire are read: some, but few.
    let two = of(2);
    let decoders = two.read / 4.0 - (2.0 * 104.0 + 1.0);
    assert!(decoders % 2.0 == 0.0 && (2.0..80.0).contains(&decoders), "{decoders}");
    assert_eq!(Traffic::default(), {
        let mut graph = GraphBuilder::new();
        graph.add("given", Constant::vector(&[0.5]));
        let sim = graph.start(&PopulationPlan::direct(), Seed::new(1));
        Traffic::of(&sim.expect("starts"))
    });
}

#[test]
fn patterns_match_as_documented() -> Result<(), PatternError> {
    let cases = [
        ("a/b", "a/b", true),
        ("a/b", "a/bc", false),
        ("a/*", "a/b", true),
        ("a/*", "a/b/c", false),
        ("**", "a/b/c", true),
        ("**/c", "a/b/c", true),
        ("**/c", "c", true),
        ("a/**", "a", true),
        ("a/**/d", "a/b/c/d", true),
        ("a/**/d", "a/b/c", false),
        ("*b*", "abc", true),
        ("a*a", "a", false),
        ("a*a", "aa", true),
        ("a*bc*d", "abbcbd", true),
    ];
    for (pattern, path, expected) in cases {
        let parsed: PathPattern = pattern.parse()?;
        assert_eq!(parsed.matches(path), expected, "{pattern} on {path}");
    }
    Ok(())
}

#[test]
fn broken_patterns_are_refused() {
    for bad in ["", "a//b", "a/", "a b", "a**b", "***"] {
        assert!(bad.parse::<PathPattern>().is_err(), "{bad}");
    }
}

#[test]
fn an_unknown_mode_names_those_that_exist() {
    let error = "lif2".parse::<Population>().map_err(|e| e.to_string());
    assert_eq!(
        error,
        Err("there is no mode `lif2` (did you mean `lif`?); the modes are: direct, rate, lif"
            .into())
    );
}

#[test]
fn a_voltage_without_a_floor_is_written_and_read_and_a_misspelt_field_is_refused() {
    let free = Lif { min_voltage: f64::NEG_INFINITY, ..Lif::default() };
    let text = serde_json::to_string(&free).unwrap();
    assert_eq!(serde_json::from_str::<Lif>(&text).unwrap(), free, "{text}");
    assert_eq!(
        serde_json::from_str::<Lif>("{\"tau_rc_s\":0.02,\"tau_ref_s\":0.002}").unwrap(),
        Lif::default()
    );
    let refused = serde_json::from_str::<Lif>("{\"min_voltge\":-1}").unwrap_err().to_string();
    assert!(
        refused.starts_with("unknown field `min_voltge`, expected one of `tau_rc_s`"),
        "{refused}"
    );
}
