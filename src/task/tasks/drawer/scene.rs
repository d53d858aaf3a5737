//! The scene: a cabinet with a drawer, blocks on the table, and the grasps for both.

use std::f64::consts::{FRAC_PI_2, TAU};

use rand::RngExt;

use super::Drawer;
use crate::sim::Seed;
use crate::task::domain::Pose;
use crate::task::robot::vector::add;
use crate::task::robot::{BodyFrame, FINGER_TIP_M, Turn};
use crate::task::scene::{
    BodyKind, Fixture, Handling, Landmark, Look, Part, Piece, SceneSpec, Slider, Symmetry,
    TableSpec, cuboid,
};
use crate::task::skill::Grasp;

/// Index of the drawer in the scene. The blocks follow.
pub(super) const DRAWER: usize = 0;

/// Half the size of a block, in metres.
pub(super) const HALF_M: f64 = 0.016;
/// Half the sizes of the drawer's inside along its direction and across, and the height of its walls, in metres.
pub(super) const INSIDE_M: [f64; 3] = [0.053, 0.048, 0.038];
/// Thickness of the drawer's walls and floor, in metres.
const WALL_M: f64 = 0.006;
/// Height of the drawer's inner floor above the table, in metres.
const FLOOR_M: f64 = 0.010;
/// Thickness of the cabinet's walls, and the gap between drawer and cabinet, in metres.
const CABINET_M: (f64, f64) = (0.008, 0.003);
/// Height of the cabinet, in metres.
const HEIGHT_M: f64 = 0.062;
/// Distance of the handle from the drawer's front, half its thickness, and its top above the inner floor, in metres.
const HANDLE_M: [f64; 3] = [0.030, 0.007, 0.055];
/// Length of the handle that the pads cover, in metres.
const HELD_M: f64 = 0.012;
/// Coordinate of the open drawer and of its stop, in metres.
pub(super) const OPEN_M: f64 = 0.105;
const STOP_M: f64 = 0.110;

/// Area in which the blocks begin, as `[x, y]` corners, in metres.
const AREA: [[f64; 2]; 2] = [[0.38, 0.10], [0.56, 0.26]];

// Colours that colour-blind readers can tell apart (Okabe and Ito 2008).
const DRAWER_LOOK: Look = Look { colour: 0xe69f00, ink: 0x8a5f00, roughness: 0.5 };
const BLOCK_LOOK: Look = Look { colour: 0x56b4e9, ink: 0x00639c, roughness: 0.5 };
const CABINET_LOOK: Look = Look { colour: 0x6f7f8f, ink: 0x3c4652, roughness: 0.6 };

/// Returns the pieces of the drawer. The origin is in the middle of the inner floor; x points out of the cabinet.
fn drawer() -> Vec<Piece> {
    let [x, y, z] = INSIDE_M;
    let (half, mid) = (WALL_M / 2.0, z / 2.0);
    let [off, thick, top] = HANDLE_M;
    let front = x + WALL_M;
    let (low, high) = (0.010, top - 0.020);
    vec![
        cuboid([0.0, 0.0, -half], [front, y + WALL_M, half]),
        cuboid([x + half, 0.0, mid], [half, y + WALL_M, mid]),
        cuboid([-x - half, 0.0, mid], [half, y + WALL_M, mid]),
        cuboid([0.0, y + half, mid], [x, half, mid]),
        cuboid([0.0, -y - half, mid], [x, half, mid]),
        cuboid([front + off, 0.0, (low + top) / 2.0], [thick, thick, (top - low) / 2.0]),
        cuboid([front + off / 2.0, 0.0, (low + high) / 2.0 - 0.005], [off / 2.0, 0.006, 0.006]),
    ]
}

/// Returns the pieces of the cabinet in the frame of the closed drawer, with the origin on the table.
fn cabinet() -> Vec<Piece> {
    let (wall, gap) = CABINET_M;
    let [x, y, _] = INSIDE_M.map(|half| half + WALL_M + gap);
    let (half, up) = (wall / 2.0, HEIGHT_M / 2.0);
    let front = INSIDE_M[0] + WALL_M;
    let (middle, deep) = ((front - x - wall) / 2.0, (front + x + wall) / 2.0);
    vec![
        cuboid([middle, y + half, up], [deep, half, up]),
        cuboid([middle, -y - half, up], [deep, half, up]),
        cuboid([-x - half, 0.0, up], [half, y, up]),
        cuboid([middle, 0.0, HEIGHT_M - half], [deep, y, half]),
    ]
}

/// Draws a scene.
pub(super) fn spec(settings: &Drawer, seed: Seed) -> SceneSpec {
    let mut rng = seed.derive("drawer", "place").rng();
    let mut spread = |most: f64| most * (2.0 * rng.random::<f64>() - 1.0);
    let [x, y] = settings.cabinet.map(|v| v + spread(settings.spread_m));
    let turn = Turn::about_z(FRAC_PI_2 + spread(settings.spread_deg.to_radians()));
    let cabinet_frame = BodyFrame { position: [x, y, 0.0], turn };
    let slider = Slider {
        fixture: None,
        axis: [1.0, 0.0, 0.0],
        range_m: [0.0, STOP_M],
        friction_n: settings.guide_n,
    };
    let frame = BodyFrame { position: [x, y, FLOOR_M], turn };
    let mut parts = vec![Part { kind: DRAWER, frame, slider: Some(slider) }];
    let mut rng = seed.derive("drawer", "blocks").rng();
    for block in 0..settings.blocks {
        let [low, high] = AREA;
        // Each block begins in its own strip, so that they never touch.
        let strip = (high[0] - low[0]) / settings.blocks as f64;
        let left = low[0] + strip * block as f64;
        let (across, free) = (strip - 0.05 * (settings.blocks - 1) as f64, rng.random::<f64>());
        let position = [
            left + across * free,
            low[1] + (high[1] - low[1]) * rng.random::<f64>(),
            HALF_M + 0.004,
        ];
        let turn = Turn::about_z(TAU * rng.random::<f64>()) * Turn::about_x(0.03);
        parts.push(Part::free(1, BodyFrame { position, turn }));
    }
    let kind = |name: &str, pieces, fold, release_m, look| BodyKind {
        name: name.into(),
        pieces,
        density: 700.0,
        friction: settings.friction,
        handling: Handling {
            symmetry: Symmetry { turns: 24, fold, flips: false },
            rise_m: 0.07,
            release_m,
            in_the_way_m: HALF_M,
            fall_m: 0.0,
            clear_m: 0.0,
        },
        look,
    };
    let pose = Pose { position: [x, y, 0.0], orientation: orientation(&cabinet_frame) };
    SceneSpec {
        kinds: vec![
            kind("drawer", drawer(), 1, HANDLE_M[1] + 0.006, DRAWER_LOOK),
            kind("block", vec![cuboid([0.0; 3], [HALF_M; 3])], 4, HALF_M + 0.006, BLOCK_LOOK),
        ],
        parts,
        fixtures: vec![Fixture {
            frame: cabinet_frame,
            pieces: cabinet(),
            friction: settings.friction,
            look: CABINET_LOOK,
            movable: None,
        }],
        landmarks: vec![Landmark::fixed("cabinet", pose)],
        table: TableSpec { friction: settings.friction, ..TableSpec::default() },
        ..SceneSpec::default()
    }
}

/// Returns the orientation of a frame that is turned about z alone.
fn orientation(frame: &BodyFrame) -> [f64; 4] {
    let [x, y, _] = frame.turn.apply([1.0, 0.0, 0.0]);
    let half = y.atan2(x) / 2.0;
    [0.0, 0.0, half.sin(), half.cos()]
}

/// Returns the grasps for a part as it lies now: the drawer by its handle, a block by two opposing sides.
pub(super) fn grasps(frame: &BodyFrame, part: usize) -> Vec<Grasp> {
    if frame.turn.apply([0.0, 0.0, 1.0])[2] < 0.99 {
        return Vec::new();
    }
    let (within, half) = if part == DRAWER {
        let [off, thick, top] = HANDLE_M;
        ([INSIDE_M[0] + WALL_M + off, 0.0, top - HELD_M + FINGER_TIP_M], thick)
    } else {
        ([0.0, 0.0, FINGER_TIP_M - 0.008], HALF_M)
    };
    let at = add(frame.position, frame.turn.apply(within));
    let grasp = |quarter: u32| {
        let turn = frame.turn * Turn::about_z(f64::from(quarter) * FRAC_PI_2);
        let [x, y, _] = turn.apply([1.0, 0.0, 0.0]);
        Grasp { at, approach: [0.0, 0.0, -1.0], closing: [x, y, 0.0], opening_m: half + 0.008 }
    };
    (0..4).map(grasp).collect()
}
