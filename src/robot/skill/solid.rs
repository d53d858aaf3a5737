//! The solid shape of a part: the faces of its convex pieces, lines through them, and the faces on which the part can
//! rest.

use rapier3d::geometry::{ConvexPolyhedron, SharedShape};
use rapier3d::math::Vector;

use crate::robot::scene::Sensed;

/// A flat face of a convex piece. Positions are in the part's frame, in metres.
#[derive(Debug, Clone)]
pub(super) struct Face {
    /// Direction out of the piece.
    pub normal: Vector,
    /// Corners, in order around the face.
    pub corners: Vec<Vector>,
    /// Mean of the corners.
    pub middle: Vector,
}

/// A convex piece.
#[derive(Debug, Clone)]
pub(super) struct Convex {
    pub faces: Vec<Face>,
}

/// The shape of a part, in the part's frame.
#[derive(Debug, Clone)]
pub(super) struct Solid {
    pub pieces: Vec<Convex>,
    /// Corners of all pieces.
    pub corners: Vec<Vector>,
    /// Centre of mass.
    pub middle: Vector,
}

/// A stretch of a line that lies inside the part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    /// Distances along the line at which the stretch begins and ends, in metres.
    pub from: f64,
    pub to: f64,
    /// Direction out of the part at the end of the stretch.
    pub out: Vector,
}

/// Gaps shorter than this within a part are ignored, in metres.
const GAP_M: f64 = 3e-4;

impl Convex {
    fn of(shape: &ConvexPolyhedron) -> Self {
        let points = shape.points();
        let corners = |first: u32, count: u32| -> Vec<Vector> {
            let own = &shape.vertices_adj_to_face()[first as usize..(first + count) as usize];
            own.iter().map(|index| points[*index as usize]).collect()
        };
        let faces = shape.faces().iter().map(|face| {
            let corners = corners(face.first_vertex_or_edge, face.num_vertices_or_edges);
            let middle = corners.iter().copied().sum::<Vector>() / corners.len().max(1) as f64;
            Face { normal: face.normal, corners, middle }
        });
        Self { faces: faces.collect() }
    }

    /// Returns the stretch of the line from `at` along `way` inside this piece.
    fn run(&self, at: Vector, way: Vector) -> Option<Run> {
        let mut run = Run { from: f64::NEG_INFINITY, to: f64::INFINITY, out: way };
        for face in &self.faces {
            let (depth, steep) = ((face.middle - at).dot(face.normal), way.dot(face.normal));
            if steep.abs() < 1e-9 {
                if depth < 0.0 {
                    return None;
                }
            } else if steep > 0.0 {
                if depth / steep < run.to {
                    (run.to, run.out) = (depth / steep, face.normal);
                }
            } else {
                run.from = run.from.max(depth / steep);
            }
        }
        (run.to - run.from > 1e-6).then_some(run)
    }
}

impl Solid {
    /// Returns the shape of a part of the scene; `None` if it has none.
    pub fn of(scene: &Sensed<'_>, part: usize) -> Option<Self> {
        let pieces = scene.pieces(part);
        let corners: Vec<Vector> = pieces.iter().flat_map(|p| p.points()).copied().collect();
        let pieces: Vec<Convex> = pieces.into_iter().map(Convex::of).collect();
        let middle = scene.mass(part).0;
        (!pieces.is_empty()).then_some(Self { pieces, corners, middle })
    }

    /// Returns the stretches of the line from `at` along `way` inside the part, in order. Touching stretches are
    /// joined.
    pub fn runs(&self, at: Vector, way: Vector) -> Vec<Run> {
        let mut all: Vec<Run> = self.pieces.iter().filter_map(|piece| piece.run(at, way)).collect();
        all.sort_by(|a, b| a.from.total_cmp(&b.from));
        let mut joined: Vec<Run> = Vec::new();
        for run in all {
            match joined.last_mut() {
                Some(last) if run.from <= last.to + GAP_M => {
                    if run.to > last.to {
                        (last.to, last.out) = (run.to, run.out);
                    }
                }
                _ => joined.push(run),
            }
        }
        joined
    }

    /// Returns whether a point is inside the part.
    pub fn contains(&self, point: Vector) -> bool {
        self.pieces.iter().any(|piece| {
            piece.faces.iter().all(|face| (point - face.middle).dot(face.normal) <= 0.0)
        })
    }

    /// Returns the faces of the hull of the whole part.
    pub fn hull(&self) -> Vec<Face> {
        let hull = SharedShape::convex_hull(&self.corners);
        let hull = hull.as_ref().and_then(|hull| hull.as_convex_polyhedron());
        hull.map_or_else(Vec::new, |hull| Convex::of(hull).faces)
    }
}
