//! From demonstrations to plans: recordings, learning, domains, planner graphs.
//!
//! Nothing here knows the command line.

mod domain;
mod error;
pub mod kinematic;
pub mod learn;
mod pose;
mod recording;

pub use domain::{Domain, KindClusters, Operator, OperatorEvidence, Origin, Provenance, State};
pub use error::{InputFault, TaskError};
pub use pose::{Pose, mean_orientation, rotation_between};
pub use recording::{Demonstration, Event, Labels, ObjectPose, Recording, Snapshot};
