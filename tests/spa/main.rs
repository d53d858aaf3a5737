//! Semantic pointers: laws, vocabularies, expressions, modules, memory and capacity.

mod capacity;
mod expressions;
mod laws;
mod modules;
mod retrieval;
mod tape;
mod vocabularies;
