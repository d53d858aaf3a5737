//! Studies of the whole system: experiments, their statistics, and the networks of `symbolt bench`.
//!
//! | module | contents |
//! |---|---|
//! | [`statistics`] | rates and means with their 95% intervals |
//! | [`experiment`] | the framework: trials in a journal, tables, figures |
//! | [`asking`] | the further demonstration that would decide most about a learned domain |
//! | [`catalogue`] | the experiments by name |
//! | [`problems`] | planning problems with known shortest plans |
//! | [`retrieval`] | objects and actions by two conditions: worlds, exact methods, closed forms, networks |
//! | [`standard`] | the networks on which speed is measured |
//! | [`tape`] | plans on a tape and on a shift stack |
//! | [`stack_planner`] | the spiking planner of 2016, rebuilt to be compared with |
//! | [`worlds`] | kinematic tasks with known truth, for scoring learners |

pub mod asking;
pub mod catalogue;
pub mod experiment;
pub mod problems;
pub mod retrieval;
pub mod stack_planner;
pub mod standard;
pub mod statistics;
#[cfg(feature = "physics")]
mod tally;
pub mod tape;
pub mod worlds;

#[cfg(feature = "physics")]
pub use tally::Tally;
