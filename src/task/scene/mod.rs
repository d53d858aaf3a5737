//! The assembly scene in Rapier: table, jig, parts, and the robot among them.
//!
//! Nothing here knows the task: neither what states there are nor what should be done.

pub(crate) mod config;
mod drops;
mod outline;
pub(crate) mod physics;
pub(crate) mod shapes;

pub use config::{JigSpec, MOST_PARTS, PartSpec, SceneSpec, TableSpec};
pub use outline::{Body, Mesh, Outline};
pub use physics::{PartKind, Scene};
