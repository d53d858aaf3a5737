//! A bolt through a nut: both are put into a jig, then the bolt through the nut.

pub mod synthetic;

pub use synthetic::{Order, SyntheticDemonstrations, SyntheticRecording};
