//! The vocabulary of an output by name, for observers without its type.

use std::sync::Arc;

use super::Content;
use crate::sim::{Graph, Real};
use crate::spa::error::VocabError;

/// The vocabulary whose pointers an output of a graph carries, found by the output's name.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::spa::OutputVocabulary;
///
/// symbolt::vocabulary!(Parts = "parts": NUT, BOLT);
/// let parts = Parts::vocabulary(64, Seed::new(1))?;
/// let mut graph = GraphBuilder::new();
/// graph.add("seen", parts.stimulus([(0, "NUT")])?);
/// let sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
/// let found = OutputVocabulary::of(sim.graph(), "seen.out").ok_or("no pointers")?;
/// assert_eq!(found.names(), ["NUT", "BOLT"]);
/// assert_eq!(found.parse("NUT * BOLT")?[..], parts.parse("NUT * BOLT")?[..]);
/// assert!(found.parse("SCREW").is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct OutputVocabulary {
    content: Arc<Content>,
    /// What messages call the vocabulary.
    label: Arc<str>,
}

impl OutputVocabulary {
    /// Returns the vocabulary of an output, named as in [`Graph::output`]. `None` if there is no such output, or if it carries
    /// no pointers of a vocabulary.
    pub fn of(graph: &Graph, output: &str) -> Option<Self> {
        let (node, output) = graph.find_output(output)?;
        let space = graph.nodes.get(node)?.ports.outputs.get(output)?.shape.space.as_ref()?;
        let content = space.attached::<Arc<Content>>()?.clone();
        Some(Self { content, label: space.to_string().into() })
    }

    /// Returns the names of its pointers, in the order in which they were added.
    pub fn names(&self) -> &[String] {
        self.content.names()
    }

    /// Evaluates an expression, as [`Vocabulary::parse`](super::Vocabulary::parse) does.
    ///
    /// # Errors
    /// As there.
    pub fn parse(&self, text: &str) -> Result<Vec<Real>, VocabError> {
        self.content.parse(&self.label, text)
    }
}
