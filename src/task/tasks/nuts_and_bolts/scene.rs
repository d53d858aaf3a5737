//! The scene: nuts and bolts on a table, and the jig.

use super::settings::NutsAndBolts;
use super::{shapes, start};
use crate::robot::Pose;
use crate::robot::arm::BodyFrame;
use crate::robot::scene::{
    BodyKind, Fixture, Handling, Landmark, Look, SceneSpec, Symmetry, TableSpec,
};
use crate::sim::Seed;
use crate::task::error::TaskError;

/// Clearance of a shaft's tip above the jig on the way, in metres.
const CLEAR_M: f64 = 0.012;
/// Height above its pocket from which a nut is lowered straight down, in metres.
const NUT_RISE_M: f64 = 0.04;
/// Number of equally spaced rotations in which a part may stand at a target.
const TURNS: u32 = 24;
/// Distance within which another part of the same kind blocks a target, in metres.
const IN_THE_WAY_M: f64 = 0.025;

// Colours that colour-blind readers can tell apart (Okabe and Ito 2008).
const NUT_LOOK: Look = Look { colour: 0xe69f00, ink: 0x8a5f00, roughness: 0.35 };
const BOLT_LOOK: Look = Look { colour: 0x56b4e9, ink: 0x00639c, roughness: 0.35 };
const JIG_LOOK: Look = Look { colour: 0x6f7f8f, ink: 0x3c4652, roughness: 0.6 };

pub(super) fn spec(settings: &NutsAndBolts, seed: Seed) -> Result<SceneSpec, TaskError> {
    let NutsAndBolts { part, jig, table, gripper, arm, step_ms, .. } = settings;
    let handling = |flips, rise_m| Handling {
        symmetry: Symmetry { turns: TURNS, fold: 6, flips },
        rise_m,
        release_m: part.across_flats_m / 2.0 + 0.004,
        in_the_way_m: IN_THE_WAY_M,
        fall_m: 0.0,
        clear_m: 0.0,
    };
    let kind = |name: &String, pieces, handling, look| BodyKind {
        name: name.clone(),
        pieces,
        density: part.density,
        friction: part.friction,
        handling,
        look,
    };
    let fixture = |pieces, [x, y]: [f64; 2]| Fixture {
        frame: BodyFrame::at([x, y, 0.0]),
        pieces,
        friction: part.friction,
        look: JIG_LOOK,
        movable: None,
    };
    let landmark = |kind: String, [x, y]: [f64; 2], z| Landmark::fixed(kind, Pose::at([x, y, z]));
    let [pocket, hole] = settings.places();
    Ok(SceneSpec {
        kinds: vec![
            // A nut has no upper side.
            kind(&settings.nut_kind, shapes::nut(part), handling(true, NUT_RISE_M), NUT_LOOK),
            kind(
                &settings.bolt_kind,
                shapes::bolt(part),
                handling(false, part.shaft_length_m + CLEAR_M),
                BOLT_LOOK,
            ),
        ],
        parts: start::parts(settings, seed)?,
        fixtures: vec![
            fixture(shapes::pocket_block(jig, part), jig.pocket),
            fixture(shapes::hole_block(jig, part), jig.hole),
        ],
        landmarks: vec![
            landmark(pocket, jig.pocket, jig.pocket_floor_m),
            landmark(hole, jig.hole, jig.hole_top_m),
        ],
        table: TableSpec {
            rim: table.rim,
            rim_height_m: table.rim_height_m,
            friction: part.friction,
        },
        gripper: *gripper,
        arm: *arm,
        step_ms: *step_ms,
    })
}
