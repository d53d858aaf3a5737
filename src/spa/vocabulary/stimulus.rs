//! Stimuli that show expressions over a vocabulary at given times.

use super::Vocabulary;
use crate::sim::{Pointer, SimDuration, Stimulus, VocabTag};
use crate::spa::error::VocabError;

impl<V: VocabTag> Vocabulary<V> {
    /// Makes a stimulus that shows each expression from its time on, in simulated ms. `0` shows nothing, and nothing is
    /// shown before the first time.
    ///
    /// ```
    /// # use symbolt::prelude::*;
    /// symbolt::vocabulary!(Parts = "parts": NUT, JIG);
    ///
    /// let parts = Parts::vocabulary(64, Seed::new(1))?;
    /// let mut graph = GraphBuilder::new();
    /// let seen = graph.add("seen", parts.stimulus([(0, "NUT"), (50, "NUT * JIG"), (90, "0")])?);
    /// # Ok::<(), symbolt::spa::VocabError>(())
    /// ```
    ///
    /// # Errors
    /// As for [`Vocabulary::parse`]. Times that do not increase are a fault when the graph is built.
    pub fn stimulus<'e>(
        &self,
        shown: impl IntoIterator<Item = (u64, &'e str)>,
    ) -> Result<Stimulus<Pointer<V>>, VocabError> {
        let mut stimulus = Stimulus::pointer(self.space(), &self.zero());
        for (ms, text) in shown {
            stimulus = stimulus.from(SimDuration::from_millis(ms), &self.parse(text)?);
        }
        Ok(stimulus)
    }
}
