//! The engine and its neurons: wiring, ticks, probes, bits, threads and ranks, solved populations.

#[path = "../support/counter.rs"]
mod counter;
#[path = "../support/rectified.rs"]
mod rectified;
#[path = "../support/things.rs"]
mod things;

mod determinism;
mod engine;
mod parallel;
mod populations;
mod probes;
mod solved;
mod wiring;
