//! The scene: a cup, a cube, and the grasps for both.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, PI, TAU};

use rand::{Rng, RngExt};

use super::Cup;
use crate::sim::Seed;
use crate::task::robot::vector::{add, cross, scale};
use crate::task::robot::{BodyFrame, FINGER_TIP_M, Turn};
use crate::task::scene::{
    BodyKind, Handling, Look, Part, Piece, SceneSpec, Symmetry, TableSpec, cuboid,
};
use crate::task::skill::Grasp;

/// Indices of the parts in the scene, and of their kinds.
pub(super) const CUP: usize = 0;
pub(super) const CUBE: usize = 1;

/// Height of the cup, in metres. The hand takes it from the side both before and after turning it over: the middle of
/// the cup must be so high that the wrist clears the table.
pub(super) const HEIGHT_M: f64 = 0.110;
/// Distance of the cup's outer flats from its axis, in metres.
const RADIUS_M: f64 = 0.032;
/// Distance of the cup's inner flats from its axis, in metres.
pub(super) const INNER_M: f64 = 0.0285;
/// Thickness of the cup's floor, in metres.
pub(super) const FLOOR_M: f64 = 0.006;
/// Number of flats.
const FLATS: u32 = 12;
/// Half the size of the cube, in metres.
pub(super) const HALF_M: f64 = 0.009;
/// Height of the table's rim, in metres: low, because the wrist passes close above it.
const RIM_M: f64 = 0.005;
/// Distance that the arm keeps from the cup and the table on its way, in metres. A touch would push the cup over.
const CLEAR_M: f64 = 0.006;
/// Least distance between the areas of cup and cube, in metres.
pub(super) const APART_M: f64 = 0.09;

// Colours that colour-blind readers can tell apart (Okabe and Ito 2008).
const CUP_LOOK: Look = Look { colour: 0x56b4e9, ink: 0x00639c, roughness: 0.3 };
const CUBE_LOOK: Look = Look { colour: 0xe69f00, ink: 0x8a5f00, roughness: 0.6 };

/// Returns the pieces of the cup: a ring of wedges and the floor. The origin is in the middle of its height; z points
/// to the opening.
fn cup() -> Vec<Piece> {
    let corner = |flat: f64, k: u32, z: f64| {
        let angle = (f64::from(k) - 0.5) * TAU / f64::from(FLATS);
        let radius = flat / (PI / f64::from(FLATS)).cos();
        [radius * angle.cos(), radius * angle.sin(), z]
    };
    let half = HEIGHT_M / 2.0;
    let wall = |k: u32| -> Piece {
        let ends = [k, k + 1].into_iter();
        let column = |k| {
            let at = move |flat| [-half, half].map(|z| corner(flat, k, z));
            [at(RADIUS_M), at(INNER_M)].concat()
        };
        ends.flat_map(column).collect()
    };
    let floor = |k: u32| [-half, FLOOR_M - half].map(|z| corner(INNER_M + 1e-3, k, z));
    (0..FLATS).map(wall).chain([(0..FLATS).flat_map(floor).collect()]).collect()
}

/// Draws a place in an area.
pub(super) fn draw([low, high]: [[f64; 2]; 2], rng: &mut impl Rng) -> [f64; 2] {
    std::array::from_fn(|i| low[i] + (high[i] - low[i]) * rng.random::<f64>())
}

/// Draws a scene.
pub(super) fn spec(settings: &Cup, seed: Seed) -> SceneSpec {
    let mut rng = seed.derive("cup", "place").rng();
    let mut part = |kind: usize, area, z: f64, lying: Turn| {
        let [x, y] = draw(area, &mut rng);
        let turn = Turn::about_z(TAU * rng.random::<f64>()) * lying;
        Part::free(kind, BodyFrame { position: [x, y, z], turn })
    };
    let parts = vec![
        part(CUP, settings.area, HEIGHT_M / 2.0 + 1e-3, Turn::about_x(PI)),
        part(CUBE, settings.cube_area, HALF_M + 3e-3, Turn::about_x(0.03)),
    ];
    let kind = |name: &str, pieces, density, handling, look| BodyKind {
        name: name.into(),
        pieces,
        density,
        friction: settings.friction,
        handling,
        look,
    };
    let handling = |fold, release_m, fall_m| Handling {
        symmetry: Symmetry { turns: 24, fold, flips: false },
        rise_m: 0.06,
        release_m,
        in_the_way_m: 0.02,
        fall_m,
        clear_m: CLEAR_M,
    };
    SceneSpec {
        kinds: vec![
            kind("cup", cup(), 900.0, handling(FLATS, RADIUS_M + 0.007, 0.0), CUP_LOOK),
            kind(
                "cube",
                vec![cuboid([0.0; 3], [HALF_M; 3])],
                700.0,
                // The hand does not fit into the cup: it lets the cube fall.
                handling(4, HALF_M + 0.006, HEIGHT_M),
                CUBE_LOOK,
            ),
        ],
        parts,
        table: TableSpec {
            friction: settings.friction,
            rim_height_m: RIM_M,
            ..TableSpec::default()
        },
        ..SceneSpec::default()
    }
}

/// Returns the grasps for a standing cup, from the side; no grasps if it lies. The hand closes on two opposing flats.
/// Grasps in which the hand points away from the arm's base come first.
pub(super) fn cup_grasps(frame: &BodyFrame) -> Vec<Grasp> {
    let axis = frame.turn.apply([0.0, 0.0, 1.0]);
    if axis[2].abs() < 0.99 {
        return Vec::new();
    }
    let [x, y, _] = frame.position;
    let out = scale([x, y, 0.0], 1.0 / x.hypot(y));
    let mut all: Vec<(f64, Grasp)> = Vec::new();
    for k in 0..FLATS {
        let turn = frame.turn * Turn::about_z(f64::from(k) * FRAC_PI_6);
        let closing = turn.apply([1.0, 0.0, 0.0]);
        let approach = cross(axis, closing);
        let along = approach.iter().zip(out).map(|(a, b)| a * b).sum::<f64>();
        if along < -0.3 {
            continue;
        }
        let at = frame.position;
        all.push((along, Grasp { at, approach, closing, opening_m: RADIUS_M + 0.007 }));
        // The other way round, with the fingers exchanged.
        let closing = scale(closing, -1.0);
        all.push((along, Grasp { at, approach, closing, opening_m: RADIUS_M + 0.007 }));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().map(|(_, grasp)| grasp).collect()
}

/// Returns the grasps for a cube from above, on two opposing sides.
pub(super) fn cube_grasps(frame: &BodyFrame) -> Vec<Grasp> {
    // A cube that fell may lie on any of its sides.
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|a| frame.turn.apply(a));
    let Some(up) = axes.iter().position(|axis| axis[2].abs() > 0.99) else { return Vec::new() };
    let [side, _] = [(up + 1) % 3, (up + 2) % 3];
    let bearing = axes[side][1].atan2(axes[side][0]);
    let at = add(frame.position, [0.0, 0.0, FINGER_TIP_M - 0.006]);
    let grasp = |quarter: u32| {
        let (sin, cos) = (bearing + f64::from(quarter) * FRAC_PI_2).sin_cos();
        Grasp {
            at,
            approach: [0.0, 0.0, -1.0],
            closing: [cos, sin, 0.0],
            opening_m: HALF_M + 0.008,
        }
    };
    (0..4).map(grasp).collect()
}
