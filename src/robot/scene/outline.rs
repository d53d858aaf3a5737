//! The shapes of a scene as triangles, for pictures. They are the shapes that the physics uses.

use rapier3d::geometry::{SharedShape, TypedShape};
use rapier3d::math::{Pose as Frame, Vector};
use serde::Serialize;

use super::shapes;
use super::spec::{Fixture, Look, Piece, SceneSpec};
use crate::robot::Pose;
use crate::robot::arm::bodies;
use crate::robot::arm::frame::pose_of;
use crate::robot::arm::kinematics::{self, JOINTS};

/// A body that moves as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Body {
    /// The table with its rim. It does not move.
    Table,
    /// A fixture that never moves, by its index in [`Outline::fixtures`].
    Fixture(usize),
    /// A kind of part, by its index in [`Outline::kinds`]. Movable fixtures have kinds too.
    Kind(usize),
    /// The link that moves with a joint, counted from 0. The last link includes the hand.
    Link(usize),
    /// A finger. Finger 0 opens along [`Outline::closing`], finger 1 in the opposite direction. The mesh shows the
    /// closed finger, in the last link's frame.
    Finger(usize),
}

/// The surface of a body in its own frame, in metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mesh {
    /// The body.
    pub body: Body,
    /// Corners of the triangles.
    pub vertices: Vec<[f32; 3]>,
    /// The three corners of each triangle, by their index in `vertices`, anticlockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A kind of part: its name and its look.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KindOutline {
    /// Name of the kind in recordings.
    pub name: String,
    /// Colours and roughness.
    pub look: Look,
}

/// Everything visible in a scene, except the poses of the parts. Movable fixtures are shown as parts: they come after
/// the scene's parts, each with a kind of its own.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outline {
    /// One mesh for each body. Parts of one kind share a mesh.
    pub meshes: Vec<Mesh>,
    /// The kinds of parts.
    pub kinds: Vec<KindOutline>,
    /// Kind of each part, by its index in `kinds`.
    pub parts: Vec<usize>,
    /// Look of each fixture that never moves.
    pub fixtures: Vec<Look>,
    /// Fixed part of each joint's frame, in the frame of the joint before it. The joint turns about its own z
    /// axis.
    pub joints: [Pose; JOINTS],
    /// Direction in which the first finger opens, in the last link's frame.
    pub closing: [f64; 3],
}

impl Outline {
    /// Returns the shapes of a scene. Costs about a millisecond.
    pub fn of(spec: &SceneSpec) -> Self {
        let hulls = |pieces: &[Piece]| {
            let all = shapes::hulls(pieces).into_iter();
            all.map(|shape| (Frame::IDENTITY, shape)).collect::<Vec<_>>()
        };
        let mut surfaces = vec![(Body::Table, shapes::table(&spec.table))];
        let (movable, still): (Vec<&Fixture>, Vec<_>) =
            spec.fixtures.iter().partition(|f| f.movable.is_some());
        let fixtures = still.iter().enumerate();
        surfaces.extend(fixtures.map(|(i, f)| (Body::Fixture(i), shapes::fixture(f).collect())));
        let pieces = spec.kinds.iter().map(|kind| &kind.pieces);
        let pieces = pieces.chain(movable.iter().map(|fixture| &fixture.pieces));
        surfaces.extend(pieces.enumerate().map(|(i, pieces)| (Body::Kind(i), hulls(pieces))));
        surfaces.extend((0..JOINTS).map(|joint| (Body::Link(joint), bodies::link_shapes(joint))));
        for (finger, side) in [1.0, -1.0].into_iter().enumerate() {
            surfaces.push((Body::Finger(finger), vec![bodies::closed_finger(side)]));
        }
        let closing = kinematics::hand_offset().rotation * Vector::Y;
        Self {
            meshes: surfaces.into_iter().map(|(body, shapes)| mesh(body, &shapes)).collect(),
            kinds: (spec.kinds.iter())
                .map(|kind| KindOutline { name: kind.name.clone(), look: kind.look })
                .chain(movable.iter().map(|fixture| KindOutline {
                    name: fixture.movable.clone().unwrap_or_default(),
                    look: fixture.look,
                }))
                .collect(),
            parts: (spec.parts.iter().map(|part| part.kind))
                .chain(spec.kinds.len()..spec.kinds.len() + movable.len())
                .collect(),
            fixtures: still.iter().map(|fixture| fixture.look).collect(),
            joints: std::array::from_fn(|joint| pose_of(&kinematics::offset(joint))),
            closing: [closing.x, closing.y, closing.z],
        }
    }
}

/// Number of sides that approximate a circle.
const ROUND: u32 = 20;

fn mesh(body: Body, shapes: &[(Frame, SharedShape)]) -> Mesh {
    let mut mesh = Mesh { body, vertices: Vec::new(), triangles: Vec::new() };
    for (at, shape) in shapes {
        let (vertices, triangles) = match shape.as_typed_shape() {
            TypedShape::Cuboid(cuboid) => cuboid.to_trimesh(),
            TypedShape::Capsule(capsule) => capsule.to_trimesh(ROUND, ROUND / 2),
            TypedShape::ConvexPolyhedron(hull) => hull.to_trimesh(),
            // No other shapes are built.
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
    use crate::robot::arm::BodyFrame;
    use crate::robot::scene::{BodyKind, Handling, Part, Symmetry, cuboid};

    /// Returns the volume inside a closed surface, by the divergence theorem.
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
            symmetry: Symmetry { turns: 4, fold: 4, flips: true },
            rise_m: 0.05,
            release_m: 0.02,
            in_the_way_m: 0.02,
            fall_m: 0.0,
            clear_m: 0.0,
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
            parts: vec![Part::free(0, BodyFrame::at([0.5, 0.0, 0.1])); 2],
            fixtures: vec![Fixture {
                frame: BodyFrame::at([0.4, 0.0, 0.0]),
                pieces,
                friction: 0.5,
                look,
                movable: None,
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
