//! Unit tests of `src/task/classify/tolerance.rs`.

use super::*;

#[test]
fn the_prior_is_the_weighted_median_and_one_loose_state_does_not_shift_it() {
    let mut pool = Pool::default();
    for (sd, dof) in [(1e-5, 4), (2e-5, 4), (3e-5, 4), (9e-3, 4), (5.0, 0)] {
        pool.position(0.0, sd, dof);
    }
    let priors = pool.priors();
    assert!((priors.aside_m - (0.5 * (4e-10 + 9e-10f64)).sqrt()).abs() < 1e-9, "{priors:?}");
    // No state tells the others.
    assert_eq!((priors.height_m, priors.tilt_rad), (2e-4, 0.015));
    let mut one = vec![(4.0, 2), (9.0, 3)];
    assert_eq!(median(&mut one), Some(9.0));
    assert_eq!(median(&mut vec![(4.0, 1)]), Some(4.0));
    assert_eq!(median(&mut Vec::new()), None);
}

#[test]
fn the_predictive_variance_is_that_of_the_formula() {
    assert_eq!(predictive(3.0, 99.0, 1), 18.0);
    assert!((predictive(3.0, 2.0, 20) - 1.05 * (9.0 + 19.0 * 4.0) / 20.0).abs() < 1e-12);
    let five = predictive(3.0, 2.0, 5) / (1.2 * (9.0 + 16.0) / 5.0);
    assert!((five - WIDENING[0].powi(2)).abs() < 1e-12);
    let half = between(&Directions { height_m: 1.0, aside_m: 3.0, tilt_rad: 0.0 }, 0.5f64.sqrt());
    assert!((half - 5.0).abs() < 1e-12);
}

#[test]
fn few_poses_are_widened_by_quantiles_of_students_distribution() {
    use statrs::distribution::{ContinuousCDF, StudentsT};
    for (poses, factor) in (FEW.0..=FEW.1).zip(WIDENING) {
        let t = StudentsT::new(0.0, 1.0, poses as f64).map(|t| t.inverse_cdf(1.0 - 1e-4));
        assert!((t.unwrap_or_default() / 5.0 - factor).abs() < 2e-3, "{poses}: {t:?}");
    }
    assert_eq!([1, 2, 5, 14].map(widening), [1.0, 1.935, 1.935, 1.0]);
}

#[test]
fn the_vertical_is_what_objects_that_lie_anywhere_agree_in() {
    let table = |i: usize| std::array::from_fn(|k| k == i);
    assert_eq!(up_axis([table(1), [true; 3], [false; 3], table(1)].into_iter()), Some(1));
    assert_eq!(up_axis([table(1), table(2)].into_iter()), None);
    assert_eq!(up_axis([[true, true, false]].into_iter()), None);
}

#[test]
fn a_place_reaches_as_far_as_objects_are_accepted() {
    use crate::task::classify::Classifier;
    use crate::task::domain::{Frame, RelationalDomain};
    use crate::task::recording::{ObjectPose, Snapshot};

    let file = include_bytes!("../fixtures/learned/jig.json");
    let domain = RelationalDomain::parse(file, "jig.json").expect("a domain");
    let classifier = Classifier::new(&domain);
    let (mut inside, mut outside) = (0, 0);
    for (s, state) in domain.states.iter().enumerate() {
        let Frame::Kind(kind) = &state.frame else { continue };
        for (p, place) in state.places.iter().enumerate() {
            if place.coordinates.iter().any(|c| c.is_open()) {
                continue;
            }
            let reach = classifier.reach(s, p);
            for (axis, share) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, 0.9), (axis, 1.3)]) {
                let mut pose = place.pose();
                pose.position[axis] += share * reach[axis];
                let object =
                    |kind: &str, pose| ObjectPose { id: kind.into(), kind: kind.into(), pose };
                let objects = vec![object(&state.kind, pose), object(kind, Pose::at([0.0; 3]))];
                let scene = Snapshot { objects, ..Snapshot::default() };
                let found = classifier.classify_object(&scene, 0).fact;
                let there = found.is_some_and(|fact| (fact.state, fact.place) == (s, p));
                match share < 1.0 {
                    true => inside += usize::from(there),
                    false => outside += usize::from(!there),
                }
                assert_eq!(there, share < 1.0, "{}, axis {axis}, {share}: {found:?}", state.name);
            }
        }
    }
    assert!(inside >= 6 && outside >= 6, "{inside} inside, {outside} outside");
}
