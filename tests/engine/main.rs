//! The engine and its neurons: wiring, ticks, probes, bits, threads and ranks, models, solved populations; and files.

// Tests may stop at the first surprise, and so may their helpers.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../support/alike.rs"]
mod alike;
#[path = "../support/counter.rs"]
mod counter;
#[path = "../support/rectified.rs"]
mod rectified;
#[path = "../support/things.rs"]
mod things;
#[path = "../support/touched.rs"]
mod touched;

mod basics;
mod broken;
mod determinism;
mod engine;
mod ensembles;
mod extremes;
mod files;
mod interventions;
mod learning;
mod learning_conformance;
mod live;
mod models;
mod neuron_ports;
mod npz;
mod parallel;
mod peers;
mod populations;
mod probes;
mod processes;
mod saturation;
mod seeds_and_time;
mod solved;
mod solvers;
mod synapses;
mod wiring;
