//! Seeds, spans of time and fingerprints.

use std::collections::HashSet;

use rand::RngExt;
use symbolt::sim::{ConfigError, Fingerprint, Real, Seed, SimDuration, Timebase};

#[test]
fn the_derivation_is_pinned() {
    // A change here changes every published result.
    assert_eq!(Seed::new(1).derive("planner/goal", "noise").value(), 8_290_046_766_323_288_215);
    assert_eq!(Seed::new(1).rng().random::<u32>(), 467_601_059);
}

#[test]
fn no_two_of_ten_thousand_derived_seeds_agree() {
    let mut seen = HashSet::new();
    for root in 0..10 {
        for node in 0..250 {
            for role in ["encoders", "noise", "pointer", "order"] {
                seen.insert(Seed::new(root).derive(&format!("a/{node}"), role));
            }
        }
    }
    assert_eq!(seen.len(), 10_000);
}

#[test]
fn moving_a_letter_between_path_and_role_changes_the_seed() {
    assert_ne!(Seed::new(0).derive("ab", "c"), Seed::new(0).derive("a", "bc"));
}

#[test]
fn a_span_that_is_no_whole_number_of_ticks_is_refused() {
    let time = Timebase::default();
    assert_eq!(time.ticks(SimDuration::from_millis(43)), Ok(43));
    let odd = SimDuration::from_micros(1_000_000 / 240);
    assert!(matches!(time.ticks(odd), Err(ConfigError::Indivisible { .. })));
}

#[test]
fn every_whole_millisecond_up_to_five_seconds_counts_exactly() {
    let time = Timebase::default();
    let wrong = (1..5000u64)
        .filter(|ms| {
            let span = SimDuration::from_secs_f64(*ms as f64 / 1000.0);
            span.and_then(|s| time.ticks(s)) != Ok(*ms)
        })
        .count();
    assert_eq!(wrong, 0);
}

#[test]
fn nonsense_durations_are_refused() {
    for bad in [-1.0, f64::NAN, f64::INFINITY, 1e13] {
        assert!(SimDuration::from_secs_f64(bad).is_err(), "{bad}");
    }
    assert!(Timebase::new(SimDuration::ZERO).is_err());
    assert!(Timebase::new(SimDuration::from_secs(2)).is_err());
}

#[test]
fn order_length_and_sign_matter() {
    let of = |parts: &[&[Real]]| {
        let mut hash = Fingerprint::default();
        parts.iter().for_each(|part| {
            hash.reals(part);
        });
        hash.value()
    };
    let all = [
        of(&[&[1.0, 2.0]]),
        of(&[&[2.0, 1.0]]),
        of(&[&[1.0], &[2.0]]),
        of(&[&[1.0, -2.0]]),
        of(&[&[-1.0, -2.0]]),
        of(&[&[]]),
    ];
    for (i, a) in all.iter().enumerate() {
        assert!(all[i + 1..].iter().all(|b| a != b), "{i}");
    }
}
