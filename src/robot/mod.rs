//! What a robot tells and is told: poses, the report of a skill, and errors of settings. It knows neither learning nor
//! symbols.
//!
//! The arm, the scene and the skills, which need the feature `physics`, are in [`task::robot`](crate::task::robot),
//! [`task::scene`](crate::task::scene) and [`task::skill`](crate::task::skill).

mod error;
pub(crate) mod pose;
mod report;

pub use error::RobotError;
#[cfg(feature = "physics")]
pub(crate) use error::in_range;
pub use pose::{Pose, mean_orientation, rotation_between};
pub use report::{SkillOutcome, SkillReport, Touch};
