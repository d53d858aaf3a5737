//! The program: its commands, the folders that it writes, what it refuses, experiments, sweeps and reports.

#![cfg(feature = "cli")]

#[path = "../support/beside.rs"]
mod beside;
#[path = "../support/propositional.rs"]
mod propositional;
#[path = "../support/run.rs"]
mod run;

mod cli;
mod cli_folders;
mod cli_refusals;
mod experiments;
mod relational_cli;
mod report;
mod sweeps;
