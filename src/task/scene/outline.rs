//! The shapes that the physics works with, as triangles: for pictures.

use rapier3d::geometry::{SharedShape, TypedShape};
use rapier3d::math::{Pose as Frame, Vector};
use serde::Serialize;

use super::shapes;
use super::spec::{Look, Piece, SceneSpec};
use crate::task::domain::Pose;
use crate::task::robot::arm::{self, JOINTS};
use crate::task::robot::bodies;
use crate::task::robot::frame::pose_of;

/// What moves as one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Body {
    /// The table with its rim; it stays where it is.
    Table,
    /// A fixture, by its place in the scene; it stays where it is, too.
    Fixture(usize),
    /// A kind of part, by its place in the scene.
    Kind(usize),
    /// The link that moves with a joint, counted from 0; the last carries the hand.
    Link(usize),
    /// The finger that opens along [`Outline::closing`], 0, or against it, 1; where it is when closed, in the frame
    /// of the last link.
    Finger(usize),
}

/// The surface of a body in its own frame, in metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mesh {
    /// Whose surface.
    pub body: Body,
    /// Corners.
    pub vertices: Vec<[f32; 3]>,
    /// Places of three corners each, counted from 0, anticlockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A kind of part: what it is called and how it looks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KindOutline {
    /// What the recorder calls it.
    pub name: String,
    /// How it looks.
    pub look: Look,
}

/// Everything there is to be seen of a scene, without where the parts are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outline {
    /// One mesh a body; parts of one kind share theirs.
    pub meshes: Vec<Mesh>,
    /// The kinds of parts.
    pub kinds: Vec<KindOutline>,
    /// The kind of each part, by its place in `kinds`.
    pub parts: Vec<usize>,
    /// How each fixture looks.
    pub fixtures: Vec<Look>,
    /// For each joint the fixed part of its frame in the frame before it; it turns about its own z.
    pub joints: [Pose; JOINTS],
    /// The direction in which the first finger opens, in the last link's frame.
    pub closing: [f64; 3],
}

impl Outline {
    /// The shapes of a scene. Costs about a millisecond.
    pub fn of(spec: &SceneSpec) -> Self {
        let hulls = |pieces: &[Piece]| {
            let all = shapes::hulls(pieces).into_iter();
            all.map(|shape| (Frame::IDENTITY, shape)).collect::<Vec<_>>()
        };
        let mut surfaces = vec![(Body::Table, shapes::table(&spec.table))];
        let fixtures = spec.fixtures.iter().enumerate();
        surfaces.extend(fixtures.map(|(i, f)| (Body::Fixture(i), shapes::fixture(f).collect())));
        let kinds = spec.kinds.iter().enumerate();
        surfaces.extend(kinds.map(|(i, kind)| (Body::Kind(i), hulls(&kind.pieces))));
        surfaces.extend((0..JOINTS).map(|joint| (Body::Link(joint), bodies::link_shapes(joint))));
        for (finger, side) in [1.0, -1.0].into_iter().enumerate() {
            surfaces.push((Body::Finger(finger), vec![bodies::closed_finger(side)]));
        }
        let closing = arm::hand_offset().rotation * Vector::Y;
        Self {
            meshes: surfaces.into_iter().map(|(body, shapes)| mesh(body, &shapes)).collect(),
            kinds: (spec.kinds.iter())
                .map(|kind| KindOutline { name: kind.name.clone(), look: kind.look })
                .collect(),
            parts: spec.parts.iter().map(|part| part.kind).collect(),
            fixtures: spec.fixtures.iter().map(|fixture| fixture.look).collect(),
            joints: std::array::from_fn(|joint| pose_of(&arm::offset(joint))),
            closing: [closing.x, closing.y, closing.z],
        }
    }
}

/// Sides of what is round.
const ROUND: u32 = 20;

fn mesh(body: Body, shapes: &[(Frame, SharedShape)]) -> Mesh {
    let mut mesh = Mesh { body, vertices: Vec::new(), triangles: Vec::new() };
    for (at, shape) in shapes {
        let (vertices, triangles) = match shape.as_typed_shape() {
            TypedShape::Cuboid(cuboid) => cuboid.to_trimesh(),
            TypedShape::Capsule(capsule) => capsule.to_trimesh(ROUND, ROUND / 2),
            TypedShape::ConvexPolyhedron(hull) => hull.to_trimesh(),
            // There are no others.
            _ => continue,
        };
        let from = mesh.vertices.len() as u32;
        mesh.vertices.extend(vertices.iter().map(|v| {
            let v = at.translation + at.rotation * *v;
            [v.x as f32, v.y as f32, v.z as f32]
        }));
        mesh.triangles.extend(triangles.iter().map(|t| t.map(|corner| corner + from)));
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::robot::BodyFrame;
    use crate::task::scene::{BodyKind, Fixture, Handling, Part, Symmetry, cuboid};

    /// Volume inside a closed surface, by the divergence theorem.
    fn volume(mesh: &Mesh) -> f64 {
        let at = |corner: u32| Vector::from(mesh.vertices[corner as usize].map(f64::from));
        let of = |t: &[u32; 3]| at(t[0]).dot(at(t[1]).cross(at(t[2]))) / 6.0;
        mesh.triangles.iter().map(of).sum()
    }

    #[test]
    fn every_body_has_a_closed_surface_that_faces_outwards() {
        let look = Look { colour: 0x0072b2, ink: 0x0072b2, roughness: 0.5 };
        let pieces = vec![cuboid([0.0, 0.0, 0.1], [0.01, 0.02, 0.03])];
        let handling = Handling {
            symmetry: Symmetry { turns: 4, flips: true },
            rise_m: 0.05,
            release_m: 0.02,
            in_the_way_m: 0.02,
        };
        let spec = SceneSpec {
            kinds: vec![BodyKind {
                name: "block".into(),
                pieces: pieces.clone(),
                density: 500.0,
                friction: 0.5,
                handling,
                look,
            }],
            parts: vec![Part { kind: 0, frame: BodyFrame::at([0.5, 0.0, 0.1]) }; 2],
            fixtures: vec![Fixture {
                frame: BodyFrame::at([0.4, 0.0, 0.0]),
                pieces,
                friction: 0.5,
                look,
            }],
            ..SceneSpec::default()
        };
        assert!(spec.check().is_ok());
        let outline = Outline::of(&spec);
        assert_eq!(outline.meshes.len(), 3 + JOINTS + 2);
        for mesh in &outline.meshes {
            assert!(!mesh.triangles.is_empty() && volume(mesh) > 1e-6, "{:?}", mesh.body);
        }
        for mesh in &outline.meshes[1..3] {
            assert!((volume(mesh) - 4.8e-5).abs() < 1e-9, "{:?}", mesh.body);
        }
        assert_eq!((outline.parts, outline.kinds.len()), (vec![0, 0], 1));
    }
}
