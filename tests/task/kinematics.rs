//! The kinematics of the arm: its length, and the places that it reaches.

#![cfg(feature = "physics")]

use std::f64::consts::FRAC_PI_4;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::RngExt;
use symbolt::robot::arm::{forward_kinematics, inverse_kinematics};
use symbolt::robot::{Pose, rotation_between};
use symbolt::sim::Seed;

/// Ranges of the joints, in radians.
const LIMITS: [(f64, f64); 7] = [
    (-2.888, 2.888),
    (-1.754, 1.754),
    (-2.888, 2.888),
    (-3.063, -0.079),
    (-2.888, 2.888),
    (-0.009, 3.744),
    (-2.888, 2.888),
];
/// The posture in which the arm waits.
const HOME: [f64; 7] = [0.0, -0.55, 0.0, -2.35, 0.0, 1.8, FRAC_PI_4];
/// Distance from the flange to the tool centre point, in metres.
const TOOL_M: f64 = 0.1034;

fn tool(angles: &[f64; 7]) -> Pose {
    forward_kinematics(angles)[7]
}

/// The direction in which the hand points.
fn pointing(pose: &Pose) -> Vector3<f64> {
    let [x, y, z, w] = pose.orientation;
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)) * Vector3::z()
}

#[test]
fn the_stretched_arm_is_as_long_as_its_links() {
    // Upright: 0.333 + 0.316 + 0.384 up; the hand hangs 88 mm beside, pointing down.
    let hand = tool(&[0.0; 7]);
    let height = 0.333 + 0.316 + 0.384 - 0.107 - TOOL_M;
    assert!(hand.distance(&Pose::at([0.088, 0.0, height])) < 1e-12);
    assert!((pointing(&hand) + Vector3::z()).norm() < 1e-12);
}

#[test]
fn every_place_near_the_table_is_reached_within_the_limits() {
    let mut rng = Seed::new(2).rng();
    let (mut asked, mut reached) = (0, 0);
    while asked < 200 {
        let angles = LIMITS.map(|(low, high)| low + (high - low) * rng.random::<f64>());
        let target = tool(&angles);
        let [x, y, z] = target.position;
        let down = -pointing(&target).z;
        if !(0.02..=0.4).contains(&z) || x < 0.3 || x.hypot(y) > 0.65 || down < 0.5 {
            continue;
        }
        asked += 1;
        if let Some(found) = inverse_kinematics(&target, &HOME) {
            reached += 1;
            let turn = rotation_between(&tool(&found), &target);
            assert!(tool(&found).distance(&target) < 1e-4 && Vector3::from(turn).norm() < 2e-4);
            assert!(found.iter().zip(LIMITS).all(|(a, (low, high))| (low..=high).contains(a)));
        }
    }
    // Some targets were drawn at the very edge of a joint's range.
    assert!(reached >= 185, "{reached} of 200");
}
