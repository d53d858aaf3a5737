//! Convex pieces of parts, jig and table, and the colliders made of them.

use std::f64::consts::{FRAC_PI_3, FRAC_PI_6, TAU};

use rapier3d::geometry::{ColliderBuilder, SharedShape};
use rapier3d::math::{Pose as Frame, Vector};

use super::config::{JigSpec, PartSpec, SceneSpec};

/// One convex piece: its corners, in the frame of the thing that it is a piece of.
pub(crate) type Piece = Vec<Vector>;

fn around(radius: f64, angle: f64, z: f64) -> Vector {
    Vector::new(radius * angle.cos(), radius * angle.sin(), z)
}

/// The six wedges of a nut about its centre, flats at 0, 60, ... degrees about z.
pub(crate) fn nut(part: &PartSpec) -> Vec<Piece> {
    let half = part.nut_height_m / 2.0;
    let outer = part.across_flats_m / 2.0 / FRAC_PI_6.cos();
    // The hole is a hexagon whose flats touch the circle.
    let inner = part.nut_hole_m / FRAC_PI_6.cos();
    (0..6)
        .map(|side| {
            let (from, to) = (side_angle(side), side_angle(side + 1));
            let mut piece = Piece::new();
            for z in [-half, half] {
                for angle in [from, to] {
                    piece.push(around(inner, angle, z));
                    piece.push(around(outer, angle, z));
                }
            }
            piece
        })
        .collect()
}

fn side_angle(side: u32) -> f64 {
    f64::from(side) * FRAC_PI_3 - FRAC_PI_6
}

/// Head and shaft of a bolt. The origin is where the axis passes the head's underside; the shaft
/// points down.
pub(crate) fn bolt(part: &PartSpec) -> Vec<Piece> {
    let corner = part.across_flats_m / 2.0 / FRAC_PI_6.cos();
    let head = (0..6)
        .flat_map(|side| [0.0, part.head_height_m].map(|z| around(corner, side_angle(side), z)))
        .collect();
    let (radius, tip) = (part.shaft_radius_m, part.tip_chamfer_m);
    let length = part.shaft_length_m;
    let sides = 24u32;
    let shaft = (0..sides)
        .flat_map(|side| {
            let angle = f64::from(side) / f64::from(sides) * TAU;
            [(radius, 0.0), (radius, tip - length), (radius - tip, -length)]
                .map(|(r, z)| around(r, angle, z))
        })
        .collect();
    vec![head, shaft]
}

/// A ring of wedges with a chamfer at its upper inner edge.
fn ring(sides: u32, inner: f64, outer: f64, [low, high]: [f64; 2], chamfer: f64) -> Vec<Piece> {
    // Flats touch the inner circle; corners reach the outer one.
    let inner_by = 1.0 / (TAU / f64::from(2 * sides)).cos();
    (0..sides)
        .map(|side| {
            let mut piece = Piece::new();
            for at in [side, side + 1] {
                let angle = f64::from(at) / f64::from(sides) * TAU;
                piece.push(around(inner * inner_by, angle, low));
                piece.push(around(outer, angle, low));
                piece.push(around(outer, angle, high));
                if chamfer > 0.0 {
                    piece.push(around(inner * inner_by, angle, high - chamfer));
                    piece.push(around((inner + chamfer) * inner_by, angle, high));
                } else {
                    piece.push(around(inner * inner_by, angle, high));
                }
            }
            piece
        })
        .collect()
}

/// The block with the nut's pocket, about the point on the table below its middle.
pub(crate) fn pocket_block(jig: &JigSpec, part: &PartSpec) -> Vec<Piece> {
    let corner = part.across_flats_m / 2.0 / FRAC_PI_6.cos();
    let inner = corner + jig.pocket_clearance_m;
    let outer = inner + jig.wall_m;
    let shaft = part.shaft_radius_m + 3e-3;
    let mut pieces = ring(6, shaft, outer, [0.0, jig.pocket_floor_m], 0.0);
    let top = jig.pocket_floor_m + jig.pocket_depth_m;
    pieces.extend(ring(12, inner, outer, [jig.pocket_floor_m, top], jig.chamfer_m));
    pieces
}

/// The block with the bolt's hole, likewise.
pub(crate) fn hole_block(jig: &JigSpec, part: &PartSpec) -> Vec<Piece> {
    let inner = part.shaft_radius_m + jig.hole_clearance_m;
    let outer = inner + jig.chamfer_m + jig.wall_m;
    let neck = jig.hole_top_m - NECK_M;
    // Wider below, where nothing has to be guided: what does not touch costs nothing.
    let mut pieces = ring(6, inner + jig.chamfer_m, outer, [0.0, neck], 0.0);
    pieces.extend(ring(12, inner, neck_radius(part), [neck, jig.hole_top_m], jig.chamfer_m));
    pieces
}

/// The upper part of the hole's block is so narrow that pads can reach past it below a head.
const NECK_M: f64 = 0.015;

/// The outer radius of that part.
pub(crate) fn neck_radius(part: &PartSpec) -> f64 {
    part.across_flats_m / 2.0 - 7e-4
}

/// What does not move: table with rim, and jig.
pub(crate) fn furniture(spec: &SceneSpec) -> [Vec<(Frame, SharedShape)>; 2] {
    let [low, high] = spec.table.rim;
    let middle = |i: usize| (low[i] + high[i]) / 2.0;
    let half = |i: usize| (high[i] - low[i]) / 2.0;
    let (thick, wall, height) = (0.02, 0.006, spec.table.rim_height_m / 2.0);
    let block = |at: Vector, [x, y, z]: [f64; 3]| {
        (Frame::from_translation(at), SharedShape::cuboid(x, y, z))
    };
    let (x, y) = (middle(0), middle(1));
    let mut table = vec![block(Vector::new(x, y, -thick), [half(0) + 0.02, half(1) + 0.02, thick])];
    for side in [-1.0, 1.0] {
        let at = Vector::new(x, y + side * (half(1) + wall), height);
        table.push(block(at, [half(0) + 2.0 * wall, wall, height]));
        let at = Vector::new(x + side * (half(0) + wall), y, height);
        table.push(block(at, [wall, half(1) + 2.0 * wall, height]));
    }
    let jig = &spec.jig;
    let blocks =
        [(pocket_block(jig, &spec.part), jig.pocket), (hole_block(jig, &spec.part), jig.hole)];
    let jig = blocks.into_iter().flat_map(|(pieces, [x, y])| {
        let at = Frame::from_translation(Vector::new(x, y, 0.0));
        hulls(&pieces).into_iter().map(move |shape| (at, shape))
    });
    [table, jig.collect()]
}

/// The convex hulls of pieces; a piece without volume is left out.
pub(crate) fn hulls(pieces: &[Piece]) -> Vec<SharedShape> {
    pieces.iter().filter_map(|piece| SharedShape::convex_hull(piece)).collect()
}

/// One collider of several convex pieces.
pub(crate) fn compound(pieces: &[Piece]) -> ColliderBuilder {
    ColliderBuilder::compound(
        hulls(pieces).into_iter().map(|shape| (Frame::IDENTITY, shape)).collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_is_convex_and_has_volume() {
        let (part, jig) = (PartSpec::default(), JigSpec::default());
        let all = [nut(&part), bolt(&part), pocket_block(&jig, &part), hole_block(&jig, &part)];
        let counts: Vec<usize> = all.iter().map(|p| hulls(p).len()).collect();
        assert_eq!(counts, [6, 2, 18, 18]);
    }

    #[test]
    fn the_nut_weighs_what_a_hexagon_with_a_hexagonal_hole_weighs() {
        let part = PartSpec::default();
        let hexagon = |across: f64| 3f64.sqrt() / 2.0 * across * across;
        let area = hexagon(part.across_flats_m) - hexagon(2.0 * part.nut_hole_m);
        let mass = compound(&nut(&part)).density(part.density).build().mass();
        let expected = area * part.nut_height_m * part.density;
        assert!((mass - expected).abs() < 1e-6 * expected, "{mass} {expected}");
    }
}
