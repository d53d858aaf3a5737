//! Planning problems and planners that know nothing of objects, poses or robots.
//!
//! | module | contents |
//! |---|---|
//! | [`strips`] | PDDL: problems, grounding, validation of plans; trajectories |
//! | [`model`] | action models learned from trajectories |
//! | [`goal_sets`] | the planner of goal sets, made of neurons alone, over grounded problems |

pub mod goal_sets;
pub mod model;
pub mod strips;
