//! Compilation: from a learned domain and the situation in a scene to what planners need.
//!
//! | to | use |
//! |---|---|
//! | set a goal in a scene | [`Problem`] |
//! | list the moves that are allowed now | [`Problem::moves`] |
//! | plan | [`Problem::plan`], the reference planner |
//! | plan with neurons | [`Problem::ground`], which returns a [`GroundProblem`] |
//! | find where a move puts its object | [`Problem::target`] |

mod assumed;
mod causes;
mod compiler;
mod counted;
mod exclusion;
mod facts;
mod ground;
mod moves;
mod problem;
mod reference_planner;
mod symbols;
mod target;
mod transition;
mod undecided;

#[cfg(feature = "physics")]
pub(crate) use assumed::{UNSEEN_M, is_loose};
pub(crate) use assumed::{assumed, lies_as_high};
pub use ground::GroundProblem;
pub use moves::Move;
pub use problem::{Problem, ProblemError};
pub(crate) use reference_planner::Key;
pub use reference_planner::PlannedMove;
pub use target::TargetPose;
