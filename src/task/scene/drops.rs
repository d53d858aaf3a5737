//! Where the parts are let fall at the beginning: drawn apart from one another, lying but tilted.

use rand::{Rng, RngExt};
use rapier3d::math::{Pose as Frame, Rotation, Vector};

use super::config::SceneSpec;
use super::physics::PartKind;
use crate::sim::Seed;
use crate::task::error::TaskError;

/// Where each part is let fall.
///
/// # Errors
/// [`TaskError::Setting`] if no drawing finds room for all of them.
pub(crate) fn places(spec: &SceneSpec, seed: Seed) -> Result<Vec<(PartKind, Frame)>, TaskError> {
    let mut rng = seed.derive("scene", "drop").rng();
    // A bad beginning can leave no room for the last part: begin again.
    (0..200).find_map(|_| draw_drops(spec, &mut rng)).ok_or_else(|| TaskError::Setting {
        name: "table.spacing_m",
        value: spec.table.spacing_m.to_string(),
        expected: "a spacing that leaves room for all parts",
    })
}

/// Where each part is let fall; `None` if the last ones found no room.
fn draw_drops(spec: &SceneSpec, rng: &mut impl Rng) -> Option<Vec<(PartKind, Frame)>> {
    let kinds = std::iter::repeat_n(PartKind::Nut, spec.nuts)
        .chain(std::iter::repeat_n(PartKind::Bolt, spec.bolts));
    let [low, high] = spec.table.drop;
    let mut places: Vec<[f64; 2]> = Vec::new();
    let mut drawn = Vec::new();
    for kind in kinds {
        let place = (0..1_000).find_map(|_| {
            let at: [f64; 2] =
                std::array::from_fn(|i| low[i] + (high[i] - low[i]) * rng.random::<f64>());
            let apart = |b: &[f64; 2]| (at[0] - b[0]).hypot(at[1] - b[1]);
            places.iter().all(|b| apart(b) >= spec.table.spacing_m).then_some(at)
        })?;
        places.push(place);
        let yaw = std::f64::consts::TAU * rng.random::<f64>();
        let roll = std::f64::consts::TAU * rng.random::<f64>();
        let tilt = spec.table.drop_tilt_deg.to_radians() * rng.random::<f64>();
        let towards = std::f64::consts::TAU * rng.random::<f64>();
        let lying = match kind {
            PartKind::Nut => Rotation::from_rotation_z(roll),
            PartKind::Bolt => {
                Rotation::from_rotation_y(std::f64::consts::FRAC_PI_2)
                    * Rotation::from_rotation_z(roll)
            }
        };
        let axis = Vector::new(towards.cos(), towards.sin(), 0.0);
        let turn = Rotation::from_rotation_z(yaw);
        let turn = Rotation::from_axis_angle(axis, tilt) * turn * lying;
        let at = Vector::new(place[0], place[1], spec.table.drop_height_m);
        drawn.push((kind, Frame::from_parts(at, turn)));
    }
    Some(drawn)
}
