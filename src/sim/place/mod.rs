//! Decides who steps which part of a graph: threads and ranks.

#[cfg(any(feature = "mpi", test))]
pub(super) mod ends;
pub(super) mod messages;
#[cfg(feature = "mpi")]
pub(super) mod mpi;
pub(super) mod ranks;
pub(super) mod team;
pub(super) mod threads;
