//! From demonstrations to plans: recordings, learning, domains, planner graphs.
//!
//! Nothing here knows the command line.

#[cfg(feature = "physics")]
mod demonstrate;
mod domain;
mod domain_file;
mod encode;
mod error;
#[cfg(feature = "physics")]
pub mod execute;
pub mod experiment;
mod files;
mod ground;
pub mod kinematic;
pub mod learn;
mod oracle;
pub mod planner;
mod pose;
mod recording;
#[cfg(feature = "physics")]
pub mod report;
#[cfg(feature = "physics")]
pub mod scene;
pub mod standard;
pub mod statistics;
mod symbolic;
#[cfg(feature = "physics")]
mod witness;

#[cfg(feature = "physics")]
pub use demonstrate::{Demonstrated, demonstrate};
pub use domain::{Domain, KindClusters, Operator, OperatorEvidence, Origin, Provenance, State};
pub use encode::{
    ABSENT, ActionSpace, Encoded, NOTHING, PRECONDITION, StateSpace, deep_preconditions,
};
pub use error::{InputFault, TaskError};
pub use files::{Overwrite, read_file, read_solved, write_whole};
pub use ground::{Classifier, FEW, Gate, Grounded, Grounding};
pub use oracle::{Commitment, Obstacle, Outlook, Rules, outlook};
pub use pose::{Pose, mean_orientation, rotation_between};
pub use recording::{Demonstration, Event, Labels, ObjectPose, Recording, Snapshot};
pub use symbolic::SymbolicDomain;
#[cfg(feature = "physics")]
pub use witness::{Assembly, Recorder};
