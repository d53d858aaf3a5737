//! The program: its commands, the folders that it writes, what it refuses, experiments, sweeps and reports.

// Tests may stop at the first surprise, and so may their helpers.
#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "cli")]

#[cfg(feature = "mcap")]
#[path = "../support/bags.rs"]
mod bags;
#[path = "../support/beside.rs"]
mod beside;
#[path = "../support/mutate.rs"]
mod mutate;
#[path = "../support/propositional.rs"]
mod propositional;
#[path = "../support/run.rs"]
mod run;
#[cfg(feature = "view")]
#[path = "../support/window.rs"]
mod window;

mod benches;
mod cli;
mod cli_folders;
mod cli_refusals;
mod experiments;
mod imports;
mod interventions;
mod messages;
mod plan_pddl;
mod relational_cli;
mod report;
mod sweeps;
#[cfg(feature = "view")]
mod view;
