//! Shapes of a task file as convex pieces.

use std::f64::consts::{PI, TAU};

use super::format::Shape;
use crate::robot::arm::vector::add;
use crate::robot::scene::{Piece, cuboid};

impl Shape {
    /// Returns the convex pieces.
    pub(super) fn pieces(&self) -> Vec<Piece> {
        match self {
            Self::Box { middle, size_m } => vec![cuboid(*middle, size_m.map(|v| v / 2.0))],
            Self::Prism { base, radius_m, top_radius_m, height_m, sides } => {
                let top = top_radius_m.unwrap_or(*radius_m);
                let rings = [(*radius_m, 0.0), (top, *height_m)];
                let corners = (0..*sides).flat_map(|side| {
                    rings.map(|(radius, z)| add(*base, corner(radius, side, *sides, z)))
                });
                vec![corners.collect()]
            }
            Self::Ring { base, inner_m, outer_m, height_m, chamfer_m, sides } => {
                let low = [(*inner_m, 0.0), (*outer_m, 0.0), (*outer_m, *height_m)];
                let edge = match *chamfer_m > 0.0 {
                    true => {
                        vec![(*inner_m, *height_m - *chamfer_m), (*inner_m + *chamfer_m, *height_m)]
                    }
                    false => vec![(*inner_m, *height_m)],
                };
                let wedge = |side: u32| {
                    let outline = low.iter().chain(&edge);
                    let both = outline.flat_map(|(radius, z)| {
                        [side, side + 1].map(|at| add(*base, corner(*radius, at, *sides, *z)))
                    });
                    both.collect()
                };
                (0..*sides).map(wedge).collect()
            }
            Self::Hull { points } => vec![points.clone()],
        }
    }
}

/// Returns the pieces of all shapes.
pub(super) fn pieces(shapes: &[Shape]) -> Vec<Piece> {
    shapes.iter().flat_map(Shape::pieces).collect()
}

/// Returns a corner of a prism whose sides are `radius` from its axis. Side 0 faces the x axis.
fn corner(radius: f64, side: u32, sides: u32, z: f64) -> [f64; 3] {
    let half = PI / f64::from(sides);
    let angle = TAU * f64::from(side) / f64::from(sides) - half;
    let far = radius / half.cos();
    [far * angle.cos(), far * angle.sin(), z]
}

#[cfg(test)]
#[path = "../../../../tests/unit/task_file_shape.rs"]
mod tests;
