//! Retrieval by several conditions from a large memory: objects by place and goal, then actions by object and effect.
//!
//! The task is that of Blouw, Eliasmith and Tripp, "A scaleable spiking neural model of action planning" (2016): objects
//! have places and serve goals, and a planner asks which objects are at a place and serve a goal, and which actions
//! with such an object have an effect. They did it in exact arithmetic, by one threshold on the similarity to the sum
//! of both conditions. [`exact`] has their method and others, [`predicted`] closed forms, and [`Network`] the retrieval
//! in spikes.

mod exact;
mod network;
mod prediction;
mod symbols;
mod world;

pub use exact::{Method, exact};
pub use network::{Network, NetworkSpec, Reach};
pub use prediction::{Predicted, predicted};
pub use symbols::{Actions, Retrieved, Roles, Symbols};
pub use world::{Query, World, WorldSpec};

/// Items that were found, that should have been, and both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Count {
    /// Number of matches that were found.
    pub hits: u64,
    /// Number of items that were found.
    pub found: u64,
    /// Number of matches: items that should have been found.
    pub matches: u64,
}

impl Count {
    /// Adds the answer to a query. Both lists are sorted.
    pub fn add(&mut self, found: &[usize], matches: &[usize]) {
        self.found += found.len() as u64;
        self.matches += matches.len() as u64;
        self.hits += found.iter().filter(|item| matches.binary_search(item).is_ok()).count() as u64;
    }

    /// Returns the share of found items that are matches; 1 if nothing was found.
    pub fn precision(&self) -> f64 {
        if self.found == 0 { 1.0 } else { self.hits as f64 / self.found as f64 }
    }

    /// Returns the share of matches that were found; 1 if there are none.
    pub fn recall(&self) -> f64 {
        if self.matches == 0 { 1.0 } else { self.hits as f64 / self.matches as f64 }
    }
}

/// Results of retrieval over many queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Score {
    /// Objects by place and goal.
    pub objects: Count,
    /// Actions by object and effect, asked with the objects that were found.
    pub actions: Count,
}
