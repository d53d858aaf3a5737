//! Learned domains: states in the frames of objects, operators with parameters, and goals with quantifiers.
//!
//! A [propositional domain](super::Domain) says only which states hold. A [`RelationalDomain`] says which object is in a
//! state, and relative to which other object. It can therefore express "a knife beside every plate", "in the drawer" and
//! "on the red block", wherever these objects stand.
//!
//! | to | use |
//! |---|---|
//! | learn one from a recording | [`learn`](super::learn::learn) |
//! | read and write one | [`RelationalDomain::read`], [`RelationalDomain::to_json`] |
//! | find the state and the reference of each object in a scene | [`Classifier`](super::classify::Classifier) |
//! | plan with one | [`Problem`](super::compile::Problem) |
//!
//! # Terms
//!
//! * A **state** is a condition of one object of one kind: it lies at one of the state's **places**, given in the
//!   state's **frame**. The frame is the world, or an object of some kind, the **reference**.
//! * The **turn** of a state says how the orientation is constrained: free, about one axis, or fully.
//! * An **operator** describes an action that moves one object. Its parameters are the **object**, its **origin** (the
//!   reference of the state that it leaves) and its **target** (the reference of the state that it enters).
//! * A **need** is a condition before the action. It is *required*, *undecided* or *absent*. Each need carries the
//!   counts behind it.
//! * A **goal** is a conjunction of terms in the order in which they were completed.

use std::collections::BTreeMap;

mod check;
mod condition;
pub(crate) mod distance;
mod file;
mod frame;
pub(crate) mod gaussian;
mod goal;
pub(crate) mod naming;
mod operator;
mod provenance;
mod situation;
mod state;
mod sub_kinds;

pub use condition::{Condition, Role, Subject};
pub(crate) use condition::{Counted, Parameters};
pub use frame::Frame;
pub(crate) use frame::{levelled, relative, world_pose};
pub use goal::{GoalTerm, Quantity};
pub use operator::{Before, Displacement, Need, NeedVerdict, RelationalOperator, SideEffect};
pub use provenance::{KindClusters, Provenance};
pub(crate) use situation::is_within;
pub use situation::{Fact, Situation};
pub(crate) use state::ROOMY_M;
pub use state::{Coordinate, FrameState, Origin, Place, Turn};
pub use sub_kinds::{SubKind, SubKinds, Undivided};

/// A learned domain with states in frames, operators with parameters, and a goal.
#[derive(Debug, Clone, PartialEq)]
pub struct RelationalDomain {
    /// The states.
    pub states: Vec<FrameState>,
    /// The operators. Their states are indices into `states`.
    pub operators: Vec<RelationalOperator>,
    /// The terms of the goal, in the order in which they were completed.
    pub goals: Vec<GoalTerm>,
    /// Standard deviation of the recorded positions of objects at rest, in metres.
    pub noise_m: f64,
    /// Standard deviation of the recorded orientations of objects at rest, in radians about each axis.
    pub noise_rad: f64,
    /// Kinds of fixtures that stood level in every demonstration, each with the side that was up, as a unit vector in the frame of
    /// its objects. A tilt that noise explains is left out of their poses.
    pub level: BTreeMap<String, [f64; 3]>,
    /// How the domain was learned.
    pub provenance: Provenance,
    /// Kinds that are divided by an attribute. States have the names of their parts as kinds.
    pub sub_kinds: Vec<SubKinds>,
    /// Sentences of states and actions by their symbols, such as `a drawer is open` for `DRAWER_OPEN`. A missing one is made
    /// anew from what is known of the state.
    pub words: BTreeMap<String, String>,
}
