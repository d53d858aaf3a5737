//! Live runs in windows: the same bits watched or not, back and forth, changed by hand; and what is refused.

// Tests may stop at the first surprise, and so may their helpers.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod colours;
#[path = "../../examples/live_view.rs"]
mod model;
mod names;
mod refusals;
mod sessions;
#[path = "../support/window.rs"]
mod window;
