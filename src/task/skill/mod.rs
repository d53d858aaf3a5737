//! Pick and place, step by step of the physics, from a part, ways to take hold of it and a target to a definite end.
//!
//! Reach above the part, approach, close, lift, measure the part in the hand, carry, lower, let go, retreat, wait until
//! the parts are at rest. Every wait has a limit in simulated time, and a failure at any stage opens the hand, raises it
//! and ends with a [`SkillOutcome`](crate::task::event::SkillOutcome) that says what happened.
//!
//! What a part is for is not known here: a task gives [`Grasp`]s and a [`Target`], and a kind's
//! [`Handling`](crate::task::scene::Handling) says in how many ways it may stand there.

mod controller;
mod grasp;
mod reach;

pub use controller::{Robot, Stepped};
pub use grasp::{Grasp, Target};
