//! Geometry of places: drawing targets, accepting them, and coming to rest. All poses are relative to the place.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::spec::Lie;
use super::truth::{Extent, TIGHT_M, TrueState, Turn};

/// Standard deviation of a placement by hand in the horizontal plane, per coordinate, in metres.
const HAND_M: f64 = 2e-4;

/// Standard deviation of a resting height, in metres.
const HEIGHT_M: f64 = 2e-5;

/// Standard deviation of the angle of a placement by hand, in degrees.
const HAND_DEG: f64 = 0.2;

/// A target may be this much above or below the heights of an area, in metres.
const ABOVE_AREA_M: f64 = 0.02;

/// Share of the tolerance that a careful demonstrator uses at most.
const CAREFUL: f64 = 0.8;

/// Standard deviation of a careful demonstrator's targets in the horizontal plane, per coordinate, by the tolerance.
const SPREAD: f64 = 0.2;

/// An object lies flat or on its side if its axis is at most this far from doing so, in degrees.
const LEVEL_DEG: f64 = 5.0;

fn normal(rng: &mut ChaCha8Rng, deviation: f64) -> f64 {
    deviation * rng.sample::<f64, _>(StandardNormal)
}

fn yaw(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
}

/// The part of a rotation that turns about the z axis.
fn twist(turn: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let about_z = Quaternion::new(turn.w, 0.0, 0.0, turn.k);
    UnitQuaternion::try_new(about_z, 1e-9).unwrap_or_default()
}

/// The angle by which a rotation tilts the z axis, in degrees.
fn tilt_deg(turn: &UnitQuaternion<f64>) -> f64 {
    (turn * Vector3::z()).angle(&Vector3::z()).to_degrees()
}

impl Lie {
    fn draw(self, rng: &mut ChaCha8Rng) -> UnitQuaternion<f64> {
        let angle = rng.random_range(-PI..PI);
        match self {
            Self::Flat => yaw(angle),
            Self::Side => {
                let roll = rng.random_range(-PI..PI);
                yaw(angle)
                    * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), PI / 2.0)
                    * yaw(roll)
            }
            Self::Tumbled => {
                let [w, x, y, z]: [f64; 4] = std::array::from_fn(|_| normal(rng, 1.0));
                UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9).unwrap_or_default()
            }
        }
    }

    /// The orientation in which an object rests that was put down with the orientation `turn`.
    fn rest(self, turn: &UnitQuaternion<f64>, rng: &mut ChaCha8Rng) -> UnitQuaternion<f64> {
        match self {
            Self::Flat if tilt_deg(turn) <= LEVEL_DEG => twist(turn),
            Self::Side if (tilt_deg(turn) - 90.0).abs() <= LEVEL_DEG => {
                let axis = turn * Vector3::z();
                let level = Vector3::new(axis.x, axis.y, 0.0);
                UnitQuaternion::rotation_between(&axis, &level).unwrap_or_default() * turn
            }
            Self::Tumbled => *turn,
            _ => self.draw(rng),
        }
    }
}

/// Draws a target in a state: near the middle of the tolerance, or anywhere in it if the demonstrator is `careless`.
pub(super) fn draw(
    state: &TrueState,
    lie: Lie,
    careless: bool,
    rng: &mut ChaCha8Rng,
) -> Isometry3<f64> {
    let position = match state.extent {
        Extent::Spot { tolerance_m } if careless => {
            // The root makes the points uniform in the disc.
            let from = Vector3::x() * (tolerance_m * rng.random::<f64>().sqrt());
            yaw(rng.random_range(-PI..PI)) * from
        }
        Extent::Spot { tolerance_m } => {
            let (limit, spread_m) = (CAREFUL * tolerance_m, SPREAD * tolerance_m);
            let offset = Vector3::new(normal(rng, spread_m), normal(rng, spread_m), 0.0);
            if offset.norm() > limit { offset * (limit / offset.norm()) } else { offset }
        }
        Extent::Area { half_m: [x, y], .. } => {
            Vector3::new(rng.random_range(-x..=x), rng.random_range(-y..=y), 0.0)
        }
    };
    let turn = match state.turn {
        Turn::Free => lie.draw(rng),
        Turn::Axis => yaw(rng.random_range(-PI..PI)),
        Turn::Full => match state.extent {
            Extent::Spot { tolerance_m } if careless && tolerance_m > TIGHT_M => {
                yaw(state.tolerance_deg.to_radians() * rng.random_range(-1.0..1.0))
            }
            Extent::Spot { tolerance_m } if tolerance_m > TIGHT_M => {
                let limit = CAREFUL * state.tolerance_deg;
                let angle = normal(rng, 0.25 * state.tolerance_deg).clamp(-limit, limit);
                yaw(angle.to_radians())
            }
            _ => UnitQuaternion::identity(),
        },
    };
    Isometry3::from_parts(Translation3::from(position), turn)
}

/// Whether a target is within the tolerance of a place.
pub(super) fn fits(state: &TrueState, target: &Isometry3<f64>) -> bool {
    let offset = target.translation.vector;
    let near = match state.extent {
        Extent::Spot { tolerance_m } => offset.norm() <= tolerance_m,
        Extent::Area { half_m: [x, y], depth_m } => {
            let heights = -ABOVE_AREA_M..=depth_m + ABOVE_AREA_M;
            offset.x.abs() <= x && offset.y.abs() <= y && heights.contains(&offset.z)
        }
    };
    let off_deg = match state.turn {
        Turn::Free => 0.0,
        Turn::Axis => tilt_deg(&target.rotation),
        Turn::Full => target.rotation.angle().to_degrees(),
    };
    near && off_deg <= state.tolerance_deg
}

/// Returns where an object comes to rest that was put at a target within the tolerance.
pub(super) fn rest(
    state: &TrueState,
    lie: Lie,
    target: &Isometry3<f64>,
    rng: &mut ChaCha8Rng,
) -> Isometry3<f64> {
    let put = target.translation.vector;
    let hand = [normal(rng, HAND_M), normal(rng, HAND_M)];
    let mut tight = false;
    let mut height = normal(rng, HEIGHT_M);
    let [x, y] = match state.extent {
        Extent::Spot { tolerance_m } => {
            tight = tolerance_m <= TIGHT_M;
            if tight { hand } else { [put.x + hand[0], put.y + hand[1]] }
        }
        Extent::Area { half_m, depth_m } => {
            let x = (put.x + hand[0]).clamp(-half_m[0], half_m[0]);
            let y = (put.y + hand[1]).clamp(-half_m[1], half_m[1]);
            // A heap is highest in the middle.
            let out = ((x / half_m[0]).powi(2) + (y / half_m[1]).powi(2)) / 2.0;
            height += depth_m * rng.random::<f64>() * (1.0 - 0.7 * out);
            [x, y]
        }
    };
    let wobble = normal(rng, HAND_DEG).to_radians();
    let turn = match state.turn {
        Turn::Free => lie.rest(&target.rotation, rng),
        Turn::Axis => twist(&target.rotation) * yaw(wobble),
        Turn::Full if tight => yaw(wobble),
        Turn::Full => twist(&target.rotation) * yaw(wobble),
    };
    Isometry3::from_parts(Translation3::new(x, y, height), turn)
}
