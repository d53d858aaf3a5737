//! The simulated robot: its arm, its scene in Rapier, and its skills.
//!
//! | module | contents |
//! |---|---|
//! | [`Pose`] | positions and orientations |
//! | [`SkillReport`] | how a skill ended |
//! | [`RobotError`] | errors of settings |
//! | `arm` | the arm and its gripper: kinematics, paths, bodies |
//! | `scene` | the Rapier scene that contains the parts and the robot |
//! | `skill` | pick, place and push: grasps, collision-free paths, the controller |
//!
//! Rapier is named in this module alone. It knows neither symbols nor tasks, neither learning nor planning. The feature
//! `physics` enables `arm`, `scene` and `skill`.

#[cfg(feature = "physics")]
pub mod arm;
mod error;
pub(crate) mod pose;
mod report;
#[cfg(feature = "physics")]
pub mod scene;
#[cfg(feature = "physics")]
pub mod skill;

pub use error::RobotError;
pub use pose::{Pose, mean_orientation, rotation_between};
pub(crate) use pose::{UP, quaternion_array};
pub use report::{SkillOutcome, SkillReport, Touch};
