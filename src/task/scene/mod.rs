//! The assembly scene in Rapier: table, jig, parts, an arm with a gripper, and its skills.
//!
//! Nothing here knows the task: neither what states there are nor what should be done.

mod arm;
mod bodies;
mod config;
mod drops;
mod grasp;
mod outline;
mod path;
mod physics;
mod reach;
mod shapes;
mod skill;

pub use arm::{forward_kinematics, inverse_kinematics};
pub use config::{ArmSpec, GripperSpec, JigSpec, MOST_PARTS, PartSpec, SceneSpec, TableSpec};
pub use grasp::Target;
pub use outline::{Body, Mesh, Outline};
pub use physics::{PartKind, Scene, SceneFrame};
pub use skill::{Outcome, Robot, SkillReport, Stepped, Touch};
