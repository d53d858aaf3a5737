//! From demonstrations to plans to a robot that carries them out.
//!
//! The rooms, bottom up. Each knows only those before it, and `.ci/arrows` checks it:
//!
//! | room | what is in it |
//! |---|---|
//! | [`domain`] | states, operators, recordings, grounding, and the symbolic reference planner |
//! | [`learn`] | from recordings to a domain |
//! | [`planner`] | the planner graph over a domain |
//! | [`robot`] | the arm: kinematics, paths, bodies |
//! | [`scene`] | bodies in Rapier, with the robot among them |
//! | [`skill`] | pick and place: grasps, ways without collisions, the controller |
//! | [`tasks`] | what is true of one task alone: its parts, grasps, demonstrator and judge |
//! | [`execute`] | demonstrations and the closed loop |
//!
//! `robot`, `scene` and `skill` know of the others only poses and recordings. Nothing here knows experiments, pages or the command line.

pub mod domain;
mod error;
#[cfg(feature = "physics")]
pub mod execute;
mod files;
pub mod learn;
pub mod planner;
#[cfg(feature = "physics")]
pub mod robot;
#[cfg(feature = "physics")]
pub mod scene;
#[cfg(feature = "physics")]
pub mod skill;
pub mod tasks;

pub use domain::{
    Classifier, Commitment, Demonstration, Domain, Event, FEW, Gate, Grounded, Grounding,
    KindClusters, Labels, ObjectPose, Obstacle, Operator, OperatorEvidence, Origin, Outlook, Pose,
    Provenance, Recording, Rules, Snapshot, State, SymbolicDomain, mean_orientation, outlook,
    rotation_between,
};
pub use error::{InputFault, TaskError};
#[cfg(feature = "physics")]
pub use execute::{Demonstrated, Recorder, demonstrate};
pub use files::{Overwrite, read_file, read_solved, write_whole};
pub use planner::{
    ABSENT, ActionSpace, Encoded, NOTHING, PRECONDITION, StateSpace, deep_preconditions,
};
