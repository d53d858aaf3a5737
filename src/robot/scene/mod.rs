//! The scene: a table, fixtures, movable parts and the robot, simulated by Rapier.
//!
//! | to | use |
//! |---|---|
//! | describe a scene | [`SceneSpec`], with its [`BodyKind`]s, [`Part`]s, [`Fixture`]s and [`Landmark`]s |
//! | build it and step it | [`Scene`] |
//! | compute grasps and paths in it | [`Sensed`], the scene as a robot with a [`Percept`] senses it |
//! | draw it | [`Outline`] for the shapes, [`Scene::frame`] for their poses |
//!
//! A task draws a [`SceneSpec`] from a seed. [`Scene::new`] builds the bodies, drops the parts and lets them
//! settle. The [`Robot`](crate::robot::skill::Robot) then drives arm and fingers and steps the scene. Friction
//! and contact alone hold a part in the hand.
//!
//! A part with a [`Slider`] moves along a straight guide, like a drawer. Another hand can move parts and movable
//! fixtures ([`Scene::displace`]); [`Landmark`]s that are attached to a body move with it. A part that falls off the
//! table is lost ([`Scene::lost`]).
//!
//! This module knows no task: neither the purpose of the bodies nor what the robot should do with them.

pub(crate) mod extent;
mod frame;
mod furnish;
mod lost;
mod moving;
mod outline;
pub(crate) mod physics;
#[cfg(test)]
mod rest;
mod sensed;
mod shapes;
mod spec;

pub use frame::SceneFrame;
pub use outline::{Body, KindOutline, Mesh, Outline};
pub use physics::{PAYLOAD_N, Scene};
pub use sensed::{Percept, Sensed};
pub use shapes::{Piece, cuboid};
pub use spec::{
    BodyId, BodyKind, Fixture, Handling, Landmark, Look, MAX_PARTS, Part, SceneSpec, Slider,
    Symmetry, TableSpec,
};
