//! Studies of the whole system: experiments, statistics, and the networks that speed is measured on.
//!
//! | room | what is in it |
//! |---|---|
//! | [`statistics`] | rates and means with their confidence intervals |
//! | [`experiment`] | the framework: trials in a journal, tables, figures |
//! | [`catalogue`] | the experiments by name |
//! | [`standard`] | the networks of `symbolt bench` |
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
