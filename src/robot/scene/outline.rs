//! The shapes of a scene as triangles, for pictures. They are the shapes that the physics uses.

use rapier3d::geometry::{SharedShape, TypedShape};
use rapier3d::math::{Pose as Frame, Vector};
use serde::Serialize;

use super::furnish::{fixture_shapes, table_shapes};
use super::shapes::{self, Piece};
use super::spec::{Fixture, Look, SceneSpec};
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
        let mut surfaces = vec![(Body::Table, table_shapes(&spec.table))];
        let (movable, still): (Vec<&Fixture>, Vec<_>) =
            spec.fixtures.iter().partition(|f| f.movable.is_some());
        let fixtures = still.iter().enumerate();
        surfaces.extend(fixtures.map(|(i, f)| (Body::Fixture(i), fixture_shapes(f).collect())));
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
