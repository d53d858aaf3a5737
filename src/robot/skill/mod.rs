//! Pick and place: takes one part and puts it at a target, or reports why that failed.
//!
//! A [`Robot`] runs one skill at a time. [`Robot::begin`] takes a part, a list of [`Grasp`]s and a
//! [`Target`] with its [`Facing`]. It searches for collision-free paths and refuses at once if there are none. Each
//! [`Robot::step`] then advances the skill and the physics by one step. In the last step, [`Stepped::ended`]
//! holds the [`SkillReport`](crate::robot::SkillReport).
//!
//! | phase | the robot | possible failures |
//! |---|---|---|
//! | reach | moves to 6 cm in front of the grasp | blocked |
//! | approach | moves straight to the grasp | blocked |
//! | close | closes the fingers until both pads press on the part | missed, after 0.7 s |
//! | lift | lifts the part by 10 cm, then measures how it lies in the hand | blocked; missed; unreachable, then it puts the part back |
//! | carry | moves to above the target | blocked; dropped |
//! | lower | measures the part again and moves straight down | blocked; dropped; unreachable; occupied, then it puts the part back |
//! | open | opens the fingers until they are free of the part, for 0.6 s at most | |
//! | retreat | moves back by 7 cm along the hand, or up by 10 cm after *blocked*, *dropped* and *timed out* | |
//! | settle | waits until all parts are at rest, for 2 s at most | |
//!
//! *Blocked* means that the arm hit something, *missed* that the part is not in the hand after closing or lifting,
//! *dropped* that it left the hand later, *occupied* that another part is at the target, and *unreachable* that there
//! is no path.
//!
//! A part on a [`Slider`](crate::robot::scene::Slider), such as a drawer, is not lifted: after closing the fingers, the
//! robot slides it straight along its guide to the target, and opens the hand.
//!
//! Every wait has a limit in simulated time, and a whole skill may last 60 s. After any failure the robot
//! opens the hand, raises it and settles. The [`SkillOutcome`](crate::robot::SkillOutcome) names the
//! failure.
//!
//! Parts come to rest on edge, upside down, leaning, close to the rim or to each other. For these, there are skills that
//! work from a part's shape alone:
//!
//! | function | returns |
//! |---|---|
//! | [`any_grasps`] | grasps for any pose, to be tried after the task's own |
//! | [`free_places`] | targets at which the part rests steadily and can be taken anew |
//! | [`pushes`] | pushes with the closed fingers for [`Robot::begin_push`], which tilt a part over or shove it to free room |
//!
//! A part that has fallen off the table ([`Scene::lost`](crate::robot::scene::Scene::lost)) is *unreachable* and has no
//! grasps, places or pushes.
//!
//! This module does not know the purpose of a part. A task gives the grasps and the target, and a kind's
//! [`Handling`](crate::robot::scene::Handling) lists the ways in which a part may stand at a target.

mod antipodal;
mod controller;
mod drive;
mod grasp;
mod hand;
mod limits;
mod picking;
mod push;
mod pushing;
mod reach;
mod resting;
mod solid;

pub use antipodal::{MOST_GRASPS, any_grasps};
pub use controller::{Robot, Stepped};
pub use grasp::{Facing, Grasp, Target};
pub use push::{MOST_PUSHES, Push, PushAim, pushes};
pub(crate) use resting::lowest;
pub use resting::{MOST_PLACES, free_places, turns_over};
