//! What a robot tells and is told: poses, the report of a skill, and errors of settings. It knows neither learning nor
//! symbols.
//!
//! The arm, the scene and the skills, which need the feature `physics`, are in [`task::robot`](self::arm),
//! [`task::scene`](self::scene) and [`task::skill`](self::skill).

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
#[cfg(feature = "physics")]
pub(crate) use error::in_range;
pub use pose::{Pose, mean_orientation, rotation_between};
pub use report::{SkillOutcome, SkillReport, Touch};
