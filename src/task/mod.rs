//! Learns tasks from demonstrations, plans them with a neural planner and executes them with a simulated robot.
//!
//! A program usually goes through four steps:
//!
//! 1. **Get a recording.** [`Recording::read`] reads one from a file. [`demonstrate`] records scripted demonstrations
//!    in the Rapier scene.
//! 2. **Learn a domain.** [`learn::learn`] infers states in the frames of objects and operators with parameters, and returns
//!    a [`domain::RelationalDomain`]. The method of the paper is one of its settings.
//! 3. **Plan.** A [`classify::Classifier`] finds the state and the reference of each object in a scene, given as a
//!    [`Snapshot`]. [`planner::PlannerBuild::plan`] plans from there, and returns moves with target poses.
//! 4. **Execute.** [`execute::episode`] runs the closed loop in the scene: look, decide, act, repeat.
//!
//! For planning without geometry, write a [`Domain`] in code with [`DomainBuilder`] and give it to a [`planner::Planner`].
//!
//! *The paper* is X. Yao, P. Blouw, S. Nair and B. Tripp, "Inferring symbols from demonstrations to support
//! vector-symbolic planning in a robotic assembly task".
//!
//! # Submodules
//!
//! | submodule | contents |
//! |---|---|
//! | [`recording`] | recordings of demonstrations, scenes, errors of sensing |
//! | [`propositional`] | states and actions by name, which planners run on; the symbolic reference planner |
//! | [`domain`] | learned domains: states in frames, operators with parameters, goals; their files |
//! | [`classify`] | finds the state of each object in a scene |
//! | [`compile`] | a learned domain in a scene, with a goal, for planners |
//! | [`import`] | recordings from logs of poses |
//! | [`pddl`] | writes learned domains, with a situation and a goal, as PDDL |
//! | [`event`] | progress events and observers |
//! | [`learn`] | learning a domain from a recording |
//! | [`planner`] | the planner graph over a domain |
//! | [`tasks`] | everything specific to one task: its parts, grasps, demonstrator and judge |
//! | [`execute`] | recording demonstrations and running episodes |
//!
//! The `physics` feature enables `execute`.
//!
//! A submodule depends only on submodules above it in the table. Planners over problems are in [`plan`](crate::plan),
//! the robot in [`robot`](crate::robot). Experiments, reports and the command line are outside `task`.

pub mod classify;
pub mod compile;
pub mod domain;
mod error;
pub mod event;
#[cfg(feature = "physics")]
pub mod execute;
pub mod import;
pub mod learn;
pub mod pddl;
pub mod planner;
pub mod propositional;
pub mod recording;
pub mod tasks;

pub use classify::Offset;
pub use domain::Origin;
pub use error::{InputFault, TaskError};
#[cfg(feature = "physics")]
pub use execute::{Demonstrated, Recorder, demonstrate};
pub use planner::{
    ABSENT, ActionSpace, Encoded, NOTHING, PRECONDITION, StateSpace, deep_preconditions,
};
pub use propositional::{
    AcceptableAnswers, ActionId, Commitment, Composition, Domain, DomainBuilder, Factor, Obstacle,
    Operator, Part, Rules, State, StateId, Verdict, WorldState, acceptable_answers,
};
pub use recording::{
    Attribute, Attributes, Demonstration, Labels, ObjectAttributes, ObjectPose, Recording, Sensing,
    Snapshot, SnapshotEvent,
};
