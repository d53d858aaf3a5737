//! The closed forms of a neuron, and the plan that gives each node its model.

#![allow(clippy::expect_used)]

use symbolt::neurons::{Lif, NeuronModel, PathPattern, PatternError, Population};

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
    assert!(Lif { tau_rc_s: -0.02, tau_ref_s: 0.002 }.check(0.001).is_err());
    assert!(Lif { tau_rc_s: 0.02, tau_ref_s: f64::NAN }.check(0.001).is_err());
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
    assert_eq!(error, Err("there is no mode `lif2`; the modes are: direct, rate, lif".into()));
}
