//! The scene in Rapier: a table, fixtures, parts, and the robot among them.
//!
//! Nothing here knows a task: neither what the bodies are for nor what should be done with them. A task says so in
//! a [`SceneSpec`].

mod outline;
pub(crate) mod physics;
mod shapes;
mod spec;

pub use outline::{Body, KindOutline, Mesh, Outline};
pub use physics::Scene;
pub use spec::{
    BodyKind, Fixture, Handling, Landmark, Look, MAX_PARTS, Part, Piece, SceneSpec, Symmetry,
    TableSpec, cuboid,
};
