//! A small vocabulary, and plans that put everything into neurons.

use symbolt::neurons::{LifSpec, Population, PopulationPlan};
use symbolt::sim::{Seed, VocabTag};
use symbolt::spa::{Vocabulary, VocabularyBuilder};

/// The tag of the vocabulary.
pub struct Things;
impl VocabTag for Things {
    const NAME: &'static str = "things";
}

/// Three pointers: A, B and C.
pub fn vocabulary(dim: usize) -> Vocabulary<Things> {
    VocabularyBuilder::new(dim, Seed::new(1)).pointers(["A", "B", "C"]).build().expect("room")
}

/// Spiking neurons everywhere.
pub fn lif() -> PopulationPlan {
    PopulationPlan::all(Population::Lif(LifSpec::default()))
}

/// Rate neurons everywhere.
pub fn rate() -> PopulationPlan {
    PopulationPlan::all(Population::Rate(LifSpec::default()))
}
