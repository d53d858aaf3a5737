//! Solving decoders: regularised least squares on dense matrices.

mod dense;
mod least_squares;

pub(crate) use least_squares::{Points, solve};
