//! Tests that need what not every machine has: the authors' recordings, or Chromium. Without it they count as ignored.

// Tests may stop at the first surprise, and so may their helpers.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::process::ExitCode;

use libtest_mimic::Arguments;

#[cfg(feature = "cli")]
#[path = "../support/chromium.rs"]
mod chromium;
#[cfg(feature = "view")]
#[path = "../support/devtools.rs"]
mod devtools;
#[cfg(feature = "view")]
#[path = "../../examples/live_view.rs"]
mod model;
#[path = "../support/needs.rs"]
mod needs;
#[path = "../support/propositional.rs"]
mod propositional;
#[cfg(feature = "cli")]
#[path = "../support/run.rs"]
mod run;

#[cfg(feature = "cli")]
mod browser;
#[cfg(feature = "cli")]
mod page;
mod recordings;
#[cfg(all(feature = "cli", feature = "view"))]
mod view;
#[cfg(feature = "view")]
#[path = "../support/window.rs"]
mod window;

fn main() -> ExitCode {
    let trials = recordings::trials();
    #[cfg(feature = "cli")]
    let trials = [trials, browser::trials(), page::trials()].into_iter().flatten().collect();
    #[cfg(all(feature = "cli", feature = "view"))]
    let trials = [trials, view::trials()].into_iter().flatten().collect();
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}
