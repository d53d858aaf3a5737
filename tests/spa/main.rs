//! Semantic pointers: laws, vocabularies, expressions, modules, memory and capacity.

// Tests may stop at the first surprise, and so may their helpers.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod agreement;
mod capacity;
mod choices;
mod expressions;
mod families;
mod flows;
mod item_memories;
mod laws;
mod modules;
mod pair_networks;
mod peers;
mod predictions;
mod reference_models;
mod resonators;
mod retrieval;
mod tape;
mod turned_ensembles;
mod vocabularies;
