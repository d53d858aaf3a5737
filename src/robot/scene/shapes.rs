//! Convex pieces of bodies, and the collision shapes that they make.

use rapier3d::geometry::{ColliderBuilder, SharedShape};
use rapier3d::math::{Pose as Frame, Vector};

/// A convex piece of a body: its corners in the body's frame, in metres.
pub type Piece = Vec<[f64; 3]>;

/// Returns the eight corners of a box, given its middle and half its sizes.
pub fn cuboid(middle: [f64; 3], half: [f64; 3]) -> Piece {
    let corner = |n: usize| {
        std::array::from_fn(|i| middle[i] + if n >> i & 1 == 0 { -half[i] } else { half[i] })
    };
    (0..8).map(corner).collect()
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
