//! Convex pieces of nuts, bolts and the jig.

use std::f64::consts::{FRAC_PI_3, FRAC_PI_6, TAU};

use super::settings::{JigSpec, PartSpec};
use crate::robot::scene::Piece;

fn around(radius: f64, angle: f64, z: f64) -> [f64; 3] {
    [radius * angle.cos(), radius * angle.sin(), z]
}

/// Returns the six wedges of a nut about its centre, with flats at 0, 60, ... degrees about z.
pub(super) fn nut(part: &PartSpec) -> Vec<Piece> {
    let half = part.nut_height_m / 2.0;
    let outer = part.across_flats_m / 2.0 / FRAC_PI_6.cos();
    // The opening is a hexagon whose flats touch the circle.
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

/// Returns head and shaft of a bolt. The origin is on the axis, at the underside of the head; the shaft
/// points down.
pub(super) fn bolt(part: &PartSpec) -> Vec<Piece> {
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

/// Returns a ring of wedges with a chamfer at its upper inner edge.
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

/// Returns the block with the nut's pocket. The origin is on the table, below the middle of the pocket.
pub(super) fn pocket_block(jig: &JigSpec, part: &PartSpec) -> Vec<Piece> {
    let corner = part.across_flats_m / 2.0 / FRAC_PI_6.cos();
    let inner = corner + jig.pocket_clearance_m;
    let outer = inner + jig.wall_m;
    let shaft = part.shaft_radius_m + 3e-3;
    let mut pieces = ring(6, shaft, outer, [0.0, jig.pocket_floor_m], 0.0);
    let top = jig.pocket_floor_m + jig.pocket_depth_m;
    pieces.extend(ring(12, inner, outer, [jig.pocket_floor_m, top], jig.chamfer_m));
    pieces
}

/// Returns the block with the bolt's hole. The origin is on the table, below the middle of the hole.
pub(super) fn hole_block(jig: &JigSpec, part: &PartSpec) -> Vec<Piece> {
    let inner = part.shaft_radius_m + jig.hole_clearance_m;
    let outer = inner + jig.chamfer_m + jig.wall_m;
    let neck = jig.hole_top_m - NECK_M;
    // Wider below, where nothing is guided: bodies that do not touch cost nothing.
    let mut pieces = ring(6, inner + jig.chamfer_m, outer, [0.0, neck], 0.0);
    pieces.extend(ring(12, inner, neck_radius(part), [neck, jig.hole_top_m], jig.chamfer_m));
    pieces
}

/// Height of the neck, the upper part of the hole's block, in metres. The neck is so narrow that the pads can
/// reach past it below a head.
const NECK_M: f64 = 0.015;

/// Returns the outer radius of the neck, in metres.
pub(super) fn neck_radius(part: &PartSpec) -> f64 {
    part.across_flats_m / 2.0 - 7e-4
}

#[cfg(test)]
#[path = "../../../../tests/unit/nuts_and_bolts_shapes.rs"]
mod tests;
