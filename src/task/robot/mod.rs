//! The arm and its gripper: kinematics, paths of joint angles, bodies for the physics.
//!
//! Nothing here knows what the robot handles.

pub(crate) mod arm;
pub(crate) mod bodies;
pub(crate) mod frame;
pub(crate) mod path;
mod spec;
pub mod vector;

pub use arm::{forward_kinematics, inverse_kinematics, reaches_table};
pub use bodies::FINGER_TIP_M;
pub use frame::{BodyFrame, Turn};
pub use spec::{ArmSpec, GripperSpec};
