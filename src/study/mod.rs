//! Studies of the whole: experiments, the networks that speed is measured on, and statistics.
//!
//! Nothing here knows pages or the command line.

pub mod catalogue;
pub mod experiment;
pub mod standard;
pub mod statistics;
#[cfg(feature = "physics")]
mod tally;

#[cfg(feature = "physics")]
pub use tally::Tally;
