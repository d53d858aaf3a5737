//! The robot: an arm with seven joints and a gripper with two fingers.
//!
//! | to | use |
//! |---|---|
//! | compute the pose of the end effector | [`forward_kinematics`] |
//! | find joint angles for a pose of the end effector | [`inverse_kinematics`], [`reaches_table`] |
//! | set motors, speeds and forces | [`ArmSpec`], [`GripperSpec`] |
//! | compute a task's geometry with the bits of the physics | [`Turn`], [`BodyFrame`], [`vector`] |
//!
//! This module also holds paths of joint angles, which run from rest to rest, and the robot's bodies for the physics.
//! [`skill`](crate::robot::skill) plans with the paths, and [`scene`](crate::robot::scene) holds the bodies.
//!
//! The end effector's frame has its origin at the tool centre point, between the fingers. Its z axis points in the
//! direction of the hand; the fingers close along its y axis. The arm's base is the origin of the scene.
//!
//! This module does not depend on what the robot handles.

pub(crate) mod bodies;
pub(crate) mod frame;
pub(crate) mod kinematics;
pub(crate) mod level;
pub(crate) mod path;
mod spec;
pub mod vector;

pub use bodies::FINGER_TIP_M;
pub use frame::{BodyFrame, Turn};
pub use kinematics::{forward_kinematics, inverse_kinematics, reaches_table};
pub use spec::{ArmSpec, GripperSpec};
