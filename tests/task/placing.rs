//! The orientations in which a part may stand at a target.

#![cfg(feature = "physics")]

use std::f64::consts::FRAC_PI_2;

use symbolt::robot::Pose;
use symbolt::robot::arm::{BodyFrame, Turn};
use symbolt::robot::scene::Symmetry;
use symbolt::robot::skill::Target;

const AT: [f64; 3] = [0.5, 0.1, 0.05];
const SQUARE: Symmetry = Symmetry { turns: 24, fold: 4, flips: false };

fn held() -> Pose {
    let turn = Turn::about_z(0.3) * Turn::about_y(FRAC_PI_2);
    BodyFrame { position: [0.4, 0.0, 0.2], turn }.pose()
}

/// Returns the directions of a pose's axes.
fn axes(pose: &Pose) -> [[f64; 3]; 3] {
    let turn = BodyFrame::from(pose).turn;
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| turn.apply(axis))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn is_like(a: &Pose, b: &Pose) -> bool {
    axes(a).iter().zip(axes(b)).all(|(a, b)| dot(*a, b) > 1.0 - 1e-12)
}

#[test]
fn a_full_target_allows_only_the_orientations_in_which_the_part_looks_the_same() {
    let turn = Turn::about_z(0.7) * Turn::about_x(0.2);
    let whole = BodyFrame { position: AT, turn }.pose();
    for (fold, flips, count) in [(1, false, 1), (4, false, 4), (6, true, 12)] {
        let all = Target::pose(&whole).poses(&Symmetry { turns: 24, fold, flips }, &held());
        assert_eq!(all.len(), count);
        assert_eq!(all.iter().filter(|own| is_like(own, &whole)).count(), 1, "fold {fold}");
        for own in &all {
            let along = dot(axes(own)[2], axes(&whole)[2]);
            assert!((along.abs() - 1.0).abs() < 1e-9 && (flips || along > 0.0));
        }
    }
}

#[test]
fn without_a_facing_the_part_keeps_its_orientation_or_turns_about_the_vertical() {
    let all = Target::anyhow(AT).poses(&SQUARE, &held());
    assert_eq!(all.len(), 24);
    assert!(is_like(&all[0], &held()));
    let height = axes(&held())[2][2];
    assert!(all.iter().all(|own| (axes(own)[2][2] - height).abs() < 1e-9));
}

#[test]
fn a_square_bar_lies_on_one_of_its_sides() {
    let symmetry = Symmetry { turns: 4, fold: 1, flips: false };
    for (x, y) in [(1.0, 0.0), (0.3, -0.8), (-0.5, 0.6)] {
        let all = Target::along(AT, [x, y, 0.0]).poses(&symmetry, &held());
        assert_eq!(all.len(), 4);
        let length = f64::hypot(x, y);
        for own in &all {
            let [side, _, axis] = axes(own);
            assert!(dot(axis, [x / length, y / length, 0.0]) > 1.0 - 1e-12);
            assert!(!(1e-9..=1.0 - 1e-9).contains(&side[2].abs()), "{side:?}");
        }
    }
}

#[test]
fn an_axis_leaves_the_turn_about_it_open() {
    let all = Target::upright(AT).poses(&SQUARE, &held());
    assert_eq!(all.len(), 24);
    assert!(all.iter().all(|own| axes(own)[2][2] > 1.0 - 1e-9));
}
