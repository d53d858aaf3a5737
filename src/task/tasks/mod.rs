//! Tasks: what is true of one task alone, each in a folder of its own.

pub mod nuts_and_bolts;
