//! From demonstrations to plans to a robot that carries them out.
//!
//! The rooms, bottom up. Each knows only those before it, and `.ci/arrows` checks it:
//!
//! | room | what is in it |
//! |---|---|
//! | [`domain`] | states, operators, recordings, grounding, and the symbolic reference planner |
//! | [`event`] | what happens while something runs, and who listens |
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
pub mod event;
#[cfg(feature = "physics")]
pub mod execute;
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
    AcceptableAnswers, ActionId, Classifier, Commitment, Demonstration, Domain, DomainBuilder,
    Evidence, GaussianGate, Grounded, Grounding, KindClusters, Labels, LearnedState, MIN_DISTINCT,
    ObjectPose, Obstacle, Operator, Origin, Parameter, Pose, Provenance, Recording, Rules,
    Snapshot, SnapshotEvent, State, StateId, Verdict, WorldState, acceptable_answers,
    mean_orientation, rotation_between,
};
pub use error::{InputFault, TaskError};
#[cfg(feature = "physics")]
pub use execute::{Demonstrated, Recorder, demonstrate};
pub use planner::{
    ABSENT, ActionSpace, Encoded, NOTHING, PRECONDITION, StateSpace, deep_preconditions,
};
