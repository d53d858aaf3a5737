//! What the README, the guides, the examples and the list of mistakes say, against what the program does.

// Tests may stop at the first surprise, and so may their helpers.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod docs;
mod examples;
mod front_door;
mod guides;
mod keys;
mod mistakes;
mod models;
