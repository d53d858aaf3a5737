//! Collision shapes built from convex pieces.

use rapier3d::geometry::{ColliderBuilder, SharedShape};
use rapier3d::math::{Pose as Frame, Vector};

use super::spec::{Fixture, Piece, TableSpec};

/// Returns the table and its rim.
pub(crate) fn table(spec: &TableSpec) -> Vec<(Frame, SharedShape)> {
    let [low, high] = spec.rim;
    let middle = |i: usize| (low[i] + high[i]) / 2.0;
    let half = |i: usize| (high[i] - low[i]) / 2.0;
    let (thick, wall, height) = (0.02, 0.006, spec.rim_height_m / 2.0);
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
    table
}

/// Returns a fixture's shapes with their frames in the scene.
pub(crate) fn fixture(spec: &Fixture) -> impl Iterator<Item = (Frame, SharedShape)> {
    let at = spec.frame.frame();
    hulls(&spec.pieces).into_iter().map(move |shape| (at, shape))
}

/// Returns whether the physics can use a piece: its corners are finite and enclose a volume.
pub(crate) fn has_volume(piece: &Piece) -> bool {
    let finite = piece.iter().flatten().all(|v| v.is_finite());
    finite && piece.len() > 3 && hull(piece).is_some_and(|h| h.mass_properties(1.0).mass() > 1e-12)
}

/// Returns the convex hull of a piece; `None` if it has no volume.
fn hull(piece: &Piece) -> Option<SharedShape> {
    let corners: Vec<Vector> = piece.iter().map(|corner| Vector::from(*corner)).collect();
    SharedShape::convex_hull(&corners)
}

/// Returns the convex hulls of the pieces. Pieces without volume are left out.
pub(crate) fn hulls(pieces: &[Piece]) -> Vec<SharedShape> {
    pieces.iter().filter_map(hull).collect()
}

/// Returns one collider for several convex pieces.
pub(crate) fn compound(pieces: &[Piece]) -> ColliderBuilder {
    ColliderBuilder::compound(
        hulls(pieces).into_iter().map(|shape| (Frame::IDENTITY, shape)).collect(),
    )
}
