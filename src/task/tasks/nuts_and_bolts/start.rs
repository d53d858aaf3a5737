//! Draws the places from which the parts fall at the beginning: apart from each other, lying but tilted.

use std::f64::consts::{FRAC_PI_2, TAU};

use rand::{Rng, RngExt};

use super::settings::{BOLT, NUT, NutsAndBolts};
use crate::robot::arm::{BodyFrame, Turn};
use crate::robot::scene::Part;
use crate::sim::Seed;
use crate::task::error::TaskError;

/// Draws the parts: nuts, then bolts.
///
/// # Errors
/// [`TaskError::Setting`] if no attempt finds room for all parts.
pub(super) fn parts(settings: &NutsAndBolts, seed: Seed) -> Result<Vec<Part>, TaskError> {
    let mut rng = seed.derive("scene", "drop").rng();
    // The places of the first parts can leave no room for the last part. In that case, start again.
    (0..200).find_map(|_| draw(settings, &mut rng)).ok_or_else(|| TaskError::Setting {
        name: "table.spacing_m",
        value: settings.table.spacing_m.to_string(),
        expected: "a spacing that leaves room for all parts",
    })
}

/// Draws all places once; `None` if a part finds no room.
fn draw(settings: &NutsAndBolts, rng: &mut impl Rng) -> Option<Vec<Part>> {
    let kinds = [(NUT, settings.nuts), (BOLT, settings.bolts)];
    let kinds = kinds.into_iter().flat_map(|(kind, count)| std::iter::repeat_n(kind, count));
    let table = &settings.table;
    let [low, high] = table.drop;
    let mut places: Vec<[f64; 2]> = Vec::new();
    let mut drawn = Vec::new();
    for kind in kinds {
        let place = (0..1_000).find_map(|_| {
            let at: [f64; 2] =
                std::array::from_fn(|i| low[i] + (high[i] - low[i]) * rng.random::<f64>());
            let apart = |b: &[f64; 2]| (at[0] - b[0]).hypot(at[1] - b[1]);
            places.iter().all(|b| apart(b) >= table.spacing_m).then_some(at)
        })?;
        places.push(place);
        let yaw = TAU * rng.random::<f64>();
        let roll = TAU * rng.random::<f64>();
        let tilt = table.drop_tilt_deg.to_radians() * rng.random::<f64>();
        let towards = TAU * rng.random::<f64>();
        let lying = match kind {
            NUT => Turn::about_z(roll),
            _ => Turn::about_y(FRAC_PI_2) * Turn::about_z(roll),
        };
        let axis = [towards.cos(), towards.sin(), 0.0];
        let turn = Turn::about(axis, tilt) * Turn::about_z(yaw) * lying;
        let position = [place[0], place[1], table.drop_height_m];
        drawn.push(Part::free(kind, BodyFrame { position, turn }));
    }
    Some(drawn)
}
