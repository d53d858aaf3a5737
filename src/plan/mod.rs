//! Planning problems and planners that know nothing of objects, poses or robots.

pub mod goal_sets;
pub mod model;
pub mod strips;
