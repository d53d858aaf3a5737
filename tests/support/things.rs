//! A small vocabulary, and plans that compute every layer in neurons.

use symbolt::neurons::PopulationPlan;
use symbolt::sim::{Seed, VocabTag};
use symbolt::spa::{Vocabulary, VocabularyBuilder};

/// Tag of the vocabulary.
pub struct Things;
impl VocabTag for Things {
    const NAME: &'static str = "things";
}

/// Returns a vocabulary of three pointers: A, B and C.
pub fn vocabulary(dim: usize) -> Vocabulary<Things> {
    VocabularyBuilder::new(dim, Seed::new(1)).pointers(["A", "B", "C"]).build().expect("room")
}

/// Returns a plan with spiking neurons in every layer.
pub fn lif() -> PopulationPlan {
    PopulationPlan::lif()
}

/// Returns a plan with rate neurons in every layer.
pub fn rate() -> PopulationPlan {
    PopulationPlan::rate()
}
